/*
   modes: 1
   indicators: 2
   inputs: v
   exchange: yes
*/
/* Dry friction that is larger at low speed:
   f = (slip_force + (static_force - slip_force) exp(-(v / stribeck_velocity)^2)) tanh(v / smoothing_velocity), with
   sign(v) for the last factor where smoothing_velocity is 0.
   p: slip_force, static_force, stribeck_velocity, smoothing_velocity.
   mode, without smoothing: the sign of the sliding, -1 or 1, and 0 before anything slid; NULL in co-simulation, where v
   decides. At rest the force of model exchange keeps its last sign until the joint slides back: a law without a state
   cannot hold a load in equilibrium, so a body that stops under load makes one event after the other. For that take a
   smoothing velocity or a LuGre element. Indicators lie a hysteresis of 1e-6 of the Stribeck velocity behind reversal;
   with smoothing they are constant. */

#include <math.h>
#include <stddef.h>

static const char *stribeck_check(const double *p, const int *n)
{
    (void)n;
    return p[1] < p[0] ? "stribeck: static_force is below slip_force, expected at least slip_force" : NULL;
}

static int stribeck_sign(double v)
{
    return (v > 0.0) - (v < 0.0);
}

static double stribeck_bump(const double *p, double v)
{
    const double ratio = v / p[2];
    return (p[1] - p[0]) * exp(-(ratio * ratio));
}

static void stribeck_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n; (void)z; (void)s;
    m[0] = 0;
}

static double stribeck_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const double size = p[0] + stribeck_bump(p, v);
    (void)n; (void)s; (void)z;
    if (p[3] > 0.0)
        return size * tanh(v / p[3]);
    return size * (m != NULL ? m[0] : stribeck_sign(v));
}

static void stribeck_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    const double hysteresis = 1e-6 * p[2];
    (void)n; (void)s; (void)z;
    g[0] = p[3] > 0.0 ? 1.0 : v + (m[0] > 0 ? hysteresis : -hysteresis);
    g[1] = p[3] > 0.0 ? 1.0 : v + (m[0] < 0 ? -hysteresis : hysteresis);
}

static int stribeck_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)p; (void)n; (void)s; (void)z;
    if (v != 0.0)
        m[0] = stribeck_sign(v);
    return 0;
}

static void stribeck_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double bump = stribeck_bump(p, v);
    const double sign = p[3] > 0.0 ? tanh(v / p[3]) : m != NULL ? m[0] : stribeck_sign(v);
    const double slope = p[3] > 0.0 ? (1.0 - sign * sign) / p[3] : 0.0;
    (void)n; (void)s; (void)z; (void)dR;
    dF[0] = 0.0;
    dF[1] = (p[0] + bump) * slope - 2.0 * v / (p[2] * p[2]) * bump * sign;
}
