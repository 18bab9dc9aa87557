/* Co-simulation of a structure with its joints: the equations of model exchange, integrated inside.
 *
 * Dormand and Prince's method of order 5 with the error estimate of order 4 (J. Comp. Appl. Math. 6:19-26, 1980), and
 * events found by bisection on the step. Inputs are parabolas. What it would step next stays among the saved
 * values. */
#include <math.h>
#include <string.h>
#include "instance.h"

/* Error of a step against the size of each state, a tenth of what the host allows but not less; and the part of its
 * usual size that always counts as size. */
#define JL_TOLERANCE 1e-10
#define JL_FLOOR 1e-3
enum { JL_STAGES = 7, JL_MOST = 4000000, JL_BISECTIONS = 44 };

static const double jl_stage[JL_STAGES - 1][JL_STAGES - 1] = {
    { 1.0 / 5.0 },
    { 3.0 / 40.0, 9.0 / 40.0 },
    { 44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0 },
    { 19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0 },
    { 9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0 },
    { 35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0 },
};
static const double jl_when[JL_STAGES] = { 0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0 };
static const double jl_error[JL_STAGES] = { 71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                                            -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0 };

/* A trial step: states and rates at its end. */
typedef struct {
    double s[JL_ROOM(JL_STATES)], rate[JL_ROOM(JL_STATES)];
} jl_end;

/* One step of h from the present states, where the rates are `rate`; the error in units of what is allowed. */
static double jl_try(const jl_values *v, const double *rate, double h, jl_end *end)
{
    double k[JL_STAGES][JL_ROOM(JL_STATES)], u[JL_ROOM(JL_INPUTS)], worst = 0.0;
    int i, j, n;
    memcpy(k[0], rate, JL_STATES * sizeof *rate);
    for (n = 1; n < JL_STAGES; n++) {
        for (i = 0; i < JL_STATES; i++) {
            double sum = 0.0;
            for (j = 0; j < n; j++) sum += jl_stage[n - 1][j] * k[j][i];
            end->s[i] = v->s[i] + h * sum;
        }
        jl_inputs_at(v, jl_when[n] * h, u);
        jl_all_rates(v->p, end->s, v->m, u, k[n]);
    }
    memcpy(end->rate, k[JL_STAGES - 1], JL_STATES * sizeof *rate);
    for (i = 0; i < JL_STATES; i++) {
        const double usual = jl_variables[JL_FIRST_STATE + i].start;
        const double size = fmax(fabs(v->s[i]), fabs(end->s[i])) + JL_FLOOR * (usual > 0.0 ? usual : 1.0);
        double sum = 0.0;
        for (j = 0; j < JL_STAGES; j++) sum += jl_error[j] * k[j][i];
        sum = fabs(h * sum) / (fmax(JL_TOLERANCE, fmin(v->tolerance / 10.0, 1e-5)) * size);
        if (!(sum <= worst)) worst = sum; /* takes what is no number, too */
        if (!isfinite(end->rate[i])) return (double)INFINITY;
    }
    return worst;
}

static void jl_seen(const jl_values *v, const double *s, double *g)
{
    double motion[JL_ROOM(JL_MOTIONS)];
    jl_motion(s, v->u, motion);
    jl_indicators(v->p, s + JL_STRUCTURE, v->m, motion, g);
}

/* An event indicator has another sign at s than in `before`. */
static int jl_crossed(const jl_values *v, const double *before, const double *s)
{
    double g[JL_ROOM(JL_INDICATORS)];
    int i;
    if (JL_INDICATORS == 0) return 0;
    jl_seen(v, s, g);
    for (i = 0; i < JL_INDICATORS; i++)
        if ((g[i] > 0.0) != (before[i] > 0.0)) return 1;
    return 0;
}

/* Half way by the cubic through both ends and their slopes: a crossing and its return within a step. */
static int jl_crossed_between(const jl_values *v, const double *before, const double *rate, double h,
                              const jl_end *end)
{
    double s[JL_ROOM(JL_STATES)];
    int i;
    if (JL_INDICATORS == 0) return 0;
    for (i = 0; i < JL_STATES; i++)
        s[i] = (v->s[i] + end->s[i]) / 2.0 + h / 8.0 * (rate[i] - end->rate[i]);
    return jl_crossed(v, before, s);
}

/* The joints settle at the present point: modes, and with them rates and indicators. */
static void jl_settle(jl_values *v, double *rate, double *g)
{
    double motion[JL_ROOM(JL_MOTIONS)];
    jl_motion(v->s, v->u, motion);
    (void)jl_event(v->p, v->s + JL_STRUCTURE, v->m, motion);
    jl_all_rates(v->p, v->s, v->m, v->u, rate);
    if (JL_INDICATORS) jl_seen(v, v->s, g);
}

/* The shortest step, up to 2^-44 of h, behind which an indicator has changed; `end` becomes its end. */
static double jl_locate(const jl_values *v, const double *before, const double *rate, double h, jl_end *end)
{
    jl_end trial;
    double low = 0.0, high = h;
    int n;
    for (n = 0; n < JL_BISECTIONS; n++) {
        const double middle = low + (high - low) / 2.0;
        (void)jl_try(v, rate, middle, &trial);
        if (jl_crossed(v, before, trial.s)) high = middle, *end = trial;
        else low = middle;
    }
    return high;
}

/* Inputs and their slopes so many seconds after the step began. */
static void jl_inputs(jl_values *v, const jl_values *begun, double since)
{
    int i;
    jl_inputs_at(begun, since, v->u);
    for (i = 0; i < JL_INPUTS; i++) v->du[i] = begun->du[i] + since * begun->ddu[i];
}

static const char *jl_advanced(jl_values *v, const jl_values *begun, double h)
{
    double rate[JL_ROOM(JL_STATES)], g[JL_ROOM(JL_INDICATORS)], done = 0.0;
    long work = 0;
    memset(g, 0, sizeof g);
    jl_settle(v, rate, g); /* the inputs or a parameter may have changed */
    if (!jl_all_finite(rate, JL_STATES)) return "a rate is no finite number";
    while (done < h) {
        const double left = h - done, stride = v->stride > 0.0 ? v->stride : h / 100.0;
        const int last = stride >= left;
        double step = last ? left : stride > left / 2.0 ? left / 2.0 : stride, error, proposed;
        jl_end end;
        if (++work > JL_MOST)
            return "the motion takes too many steps; a joint that sticks without a spring (coulomb or stribeck without "
                   "smoothing_velocity) does so, or a rate that is far above the machine's";
        error = jl_try(v, rate, step, &end);
        if (!(error <= 1.0)) {
            v->stride = step * (isfinite(error) ? fmax(0.2, 0.9 * pow(error, -0.2)) : 0.1);
            if (v->stride < 1e-14 * h)
                return "the motion leaves what numbers can hold, or a force jumps without an event";
            continue;
        }
        if (jl_crossed(v, g, end.s)) {
            step = jl_locate(v, g, rate, step, &end);
            work += JL_BISECTIONS;
            memcpy(v->s, end.s, JL_STATES * sizeof *end.s);
            jl_inputs(v, begun, done + step);
            jl_settle(v, rate, g);
            if (!jl_all_finite(v->s, JL_STATES) || !jl_all_finite(rate, JL_STATES))
                return "a state or a rate after an event is no finite number";
            done += step;
            continue;
        }
        if (step > 1e-12 * h && jl_crossed_between(v, g, rate, step, &end)) {
            v->stride = step / 2.0;
            continue;
        }
        memcpy(v->s, end.s, JL_STATES * sizeof *end.s);
        memcpy(rate, end.rate, JL_STATES * sizeof *end.rate);
        if (JL_INDICATORS) jl_seen(v, v->s, g);
        done = last ? h : done + step;
        jl_inputs(v, begun, done);
        /* A step that was cut short says nothing against the longer one. */
        proposed = step * (error > 0.0 ? fmin(5.0, 0.9 * pow(error, -0.2)) : 5.0);
        v->stride = fmin(h, step < stride ? fmax(stride, proposed) : proposed);
    }
    return NULL;
}

#ifdef JL_CONDITIONS
/* Conditions jumped: what remembers stays where it is, as in a step of the joints' own, and the modes follow from that. */
static void jl_retune(jl_values *v)
{
    jl_values before = *v;
    double motion[JL_ROOM(JL_MOTIONS)], virgin[JL_ROOM(JL_MEMORY)];
    memcpy(JL_PRESENT(&before), v->held, sizeof v->held);
    jl_motion(v->s, before.u, motion);
    (void)jl_event(v->p, v->s + JL_STRUCTURE, v->m, motion);
    jl_motion(v->s, v->u, motion);
    jl_initial(v->p, motion, virgin, v->m);
    (void)jl_event(v->p, v->s + JL_STRUCTURE, v->m, motion);
    v->stride = 0.0;
}

#endif
const char *jl_integrate(jl_values *v, double h)
{
#ifdef JL_CONDITIONS
    if (JL_JUMPED(v)) jl_retune(v);
#endif
    const jl_values begun = *v;
    return jl_advanced(v, &begun, h);
}
