/* Play in series with an element that remembers: position s[0], stretch s[1] of the element and of what the play takes
   of it; m[0]: the side of the play on which the element is loaded, 0 inside it and where there is none. */
#ifndef JL_PLAY_H
#define JL_PLAY_H

#include <math.h>

static void play_initial(double z, double *s, int *m)
{
    s[0] = z;
    s[1] = 0.0;
    m[0] = 0;
}

/* Part of a travel to one side that only moves the play; to_zero: what unloads the element, 0 where it is loaded. */
static double play_lost(double clearance, double side, double travel, double to_zero, double gap)
{
    return fmin(fmax(travel - to_zero, 0.0), clearance - side * gap);
}

static int play_is_free(double clearance, const int *m)
{
    return clearance > 0.0 && m[0] == 0;
}

/* Of the element. */
static double play_deflection(double clearance, const double *s, const int *m)
{
    return play_is_free(clearance, m) ? 0.0 : s[1] - m[0] * clearance;
}

/* They lie a hysteresis of 1e-6 of length + clearance behind the ends of the play. */
static void play_indicators(double clearance, double length, const double *s, const int *m, double *g)
{
    const double hysteresis = 1e-6 * (length + clearance);
    g[0] = clearance > 0.0 ? s[1] - clearance + (m[0] > 0 ? hysteresis : -hysteresis) : 1.0;
    g[1] = clearance > 0.0 ? s[1] + clearance + (m[0] < 0 ? -hysteresis : hysteresis) : 1.0;
}

static void play_event(double clearance, const double *s, int *m)
{
    m[0] = clearance > 0.0 ? (s[1] > clearance) - (s[1] < -clearance) : 0;
}

#endif
