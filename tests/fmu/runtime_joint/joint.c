/* Spring, damper, Jenkins slider and end stop, written by hand: the smallest joint with everything.
 * p: spring stiffness and damping, slider stiffness and slip force, stop stiffness and gap, cubic stiffness.
 * m[0]: the slider sticks (0) or slips forwards (1) or backwards (-1); m[1]: the stop is closed. */
#include <math.h>
#include <stdio.h>
#include "joint.h"

const char jl_token[] = "{runtime-joint-1}";
const char jl_identifier[] = "RuntimeJoint";

const jl_variable jl_variables[JL_VARIABLES] = {
    { "displacement", JL_INPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "velocity", JL_INPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "force", JL_OUTPUT, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "spring.stiffness", JL_PARAMETER, 1e6, 0.0, INFINITY, -INFINITY },
    { "damper.damping", JL_PARAMETER, 100.0, 0.0, INFINITY, -INFINITY },
    { "slider.stiffness", JL_PARAMETER, 2e6, 0.0, INFINITY, 0.0 },
    { "slider.slip_force", JL_PARAMETER, 20.0, 0.0, INFINITY, -INFINITY },
    { "stop.stiffness", JL_PARAMETER, 1e7, 0.0, INFINITY, -INFINITY },
    { "stop.gap", JL_PARAMETER, 5e-5, 0.0, INFINITY, 0.0 },
    { "spring.cubic", JL_PARAMETER, 1e14, 0.0, INFINITY, -INFINITY },
    { "slider.position", JL_STATE, 1e-5, -INFINITY, INFINITY, -INFINITY },
    { "der(slider.position)", JL_RATE, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "slider.slip", JL_INDICATOR, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "stop.contact", JL_INDICATOR, 0.0, -INFINITY, INFINITY, -INFINITY },
    { "time", JL_TIME, 0.0, -INFINITY, INFINITY, -INFINITY },
};
const int jl_continuous[] = { 0 };
const double jl_validity[] = { -1e-4, 1e-4, -0.1, 0.1 };
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
    int i;
    for (i = 0; i < JL_PARAMETERS; i++) {
        const jl_variable *d = &jl_variables[JL_FIRST_PARAMETER + i];
        if (p[i] >= d->lower && p[i] > d->above) continue;
        snprintf(message, size, "%s is %.15g, expected a value above %.15g", d->name, p[i], fmax(d->above, d->lower));
        return 1;
    }
    if (p[0] > 1e300) {
        snprintf(message, size, "100%% of %%s and %%n must reach the host as it stands");
        return 1;
    }
    return 0;
}

void jl_initial(const double *p, const double *motion, double *s, int *m)
{
    const double z = motion[0];
    s[0] = z;
    m[0] = 0;
    m[1] = z > p[5];
}

static double spring(const double *p, double z, double v) { return p[0] * z + p[1] * v + p[6] * z * z * z; }

void jl_step(const double *p, const double *s, const double *motion, double h, double *after, double *f)
{
    const double z = motion[0], v = motion[1];
    const double reach = p[3] / p[2], stretch = fmin(fmax(z - s[0], -reach), reach);
    (void)h;
    after[0] = z - stretch;
    f[0] = spring(p, z, v) + p[2] * stretch + p[4] * fmax(z - p[5], 0.0);
}

void jl_step_partials(const double *p, const double *s, const double *motion, double *dF)
{
    const double z = motion[0];
    dF[0] = p[0] + 3.0 * p[6] * z * z + (fabs(z - s[0]) < p[3] / p[2] ? p[2] : 0.0) + (z > p[5] ? p[4] : 0.0);
    dF[1] = p[1];
}

void jl_force(const double *p, const double *s, const int *m, const double *motion, double *f)
{
    const double z = motion[0], v = motion[1];
    f[0] = spring(p, z, v) + p[2] * (z - s[0]) + (m[1] ? p[4] * (z - p[5]) : 0.0);
}

void jl_rates(const double *p, const double *s, const int *m, const double *motion, double *rate)
{
    const double v = motion[1];
    (void)p, (void)s;
    rate[0] = m[0] ? v : 0.0;
}

void jl_indicators(const double *p, const double *s, const int *m, const double *motion, double *g)
{
    const double z = motion[0], v = motion[1];
    const double reach = p[3] / p[2];
    g[0] = m[0] ? m[0] * v / 1e-3 + 1e-6 : 1.0 + 1e-6 - fabs(z - s[0]) / reach;
    g[1] = (z - p[5]) / p[5] - (m[1] ? -1e-6 : 1e-6);
}

int jl_event(const double *p, double *s, int *m, const double *motion)
{
    const double z = motion[0];
    double g[2];
    jl_indicators(p, s, m, motion, g);
    if (g[0] <= 0.0) {
        m[0] = m[0] ? 0 : (z > s[0] ? 1 : -1);
        if (m[0]) s[0] = z - m[0] * p[3] / p[2]; /* where it began to slip, between two steps of the solver */
    }
    if (m[1] ? g[1] < 0.0 : g[1] > 0.0) m[1] = !m[1];
    return 1; /* too much said: a jump is what moved a continuous state */
}

void jl_partials(const double *p, const double *s, const int *m, const double *motion, double *dF, double *dR)
{
    const double z = motion[0];
    (void)s;
    dF[0] = p[0] + 3.0 * p[6] * z * z + p[2] + (m[1] ? p[4] : 0.0);
    dF[1] = p[1];
    dF[2] = -p[2];
    dR[0] = 0.0;
    dR[1] = m[0] ? 1.0 : 0.0;
    dR[2] = 0.0;
}
