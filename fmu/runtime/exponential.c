/* Co-simulation of a structure whose joints are closed at their tangents: the linear part moves exactly, whatever its
 * frequencies, and what the joints are more than their tangents is a force d that changes linearly over a step.
 *
 *     y' = L y + P d + D u + c,   y(h) = e^(Lh) y + h p1(Lh) (P d0 + D u + c) + h p2(Lh) P (d1 - d0)
 *
 * with p1(z) = (e^z - 1)/z and p2(z) = (p1(z) - 1)/z, exponential time differencing (Cox and Matthews, J. Comp. Phys.
 * 176:430-455, 2002). d1 is asked for where the motion would be with d extrapolated from the step before. How far it
 * lies beside the extrapolated one is the error; steps are halved and doubled by it. Inputs are straight lines. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "instance.h"

enum { JL_PAIRS = JL_POLES / 2, JL_FLOWS = 12, JL_UNITS = 1 << 14 };

/* Blocks of 2 x 2 for each pair: e^(Lh), h p1, h p2. */
typedef struct {
    double h;
    double move[4 * JL_ROOM(JL_PAIRS)], hold[4 * JL_ROOM(JL_PAIRS)], ramp[4 * JL_ROOM(JL_PAIRS)];
} jl_flow;

typedef struct {
    double re, im;
} jl_complex;

/* 1/k! + z/(k + 1)! + ..., for small z. */
static jl_complex jl_series(double re, double im, int k)
{
    jl_complex sum = { 0.0, 0.0 }, term = { 1.0, 0.0 };
    int i;
    for (i = 2; i <= k; i++) term.re /= i;
    for (i = 1; i < 24; i++) {
        const double t = term.re;
        sum.re += term.re, sum.im += term.im;
        term.re = (t * re - term.im * im) / (k + i);
        term.im = (t * im + term.im * re) / (k + i);
    }
    return sum;
}

/* (p - 1/k!)/z */
static jl_complex jl_next(jl_complex p, double factorial, double re, double im)
{
    const double a = p.re - 1.0 / factorial, size = re * re + im * im;
    jl_complex next;
    next.re = (a * re + p.im * im) / size;
    next.im = (p.im * re - a * im) / size;
    return next;
}

static void jl_phi(double re, double im, jl_complex *phi)
{
    int k;
    if (re * re + im * im < 1.0) {
        for (k = 0; k < 3; k++) phi[k] = jl_series(re, im, k);
        return;
    }
    phi[0].re = exp(re) * cos(im), phi[0].im = exp(re) * sin(im);
    phi[1] = jl_next(phi[0], 1.0, re, im);
    phi[2] = jl_next(phi[1], 1.0, re, im);
}

static void jl_block(double *block, double a, double b, double c, double d)
{
    block[0] = a, block[1] = b, block[2] = c, block[3] = d;
}

static void jl_fill(jl_flow *flow, double h)
{
    double *const of[] = { flow->move, flow->hold, flow->ramp };
    int i, k;
    flow->h = h;
    for (i = 0; i < JL_PAIRS; i++) {
        const double s = jl_pole[2 * i] * h, w = jl_pole[2 * i + 1] * h;
        jl_complex phi[3], other[3];
        if (jl_pole_kind[i] == 2) {
            jl_block(flow->move + 4 * i, 1.0, h, 0.0, 1.0);
            jl_block(flow->hold + 4 * i, h, h * h / 2.0, 0.0, h);
            jl_block(flow->ramp + 4 * i, h / 2.0, h * h / 6.0, 0.0, h / 2.0);
            continue;
        }
        if (jl_pole_kind[i] == 1) jl_phi(s, 0.0, phi), jl_phi(w, 0.0, other);
        else jl_phi(s, w, phi);
        for (k = 0; k < 3; k++) {
            const double times = k ? h : 1.0;
            if (jl_pole_kind[i] == 1) jl_block(of[k] + 4 * i, times * phi[k].re, 0.0, 0.0, times * other[k].re);
            else
                jl_block(of[k] + 4 * i, times * phi[k].re, -times * phi[k].im, times * phi[k].im,
                         times * phi[k].re);
        }
    }
}

/* The blocks for steps of h, kept beside the values: they follow from h alone. */
static const jl_flow *jl_flow_of(jl_instance *instance, double h)
{
    jl_flow *all = (jl_flow *)instance->flows;
    int i;
    if (!all) all = (jl_flow *)(instance->flows = calloc(JL_FLOWS, sizeof *all));
    if (!all) return NULL;
    for (i = 0; i < JL_FLOWS; i++)
        if (all[i].h == h) return all + i;
    i = instance->next_flow++ % JL_FLOWS;
    jl_fill(all + i, h);
    return all + i;
}

/* result += block * x */
static void jl_add(const double *block, const double *x, double *result)
{
    int i;
    for (i = 0; i < JL_PAIRS; i++) {
        const double *b = block + 4 * i, x1 = x[2 * i], x2 = x[2 * i + 1];
        result[2 * i] += b[0] * x1 + b[1] * x2;
        result[2 * i + 1] += b[2] * x1 + b[3] * x2;
    }
}

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

/* What the joints are more than their tangents, h seconds after the states s. */
static void jl_bend(const jl_values *v, const double *motion, double h, double *after, double *d)
{
    double f[JL_ROOM(JL_JOINTS)];
    int i;
    jl_step(v->p, v->s + JL_STRUCTURE, motion, h, after, f);
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
    jl_bend(v, motion, 0.0, after, v->d);
    jl_pushed(v->d, v->push);
    v->before = 0.0;
    v->closed = v->bent = 1;
}

/* Second difference of the forces, against stiffness times how far the joints are from where they began: root of sums
 * of squares over all joints. */
static double jl_beside(const double *motion, const double *d, const double *thought)
{
    double wrong = 0.0, size = 0.0;
    int i;
    for (i = 0; i < JL_BENT; i++) {
        const double moved = jl_tangent[5 * i] * (motion[2 * jl_bent[i]] - jl_tangent[5 * i + 3]);
        const double small = jl_tangent[5 * i + 4], beside = (d[i] - thought[i]) / 6.0;
        wrong += beside * beside;
        size += moved * moved + small * small;
    }
    return sqrt(wrong / size);
}

const char *jl_exponential(jl_instance *instance, jl_call call, double h)
{
    jl_values *v = &instance->values;
    const double tolerance = v->tolerance > 0.0 ? v->tolerance : JL_USUAL;
    double constant[JL_ROOM(JL_POLES)], slope[JL_ROOM(JL_POLES)] = { 0.0 }, motion[JL_ROOM(JL_MOTIONS)] = { 0.0 };
    int done = 0, size = JL_UNITS, i;
    if (!v->closed || !v->bent) jl_close(v);
    while (size > 1 && v->stride > 0.0 && h * size > 1.000001 * v->stride * JL_UNITS) size /= 2;
    memcpy(constant, jl_constant, JL_POLES * sizeof *constant);
    jl_gather(jl_drive, v->u, JL_INPUTS, JL_POLES, constant);
    jl_gather(jl_drive, v->du, JL_INPUTS, JL_POLES, slope);
    while (done < JL_UNITS) {
        const double step = h * size / JL_UNITS, ahead = v->before > 0.0 ? step / v->before : 0.0;
        const double since = h * done / JL_UNITS;
        const jl_flow *flow = jl_flow_of(instance, step);
        double to[JL_ROOM(JL_POLES)] = { 0.0 }, held[JL_ROOM(JL_POLES)], ramp[JL_ROOM(JL_POLES)];
        double push[JL_ROOM(JL_POLES)], d[JL_ROOM(JL_BENT)], thought[JL_ROOM(JL_BENT)];
        double after[JL_ROOM(JL_MEMORY)], error = 0.0;
        if (!flow) return "there is no memory left";
        for (i = 0; i < JL_POLES; i++) held[i] = constant[i] + since * slope[i] + v->push[i];
        for (i = 0; i < JL_POLES; i++) ramp[i] = step * slope[i] + ahead * (v->push[i] - v->pushed[i]);
        jl_add(flow->move, v->q, to), jl_add(flow->hold, held, to), jl_add(flow->ramp, ramp, to);
        if (JL_BENT) {
            jl_bent_motion(to, motion);
            jl_bend(v, motion, step, after, d);
            for (i = 0; i < JL_BENT; i++) thought[i] = v->d[i] + ahead * (v->d[i] - v->was[i]);
            error = jl_beside(motion, d, thought) / tolerance;
            if (!(error <= 1.0) && size > 1) {
                size /= 2;
                continue;
            }
            if (!isfinite(error)) return "the motion leaves what numbers can hold";
            jl_pushed(d, push);
            for (i = 0; i < JL_POLES; i++) ramp[i] = push[i] - v->push[i] - (ramp[i] - step * slope[i]);
            jl_add(flow->ramp, ramp, to);
            memcpy(v->pushed, v->push, sizeof push), memcpy(v->push, push, sizeof push);
            memcpy(v->was, v->d, sizeof d), memcpy(v->d, d, sizeof d);
            memcpy(v->s + JL_STRUCTURE, after, JL_MEMORY * sizeof *after);
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
