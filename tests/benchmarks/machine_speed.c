/* A machine FMU (FMI 2.0, co-simulation) under held forces in a C client.
 *
 * usage: machine_speed LIBRARY TOKEN FORCE OUTPUT SIZE TOLERANCE STEP STEPS EVERY NUDGED
 * FORCE, OUTPUT: value references; SIZE: of the force in N, a sum of sines below 1/(40 STEP); TOLERANCE: 0 tells none.
 * NUDGED: value reference of a parameter that is moved by 1e-12 of itself, which opens a closed structure; 0 is none.
 * Prints the time of a step in s, the work of the force in J (where OUTPUT is the displacement along it), then the
 * output behind every EVERY-th step. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "fmi2FunctionTypes.h"

static void tell(fmi2ComponentEnvironment where, fmi2String name, fmi2Status status, fmi2String category, fmi2String format,
                 ...)
{
    va_list list;
    (void)where, (void)name, (void)status, (void)category, (void)format;
    va_start(list, format);
    fprintf(stderr, "%s\n", va_arg(list, const char *));
    va_end(list);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *find(void *library, const char *name)
{
    void *address = dlsym(library, name);
    if (address) return address;
    fprintf(stderr, "%s is missing\n", name);
    exit(1);
}
#define CALL(name) ((name##TYPE *)(uintptr_t)find(library, #name))

int main(int count, char **arguments)
{
    const fmi2CallbackFunctions callbacks = { tell, calloc, free, NULL, NULL };
    fmi2ValueReference force, output, nudged;
    double size, tolerance, h, taken, work = 0.0, begun = 0.0, *found;
    long i, steps, every;
    void *library, *fmu;
    int bad = 0;
    if (count != 11) return 2;
    nudged = (fmi2ValueReference)atol(arguments[10]);
    force = (fmi2ValueReference)atol(arguments[3]), output = (fmi2ValueReference)atol(arguments[4]);
    size = atof(arguments[5]), tolerance = atof(arguments[6]), h = atof(arguments[7]);
    steps = atol(arguments[8]), every = atol(arguments[9]);
    library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    found = malloc((size_t)steps * sizeof *found);
    if (!library || !found) return 1;
    fmu = CALL(fmi2Instantiate)("speed", fmi2CoSimulation, arguments[2], NULL, &callbacks, 0, 1);
    if (!fmu) return 1;
    bad |= CALL(fmi2SetupExperiment)(fmu, tolerance > 0.0, tolerance, 0.0, 0, 0.0) != fmi2OK;
    bad |= CALL(fmi2EnterInitializationMode)(fmu) != fmi2OK;
    if (nudged) {
        double value = 0.0;
        bad |= CALL(fmi2GetReal)(fmu, &nudged, 1, &value) != fmi2OK;
        value *= 1.0 + 1e-12;
        bad |= CALL(fmi2SetReal)(fmu, &nudged, 1, &value) != fmi2OK;
    }
    bad |= CALL(fmi2ExitInitializationMode)(fmu) != fmi2OK;
    bad |= CALL(fmi2GetReal)(fmu, &output, 1, &begun) != fmi2OK;
    taken = now();
    for (i = 0; i < steps && !bad; i++) {
        const double t = h * (double)i, w = 2.0 * 3.14159265358979 / (40.0 * h);
        const double f = size * (0.4 * sin(w * t) + 0.3 * sin(0.37 * w * t) + 0.3 * sin(0.11 * w * t + 1.0));
        bad |= CALL(fmi2SetReal)(fmu, &force, 1, &f) != fmi2OK;
        bad |= CALL(fmi2DoStep)(fmu, t, h, fmi2True) != fmi2OK;
        bad |= CALL(fmi2GetReal)(fmu, &output, 1, found + i) != fmi2OK;
        work += f * (found[i] - (i ? found[i - 1] : begun));
    }
    taken = (now() - taken) / (double)steps;
    if (bad) return 1;
    printf("%.6g\n%.17g\n", taken, work);
    for (i = every - 1; i < steps; i += every) printf("%.17g\n", found[i]);
    return 0;
}
