/*
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* One preloaded rolling contact: f = preload [(1 + u)^(3/2) - 1], the first term only while it touches,
   u = z / (kappa preload^(2/3)). p: preload, kappa. Force and stiffness are continuous at lift-off, so it needs no
   event. */

#include <math.h>

static double hertz_contact_slope(const double *p)
{
    const double root = cbrt(p[0]);
    return 1.0 / (p[1] * root * root);
}

static double hertz_contact_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    const double u = fmax(1.0 + z * hertz_contact_slope(p), 0.0);
    (void)n; (void)s; (void)m; (void)v;
    return p[0] * (u * sqrt(u) - 1.0);
}

static void hertz_contact_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double slope = hertz_contact_slope(p);
    (void)n; (void)s; (void)m; (void)v; (void)dR;
    dF[0] = 1.5 * p[0] * slope * sqrt(fmax(1.0 + z * slope, 0.0));
    dF[1] = 0.0;
}
