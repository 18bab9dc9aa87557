/* Factor by which parameters follow a condition. */
#ifndef JL_MODULATION_H
#define JL_MODULATION_H

#include <math.h>

/* Linear between the points of a table, kept beyond its ends, 1 at the reference. A table that repeats (period > 0) ends
 * with its first point, a period later. */
static double jl_factor(const double (*at)[2], int count, double period, double reference, double x)
{
    int i = 0;
    if (x == reference) return 1.0;
    if (period > 0.0) x -= period * floor((x - at[0][0]) / period);
    if (!(x > at[0][0])) return at[0][1];
    if (x >= at[count - 1][0]) return at[count - 1][1];
    while (x >= at[i + 1][0]) i++;
    return (at[i + 1][1] - at[i][1]) / (at[i + 1][0] - at[i][0]) * (x - at[i][0]) + at[i][1];
}

#endif
