/* How inputs go on within a step of what is integrated inside: their first and second derivatives. FMI 2.0 is told them;
 * FMI 3.0 asks for the inputs half way and at the end, which a parabola goes through. */
#include <math.h>
#include <string.h>
#include "instance.h"

int jl_set_slopes(void *c, jl_call call, const unsigned int *references, size_t count, const int *order,
                  const double *slope)
{
    jl_instance *instance = (jl_instance *)c;
    size_t i;
    if (jl_enter(instance, call)) return JL_ERROR;
    if (count && !JL_STRUCTURE) return jl_fail(instance, call, "inputs are held over the step");
    if (jl_listed(instance, call, references, count, slope, count)) return JL_ERROR;
    if (count && !order) return jl_fail(instance, call, "the orders are NULL");
    for (i = 0; i < count; i++) {
        const char *name = jl_variables[JL_PLACE(references[i])].name;
        if (JL_PLACE(references[i]) >= JL_INPUTS) return jl_fail(instance, call, "%s is no input", name);
        if (order[i] != 1 && order[i] != 2)
            return jl_fail(instance, call, "derivative %d of %s, expected the first or the second", order[i], name);
        if (!isfinite(slope[i]))
            return jl_fail(instance, call, "derivative %d of %s is %g, expected a finite number", order[i], name,
                           slope[i]);
    }
    for (i = 0; i < count; i++)
        (order[i] == 1 ? instance->values.du : instance->values.ddu)[JL_PLACE(references[i])] = slope[i];
    return JL_OK;
}

void jl_inputs_at(const jl_values *v, double since, double *u)
{
    int i;
    for (i = 0; i < JL_INPUTS; i++) u[i] = v->u[i] + since * (v->du[i] + 0.5 * since * v->ddu[i]);
}

int jl_ask_inputs(jl_instance *instance, double time, double h)
{
    jl_values *v = &instance->values;
    double u[3][JL_ROOM(JL_INPUTS)];
    int i, k;
    if (!instance->ask) return JL_OK;
    memcpy(u[0], v->u, sizeof u[0]);
    for (k = 1; k < 3; k++) {
        v->state = JL_INTERMEDIATE;
        instance->ask(instance, time + 0.5 * k * h);
        if (v->state != JL_INTERMEDIATE) return JL_ERROR;
        memcpy(u[k], v->u, sizeof u[k]);
    }
    v->state = JL_STEP;
    for (i = 0; i < JL_INPUTS; i++) {
        v->du[i] = (4.0 * u[1][i] - 3.0 * u[0][i] - u[2][i]) / h;
        v->ddu[i] = 4.0 * (u[0][i] - 2.0 * u[1][i] + u[2][i]) / (h * h);
    }
    memcpy(v->u, u[0], sizeof u[0]);
    return JL_OK;
}
