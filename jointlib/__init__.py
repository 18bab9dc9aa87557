"""Nonlinear machine joints: laws, identification, describing functions, closing the loop.

The names of the verbs are here, as functions that do what a verb does. They are imported when first used, so that
``jointlib --help`` need not wait.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jointlib.answers.df import df
    from jointlib.answers.estimate import estimate
    from jointlib.answers.identify import cutting_forces, identify
    from jointlib.answers.import_records import import_
    from jointlib.answers.trace import trace
    from jointlib.describing import DescribingFunction
    from jointlib.errors import CheckFailed, FrequencyMismatch, InputError, Outcome
    from jointlib.frf import FRF, ReceptanceKind
    from jointlib.identification import Identification, restoring_force
    from jointlib.io.joint_file import read_joint, write_joint
    from jointlib.io.measurement_file import read_measurement, read_records
    from jointlib.joint import Joint
    from jointlib.law import JointLaw, Motion
    from jointlib.loop.answer.report import TraceReport, Verdict
    from jointlib.measurement import Measurement
    from jointlib.modal_fit.fit import fit_modes

_HOME = {
    "DescribingFunction": "describing",
    "CheckFailed": "errors",
    "FrequencyMismatch": "errors",
    "InputError": "errors",
    "Outcome": "errors",
    "FRF": "frf",
    "ReceptanceKind": "frf",
    "Identification": "identification",
    "cutting_forces": "answers.identify",
    "df": "answers.df",
    "estimate": "answers.estimate",
    "fit_modes": "modal_fit.fit",
    "identify": "answers.identify",
    "import_": "answers.import_records",
    "restoring_force": "identification",
    "read_joint": "io.joint_file",
    "write_joint": "io.joint_file",
    "read_measurement": "io.measurement_file",
    "read_records": "io.measurement_file",
    "Joint": "joint",
    "JointLaw": "law",
    "Motion": "law",
    "TraceReport": "loop.answer.report",
    "Verdict": "loop.answer.report",
    "trace": "answers.trace",
    "Measurement": "measurement",
}

__all__ = [
    "FRF",
    "CheckFailed",
    "DescribingFunction",
    "FrequencyMismatch",
    "Identification",
    "InputError",
    "Joint",
    "JointLaw",
    "Measurement",
    "Motion",
    "Outcome",
    "ReceptanceKind",
    "TraceReport",
    "Verdict",
    "cutting_forces",
    "df",
    "estimate",
    "fit_modes",
    "identify",
    "import_",
    "read_joint",
    "read_measurement",
    "read_records",
    "restoring_force",
    "trace",
    "write_joint",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'jointlib' has no attribute {name!r}")
    return getattr(import_module(f"jointlib.{_HOME[name]}"), name)
