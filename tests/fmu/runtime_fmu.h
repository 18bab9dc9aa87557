/* A test's view of an FMU instance: FMI 2 and 3, co-simulation and model exchange behind the same calls. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#define TOKEN "{runtime-joint-1}"

enum { Z = 1, V, FORCE, STIFFNESS, DAMPING, SLIDER, SLIP, STOP, GAP, CUBIC, STATE, RATE, SLIPPING, CONTACT, TIME };

/* What the FMU logged. */
static struct {
    int count, status;
    char category[64], name[64], text[1200];
} told;
static int failures;

static void check(int good, const char *what, int line)
{
    if (good) return;
    failures++;
    printf("line %d: %s (last message: %s)\n", line, what, told.text);
}
#define CHECK(condition) check(condition, #condition, __LINE__)
#define TOLD(words) (told.count && strstr(told.text, words) != NULL)

static void tell2(fmi2ComponentEnvironment where, fmi2String name, fmi2Status status, fmi2String category,
                  fmi2String format, ...)
{
    va_list list;
    const char *text;
    (void)where;
    told.count++;
    told.status = status;
    snprintf(told.name, sizeof told.name, "%s", name);
    snprintf(told.category, sizeof told.category, "%s", category);
    CHECK(strcmp(format, "%s") == 0);
    va_start(list, format);
    text = va_arg(list, const char *);
    snprintf(told.text, sizeof told.text, "%s", text);
    va_end(list);
}

static void tell3(fmi3InstanceEnvironment where, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)where;
    told.count++;
    told.status = status;
    snprintf(told.category, sizeof told.category, "%s", category);
    snprintf(told.text, sizeof told.text, "%s", message);
}

typedef struct {
    void *library;
    int version, exchange;
    void *c;
    double time;
    int jumped;  /* the last event changed a continuous state */
    double kept; /* time when the state was saved */
    double ahead; /* how far its motion is ahead of the time */
} Fmu;

static void *find(void *library, const char *name)
{
    void *address = dlsym(library, name);
    if (address) return address;
    printf("%s is missing\n", name);
    exit(1);
}
#define CALL(library, name) ((name##TYPE *)(uintptr_t)find(library, #name))
#define BOTH_OF(f, two, arguments2, three, arguments3) \
    (f->version == 2 ? (int)CALL(f->library, two) arguments2 : (int)CALL(f->library, three) arguments3)
#define BOTH(two, arguments2, three, arguments3) BOTH_OF(f, two, arguments2, three, arguments3)

static Fmu fmu_with(void *library, int version, int exchange, const char *name, const char *token, int log)
{
    Fmu f = { library, version, exchange, NULL, 0.0, 0, 0.0, 0.0 };
    if (version == 2) {
        fmi2CallbackFunctions callbacks = { tell2, NULL, NULL, NULL, NULL };
        if (!log) callbacks.logger = NULL;
        f.c = CALL(library, fmi2Instantiate)(name, exchange ? fmi2ModelExchange : fmi2CoSimulation, token, NULL,
                                             &callbacks, 0, log);
        memset(&callbacks, 0x55, sizeof callbacks); /* the FMU must have its own copy */
    } else if (exchange)
        f.c = CALL(library, fmi3InstantiateModelExchange)(name, token, NULL, false, log, NULL, log ? tell3 : NULL);
    else
        f.c = CALL(library, fmi3InstantiateCoSimulation)(name, token, NULL, false, log, false, false, NULL, 0, NULL,
                                                         log ? tell3 : NULL, NULL);
    return f;
}

static Fmu fmu(void *library, int version, int exchange)
{
    return fmu_with(library, version, exchange, "it", TOKEN, 1);
}

static void fmu_free(Fmu *f)
{
    if (f->version == 2) CALL(f->library, fmi2FreeInstance)(f->c);
    else CALL(f->library, fmi3FreeInstance)(f->c);
}

static int get(Fmu *f, unsigned reference, double *x)
{
    return BOTH(fmi2GetReal, (f->c, &reference, 1, x), fmi3GetFloat64, (f->c, &reference, 1, x, 1));
}

static double value(Fmu *f, unsigned reference)
{
    double x = NAN;
    CHECK(get(f, reference, &x) == 0);
    return x;
}

static int set(Fmu *f, unsigned reference, double x)
{
    return BOTH(fmi2SetReal, (f->c, &reference, 1, &x), fmi3SetFloat64, (f->c, &reference, 1, &x, 1));
}

static int move(Fmu *f, double z, double v)
{
    const unsigned references[] = { Z, V };
    const double x[] = { z, v };
    return BOTH(fmi2SetReal, (f->c, references, 2, x), fmi3SetFloat64, (f->c, references, 2, x, 2));
}

static int enter(Fmu *f)
{
    return BOTH(fmi2EnterInitializationMode, (f->c), fmi3EnterInitializationMode, (f->c, false, 0, 0, false, 0));
}

static int leave(Fmu *f) { return BOTH(fmi2ExitInitializationMode, (f->c), fmi3ExitInitializationMode, (f->c)); }

static int terminate(Fmu *f) { return BOTH(fmi2Terminate, (f->c), fmi3Terminate, (f->c)); }

static int reset(Fmu *f) { return BOTH(fmi2Reset, (f->c), fmi3Reset, (f->c)); }

static int update(Fmu *f)
{
    fmi2EventInfo info;
    fmi3Boolean a = true, b = true, c = true, jumped = true, d = true;
    double time;
    int status;
    memset(&info, 0x55, sizeof info);
    status = BOTH(fmi2NewDiscreteStates, (f->c, &info), fmi3UpdateDiscreteStates,
                  (f->c, &a, &b, &c, &jumped, &d, &time));
    if (status) return status;
    if (f->version == 2) {
        a = info.newDiscreteStatesNeeded, b = info.terminateSimulation, c = info.nominalsOfContinuousStatesChanged;
        jumped = info.valuesOfContinuousStatesChanged, d = info.nextEventTimeDefined;
    }
    CHECK(!a && !b && !c && !d);
    f->jumped = jumped;
    return status;
}

static int continuous(Fmu *f)
{
    return BOTH(fmi2EnterContinuousTimeMode, (f->c), fmi3EnterContinuousTimeMode, (f->c));
}

static int event(Fmu *f) { return BOTH(fmi2EnterEventMode, (f->c), fmi3EnterEventMode, (f->c)); }

static int step(Fmu *f, double h)
{
    fmi3Boolean a, b, c;
    double reached;
    int status = BOTH(fmi2DoStep, (f->c, f->time, h, 1), fmi3DoStep, (f->c, f->time, h, true, &a, &b, &c, &reached));
    f->time += h;
    return status;
}

static int save(Fmu *f, void **s)
{
    f->kept = f->time;
    return BOTH(fmi2GetFMUstate, (f->c, s), fmi3GetFMUState, (f->c, s));
}

static int restore(Fmu *f, void *s)
{
    f->time = f->kept;
    return BOTH(fmi2SetFMUstate, (f->c, s), fmi3SetFMUState, (f->c, s));
}

static int drop(Fmu *f, void **s) { return BOTH(fmi2FreeFMUstate, (f->c, s), fmi3FreeFMUState, (f->c, s)); }

static int saved_size(Fmu *f, void *s, size_t *n)
{
    return BOTH(fmi2SerializedFMUstateSize, (f->c, s, n), fmi3SerializedFMUStateSize, (f->c, s, n));
}

static int pack(Fmu *f, void *s, void *bytes, size_t n)
{
    return BOTH(fmi2SerializeFMUstate, (f->c, s, (char *)bytes, n), fmi3SerializeFMUState,
                (f->c, s, (uint8_t *)bytes, n));
}

static int unpack(Fmu *f, const void *bytes, size_t n, void **s)
{
    return BOTH(fmi2DeSerializeFMUstate, (f->c, (const char *)bytes, n, s), fmi3DeserializeFMUState,
                (f->c, (const uint8_t *)bytes, n, s));
}

/* Until it can be stepped: step mode, or continuous-time mode. */
static Fmu running(void *library, int version, int exchange, double z, double v)
{
    Fmu f = fmu(library, version, exchange), *it = &f;
    CHECK(f.c != NULL);
    CHECK(enter(it) == 0);
    CHECK(move(it, z, v) == 0);
    CHECK(leave(it) == 0);
    if (exchange) CHECK(update(it) == 0 && continuous(it) == 0);
    return f;
}
