/* One FMU instance, the same for FMI 2 and FMI 3, co-simulation and model exchange. */
#ifndef JL_INSTANCE_H
#define JL_INSTANCE_H

#include "joint.h"

#ifdef JL_PREFIX
#define jl_new JL_NAME(jl_new)
#define jl_free JL_NAME(jl_free)
#define jl_enter JL_NAME(jl_enter)
#define jl_fail JL_NAME(jl_fail)
#define jl_report JL_NAME(jl_report)
#define jl_logging JL_NAME(jl_logging)
#define jl_experiment JL_NAME(jl_experiment)
#define jl_exit_initialization JL_NAME(jl_exit_initialization)
#define jl_move JL_NAME(jl_move)
#define jl_reset JL_NAME(jl_reset)
#define jl_refuse JL_NAME(jl_refuse)
#define jl_save JL_NAME(jl_save)
#define jl_restore JL_NAME(jl_restore)
#define jl_drop JL_NAME(jl_drop)
#define jl_saved_size JL_NAME(jl_saved_size)
#define jl_serialize JL_NAME(jl_serialize)
#define jl_deserialize JL_NAME(jl_deserialize)
#define jl_start JL_NAME(jl_start)
#define jl_all_finite JL_NAME(jl_all_finite)
#define jl_no_number JL_NAME(jl_no_number)
#define jl_prepare JL_NAME(jl_prepare)
#define jl_look JL_NAME(jl_look)
#define jl_begin JL_NAME(jl_begin)
#define jl_moves JL_NAME(jl_moves)
#define jl_motion JL_NAME(jl_motion)
#define jl_slopes JL_NAME(jl_slopes)
#define jl_outputs JL_NAME(jl_outputs)
#define jl_all_rates JL_NAME(jl_all_rates)
#define jl_integrate JL_NAME(jl_integrate)
#define jl_watch JL_NAME(jl_watch)
#define jl_watch_at JL_NAME(jl_watch_at)
#define jl_is_closed JL_NAME(jl_is_closed)
#define jl_exponential JL_NAME(jl_exponential)
#define jl_open JL_NAME(jl_open)
#define jl_port_motions JL_NAME(jl_port_motions)
#define jl_get JL_NAME(jl_get)
#define jl_set JL_NAME(jl_set)
#define jl_derivative JL_NAME(jl_derivative)
#define jl_do_step JL_NAME(jl_do_step)
#define jl_set_slopes JL_NAME(jl_set_slopes)
#define jl_listed JL_NAME(jl_listed)
#define jl_inputs_at JL_NAME(jl_inputs_at)
#define jl_ask_inputs JL_NAME(jl_ask_inputs)
#define jl_output_rates JL_NAME(jl_output_rates)
#define jl_new_discrete_states JL_NAME(jl_new_discrete_states)
#define jl_continuous_time JL_NAME(jl_continuous_time)
#define jl_completed_step JL_NAME(jl_completed_step)
#define jl_set_time JL_NAME(jl_set_time)
#define jl_set_continuous_states JL_NAME(jl_set_continuous_states)
#define jl_get_continuous_states JL_NAME(jl_get_continuous_states)
#define jl_get_rates JL_NAME(jl_get_rates)
#define jl_get_indicators JL_NAME(jl_get_indicators)
#define jl_get_nominals JL_NAME(jl_get_nominals)
#endif

/* FMI functions are all that a library shows (compile with -fvisibility=hidden). */
#if defined(_WIN32) || defined(__CYGWIN__)
#define JL_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define JL_EXPORT __attribute__((visibility("default")))
#else
#define JL_EXPORT
#endif

/* The states of an instance that decide what may be called. */
enum {
    JL_INSTANTIATED = 'I',
    JL_INITIALIZATION = 'N',
    JL_EVENT = 'E',
    JL_CONTINUOUS_TIME = 'C',
    JL_STEP = 'S',
    JL_INTERMEDIATE = 'U',
    JL_TERMINATED = 'T',
    JL_FAILED = 'X'
};

/* Every function that takes an instance, and the states in which it may be called: co-simulation, model exchange.
 * FMI 2.0: tables of sections 3.2.3 and 4.2.4. Steps are neither asynchronous nor cancelled, so nothing cancels one.
 * Stricter than the tables: in state X no value is read and no state is saved. */
#define JL_CALLS_2(CALL) \
    CALL(fmi2SetDebugLogging, "INSTX", "INECTX") \
    CALL(fmi2SetupExperiment, "I", "I") \
    CALL(fmi2EnterInitializationMode, "I", "I") \
    CALL(fmi2ExitInitializationMode, "N", "N") \
    CALL(fmi2Terminate, "S", "EC") \
    CALL(fmi2Reset, "INSTX", "INECTX") \
    CALL(fmi2GetReal, "NST", "NECT") \
    CALL(fmi2GetInteger, "NST", "NECT") \
    CALL(fmi2GetBoolean, "NST", "NECT") \
    CALL(fmi2GetString, "NST", "NECT") \
    CALL(fmi2SetReal, "INS", "INEC") \
    CALL(fmi2SetInteger, "INS", "INE") \
    CALL(fmi2SetBoolean, "INS", "INE") \
    CALL(fmi2SetString, "INS", "INE") \
    CALL(fmi2GetFMUstate, "INST", "INECT") \
    CALL(fmi2SetFMUstate, "INSTX", "INECTX") \
    CALL(fmi2FreeFMUstate, "INSTX", "INECTX") \
    CALL(fmi2SerializedFMUstateSize, "INSTX", "INECTX") \
    CALL(fmi2SerializeFMUstate, "INSTX", "INECTX") \
    CALL(fmi2DeSerializeFMUstate, "INSTX", "INECTX") \
    CALL(fmi2GetDirectionalDerivative, "NST", "NECT") \
    CALL(fmi2EnterEventMode, "", "EC") \
    CALL(fmi2NewDiscreteStates, "", "E") \
    CALL(fmi2EnterContinuousTimeMode, "", "E") \
    CALL(fmi2CompletedIntegratorStep, "", "C") \
    CALL(fmi2SetTime, "", "EC") \
    CALL(fmi2SetContinuousStates, "", "C") \
    CALL(fmi2GetDerivatives, "", "NECT") \
    CALL(fmi2GetEventIndicators, "", "NECT") \
    CALL(fmi2GetContinuousStates, "", "NECT") \
    CALL(fmi2GetNominalsOfContinuousStates, "", "INECT") \
    CALL(fmi2SetRealInputDerivatives, "INS", "") \
    CALL(fmi2GetRealOutputDerivatives, "ST", "") \
    CALL(fmi2DoStep, "S", "") \
    CALL(fmi2CancelStep, "", "") \
    CALL(fmi2GetStatus, "ST", "") \
    CALL(fmi2GetRealStatus, "ST", "") \
    CALL(fmi2GetIntegerStatus, "ST", "") \
    CALL(fmi2GetBooleanStatus, "ST", "") \
    CALL(fmi2GetStringStatus, "ST", "")

/* FMI 3.0: sections 2.3, 3.2 and 4.2. There are no structural parameters (no configuration mode), no clocks, no
 * event mode in co-simulation and no scheduled execution. */
#define JL_CALLS_3(CALL) \
    CALL(fmi3SetDebugLogging, "INSTX", "INECTX") \
    CALL(fmi3EnterInitializationMode, "I", "I") \
    CALL(fmi3ExitInitializationMode, "N", "N") \
    CALL(fmi3EnterEventMode, "", "C") \
    CALL(fmi3Terminate, "S", "EC") \
    CALL(fmi3Reset, "INSTX", "INECTX") \
    CALL(fmi3GetFloat32, "INST", "INECT") \
    CALL(fmi3GetFloat64, "INST", "INECT") \
    CALL(fmi3GetInt8, "INST", "INECT") \
    CALL(fmi3GetUInt8, "INST", "INECT") \
    CALL(fmi3GetInt16, "INST", "INECT") \
    CALL(fmi3GetUInt16, "INST", "INECT") \
    CALL(fmi3GetInt32, "INST", "INECT") \
    CALL(fmi3GetUInt32, "INST", "INECT") \
    CALL(fmi3GetInt64, "INST", "INECT") \
    CALL(fmi3GetUInt64, "INST", "INECT") \
    CALL(fmi3GetBoolean, "INST", "INECT") \
    CALL(fmi3GetString, "INST", "INECT") \
    CALL(fmi3GetBinary, "INST", "INECT") \
    CALL(fmi3GetClock, "", "E") \
    CALL(fmi3SetFloat32, "INS", "INEC") \
    CALL(fmi3SetFloat64, "INSU", "INEC") \
    CALL(fmi3SetInt8, "INS", "INE") \
    CALL(fmi3SetUInt8, "INS", "INE") \
    CALL(fmi3SetInt16, "INS", "INE") \
    CALL(fmi3SetUInt16, "INS", "INE") \
    CALL(fmi3SetInt32, "INS", "INE") \
    CALL(fmi3SetUInt32, "INS", "INE") \
    CALL(fmi3SetInt64, "INS", "INE") \
    CALL(fmi3SetUInt64, "INS", "INE") \
    CALL(fmi3SetBoolean, "INS", "INE") \
    CALL(fmi3SetString, "INS", "INE") \
    CALL(fmi3SetBinary, "INS", "INE") \
    CALL(fmi3SetClock, "", "E") \
    CALL(fmi3GetNumberOfVariableDependencies, "", "") \
    CALL(fmi3GetVariableDependencies, "", "") \
    CALL(fmi3GetFMUState, "INST", "INECT") \
    CALL(fmi3SetFMUState, "INSTX", "INECTX") \
    CALL(fmi3FreeFMUState, "INSTX", "INECTX") \
    CALL(fmi3SerializedFMUStateSize, "INSTX", "INECTX") \
    CALL(fmi3SerializeFMUState, "INSTX", "INECTX") \
    CALL(fmi3DeserializeFMUState, "INSTX", "INECTX") \
    CALL(fmi3GetDirectionalDerivative, "NST", "NECT") \
    CALL(fmi3GetAdjointDerivative, "NST", "NECT") \
    CALL(fmi3EnterConfigurationMode, "", "") \
    CALL(fmi3ExitConfigurationMode, "", "") \
    CALL(fmi3GetIntervalDecimal, "N", "NE") \
    CALL(fmi3GetIntervalFraction, "N", "NE") \
    CALL(fmi3GetShiftDecimal, "N", "N") \
    CALL(fmi3GetShiftFraction, "N", "N") \
    CALL(fmi3SetIntervalDecimal, "N", "N") \
    CALL(fmi3SetIntervalFraction, "N", "N") \
    CALL(fmi3SetShiftDecimal, "N", "N") \
    CALL(fmi3SetShiftFraction, "N", "N") \
    CALL(fmi3EvaluateDiscreteStates, "", "E") \
    CALL(fmi3UpdateDiscreteStates, "", "E") \
    CALL(fmi3EnterContinuousTimeMode, "", "E") \
    CALL(fmi3CompletedIntegratorStep, "", "C") \
    CALL(fmi3SetTime, "", "EC") \
    CALL(fmi3SetContinuousStates, "", "C") \
    CALL(fmi3GetContinuousStateDerivatives, "", "NECT") \
    CALL(fmi3GetEventIndicators, "", "NECT") \
    CALL(fmi3GetContinuousStates, "", "NECT") \
    CALL(fmi3GetNominalsOfContinuousStates, "", "NECT") \
    CALL(fmi3GetNumberOfEventIndicators, "", "INECT") \
    CALL(fmi3GetNumberOfContinuousStates, "", "INECT") \
    CALL(fmi3EnterStepMode, "", "") \
    CALL(fmi3GetOutputDerivatives, "ST", "") \
    CALL(fmi3DoStep, "S", "") \
    CALL(fmi3ActivateModelPartition, "", "")

#define JL_NUMBER(name, co_simulation, model_exchange) call_##name,
typedef enum { JL_CALLS_2(JL_NUMBER) JL_CALLS_3(JL_NUMBER) JL_INSTANTIATE } jl_call;
#undef JL_NUMBER

/* The statuses that FMI 2 and FMI 3 share. */
enum { JL_OK, JL_WARNING, JL_DISCARD, JL_ERROR };

/* All that a saved state holds: plain values, zero-filled, copied as one block. */
typedef struct {
    double time, stop; /* s */
    double tolerance;  /* the host's, 0 where it has none */
    double stride;     /* s, what the integrator would step next; 0 before it stepped */
    double u[JL_ROOM(JL_INPUTS)];
    double du[JL_ROOM(JL_INPUTS)], ddu[JL_ROOM(JL_INPUTS)]; /* 1/s, 1/s2, how the inputs go on in the next step */
    double y[JL_ROOM(JL_OUTPUTS)]; /* valid while `fresh` */
    double p[JL_ROOM(JL_PARAMETERS)];
    double s[JL_ROOM(JL_STATES)];
    int m[JL_ROOM(JL_MODES)];
    double q[JL_ROOM(JL_POLES)];                              /* the closed structure, the truth while `closed` */
    double push[JL_ROOM(JL_POLES)], pushed[JL_ROOM(JL_POLES)]; /* what bent joints do to it, now and a step before */
    double d[JL_ROOM(JL_BENT)], was[JL_ROOM(JL_BENT)];        /* their forces beyond the tangents, in N */
    double at[JL_ROOM(JL_TURNS * JL_MOTIONS)], past[JL_ROOM(JL_TURNS * JL_MOTIONS)]; /* motions, where joints remember */
    double before;   /* s, that step; 0 where there was none */
    double told;     /* s, when an input was last set */
#ifdef JL_CONDITIONS
    double held[JL_CONDITIONS]; /* the conditions at the end of the last step */
#endif
    int closed;      /* the structure is in q, and s is behind */
    int bent;        /* d and push are of the present parameters */
    int state;       /* what may be called */
    int exchange;    /* model exchange */
    int initialized; /* before, the joints are virgin at the displacements that are set */
    int sound;       /* the parameters were checked since they were set */
    int timed;       /* the time is the host's, by an experiment that was set up or a step */
    int fresh;       /* the outputs were computed since anything was set: 1 those of ports, 2 all */
    int behind;      /* a solver asked rates of a time for which it told no inputs */
    int late;        /* and told another input later */
} jl_values;

#ifdef JL_CONDITIONS
enum { JL_MOTION_SAID = 1, JL_CONDITION_SAID = 2 }; /* that they left what is known of a joint */
#define JL_PRESENT(v) ((v)->u + JL_INPUTS - JL_CONDITIONS)
#define JL_HOLD(v) memcpy((v)->held, JL_PRESENT(v), sizeof (v)->held)
#define JL_JUMPED(v) (memcmp((v)->held, JL_PRESENT(v), sizeof (v)->held) != 0)

#endif
typedef struct jl_instance jl_instance;
struct jl_instance {
    jl_values values;
    int version;     /* 2 or 3 */
    int errors;      /* what is logged */
    int warnings;
    int outside;     /* leaving the identified range was logged */
    const char *name; /* owned */
    void *flows;      /* owned: what steps of some lengths do to the closed structure */
    unsigned next_flow;
    void *environment;
    void (*logger)(void); /* the host's, of the type of its version */
    void (*intermediate)(void); /* the host's, NULL where it does not answer */
    void (*ask)(jl_instance *, double time); /* for the inputs at a time within a step; NULL where nobody answers */
    void (*log)(const jl_instance *, int status, const char *category, const char *message);
};

/* Life cycle (instance.c). Each function but the first two checks the call order itself and returns a status. */
jl_instance *jl_new(const jl_instance *host, int exchange, const char *name, const char *token);
void jl_free(void *instance);
int jl_enter(jl_instance *instance, jl_call call);
int jl_fail(jl_instance *instance, jl_call call, const char *format, ...);
void jl_report(const jl_instance *instance, jl_call call, int status, const char *message);
int jl_logging(void *instance, jl_call call, int on, size_t count, const char *const *categories);
int jl_experiment(void *instance, jl_call call, double tolerance, double start, int stop_defined, double stop);
int jl_move(void *instance, jl_call call, int state);
int jl_reset(void *instance, jl_call call);
int jl_refuse(void *instance, jl_call call, size_t count, const char *reason); /* sound only where nothing is asked */

/* Saved states (saved.c). */
int jl_save(void *instance, jl_call call, void **saved);
int jl_restore(void *instance, jl_call call, const void *saved);
int jl_drop(void *instance, jl_call call, void **saved);
int jl_saved_size(void *instance, jl_call call, const void *saved, size_t *size);
int jl_serialize(void *instance, jl_call call, const void *saved, void *bytes, size_t size);
int jl_deserialize(void *instance, jl_call call, const void *bytes, size_t size, void **saved);

/* Values (values.c). `places` is the length of the array that the host says it passes. */
void jl_start(jl_values *values);
int jl_all_finite(const double *x, int count);
int jl_no_number(jl_instance *instance, jl_call call, const char *what);
int jl_prepare(jl_instance *instance, jl_call call);
void jl_look(const jl_values *values, double *rate, double *g);
void jl_watch(jl_instance *instance, jl_call call);
void jl_watch_at(jl_instance *instance, jl_call call, const double *motion);
int jl_exit_initialization(void *instance, jl_call call);
int jl_get(void *instance, jl_call call, const unsigned int *references, size_t count, double *x, size_t places);
int jl_set(void *instance, jl_call call, const unsigned int *references, size_t count, const double *x, size_t places);
int jl_do_step(void *instance, jl_call call, double time, double h);
int jl_listed(jl_instance *instance, jl_call call, const unsigned int *references, size_t count, const double *x,
              size_t places);

/* Inputs within a step (inputs.c). */
int jl_set_slopes(void *instance, jl_call call, const unsigned int *references, size_t count, const int *order,
                  const double *slope);
void jl_inputs_at(const jl_values *values, double since, double *u);
int jl_ask_inputs(jl_instance *instance, double time, double h);

/* The structure (structure.c): products with its matrices. f may be NULL where no force enters. jl_moves is what small
 * changes of x, u and f do to rows from `first` on: the static load has no part in it. */
void jl_begin(const double *p, const double *motion, double *s, int *m);
void jl_moves(int first, int count, const double *x, const double *u, const double *f, double *result);
void jl_motion(const double *x, const double *u, double *motion);
void jl_slopes(const double *x, const double *u, const double *f, double *slope);
void jl_outputs(const double *x, const double *u, const double *f, double *y);
void jl_all_rates(const double *p, const double *s, const int *m, const double *u, double *rate);

/* Co-simulation with a structure (integrate.c): h seconds; NULL or a sentence on why not. */
const char *jl_integrate(jl_values *values, double h);

/* Co-simulation with the joints closed at their tangents (exponential.c): from JL_LOOSE on, or where the structure is
 * stiff, and while the parameters in the modes are as exported. jl_open puts the structure into s. */
#define JL_LOOSE 1e-7
#define JL_USUAL 1e-4 /* tolerance of a stiff structure where the host has none */
int jl_is_closed(const jl_values *values);
const char *jl_exponential(jl_instance *instance, jl_call call, double h);
void jl_open(jl_values *values);
void jl_port_motions(const jl_values *values, double *out);

/* Model exchange (exchange.c). */
int jl_new_discrete_states(void *instance, jl_call call, int *jumped); /* NULL: the host has no place for it */
int jl_continuous_time(void *instance, jl_call call);
int jl_completed_step(void *instance, jl_call call, int answerable, int *event);
int jl_set_time(void *instance, jl_call call, double time);
int jl_set_continuous_states(void *instance, jl_call call, const double *x, size_t count);
int jl_get_continuous_states(void *instance, jl_call call, double *x, size_t count);
int jl_get_rates(void *instance, jl_call call, double *x, size_t count);
int jl_get_indicators(void *instance, jl_call call, double *x, size_t count);
int jl_get_nominals(void *instance, jl_call call, double *x, size_t count);

/* Derivatives (derivative.c): the partials times a seed over the knowns (adjoint: over the unknowns). */
typedef struct {
    const unsigned int *unknowns, *knowns;
    size_t unknown_count, known_count;
    const double *seed;
    size_t seed_count;
    double *result;
    size_t result_count;
    int adjoint;
} jl_directions;
int jl_derivative(void *instance, jl_call call, const jl_directions *asked);
int jl_output_rates(void *instance, jl_call call, const unsigned int *references, size_t count, const int *order,
                    double *rate, size_t places);

#endif
