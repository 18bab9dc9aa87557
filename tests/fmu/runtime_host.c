/* A host without Python: runs one check of the FMI wrapper on the libraries of two hand-written joints.
 *
 * usage: host CHECK VERSION me|cs JOINT_LIBRARY SPRING_LIBRARY
 * Exit status 0 and no output if the check holds; `order` prints what every function answered in every state. */
#include "runtime_fmu.h"

static void *library, *spring;
static int version, exchange;

enum { STEPS = 400 };
static const double pi = 3.14159265358979323846, h = 1e-5;

static double travel(double t) { return 8e-5 * sin(2.0 * pi * 250.0 * t); }
static double speed(double t) { return 8e-5 * 2.0 * pi * 250.0 * cos(2.0 * pi * 250.0 * t); }

/* The joint as a play operator: the slider is dragged along at the distance of its reach. */
static double reference(double *slider, double z, double v)
{
    const double reach = 20.0 / 2e6;
    *slider = fmax(z - reach, fmin(z + reach, *slider));
    return 1e6 * z + 100.0 * v + 1e14 * z * z * z + 2e6 * (z - *slider) + (z > 5e-5 ? 1e7 * (z - 5e-5) : 0.0);
}

static int vector(Fmu *f, char what, double *x)
{
    switch (what) {
    case 'x': return BOTH(fmi2GetContinuousStates, (f->c, x, 1), fmi3GetContinuousStates, (f->c, x, 1));
    case 'd': return BOTH(fmi2GetDerivatives, (f->c, x, 1), fmi3GetContinuousStateDerivatives, (f->c, x, 1));
    case 'g': return BOTH(fmi2GetEventIndicators, (f->c, x, 2), fmi3GetEventIndicators, (f->c, x, 2));
    case 'n':
        return BOTH(fmi2GetNominalsOfContinuousStates, (f->c, x, 1), fmi3GetNominalsOfContinuousStates, (f->c, x, 1));
    default: return BOTH(fmi2SetContinuousStates, (f->c, x, 1), fmi3SetContinuousStates, (f->c, x, 1));
    }
}

/* One step of h seconds: co-simulation, or Euler's rule with the events that the indicators announce. */
static double advance(Fmu *f, double z, double v, int *events)
{
    double x, rate, before[2], g[2];
    if (!f->exchange) {
        CHECK(move(f, z, v) == 0);
        CHECK(step(f, h) == 0);
        return value(f, FORCE);
    }
    CHECK(vector(f, 'g', before) == 0);
    CHECK(vector(f, 'x', &x) == 0);
    CHECK(vector(f, 'd', &rate) == 0);
    x += h * rate;
    f->time += h;
    CHECK(BOTH(fmi2SetTime, (f->c, f->time), fmi3SetTime, (f->c, f->time)) == 0);
    CHECK(move(f, z, v) == 0);
    CHECK(vector(f, 's', &x) == 0);
    CHECK(vector(f, 'g', g) == 0);
    if ((before[0] > 0) != (g[0] > 0) || (before[1] > 0) != (g[1] > 0)) {
        (*events)++;
        CHECK(event(f) == 0);
        CHECK(update(f) == 0);
        CHECK(continuous(f) == 0);
    }
    return value(f, FORCE);
}

static void run(Fmu *f, double *force, int count)
{
    int i, events = 0;
    for (i = 0; i < count; i++) {
        const double t = f->time + f->ahead + h;
        force[i] = advance(f, travel(t), speed(t), &events);
    }
    CHECK(!f->exchange || count < STEPS || events >= 6);
}

/* Instantiate, initialize, step, terminate, free, twice, and once without names and logger. */
static void life(void)
{
    static double force[STEPS];
    double slider = 0.0, worst = 0.0, x;
    int i, again;
    for (again = 0; again < 2; again++) {
        Fmu f = running(library, version, exchange, 0.0, speed(0.0)), *it = &f;
        run(it, force, STEPS);
        for (i = 0, slider = 0.0, worst = 0.0; i < STEPS; i++) {
            const double t = (i + 1) * h;
            worst = fmax(worst, fabs(force[i] - reference(&slider, travel(t), speed(t))));
        }
        /* Euler's rule and events at the end of a step: the slider and the stop are late by a step's travel. */
        CHECK(worst < (exchange ? 2e6 * 2.0 * speed(0.0) * h + 1e7 * speed(0.0) * h : 1e-9));
        if (version == 2 && !exchange) {
            fmi2Boolean ended = 1;
            CHECK(CALL(library, fmi2GetRealStatus)(f.c, fmi2LastSuccessfulTime, &x) == 0 && x == f.time);
            CHECK(CALL(library, fmi2GetBooleanStatus)(f.c, fmi2Terminated, &ended) == 0 && !ended);
        }
        CHECK(terminate(it) == 0);
        CHECK(get(it, FORCE, &x) == 0 && x == force[STEPS - 1]);
        fmu_free(it);
    }
    {
        Fmu f = fmu_with(library, version, exchange, NULL, TOKEN, 0), *it = &f;
        CHECK(f.c && enter(it) == 0 && leave(it) == 0 && get(it, 99, &x) == 3);
        fmu_free(it);
        if (version == 2) {
            f.c = CALL(library, fmi2Instantiate)(NULL, exchange ? fmi2ModelExchange : fmi2CoSimulation, TOKEN, NULL,
                                                 NULL, 0, 0);
            CHECK(f.c && leave(it) == 3);
            fmu_free(it);
        }
        f.c = NULL;
        fmu_free(it);
        CHECK(enter(it) == 3 && get(it, FORCE, &x) == 3);
    }
    CHECK(strcmp(CALL(library, fmi2GetVersion)(), "2.0") == 0 && strcmp(CALL(library, fmi3GetVersion)(), "3.0") == 0);
    CHECK(strcmp(CALL(library, fmi2GetTypesPlatform)(), "default") == 0);
}

/* Two instances in turn, with another joint beside them, compute what each computes alone. */
static void two(void)
{
    static double alone[2][STEPS], together[2][STEPS];
    int i, k, events[2] = { 0, 0 };
    Fmu f[2], other = fmu_with(spring, version, 0, "other", "{runtime-spring-1}", 1);
    CHECK(enter(&other) == 0 && set(&other, Z, 1e-3) == 0 && leave(&other) == 0);
    for (k = 0; k < 2; k++) {
        Fmu one = running(library, version, exchange, 0.0, speed(0.0));
        one.ahead = 1e-3 * k;
        run(&one, alone[k], STEPS);
        fmu_free(&one);
        f[k] = running(library, version, exchange, 0.0, speed(0.0));
        f[k].ahead = 1e-3 * k;
    }
    for (i = 0; i < STEPS; i++)
        for (k = 0; k < 2; k++) {
            const double t = f[k].time + f[k].ahead + h;
            together[k][i] = advance(&f[k], travel(t), speed(t), &events[k]);
            CHECK(value(&other, FORCE) == 1000.0);
        }
    CHECK(memcmp(alone, together, sizeof alone) == 0);
    CHECK(memcmp(alone[0], alone[1], sizeof alone[0]) != 0);
    fmu_free(&f[1]), fmu_free(&f[0]), fmu_free(&other);
}

/* The same bits after a return to a saved state, in another instance, and after a reset. */
static void saved(void)
{
    static double first[STEPS], second[STEPS];
    Fmu f = running(library, version, exchange, 0.0, speed(0.0)), *it = &f, g, alien;
    void *state = NULL, *copy = NULL, *same;
    unsigned char *bytes, *others;
    size_t size = 0, i;
    double t;
    run(it, first, 37);
    CHECK(save(it, &state) == 0);
    t = f.time;
    run(it, first, 100);
    CHECK(restore(it, state) == 0);
    f.time = t;
    run(it, second, 100);
    CHECK(memcmp(first, second, 100 * sizeof *first) == 0);
    CHECK(saved_size(it, state, &size) == 0 && size > 0);
    bytes = malloc(size), others = malloc(size);
    CHECK(pack(it, state, bytes, size) == 0);
    g = fmu(library, version, exchange);
    CHECK(unpack(&g, bytes, size, &copy) == 0 && restore(&g, copy) == 0);
    g.time = t;
    run(&g, second, 100);
    CHECK(memcmp(first, second, 100 * sizeof *first) == 0);
    CHECK(restore(it, state) == 0);
    same = copy;
    CHECK(save(it, &copy) == 0 && copy == same); /* a place that is given is used again */
    CHECK(pack(it, copy, others, size) == 0 && memcmp(bytes, others, size) == 0);

    /* Any damaged byte, another length, another joint, the other kind of instance. */
    for (i = 0; i < size; i++) {
        void *none = NULL;
        bytes[i] ^= 0x10;
        CHECK(unpack(&g, bytes, size, &none) == 3 && none == NULL);
        bytes[i] ^= 0x10;
        CHECK(restore(&g, copy) == 0); /* out of the error state */
    }
    same = NULL;
    CHECK(unpack(&g, bytes, size - 1, &same) == 3 && same == NULL);
    CHECK(TOLD("belongs to another FMU"));
    alien = fmu_with(spring, version, 0, "alien", "{runtime-spring-1}", 1);
    CHECK(unpack(&alien, bytes, size, &same) == 3 && restore(&alien, copy) == 3 && TOLD("belongs to another FMU"));
    fmu_free(&alien);
    alien = fmu(library, version, !exchange);
    CHECK(restore(&alien, copy) == 3 && TOLD(exchange ? "is one of model exchange" : "is one of co-simulation"));
    fmu_free(&alien);

    /* Reset: every byte as in a fresh instance. */
    CHECK(reset(&g) == 0 && reset(it) == 0);
    fmu_free(&g);
    g = fmu(library, version, exchange);
    CHECK(save(it, &state) == 0 && save(&g, &copy) == 0);
    CHECK(pack(it, state, bytes, size) == 0 && pack(&g, copy, others, size) == 0);
    CHECK(memcmp(bytes, others, size) == 0);
    CHECK(pack(it, state, bytes, size + 1) == 3 && TOLD("expected"));
    CHECK(drop(it, &state) == 0 && state == NULL && drop(it, &state) == 0 && drop(it, &copy) == 0);
    free(bytes), free(others);
    fmu_free(&g), fmu_free(it);
}

static double directional(Fmu *f, unsigned unknown, unsigned known)
{
    double seed = 3.0, forward = NAN, adjoint = NAN;
    if (f->version == 2) {
        CHECK(CALL(library, fmi2GetDirectionalDerivative)(f->c, &unknown, 1, &known, 1, &seed, &forward) == 0);
        return forward / 3.0;
    }
    CHECK(CALL(library, fmi3GetDirectionalDerivative)(f->c, &unknown, 1, &known, 1, &seed, 1, &forward, 1) == 0);
    CHECK(CALL(library, fmi3GetAdjointDerivative)(f->c, &unknown, 1, &known, 1, &seed, 1, &adjoint, 1) == 0);
    CHECK(forward == adjoint);
    return forward / 3.0;
}

static void put(Fmu *f, unsigned known, double x)
{
    if (known == STATE) CHECK(vector(f, 's', &x) == 0);
    else CHECK(set(f, known, x) == 0);
}

/* Analytic derivatives against central differences by set and get. */
static void derivatives(void)
{
    static const unsigned unknowns[] = { FORCE, RATE }, knowns[] = { Z, V, STATE };
    static const double small[] = { 1e-9, 1e-6, 1e-9 };
    const double points[][2] = { { 3e-6, 0.02 }, { 3e-5, 0.05 }, { 7e-5, -0.01 } };
    int i, j, k, status;
    double seed[] = { 2.0, -5.0, 7.0 }, result[3], sum;
    for (i = 0; i < 3; i++) {
        Fmu f = running(library, version, exchange, 0.0, 0.0), *it = &f;
        CHECK(move(it, points[i][0], points[i][1]) == 0);
        if (exchange) CHECK(event(it) == 0 && update(it) == 0 && continuous(it) == 0);
        for (j = 0; j < (exchange ? 2 : 1); j++)
            for (k = 0; k < (exchange ? 3 : 2); k++) {
                const double at = value(it, knowns[k]), d = small[k], found = directional(it, unknowns[j], knowns[k]);
                double up, down;
                put(it, knowns[k], at + d), up = value(it, unknowns[j]);
                put(it, knowns[k], at - d), down = value(it, unknowns[j]);
                put(it, knowns[k], at);
                CHECK(fabs((up - down) / (2.0 * d) - found) <= 1e-6 * fabs(found) + 1e-7);
            }
        /* Several at once: the sum over the knowns. */
        k = exchange ? 3 : 2;
        status = BOTH_OF(it, fmi2GetDirectionalDerivative, (it->c, unknowns, 1, knowns, k, seed, result),
                       fmi3GetDirectionalDerivative, (it->c, unknowns, 1, knowns, k, seed, k, result, 1));
        for (j = 0, sum = 0.0; j < k; j++) sum += seed[j] * directional(it, FORCE, knowns[j]);
        CHECK(status == 0 && fabs(result[0] - sum) <= 1e-12 * fabs(sum));
        if (version == 3) {
            CHECK(CALL(library, fmi3GetAdjointDerivative)(f.c, unknowns, 1, knowns, k, seed, 1, result, k) == 0);
            for (j = 0; j < k; j++) CHECK(fabs(result[j] - 2.0 * directional(it, FORCE, knowns[j])) <= 1e-6);
            status = CALL(library, fmi3GetDirectionalDerivative)(f.c, unknowns, 1, knowns, k, seed, k - 1, result, 1);
            CHECK(status == 3);
        } else
            CHECK(CALL(library, fmi2GetDirectionalDerivative)(f.c, unknowns, 1, unknowns, 1, seed, result) == 3);
        fmu_free(it);
    }
    {
        /* Before initialization ends the virgin slider moves along: its stiffness is not felt. */
        Fmu f = fmu(library, version, exchange), *it = &f;
        double up, down;
        CHECK(enter(it) == 0 && move(it, 2e-5, 0.0) == 0);
        up = (set(it, Z, 2e-5 + 1e-9), value(it, FORCE)), down = (set(it, Z, 2e-5 - 1e-9), value(it, FORCE));
        CHECK(set(it, Z, 2e-5) == 0);
        sum = directional(it, FORCE, Z);
        CHECK(fabs((up - down) / 2e-9 - sum) < 1e-6 * sum);
        CHECK(directional(it, FORCE, V) == 100.0);
        fmu_free(it);
    }
}

/* A value that is set shows in the force at once, without a step, in every mode. */
static void feedthrough(void)
{
    Fmu f = fmu(library, version, exchange), *it = &f;
    double before, slider;
    CHECK(enter(it) == 0);
    CHECK(move(it, 1e-6, 0.0) == 0 && fabs(value(it, FORCE) - 1e6 * 1e-6) < 1e-3 && value(it, STATE) == 1e-6);
    CHECK(set(it, Z, 2e-6) == 0 && fabs(value(it, FORCE) - 1e6 * 2e-6) < 1e-3 && value(it, STATE) == 2e-6);
    CHECK(set(it, STIFFNESS, 2e6) == 0 && fabs(value(it, FORCE) - 2e6 * 2e-6) < 2e-3);
    CHECK(leave(it) == 0);
    /* From here on the slider stays: its spring of 2e6 N/m joins in. */
    CHECK(move(it, 3e-6, 0.01) == 0);
    CHECK(fabs(value(it, FORCE) - (2e6 * 3e-6 + 2e6 * 1e-6 + 100.0 * 0.01)) < 1e-2);
    CHECK(set(it, DAMPING, 300.0) == 0); /* tunable in step and event mode */
    CHECK(fabs(value(it, FORCE) - (2e6 * 3e-6 + 2e6 * 1e-6 + 300.0 * 0.01)) < 1e-2);
    if (exchange) {
        CHECK(update(it) == 0 && continuous(it) == 0);
        before = value(it, FORCE);
        CHECK(set(it, V, 0.02) == 0 && fabs(value(it, FORCE) - before - 3.0) < 1e-9);
        CHECK(set(it, DAMPING, 100.0) == 3 && TOLD("damper.damping cannot be set here"));
    } else {
        /* Looking far away does not drag the slider along. */
        slider = value(it, STATE);
        CHECK(move(it, 5e-5, 0.0) == 0 && value(it, FORCE) > 100.0 && value(it, STATE) == slider);
        CHECK(step(it, h) == 0 && value(it, STATE) > slider);
    }
    fmu_free(it);
}

#include "runtime_order.h"
#include "runtime_refusals.h"

int main(int count, char **arguments)
{
    static const struct {
        const char *name;
        void (*check)(void);
    } checks[] = { { "life", life },     { "two", two },          { "saved", saved },
                   { "order", order },   { "arguments", faults }, { "parameters", parameters },
                   { "events", events }, { "log", logging },      { "derivatives", derivatives },
                   { "feedthrough", feedthrough } };
    int round, i;
    if (count != 6) return 2;
    version = atoi(arguments[2]);
    exchange = strcmp(arguments[3], "me") == 0;
    /* Twice: the libraries leave the process in between. */
    for (round = 0; round < 2; round++) {
        library = dlopen(arguments[4], RTLD_NOW | RTLD_LOCAL);
        spring = dlopen(arguments[5], RTLD_NOW | RTLD_LOCAL);
        if (!library || !spring) {
            printf("%s\n", dlerror());
            return 1;
        }
        for (i = 0; i < (int)(sizeof checks / sizeof *checks); i++)
            if (strcmp(arguments[1], checks[i].name) == 0 && (round == 0 || checks[i].check != order))
                checks[i].check();
        dlclose(spring);
        dlclose(library);
        CHECK(dlopen(arguments[4], RTLD_NOW | RTLD_NOLOAD) == NULL);
    }
    return failures ? 1 : 0;
}
