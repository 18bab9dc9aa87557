/*
   modes: 1
   indicators: 2*n[0]
   inputs: z v
   exchange: yes
*/
/* Stiffness and damping by table over the displacement, in segments. p: width[n0], stiffness[n0], damping[n0]; the last
   segment goes on for ever.
   mode: in which segment |z| is, negative below zero; NULL in co-simulation, where z decides. Indicators lie a
   hysteresis behind the edges, 1e-6 of the edge or of one micrometre if that is larger. */

#include <math.h>
#include <stddef.h>

static const char *tabulated_check(const double *p, const int *n)
{
    (void)p;
    return n[0] != n[1] || n[0] != n[2]
        ? "tabulated: lists differ in length, expected as many entries of stiffness and damping as of width" : NULL;
}

static int tabulated_segment(const double *p, const int *n, double z)
{
    double edge = p[0];
    int i = 0;
    while (i + 1 < n[0] && fabs(z) >= edge)
        edge += p[++i];
    return z < 0.0 ? -i : i;
}

static void tabulated_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)s;
    m[0] = tabulated_segment(p, n, z);
}

/* Where segment ``last`` begins, and the force carried there; its damping at |z| = side z and the slope of that. */
static double tabulated_begin(const double *p, const int *n, int last, double *carried)
{
    double edge = 0.0;
    int i;
    *carried = 0.0;
    for (i = 0; i < last; i++) {
        *carried += p[n[0] + i] * p[i];
        edge += p[i];
    }
    return edge;
}

static double tabulated_rise(const double *p, const int *n, int last)
{
    const double *c = p + 2 * n[0];
    return last + 1 < n[0] ? (c[last + 1] - c[last]) / p[last] : 0.0;
}

static double tabulated_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const int mode = m != NULL ? m[0] : tabulated_segment(p, n, z), last = mode < 0 ? -mode : mode;
    const double side = mode < 0 || (mode == 0 && z < 0.0) ? -1.0 : 1.0;
    double carried, beyond;
    (void)s;
    beyond = side * z - tabulated_begin(p, n, last, &carried);
    return side * (carried + p[n[0] + last] * beyond)
        + (p[2 * n[0] + last] + tabulated_rise(p, n, last) * beyond) * v;
}

static void tabulated_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    double edge = 0.0;
    int i;
    (void)s; (void)v;
    g[0] = g[1] = 1.0;
    for (i = 1; i < n[0]; i++) {
        const double hysteresis = 1e-6 * fmax(edge += p[i - 1], 1e-6);
        g[2 * i] = z - edge + (m[0] >= i ? hysteresis : -hysteresis);
        g[2 * i + 1] = z + edge + (m[0] <= -i ? -hysteresis : hysteresis);
    }
}

static int tabulated_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)s; (void)v;
    m[0] = tabulated_segment(p, n, z);
    return 0;
}

static void tabulated_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const int mode = m != NULL ? m[0] : tabulated_segment(p, n, z), last = mode < 0 ? -mode : mode;
    const double side = mode < 0 || (mode == 0 && z < 0.0) ? -1.0 : 1.0, rise = tabulated_rise(p, n, last);
    double carried, beyond;
    (void)s; (void)dR;
    beyond = side * z - tabulated_begin(p, n, last, &carried);
    dF[0] = p[n[0] + last] + rise * side * v;
    dF[1] = p[2 * n[0] + last] + rise * beyond;
}
