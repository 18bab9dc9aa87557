/* Life cycle of an instance: the call order, the log, what may be entered from where. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "instance.h"

#define JL_ROW(name, co_simulation, model_exchange) { #name, { co_simulation, model_exchange } },
/* Arrays, not pointers: nothing for the loader to relocate. */
static const struct {
    char name[36];
    char states[2][7];
} jl_calls[] = { JL_CALLS_2(JL_ROW) JL_CALLS_3(JL_ROW) { "instantiation", { "", "" } } };
#undef JL_ROW

static const char *jl_state_name(int state)
{
    switch (state) {
    case JL_INSTANTIATED: return "instantiated";
    case JL_INITIALIZATION: return "initialization mode";
    case JL_EVENT: return "event mode";
    case JL_CONTINUOUS_TIME: return "continuous-time mode";
    case JL_STEP: return "step mode";
    case JL_INTERMEDIATE: return "intermediate update mode";
    case JL_TERMINATED: return "terminated";
    default: return "error";
    }
}

void jl_report(const jl_instance *instance, jl_call call, int status, const char *message)
{
    const int wanted = status == JL_ERROR ? instance->errors : instance->warnings;
    char text[1024];
    /* Why there is no instance is always told. */
    if (!instance->logger || !(wanted || call == JL_INSTANTIATE)) return;
    snprintf(text, sizeof text, "%s: %s", jl_calls[call].name, message);
    instance->log(instance, status, status == JL_ERROR ? "logStatusError" : "logStatusWarning", text);
}

int jl_fail(jl_instance *instance, jl_call call, const char *format, ...)
{
    char message[896];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    jl_report(instance, call, JL_ERROR, message);
    instance->values.state = JL_FAILED;
    return JL_ERROR;
}

int jl_enter(jl_instance *instance, jl_call call)
{
    if (!instance) return JL_ERROR;
    if (strchr(jl_calls[call].states[instance->values.exchange], instance->values.state)) return JL_OK;
    return jl_fail(instance, call, "not allowed in state \"%s\" of %s", jl_state_name(instance->values.state),
                   instance->values.exchange ? "model exchange" : "co-simulation");
}

jl_instance *jl_new(const jl_instance *host, int exchange, const char *name, const char *token)
{
    jl_instance *instance;
    char *copy;
    size_t length;
    if (!token || strcmp(token, jl_token) != 0) {
        char message[896];
        snprintf(message, sizeof message, "the token is \"%s\", expected \"%s\": the description and the binary differ",
                 token ? token : "NULL", jl_token);
        jl_report(host, JL_INSTANTIATE, JL_ERROR, message);
        return NULL;
    }
    if (exchange && !JL_EXCHANGE) {
        jl_report(host, JL_INSTANTIATE, JL_ERROR, "this joint has co-simulation only");
        return NULL;
    }
    if (!name) name = jl_identifier;
    length = strlen(name) + 1;
    instance = (jl_instance *)calloc(1, sizeof *instance);
    copy = (char *)calloc(length, 1);
    if (!instance || !copy) {
        jl_report(host, JL_INSTANTIATE, JL_ERROR, "there is no memory left");
        free(instance);
        free(copy);
        return NULL;
    }
    *instance = *host;
    memcpy(copy, name, length);
    instance->name = copy;
    instance->flows = NULL;
    instance->next_flow = 0;
    memset(&instance->values, 0, sizeof instance->values);
    instance->values.exchange = exchange;
    jl_start(&instance->values);
    return instance;
}

void jl_free(void *instance)
{
    if (!instance) return;
    free((void *)((jl_instance *)instance)->name);
    free(((jl_instance *)instance)->flows);
    free(instance);
}

int jl_logging(void *c, jl_call call, int on, size_t count, const char *const *categories)
{
    jl_instance *instance = (jl_instance *)c;
    int errors = on && count == 0, warnings = errors;
    size_t i;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (count && !categories)
        return jl_fail(instance, call, "the categories are NULL, expected %lu", (unsigned long)count);
    for (i = 0; i < count; i++) {
        const char *category = categories[i] ? categories[i] : "NULL";
        /* Hosts name categories of other FMUs, too. */
        if (on && strcmp(category, "logStatusError") == 0) errors = 1;
        if (on && strcmp(category, "logStatusWarning") == 0) warnings = 1;
    }
    instance->errors = errors;
    instance->warnings = warnings;
    return JL_OK;
}

int jl_experiment(void *c, jl_call call, double tolerance, double start, int stop_defined, double stop)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (!isfinite(start)) return jl_fail(instance, call, "the start time is %.17g, expected a finite number", start);
    if (stop_defined && !(isfinite(stop) && stop >= start))
        return jl_fail(instance, call, "the stop time is %.17g, expected %.17g s or later", stop, start);
    instance->values.tolerance = tolerance > 0.0 ? fmin(fmax(tolerance, 1e-9), 1e-3) : 0.0;
    instance->values.time = start;
    instance->values.timed = 1;
    instance->values.stop = stop_defined ? stop : (double)INFINITY;
    return JL_OK;
}

int jl_move(void *c, jl_call call, int state)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call)) return JL_ERROR;
    instance->values.state = state;
    return JL_OK;
}

int jl_reset(void *c, jl_call call)
{
    jl_instance *instance = (jl_instance *)c;
    int exchange;
    if (jl_enter(instance, call)) return JL_ERROR;
    exchange = instance->values.exchange;
    memset(&instance->values, 0, sizeof instance->values);
    instance->values.exchange = exchange;
    instance->outside = 0;
    jl_start(&instance->values);
    return JL_OK;
}

int jl_refuse(void *c, jl_call call, size_t count, const char *reason)
{
    jl_instance *instance = (jl_instance *)c;
    if (jl_enter(instance, call)) return JL_ERROR;
    return count ? jl_fail(instance, call, "%s", reason) : JL_OK;
}
