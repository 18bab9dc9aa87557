/* Every FMI function that takes an instance, with arguments that are legal wherever the call is. */

#define CALLS_2(CALL) \
    CALL(fmi2SetDebugLogging, (c, 1, 0, NULL)) \
    CALL(fmi2SetupExperiment, (c, 0, 0.0, 0.0, 0, 0.0)) \
    CALL(fmi2EnterInitializationMode, (c)) \
    CALL(fmi2ExitInitializationMode, (c)) \
    CALL(fmi2Terminate, (c)) \
    CALL(fmi2Reset, (c)) \
    CALL(fmi2GetReal, (c, &input, 1, x)) \
    CALL(fmi2GetInteger, (c, NULL, 0, NULL)) \
    CALL(fmi2GetBoolean, (c, NULL, 0, NULL)) \
    CALL(fmi2GetString, (c, NULL, 0, NULL)) \
    CALL(fmi2SetReal, (c, &input, 1, x)) \
    CALL(fmi2SetInteger, (c, NULL, 0, NULL)) \
    CALL(fmi2SetBoolean, (c, NULL, 0, NULL)) \
    CALL(fmi2SetString, (c, NULL, 0, NULL)) \
    CALL(fmi2GetFMUstate, (c, &fresh)) \
    CALL(fmi2SetFMUstate, (c, saved)) \
    CALL(fmi2FreeFMUstate, (c, &fresh)) \
    CALL(fmi2SerializedFMUstateSize, (c, saved, &size)) \
    CALL(fmi2SerializeFMUstate, (c, saved, (char *)bytes, size)) \
    CALL(fmi2DeSerializeFMUstate, (c, (char *)bytes, size, &fresh)) \
    CALL(fmi2GetDirectionalDerivative, (c, &force, 1, &input, 1, x, x + 1)) \
    CALL(fmi2EnterEventMode, (c)) \
    CALL(fmi2NewDiscreteStates, (c, &info)) \
    CALL(fmi2EnterContinuousTimeMode, (c)) \
    CALL(fmi2CompletedIntegratorStep, (c, 0, flags, flags + 1)) \
    CALL(fmi2SetTime, (c, 0.0)) \
    CALL(fmi2SetContinuousStates, (c, x, 1)) \
    CALL(fmi2GetDerivatives, (c, x, 1)) \
    CALL(fmi2GetEventIndicators, (c, x, 2)) \
    CALL(fmi2GetContinuousStates, (c, x, 1)) \
    CALL(fmi2GetNominalsOfContinuousStates, (c, x, 1)) \
    CALL(fmi2SetRealInputDerivatives, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi2GetRealOutputDerivatives, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi2DoStep, (c, 0.0, 1e-3, 1)) \
    CALL(fmi2CancelStep, (c)) \
    CALL(fmi2GetStatus, (c, fmi2DoStepStatus, &status)) \
    CALL(fmi2GetRealStatus, (c, fmi2LastSuccessfulTime, x)) \
    CALL(fmi2GetIntegerStatus, (c, fmi2DoStepStatus, flags)) \
    CALL(fmi2GetBooleanStatus, (c, fmi2Terminated, flags)) \
    CALL(fmi2GetStringStatus, (c, fmi2PendingStatus, &text))

#define NOTHING (c, NULL, 0, NULL, 0)
#define CALLS_3(CALL) \
    CALL(fmi3SetDebugLogging, (c, true, 0, NULL)) \
    CALL(fmi3EnterInitializationMode, (c, false, 0.0, 0.0, false, 0.0)) \
    CALL(fmi3ExitInitializationMode, (c)) \
    CALL(fmi3EnterEventMode, (c)) \
    CALL(fmi3Terminate, (c)) \
    CALL(fmi3Reset, (c)) \
    CALL(fmi3GetFloat32, NOTHING) \
    CALL(fmi3GetFloat64, (c, &input, 1, x, 1)) \
    CALL(fmi3GetInt8, NOTHING) \
    CALL(fmi3GetUInt8, NOTHING) \
    CALL(fmi3GetInt16, NOTHING) \
    CALL(fmi3GetUInt16, NOTHING) \
    CALL(fmi3GetInt32, NOTHING) \
    CALL(fmi3GetUInt32, NOTHING) \
    CALL(fmi3GetInt64, NOTHING) \
    CALL(fmi3GetUInt64, NOTHING) \
    CALL(fmi3GetBoolean, NOTHING) \
    CALL(fmi3GetString, NOTHING) \
    CALL(fmi3GetBinary, (c, NULL, 0, NULL, NULL, 0)) \
    CALL(fmi3GetClock, (c, NULL, 0, NULL)) \
    CALL(fmi3SetFloat32, NOTHING) \
    CALL(fmi3SetFloat64, (c, &input, 1, x, 1)) \
    CALL(fmi3SetInt8, NOTHING) \
    CALL(fmi3SetUInt8, NOTHING) \
    CALL(fmi3SetInt16, NOTHING) \
    CALL(fmi3SetUInt16, NOTHING) \
    CALL(fmi3SetInt32, NOTHING) \
    CALL(fmi3SetUInt32, NOTHING) \
    CALL(fmi3SetInt64, NOTHING) \
    CALL(fmi3SetUInt64, NOTHING) \
    CALL(fmi3SetBoolean, NOTHING) \
    CALL(fmi3SetString, NOTHING) \
    CALL(fmi3SetBinary, (c, NULL, 0, NULL, NULL, 0)) \
    CALL(fmi3SetClock, (c, NULL, 0, NULL)) \
    CALL(fmi3GetNumberOfVariableDependencies, (c, 2, &size)) \
    CALL(fmi3GetVariableDependencies, (c, 2, NULL, NULL, NULL, NULL, 0)) \
    CALL(fmi3GetFMUState, (c, &fresh)) \
    CALL(fmi3SetFMUState, (c, saved)) \
    CALL(fmi3FreeFMUState, (c, &fresh)) \
    CALL(fmi3SerializedFMUStateSize, (c, saved, &size)) \
    CALL(fmi3SerializeFMUState, (c, saved, bytes, size)) \
    CALL(fmi3DeserializeFMUState, (c, bytes, size, &fresh)) \
    CALL(fmi3GetDirectionalDerivative, (c, &force, 1, &input, 1, x, 1, x + 1, 1)) \
    CALL(fmi3GetAdjointDerivative, (c, &force, 1, &input, 1, x, 1, x + 1, 1)) \
    CALL(fmi3EnterConfigurationMode, (c)) \
    CALL(fmi3ExitConfigurationMode, (c)) \
    CALL(fmi3GetIntervalDecimal, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi3GetIntervalFraction, (c, NULL, 0, NULL, NULL, NULL)) \
    CALL(fmi3GetShiftDecimal, (c, NULL, 0, NULL)) \
    CALL(fmi3GetShiftFraction, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi3SetIntervalDecimal, (c, NULL, 0, NULL)) \
    CALL(fmi3SetIntervalFraction, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi3SetShiftDecimal, (c, NULL, 0, NULL)) \
    CALL(fmi3SetShiftFraction, (c, NULL, 0, NULL, NULL)) \
    CALL(fmi3EvaluateDiscreteStates, (c)) \
    CALL(fmi3UpdateDiscreteStates, (c, yes, yes + 1, yes + 2, yes + 3, yes + 4, x)) \
    CALL(fmi3EnterContinuousTimeMode, (c)) \
    CALL(fmi3CompletedIntegratorStep, (c, true, yes, yes + 1)) \
    CALL(fmi3SetTime, (c, 0.0)) \
    CALL(fmi3SetContinuousStates, (c, x, 1)) \
    CALL(fmi3GetContinuousStateDerivatives, (c, x, 1)) \
    CALL(fmi3GetEventIndicators, (c, x, 2)) \
    CALL(fmi3GetContinuousStates, (c, x, 1)) \
    CALL(fmi3GetNominalsOfContinuousStates, (c, x, 1)) \
    CALL(fmi3GetNumberOfEventIndicators, (c, &size)) \
    CALL(fmi3GetNumberOfContinuousStates, (c, &size)) \
    CALL(fmi3EnterStepMode, (c)) \
    CALL(fmi3GetOutputDerivatives, (c, NULL, 0, NULL, NULL, 0)) \
    CALL(fmi3DoStep, (c, 0.0, 1e-3, true, yes, yes + 1, yes + 2, x)) \
    CALL(fmi3ActivateModelPartition, (c, 0, 0.0))
