/*
   modes: 0
   indicators: 0
   inputs: v
   exchange: yes
*/
/* Viscous damper: f = damping v. */

static double viscous_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)z;
    return p[0] * v;
}

static void viscous_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)z; (void)v; (void)dR;
    dF[0] = 0.0;
    dF[1] = p[0];
}
