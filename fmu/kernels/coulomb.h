/*
   modes: 1
   indicators: 2
   inputs: v
   exchange: yes
*/
/* Dry friction: f = slip_force tanh(v / smoothing_velocity), or slip_force sign(v) where that is 0.
   p: slip_force, smoothing_velocity.
   mode, without smoothing: the sign of the sliding, -1 or 1, and 0 before anything slid; NULL in co-simulation, where v
   decides. At rest the force of model exchange keeps its last sign until the joint slides back: a law without a state
   cannot hold a load in equilibrium, so a body that stops under load makes one event after the other. For that take a
   smoothing velocity or a Jenkins element. Indicators lie a hysteresis of 1e-9 m/s behind reversal; with smoothing they
   are constant. */

#include <math.h>
#include <stddef.h>

#define COULOMB_HYSTERESIS 1e-9 /* m/s */

static int coulomb_sign(double v)
{
    return (v > 0.0) - (v < 0.0);
}

static void coulomb_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n; (void)z; (void)s;
    m[0] = 0;
}

static double coulomb_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    (void)n; (void)s; (void)z;
    if (p[1] > 0.0)
        return p[0] * tanh(v / p[1]);
    return p[0] * (m != NULL ? m[0] : coulomb_sign(v));
}

static void coulomb_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    (void)n; (void)s; (void)z;
    g[0] = p[1] > 0.0 ? 1.0 : v + (m[0] > 0 ? COULOMB_HYSTERESIS : -COULOMB_HYSTERESIS);
    g[1] = p[1] > 0.0 ? 1.0 : v + (m[0] < 0 ? -COULOMB_HYSTERESIS : COULOMB_HYSTERESIS);
}

static int coulomb_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)p; (void)n; (void)s; (void)z;
    if (v != 0.0)
        m[0] = coulomb_sign(v);
    return 0;
}

static void coulomb_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double course = p[1] > 0.0 ? tanh(v / p[1]) : 1.0;
    (void)n; (void)s; (void)m; (void)z; (void)dR;
    dF[0] = 0.0;
    dF[1] = p[1] > 0.0 ? p[0] * (1.0 - course * course) / p[1] : 0.0;
}
