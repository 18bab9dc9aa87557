/* A host that drives one joint at random, with many sets of parameters: every force and state must stay in its bounds.
 *
 * usage: storm LIBRARY TOKEN STEPS < PLAN
 * PLAN: the value references of the parameters, of the states, the places of the continuous states among the states
 * (each list behind its length), the number of event indicators, the number of lives, and for each life the amplitudes
 * of displacement and velocity, the bound of the force, the parameters, and the bounds of the states.
 * Prints steps, forces that were not zero, largest share of the bound, and resident pages after a quarter and at the
 * end. Exit status 1 at the first finding. */
#include "runtime_fmu.h"
#include <float.h>

enum { MOST = 512 };

typedef struct {
    int count;
    unsigned at[MOST];
} List;

static List parameters, states, continuous_states;
static int indicators;
static double amplitude, velocity, bound, p[MOST], bounds[MOST], largest;
static long moved;

static uint64_t seed = 88172645463325252u;

/* Uniform in (0, 1). */
static double uniform(void)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return ((double)(seed >> 12) + 0.5) / 4503599627370496.0;
}

static double between(double low, double high) { return low + (high - low) * uniform(); }

static double decades(double low, double high) { return pow(10.0, between(low, high)); }

static void read_number(double *x)
{
    if (scanf("%lf", x) != 1) exit(2);
}

static int read_count(void)
{
    double x;
    read_number(&x);
    if (x < 0 || x > MOST) exit(2);
    return (int)x;
}

static void read_list(List *list)
{
    int i;
    list->count = read_count();
    for (i = 0; i < list->count; i++) list->at[i] = (unsigned)read_count();
}

static void need(int good, const char *what, const Fmu *f, double x, double limit)
{
    int i;
    if (good) return;
    printf("FMI %d %s, t = %g: %s is %.17g, limit %.17g (last message: %s); parameters", f->version,
           f->exchange ? "model exchange" : "co-simulation", f->time, what, x, limit, told.text);
    for (i = 0; i < parameters.count; i++) printf(" %.17g", p[i]);
    printf("\n");
    exit(1);
}

/* What the physics allows, and no message. */
static void look(Fmu *f)
{
    const double force = value(f, FORCE);
    double x[MOST];
    int i, n = states.count;
    need(fabs(force) <= bound, "force", f, force, bound);
    moved += force != 0.0;
    if (bound > 0.0) largest = fmax(largest, fabs(force) / bound);
    if (n) need(BOTH(fmi2GetReal, (f->c, states.at, n, x), fmi3GetFloat64, (f->c, states.at, n, x, n)) == 0, "states", f,
                n, 0);
    for (i = 0; i < n; i++) {
        /* Where displacement jumps against the velocity, a slider of model exchange stands its reach ahead of it. */
        const double limit = f->exchange ? DBL_MAX : bounds[i];
        char name[32];
        snprintf(name, sizeof name, "state %d", i);
        need(fabs(x[i]) <= limit, name, f, x[i], limit);
    }
    need(!told.count, "message", f, told.count, 0);
}

static void walk(double h, double *z, double *v)
{
    const double kind = uniform();
    if (kind < 0.5) { /* a path */
        const double side = uniform() < 0.3 ? -1.0 : 1.0, before = *z;
        *z = fmax(-amplitude, fmin(amplitude, *z + copysign(amplitude * decades(-9, 0), *v * side)));
        *v = fmax(-velocity, fmin(velocity, (*z - before) / h));
    } else if (kind < 0.7) { /* a jump; velocity and displacement have nothing to do with each other */
        *z = between(-amplitude, amplitude);
        *v = between(-velocity, velocity);
    } else if (kind < 0.8) { /* creep */
        *v = copysign(velocity * decades(-18, 0), *v);
    } else if (kind < 0.9) { /* rest */
        *v = 0.0;
    } else { /* edges of the range and of the numbers */
        static const double edges[] = { 0.0, -0.0, 1.0, -1.0, 4e-310, -4e-310 };
        *z = amplitude * edges[(int)(6 * uniform())];
        *v = velocity * edges[(int)(6 * uniform())];
    }
}

/* There and back through bytes. */
static void travel_as_bytes(Fmu *f)
{
    void *state = NULL, *copy = NULL, *bytes;
    const double before = value(f, FORCE);
    size_t size = 0;
    int good = save(f, &state) == 0 && saved_size(f, state, &size) == 0;
    bytes = malloc(size);
    good = good && pack(f, state, bytes, size) == 0 && unpack(f, bytes, size, &copy) == 0 && restore(f, copy) == 0;
    need(good && value(f, FORCE) == before, "force that was saved", f, value(f, FORCE), before);
    free(bytes);
    need(drop(f, &state) == 0 && drop(f, &copy) == 0, "state that is dropped", f, 0, 0);
}

static void slopes(Fmu *f)
{
    const unsigned unknown = FORCE, known[] = { Z, V };
    const double seeds[] = { 1.0, 1.0 };
    double slope = NAN;
    int status = BOTH(fmi2GetDirectionalDerivative, (f->c, &unknown, 1, known, 2, seeds, &slope),
                      fmi3GetDirectionalDerivative, (f->c, &unknown, 1, known, 2, seeds, 2, &slope, 1));
    need(status == 0 && isfinite(slope), "slope", f, slope, INFINITY);
}

/* A point of model exchange: states within their bounds, and the event that they may ask for. */
static void exchange_point(Fmu *f, double z, double v)
{
    double x[MOST], g[MOST];
    int i, n = continuous_states.count, m = indicators, good;
    f->time += decades(-9, 0);
    for (i = 0; i < n; i++) x[i] = between(-1.0, 1.0) * bounds[continuous_states.at[i]];
    good = BOTH(fmi2SetTime, (f->c, f->time), fmi3SetTime, (f->c, f->time)) == 0 && move(f, z, v) == 0;
    good = good && BOTH(fmi2SetContinuousStates, (f->c, x, n), fmi3SetContinuousStates, (f->c, x, n)) == 0;
    for (i = 0; i < 2 && good; i++) { /* before the event and after it */
        good = BOTH(fmi2GetDerivatives, (f->c, x, n), fmi3GetContinuousStateDerivatives, (f->c, x, n)) == 0;
        good = good && BOTH(fmi2GetEventIndicators, (f->c, g, m), fmi3GetEventIndicators, (f->c, g, m)) == 0;
        need(isfinite(value(f, FORCE)), "force", f, value(f, FORCE), INFINITY);
        if (i == 0) good = good && event(f) == 0 && update(f) == 0 && continuous(f) == 0;
    }
    need(good, "model exchange", f, 0, 0);
    for (i = 0; i < n; i++) need(isfinite(x[i]), "rate", f, x[i], INFINITY);
    for (i = 0; i < m; i++) need(isfinite(g[i]), "indicator", f, g[i], INFINITY);
    look(f);
    slopes(f);
}

static long pages(void)
{
    long all = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &all, &resident) != 2) exit(2);
    fclose(file);
    return resident;
}

static Fmu born(void *library, const char *token, int version, int exchange)
{
    Fmu f = fmu_with(library, version, exchange, "storm", token, 1), *it = &f;
    const int n = parameters.count;
    int good = f.c && BOTH_OF(it, fmi2SetReal, (f.c, parameters.at, n, p), fmi3SetFloat64,
                              (f.c, parameters.at, n, p, n)) == 0;
    good = good && enter(it) == 0 && move(it, between(-amplitude, amplitude), 0.0) == 0 && leave(it) == 0;
    if (exchange) good = good && update(it) == 0 && continuous(it) == 0;
    need(good, "birth", it, 0, 0);
    return f;
}

int main(int count, char **arguments)
{
    long steps = count == 4 ? atol(arguments[3]) : 0, done = 0, early = 0;
    int life, lives, i;
    void *library = steps ? dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL) : NULL;
    if (!library) return 2;
    read_list(&parameters), read_list(&states), read_list(&continuous_states);
    indicators = read_count(), lives = read_count();
    for (life = 0; life < lives; life++) {
        const int version = 2 + life % 2;
        Fmu f, point;
        double z, v = 0.0;
        long step_of_life;
        read_number(&amplitude), read_number(&velocity), read_number(&bound);
        for (i = 0; i < parameters.count; i++) read_number(&p[i]);
        for (i = 0; i < states.count; i++) read_number(&bounds[i]);
        f = born(library, arguments[2], version, 0), point = born(library, arguments[2], version, 1);
        z = value(&f, Z);
        for (step_of_life = 0; step_of_life < steps; step_of_life++, done++) {
            const double h = decades(-9, 0);
            walk(h, &z, &v);
            need(move(&f, z, v) == 0, "inputs", &f, z, amplitude);
            if (step_of_life % 16 == 0) look(&f); /* feedthrough */
            need(step(&f, h) == 0, "step", &f, h, 0);
            look(&f);
            if (step_of_life % 32 == 5) slopes(&f), travel_as_bytes(&f);
            if (step_of_life % 16 == 9) exchange_point(&point, z, v);
        }
        need(terminate(&f) == 0 && terminate(&point) == 0, "end", &f, 0, 0);
        fmu_free(&f), fmu_free(&point);
        if (life == lives / 4) early = pages();
    }
    printf("%ld %ld %.17g %ld %ld\n", done, moved, largest, early, pages());
    return dlclose(library) != 0 || failures != 0;
}
