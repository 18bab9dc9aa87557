/*
   states: slider[i] m
   modes: n[0]
   indicators: 2*n[0]
   inputs: z
   exchange: yes
*/
/* Several springs with play and slider in parallel, which slip one after the other; each as the law jenkins.
   p: stiffness[n0], slip_force[n0], clearance.
   mode of a slider: -2, 2 slipping to that side; -1, 1 sticking and loaded behind the play; 0 in the play, or sticking
   where there is none. In model exchange a slider stands still while it sticks and sits its reach behind z while it
   slips: nothing is integrated, and events set it. Indicators lie a hysteresis behind the edges: 1e-6 of the reach (of
   one micrometre if that is larger), and 1e-9 m/s for the reversal that ends slip. At rest the force stays. */

#include <math.h>
#include <stddef.h>

#define IWAN_REVERSAL 1e-9 /* m/s */

static const char *iwan_check(const double *p, const int *n)
{
    (void)p;
    return n[0] != n[1] ? "iwan: lists differ in length, expected as many entries of slip_force as of stiffness" : NULL;
}

static double iwan_clearance(const double *p, const int *n)
{
    return p[2 * n[0]];
}

static double iwan_reach(const double *p, const int *n, int i)
{
    return p[n[0] + i] / p[i] + iwan_clearance(p, n);
}

static double iwan_hysteresis(double reach)
{
    return 1e-6 * fmax(reach, 1e-6);
}

static void iwan_initial(const double *p, const int *n, double z, double *s, int *m)
{
    int i;
    (void)p;
    for (i = 0; i < n[0]; i++) {
        s[i] = z;
        m[i] = 0;
    }
}

static double iwan_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    double force = 0.0;
    int i;
    (void)v; (void)h;
    for (i = 0; i < n[0]; i++) {
        const double reach = iwan_reach(p, n, i), stretch = fmin(fmax(z - s[i], -reach), reach);
        force += p[i] * copysign(fmax(fabs(stretch) - iwan_clearance(p, n), 0.0), stretch);
        after[i] = z - stretch;
    }
    return force;
}

/* At the edge of slip, where every step of a sliding joint ends, the direction of the motion decides. */
static void iwan_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    int i;
    dF[0] = dF[1] = 0.0;
    for (i = 0; i < n[0]; i++) {
        const double stretch = z - s[i], reach = iwan_reach(p, n, i), edge = iwan_hysteresis(reach);
        const double room = reach - fabs(stretch);
        const int slips = p[n[0] + i] == 0.0 || room < -edge || (room < edge && stretch * v > 0.0);
        dF[0] += slips || fabs(stretch) < iwan_clearance(p, n) ? 0.0 : p[i];
    }
}

static double iwan_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const double clearance = iwan_clearance(p, n);
    double force = 0.0;
    int i;
    (void)v;
    for (i = 0; i < n[0]; i++) {
        const int side = (m[i] > 0) - (m[i] < 0);
        if (m[i] == 2 * side && side)
            force += side * p[n[0] + i];
        else if (side || clearance == 0.0)
            force += p[i] * (z - s[i] - side * clearance);
    }
    return force;
}

static void iwan_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    const double clearance = iwan_clearance(p, n);
    int i;
    for (i = 0; i < n[0]; i++) {
        const double reach = iwan_reach(p, n, i), hysteresis = iwan_hysteresis(reach), stretch = z - s[i];
        const double outer = m[i] || clearance == 0.0 ? reach : clearance;
        if (m[i] == 2 || m[i] == -2) {
            g[2 * i] = g[2 * i + 1] = v + (m[i] > 0 ? IWAN_REVERSAL : -IWAN_REVERSAL);
        } else {
            g[2 * i] = stretch - (m[i] < 0 ? -clearance : outer) - hysteresis;
            g[2 * i + 1] = stretch - (m[i] > 0 ? clearance : -outer) + hysteresis;
        }
    }
}

/* No continuous state jumps. */
static int iwan_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    const double clearance = iwan_clearance(p, n);
    int i;
    for (i = 0; i < n[0]; i++) {
        const double reach = iwan_reach(p, n, i), pulled = z - s[i];
        double stretch = fmin(fmax(pulled, -reach), reach);
        if (m[i] == 2 || m[i] == -2)
            stretch = m[i] > 0 ? reach : -reach;
        if (stretch != pulled)
            s[i] = z - stretch;
        if (stretch >= reach && v >= 0.0)
            m[i] = 2;
        else if (stretch <= -reach && v <= 0.0)
            m[i] = -2;
        else
            m[i] = clearance > 0.0 ? (stretch > clearance) - (stretch < -clearance) : 0;
    }
    return 0;
}

static void iwan_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    int i;
    (void)s; (void)z; (void)v;
    dF[0] = dF[1] = 0.0;
    for (i = 0; i < n[0]; i++) {
        const int loaded = m[i] == 1 || m[i] == -1 || (m[i] == 0 && iwan_clearance(p, n) == 0.0);
        dF[2 + i] = loaded ? -p[i] : 0.0;
        dF[0] -= dF[2 + i];
    }
    for (i = 0; i < n[0] * (2 + n[0]); i++)
        dR[i] = 0.0;
}
