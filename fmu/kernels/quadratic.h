/*
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* Quadratic spring: f = stiffness2 z^2. */

static double quadratic_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)v;
    return p[0] * (z * z);
}

static void quadratic_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)v; (void)dR;
    dF[0] = 2.0 * p[0] * z;
    dF[1] = 0.0;
}
