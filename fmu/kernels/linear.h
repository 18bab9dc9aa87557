/*
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* Linear spring: f = stiffness z. */

static double linear_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)v;
    return p[0] * z;
}

static void linear_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)z; (void)v; (void)dR;
    dF[0] = p[0];
    dF[1] = 0.0;
}
