/* What outputs and rates do when conditions move, or what lags behind them: central differences, as the kernels of laws
 * tell no derivatives by their parameters. */
#ifndef JL_CONDITIONS_H
#define JL_CONDITIONS_H

/* Outputs and rates at the present point, in the order of a column. */
static void jl_answer(jl_values *v, double *column)
{
    double motion[JL_ROOM(JL_MOTIONS)], after[JL_ROOM(JL_MEMORY)], f[JL_ROOM(JL_JOINTS)];
    jl_motion(v->s, v->u, motion);
    if (!v->initialized) jl_begin(v->p, motion, v->s + JL_STRUCTURE, v->m);
    if (v->exchange || JL_STRUCTURE) jl_force(v->p, v->s + JL_STRUCTURE, v->m, motion, f);
    else jl_step(v->p, v->s, motion, 0.0, after, f);
    jl_outputs(v->s, v->u, f, column);
    jl_all_rates(v->p, v->s, v->m, v->u, column + JL_OUTPUTS);
}

/* Adds to a column what conditions and lagging states do that move as `all` tells. */
static void jl_respond_to_conditions(const jl_values *at, const double *all, double *column)
{
    int i, k;
    for (k = 0; k < JL_CONDITIONS + JL_LAGS; k++) {
        const int state = k - JL_CONDITIONS, input = JL_INPUTS - JL_CONDITIONS + k, place = JL_STATES - JL_LAGS + state;
        const double moves = all[state < 0 ? input : JL_INPUTS + place];
        double ends[2][JL_UNKNOWNS];
        if (moves == 0.0) continue;
        for (i = 0; i < 2; i++) {
            jl_values v = *at;
            *(state < 0 ? v.u + input : v.s + place) += (i ? 1.0 : -1.0) * jl_nudge[k];
            jl_answer(&v, ends[i]);
        }
        for (i = 0; i < JL_UNKNOWNS; i++) column[i] += moves * (ends[1][i] - ends[0][i]) / (2.0 * jl_nudge[k]);
    }
}

#endif
