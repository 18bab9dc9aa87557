/*
   states: position m
   states: stretch m continuous
   modes: 0
   indicators: 0
   inputs: z
   exchange: yes
*/
/* Spring and damper in series: rate of the stretch = v - stretch stiffness / damping, f = stiffness stretch.
   p: stiffness, damping. A step is exact for a path that is linear in it; without duration it is elastic. The position
   serves co-simulation only. */

#include <math.h>

static void maxwell_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n; (void)m;
    s[0] = z;
    s[1] = 0.0;
}

static double maxwell_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    const double x = h * p[0] / p[1], forgotten = -expm1(-x), followed = x > 0.0 ? forgotten / x : 1.0;
    const double stretch = s[1] - forgotten * s[1] + followed * (z - s[0]);
    (void)n; (void)v;
    after[0] = z;
    after[1] = stretch;
    return p[0] * stretch;
}

static void maxwell_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    (void)n; (void)s; (void)z; (void)v;
    dF[0] = p[0];
    dF[1] = 0.0;
}

static double maxwell_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    (void)n; (void)m; (void)z; (void)v;
    return p[0] * s[1];
}

static void maxwell_rates(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *rate)
{
    (void)n; (void)m; (void)z;
    rate[0] = 0.0;
    rate[1] = v - s[1] * p[0] / p[1];
}

static void maxwell_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    int i;
    (void)n; (void)s; (void)m; (void)z; (void)v;
    for (i = 0; i < 4; i++)
        dF[i] = dR[i] = dR[4 + i] = 0.0;
    dF[3] = p[0];
    dR[5] = 1.0;
    dR[7] = -p[0] / p[1];
}
