/* Directional and adjoint derivatives: analytic partials of the force and the rates by inputs and states. */
#include <string.h>
#include "instance.h"

enum { JL_WIDTH = 2 + JL_STATES };

/* One row of JL_WIDTH partials for the force, then one for the rate of each state. */
typedef double jl_table[(1 + JL_STATES) * JL_WIDTH];

/* A virgin state follows the displacement, which laws let it do linearly: its slope is exact over any distance. */
static void jl_virgin(const jl_values *v, jl_table table)
{
    double s[JL_ROOM(JL_STATES)];
    int m[JL_ROOM(JL_MODES)], i, j;
    jl_initial(v->p, v->input[0] + 1.0, s, m);
    for (i = 0; i <= JL_STATES; i++)
        for (j = 0; j < JL_STATES; j++) table[i * JL_WIDTH] += table[i * JL_WIDTH + 2 + j] * (s[j] - v->s[j]);
}

/* Co-simulation holds the states; only before initialization ends do they follow the displacement. */
static void jl_fill(const jl_values *v, jl_table table)
{
    double held[2];
    memset(table, 0, sizeof(jl_table));
    if (v->exchange || !v->initialized)
        jl_partials(v->p, v->s, v->m, v->input[0], v->input[1], table, table + JL_WIDTH);
    if (!v->initialized) jl_virgin(v, table);
    if (v->exchange) return;
    jl_step_partials(v->p, v->s, v->input[0], v->input[1], held);
    if (v->initialized) table[0] = held[0];
    table[1] = held[1];
}

/* Row of an unknown, -1 if it is none. */
static int jl_row(const jl_values *v, unsigned int reference)
{
    if (reference == JL_FORCE) return 0;
    if (v->exchange && reference >= JL_FIRST_RATE && reference < JL_FIRST_INDICATOR)
        return 1 + jl_continuous[reference - JL_FIRST_RATE];
    return -1;
}

/* Column of a known, -1 if it is none. */
static int jl_column(const jl_values *v, unsigned int reference)
{
    int i;
    /* How the force hangs on the states, which a virgin one follows, is only known where there is model exchange. */
    if (reference == 0 && !v->initialized && JL_STATES && !JL_EXCHANGE) return -1;
    if (reference < 2) return (int)reference;
    for (i = 0; i < JL_CONTINUOUS; i++)
        if (v->exchange && v->initialized && (int)reference == JL_FIRST_STATE + jl_continuous[i])
            return 2 + jl_continuous[i];
    return -1;
}

int jl_derivative(void *c, jl_call call, const jl_directions *asked)
{
    jl_instance *instance = (jl_instance *)c;
    const jl_values *v;
    const size_t rows = asked->unknown_count, columns = asked->known_count;
    const size_t seeds = asked->adjoint ? rows : columns, results = asked->adjoint ? columns : rows;
    jl_table table;
    size_t i, j;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (asked->seed_count != seeds || asked->result_count != results)
        return jl_fail(instance, call, "%lu seeds and room for %lu results, expected %lu and %lu",
                       (unsigned long)asked->seed_count, (unsigned long)asked->result_count, (unsigned long)seeds,
                       (unsigned long)results);
    if ((rows && !asked->unknowns) || (columns && !asked->knowns) || (seeds && !asked->seed)
        || (results && !asked->result))
        return jl_fail(instance, call, "the references, the seed or the result are NULL");
    v = &instance->values;
    for (i = 0; i < rows; i++)
        if (jl_row(v, asked->unknowns[i]) < 0)
            return jl_fail(instance, call, "value reference %u is no unknown here", asked->unknowns[i]);
    for (j = 0; j < columns; j++)
        if (jl_column(v, asked->knowns[j]) < 0)
            return jl_fail(instance, call, "value reference %u is no known here", asked->knowns[j]);
    if (jl_prepare(instance, call)) return JL_ERROR;
    jl_fill(v, table);
    for (i = 0; i < results; i++) asked->result[i] = 0.0;
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++) {
            const double partial = table[jl_row(v, asked->unknowns[i]) * JL_WIDTH + jl_column(v, asked->knowns[j])];
            if (asked->adjoint) asked->result[j] += partial * asked->seed[i];
            else asked->result[i] += partial * asked->seed[j];
        }
    return JL_OK;
}
