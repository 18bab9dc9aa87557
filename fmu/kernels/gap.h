/*
   modes: 1
   indicators: 2
   inputs: z
   exchange: yes
*/
/* Play that interrupts a spring: f = -stiffness clip(z, -clearance, clearance). p: stiffness, clearance.
   mode: -1, 0, 1 below, inside and above the play; NULL in co-simulation, where z decides. Indicators lie a hysteresis
   behind the edges, 1e-6 of the clearance or of one micrometre if that is larger. */

#include <math.h>
#include <stddef.h>

static int gap_side(const double *p, double z)
{
    return z >= p[1] ? 1 : z <= -p[1] ? -1 : 0;
}

static void gap_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)n; (void)s;
    m[0] = gap_side(p, z);
}

static double gap_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const int side = m != NULL ? m[0] : gap_side(p, z);
    (void)n; (void)s; (void)v;
    return -p[0] * (side ? side * p[1] : z);
}

static void gap_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    const double hysteresis = 1e-6 * fmax(p[1], 1e-6);
    (void)n; (void)s; (void)v;
    g[0] = z - p[1] + (m[0] > 0 ? hysteresis : -hysteresis);
    g[1] = z + p[1] + (m[0] < 0 ? -hysteresis : hysteresis);
}

static int gap_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)n; (void)s; (void)v;
    m[0] = gap_side(p, z);
    return 0;
}

static void gap_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)v; (void)dR;
    dF[0] = (m != NULL ? m[0] : gap_side(p, z)) ? 0.0 : -p[0];
    dF[1] = 0.0;
}
