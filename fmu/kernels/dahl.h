/*
   states: position m
   states: stretch m continuous
   modes: 1
   indicators: 2
   inputs: z
   exchange: yes
*/
/* Dahl friction with play in series: f = stiffness y, rate of y = v - |v| y / length, length = slip_force / stiffness;
   stretch = y and what the play takes of it. p: stiffness, slip_force, clearance. A step is the exact return map.
   mode: the side of the play on which the element is loaded, 0 inside it and where there is none. Inside it y is 0 and
   the stretch follows v, so the rate is continuous and no state jumps. Indicators lie a hysteresis of 1e-6 of
   length + clearance behind the ends of the play; without play they are constant. The position serves co-simulation
   only. */

#include "shared/play.h"

static void dahl_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n;
    play_initial(z, s, m);
}

static double dahl_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    const double length = p[1] / p[0], clearance = p[2];
    double move = z - s[0], gap = fmin(fmax(s[1], -clearance), clearance), q = (s[1] - gap) / length, decay;
    (void)n; (void)v; (void)h;
    if (clearance > 0.0 && move != 0.0) {
        const double side = copysign(1.0, move), to_zero = length * log1p(fmax(-side * q, 0.0));
        const double lost = side * play_lost(clearance, side, fabs(move), to_zero, gap);
        move -= lost;
        gap += lost;
    }
    decay = expm1(-fabs(move) / length);
    q = q + q * decay + copysign(decay, move);
    after[0] = z;
    after[1] = length * q + gap;
    return p[1] * q;
}

/* With no travel yet the direction of the motion decides. */
static void dahl_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    const double direction = z != s[0] ? z - s[0] : v;
    const double sign = (direction > 0.0) - (direction < 0.0);
    double after[2], force = dahl_step(p, n, s, z, v, 0.0, after);
    dF[0] = p[2] > 0.0 && fabs(after[1]) < p[2] ? 0.0 : p[0] * (1.0 - sign * force / p[1]);
    dF[1] = 0.0;
}

/* Deflection of the element in units of its length. */
static double dahl_share(const double *p, const double *s, const int *m)
{
    return play_deflection(p[2], s, m) * p[0] / p[1];
}

static double dahl_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    (void)n; (void)z; (void)v;
    return p[1] * dahl_share(p, s, m);
}

static void dahl_rates(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *rate)
{
    (void)n; (void)z;
    rate[0] = 0.0;
    rate[1] = v - fabs(v) * dahl_share(p, s, m);
}

static void dahl_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    (void)n; (void)z; (void)v;
    play_indicators(p[2], p[1] / p[0], s, m, g);
}

static int dahl_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)n; (void)z; (void)v;
    play_event(p[2], s, m);
    return 0;
}

static void dahl_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double share = dahl_share(p, s, m);
    const int loaded = !play_is_free(p[2], m);
    int i;
    (void)n; (void)z;
    for (i = 0; i < 4; i++)
        dF[i] = dR[i] = dR[4 + i] = 0.0;
    dF[3] = loaded ? p[0] : 0.0;
    dR[5] = 1.0 - ((v > 0.0) - (v < 0.0)) * share;
    dR[7] = loaded ? -fabs(v) * p[0] / p[1] : 0.0;
}
