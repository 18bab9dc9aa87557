/*
   states: position m
   states: stretch m continuous
   modes: 1
   indicators: 2
   inputs: z v
   exchange: yes
*/
/* LuGre friction with play in series: bristle y, rate of y = v - |v| y / Y(v), f = stiffness y + damping (rate of y),
   Y = (slip_force + (static_force - slip_force) exp(-(v / stribeck_velocity)^2)) / stiffness; stretch = y and what the
   play takes of it. p: stiffness, damping, slip_force, static_force, stribeck_velocity, clearance. A step follows the
   bristle along the travel at the mean velocity of the step. In model exchange the rate is stiff where |v| / Y is
   large.
   mode: the side of the play on which the bristle is loaded, 0 inside it and where there is none. Inside it there is no
   force and the stretch follows v, so the rate is continuous and no state jumps. Indicators lie a hysteresis of 1e-6 of
   static_force / stiffness + clearance behind the ends of the play; without play they are constant. The position serves
   co-simulation only. */

#include "shared/play.h"
#include <stddef.h>

static const char *lugre_check(const double *p, const int *n)
{
    (void)n;
    return p[3] < p[2] ? "lugre: static_force is below slip_force, expected at least slip_force" : NULL;
}

/* Y, the deflection at which the bristles slide at a velocity. */
static double lugre_length(const double *p, double v)
{
    const double ratio = v / p[4];
    return (p[2] + (p[3] - p[2]) * exp(-ratio * ratio)) / p[0];
}

/* dY/dv */
static double lugre_bend(const double *p, double v)
{
    return -2.0 * v / (p[4] * p[4]) * (lugre_length(p, v) - p[2] / p[0]);
}

static void lugre_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n;
    play_initial(z, s, m);
}

/* Bristle after a travel at one length; gap: the play after it, left: the travel that the play did not take. */
static double lugre_bristle(const double *p, const double *s, double z, double length, double *gap, double *left,
    int *is_free)
{
    const double clearance = p[5];
    double move = z - s[0], y, decay;
    *gap = fmin(fmax(s[1], -clearance), clearance);
    *is_free = 0;
    y = s[1] - *gap;
    if (clearance > 0.0) {
        const double side = (move > 0.0) - (move < 0.0), to_zero = length * log1p(fmax(-side * y, 0.0) / length);
        const double lost = play_lost(clearance, side, fabs(move), to_zero, *gap);
        const int ends_inside = fabs(move) >= to_zero && lost < clearance - side * *gap;
        *is_free = side != 0.0 ? ends_inside : fabs(*gap) < clearance;
        move -= side * lost;
        *gap += side * lost;
    }
    *left = move;
    decay = expm1(-fabs(move) / length);
    return y + y * decay + copysign(length * decay, move);
}

static double lugre_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    const double length = lugre_length(p, h > 0.0 ? (z - s[0]) / h : v);
    double gap, left, rate, y;
    int is_free;
    (void)n;
    y = lugre_bristle(p, s, z, length, &gap, &left, &is_free);
    rate = v - fabs(v) * y / lugre_length(p, v);
    after[0] = z;
    after[1] = y + gap;
    return p[0] * y + (is_free ? 0.0 : p[1] * rate);
}

/* With no travel yet the direction of the motion decides. */
static void lugre_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    const double length = lugre_length(p, v), bend = lugre_bend(p, v), sign = (v > 0.0) - (v < 0.0);
    double gap, left, y, side, by_length;
    int is_free;
    (void)n;
    y = lugre_bristle(p, s, z, length, &gap, &left, &is_free);
    side = z != s[0] ? (left > 0.0) - (left < 0.0) : sign;
    by_length = -side * expm1(-fabs(left) / length) + (y - side * length) * fabs(left) / (length * length);
    dF[0] = (p[0] - p[1] * fabs(v) / length) * (1.0 - side * y / length);
    dF[1] = (p[0] - p[1] * fabs(v) / length) * by_length * bend
        + p[1] * (1.0 - sign * y / length + fabs(v) * y * bend / (length * length));
    if (is_free)
        dF[0] = dF[1] = 0.0;
}

static double lugre_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    const double y = play_deflection(p[5], s, m);
    (void)n; (void)z;
    return play_is_free(p[5], m) ? 0.0 : p[0] * y + p[1] * (v - fabs(v) * y / lugre_length(p, v));
}

static void lugre_rates(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *rate)
{
    (void)n; (void)z;
    rate[0] = 0.0;
    rate[1] = v - fabs(v) * play_deflection(p[5], s, m) / lugre_length(p, v);
}

static void lugre_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    (void)n; (void)z; (void)v;
    play_indicators(p[5], p[3] / p[0], s, m, g);
}

static int lugre_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)n; (void)z; (void)v;
    play_event(p[5], s, m);
    return 0;
}

static void lugre_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double length = lugre_length(p, v), share = play_deflection(p[5], s, m) / length;
    const double sign = (v > 0.0) - (v < 0.0);
    const int loaded = !play_is_free(p[5], m);
    int i;
    (void)n; (void)z;
    for (i = 0; i < 4; i++)
        dF[i] = dR[i] = dR[4 + i] = 0.0;
    dR[5] = 1.0 - sign * share + fabs(v) * share * lugre_bend(p, v) / length;
    dR[7] = loaded ? -fabs(v) / length : 0.0;
    dF[1] = loaded ? p[1] * dR[5] : 0.0;
    dF[3] = loaded ? p[0] + p[1] * dR[7] : 0.0;
}
