/*
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* Cubic spring: f = stiffness3 z^3. */

static double cubic_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)v;
    return p[0] * (z * z * z);
}

static void cubic_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)v; (void)dR;
    dF[0] = 3.0 * p[0] * (z * z);
    dF[1] = 0.0;
}
