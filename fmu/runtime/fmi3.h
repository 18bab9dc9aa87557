/* FMI 3.0: declarations of its 75 functions. Types from the standard's fmi3FunctionTypes.h. */
#ifndef JL_FMI3_H
#define JL_FMI3_H

#include "fmi3FunctionTypes.h"
#include "instance.h"

#define JL_3(name) JL_NAME(fmi3##name)
#define JL_DECLARE_3(name, co_simulation, model_exchange) JL_EXPORT name##TYPE JL_NAME(name);
#define JL_STATUS_3(call) return (fmi3Status)(call)

JL_EXPORT fmi3GetVersionTYPE JL_3(GetVersion);
JL_EXPORT fmi3InstantiateModelExchangeTYPE JL_3(InstantiateModelExchange);
JL_EXPORT fmi3InstantiateCoSimulationTYPE JL_3(InstantiateCoSimulation);
JL_EXPORT fmi3InstantiateScheduledExecutionTYPE JL_3(InstantiateScheduledExecution);
JL_EXPORT fmi3FreeInstanceTYPE JL_3(FreeInstance);
JL_CALLS_3(JL_DECLARE_3)

#endif
