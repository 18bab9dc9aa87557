/* A host without Python: two exported joints at once repeat the reference runs that their FMUs carry.
 *
 * usage: exported VERSION LIBRARY TOKEN LIBRARY TOKEN < RUNS
 * RUNS: for each joint the number of rows, and for each row time, displacement, velocity and force.
 * Prints the largest difference relative to the largest force of each joint. */
#include "runtime_fmu.h"

enum { LAG = 37, MOST = 4000 };

typedef struct {
    const char *path, *token;
    void *library;
    int rows;
    double t[MOST], z[MOST], v[MOST], force[MOST], found[MOST], largest, worst;
} Joint;

static Joint joints[2];
static int version;

static void row(const Joint *j, Fmu *f, int i, double *force)
{
    if (i < 0 || i >= j->rows) return;
    CHECK(move(f, j->z[i], j->v[i]) == 0);
    if (i == 0) {
        CHECK(leave(f) == 0);
        f->time = j->t[0];
    } else
        CHECK(step(f, j->t[i] - j->t[i - 1]) == 0);
    *force = value(f, FORCE);
}

/* From birth to end: both joints in turn, and a second instance of each that lags behind. */
static void life(int first)
{
    static double late[2][MOST];
    Fmu f[4];
    int i, k, most = joints[0].rows > joints[1].rows ? joints[0].rows : joints[1].rows;
    for (k = 0; k < 4; k++) {
        f[k] = fmu_with(joints[k % 2].library, version, 0, "host", joints[k % 2].token, 1);
        CHECK(f[k].c && enter(&f[k]) == 0);
    }
    for (i = 0; i < most + LAG; i++)
        for (k = 0; k < 4; k++) {
            Joint *j = &joints[k % 2];
            double force = NAN;
            row(j, &f[k], k < 2 ? i : i - LAG, &force);
            if (k < 2 && i < j->rows) {
                CHECK(first || j->found[i] == force);
                j->found[i] = force;
                j->worst = fmax(j->worst, fabs(force - j->force[i]));
            } else if (k >= 2 && i >= LAG && i - LAG < j->rows)
                late[k % 2][i - LAG] = force;
        }
    for (k = 0; k < 2; k++) CHECK(memcmp(late[k], joints[k].found, (size_t)joints[k].rows * sizeof(double)) == 0);
    for (k = 3; k >= 0; k--) {
        CHECK(terminate(&f[k]) == 0);
        fmu_free(&f[k]);
    }
    CHECK(!told.count);
}

static int python_is_here(void)
{
    char line[4096];
    int found = 0;
    FILE *file = fopen("/proc/self/maps", "r");
    if (!file) return 1;
    while (fgets(line, sizeof line, file)) found |= strstr(line, "libpython") != NULL;
    fclose(file);
    return found;
}

int main(int count, char **arguments)
{
    int i, k, round;
    if (count != 6) return 2;
    version = atoi(arguments[1]);
    for (k = 0; k < 2; k++) {
        Joint *j = &joints[k];
        j->path = arguments[2 + 2 * k], j->token = arguments[3 + 2 * k];
        if (scanf("%d", &j->rows) != 1 || j->rows > MOST) return 2;
        for (i = 0; i < j->rows; i++) {
            if (scanf("%lf %lf %lf %lf", &j->t[i], &j->z[i], &j->v[i], &j->force[i]) != 4) return 2;
            j->largest = fmax(j->largest, fabs(j->force[i]));
        }
    }
    /* Twice: the libraries leave the process in between. */
    for (round = 0; round < 2; round++) {
        for (k = 0; k < 2; k++) {
            joints[k].library = dlopen(joints[k].path, RTLD_NOW | RTLD_LOCAL);
            if (!joints[k].library) {
                printf("%s\n", dlerror());
                return 1;
            }
        }
        CHECK(!python_is_here());
        life(round == 0), life(0);
        for (k = 0; k < 2; k++) {
            CHECK(dlclose(joints[k].library) == 0);
            CHECK(dlopen(joints[k].path, RTLD_NOW | RTLD_NOLOAD) == NULL);
        }
    }
    printf("%.17g %.17g\n", joints[0].worst / joints[0].largest, joints[1].worst / joints[1].largest);
    return failures != 0;
}
