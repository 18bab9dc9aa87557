/* What the wrapper must refuse, and in which words. */

#define REFUSED(call, words) \
    do { \
        Fmu one = running(library, version, exchange, 0.0, 0.0), *f = &one; \
        told.count = 0; \
        CHECK((call) == 3); \
        CHECK(TOLD(words)); \
        CHECK(get(f, FORCE, &x) == 3); \
        fmu_free(f); \
    } while (0)

/* One fault in an otherwise legal call. */
static void faults(void)
{
    const unsigned two[] = { Z, V }, wrong = version == 2 ? SLIPPING : 16;
    double x = 0.0, pair[2] = { 0.0, 0.0 };
    fmi3Boolean a, b;
    int c;
    REFUSED(get(f, wrong, &x),
            version == 2 ? "value reference 13, expected one from 1 to 12" : "value reference 16, expected");
    REFUSED(get(f, 0, &x), "value reference 0, expected one from 1 to");
    REFUSED(set(f, 0, 0.0), "value reference 0, expected one from 1 to");
    REFUSED(set(f, 4000000000u, 0.0), "value reference 4000000000");
    REFUSED(set(f, FORCE, 1.0), "force cannot be set here");
    REFUSED(set(f, RATE, 1.0), "der(slider.position) cannot be set here");
    REFUSED(move(f, NAN, 0.0), "displacement is nan, expected a finite number");
    REFUSED(move(f, 0.0, INFINITY), "velocity is inf, expected a finite number");
    REFUSED(BOTH(fmi2GetReal, (f->c, NULL, 1, &x), fmi3GetFloat64, (f->c, NULL, 1, &x, 1)), "NULL");
    REFUSED(BOTH(fmi2SetReal, (f->c, two, 2, NULL), fmi3SetFloat64, (f->c, two, 2, NULL, 2)), "NULL");
    REFUSED(BOTH(fmi2GetInteger, (f->c, two, 1, &c), fmi3GetFloat32, (f->c, two, 1, NULL, 1)), "no variables of");
    REFUSED(BOTH(fmi2GetFMUstate, (f->c, NULL), fmi3GetFMUState, (f->c, NULL)), "NULL");
    REFUSED(BOTH(fmi2SetFMUstate, (f->c, NULL), fmi3SetFMUState, (f->c, NULL)), "the saved state is NULL");
    REFUSED(BOTH(fmi2SetDebugLogging, (f->c, 1, 1, NULL), fmi3SetDebugLogging, (f->c, 1, 1, NULL)), "categories");
    if (version == 3) {
        REFUSED(CALL(library, fmi3GetFloat64)(f->c, two, 2, pair, 1), "1 numbers for 2 variables");
        REFUSED(CALL(library, fmi3SetFloat64)(f->c, two, 1, pair, 2), "2 numbers for 1 variables");
    }
    if (exchange) {
        REFUSED(BOTH(fmi2SetTime, (f->c, NAN), fmi3SetTime, (f->c, NAN)), "the time is nan");
        REFUSED(BOTH(fmi2GetDerivatives, (f->c, pair, 2), fmi3GetContinuousStateDerivatives, (f->c, pair, 2)),
                "expected 1");
        REFUSED(BOTH(fmi2GetEventIndicators, (f->c, pair, 1), fmi3GetEventIndicators, (f->c, pair, 1)), "expected 2");
        REFUSED(BOTH(fmi2GetContinuousStates, (f->c, NULL, 1), fmi3GetContinuousStates, (f->c, NULL, 1)),
                "expected 1");
        REFUSED((x = NAN, vector(f, 's', &x)), "slider.position is nan");
        REFUSED(BOTH(fmi2CompletedIntegratorStep, (f->c, 1, NULL, &c), fmi3CompletedIntegratorStep,
                     (f->c, 1, &a, NULL)),
                "NULL");
        /* FMI 2 lets a continuous state be set one by one, FMI 3 does not. */
        if (version == 3) REFUSED(set(f, STATE, 1e-6), "slider.position cannot be set here");
        else {
            Fmu one = running(library, version, exchange, 0.0, 0.0);
            CHECK(set(&one, STATE, 1e-6) == 0 && fabs(value(&one, FORCE) + 2.0) < 1e-9);
            fmu_free(&one);
        }
        return;
    }
    REFUSED(set(f, STATE, 1e-6), "slider.position cannot be set here");
    REFUSED((x = step(f, 1e-3), f->time = 0.0, x == 0 ? step(f, 1e-3) : 0), "expected one from 0.001");
    REFUSED(step(f, 0.0), "a step of 0 s");
    REFUSED(step(f, -1e-3), "expected one above 0");
    REFUSED(step(f, NAN), "a step of nan s");
    REFUSED(step(f, INFINITY), "a step of inf s");
    REFUSED((f->time = NAN, step(f, 1e-3)), "finite time");
    if (version == 3)
        REFUSED(CALL(library, fmi3DoStep)(f->c, 0.0, 1e-3, true, &a, &b, NULL, &x), "NULL");
    {
        /* Past the stop time, but not by the rounding of many steps. */
        Fmu one = fmu(library, version, exchange), *f = &one;
        if (version == 2) CHECK(CALL(library, fmi2SetupExperiment)(f->c, 0, 0.0, 0.0, 1, 1e-3) == 0 && enter(f) == 0);
        else CHECK(CALL(library, fmi3EnterInitializationMode)(f->c, false, 0.0, 0.0, true, 1e-3) == 0);
        CHECK(leave(f) == 0);
        for (c = 0; c < 10; c++) CHECK(step(f, 1e-4) == 0);
        CHECK(step(f, 1e-4) == 3 && TOLD("the stop time is 0.001"));
        fmu_free(f);
    }
}

/* Parameters that void the joint: at the end of initialization, and when they are tuned. */
static void parameters(void)
{
    Fmu one = fmu(library, version, exchange), *f = &one;
    double x;
    CHECK(set(f, GAP, 0.0) == 0 && enter(f) == 0 && leave(f) == 3);
    CHECK(TOLD("ExitInitializationMode: stop.gap is 0, expected a value above 0"));
    CHECK(reset(f) == 0 && set(f, GAP, 1e-5) == 0 && enter(f) == 0 && leave(f) == 0 && value(f, GAP) == 1e-5);
    CHECK(set(f, STIFFNESS, -1.0) == 0);
    CHECK((exchange ? update(f) : step(f, 1e-3)) == 3);
    CHECK(TOLD(exchange ? "DiscreteStates: spring.stiffness is -1" : "DoStep: spring.stiffness is -1"));
    CHECK(reset(f) == 0 && enter(f) == 0 && set(f, SLIDER, 0.0) == 0);
    CHECK(get(f, FORCE, &x) == 3 && TOLD("slider.stiffness"));
    CHECK(reset(f) == 0 && set(f, SLIP, NAN) == 3 && TOLD("slider.slip_force is nan"));
    /* The host's format is "%s": signs in a message are no instructions. */
    CHECK(reset(f) == 0 && set(f, STIFFNESS, 1e301) == 0 && enter(f) == 0 && leave(f) == 3);
    CHECK(TOLD("100% of %s and %n must reach the host"));
    fmu_free(f);
    if (version == 3) {
        /* Start values can be read at once; what is calculated has none yet. */
        one = fmu(library, 3, exchange);
        CHECK(value(f, STIFFNESS) == 1e6 && value(f, Z) == 0.0 && value(f, TIME) == 0.0);
        CHECK(get(f, FORCE, &x) == 3 && TOLD("force has no value before initialization"));
        fmu_free(f);
    }
}

/* Modes change at events only; states that jump are told; the nominals and the numbers of vectors. */
static void events(void)
{
    Fmu one, *f = &one;
    double x[2], before;
    size_t n = 9;
    if (!exchange) return;
    one = running(library, version, 1, 0.0, 0.0);
    CHECK(vector(f, 'g', x) == 0 && x[1] < 0.0);
    CHECK(move(f, 6e-5, 0.0) == 0);
    before = value(f, FORCE);
    CHECK(vector(f, 'g', x) == 0 && x[1] > 0.0);
    CHECK(event(f) == 0 && value(f, FORCE) == before);
    CHECK(update(f) == 0 && f->jumped);
    /* The stop is closed, and the slider, at 6 of its reaches, follows: 120 N fall to 20 N. */
    CHECK(fabs(value(f, FORCE) - before - 1e7 * 1e-5 + 100.0) < 1e-6);
    CHECK(vector(f, 'x', x) == 0 && fabs(x[0] - 5e-5) < 1e-18);
    CHECK(update(f) == 0 && !f->jumped);
    CHECK(continuous(f) == 0);
    CHECK(vector(f, 'n', x) == 0 && x[0] == 1e-5);
    CHECK(move(f, 6e-5, 0.03) == 0 && vector(f, 'd', x) == 0 && x[0] == 0.03 && value(f, RATE) == 0.03);
    /* Where a solver tries a point without a force it is told to discard it, and may go on. */
    told.count = 0;
    CHECK(move(f, 1e200, 0.0) == 0 && get(f, FORCE, x) == 2 && TOLD("the force is no finite number"));
    CHECK(told.status == 2 && strcmp(told.category, "logStatusWarning") == 0);
    CHECK(move(f, 6e-5, 0.03) == 0 && get(f, FORCE, x) == 0);
    if (version == 3) {
        CHECK(value(f, CONTACT) > 0.0);
        CHECK(CALL(library, fmi3GetNumberOfContinuousStates)(f->c, &n) == 0 && n == 1);
        CHECK(CALL(library, fmi3GetNumberOfEventIndicators)(f->c, &n) == 0 && n == 2);
        CHECK(CALL(library, fmi3SetTime)(f->c, 0.25) == 0 && value(f, TIME) == 0.25);
    }
    fmu_free(f);
}

static void logging(void)
{
    const char *warnings[] = { "logStatusWarning" }, *strange[] = { "logEvents", "logStatusError" };
    Fmu one, *f = &one;
    double x;
    int i;
    told.count = 0;
    CHECK(fmu_with(library, version, exchange, "it", "{other}", 1).c == NULL && told.count == 1);
    CHECK(TOLD("the token is \"{other}\", expected \"" TOKEN "\""));
    CHECK(fmu_with(library, version, exchange, "it", NULL, 1).c == NULL && told.count == 2);
    CHECK(fmu_with(spring, version, 1, "it", "{runtime-spring-1}", 1).c == NULL && TOLD("co-simulation only"));
    if (version == 3) {
        told.count = 0;
        CHECK(CALL(library, fmi3InstantiateScheduledExecution)("it", TOKEN, NULL, false, true, NULL, tell3, NULL, NULL,
                                                               NULL) == NULL);
        CHECK(TOLD("no scheduled execution"));
        CHECK(CALL(library, fmi3InstantiateCoSimulation)("it", TOKEN, NULL, false, true, true, false, NULL, 0, NULL,
                                                         tell3, NULL) == NULL);
        CHECK(TOLD("no event mode"));
        /* loggingOn = false: not a word, but why there is no instance. */
        one.library = library, one.version = 3, one.exchange = exchange;
        one.c = exchange ? CALL(library, fmi3InstantiateModelExchange)("it", TOKEN, NULL, false, false, NULL, tell3)
                         : CALL(library, fmi3InstantiateCoSimulation)("it", TOKEN, NULL, false, false, false, false,
                                                                      NULL, 0, NULL, tell3, NULL);
        told.count = 0;
        CHECK(leave(f) == 3 && told.count == 0);
        fmu_free(f);
    }
    if (version == 2) {
        /* FMI 2 switches debug messages off by loggingOn = false, not errors. */
        fmi2CallbackFunctions callbacks = { tell2, NULL, NULL, NULL, NULL };
        one.library = library, one.version = 2;
        one.c = CALL(library, fmi2Instantiate)("it", exchange ? fmi2ModelExchange : fmi2CoSimulation, TOKEN, NULL,
                                               &callbacks, 0, 0);
        told.count = 0;
        CHECK(leave(f) == 3 && told.count == 1);
        fmu_free(f);
        CHECK(CALL(library, fmi2Instantiate)("it", (fmi2Type)7, TOKEN, NULL, &callbacks, 0, 0) == NULL);
        CHECK(TOLD("expected model exchange or co-simulation"));
    }
    /* Leaving the identified range is said once, as a warning, and the step is good. */
    one = running(library, version, exchange, 0.0, 0.0);
    told.count = 0;
    for (i = 0; i < 3; i++) {
        CHECK(move(f, 2e-4, 0.0) == 0);
        if (exchange) CHECK(event(f) == 0 && update(f) == 0 && continuous(f) == 0);
        else CHECK(step(f, 1e-3) == 0);
    }
    CHECK(told.count == 1 && told.status == 1 && strcmp(told.category, "logStatusWarning") == 0);
    CHECK(TOLD("displacement is 0.0002, the joint was identified from -0.0001 to 0.0001"));
    if (version == 2) CHECK(strcmp(told.name, "it") == 0);
    /* Categories: errors can be left out, those of other FMUs are passed over. */
    CHECK(BOTH(fmi2SetDebugLogging, (f->c, 1, 1, warnings), fmi3SetDebugLogging, (f->c, true, 1, warnings)) == 0);
    told.count = 0;
    CHECK(get(f, 99, &x) == 3 && told.count == 0);
    CHECK(BOTH(fmi2SetDebugLogging, (f->c, 1, 0, NULL), fmi3SetDebugLogging, (f->c, true, 0, NULL)) == 0);
    CHECK(BOTH(fmi2SetDebugLogging, (f->c, 1, 2, strange), fmi3SetDebugLogging, (f->c, true, 2, strange)) == 0);
    told.count = 0;
    CHECK(get(f, 99, &x) == 3 && told.count == 1);
    fmu_free(f);
    /* A force that is no number fails the step, nothing else. */
    one = fmu_with(spring, version, 0, "spring", "{runtime-spring-1}", 1);
    CHECK(enter(f) == 0 && leave(f) == 0 && set(f, STIFFNESS, 2e6) == 0 && step(f, 1e-3) == 3);
    CHECK(TOLD("the force or a state after the step is no finite number at displacement 0 m, velocity 0 m/s"));
    fmu_free(f);
}
