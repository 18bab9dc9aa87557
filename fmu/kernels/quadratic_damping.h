/*
   modes: 0
   indicators: 0
   inputs: v
   exchange: yes
*/
/* Damping that grows with speed: f = damping2 v |v|. */

#include <math.h>

static double quadratic_damping_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)z;
    return p[0] * v * fabs(v);
}

static void quadratic_damping_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)z; (void)dR;
    dF[0] = 0.0;
    dF[1] = 2.0 * p[0] * fabs(v);
}
