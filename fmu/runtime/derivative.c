/* Directional and adjoint derivatives: analytic partials of the joints carried through the structure (chain rule). */
#include <string.h>
#include "instance.h"

enum { JL_UNKNOWNS = JL_OUTPUTS + JL_STATES, JL_KNOWNS = JL_INPUTS + JL_STATES };

/* Partials of the joints at the present point. */
typedef struct {
    double dF[JL_ROOM(JL_JOINTS * JL_WIDTH)], dR[JL_ROOM(JL_MEMORY * JL_WIDTH)];
    double follow[JL_ROOM(JL_MEMORY)]; /* slope of each state by the displacement of its joint */
} jl_partial;

/* A virgin state follows the displacement, which laws let it do linearly: its slope is exact over any distance. One that
 * was loaded does so piece by piece, and takes a small one. */
static void jl_virgin(const jl_values *v, const double *motion, double *follow)
{
    double moved[JL_ROOM(JL_MOTIONS)], s[JL_ROOM(JL_MEMORY)];
    const double far = JL_LOADED ? 1e-10 : 1.0;
    int m[JL_ROOM(JL_MODES)], i;
    for (i = 0; i < JL_MOTIONS; i++) moved[i] = motion[i] + (i % 2 ? 0.0 : far);
#ifdef JL_CONDITIONS
    memcpy(moved + 2 * JL_JOINTS, motion + 2 * JL_JOINTS, JL_CONDITIONS * sizeof *moved);
#endif
    jl_begin(v->p, moved, s, m);
    for (i = 0; i < JL_MEMORY; i++) follow[i] = (s[i] - v->s[JL_STRUCTURE + i]) / far;
}

/* Where co-simulation takes the joints' own steps the states are held; only before initialization ends do they follow
 * the displacement. */
static void jl_linearize(const jl_values *v, jl_partial *at)
{
    double motion[JL_ROOM(JL_MOTIONS)], held[JL_ROOM(JL_MOTIONS)];
    const int steps = !v->exchange && !JL_STRUCTURE;
    int i;
    memset(at, 0, sizeof *at);
    jl_motion(v->s, v->u, motion);
    if (!steps || !v->initialized)
        jl_partials(v->p, v->s + JL_STRUCTURE, v->m, motion, at->dF, at->dR);
    if (!v->initialized) jl_virgin(v, motion, at->follow);
    if (!steps) return;
    jl_step_partials(v->p, v->s + JL_STRUCTURE, motion, held);
    for (i = 0; i < JL_JOINTS; i++) {
        if (v->initialized) at->dF[i * JL_WIDTH] = held[2 * i];
        at->dF[i * JL_WIDTH + 1] = held[2 * i + 1];
    }
}

/* A row of partials times its joint's motion and the states. */
static double jl_along(const double *row, const double *motion, const double *ds)
{
    double sum = row[0] * motion[0] + row[1] * motion[1];
    int i;
    for (i = 0; i < JL_MEMORY; i++) sum += row[2 + i] * ds[i];
    return sum;
}

/* What every output and every rate does when the knowns move: inputs, then states. */
static void jl_respond(const jl_partial *at, const double *all, double *column)
{
    double motion[JL_ROOM(JL_MOTIONS)], ds[JL_ROOM(JL_MEMORY)], df[JL_ROOM(JL_JOINTS)];
    const double *du = all, *dx = all + JL_INPUTS;
    int i;
    jl_moves(JL_STRUCTURE, JL_MOTIONS, dx, du, NULL, motion);
    for (i = 0; i < JL_MEMORY; i++) ds[i] = dx[JL_STRUCTURE + i] + at->follow[i] * motion[2 * jl_owner[i]];
    for (i = 0; i < JL_JOINTS; i++) df[i] = jl_along(at->dF + i * JL_WIDTH, motion + 2 * i, ds);
    jl_moves(JL_STRUCTURE + JL_MOTIONS, JL_OUTPUTS, dx, du, df, column);
    jl_moves(0, JL_STRUCTURE, dx, du, df, column + JL_OUTPUTS);
    for (i = 0; i < JL_MEMORY; i++)
        column[JL_OUTPUTS + JL_STRUCTURE + i] = jl_along(at->dR + i * JL_WIDTH, motion + 2 * jl_owner[i], ds);
}

#ifdef JL_CONDITIONS
#include "conditions.h"

#endif
/* Place of an unknown in a column, -1 if it is none. */
static int jl_unknown(const jl_values *v, unsigned int reference)
{
    const unsigned int at = JL_PLACE(reference);
    if (at >= JL_FIRST_OUTPUT && at < JL_FIRST_PARAMETER) return (int)at - JL_FIRST_OUTPUT;
    if (v->exchange && at >= JL_FIRST_RATE && at < JL_FIRST_INDICATOR)
        return JL_OUTPUTS + jl_continuous[at - JL_FIRST_RATE];
    return -1;
}

/* An input that displaces a joint at once. */
static int jl_displaces(int input)
{
    int i, k;
    for (i = 0; i < JL_MOTIONS; i += 2)
        for (k = jl_first[JL_STRUCTURE + i]; k < jl_first[JL_STRUCTURE + i + 1]; k++)
            if (jl_column[k] == JL_STRUCTURE + input) return 1;
    return 0;
}

/* Number of a known, -1 if it is none. */
static int jl_known(const jl_values *v, unsigned int reference)
{
    const unsigned int at = JL_PLACE(reference);
    const int input = at < JL_INPUTS ? (int)at : -1;
    int i;
#ifdef JL_CONDITIONS
    if (input >= JL_INPUTS - JL_CONDITIONS) return input;
#endif
    /* How the forces hang on the states, which virgin ones follow, is only known where there is model exchange. */
    if (input >= 0) return !v->initialized && JL_MEMORY && !JL_EXCHANGE && jl_displaces(input) ? -1 : input;
    for (i = 0; i < JL_CONTINUOUS; i++)
        if (v->exchange && (v->initialized || jl_continuous[i] < JL_STRUCTURE)
            && (int)at == JL_FIRST_STATE + jl_continuous[i])
            return JL_INPUTS + jl_continuous[i];
    return -1;
}

/* The open structure, with the modes that its joints are in. */
static const jl_values *jl_asked_about(const jl_values *v, jl_values *open)
{
    double motion[JL_ROOM(JL_MOTIONS)];
    if (!v->closed) return v;
    *open = *v;
    jl_open(open);
    jl_motion(open->s, open->u, motion);
    (void)jl_event(open->p, open->s + JL_STRUCTURE, open->m, motion);
    return open;
}

int jl_derivative(void *c, jl_call call, const jl_directions *asked)
{
    jl_instance *instance = (jl_instance *)c;
    const jl_values *v;
    const size_t rows = asked->unknown_count, columns = asked->known_count;
    const size_t seeds = asked->adjoint ? rows : columns, results = asked->adjoint ? columns : rows;
    jl_partial at;
    jl_values open;
    size_t i, j;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (asked->seed_count != seeds || asked->result_count != results)
        return jl_fail(instance, call, "%lu seeds and room for %lu results, expected %lu and %lu",
                       (unsigned long)asked->seed_count, (unsigned long)asked->result_count, (unsigned long)seeds,
                       (unsigned long)results);
    if ((rows && !asked->unknowns) || (columns && !asked->knowns) || (seeds && !asked->seed)
        || (results && !asked->result))
        return jl_fail(instance, call, "the references, the seed or the result are NULL");
    v = jl_asked_about(&instance->values, &open);
    for (i = 0; i < rows; i++)
        if (jl_unknown(v, asked->unknowns[i]) < 0)
            return jl_fail(instance, call, "value reference %u is no unknown here", asked->unknowns[i]);
    for (j = 0; j < columns; j++)
        if (jl_known(v, asked->knowns[j]) < 0)
            return jl_fail(instance, call, "value reference %u is no known here", asked->knowns[j]);
    if (jl_prepare(instance, call)) return JL_ERROR;
    jl_linearize(v, &at);
    for (i = 0; i < results; i++) asked->result[i] = 0.0;
    for (j = 0; j < columns; j++) {
        double column[JL_UNKNOWNS], all[JL_KNOWNS] = { 0.0 };
        all[jl_known(v, asked->knowns[j])] = 1.0;
        jl_respond(&at, all, column);
#ifdef JL_CONDITIONS
        jl_respond_to_conditions(v, all, column);
#endif
        for (i = 0; i < rows; i++) {
            const double partial = column[jl_unknown(v, asked->unknowns[i])];
            if (asked->adjoint) asked->result[j] += partial * asked->seed[i];
            else asked->result[i] += partial * asked->seed[j];
        }
    }
    return JL_OK;
}

/* First derivatives of outputs by time, at held inputs. */
int jl_output_rates(void *c, jl_call call, const unsigned int *references, size_t count, const int *order, double *rate,
                    size_t places)
{
    jl_instance *instance = (jl_instance *)c;
    const jl_values *v;
    jl_partial at;
    jl_values open;
    double all[JL_KNOWNS] = { 0.0 }, column[JL_UNKNOWNS];
    size_t i;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (count && !JL_STRUCTURE) return jl_fail(instance, call, "outputs have no derivatives by time");
    if (jl_listed(instance, call, references, count, rate, places)) return JL_ERROR;
    if (count && !order) return jl_fail(instance, call, "the orders are NULL");
    for (i = 0; i < count; i++) {
        const unsigned int place = JL_PLACE(references[i]);
        const char *name = jl_variables[place].name;
        if (place < JL_FIRST_OUTPUT || place >= JL_FIRST_PARAMETER) return jl_fail(instance, call, "%s is no output", name);
        if (order[i] != 1) return jl_fail(instance, call, "derivative %d of %s, expected the first", order[i], name);
    }
    if (!count) return JL_OK;
    if (jl_prepare(instance, call)) return JL_ERROR;
    v = jl_asked_about(&instance->values, &open);
    jl_linearize(v, &at);
    jl_all_rates(v->p, v->s, v->m, v->u, all + JL_INPUTS);
    jl_respond(&at, all, column);
#ifdef JL_CONDITIONS
    jl_respond_to_conditions(v, all, column);
#endif
    for (i = 0; i < count; i++) rate[i] = column[JL_PLACE(references[i]) - JL_FIRST_OUTPUT];
    return JL_OK;
}
