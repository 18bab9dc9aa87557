/* A host without Python: a joint whose conditions change from step to step, with a state that is saved on the way.
 *
 * usage: conditioned VERSION LIBRARY TOKEN CONDITIONS < ROWS
 * ROWS: their number, the start (displacement, velocity, conditions), and for each step its length and the same.
 * Prints the force after each step; what the FMU logged goes to standard error. */
#include "runtime_fmu.h"

enum { MOST = 8 };

static int inputs;

static void put(Fmu *f)
{
    double x[MOST];
    unsigned reference[MOST];
    int i;
    for (i = 0; i < inputs; i++) {
        reference[i] = (unsigned)i + 1u;
        if (scanf("%lf", &x[i]) != 1) exit(2);
    }
    CHECK(BOTH(fmi2SetReal, (f->c, reference, (size_t)inputs, x), fmi3SetFloat64,
               (f->c, reference, (size_t)inputs, x, (size_t)inputs)) == 0);
}

int main(int count, char **arguments)
{
    Fmu f;
    int rows, i;
    void *library, *saved = NULL;
    if (count != 5 || scanf("%d", &rows) != 1) return 2;
    inputs = 2 + atoi(arguments[4]);
    library = dlopen(arguments[2], RTLD_NOW | RTLD_LOCAL);
    if (!library || inputs > MOST) return 2;
    f = fmu_with(library, atoi(arguments[1]), 0, "host", arguments[3], 1);
    CHECK(f.c && enter(&f) == 0);
    put(&f);
    CHECK(leave(&f) == 0);
    for (i = 0; i < rows; i++) {
        double h, force;
        if (scanf("%lf", &h) != 1) return 2;
        put(&f);
        CHECK(save(&f, &saved) == 0);
        CHECK(step(&f, h) == 0);
        force = value(&f, (unsigned)inputs + 1u);
        CHECK(restore(&f, saved) == 0);
        CHECK(step(&f, h) == 0);
        CHECK(value(&f, (unsigned)inputs + 1u) == force);
        printf("%.17g\n", force);
    }
    CHECK(drop(&f, &saved) == 0);
    CHECK(terminate(&f) == 0);
    fmu_free(&f);
    if (told.count) fprintf(stderr, "%d: %s\n", told.count, told.text);
    return failures != 0;
}
