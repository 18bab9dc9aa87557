/* Co-simulation of a structure whose joints are closed at their tangents: the linear part moves exactly, whatever its
 * frequencies, and what the joints are more than their tangents is a force d that changes linearly over a step.
 *
 *     y' = L y + P d + D u + c,   y(h) = e^(Lh) y + h p1(Lh) (P d0 + D u + c) + h p2(Lh) P (d1 - d0)
 *
 * with p1(z) = (e^z - 1)/z and p2(z) = (p1(z) - 1)/z, exponential time differencing (Cox and Matthews, J. Comp. Phys.
 * 176:430-455, 2002). d1 is asked for where the motion would be with d extrapolated from the step before. How far it
 * lies beside the extrapolated one is the error; steps are halved and doubled by it. Inputs are parabolas. */
#include <math.h>
#include <string.h>
#include "flow.h"

enum { JL_UNITS = 1 << 14 };

/* sum += table' * x, `table` of count rows as wide as `sum`; four rows at a time, which keeps the sums in registers. */
static void jl_gather(const double *table, const double *x, int count, int wide, double *restrict sum)
{
    const double *a = table;
    int i = 0, k;
    for (; i + 4 <= count; i += 4, a += 4 * wide) {
        const double *b = a + wide, *c = b + wide, *d = c + wide;
        const double x0 = x[i], x1 = x[i + 1], x2 = x[i + 2], x3 = x[i + 3];
        for (k = 0; k < wide; k++) sum[k] += (a[k] * x0 + b[k] * x1) + (c[k] * x2 + d[k] * x3);
    }
    for (; i < count; i++, a += wide)
        for (k = 0; k < wide; k++) sum[k] += a[k] * x[i];
}

/* Forces of the bent joints into y'. */
static void jl_pushed(const double *d, double *push)
{
    double basis[JL_ROOM(JL_BASIS)] = { 0.0 };
    int i, k;
    for (i = 0; i < JL_BENT; i++)
        for (k = jl_share_first[i]; k < jl_share_first[i + 1]; k++) basis[jl_share_column[k]] += jl_share[k] * d[i];
    for (i = 0; i < JL_POLES; i++) push[i] = 0.0;
    jl_gather(jl_push, basis, JL_BASIS, JL_POLES, push);
}

/* Motions of the bent joints at y, the others at rest; z and v in turn for every joint. */
static void jl_bent_motion(const double *y, double *motion)
{
    double read[JL_ROOM(JL_READS)] = { 0.0 };
    int i, k;
    jl_gather(jl_read, y, JL_POLES, JL_READS, read);
    memset(motion, 0, JL_MOTIONS * sizeof *motion);
    for (i = 0; i < JL_BENT; i++) {
        double z = jl_tangent[5 * i + 2], v = 0.0;
        for (k = jl_share_first[i]; k < jl_share_first[i + 1]; k++) {
            z += jl_share[k] * read[jl_share_column[k]];
            if (JL_BENT_BY_VELOCITY) v += jl_share[k] * read[JL_READS / 2 + jl_share_column[k]];
        }
        motion[2 * jl_bent[i]] = z;
        if (jl_by_velocity[i]) motion[2 * jl_bent[i] + 1] = v;
    }
}

#ifdef JL_CONDITIONS
/* The conditions so many seconds after the step began. */
static void jl_conditions_at(const jl_values *v, double since, double *motion)
{
    double u[JL_INPUTS];
    jl_inputs_at(v, since, u);
    memcpy(motion + 2 * JL_JOINTS, u + JL_INPUTS - JL_CONDITIONS, JL_CONDITIONS * sizeof *motion);
}

#endif
/* What the joints are more than their tangents, h seconds after their states s. */
static void jl_bend(const double *p, const double *s, const double *motion, double h, double *after, double *d)
{
    double f[JL_ROOM(JL_JOINTS)];
    int i;
    jl_step(p, s, motion, h, after, f);
    for (i = 0; i < JL_BENT; i++) {
        const int j = jl_bent[i];
        d[i] = f[j] - jl_tangent[5 * i] * motion[2 * j] - jl_tangent[5 * i + 1] * motion[2 * j + 1];
    }
}

int jl_is_closed(const jl_values *v)
{
    int i;
    if (JL_POLES == 0 || v->exchange || !(JL_STIFF || v->tolerance >= JL_LOOSE)) return 0;
    for (i = 0; i < JL_KEPT; i++)
        if (v->p[jl_kept[i]] != jl_variables[JL_FIRST_PARAMETER + jl_kept[i]].start) return 0;
    if (v->closed) return 1;
    for (i = 0; i < JL_STRUCTURE; i++)
        if (v->s[i] != jl_rest[i]) return 0;
    return 1;
}

void jl_open(jl_values *v)
{
    int i, k;
    for (i = 0; i < JL_POLES; i++) {
        double sum = 0.0;
        for (k = 0; k < JL_POLES; k++) sum += jl_opened[i * JL_POLES + k] * v->q[k];
        v->s[i] = sum;
    }
}

void jl_port_motions(const jl_values *v, double *out)
{
    double told[JL_ROOM(JL_PORTS)] = { 0.0 };
    jl_gather(jl_port, v->q, JL_POLES, JL_PORTS, told);
    memcpy(out, told, JL_PORTS * sizeof *out);
}

/* The joints as they are now: forces anew, and nothing known of a step before. */
static void jl_close(jl_values *v)
{
    double motion[JL_ROOM(JL_MOTIONS)], after[JL_ROOM(JL_MEMORY)];
    if (!v->closed) memcpy(v->q, jl_at_rest, JL_POLES * sizeof *v->q);
    jl_bent_motion(v->q, motion);
#ifdef JL_CONDITIONS
    jl_conditions_at(v, 0.0, motion);
#endif
    jl_bend(v->p, v->s + JL_STRUCTURE, motion, 0.0, after, v->d);
    jl_pushed(v->d, v->push);
    if (JL_TURNS) memcpy(v->at, motion, sizeof v->at);
    v->before = 0.0;
    v->closed = v->bent = 1;
}

#ifdef JL_CONDITIONS
/* Conditions jumped, and with them the forces; how these change over time stays known. */
static void jl_rebend(jl_values *v)
{
    const jl_values before = *v;
    double motion[JL_ROOM(JL_MOTIONS)], after[JL_ROOM(JL_MEMORY)];
    int i;
    jl_bent_motion(v->q, motion);
    jl_conditions_at(v, 0.0, motion);
    jl_bend(v->p, v->s + JL_STRUCTURE, motion, 0.0, after, v->d);
    jl_pushed(v->d, v->push);
    for (i = 0; i < JL_BENT; i++) v->was[i] += v->d[i] - before.d[i];
    for (i = 0; i < JL_POLES; i++) v->pushed[i] += v->push[i] - before.push[i];
    if (JL_TURNS) memcpy(v->at + 2 * JL_JOINTS, motion + 2 * JL_JOINTS, JL_CONDITIONS * sizeof *motion);
}

#endif
/* A point on a step's way: where a joint that remembers turns, by the parabola through this step and the one before it,
 * else at its share of the time. 1 if it has to be asked for. Laws whose step is not exact are asked near the end: a bend
 * behind the last point at which they look is not seen. */
#define JL_SHARE (JL_HALVED ? 0.875 : 0.5)
static int jl_on_the_way(const jl_values *v, const double *motion, double h, double *point)
{
    int i, asked = JL_HALVED;
    for (i = 0; i < JL_MOTIONS; i++) point[i] = v->at[i] + JL_SHARE * (motion[i] - v->at[i]);
    for (i = 0; i < JL_BENT && v->before > 0.0; i++) {
        const int j = 2 * jl_bent[i];
        const double steep = (motion[j] - v->at[j]) / h, was = (v->at[j] - v->past[j]) / v->before;
        const double bend = (steep - was) / (h + v->before), slope = steep - bend * h;
        if (!jl_remembers[i] || !(slope * (slope + 2.0 * bend * h) < 0.0)) continue;
        point[j] = v->at[j] - 0.25 * slope * slope / bend;
        asked = 1;
    }
    return asked;
}

/* Second difference of the forces, and what a point on the way makes of them, against stiffness times how far the
 * joints are from where they began: root of sums of squares over all joints. */
static double jl_beside(const double *motion, const double *d, const double *thought, const double *once)
{
    double wrong = 0.0, size = 0.0;
    int i;
    for (i = 0; i < JL_BENT; i++) {
        const double moved = jl_tangent[5 * i] * (motion[2 * jl_bent[i]] - jl_tangent[5 * i + 3]);
        const double small = jl_tangent[5 * i + 4], beside = (d[i] - thought[i]) / 6.0, apart = d[i] - once[i];
        wrong += beside * beside + apart * apart;
        size += moved * moved + small * small;
    }
    return sqrt(wrong / size);
}

const char *jl_exponential(jl_instance *instance, jl_call call, double h)
{
    jl_values *v = &instance->values;
    const double tolerance = v->tolerance > 0.0 ? v->tolerance : JL_USUAL;
    double constant[JL_ROOM(JL_POLES)], slope[JL_ROOM(JL_POLES)] = { 0.0 }, curve[JL_ROOM(JL_POLES)] = { 0.0 };
    double motion[JL_ROOM(JL_MOTIONS)] = { 0.0 };
    int done = 0, curved = 0, size = JL_UNITS, i;
    if (!v->closed || !v->bent) jl_close(v);
#ifdef JL_CONDITIONS
    else if (JL_JUMPED(v)) jl_rebend(v);
#endif
    while (size > 1 && v->stride > 0.0 && h * size > 1.000001 * v->stride * JL_UNITS) size /= 2;
    memcpy(constant, jl_constant, JL_POLES * sizeof *constant);
    jl_gather(jl_drive, v->u, JL_INPUTS, JL_POLES, constant);
    jl_gather(jl_drive, v->du, JL_INPUTS, JL_POLES, slope);
    for (i = 0; i < JL_INPUTS; i++) curved |= v->ddu[i] != 0.0;
    if (curved) jl_gather(jl_drive, v->ddu, JL_INPUTS, JL_POLES, curve);
    while (done < JL_UNITS) {
        const double step = h * size / JL_UNITS, ahead = v->before > 0.0 ? step / v->before : 0.0;
        const double since = h * done / JL_UNITS;
        const jl_flow *flow = jl_flow_of(instance, step);
        double to[JL_ROOM(JL_POLES)] = { 0.0 }, held[JL_ROOM(JL_POLES)], ramp[JL_ROOM(JL_POLES)];
        double rise[JL_ROOM(JL_POLES)];
        double push[JL_ROOM(JL_POLES)], d[JL_ROOM(JL_BENT)], thought[JL_ROOM(JL_BENT)];
        double once[JL_ROOM(JL_BENT)], after[JL_ROOM(JL_MEMORY)], between[JL_ROOM(JL_MEMORY)];
        double point[JL_ROOM(JL_MOTIONS)], error = 0.0;
        if (!flow) return "there is no memory left";
        for (i = 0; i < JL_POLES; i++) held[i] = constant[i] + since * (slope[i] + 0.5 * since * curve[i]) + v->push[i];
        for (i = 0; i < JL_POLES; i++) rise[i] = step * (slope[i] + since * curve[i]);
        for (i = 0; i < JL_POLES; i++) ramp[i] = rise[i] + ahead * (v->push[i] - v->pushed[i]);
        jl_add(flow->move, v->q, to), jl_add(flow->hold, held, to), jl_add(flow->ramp, ramp, to);
        if (curved) {
            for (i = 0; i < JL_POLES; i++) held[i] = step * step * curve[i];
            jl_add(flow->bow, held, to);
        }
        if (JL_BENT) {
            jl_bent_motion(to, motion);
#ifdef JL_CONDITIONS
            jl_conditions_at(v, since + step, motion);
#endif
            jl_bend(v->p, v->s + JL_STRUCTURE, motion, step, after, d);
            memcpy(once, d, sizeof once);
            if (JL_TURNS && jl_on_the_way(v, motion, step, point)) {
                jl_bend(v->p, v->s + JL_STRUCTURE, point, JL_SHARE * step, between, d);
                jl_bend(v->p, between, motion, (1.0 - JL_SHARE) * step, after, d);
            }
            for (i = 0; i < JL_BENT; i++) thought[i] = v->d[i] + ahead * (v->d[i] - v->was[i]);
            error = jl_beside(motion, d, thought, once) / tolerance;
            if (!(error <= 1.0) && size > 1) {
                size /= 2;
                continue;
            }
            if (!isfinite(error)) return "the motion leaves what numbers can hold";
            jl_pushed(d, push);
            for (i = 0; i < JL_POLES; i++) ramp[i] = push[i] - v->push[i] - (ramp[i] - rise[i]);
            jl_add(flow->ramp, ramp, to);
            memcpy(v->pushed, v->push, sizeof push), memcpy(v->push, push, sizeof push);
            memcpy(v->was, v->d, sizeof d), memcpy(v->d, d, sizeof d);
            memcpy(v->s + JL_STRUCTURE, after, JL_MEMORY * sizeof *after);
            if (JL_TURNS) memcpy(v->past, v->at, sizeof v->past), memcpy(v->at, motion, sizeof v->at);
        }
        memcpy(v->q, to, sizeof to);
        v->before = step;
        v->stride = error < 0.2 ? 2.0 * step : step; /* twice the step has four times the second difference */
        done += size;
        if (error < 0.2 && done % (2 * size) == 0 && 2 * size <= JL_UNITS - done) size *= 2;
    }
    jl_watch_at(instance, call, motion);
    return jl_all_finite(v->q, JL_POLES) ? NULL : "the motion leaves what numbers can hold";
}
