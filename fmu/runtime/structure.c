/* The linear structure: products of its sparse matrices with states x, inputs u and joint forces f. */
#include <string.h>
#include "instance.h"

#define JL_SLOW 1e6 /* s, how long a joint takes to be loaded */

/* Forces that are not given are 0. */
void jl_moves(int first, int count, const double *x, const double *u, const double *f, double *result)
{
    double all[JL_ROOM(JL_COLUMNS)] = { 0.0 };
    int i, k;
    memcpy(all, x, JL_STRUCTURE * sizeof *all);
    memcpy(all + JL_STRUCTURE, u, JL_INPUTS * sizeof *all);
    if (f) memcpy(all + JL_STRUCTURE + JL_INPUTS, f, JL_JOINTS * sizeof *all);
    for (i = 0; i < count; i++) {
        double sum = 0.0;
        for (k = jl_first[first + i]; k < jl_first[first + i + 1]; k++) sum += jl_entry[k] * all[jl_column[k]];
        result[i] = sum;
    }
}

/* Rows from `first` on. */
static void jl_product(int first, int count, const double *x, const double *u, const double *f, double *result)
{
    int i;
    jl_moves(first, count, x, u, f, result);
    for (i = 0; i < count && JL_LOADED; i++) result[i] += jl_load[first + i];
}

/* The joints before the first step: virgin where they are, or loaded there slowly from 0. */
void jl_begin(const double *p, const double *motion, double *s, int *m)
{
    double zero[JL_ROOM(JL_MOTIONS)] = { 0.0 }, still[JL_ROOM(JL_MOTIONS)] = { 0.0 };
    double virgin[JL_ROOM(JL_MEMORY)] = { 0.0 }, f[JL_ROOM(JL_JOINTS)];
    int i;
    if (!JL_LOADED) {
        jl_initial(p, motion, s, m);
        return;
    }
    for (i = 0; i < JL_MOTIONS; i += 2) still[i] = motion[i];
#ifdef JL_CONDITIONS
    for (i = 2 * JL_JOINTS; i < JL_MOTIONS; i++) zero[i] = still[i] = motion[i];
#endif
    jl_initial(p, zero, virgin, m);
    jl_step(p, virgin, still, JL_SLOW, s, f);
    (void)jl_event(p, s, m, still);
}

void jl_motion(const double *x, const double *u, double *motion)
{
    jl_product(JL_STRUCTURE, JL_MOTIONS, x, u, NULL, motion);
}

void jl_slopes(const double *x, const double *u, const double *f, double *slope)
{
    jl_product(0, JL_STRUCTURE, x, u, f, slope);
}

void jl_outputs(const double *x, const double *u, const double *f, double *y)
{
    jl_product(JL_STRUCTURE + JL_MOTIONS, JL_OUTPUTS, x, u, f, y);
}

/* Rates of all states, those of the structure first. */
void jl_all_rates(const double *p, const double *s, const int *m, const double *u, double *rate)
{
    double motion[JL_ROOM(JL_MOTIONS)], f[JL_ROOM(JL_JOINTS)];
    jl_motion(s, u, motion);
    jl_force(p, s + JL_STRUCTURE, m, motion, f);
    jl_slopes(s, u, f, rate);
    jl_rates(p, s + JL_STRUCTURE, m, motion, rate + JL_STRUCTURE);
}
