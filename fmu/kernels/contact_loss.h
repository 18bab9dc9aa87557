/*
   modes: 1
   indicators: 1
   inputs: z
   exchange: yes
*/
/* Contact lost, or a stop met, on one side: f = -side stiffness max(side z - clearance, 0).
   p: stiffness, clearance, side.
   mode: 1 past the clearance, else 0; NULL in co-simulation, where z decides. The indicator lies a hysteresis behind
   the edge, 1e-6 of the clearance or of one micrometre if that is larger. */

#include <math.h>
#include <stddef.h>

static const char *contact_loss_check(const double *p, const int *n)
{
    (void)n;
    return fabs(p[2]) != 1.0 ? "contact-loss: side is neither of 1 and -1, expected one of them" : NULL;
}

static int contact_loss_past(const double *p, double z)
{
    return p[2] * z > p[1];
}

static void contact_loss_initial(const double *p, const int *n, double z, double *s, int *m)
{
    (void)n; (void)s;
    m[0] = contact_loss_past(p, z);
}

static double contact_loss_force(const double *p, const int *n, const double *s, const int *m,
    double z, double v)
{
    (void)n; (void)s; (void)v;
    return (m != NULL ? m[0] : contact_loss_past(p, z)) ? -p[2] * p[0] * (p[2] * z - p[1]) : 0.0;
}

static void contact_loss_indicators(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *g)
{
    const double hysteresis = 1e-6 * fmax(fabs(p[1]), 1e-6);
    (void)n; (void)s; (void)v;
    g[0] = p[2] * z - p[1] + (m[0] ? hysteresis : -hysteresis);
}

static int contact_loss_event(const double *p, const int *n, double *s, int *m, double z, double v)
{
    (void)n; (void)s; (void)v;
    m[0] = contact_loss_past(p, z);
    return 0;
}

static void contact_loss_partials(const double *p, const int *n, const double *s, const int *m,
    double z, double v, double *dF, double *dR)
{
    (void)n; (void)s; (void)v; (void)dR;
    dF[0] = (m != NULL ? m[0] : contact_loss_past(p, z)) ? -p[0] : 0.0;
    dF[1] = 0.0;
}
