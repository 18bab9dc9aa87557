/* FMI 2.0: the 44 functions, in terms of instance.h. Types from the standard's fmi2FunctionTypes.h; the functions are
 * declared here, because copies of fmi2Functions.h differ in what they make of FMI2_FUNCTION_PREFIX. */
#include <string.h>
#include "fmi2FunctionTypes.h"
#include "instance.h"

#define JL_2(name) JL_NAME(fmi2##name)
#define JL_DECLARE_2(name, co_simulation, model_exchange) JL_EXPORT name##TYPE JL_NAME(name);

JL_EXPORT fmi2GetTypesPlatformTYPE JL_2(GetTypesPlatform);
JL_EXPORT fmi2GetVersionTYPE JL_2(GetVersion);
JL_EXPORT fmi2InstantiateTYPE JL_2(Instantiate);
JL_EXPORT fmi2FreeInstanceTYPE JL_2(FreeInstance);
JL_CALLS_2(JL_DECLARE_2)

#define JL_STATUS_2(call) return (fmi2Status)(call)

const char *JL_2(GetTypesPlatform)(void) { return fmi2TypesPlatform; }

const char *JL_2(GetVersion)(void) { return "2.0"; }

static void jl_log_2(const jl_instance *instance, int status, const char *category, const char *message)
{
    fmi2CallbackLogger logger = (fmi2CallbackLogger)instance->logger;
    logger(instance->environment, instance->name, (fmi2Status)status, category, "%s", message);
}

/* Errors and warnings are told whether or not debug logging is on; fmi2SetDebugLogging can silence them. */
fmi2Component JL_2(Instantiate)(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                                fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                                fmi2Boolean visible, fmi2Boolean loggingOn)
{
    jl_instance host;
    memset(&host, 0, sizeof host);
    host.version = 2;
    host.errors = host.warnings = 1;
    host.name = instanceName ? instanceName : jl_identifier;
    host.log = jl_log_2;
    if (functions) {
        host.environment = functions->componentEnvironment;
        host.logger = (void (*)(void))functions->logger;
    }
    (void)fmuResourceLocation, (void)visible, (void)loggingOn;
    if (fmuType == fmi2ModelExchange || fmuType == fmi2CoSimulation)
        return jl_new(&host, fmuType == fmi2ModelExchange, instanceName, fmuGUID);
    jl_report(&host, JL_INSTANTIATE, JL_ERROR, "expected model exchange or co-simulation");
    return NULL;
}

fmi2Status JL_2(SetupExperiment)(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                                 fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    JL_STATUS_2(jl_experiment(c, call_fmi2SetupExperiment, toleranceDefined ? tolerance : 0.0, startTime, stopTimeDefined,
                              stopTime));
}

fmi2Status JL_2(EnterInitializationMode)(fmi2Component c)
{
    JL_STATUS_2(jl_move(c, call_fmi2EnterInitializationMode, JL_INITIALIZATION));
}

fmi2Status JL_2(GetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    JL_STATUS_2(jl_get(c, call_fmi2GetReal, vr, n, value, n));
}

fmi2Status JL_2(SetReal)(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    JL_STATUS_2(jl_set(c, call_fmi2SetReal, vr, n, value, n));
}

/* Every variable is a Real: the other types may be asked for nothing. */
#define JL_ABSENT_2(type) \
    fmi2Status JL_2(Get##type)(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2##type value[]) \
    { \
        (void)vr, (void)value; \
        JL_STATUS_2(jl_refuse(c, call_fmi2Get##type, n, "there are no variables of the type " #type)); \
    } \
    fmi2Status JL_2(Set##type)(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2##type value[]) \
    { \
        (void)vr, (void)value; \
        JL_STATUS_2(jl_refuse(c, call_fmi2Set##type, n, "there are no variables of the type " #type)); \
    }
JL_ABSENT_2(Integer)
JL_ABSENT_2(Boolean)
JL_ABSENT_2(String)

fmi2Status JL_2(GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    JL_STATUS_2(jl_save(c, call_fmi2GetFMUstate, state));
}

fmi2Status JL_2(SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
    JL_STATUS_2(jl_restore(c, call_fmi2SetFMUstate, state));
}

fmi2Status JL_2(FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    JL_STATUS_2(jl_drop(c, call_fmi2FreeFMUstate, state));
}

fmi2Status JL_2(SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    JL_STATUS_2(jl_saved_size(c, call_fmi2SerializedFMUstateSize, state, size));
}

fmi2Status JL_2(SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    JL_STATUS_2(jl_serialize(c, call_fmi2SerializeFMUstate, state, bytes, size));
}

fmi2Status JL_2(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
{
    JL_STATUS_2(jl_deserialize(c, call_fmi2DeSerializeFMUstate, bytes, size, state));
}

fmi2Status JL_2(GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[], size_t nUnknown,
                                          const fmi2ValueReference knowns[], size_t nKnown, const fmi2Real seed[],
                                          fmi2Real result[])
{
    jl_directions asked;
    asked.unknowns = unknowns, asked.unknown_count = nUnknown;
    asked.knowns = knowns, asked.known_count = nKnown;
    asked.seed = seed, asked.seed_count = nKnown;
    asked.result = result, asked.result_count = nUnknown;
    asked.adjoint = 0;
    JL_STATUS_2(jl_derivative(c, call_fmi2GetDirectionalDerivative, &asked));
}

#define JL_FMI(name) JL_2(name)
#define JL_CALLED(name) call_fmi2##name
#define JL_T(name) fmi2##name
#define JL_HANDLE fmi2Component
#define JL_REAL fmi2Real
#include "same_calls.h"

/* Model exchange */

fmi2Status JL_2(NewDiscreteStates)(fmi2Component c, fmi2EventInfo *info)
{
    int jumped = 0;
    if (jl_new_discrete_states(c, call_fmi2NewDiscreteStates, info ? &jumped : NULL)) return fmi2Error;
    memset(info, 0, sizeof *info);
    info->valuesOfContinuousStatesChanged = jumped ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status JL_2(GetDerivatives)(fmi2Component c, fmi2Real x[], size_t n)
{
    JL_STATUS_2(jl_get_rates(c, call_fmi2GetDerivatives, x, n));
}

/* Co-simulation */

fmi2Status JL_2(SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                         const fmi2Integer order[], const fmi2Real value[])
{
    JL_STATUS_2(jl_set_slopes(c, call_fmi2SetRealInputDerivatives, vr, n, order, value));
}

fmi2Status JL_2(GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                          const fmi2Integer order[], fmi2Real value[])
{
    JL_STATUS_2(jl_output_rates(c, call_fmi2GetRealOutputDerivatives, vr, n, order, value, n));
}

fmi2Status JL_2(DoStep)(fmi2Component c, fmi2Real time, fmi2Real h, fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    JL_STATUS_2(jl_do_step(c, call_fmi2DoStep, time, h));
}

fmi2Status JL_2(CancelStep)(fmi2Component c) { JL_STATUS_2(jl_refuse(c, call_fmi2CancelStep, 0, "")); }

/* No step is ever pending or discarded: of its status only the last time and the end can be told. */
#define JL_STATUS_OF(function, type, known, answer) \
    fmi2Status JL_2(function)(fmi2Component c, const fmi2StatusKind kind, type *value) \
    { \
        jl_instance *instance = (jl_instance *)c; \
        if (jl_refuse(c, call_fmi2##function, !value, "the place of the value is NULL")) return fmi2Error; \
        if (!(known)) return fmi2Discard; \
        *value = (answer); \
        (void)kind, (void)instance; \
        return fmi2OK; \
    }
JL_STATUS_OF(GetStatus, fmi2Status, 0, fmi2OK)
JL_STATUS_OF(GetRealStatus, fmi2Real, kind == fmi2LastSuccessfulTime, instance->values.time)
JL_STATUS_OF(GetIntegerStatus, fmi2Integer, 0, 0)
JL_STATUS_OF(GetBooleanStatus, fmi2Boolean, kind == fmi2Terminated, fmi2False)
JL_STATUS_OF(GetStringStatus, fmi2String, 0, "")
