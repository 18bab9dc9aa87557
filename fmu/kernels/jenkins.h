/*
   states: slider m
   modes: 1
   indicators: 2
   inputs: z
   exchange: yes
*/
/* Spring, play and slider in series: f = stiffness (z - slider) less the play, the slider dragged along where
   |z - slider| exceeds reach = slip_force / stiffness + clearance. p: stiffness, slip_force, clearance.
   mode: -2, 2 slipping to that side; -1, 1 sticking and loaded behind the play; 0 in the play, or sticking where there
   is none. In model exchange the slider stands still while it sticks and sits reach behind z while it slips: nothing is
   integrated, and events set it. Indicators lie a hysteresis behind the edges: 1e-6 of reach (of one micrometre if that
   is larger), and 1e-9 m/s for the reversal that ends slip. At rest the force stays. */

#include <math.h>

#define JENKINS_REVERSAL 1e-9 /* m/s */

static double jenkins_reach(const double *p)
{
    return p[1] / p[0] + p[2];
}

static double jenkins_hysteresis(const double *p)
{
    return 1e-6 * fmax(jenkins_reach(p), 1e-6);
}

static void jenkins_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n;
    s[0] = z;
    m[0] = 0;
}

static double jenkins_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    const double reach = jenkins_reach(p), stretch = fmin(fmax(z - s[0], -reach), reach);
    (void)n; (void)v; (void)h;
    after[0] = z - stretch;
    return p[0] * copysign(fmax(fabs(stretch) - p[2], 0.0), stretch);
}

/* At the edge of slip, where every step of a sliding joint ends, the direction of the motion decides. */
static void jenkins_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    const double stretch = z - s[0], room = jenkins_reach(p) - fabs(stretch), edge = jenkins_hysteresis(p);
    const int slips = p[1] == 0.0 || room < -edge || (room < edge && stretch * v > 0.0);
    (void)n;
    dF[0] = slips || fabs(stretch) < p[2] ? 0.0 : p[0];
    dF[1] = 0.0;
}

static double jenkins_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const int side = (m[0] > 0) - (m[0] < 0);
    (void)n; (void)v;
    if (m[0] == 2 * side && side)
        return side * p[1];
    return side || p[2] == 0.0 ? p[0] * (z - s[0] - side * p[2]) : 0.0;
}

static void jenkins_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    const double hysteresis = jenkins_hysteresis(p), reach = jenkins_reach(p), stretch = z - s[0];
    const double outer = m[0] || p[2] == 0.0 ? reach : p[2];
    (void)n;
    if (m[0] == 2 || m[0] == -2) {
        g[0] = g[1] = v + (m[0] > 0 ? JENKINS_REVERSAL : -JENKINS_REVERSAL);
        return;
    }
    g[0] = stretch - (m[0] < 0 ? -p[2] : outer) - hysteresis;
    g[1] = stretch - (m[0] > 0 ? p[2] : -outer) + hysteresis;
}

/* No continuous state jumps. */
static int jenkins_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    const double reach = jenkins_reach(p), pulled = z - s[0];
    double stretch = fmin(fmax(pulled, -reach), reach);
    (void)n;
    if (m[0] == 2 || m[0] == -2)
        stretch = m[0] > 0 ? reach : -reach;
    if (stretch != pulled)
        s[0] = z - stretch;
    if (stretch >= reach && v >= 0.0)
        m[0] = 2;
    else if (stretch <= -reach && v <= 0.0)
        m[0] = -2;
    else
        m[0] = p[2] > 0.0 ? (stretch > p[2]) - (stretch < -p[2]) : 0;
    return 0;
}

static void jenkins_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const int loaded = m[0] == 1 || m[0] == -1 || (m[0] == 0 && p[2] == 0.0);
    (void)n; (void)s; (void)z; (void)v;
    dF[0] = loaded ? p[0] : 0.0;
    dF[1] = 0.0;
    dF[2] = -dF[0];
    dR[0] = dR[1] = dR[2] = 0.0;
}
