/*
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* Preloaded ball guide, both sides of lift-off: f = 2 sin(angle) preload [(1 + u)^(3/2) - (1 - u)^(3/2)], each row only
   while it touches, u = z sin(angle) / (kappa preload^(2/3)). p: preload, kappa, contact_angle. Force and stiffness are
   continuous at lift-off, so it needs no event. */

#include <math.h>

static double hertz_guide_slope(const double *p)
{
    const double root = cbrt(p[0]);
    return sin(p[2]) / (p[1] * root * root);
}

static double hertz_guide_row(double u)
{
    return u > 0.0 ? u * sqrt(u) : 0.0;
}

static double hertz_guide_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    const double u = z * hertz_guide_slope(p);
    (void)n; (void)s; (void)m; (void)v;
    return 2.0 * sin(p[2]) * p[0] * (hertz_guide_row(1.0 + u) - hertz_guide_row(1.0 - u));
}

static void hertz_guide_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double slope = hertz_guide_slope(p), u = z * slope;
    (void)n; (void)s; (void)m; (void)v; (void)dR;
    dF[0] = 3.0 * sin(p[2]) * p[0] * slope * (sqrt(fmax(1.0 + u, 0.0)) + sqrt(fmax(1.0 - u, 0.0)));
    dF[1] = 0.0;
}
