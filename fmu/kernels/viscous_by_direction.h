/*
   modes: 0
   indicators: 0
   inputs: v
   exchange: yes
*/
/* Viscous friction that differs between the directions: damping_positive v or damping_negative v.
   The force is continuous at reversal, so it needs no event. */

static double viscous_by_direction_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)m; (void)z;
    return v > 0.0 ? p[0] * v : p[1] * v;
}

static void viscous_by_direction_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)m; (void)z; (void)dR;
    dF[0] = 0.0;
    dF[1] = v >= 0.0 ? p[0] : p[1];
}
