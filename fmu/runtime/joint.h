/* What the FMI wrapper asks of a joint: the generated joint.c answers, joint_sizes.h gives the counts.
 *
 * A joint is the force F(z, v, s) in N between two machine parts, z their relative displacement in m, v the relative
 * velocity in m/s, s the internal states. Every function is pure: no statics, no allocation, no input or output.
 * Parameters p, states s and modes m come in the order of their variables. */
#ifndef JOINT_H
#define JOINT_H

#include <stddef.h>
#include "joint_sizes.h"

/* Joints linked into one program need names of their own: the standard's FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX
 * (-DFMI2_FUNCTION_PREFIX=name_) goes before every name. A shared library has none. */
#if defined(FMI2_FUNCTION_PREFIX)
#define JL_PREFIX FMI2_FUNCTION_PREFIX
#elif defined(FMI3_FUNCTION_PREFIX)
#define JL_PREFIX FMI3_FUNCTION_PREFIX
#endif
#define JL_PASTE(a, b) a##b
#define JL_PASTED(a, b) JL_PASTE(a, b)
#ifdef JL_PREFIX
#define JL_NAME(name) JL_PASTED(JL_PREFIX, name)
#define jl_token JL_NAME(jl_token)
#define jl_identifier JL_NAME(jl_identifier)
#define jl_variables JL_NAME(jl_variables)
#define jl_continuous JL_NAME(jl_continuous)
#define jl_validity JL_NAME(jl_validity)
#define jl_check JL_NAME(jl_check)
#define jl_initial JL_NAME(jl_initial)
#define jl_step JL_NAME(jl_step)
#define jl_force JL_NAME(jl_force)
#define jl_rates JL_NAME(jl_rates)
#define jl_indicators JL_NAME(jl_indicators)
#define jl_event JL_NAME(jl_event)
#define jl_partials JL_NAME(jl_partials)
#define jl_step_partials JL_NAME(jl_step_partials)
#else
#define JL_NAME(name) name
#endif

/* Variables in the order of their value references: displacement, velocity, force, the parameters, the states, the
 * rates of the continuous states, the event indicators, and time. FMI 2 has no variables of the last two kinds. */
enum { JL_INPUT, JL_OUTPUT, JL_PARAMETER, JL_STATE, JL_RATE, JL_INDICATOR, JL_TIME };

enum {
    JL_FORCE = 2,
    JL_FIRST_PARAMETER = 3,
    JL_FIRST_STATE = JL_FIRST_PARAMETER + JL_PARAMETERS,
    JL_FIRST_RATE = JL_FIRST_STATE + JL_STATES,
    JL_FIRST_INDICATOR = JL_FIRST_RATE + JL_CONTINUOUS
};

/* Length of an array that C does not allow to be empty. */
#define JL_ROOM(count) ((count) > 0 ? (count) : 1)

typedef struct {
    const char *name;
    int kind;
    double start; /* of a state its usual size (FMI's nominal), 0 where it is not known */
    double lower, upper, above;
} jl_variable;

extern const char jl_token[];      /* instantiation token (FMI 3), guid (FMI 2) */
extern const char jl_identifier[]; /* model identifier */
extern const jl_variable jl_variables[JL_VARIABLES];
extern const int jl_continuous[];    /* for each continuous state of model exchange its place among the states */
extern const double jl_validity[4];  /* identified range: displacement from, to, velocity from, to; or infinite */

/* 0 if the parameters are sound, else a sentence: which one, what was found, what was expected. */
int jl_check(const double *p, char *message, size_t size);

/* The virgin joint at displacement z. */
void jl_initial(const double *p, double z, double *s, int *m);

/* Co-simulation: force after h seconds at the held inputs, and the states then (`after`, apart from s). */
double jl_step(const double *p, const double *s, double z, double v, double h, double *after);

/* Partial derivatives of that force at h = 0 with the states held: dF[0] by z, dF[1] by v. */
void jl_step_partials(const double *p, const double *s, double z, double v, double *dF);

/* Model exchange. rate and the rows of dR: one for each state, also for those that are not continuous. */
double jl_force(const double *p, const double *s, const int *m, double z, double v);
void jl_rates(const double *p, const double *s, const int *m, double z, double v, double *rate);
void jl_indicators(const double *p, const double *s, const int *m, double z, double v, double *g);

/* Settles the modes at an event; 1 if a state jumped. */
int jl_event(const double *p, double *s, int *m, double z, double v);

/* dF[2 + JL_STATES]: of the force by z, v and each state; dR[JL_STATES][2 + JL_STATES] the same of each rate. */
void jl_partials(const double *p, const double *s, const int *m, double z, double v, double *dF, double *dR);

#endif
