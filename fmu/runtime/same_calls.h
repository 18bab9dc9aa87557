/* The functions that FMI 2.0 and 3.0 have in one form. fmi2.c and fmi3.c include this once each and say before what a
 * function, its number, a type and the instance are called: JL_FMI, JL_CALLED, JL_T, JL_HANDLE, JL_REAL. */

#define JL_ANSWER(call) return (JL_T(Status))(call)

void JL_FMI(FreeInstance)(JL_HANDLE c) { jl_free(c); }

JL_T(Status) JL_FMI(SetDebugLogging)(JL_HANDLE c, JL_T(Boolean) loggingOn, size_t n, const JL_T(String) categories[])
{
    JL_ANSWER(jl_logging(c, JL_CALLED(SetDebugLogging), loggingOn, n, categories));
}

JL_T(Status) JL_FMI(ExitInitializationMode)(JL_HANDLE c)
{
    JL_ANSWER(jl_exit_initialization(c, JL_CALLED(ExitInitializationMode)));
}

JL_T(Status) JL_FMI(EnterEventMode)(JL_HANDLE c) { JL_ANSWER(jl_move(c, JL_CALLED(EnterEventMode), JL_EVENT)); }

JL_T(Status) JL_FMI(Terminate)(JL_HANDLE c) { JL_ANSWER(jl_move(c, JL_CALLED(Terminate), JL_TERMINATED)); }

JL_T(Status) JL_FMI(Reset)(JL_HANDLE c) { JL_ANSWER(jl_reset(c, JL_CALLED(Reset))); }

/* Model exchange */

JL_T(Status) JL_FMI(EnterContinuousTimeMode)(JL_HANDLE c)
{
    JL_ANSWER(jl_continuous_time(c, JL_CALLED(EnterContinuousTimeMode)));
}

JL_T(Status) JL_FMI(CompletedIntegratorStep)(JL_HANDLE c, JL_T(Boolean) noSetFMUStatePriorToCurrentPoint,
                                             JL_T(Boolean) *enterEventMode, JL_T(Boolean) *terminateSimulation)
{
    const int answerable = enterEventMode && terminateSimulation;
    int event = 0;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (jl_completed_step(c, JL_CALLED(CompletedIntegratorStep), answerable, &event)) return JL_T(Error);
    *enterEventMode = event ? JL_T(True) : JL_T(False);
    *terminateSimulation = JL_T(False);
    return JL_T(OK);
}

JL_T(Status) JL_FMI(SetTime)(JL_HANDLE c, JL_REAL time) { JL_ANSWER(jl_set_time(c, JL_CALLED(SetTime), time)); }

JL_T(Status) JL_FMI(SetContinuousStates)(JL_HANDLE c, const JL_REAL x[], size_t n)
{
    JL_ANSWER(jl_set_continuous_states(c, JL_CALLED(SetContinuousStates), x, n));
}

JL_T(Status) JL_FMI(GetEventIndicators)(JL_HANDLE c, JL_REAL x[], size_t n)
{
    JL_ANSWER(jl_get_indicators(c, JL_CALLED(GetEventIndicators), x, n));
}

JL_T(Status) JL_FMI(GetContinuousStates)(JL_HANDLE c, JL_REAL x[], size_t n)
{
    JL_ANSWER(jl_get_continuous_states(c, JL_CALLED(GetContinuousStates), x, n));
}

JL_T(Status) JL_FMI(GetNominalsOfContinuousStates)(JL_HANDLE c, JL_REAL x[], size_t n)
{
    JL_ANSWER(jl_get_nominals(c, JL_CALLED(GetNominalsOfContinuousStates), x, n));
}

#undef JL_ANSWER
#undef JL_FMI
#undef JL_CALLED
#undef JL_T
#undef JL_HANDLE
#undef JL_REAL
