/* What the FMI wrapper asks of a model: the generated joint.c answers, joint_sizes.h gives the counts.
 *
 * A model is a linear structure with joints between its parts:
 *     x' = A x + B u + G f     structure states x (none in a lone joint), inputs u, joint forces f in N
 *     [z; v] = C x + D u       relative displacement in m and velocity in m/s of each joint
 *     y = E x + F u + H f      outputs
 * with the constants of a static load added to every row, and each joint is a force f(z, v, s) with internal states s of
 * its own. A lone joint has u = [z; v] and y = f.
 * Every function is pure: no statics, no allocation, no input or output. Parameters p, states and modes m come in the
 * order of their variables; the states are those of the structure, then those of the joints. */
#ifndef JOINT_H
#define JOINT_H

#include <stddef.h>
#include "joint_sizes.h"

/* Models linked into one program need names of their own: the standard's FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX
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
#define jl_motion_names JL_NAME(jl_motion_names)
#define jl_owner JL_NAME(jl_owner)
#define jl_first JL_NAME(jl_first)
#define jl_column JL_NAME(jl_column)
#define jl_entry JL_NAME(jl_entry)
#define jl_load JL_NAME(jl_load)
#define jl_rest JL_NAME(jl_rest)
#define jl_pole JL_NAME(jl_pole)
#define jl_pole_kind JL_NAME(jl_pole_kind)
#define jl_read JL_NAME(jl_read)
#define jl_push JL_NAME(jl_push)
#define jl_drive JL_NAME(jl_drive)
#define jl_constant JL_NAME(jl_constant)
#define jl_port JL_NAME(jl_port)
#define jl_opened JL_NAME(jl_opened)
#define jl_at_rest JL_NAME(jl_at_rest)
#define jl_tangent JL_NAME(jl_tangent)
#define jl_share JL_NAME(jl_share)
#define jl_share_first JL_NAME(jl_share_first)
#define jl_share_column JL_NAME(jl_share_column)
#define jl_bent JL_NAME(jl_bent)
#define jl_by_velocity JL_NAME(jl_by_velocity)
#define jl_remembers JL_NAME(jl_remembers)
#define jl_kept JL_NAME(jl_kept)
#ifdef JL_CONDITIONS
#define jl_nudge JL_NAME(jl_nudge)
#endif
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

/* Variables in the order of their value references, which count from 1: inputs, outputs, the parameters, the states, the
 * rates of the continuous states, the event indicators, and time. FMI 2 has no variables of the last two kinds. */
enum { JL_INPUT, JL_OUTPUT, JL_PARAMETER, JL_STATE, JL_RATE, JL_INDICATOR, JL_TIME };

enum {
    JL_FIRST_OUTPUT = JL_INPUTS,
    JL_FIRST_PARAMETER = JL_FIRST_OUTPUT + JL_OUTPUTS,
    JL_FIRST_STATE = JL_FIRST_PARAMETER + JL_PARAMETERS,
    JL_FIRST_RATE = JL_FIRST_STATE + JL_STATES,
    JL_FIRST_INDICATOR = JL_FIRST_RATE + JL_CONTINUOUS,
    JL_MEMORY = JL_STATES - JL_STRUCTURE,  /* states of the joints */
#ifdef JL_CONDITIONS
    JL_MOTIONS = 2 * JL_JOINTS + JL_CONDITIONS, /* displacement and velocity of each joint in turn, then the conditions */
#else
    JL_MOTIONS = 2 * JL_JOINTS,            /* displacement and velocity of each joint in turn */
#endif
    JL_WIDTH = 2 + JL_MEMORY,              /* what a joint depends on: its own motion, and states */
    JL_ROWS = JL_STRUCTURE + JL_MOTIONS + JL_OUTPUTS,
    JL_COLUMNS = JL_STRUCTURE + JL_INPUTS + JL_JOINTS
};

/* Place of a variable by its value reference; 0 is none, and comes out as the largest number. */
#define JL_PLACE(reference) ((reference) - 1u)

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
extern const int jl_continuous[];           /* for each continuous state of model exchange its place among the states */
extern const double jl_validity[];          /* identified range, for each joint: z from, to, v from, to; or infinite */
extern const char *const jl_motion_names[]; /* name of each joint's displacement and velocity */
extern const int jl_owner[];                /* for each state of the joints the joint that it belongs to */

/* The matrices row by row, without their zeros: rows [A B G; C D 0; E F H], columns x, u, f. Row i holds
 * jl_entry[jl_first[i]] to jl_entry[jl_first[i + 1] - 1]. */
extern const int jl_first[];
extern const int jl_column[];
extern const double jl_entry[];
extern const double jl_load[]; /* added to each row; all 0 unless JL_LOADED */
extern const double jl_rest[]; /* x at the start, in balance with that */

/* The structure with its joints closed at their tangents, where JL_POLES is not 0: y with x = W y, in pairs. A pair is a
 * complex mode (kind 0: pole s + iw), two real ones (1) or a free motion and its speed (2). Joints that are more than
 * their tangents are bent; their displacements are combinations of those of a basis. */
extern const double jl_pole[];       /* for each pair s, w, or two real poles */
extern const int jl_pole_kind[];
extern const double jl_read[];       /* [y][JL_READS]: motions of the basis */
extern const double jl_push[];       /* [JL_BASIS][y]: forces of the basis into y' */
extern const double jl_drive[];      /* [JL_INPUTS][y] */
extern const double jl_constant[];   /* added to y' */
extern const double jl_port[];       /* [y][JL_PORTS]: the first outputs */
extern const double jl_opened[];     /* W, row by row */
extern const double jl_at_rest[];    /* y at the start */
extern const double jl_tangent[];    /* of each bent joint stiffness and damping in the modes, and offset of z */
extern const int jl_bent[];          /* of each bent joint its number */
extern const int jl_by_velocity[];   /* its laws are asked with their velocity */
extern const int jl_remembers[];     /* a law of it has states */
extern const int jl_share_first[], jl_share_column[];
extern const double jl_share[];      /* its displacement over those of the basis, without zeros */
extern const int jl_kept[];          /* parameters that are in the modes */
#ifdef JL_CONDITIONS

/* Conditions that parameters of joints follow are the last inputs, and stand behind the motions of the joints. What lags
 * behind them are the last states. */
extern const double jl_nudge[]; /* of each condition, then of each lagging state: how far a difference goes */
#endif

/* 0 if the parameters are sound, else a sentence: which one, what was found, what was expected. */
int jl_check(const double *p, char *message, size_t size);

/* The joints. `motion` is z, v of each in turn, s their states alone, f their forces. */

/* The virgin joints at these displacements. */
void jl_initial(const double *p, const double *motion, double *s, int *m);

/* Co-simulation without structure: forces after h seconds at the held motion, and the states then (`after`, apart from
 * s). */
void jl_step(const double *p, const double *s, const double *motion, double h, double *after, double *f);

/* Partial derivatives of those forces at h = 0 with the states held: dF[2 * i] by z, dF[2 * i + 1] by v. */
void jl_step_partials(const double *p, const double *s, const double *motion, double *dF);

/* Model exchange, and every model with a structure. rate and the rows of dR: one for each state, also for those that are
 * not continuous. */
void jl_force(const double *p, const double *s, const int *m, const double *motion, double *f);
void jl_rates(const double *p, const double *s, const int *m, const double *motion, double *rate);
void jl_indicators(const double *p, const double *s, const int *m, const double *motion, double *g);

/* Settles the modes at an event; 1 if a state jumped. */
int jl_event(const double *p, double *s, int *m, const double *motion);

/* dF[JL_JOINTS][JL_WIDTH]: of each force by its own z and v and by every state; dR[JL_MEMORY][JL_WIDTH] the same of the
 * rate of each state. */
void jl_partials(const double *p, const double *s, const int *m, const double *motion, double *dF, double *dR);

#endif
