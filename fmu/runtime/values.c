/* Values of an instance: set and get, and the steps of co-simulation. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "instance.h"

static const char jl_inputs[2][13] = { "displacement", "velocity" };

void jl_start(jl_values *v)
{
    int i;
    v->state = JL_INSTANTIATED;
    v->stop = (double)INFINITY;
    for (i = 0; i < 2; i++) v->input[i] = jl_variables[i].start;
    for (i = 0; i < JL_PARAMETERS; i++) v->p[i] = jl_variables[JL_FIRST_PARAMETER + i].start;
}

int jl_all_finite(const double *x, int count)
{
    int i;
    for (i = 0; i < count; i++)
        if (!isfinite(x[i])) return 0;
    return 1;
}

/* A solver may try points that the law cannot answer: there it is told to discard them. */
int jl_no_number(jl_instance *instance, jl_call call, const char *what)
{
    const jl_values *v = &instance->values;
    char message[256];
    snprintf(message, sizeof message, "%s is no finite number at displacement %.17g m, velocity %.17g m/s", what,
             v->input[0], v->input[1]);
    if (v->state != JL_CONTINUOUS_TIME) return jl_fail(instance, call, "%s", message);
    jl_report(instance, call, JL_DISCARD, message);
    return JL_DISCARD;
}

/* The parameters are sound, and the virgin state follows the displacement until initialization ends. */
int jl_prepare(jl_instance *instance, jl_call call)
{
    jl_values *v = &instance->values;
    if (!v->sound) {
        char message[512] = "";
        if (jl_check(v->p, message, sizeof message)) return jl_fail(instance, call, "%s", message);
        v->sound = 1;
    }
    if (!v->initialized && !v->fresh) jl_initial(v->p, v->input[0], v->s, v->m);
    return JL_OK;
}

/* The force of the present inputs, parameters and states; no state moves. */
static int jl_present(jl_instance *instance, jl_call call)
{
    jl_values *v = &instance->values;
    double after[JL_ROOM(JL_STATES)], force;
    if (jl_prepare(instance, call)) return JL_ERROR;
    if (v->fresh) return JL_OK;
    force = v->exchange ? jl_force(v->p, v->s, v->m, v->input[0], v->input[1])
                        : jl_step(v->p, v->s, v->input[0], v->input[1], 0.0, after);
    if (!isfinite(force)) return jl_no_number(instance, call, "the force");
    v->force = force;
    v->fresh = 1;
    return JL_OK;
}

/* Rates of the continuous states and event indicators. In co-simulation nothing keeps the modes: they are settled
 * for the look on copies. */
void jl_look(const jl_values *v, double *rate, double *g)
{
    double s[JL_ROOM(JL_STATES)], every[JL_ROOM(JL_STATES)];
    int m[JL_ROOM(JL_MODES)], i;
    memcpy(s, v->s, sizeof s);
    memcpy(m, v->m, sizeof m);
    if (!v->exchange) (void)jl_event(v->p, s, m, v->input[0], v->input[1]);
    if (g) jl_indicators(v->p, s, m, v->input[0], v->input[1], g);
    if (!rate) return;
    jl_rates(v->p, s, m, v->input[0], v->input[1], every);
    for (i = 0; i < JL_CONTINUOUS; i++) rate[i] = every[jl_continuous[i]];
}

/* Says once that an accepted point lies outside the range in which the joint was identified. */
void jl_watch(jl_instance *instance, jl_call call)
{
    int i;
    for (i = 0; i < 2 && !instance->outside; i++) {
        const double x = instance->values.input[i], low = jl_validity[2 * i], high = jl_validity[2 * i + 1];
        char message[256];
        if (x >= low && x <= high) continue;
        snprintf(message, sizeof message, "%s is %.6g, the joint was identified from %.6g to %.6g (said once)",
                 jl_inputs[i], x, low, high);
        jl_report(instance, call, JL_WARNING, message);
        instance->outside = 1;
    }
}

int jl_exit_initialization(void *c, jl_call call)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call) || jl_present(instance, call)) return JL_ERROR;
    instance->values.initialized = 1;
    instance->values.state = instance->values.exchange ? JL_EVENT : JL_STEP;
    jl_watch(instance, call);
    return JL_OK;
}

/* References and numbers as a host passes them; FMI 2 ends before the event indicators. */
static int jl_listed(jl_instance *instance, jl_call call, const unsigned int *references, size_t count,
                     const double *x, size_t places)
{
    const unsigned int end = instance->version == 2 ? JL_FIRST_INDICATOR : JL_VARIABLES;
    size_t i;
    if (count != places)
        return jl_fail(instance, call, "%lu numbers for %lu variables", (unsigned long)places, (unsigned long)count);
    if (count && (!references || !x)) return jl_fail(instance, call, "the references or the numbers are NULL");
    for (i = 0; i < count; i++)
        if (references[i] >= end)
            return jl_fail(instance, call, "value reference %u, expected one below %u", references[i], end);
    return JL_OK;
}

int jl_get(void *c, jl_call call, const unsigned int *references, size_t count, double *x, size_t places)
{
    jl_instance *instance = (jl_instance *)c;
    double rate[JL_ROOM(JL_CONTINUOUS)] = { 0.0 }, g[JL_ROOM(JL_INDICATORS)] = { 0.0 };
    int looked = 0, status;
    size_t i;
    if (jl_enter(instance, call) || jl_listed(instance, call, references, count, x, places)) return JL_ERROR;
    for (i = 0; i < count; i++) {
        const int at = (int)references[i], kind = jl_variables[at].kind;
        const jl_values *v = &instance->values;
        if (kind == JL_INPUT) x[i] = v->input[at];
        else if (kind == JL_PARAMETER) x[i] = v->p[at - JL_FIRST_PARAMETER];
        else if (kind == JL_TIME) x[i] = v->time;
        else {
            if (v->state == JL_INSTANTIATED)
                return jl_fail(instance, call, "%s has no value before initialization", jl_variables[at].name);
            status = jl_present(instance, call);
            if (status) return status;
            if (kind == JL_OUTPUT) x[i] = v->force;
            else if (kind == JL_STATE) x[i] = v->s[at - JL_FIRST_STATE];
            else {
                if (!looked) jl_look(v, rate, g);
                looked = 1;
                x[i] = kind == JL_RATE ? rate[at - JL_FIRST_RATE] : g[at - JL_FIRST_INDICATOR];
            }
        }
    }
    return JL_OK;
}

static int jl_is_continuous(int state)
{
    int i;
    for (i = 0; i < JL_CONTINUOUS; i++)
        if (jl_continuous[i] == state) return 1;
    return 0;
}

/* Inputs always (FMI 2 gives them no start value, yet hosts set one); parameters but in continuous time; continuous
 * states there, in FMI 2 only. */
static int jl_settable(const jl_instance *instance, int at)
{
    const int state = instance->values.state, kind = jl_variables[at].kind;
    if (kind == JL_PARAMETER) return state != JL_CONTINUOUS_TIME;
    if (kind == JL_STATE)
        return state == JL_CONTINUOUS_TIME && instance->version == 2 && jl_is_continuous(at - JL_FIRST_STATE);
    return kind == JL_INPUT;
}

int jl_set(void *c, jl_call call, const unsigned int *references, size_t count, const double *x, size_t places)
{
    jl_instance *instance = (jl_instance *)c;
    size_t i;
    if (jl_enter(instance, call) || jl_listed(instance, call, references, count, x, places)) return JL_ERROR;
    for (i = 0; i < count; i++) {
        const char *name = jl_variables[references[i]].name;
        if (!jl_settable(instance, (int)references[i])) return jl_fail(instance, call, "%s cannot be set here", name);
        if (!isfinite(x[i])) return jl_fail(instance, call, "%s is %g, expected a finite number", name, x[i]);
    }
    for (i = 0; i < count; i++) {
        jl_values *v = &instance->values;
        const int at = (int)references[i], kind = jl_variables[at].kind;
        if (kind == JL_INPUT) v->input[at] = x[i];
        else if (kind == JL_STATE) v->s[at - JL_FIRST_STATE] = x[i];
        else {
            v->p[at - JL_FIRST_PARAMETER] = x[i];
            v->sound = 0;
        }
        v->fresh = 0;
    }
    return JL_OK;
}

int jl_do_step(void *c, jl_call call, double time, double h)
{
    jl_instance *instance = (jl_instance *)c;
    jl_values *v;
    double after[JL_ROOM(JL_STATES)], force;
    if (jl_enter(instance, call)) return JL_ERROR;
    v = &instance->values;
    if (!isfinite(time) || !isfinite(h) || !(h > 0.0))
        return jl_fail(instance, call, "a step of %.17g s from %.17g s, expected one above 0 from a finite time", h,
                       time);
    /* Sums of steps round off: a thousandth of a step beyond the end is not past it. */
    if (time + h > v->stop + 1e-3 * h)
        return jl_fail(instance, call, "a step to %.17g s, the stop time is %.17g s", time + h, v->stop);
    if (jl_prepare(instance, call)) return JL_ERROR;
    force = jl_step(v->p, v->s, v->input[0], v->input[1], h, after);
    if (!isfinite(force) || !jl_all_finite(after, JL_STATES))
        return jl_no_number(instance, call, "the force or a state after the step");
    memcpy(v->s, after, JL_STATES * sizeof *after);
    v->force = force;
    v->fresh = 1;
    v->time = time + h;
    jl_watch(instance, call);
    return JL_OK;
}
