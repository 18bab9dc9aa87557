"""Identification of joints: from records to parameters, with their errors and their range."""

from jointlib.identification.damping import ViscousDamping, viscous_damping
from jointlib.identification.force_samples import RestoringForce, restoring_force
from jointlib.identification.hertz_fit import HertzFit, fit_hertz
from jointlib.identification.joint_fit import identify
from jointlib.identification.modal_check import RigBody, RigModes, rig_modes
from jointlib.identification.result import FitError, Found, Identification
from jointlib.identification.surface import SurfaceFit, fit_surface

__all__ = [
    "FitError",
    "Found",
    "HertzFit",
    "Identification",
    "RestoringForce",
    "RigBody",
    "RigModes",
    "SurfaceFit",
    "ViscousDamping",
    "fit_hertz",
    "fit_surface",
    "identify",
    "restoring_force",
    "rig_modes",
    "viscous_damping",
]
