"""Which FMI function may be called in which state, transcribed from the texts of the standards."""

from __future__ import annotations

# FMI 2.0.4, sections 4.2.4 and 3.2.3, with the standard's own marks. Columns: instantiated, initialization mode, step
# complete, step in progress, step failed, step canceled, terminated, error; and for model exchange instantiated,
# initialization mode, event mode, continuous-time mode, terminated, error.
_CO_SIMULATION_2 = """
fmi2SetDebugLogging          |x |x |x |x |x |x |x |x
fmi2SetupExperiment          |x |  |  |  |  |  |  |
fmi2EnterInitializationMode  |x |  |  |  |  |  |  |
fmi2ExitInitializationMode   |  |x |  |  |  |  |  |
fmi2Terminate                |  |  |x |  |x |  |  |
fmi2Reset                    |x |x |x |  |x |x |x |x
fmi2GetReal                  |  |2 |x |  |8 |7 |x |7
fmi2GetInteger               |  |2 |x |  |8 |7 |x |7
fmi2GetBoolean               |  |2 |x |  |8 |7 |x |7
fmi2GetString                |  |2 |x |  |8 |7 |x |7
fmi2SetReal                  |1 |3 |6 |  |  |  |  |
fmi2SetInteger               |1 |3 |6 |  |  |  |  |
fmi2SetBoolean               |1 |3 |6 |  |  |  |  |
fmi2SetString                |1 |3 |6 |  |  |  |  |
fmi2GetFMUstate              |x |x |x |  |8 |7 |x |7
fmi2SetFMUstate              |x |x |x |  |x |x |x |x
fmi2FreeFMUstate             |x |x |x |  |x |x |x |x
fmi2SerializedFMUstateSize   |x |x |x |  |x |x |x |x
fmi2SerializeFMUstate        |x |x |x |  |x |x |x |x
fmi2DeSerializeFMUstate      |x |x |x |  |x |x |x |x
fmi2GetDirectionalDerivative |  |x |x |  |8 |7 |x |7
fmi2SetRealInputDerivatives  |x |x |x |  |  |  |  |
fmi2GetRealOutputDerivatives |  |  |x |  |8 |x |x |7
fmi2DoStep                   |  |  |x |  |  |  |  |
fmi2CancelStep               |  |  |  |x |  |  |  |
fmi2GetStatus                |  |  |x |x |x |  |x |
fmi2GetRealStatus            |  |  |x |x |x |  |x |
fmi2GetIntegerStatus         |  |  |x |x |x |  |x |
fmi2GetBooleanStatus         |  |  |x |x |x |  |x |
fmi2GetStringStatus          |  |  |x |x |x |  |x |
"""
_MODEL_EXCHANGE_2 = """
fmi2SetDebugLogging               |x |x |x |x |x |x
fmi2SetupExperiment               |x |  |  |  |  |
fmi2EnterInitializationMode       |x |  |  |  |  |
fmi2ExitInitializationMode        |  |x |  |  |  |
fmi2Terminate                     |  |  |x |x |  |
fmi2Reset                         |x |x |x |x |x |x
fmi2GetReal                       |  |2 |x |x |x |7
fmi2GetInteger                    |  |2 |x |x |x |7
fmi2GetBoolean                    |  |2 |x |x |x |7
fmi2GetString                     |  |2 |x |x |x |7
fmi2SetReal                       |1 |3 |4 |5 |  |
fmi2SetInteger                    |1 |3 |4 |  |  |
fmi2SetBoolean                    |1 |3 |4 |  |  |
fmi2SetString                     |1 |3 |4 |  |  |
fmi2GetFMUstate                   |x |x |x |x |x |7
fmi2SetFMUstate                   |x |x |x |x |x |x
fmi2FreeFMUstate                  |x |x |x |x |x |x
fmi2SerializedFMUstateSize        |x |x |x |x |x |x
fmi2SerializeFMUstate             |x |x |x |x |x |x
fmi2DeSerializeFMUstate           |x |x |x |x |x |x
fmi2GetDirectionalDerivative      |  |x |x |x |x |7
fmi2EnterEventMode                |  |  |x |x |  |
fmi2NewDiscreteStates             |  |  |x |  |  |
fmi2EnterContinuousTimeMode       |  |  |x |  |  |
fmi2CompletedIntegratorStep       |  |  |  |x |  |
fmi2SetTime                       |  |  |8 |x |  |
fmi2SetContinuousStates           |  |  |  |x |  |
fmi2GetEventIndicators            |  |x |x |x |x |7
fmi2GetContinuousStates           |  |x |x |x |x |7
fmi2GetDerivatives                |  |x |x |x |x |7
fmi2GetNominalsOfContinuousStates |x |x |x |x |x |7
"""
# Steps are synchronous and never fail but by an error, so the three states "-" do not occur. Mark 7 in the state
# error, values for debugging only: an instance in error gives none. The time is taken in event mode as in FMI 2.0.1, of
# which later releases make mark 8 (for models of discrete time).
_COLUMNS_2 = {"cs": (_CO_SIMULATION_2, "INS---TX"), "me": (_MODEL_EXCHANGE_2, "INECTX")}


# FMI 3.0.1, sections 2.3, 3.2 and 4.2: the functions of the super states, then those of each state.
def _functions(*words: str) -> set[str]:
    """Functions whose names are made of one part of each of the words, parts divided by spaces."""
    names = {"fmi3"}
    for word in words:
        names = {name + part for name in names for part in word.split()}
    return names


_TYPES = "Float32 Float64 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String Binary"
_GET, _SET = _functions("Get", _TYPES), _functions("Set", _TYPES)
_ALWAYS = _functions("SetDebugLogging Reset SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState")
_ALWAYS |= _functions("DeserializeFMUState")
_SAVE = _functions("GetFMUState")
_PARTIALS = _functions("GetDirectionalDerivative GetAdjointDerivative")
_VECTORS = _functions("Get", "ContinuousStateDerivatives ContinuousStates NominalsOfContinuousStates EventIndicators")
_NUMBERS = _functions("GetNumberOf", "ContinuousStates EventIndicators")
_INITIALIZATION = _ALWAYS | _SAVE | _GET | _SET | _PARTIALS | _functions("ExitInitializationMode")
_INITIALIZATION |= _functions("Get Set", "Interval Shift", "Decimal Fraction")
_EVENT = _functions("EvaluateDiscreteStates UpdateDiscreteStates EnterContinuousTimeMode Terminate GetClock SetClock")
# The reference FMUs take the time in event mode too; the text names continuous-time mode.
_EVENT |= _functions("GetInterval", "Decimal Fraction") | _functions("SetTime")
_CONTINUOUS = _functions("SetTime SetContinuousStates CompletedIntegratorStep EnterEventMode Terminate")
_STEP = _functions("DoStep GetOutputDerivatives Terminate")
_ALLOWED_3 = {
    "cs": {
        # fmi3Get of start values.
        "I": _ALWAYS | _SAVE | _GET | _SET | _functions("EnterInitializationMode"),
        "N": _INITIALIZATION,
        "S": _ALWAYS | _SAVE | _GET | _SET | _PARTIALS | _STEP,
        "T": _ALWAYS | _SAVE | _GET | _PARTIALS | _functions("GetOutputDerivatives"),
        "X": _ALWAYS,
    },
    "me": {
        "I": _ALWAYS | _SAVE | _GET | _SET | _NUMBERS | _functions("EnterInitializationMode"),
        "N": _INITIALIZATION | _VECTORS | _NUMBERS,
        "E": _ALWAYS | _SAVE | _GET | _SET | _PARTIALS | _VECTORS | _NUMBERS | _EVENT,
        # Only continuous inputs: of the types that have them.
        "C": _ALWAYS | _SAVE | _GET | _functions("SetFloat", "32 64") | _PARTIALS | _VECTORS | _NUMBERS | _CONTINUOUS,
        "T": _ALWAYS | _SAVE | _GET | _PARTIALS | _VECTORS | _NUMBERS,
        "X": _ALWAYS,
    },
}


def allowed(version: int, kind: str, state: str) -> set[str]:
    """Functions that may be called in a state of co-simulation ("cs") or model exchange ("me")."""
    if version == 3:
        return _ALLOWED_3[kind][state]
    table, columns = _COLUMNS_2[kind]
    rows = (line.split("|") for line in table.strip().splitlines())
    marks = {name.strip(): cells[columns.index(state)].strip() for name, *cells in rows}
    return {name for name, mark in marks.items() if mark and not (state == "X" and mark == "7")}
