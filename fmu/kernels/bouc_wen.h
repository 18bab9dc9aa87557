/*
   states: position m
   states: stretch m continuous
   modes: 1
   indicators: 2
   inputs: z
   exchange: yes
*/
/* Bouc-Wen hysteresis with play in series: f = slip_force u, rate of u = v / length (1 - |u|^exponent (shape +
   (1 - shape) sign(u v))), length = slip_force / stiffness; stretch = length u and what the play takes of it.
   p: stiffness, slip_force, exponent, shape, clearance. A step is exponential along the travel.
   mode: the side of the play on which the element is loaded, 0 inside it and where there is none. Inside it u is 0 and
   the stretch follows v, so the rate is continuous and no state jumps. Indicators lie a hysteresis of 1e-6 of
   length + clearance behind the ends of the play; without play they are constant. The position serves co-simulation
   only. */

#include "shared/play.h"

static void bouc_wen_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)p; (void)n;
    play_initial(z, s, m);
}

/* du over a travel of one length, to the positive side. */
static double bouc_wen_slope(const double *p, double u)
{
    return u == 0.0 ? 1.0 : 1.0 - pow(fabs(u), p[2]) * (p[3] + copysign(1.0 - p[3], u));
}

/* Travel in lengths that unloads from u < 0, by five Gauss points. */
static double bouc_wen_to_zero(const double *p, double u)
{
    static const double x[5] = {0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319};
    static const double w[5] = {
        0.11846344252809454, 0.23931433524968324, 0.28444444444444433, 0.23931433524968324, 0.11846344252809454};
    const double size = fmax(-u, 0.0);
    double sum = 0.0;
    int i;
    for (i = 0; i < 5; i++)
        sum += w[i] / (1.0 - (2.0 * p[3] - 1.0) * pow(x[i] * size, p[2]));
    return size * sum;
}

/* Behind the play: u before the loaded part of a travel, to the positive side; travel: that part in lengths; gap: the
   play after it; bound: what u may not pass. */
static double bouc_wen_start(const double *p, const double *s, double z, double *side, double *travel, double *gap,
    double *bound)
{
    const double length = p[1] / p[0], clearance = p[4];
    double u;
    *travel = fabs(z - s[0]);
    *side = copysign(1.0, z - s[0]);
    *gap = fmin(fmax(s[1], -clearance), clearance);
    *bound = 1.0;
    u = *side * (s[1] - *gap) / length;
    if (clearance > 0.0) {
        const double to_zero = length * bouc_wen_to_zero(p, u);
        const double lost = play_lost(clearance, *side, *travel, to_zero, *gap);
        if (*travel < to_zero) {
            *bound = u < 0.0 ? 0.0 : 1.0;
        } else {
            *bound = lost < clearance - *side * *gap ? 0.0 : 1.0;
            if (u < 0.0) {
                u = 0.0;
                *travel -= to_zero;
            }
        }
        *travel = fmax(*travel - lost, 0.0);
        *gap += *side * lost;
    }
    *travel /= length;
    return u;
}

/* u after a travel: u + travel slope expm1(r) / r, r by the secant over two thirds of it. dr: dr over the travel. */
static double bouc_wen_advance(const double *p, double u, double travel, double *r, double *dr)
{
    const double slope = fmax(bouc_wen_slope(p, u), 1e-300), shrink = 1.0 + p[2] * travel;
    const double there = u + travel * slope / (1.5 * shrink), ahead = bouc_wen_slope(p, there);
    const double sign = (there > 0.0) - (there < 0.0);
    const double bend = -p[2] * pow(fabs(there), p[2] - 1.0) * sign * (p[3] + (1.0 - p[3]) * sign);
    *r = fmin(1.5 * (ahead - slope) * shrink / slope, 30.0) + 1e-300;
    *dr = bend / shrink + 1.5 * p[2] * (ahead - slope) / slope;
    return fmin(u + travel * slope * expm1(*r) / *r, 1.0);
}

static double bouc_wen_step(const double *p, const int *n, const double *s, double z, double v, double h,
    double *after)
{
    double side, travel, gap, bound, u, r, dr;
    (void)n; (void)v; (void)h;
    u = bouc_wen_start(p, s, z, &side, &travel, &gap, &bound);
    u = side * fmin(bouc_wen_advance(p, u, travel, &r, &dr), bound);
    after[0] = z;
    after[1] = p[1] / p[0] * u + gap;
    return p[1] * u;
}

/* Of the step itself; with no travel yet the direction of the motion decides. */
static void bouc_wen_step_partials(const double *p, const int *n, const double *s, double z, double v, double *dF)
{
    double side, travel, gap, bound, u, r, dr;
    (void)n;
    u = bouc_wen_start(p, s, z, &side, &travel, &gap, &bound);
    dF[1] = 0.0;
    if (z == s[0]) {
        const double sign = ((v > 0.0) - (v < 0.0)) * ((u > 0.0) - (u < 0.0));
        const int is_free = p[4] > 0.0 && fabs(s[1]) < p[4];
        dF[0] = is_free ? 0.0 : p[0] * (1.0 - pow(fabs(u), p[2]) * (p[3] + (1.0 - p[3]) * sign));
    } else {
        const double slope = fmax(bouc_wen_slope(p, u), 1e-300), after = bouc_wen_advance(p, u, travel, &r, &dr);
        const int small = fabs(r) < 1e-3;
        const double d_phi = small ? 0.5 + r / 3.0 + r * r / 8.0 : (exp(r) - expm1(r) / r) / r;
        dF[0] = after < bound ? p[0] * slope * (expm1(r) / r + travel * d_phi * dr) : 0.0;
    }
}

/* Deflection of the element in units of its length. */
static double bouc_wen_share(const double *p, const double *s, const int *m)
{
    return play_deflection(p[4], s, m) * p[0] / p[1];
}

static double bouc_wen_force(const double *p, const int *n, const double *s, const int *m, double z, double v)
{
    (void)n; (void)z; (void)v;
    return p[1] * bouc_wen_share(p, s, m);
}

/* |u|^exponent; beyond 1, where only a solver's trial gets, its tangent, which no exponent makes overflow. */
static double bouc_wen_power(const double *p, double u)
{
    const double size = fabs(u);
    return size <= 1.0 ? pow(size, p[2]) : 1.0 + p[2] * (size - 1.0);
}

static void bouc_wen_rates(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *rate)
{
    const double u = bouc_wen_share(p, s, m), sign = (u > 0.0) - (u < 0.0);
    (void)n; (void)z;
    rate[0] = 0.0;
    rate[1] = v - bouc_wen_power(p, u) * (p[3] * v + (1.0 - p[3]) * sign * fabs(v));
}

static void bouc_wen_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    (void)n; (void)z; (void)v;
    play_indicators(p[4], p[1] / p[0], s, m, g);
}

static int bouc_wen_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)n; (void)z; (void)v;
    play_event(p[4], s, m);
    return 0;
}

static void bouc_wen_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    const double u = bouc_wen_share(p, s, m), sign = (u > 0.0) - (u < 0.0), motion = (v > 0.0) - (v < 0.0);
    const int loaded = !play_is_free(p[4], m);
    int i;
    (void)n; (void)z;
    for (i = 0; i < 4; i++)
        dF[i] = dR[i] = dR[4 + i] = 0.0;
    dF[3] = loaded ? p[0] : 0.0;
    dR[5] = 1.0 - bouc_wen_power(p, u) * (p[3] + (1.0 - p[3]) * sign * motion);
    dR[7] = loaded ? -p[2] * pow(fmin(fabs(u), 1.0), p[2] - 1.0) * (p[3] * v * sign + (1.0 - p[3]) * fabs(v)) * p[0] / p[1] : 0.0;
}
