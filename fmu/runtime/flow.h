/* What a step of some length does to the closed structure, pair by pair: e^(Lh), h p1(Lh), h p2(Lh) and h p3(Lh). */
#ifndef JL_FLOW_H
#define JL_FLOW_H

#include <math.h>
#include <stdlib.h>
#include "instance.h"

enum { JL_PAIRS = JL_POLES / 2, JL_FLOWS = 12 };

/* Blocks of 2 x 2 for each pair, in this order. */
typedef struct {
    double h;
    double move[4 * JL_ROOM(JL_PAIRS)], hold[4 * JL_ROOM(JL_PAIRS)], ramp[4 * JL_ROOM(JL_PAIRS)];
    double bow[4 * JL_ROOM(JL_PAIRS)];
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
        for (k = 0; k < 4; k++) phi[k] = jl_series(re, im, k);
        return;
    }
    phi[0].re = exp(re) * cos(im), phi[0].im = exp(re) * sin(im);
    phi[1] = jl_next(phi[0], 1.0, re, im);
    phi[2] = jl_next(phi[1], 1.0, re, im);
    phi[3] = jl_next(phi[2], 2.0, re, im);
}

static void jl_block(double *block, double a, double b, double c, double d)
{
    block[0] = a, block[1] = b, block[2] = c, block[3] = d;
}

static void jl_fill(jl_flow *flow, double h)
{
    double *const of[] = { flow->move, flow->hold, flow->ramp, flow->bow };
    int i, k;
    flow->h = h;
    for (i = 0; i < JL_PAIRS; i++) {
        const double s = jl_pole[2 * i] * h, w = jl_pole[2 * i + 1] * h;
        jl_complex phi[4], other[4];
        if (jl_pole_kind[i] == 2) {
            jl_block(flow->move + 4 * i, 1.0, h, 0.0, 1.0);
            jl_block(flow->hold + 4 * i, h, h * h / 2.0, 0.0, h);
            jl_block(flow->ramp + 4 * i, h / 2.0, h * h / 6.0, 0.0, h / 2.0);
            jl_block(flow->bow + 4 * i, h / 6.0, h * h / 24.0, 0.0, h / 6.0);
            continue;
        }
        if (jl_pole_kind[i] == 1) jl_phi(s, 0.0, phi), jl_phi(w, 0.0, other);
        else jl_phi(s, w, phi);
        for (k = 0; k < 4; k++) {
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

#endif
