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
const double jl_validity[4] = { -INFINITY, INFINITY, -INFINITY, INFINITY };

int jl_check(const double *p, char *message, size_t size)
{
    if (p[0] >= 0.0) return 0;
    snprintf(message, size, "spring.stiffness is %g, expected a value not below 0", p[0]);
    return 1;
}

void jl_initial(const double *p, double z, double *s, int *m) { (void)p, (void)z, (void)s, (void)m; }

double jl_force(const double *p, const double *s, const int *m, double z, double v)
{
    (void)s, (void)m, (void)v;
    return p[0] > 1e6 ? NAN : p[0] * z;
}

double jl_step(const double *p, const double *s, double z, double v, double h, double *after)
{
    (void)h, (void)after;
    return jl_force(p, s, NULL, z, v);
}

void jl_step_partials(const double *p, const double *s, double z, double v, double *dF)
{
    (void)s, (void)z, (void)v;
    dF[0] = p[0];
    dF[1] = 0.0;
}

void jl_rates(const double *p, const double *s, const int *m, double z, double v, double *rate)
{
    (void)p, (void)s, (void)m, (void)z, (void)v, (void)rate;
}

void jl_indicators(const double *p, const double *s, const int *m, double z, double v, double *g)
{
    (void)p, (void)s, (void)m, (void)z, (void)v, (void)g;
}

int jl_event(const double *p, double *s, int *m, double z, double v)
{
    (void)p, (void)s, (void)m, (void)z, (void)v;
    return 0;
}

void jl_partials(const double *p, const double *s, const int *m, double z, double v, double *dF, double *dR)
{
    (void)m, (void)dR;
    jl_step_partials(p, s, z, v, dF);
}
