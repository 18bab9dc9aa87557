/* FMI 3.0: the functions that do something, in terms of instance.h. */
#include <string.h>
#include "fmi3.h"

const char *JL_3(GetVersion)(void) { return "3.0"; }

static void jl_log_3(const jl_instance *instance, int status, const char *category, const char *message)
{
    ((fmi3LogMessageCallback)instance->logger)(instance->environment, (fmi3Status)status, category, message);
}

static jl_instance jl_host_3(fmi3Boolean loggingOn, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger)
{
    jl_instance host;
    memset(&host, 0, sizeof host);
    host.version = 3;
    host.errors = host.warnings = loggingOn;
    host.environment = environment;
    host.logger = (void (*)(void))logger;
    host.log = jl_log_3;
    return host;
}

/* Values of a time to come may be set, none be had, and the step goes on whatever is answered. */
static void jl_ask_3(jl_instance *instance, double time)
{
    fmi3Boolean early = fmi3False;
    fmi3Float64 when = time;
    ((fmi3IntermediateUpdateCallback)instance->intermediate)(instance->environment, time, fmi3True, fmi3False, fmi3False,
                                                             fmi3False, &early, &when);
}

fmi3Instance JL_3(InstantiateModelExchange)(fmi3String instanceName, fmi3String token, fmi3String resourcePath,
                                            fmi3Boolean visible, fmi3Boolean loggingOn,
                                            fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage)
{
    jl_instance host = jl_host_3(loggingOn, environment, logMessage);
    (void)resourcePath, (void)visible;
    return jl_new(&host, 1, instanceName, token);
}

fmi3Instance JL_3(InstantiateCoSimulation)(fmi3String instanceName, fmi3String token, fmi3String resourcePath,
                                           fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                           fmi3Boolean earlyReturnAllowed, const fmi3ValueReference intermediate[],
                                           size_t nIntermediate, fmi3InstanceEnvironment environment,
                                           fmi3LogMessageCallback logMessage,
                                           fmi3IntermediateUpdateCallback intermediateUpdate)
{
    jl_instance host = jl_host_3(loggingOn, environment, logMessage);
    (void)resourcePath, (void)visible, (void)earlyReturnAllowed;
    (void)intermediate, (void)nIntermediate;
    if (intermediateUpdate && JL_STRUCTURE) {
        host.intermediate = (void (*)(void))intermediateUpdate;
        host.ask = jl_ask_3;
    }
    if (!eventModeUsed) return jl_new(&host, 0, instanceName, token);
    jl_report(&host, JL_INSTANTIATE, JL_ERROR, "co-simulation has no event mode here");
    return NULL;
}

fmi3Instance JL_3(InstantiateScheduledExecution)(fmi3String instanceName, fmi3String token, fmi3String resourcePath,
                                                 fmi3Boolean visible, fmi3Boolean loggingOn,
                                                 fmi3InstanceEnvironment environment,
                                                 fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                                 fmi3LockPreemptionCallback lockPreemption,
                                                 fmi3UnlockPreemptionCallback unlockPreemption)
{
    jl_instance host = jl_host_3(loggingOn, environment, logMessage);
    (void)instanceName, (void)token, (void)resourcePath, (void)visible;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    jl_report(&host, JL_INSTANTIATE, JL_ERROR,
              "there is no scheduled execution, expected co-simulation or model exchange");
    return NULL;
}

fmi3Status JL_3(EnterInitializationMode)(fmi3Instance c, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                         fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    if (jl_experiment(c, call_fmi3EnterInitializationMode, toleranceDefined ? tolerance : 0.0, startTime, stopTimeDefined,
                              stopTime)) return fmi3Error;
    JL_STATUS_3(jl_move(c, call_fmi3EnterInitializationMode, JL_INITIALIZATION));
}

fmi3Status JL_3(GetFloat64)(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 x[], size_t places)
{
    JL_STATUS_3(jl_get(c, call_fmi3GetFloat64, vr, n, x, places));
}

fmi3Status JL_3(SetFloat64)(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 x[],
                            size_t places)
{
    JL_STATUS_3(jl_set(c, call_fmi3SetFloat64, vr, n, x, places));
}

fmi3Status JL_3(GetFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    JL_STATUS_3(jl_save(c, call_fmi3GetFMUState, state));
}

fmi3Status JL_3(SetFMUState)(fmi3Instance c, fmi3FMUState state)
{
    JL_STATUS_3(jl_restore(c, call_fmi3SetFMUState, state));
}

fmi3Status JL_3(FreeFMUState)(fmi3Instance c, fmi3FMUState *state)
{
    JL_STATUS_3(jl_drop(c, call_fmi3FreeFMUState, state));
}

fmi3Status JL_3(SerializedFMUStateSize)(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    JL_STATUS_3(jl_saved_size(c, call_fmi3SerializedFMUStateSize, state, size));
}

fmi3Status JL_3(SerializeFMUState)(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    JL_STATUS_3(jl_serialize(c, call_fmi3SerializeFMUState, state, bytes, size));
}

fmi3Status JL_3(DeserializeFMUState)(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    JL_STATUS_3(jl_deserialize(c, call_fmi3DeserializeFMUState, bytes, size, state));
}

#define JL_DERIVATIVE_3(name, transposed) \
    fmi3Status JL_3(name)(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                          const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                          fmi3Float64 result[], size_t nResult) \
    { \
        jl_directions asked; \
        asked.unknowns = unknowns, asked.unknown_count = nUnknowns; \
        asked.knowns = knowns, asked.known_count = nKnowns; \
        asked.seed = seed, asked.seed_count = nSeed; \
        asked.result = result, asked.result_count = nResult; \
        asked.adjoint = transposed; \
        JL_STATUS_3(jl_derivative(c, call_fmi3##name, &asked)); \
    }
JL_DERIVATIVE_3(GetDirectionalDerivative, 0)
JL_DERIVATIVE_3(GetAdjointDerivative, 1)

#define JL_FMI(name) JL_3(name)
#define JL_CALLED(name) call_fmi3##name
#define JL_T(name) fmi3##name
#define JL_HANDLE fmi3Instance
#define JL_REAL fmi3Float64
#include "same_calls.h"

/* Model exchange */

/* There is nothing to evaluate before fmi3UpdateDiscreteStates. */
fmi3Status JL_3(EvaluateDiscreteStates)(fmi3Instance c)
{
    JL_STATUS_3(jl_refuse(c, call_fmi3EvaluateDiscreteStates, 0, ""));
}

fmi3Status JL_3(UpdateDiscreteStates)(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                      fmi3Boolean *valuesChanged, fmi3Boolean *timeDefined, fmi3Float64 *time)
{
    const int answerable = again && terminate && nominals && valuesChanged && timeDefined && time;
    int jumped = 0;
    if (jl_new_discrete_states(c, call_fmi3UpdateDiscreteStates, answerable ? &jumped : NULL)) return fmi3Error;
    *again = *terminate = *nominals = *timeDefined = fmi3False;
    *valuesChanged = jumped != 0;
    *time = 0.0;
    return fmi3OK;
}

fmi3Status JL_3(GetContinuousStateDerivatives)(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    JL_STATUS_3(jl_get_rates(c, call_fmi3GetContinuousStateDerivatives, x, n));
}

fmi3Status JL_3(GetNumberOfEventIndicators)(fmi3Instance c, size_t *n)
{
    if (jl_refuse(c, call_fmi3GetNumberOfEventIndicators, !n, "the place of the number is NULL")) return fmi3Error;
    *n = JL_INDICATORS;
    return fmi3OK;
}

fmi3Status JL_3(GetNumberOfContinuousStates)(fmi3Instance c, size_t *n)
{
    if (jl_refuse(c, call_fmi3GetNumberOfContinuousStates, !n, "the place of the number is NULL")) return fmi3Error;
    *n = JL_CONTINUOUS;
    return fmi3OK;
}

/* Co-simulation */

fmi3Status JL_3(GetOutputDerivatives)(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                      fmi3Float64 x[], size_t places)
{
    JL_STATUS_3(jl_output_rates(c, call_fmi3GetOutputDerivatives, vr, n, orders, x, places));
}

fmi3Status JL_3(DoStep)(fmi3Instance c, fmi3Float64 time, fmi3Float64 h, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                        fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                        fmi3Float64 *lastSuccessfulTime)
{
    const int answerable = eventHandlingNeeded && terminateSimulation && earlyReturn && lastSuccessfulTime;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (jl_refuse(c, call_fmi3DoStep, !answerable, "the place of the answer is NULL")) return fmi3Error;
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = time;
    if (jl_do_step(c, call_fmi3DoStep, time, h)) return fmi3Error;
    *lastSuccessfulTime = time + h;
    return fmi3OK;
}
