/* Values of an instance: set and get, and the steps of co-simulation. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "instance.h"

void jl_start(jl_values *v)
{
    int i;
    v->state = JL_INSTANTIATED;
    v->stop = (double)INFINITY;
    for (i = 0; i < JL_INPUTS; i++) v->u[i] = jl_variables[i].start;
    for (i = 0; i < JL_STRUCTURE; i++) v->s[i] = jl_rest[i];
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
    double motion[JL_ROOM(JL_MOTIONS)] = { 0.0 };
    char message[512];
    jl_motion(v->s, v->u, motion);
    if (JL_JOINTS)
        snprintf(message, sizeof message, "%s is no finite number at %s %.17g m, %s %.17g m/s", what,
                 jl_motion_names[0], motion[0], jl_motion_names[1], motion[1]);
    else snprintf(message, sizeof message, "%s is no finite number", what);
    if (v->state != JL_CONTINUOUS_TIME) return jl_fail(instance, call, "%s", message);
    jl_report(instance, call, JL_DISCARD, message);
    return JL_DISCARD;
}

/* The parameters are sound, and the joints follow the displacement until initialization ends. */
int jl_prepare(jl_instance *instance, jl_call call)
{
    jl_values *v = &instance->values;
    if (!v->sound) {
        char message[512] = "";
        if (jl_check(v->p, message, sizeof message)) return jl_fail(instance, call, "%s", message);
        v->sound = 1;
    }
    if (!v->initialized && !v->fresh) {
        double motion[JL_ROOM(JL_MOTIONS)];
        jl_motion(v->s, v->u, motion);
        jl_begin(v->p, motion, v->s + JL_STRUCTURE, v->m);
    }
    return JL_OK;
}

/* The outputs of the present inputs, parameters and states; no state moves. Of a closed structure the motions of ports
 * (`much` 1) take little, all outputs and with them the states in s much more. */
static int jl_present(jl_instance *instance, jl_call call, int much)
{
    jl_values *v = &instance->values;
    double motion[JL_ROOM(JL_MOTIONS)], after[JL_ROOM(JL_MEMORY)], f[JL_ROOM(JL_JOINTS)], y[JL_ROOM(JL_OUTPUTS)];
    if (jl_prepare(instance, call)) return JL_ERROR;
    if (v->fresh >= much) return JL_OK;
    if (v->closed && much == 1) {
        jl_port_motions(v, v->y);
        v->fresh = 1;
        return JL_OK;
    }
    if (v->closed) jl_open(v);
    jl_motion(v->s, v->u, motion);
    if (v->closed) jl_step(v->p, v->s + JL_STRUCTURE, motion, 0.0, after, f);
    else if (v->exchange || JL_STRUCTURE) jl_force(v->p, v->s + JL_STRUCTURE, v->m, motion, f);
    else jl_step(v->p, v->s, motion, 0.0, after, f);
    jl_outputs(v->s, v->u, f, y);
    if (!jl_all_finite(y, JL_OUTPUTS))
        return jl_no_number(instance, call, JL_OUTPUTS == 1 ? "the force" : "an output");
    memcpy(v->y, y, JL_OUTPUTS * sizeof *y);
    v->fresh = 2;
    return JL_OK;
}

/* Rates of the continuous states and event indicators. Where co-simulation takes the joints' own steps nothing keeps
 * the modes: they are settled for the look on copies. */
void jl_look(const jl_values *v, double *rate, double *g)
{
    double s[JL_ROOM(JL_STATES)], motion[JL_ROOM(JL_MOTIONS)], every[JL_ROOM(JL_STATES)];
    int m[JL_ROOM(JL_MODES)], i;
    memcpy(s, v->s, sizeof s);
    memcpy(m, v->m, sizeof m);
    jl_motion(s, v->u, motion);
    if (v->closed || (!v->exchange && !JL_STRUCTURE)) (void)jl_event(v->p, s + JL_STRUCTURE, m, motion);
    if (g) jl_indicators(v->p, s + JL_STRUCTURE, m, motion, g);
    if (!rate) return;
    jl_all_rates(v->p, s, m, v->u, every);
    for (i = 0; i < JL_CONTINUOUS; i++) rate[i] = every[jl_continuous[i]];
}

/* Says once that an accepted point lies outside the range in which a joint was identified. */
void jl_watch_at(jl_instance *instance, jl_call call, const double *motion)
{
    int i;
#ifdef JL_CONDITIONS
    for (i = 0; i < JL_MOTIONS; i++) {
        const int kind = i < 2 * JL_JOINTS ? JL_MOTION_SAID : JL_CONDITION_SAID;
#else
    for (i = 0; i < JL_MOTIONS && !instance->outside; i++) {
#endif
        const double x = motion[i], low = jl_validity[2 * i], high = jl_validity[2 * i + 1];
        char message[512];
#ifdef JL_CONDITIONS
        if (instance->outside & kind) continue;
#endif
        if (x >= low && x <= high) continue;
        snprintf(message, sizeof message, "%s is %.6g, the joint was identified from %.6g to %.6g (said once)",
                 jl_motion_names[i], x, low, high);
        jl_report(instance, call, JL_WARNING, message);
#ifdef JL_CONDITIONS
        instance->outside |= kind;
#else
        instance->outside = 1;
#endif
    }
}

void jl_watch(jl_instance *instance, jl_call call)
{
    double motion[JL_ROOM(JL_MOTIONS)];
#ifdef JL_CONDITIONS
    if (instance->outside == (JL_MOTION_SAID | JL_CONDITION_SAID)) return;
#else
    if (instance->outside) return;
#endif
    jl_motion(instance->values.s, instance->values.u, motion);
    jl_watch_at(instance, call, motion);
}

int jl_exit_initialization(void *c, jl_call call)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call) || jl_present(instance, call, 2)) return JL_ERROR;
    instance->values.initialized = 1;
#ifdef JL_CONDITIONS
    JL_HOLD(&instance->values);
#endif
    instance->values.state = instance->values.exchange ? JL_EVENT : JL_STEP;
    jl_watch(instance, call);
    return JL_OK;
}

/* References and numbers as a host passes them; FMI 2 ends before the event indicators. */
int jl_listed(jl_instance *instance, jl_call call, const unsigned int *references, size_t count, const double *x,
              size_t places)
{
    const unsigned int end = instance->version == 2 ? JL_FIRST_INDICATOR : JL_VARIABLES;
    size_t i;
    if (count != places)
        return jl_fail(instance, call, "%lu numbers for %lu variables", (unsigned long)places, (unsigned long)count);
    if (count && (!references || !x)) return jl_fail(instance, call, "the references or the numbers are NULL");
    for (i = 0; i < count; i++)
        if (JL_PLACE(references[i]) >= end)
            return jl_fail(instance, call, "value reference %u, expected one from 1 to %u", references[i], end);
    return JL_OK;
}

/* A state of the structure: it has a start value. */
static int jl_is_structure(int at)
{
    return at >= JL_FIRST_STATE && at < JL_FIRST_STATE + JL_STRUCTURE;
}

int jl_get(void *c, jl_call call, const unsigned int *references, size_t count, double *x, size_t places)
{
    jl_instance *instance = (jl_instance *)c;
    double rate[JL_ROOM(JL_CONTINUOUS)] = { 0.0 }, g[JL_ROOM(JL_INDICATORS)] = { 0.0 };
    int looked = 0, status;
    size_t i;
    if (jl_enter(instance, call) || jl_listed(instance, call, references, count, x, places)) return JL_ERROR;
    for (i = 0; i < count; i++) {
        const int at = (int)JL_PLACE(references[i]), kind = jl_variables[at].kind;
        const jl_values *v = &instance->values;
        if (kind == JL_INPUT) x[i] = v->u[at];
        else if (kind == JL_PARAMETER) x[i] = v->p[at - JL_FIRST_PARAMETER];
        else if (kind == JL_TIME) x[i] = v->time;
        else {
            if (v->state == JL_INSTANTIATED && !jl_is_structure(at))
                return jl_fail(instance, call, "%s has no value before initialization", jl_variables[at].name);
            status = jl_is_structure(at) && !v->closed ? JL_OK
                                                       : jl_present(instance, call, 1 + (at - JL_FIRST_OUTPUT >= JL_PORTS));
            if (status) return status;
            if (kind == JL_OUTPUT) x[i] = v->y[at - JL_FIRST_OUTPUT];
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
 * states there, in FMI 2 only; those of the structure before initialization ends, as they have a start value. */
static int jl_settable(const jl_instance *instance, int at)
{
    const int state = instance->values.state, kind = jl_variables[at].kind;
    if (kind == JL_PARAMETER) return state != JL_CONTINUOUS_TIME && state != JL_INTERMEDIATE;
    if (jl_is_structure(at) && !instance->values.initialized) return 1;
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
        const int at = (int)JL_PLACE(references[i]);
        const char *name = jl_variables[at].name;
        if (!jl_settable(instance, at)) return jl_fail(instance, call, "%s cannot be set here", name);
        if (!isfinite(x[i])) return jl_fail(instance, call, "%s is %g, expected a finite number", name, x[i]);
    }
    for (i = 0; i < count; i++) {
        jl_values *v = &instance->values;
        const int at = (int)JL_PLACE(references[i]), kind = jl_variables[at].kind;
        if (kind == JL_INPUT) {
            if (v->behind && v->u[at] != x[i]) v->late = 1;
            v->told = v->time;
            v->u[at] = x[i];
        } else if (kind == JL_STATE) v->s[at - JL_FIRST_STATE] = x[i];
        else {
            v->p[at - JL_FIRST_PARAMETER] = x[i];
            v->sound = v->bent = 0;
        }
        v->fresh = 0;
    }
    return JL_OK;
}

/* The joints' own steps at the held motion; NULL or what is no number. */
static const char *jl_advance(jl_values *v, double h)
{
    double motion[JL_ROOM(JL_MOTIONS)], after[JL_ROOM(JL_MEMORY)], f[JL_ROOM(JL_JOINTS)], y[JL_ROOM(JL_OUTPUTS)];
    jl_motion(v->s, v->u, motion);
    jl_step(v->p, v->s, motion, h, after, f);
    jl_outputs(v->s, v->u, f, y);
    if (!jl_all_finite(y, JL_OUTPUTS) || !jl_all_finite(after, JL_MEMORY)) return "the force or a state after the step";
    memcpy(v->s, after, JL_MEMORY * sizeof *after);
    memcpy(v->y, y, JL_OUTPUTS * sizeof *y);
    return NULL;
}

int jl_do_step(void *c, jl_call call, double time, double h)
{
    jl_instance *instance = (jl_instance *)c;
    jl_values *v;
    const char *fault;
    double ahead[JL_ROOM(JL_INPUTS)];
    if (jl_enter(instance, call)) return JL_ERROR;
    v = &instance->values;
    if (!isfinite(time) || !isfinite(h) || !(h > 0.0))
        return jl_fail(instance, call, "a step of %.17g s from %.17g s, expected one above 0 from a finite time", h,
                       time);
    if (v->timed && fabs(time - v->time) > 1e-3 * h + 1e-12 * fabs(time))
        return jl_fail(instance, call, "a step from %.17g s, expected one from %.17g s, where the last one ended", time,
                       v->time);
    /* Sums of steps round off: a thousandth of a step beyond the end is not past it. */
    if (time + h > v->stop + 1e-3 * h)
        return jl_fail(instance, call, "a step to %.17g s, the stop time is %.17g s", time + h, v->stop);
    if (jl_prepare(instance, call)) return JL_ERROR;
    if (JL_STRUCTURE) {
        const int closed = jl_is_closed(v);
        if (jl_ask_inputs(instance, time, h)) return JL_ERROR;
        jl_inputs_at(v, h, ahead);
        if (v->closed && !closed) jl_open(v), v->closed = 0, v->stride = 0.0;
        fault = closed ? jl_exponential(instance, call, h) : jl_integrate(v, h);
        if (fault) return jl_fail(instance, call, "between %.9g s and %.9g s %s", time, time + h, fault);
        v->fresh = 0;
        memcpy(v->u, ahead, sizeof v->u);
        memset(v->du, 0, sizeof v->du), memset(v->ddu, 0, sizeof v->ddu); /* told anew for every step */
        if (!closed && jl_present(instance, call, 2)) return JL_ERROR;
    } else {
        fault = jl_advance(v, h);
        if (fault) return jl_no_number(instance, call, fault);
        v->fresh = 2;
    }
#ifdef JL_CONDITIONS
    JL_HOLD(v);
#endif
    v->time = time + h;
    v->timed = 1;
    if (!v->closed) jl_watch(instance, call);
    return JL_OK;
}
