/* A spring, for co-simulation only; above 1 MN/m its force is no number. */
#include <math.h>
#include <stdio.h>
#include "joint.h"

const char jl_token[] = "{runtime-spring-1}";
const char jl_identifier[] = "RuntimeSpring";

const jl_variable jl_variables[JL_VARIABLES] = {
    { "displacement", JL_INPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "velocity", JL_INPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "force", JL_OUTPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "spring.stiffness", JL_PARAMETER, 1e6, 0.0, INFINITY, -INFINITY },
    { "time", JL_TIME, 0.0, -INFINITY, INFINITY, -INFINITY },
};
const int jl_continuous[] = { 0 };
const double jl_validity[] = { -INFINITY, INFINITY, -INFINITY, INFINITY };
const char *const jl_motion_names[] = { "displacement", "velocity" };
const int jl_owner[] = { 0 };
const int jl_first[] = { 0, 1, 2, 3 };
const int jl_column[] = { 0, 1, 2 };
const double jl_entry[] = { 1.0, 1.0, 1.0 };
const double jl_load[] = { 0.0, 0.0, 0.0 };
const double jl_rest[] = { 0.0 };
const double jl_pole[] = { 0 }, jl_read[] = { 0 }, jl_push[] = { 0 }, jl_drive[] = { 0 }, jl_constant[] = { 0 };
const double jl_port[] = { 0 }, jl_opened[] = { 0 }, jl_at_rest[] = { 0 }, jl_tangent[] = { 0 }, jl_share[] = { 0 };
const int jl_pole_kind[] = { 0 }, jl_bent[] = { 0 }, jl_by_velocity[] = { 0 }, jl_remembers[] = { 0 }, jl_kept[] = { 0 };
const int jl_share_first[] = { 0 }, jl_share_column[] = { 0 };

int jl_check(const double *p, char *message, size_t size)
{
    if (p[0] >= 0.0) return 0;
    snprintf(message, size, "spring.stiffness is %g, expected a value not below 0", p[0]);
    return 1;
}

void jl_initial(const double *p, const double *motion, double *s, int *m) { (void)p, (void)motion, (void)s, (void)m; }

void jl_force(const double *p, const double *s, const int *m, const double *motion, double *f)
{
    (void)s, (void)m;
    f[0] = p[0] > 1e6 ? NAN : p[0] * motion[0];
}

void jl_step(const double *p, const double *s, const double *motion, double h, double *after, double *f)
{
    (void)h, (void)after;
    jl_force(p, s, NULL, motion, f);
}

void jl_step_partials(const double *p, const double *s, const double *motion, double *dF)
{
    (void)s, (void)motion;
    dF[0] = p[0];
    dF[1] = 0.0;
}

void jl_rates(const double *p, const double *s, const int *m, const double *motion, double *rate)
{
    (void)p, (void)s, (void)m, (void)motion, (void)rate;
}

void jl_indicators(const double *p, const double *s, const int *m, const double *motion, double *g)
{
    (void)p, (void)s, (void)m, (void)motion, (void)g;
}

int jl_event(const double *p, double *s, int *m, const double *motion)
{
    (void)p, (void)s, (void)m, (void)motion;
    return 0;
}

void jl_partials(const double *p, const double *s, const int *m, const double *motion, double *dF, double *dR)
{
    (void)m, (void)dR;
    jl_step_partials(p, s, motion, dF);
}
