/* A whole machine FMU linked into one program for the sanitizers: steps, events, partials, saved states, both kinds. */
#include <stdarg.h>
#include <stdlib.h>
#include "all.c"

static int failures;
#define CHECK(condition) ((condition) ? (void)0 : (void)(failures++, printf("line %d: %s\n", __LINE__, #condition)))

static void tell(fmi2ComponentEnvironment where, fmi2String name, fmi2Status status, fmi2String category, fmi2String text,
                 ...)
{
    va_list list;
    (void)where, (void)name, (void)status, (void)category;
    va_start(list, text);
    vprintf(text, list);
    va_end(list);
    printf("\n");
    failures++;
}

static fmi2Component start(int exchange, double tolerance)
{
    static const fmi2CallbackFunctions callbacks = { tell, NULL, NULL, NULL, NULL };
    fmi2Component c = fmi2Instantiate("it", exchange ? fmi2ModelExchange : fmi2CoSimulation, jl_token, NULL, &callbacks,
                                      fmi2False, fmi2True);
    CHECK(c && fmi2SetupExperiment(c, tolerance > 0.0, tolerance, 0.0, fmi2False, 0.0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK && fmi2ExitInitializationMode(c) == fmi2OK);
    return c;
}

static void outputs(fmi2Component c, double *y)
{
    unsigned int reference[JL_OUTPUTS], i;
    for (i = 0; i < JL_OUTPUTS; i++) reference[i] = JL_FIRST_OUTPUT + i + 1;
    CHECK(fmi2GetReal(c, reference, JL_OUTPUTS, y) == fmi2OK);
}

static void steps(double tolerance)
{
    fmi2Component c = start(0, tolerance);
    fmi2FMUstate saved = NULL;
    const unsigned int force = 1;
    double y[2][JL_OUTPUTS];
    int run, i;
    CHECK(fmi2GetFMUstate(c, &saved) == fmi2OK);
    for (run = 0; run < 2; run++) {
        CHECK(fmi2SetFMUstate(c, saved) == fmi2OK);
        for (i = 0; i < 100; i++) {
            const double level = (i % 3 - 1) * 3.0 * i;
            CHECK(fmi2SetReal(c, &force, 1, &level) == fmi2OK && fmi2DoStep(c, i * 1e-4, 1e-4, fmi2True) == fmi2OK);
        }
        outputs(c, y[run]);
    }
    CHECK(memcmp(y[0], y[1], sizeof y[0]) == 0 && y[0][0] != 0.0);
    CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK);
    fmi2FreeInstance(c);
}

static void silent(fmi3InstanceEnvironment where, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)where, (void)status, (void)category, (void)message;
}

static fmi3Instance asking;
static unsigned int answered;

/* Sets the variable that is answered; a parameter is refused, and ends the step. */
static void answer(fmi3InstanceEnvironment where, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get, fmi3Boolean done,
                   fmi3Boolean can_return, fmi3Boolean *asked, fmi3Float64 *early)
{
    const double level = 50.0 + 1e4 * fmod(time, 1e-2);
    (void)where, (void)done, (void)can_return, (void)asked, (void)early;
    CHECK(set && !get && fmi3SetFloat64(asking, &answered, 1, &level, 1) == (answered == 1 ? fmi3OK : fmi3Error));
}

/* Forces that bend: told in FMI 2.0, asked for in FMI 3.0; derivatives of the outputs. */
static void within(double tolerance)
{
    fmi2Component c = start(0, tolerance);
    const unsigned int force[] = { 1, 1 }, parameter = JL_FIRST_PARAMETER + 1;
    const int orders[] = { 1, 2 };
    unsigned int reference[JL_OUTPUTS];
    int order[JL_OUTPUTS], i;
    double y[JL_OUTPUTS], slopes[] = { 1e4, 1e7 }, end = 0.0;
    fmi3Boolean flags[3];
    for (i = 0; i < JL_OUTPUTS; i++) reference[i] = JL_FIRST_OUTPUT + (unsigned int)i + 1, order[i] = 1;
    for (i = 0; i < 50; i++) {
        CHECK(fmi2SetRealInputDerivatives(c, force, 2, orders, slopes) == fmi2OK);
        CHECK(fmi2DoStep(c, i * 1e-4, 1e-4, fmi2True) == fmi2OK);
        CHECK(fmi2GetRealOutputDerivatives(c, reference, JL_OUTPUTS, order, y) == fmi2OK && y[0] - y[0] == 0.0);
    }
    fmi2FreeInstance(c);
    asking = fmi3InstantiateCoSimulation("it", jl_token, NULL, fmi3False, fmi3True, fmi3False, fmi3False, NULL, 0, NULL,
                                         silent, answer);
    CHECK(asking && fmi3EnterInitializationMode(asking, tolerance > 0.0, tolerance, 0.0, fmi3False, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(asking) == fmi3OK);
    answered = 1;
    for (i = 0; i < 50; i++) {
        CHECK(fmi3DoStep(asking, i * 1e-4, 1e-4, fmi3True, flags, flags + 1, flags + 2, &end) == fmi3OK);
        CHECK(fmi3GetOutputDerivatives(asking, reference, JL_OUTPUTS, order, y, JL_OUTPUTS) == fmi3OK);
    }
    answered = parameter;
    CHECK(fmi3DoStep(asking, i * 1e-4, 1e-4, fmi3True, flags, flags + 1, flags + 2, &end) == fmi3Error);
    fmi3FreeInstance(asking);
}

static void exchange(void)
{
    fmi2Component c = start(1, 0.0);
    fmi2EventInfo info;
    double y[JL_OUTPUTS], x[JL_ROOM(JL_CONTINUOUS)], g[JL_ROOM(JL_INDICATORS)], result[JL_OUTPUTS];
    int i;
    CHECK(fmi2NewDiscreteStates(c, &info) == fmi2OK && fmi2EnterContinuousTimeMode(c) == fmi2OK);
    for (i = 0; i < JL_CONTINUOUS; i++) x[i] = i % 2 ? 1e-2 : 1e-6;
    CHECK(fmi2SetContinuousStates(c, x, JL_CONTINUOUS) == fmi2OK);
    CHECK(fmi2GetDerivatives(c, x, JL_CONTINUOUS) == fmi2OK && fmi2GetEventIndicators(c, g, JL_INDICATORS) == fmi2OK);
    for (i = 0; i < JL_CONTINUOUS; i++) {
        const unsigned int known = 1 + JL_FIRST_STATE + (unsigned int)jl_continuous[i], unknown = 1 + JL_FIRST_OUTPUT;
        const double one = 1.0;
        CHECK(fmi2GetDirectionalDerivative(c, &unknown, 1, &known, 1, &one, result) == fmi2OK);
    }
    outputs(c, y);
    CHECK(fmi2EnterEventMode(c) == fmi2OK && fmi2NewDiscreteStates(c, &info) == fmi2OK);
    fmi2FreeInstance(c);
}

/* Many steps under forces that jump, with a state kept and put back now and then. */
static void many(long count, double tolerance)
{
    fmi2Component c = start(0, tolerance);
    fmi2FMUstate saved = NULL;
    const unsigned int force = 1;
    unsigned long long noise = 88172645463325252ull;
    double y[JL_OUTPUTS], time = 0.0, then = 0.0;
    long i;
    for (i = 0; i < count && failures < 10; i++) {
        double level;
        noise ^= noise << 13, noise ^= noise >> 7, noise ^= noise << 17;
        level = ((double)(noise % 2001) - 1000.0) * 0.1;
        if (i % 1000 == 0) CHECK(fmi2GetFMUstate(c, &saved) == fmi2OK), then = time;
        if (i % 1000 == 500) CHECK(fmi2SetFMUstate(c, saved) == fmi2OK), time = then;
        CHECK(fmi2SetReal(c, &force, 1, &level) == fmi2OK);
        CHECK(fmi2DoStep(c, time, 1e-4, fmi2True) == fmi2OK);
        time += 1e-4;
    }
    outputs(c, y);
    CHECK(y[0] - y[0] == 0.0);
    if (saved) CHECK(fmi2FreeFMUstate(c, &saved) == fmi2OK);
    fmi2FreeInstance(c);
}

/* The same in FMI 3.0, with forces that are asked for within a step. */
static void many3(long count, double tolerance)
{
    fmi3FMUState saved = NULL;
    const unsigned int force = 1;
    unsigned int reference[JL_OUTPUTS], i;
    unsigned long long noise = 88172645463325252ull;
    double y[JL_OUTPUTS], time = 0.0, then = 0.0, end;
    fmi3Boolean flags[3];
    fmi3Instance c = fmi3InstantiateCoSimulation("it", jl_token, NULL, fmi3False, fmi3True, fmi3False, fmi3False, NULL,
                                                 0, NULL, silent, answer);
    long k;
    for (i = 0; i < JL_OUTPUTS; i++) reference[i] = JL_FIRST_OUTPUT + i + 1;
    CHECK(c && fmi3EnterInitializationMode(c, tolerance > 0.0, tolerance, 0.0, fmi3False, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    asking = c, answered = 1;
    for (k = 0; k < count && failures < 10; k++) {
        double level;
        noise ^= noise << 13, noise ^= noise >> 7, noise ^= noise << 17;
        level = ((double)(noise % 2001) - 1000.0) * 0.1;
        if (k % 1000 == 0) CHECK(fmi3GetFMUState(c, &saved) == fmi3OK), then = time;
        if (k % 1000 == 500) CHECK(fmi3SetFMUState(c, saved) == fmi3OK), time = then;
        CHECK(fmi3SetFloat64(c, &force, 1, &level, 1) == fmi3OK);
        CHECK(fmi3DoStep(c, time, 1e-4, fmi3True, flags, flags + 1, flags + 2, &end) == fmi3OK);
        time += 1e-4;
    }
    CHECK(fmi3GetFloat64(c, reference, JL_OUTPUTS, y, JL_OUTPUTS) == fmi3OK && y[0] - y[0] == 0.0);
    if (saved) CHECK(fmi3FreeFMUState(c, &saved) == fmi3OK);
    fmi3FreeInstance(c);
}

/* Many rates at random states, as a solver asks for them, with an event where an indicator changes its sign. */
static void many_rates(long count)
{
    fmi2Component c = start(1, 0.0);
    fmi2EventInfo info;
    fmi2Boolean wanted, over;
    const unsigned int force = 1;
    unsigned long long noise = 88172645463325252ull;
    double y[JL_OUTPUTS], x[JL_ROOM(JL_CONTINUOUS)], g[JL_ROOM(JL_INDICATORS)], before[JL_ROOM(JL_INDICATORS)];
    long k;
    int i;
    CHECK(fmi2NewDiscreteStates(c, &info) == fmi2OK && fmi2EnterContinuousTimeMode(c) == fmi2OK);
    CHECK(fmi2GetContinuousStates(c, x, JL_CONTINUOUS) == fmi2OK);
    CHECK(fmi2GetEventIndicators(c, before, JL_INDICATORS) == fmi2OK);
    for (k = 0; k < count && failures < 10; k++) {
        const double level = (double)(k % 201) - 100.0;
        int changed = 0;
        for (i = 0; i < JL_CONTINUOUS; i++) {
            noise ^= noise << 13, noise ^= noise >> 7, noise ^= noise << 17;
            x[i] = ((double)(noise % 2001) - 1000.0) * (i % 2 ? 1e-5 : 1e-9);
        }
        CHECK(fmi2SetTime(c, 1e-4 * (double)k) == fmi2OK && fmi2SetReal(c, &force, 1, &level) == fmi2OK);
        CHECK(fmi2SetContinuousStates(c, x, JL_CONTINUOUS) == fmi2OK);
        CHECK(fmi2GetDerivatives(c, x, JL_CONTINUOUS) == fmi2OK && x[0] - x[0] == 0.0);
        CHECK(fmi2GetEventIndicators(c, g, JL_INDICATORS) == fmi2OK);
        CHECK(fmi2CompletedIntegratorStep(c, fmi2True, &wanted, &over) == fmi2OK);
        for (i = 0; i < JL_INDICATORS; i++) changed |= (g[i] > 0.0) != (before[i] > 0.0);
        if (!changed && !wanted) continue;
        CHECK(fmi2EnterEventMode(c) == fmi2OK && fmi2NewDiscreteStates(c, &info) == fmi2OK);
        CHECK(fmi2EnterContinuousTimeMode(c) == fmi2OK);
        CHECK(fmi2GetEventIndicators(c, before, JL_INDICATORS) == fmi2OK);
    }
    outputs(c, y);
    CHECK(y[0] - y[0] == 0.0);
    fmi2FreeInstance(c);
}

/* As in FMI 2.0. */
static void many_rates3(long count)
{
    fmi3Instance c = fmi3InstantiateModelExchange("it", jl_token, NULL, fmi3False, fmi3True, NULL, silent);
    const unsigned int force = 1;
    unsigned long long noise = 88172645463325252ull;
    double x[JL_ROOM(JL_CONTINUOUS)], g[JL_ROOM(JL_INDICATORS)], before[JL_ROOM(JL_INDICATORS)], next;
    fmi3Boolean flags[5], wanted, over;
    long k;
    int i;
    CHECK(c && fmi3EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    CHECK(fmi3UpdateDiscreteStates(c, flags, flags + 1, flags + 2, flags + 3, flags + 4, &next) == fmi3OK);
    CHECK(fmi3EnterContinuousTimeMode(c) == fmi3OK);
    CHECK(fmi3GetEventIndicators(c, before, JL_INDICATORS) == fmi3OK);
    for (k = 0; k < count && failures < 10; k++) {
        const double level = (double)(k % 201) - 100.0;
        int changed = 0;
        for (i = 0; i < JL_CONTINUOUS; i++) {
            noise ^= noise << 13, noise ^= noise >> 7, noise ^= noise << 17;
            x[i] = ((double)(noise % 2001) - 1000.0) * (i % 2 ? 1e-5 : 1e-9);
        }
        CHECK(fmi3SetTime(c, 1e-4 * (double)k) == fmi3OK && fmi3SetFloat64(c, &force, 1, &level, 1) == fmi3OK);
        CHECK(fmi3SetContinuousStates(c, x, JL_CONTINUOUS) == fmi3OK);
        CHECK(fmi3GetContinuousStateDerivatives(c, x, JL_CONTINUOUS) == fmi3OK && x[0] - x[0] == 0.0);
        CHECK(fmi3GetEventIndicators(c, g, JL_INDICATORS) == fmi3OK);
        CHECK(fmi3CompletedIntegratorStep(c, fmi3True, &wanted, &over) == fmi3OK);
        for (i = 0; i < JL_INDICATORS; i++) changed |= (g[i] > 0.0) != (before[i] > 0.0);
        if (!changed && !wanted) continue;
        CHECK(fmi3EnterEventMode(c) == fmi3OK);
        CHECK(fmi3UpdateDiscreteStates(c, flags, flags + 1, flags + 2, flags + 3, flags + 4, &next) == fmi3OK);
        CHECK(fmi3EnterContinuousTimeMode(c) == fmi3OK);
        CHECK(fmi3GetEventIndicators(c, before, JL_INDICATORS) == fmi3OK);
    }
    fmi3FreeInstance(c);
}

/* How many steps, at which tolerance, in which version of the standard; "rates" for model exchange. */
int main(int count, char **words)
{
    if (count > 3) {
        const long steps = atol(words[1]);
        const int third = words[3][0] == '3';
        if (strcmp(words[2], "rates") == 0)
            third ? many_rates3(steps) : many_rates(steps);
        else
            third ? many3(steps, atof(words[2])) : many(steps, atof(words[2]));
        return failures != 0;
    }
    within(0.0), within(1e-5);
    steps(0.0);
    steps(1e-5); /* the joints closed at their tangents, where they can be */
    exchange();
    return failures != 0;
}
