/* FMI 3.0: the functions on what a joint does not have: other types, clocks, configuration, dependencies. */
#include "fmi3.h"

/* Every variable is a Float64: the other types may be asked for nothing. */
#define JL_ABSENT_3(type) \
    fmi3Status JL_3(Get##type)(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##type x[], size_t places) \
    { \
        (void)vr, (void)x, (void)places; \
        JL_STATUS_3(jl_refuse(c, call_fmi3Get##type, n, "there are no variables of the type " #type)); \
    } \
    fmi3Status JL_3(Set##type)(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##type x[], \
                               size_t places) \
    { \
        (void)vr, (void)x, (void)places; \
        JL_STATUS_3(jl_refuse(c, call_fmi3Set##type, n, "there are no variables of the type " #type)); \
    }
JL_ABSENT_3(Float32)
JL_ABSENT_3(Int8)
JL_ABSENT_3(UInt8)
JL_ABSENT_3(Int16)
JL_ABSENT_3(UInt16)
JL_ABSENT_3(Int32)
JL_ABSENT_3(UInt32)
JL_ABSENT_3(Int64)
JL_ABSENT_3(UInt64)
JL_ABSENT_3(Boolean)
JL_ABSENT_3(String)

/* The remaining functions on absent things; `unused` are the arguments behind the count. */
#define JL_NOTHING_3(name, reason, arguments, unused) \
    fmi3Status JL_3(name) arguments \
    { \
        (void)vr; \
        unused; \
        JL_STATUS_3(jl_refuse(c, call_fmi3##name, n, reason)); \
    }
#define JL_VECTOR fmi3Instance c, const fmi3ValueReference vr[], size_t n
JL_NOTHING_3(GetBinary, "there are no variables of the type Binary",
             (JL_VECTOR, size_t sizes[], fmi3Binary x[], size_t places), ((void)sizes, (void)x, (void)places))
JL_NOTHING_3(SetBinary, "there are no variables of the type Binary",
             (JL_VECTOR, const size_t sizes[], const fmi3Binary x[], size_t places),
             ((void)sizes, (void)x, (void)places))
JL_NOTHING_3(GetClock, "there are no clocks", (JL_VECTOR, fmi3Clock x[]), ((void)x))
JL_NOTHING_3(SetClock, "there are no clocks", (JL_VECTOR, const fmi3Clock x[]), ((void)x))
JL_NOTHING_3(GetIntervalDecimal, "there are no clocks",
             (JL_VECTOR, fmi3Float64 x[], fmi3IntervalQualifier qualifiers[]), ((void)x, (void)qualifiers))
JL_NOTHING_3(GetIntervalFraction, "there are no clocks",
             (JL_VECTOR, fmi3UInt64 x[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]),
             ((void)x, (void)resolutions, (void)qualifiers))
JL_NOTHING_3(GetShiftDecimal, "there are no clocks", (JL_VECTOR, fmi3Float64 x[]), ((void)x))
JL_NOTHING_3(GetShiftFraction, "there are no clocks", (JL_VECTOR, fmi3UInt64 x[], fmi3UInt64 resolutions[]),
             ((void)x, (void)resolutions))
JL_NOTHING_3(SetIntervalDecimal, "there are no clocks", (JL_VECTOR, const fmi3Float64 x[]), ((void)x))
JL_NOTHING_3(SetIntervalFraction, "there are no clocks",
             (JL_VECTOR, const fmi3UInt64 x[], const fmi3UInt64 resolutions[]), ((void)x, (void)resolutions))
JL_NOTHING_3(SetShiftDecimal, "there are no clocks", (JL_VECTOR, const fmi3Float64 x[]), ((void)x))
JL_NOTHING_3(SetShiftFraction, "there are no clocks", (JL_VECTOR, const fmi3UInt64 x[], const fmi3UInt64 resolutions[]),
             ((void)x, (void)resolutions))

/* The call-order table allows these in no state. */
fmi3Status JL_3(GetNumberOfVariableDependencies)(fmi3Instance c, fmi3ValueReference reference, size_t *n)
{
    (void)reference, (void)n;
    JL_STATUS_3(jl_refuse(c, call_fmi3GetNumberOfVariableDependencies, 0, ""));
}

fmi3Status JL_3(GetVariableDependencies)(fmi3Instance c, fmi3ValueReference dependent, size_t elements[],
                                         fmi3ValueReference independents[], size_t independent_elements[],
                                         fmi3DependencyKind kinds[], size_t n)
{
    (void)dependent, (void)elements, (void)independents, (void)independent_elements, (void)kinds, (void)n;
    JL_STATUS_3(jl_refuse(c, call_fmi3GetVariableDependencies, 0, ""));
}

fmi3Status JL_3(EnterConfigurationMode)(fmi3Instance c)
{
    JL_STATUS_3(jl_refuse(c, call_fmi3EnterConfigurationMode, 0, ""));
}

fmi3Status JL_3(ExitConfigurationMode)(fmi3Instance c)
{
    JL_STATUS_3(jl_refuse(c, call_fmi3ExitConfigurationMode, 0, ""));
}

fmi3Status JL_3(EnterStepMode)(fmi3Instance c) { JL_STATUS_3(jl_refuse(c, call_fmi3EnterStepMode, 0, "")); }

fmi3Status JL_3(ActivateModelPartition)(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time)
{
    (void)clock, (void)time;
    JL_STATUS_3(jl_refuse(c, call_fmi3ActivateModelPartition, 0, ""));
}
