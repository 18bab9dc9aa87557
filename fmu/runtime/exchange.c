/* Model exchange: events, time, and the vectors of states, rates and event indicators. */
#include <math.h>
#include <string.h>
#include "instance.h"

/* Continuous states that an event changed: states that only events change do not count. */
static int jl_moved(const double *before, const double *after)
{
    int i;
    for (i = 0; i < JL_CONTINUOUS; i++)
        if (before[jl_continuous[i]] != after[jl_continuous[i]]) return 1;
    return 0;
}

int jl_new_discrete_states(void *c, jl_call call, int *jumped)
{
    jl_instance *instance = (jl_instance *)c;
    jl_values *v;
    double before[JL_ROOM(JL_STATES)], motion[JL_ROOM(JL_MOTIONS)];
    if (jl_refuse(c, call, !jumped, "the place of the answer is NULL") || jl_prepare(instance, call)) return JL_ERROR;
    v = &instance->values;
    memcpy(before, v->s, sizeof before);
    jl_motion(v->s, v->u, motion);
    *jumped = jl_event(v->p, v->s + JL_STRUCTURE, v->m, motion) && jl_moved(before, v->s);
    v->fresh = v->behind = v->late = 0;
    v->told = v->time;
    if (!jl_all_finite(v->s, JL_STATES)) return jl_no_number(instance, call, "a state after the event");
    jl_watch(instance, call);
    return JL_OK;
}

int jl_continuous_time(void *c, jl_call call)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call) || jl_prepare(instance, call)) return JL_ERROR;
    instance->values.state = JL_CONTINUOUS_TIME;
    return JL_OK;
}

/* Some hosts hold a given signal while their solver goes past an output point, and tell new forces only then: rates were
 * asked for times without them. An event makes their solver drop what it stepped too far. */
int jl_completed_step(void *c, jl_call call, int answerable, int *event)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_refuse(c, call, !answerable, "the place of the answer is NULL")) return JL_ERROR;
    jl_watch(instance, call);
    *event = instance->values.late;
    instance->values.behind = instance->values.late = 0;
    return JL_OK;
}

int jl_set_time(void *c, jl_call call, double time)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (!isfinite(time)) return jl_fail(instance, call, "the time is %g, expected a finite number", time);
    instance->values.time = time;
    return JL_OK;
}

/* The call is in order, the array has the length that is due. */
static int jl_array(jl_instance *instance, jl_call call, const double *x, size_t count, int due)
{
    if (jl_enter(instance, call)) return JL_ERROR;
    if (count != (size_t)due || (due && !x))
        return jl_fail(instance, call, "%lu numbers at %s, expected %d", (unsigned long)count, x ? "hand" : "NULL",
                       due);
    return JL_OK;
}

int jl_set_continuous_states(void *c, jl_call call, const double *x, size_t count)
{
    jl_instance *instance = (jl_instance *)c;
    int i;
    if (jl_array(instance, call, x, count, JL_CONTINUOUS)) return JL_ERROR;
    for (i = 0; i < JL_CONTINUOUS; i++)
        if (!isfinite(x[i]))
            return jl_fail(instance, call, "%s is %g, expected a finite number",
                           jl_variables[JL_FIRST_STATE + jl_continuous[i]].name, x[i]);
    for (i = 0; i < JL_CONTINUOUS; i++) instance->values.s[jl_continuous[i]] = x[i];
    instance->values.fresh = 0;
    return JL_OK;
}

int jl_get_continuous_states(void *c, jl_call call, double *x, size_t count)
{
    jl_instance *instance = (jl_instance *)c;
    int i;
    if (jl_array(instance, call, x, count, JL_CONTINUOUS) || jl_prepare(instance, call)) return JL_ERROR;
    for (i = 0; i < JL_CONTINUOUS; i++) x[i] = instance->values.s[jl_continuous[i]];
    return JL_OK;
}

int jl_get_rates(void *c, jl_call call, double *x, size_t count)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_array(instance, call, x, count, JL_CONTINUOUS) || jl_prepare(instance, call)) return JL_ERROR;
    if (JL_CONTINUOUS == 0) return JL_OK;
    if (JL_STRUCTURE && instance->values.time != instance->values.told) instance->values.behind = 1;
    jl_look(&instance->values, x, NULL);
    return jl_all_finite(x, JL_CONTINUOUS) ? JL_OK : jl_no_number(instance, call, "a rate");
}

int jl_get_indicators(void *c, jl_call call, double *x, size_t count)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_array(instance, call, x, count, JL_INDICATORS) || jl_prepare(instance, call)) return JL_ERROR;
    if (JL_INDICATORS == 0) return JL_OK;
    jl_look(&instance->values, NULL, x);
    return jl_all_finite(x, JL_INDICATORS) ? JL_OK : jl_no_number(instance, call, "an event indicator");
}

int jl_get_nominals(void *c, jl_call call, double *x, size_t count)
{
    jl_instance *instance = (jl_instance *)c;
    int i;
    if (jl_array(instance, call, x, count, JL_CONTINUOUS)) return JL_ERROR;
    for (i = 0; i < JL_CONTINUOUS; i++) {
        const double usual = jl_variables[JL_FIRST_STATE + jl_continuous[i]].start;
        x[i] = usual > 0.0 ? usual : 1.0;
    }
    return JL_OK;
}
