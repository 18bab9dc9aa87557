"""Fit a joint to measurements and write it."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.answers.given import File, joint_of, measurement_of
from jointlib.cutting_force.cutting_file import write_cutting_file
from jointlib.cutting_force.identify import identify_cutting
from jointlib.cutting_force.result import CuttingForces
from jointlib.errors import InputError
from jointlib.identification import Identification
from jointlib.identification import identify as fitted
from jointlib.io.atomic import given_target
from jointlib.io.joint_file import write_joint
from jointlib.joint import Joint
from jointlib.measurement import FORCES, RINGDOWN, Measurement
from jointlib.ringdown.identify import Ringdown, identify_ringdown, write_backbones


def identify(
    measurements: Measurement | File | Sequence[Measurement | File],
    *,
    laws: Sequence[str] | None = None,
    start: Joint | File | None = None,
    order: tuple[int, int] | str | None = None,
    output: File | None = None,
) -> Identification:
    """Fit a joint to the fit records of one or several tests, what ``jointlib identify`` does.

    A ball guide takes preload and kappa from static records if there are any; all else is fitted to rig or path
    records with those held. Sealed and quiet records stay closed.

    Parameters
    ----------
    measurements
        Static, rig and path tests or their files; rig and path not together. Errors are reported in the same order.
    laws
        Kinds of the laws; first values are guessed from the data.
    start
        A joint, or its file, that gives the laws, first values and what is ``fixed``; instead of ``laws``.
    order
        Orders in displacement and velocity of a chebyshev or polynomial surface; chosen on held-out data if None.
    output
        The joint file to write.
    """
    path = given_target(output)
    given = [measurements] if isinstance(measurements, Measurement | File) else measurements
    kinds = [laws] if isinstance(laws, str) else laws
    tests = [measurement_of(one) for one in given]
    first = None if start is None else joint_of(start)
    if any(test.kind == RINGDOWN for test in tests):
        if len(tests) > 1 or order is not None:
            raise InputError(f"identify: a measurement of kind {RINGDOWN!r} stands alone, without orders of a surface")
        decays = identify_ringdown(tests[0], kinds or None, first).fit
        if decays is None:
            raise InputError(
                "identify: expected either laws or a start joint; `ringdown` tells a decay without a joint"
            )
        if path is not None:
            write_joint(path, decays.joint)
        return decays
    named = {} if path is None else {"joint_file": str(path)}
    found = fitted(tests, laws=kinds or None, start=first, order=_orders(order), **named)
    if path is not None:
        write_joint(path, found.joint)
    return found


def cutting_forces(measurement: Measurement | File, *, output: File | None = None) -> CuttingForces:
    """Coefficients of cutting forces from dynamometer records, what ``jointlib identify`` does with such a measurement.

    Parameters
    ----------
    measurement
        A measurement of kind ``cutting-force`` or its file.
    output
        The cutting file to write, which ``file`` in the ``[cutting]`` of a machine can name.
    """
    path, test = given_target(output), measurement_of(measurement)
    if test.kind != FORCES:
        raise InputError(f"{test.source}: kind is {test.kind!r}, expected {FORCES!r} to tell coefficients of a cut")
    found = identify_cutting(test)
    if path is not None:
        write_cutting_file(path, found.coefficients)
    return found


def ringdown(
    measurement: Measurement | File,
    *,
    laws: Sequence[str] | None = None,
    start: Joint | File | None = None,
    output: File | None = None,
) -> Ringdown:
    """Frequency and damping over amplitude from free decays, what ``jointlib identify`` does with such a measurement.

    Parameters
    ----------
    measurement
        A measurement of kind ``ringdown`` or its file.
    laws, start
        Kinds of laws, or a joint that gives them with first values, to be fitted to the decay; the measurement then
        tells the ``modal_mass``.
    output
        The joint file to write; without laws the table over amplitude, a .csv file.
    """
    path, kinds = given_target(output), [laws] if isinstance(laws, str) else laws
    found = identify_ringdown(measurement_of(measurement), kinds or None, None if start is None else joint_of(start))
    if path is not None and found.fit is not None:
        write_joint(path, found.fit.joint)
    elif path is not None:
        write_backbones(path, found)
    return found


def _orders(order: tuple[int, int] | str | None) -> tuple[int, int] | None:
    if not isinstance(order, str):
        return order
    parts = order.split(",")
    if len(parts) != 2 or not all(p.strip().isascii() and p.strip().isdigit() for p in parts):
        raise InputError(f"--order: {order!r}, expected two whole numbers i,j")
    return int(parts[0]), int(parts[1])
