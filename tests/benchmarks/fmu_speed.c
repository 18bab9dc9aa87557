/* Time of one step of an FMI 2.0 co-simulation in a C client: set displacement and velocity, step, get the force.
 *
 * usage: fmu_speed LIBRARY TOKEN RESOURCES STEPS REPEATS FIRST
 * RESOURCES: URI of the folder "resources"; FIRST: value reference of displacement, which velocity and force follow.
 * Prints the shortest time of a step in ns and the time to instantiate and initialize in ns. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "fmi2FunctionTypes.h"

static void tell(fmi2ComponentEnvironment where, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String format, ...)
{
    va_list list;
    (void)where, (void)category;
    va_start(list, format);
    fprintf(stderr, "%s, status %d: ", name, (int)status);
    vfprintf(stderr, format, list);
    fprintf(stderr, "\n");
    va_end(list);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void *find(void *library, const char *name)
{
    void *address = dlsym(library, name);
    if (address) return address;
    fprintf(stderr, "%s\n", dlerror());
    exit(1);
}
#define CALL(name) ((name##TYPE *)(uintptr_t)find(library, #name))

int main(int count, char **arguments)
{
    const double h = 1e-6, omega = 2e3, size = 4e-6;
    const fmi2CallbackFunctions callbacks = { tell, calloc, free, NULL, NULL };
    fmi2DoStepTYPE *step;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    double best = INFINITY, born, sum = 0.0;
    fmi2ValueReference inputs[2], output;
    int bad = 0;
    long i, k, steps, repeats;
    void *library, *fmu;
    if (count != 7) return 2;
    inputs[0] = (fmi2ValueReference)atol(arguments[6]), inputs[1] = inputs[0] + 1, output = inputs[0] + 2;
    steps = atol(arguments[4]), repeats = atol(arguments[5]);
    library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 1;
    }
    step = CALL(fmi2DoStep), set = CALL(fmi2SetReal), get = CALL(fmi2GetReal);
    born = now();
    fmu = CALL(fmi2Instantiate)("speed", fmi2CoSimulation, arguments[2], arguments[3], &callbacks, 0, 0);
    if (!fmu) return 1;
    bad |= CALL(fmi2SetupExperiment)(fmu, 0, 0.0, 0.0, 0, 0.0) != fmi2OK;
    bad |= CALL(fmi2EnterInitializationMode)(fmu) != fmi2OK || CALL(fmi2ExitInitializationMode)(fmu) != fmi2OK;
    born = now() - born;
    for (k = 0; k < repeats; k++) {
        const double start = now();
        for (i = 0; i < steps; i++) {
            /* A triangle instead of a sine: the client itself takes next to no time. */
            const double t = h * (double)(k * steps + i), side = i % 1000 < 500 ? 1.0 : -1.0;
            const double x[] = { size * (side * (double)(i % 500) / 250.0 - side), side * size * omega };
            double force;
            bad |= set(fmu, inputs, 2, x) | step(fmu, t, h, fmi2True) | get(fmu, &output, 1, &force);
            sum += force;
        }
        best = fmin(best, (now() - start) / (double)steps);
    }
    if (bad || !isfinite(sum) || sum == 0.0) {
        fprintf(stderr, "a call failed, or there was no force\n");
        return 1;
    }
    printf("%.17g %.17g\n", best, born);
    return 0;
}
