"""No chart says that there is no chatter where a second method finds it: random machines and wrong turns from them.

The second method shares the mean stiffness of the cut and no search: receptances of the assembled matrices, joints by
the spring and damper that their describing function is near rest, on lines round every natural frequency they have,
whatever band a file asks for.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from random_machines import mutations, random_machine
from scipy.linalg import eigh

from jointlib.describing import DescribingFunction
from jointlib.errors import CheckFailed, InputError
from machines import Cutting, Machine, lobes_at_amplitude
from machines.coupling.second_order import machine_equations

_ROUND = np.concatenate([-np.geomspace(1e-4, 0.3, 12)[::-1], [0.0], np.geomspace(1e-4, 0.3, 12)])
"""Of a natural frequency: lines at which its mode is looked at, for damping ratios down to 1e-4."""

_SMALL = 60
"""Contacts of a machine up to which its exact chart is asked for too; the larger ones take their preview."""


@dataclass(frozen=True)
class Chatter:
    """The lowest depth in m of chatter over all speeds, at a frequency in Hz, and a speed in rpm at which it has it."""

    depth: float
    frequency: float
    speed: float


def lowest_chatter(machine: Machine) -> Chatter | None:
    """b = −1/(2 Re λ), λ the eigenvalues of D·G, over every mode of the machine; None where Re λ is never negative."""
    assert machine.cutting is not None
    cutting, model = Cutting(**machine.cutting), machine_equations(machine)

    gains = np.array([DescribingFunction(j)(1e-12, 1.0) for j in machine.joints()])
    model_K = model.stiffness + model.joints.T @ (gains.real[:, None] * model.joints)
    model_C = model.damping + model.joints.T @ (gains.imag[:, None] * model.joints)
    squared, shapes = eigh(model_K, model.mass)
    natural = np.sqrt(np.maximum(squared, 0)) / (2 * np.pi)
    lines = np.unique(np.outer(natural[natural > 0.1], 1 + _ROUND))
    rows = machine.dof_rows(machine.tool_dofs, "tool")
    if cutting.process != "milling":
        n = np.array([np.cos(cutting.feed_direction), np.sin(cutting.feed_direction)])
        rows = np.array([sum(n["xy".index(a)] * row for a, row in zip(machine.tool_axes, rows, strict=True))])
        D = np.array([[cutting.specific]])
    else:
        held = ["xy".index(axis) for axis in machine.tool_axes]
        D = cutting.mean_stiffness[np.ix_(held, held)]
    P, C = rows @ model.shapes @ shapes, shapes.T @ model_C @ shapes
    loop = np.empty((len(lines), len(D)), dtype=complex)
    for part in np.array_split(np.arange(len(lines)), 1 + len(lines) * len(C) ** 2 // 2**20):
        w = 2 * np.pi * lines[part, None, None]
        dynamic = np.diag(squared) - w**2 * np.eye(len(C)) + 1j * w * C
        loop[part] = np.linalg.eigvals(D @ (P @ np.linalg.solve(dynamic, P.T.astype(complex))))
    real = loop.real
    line, which = np.unravel_index(int(np.argmin(real)), real.shape)
    value = loop[line, which]
    if not value.real < 0:
        return None
    wave = 0.5 + np.angle(-value) / np.pi
    low, high = cutting.speed or (1000.0, 20000.0)
    speeds = [60 * lines[line] / (k + wave) / cutting.cuts_per_revolution for k in range(400)]
    within = [speed for speed in speeds if low <= speed <= high]
    return Chatter(float(-1 / (2 * value.real)), float(lines[line]), within[0] if within else speeds[0])


def charted(count: int) -> Iterator[tuple[str, Machine]]:
    """Random machines, each followed by its mutations, until there are so many."""
    made = (
        (f"{seed} {name}", machine)
        for seed in itertools.count()
        for base in [random_machine(seed)]
        for name, machine in [("as it is", base), *mutations(base, seed)]
    )
    return itertools.islice(made, count)


def failing(count: int) -> tuple[int, list[str]]:
    """How many charts were judged, and a line for each that says there is no chatter where there is."""
    judged, wrong = 0, []
    for name, machine in charted(count):
        assert machine.cutting is not None
        try:
            other = lowest_chatter(machine)
        except (InputError, np.linalg.LinAlgError):
            continue
        if other is None:
            continue
        turning = machine.cutting["process"] == "turning"
        small = len(machine.flexible) <= _SMALL
        methods = ["turning"] if turning else ["zero-order", None] if small else ["zero-order"]
        for method in methods:
            try:
                chart = lobes_at_amplitude(machine, np.array([other.speed]), 0.0, method)
            except (CheckFailed, InputError):
                continue  # refused in a sentence: nothing is said to be stable
            judged += 1
            said = f"{name}, {method}: {chart.depth[0]:g} m at {other.speed:.6g} rpm, lowest {chart.minimum_depth:g} m"
            found = f"second method {other.depth:g} m at {other.frequency:.6g} Hz"
            if method is None:  # zero order is not exact in milling: only what is said to be unbounded is wrong
                late = not np.isfinite(chart.depth[0]) or chart.depth[0] > 100 * other.depth
            else:
                late = not chart.minimum_depth <= 1.02 * other.depth + 1e-12  # a picometre is no depth
            if late:
                wrong.append(f"{said}; {found}")
    return judged, wrong


@pytest.mark.thorough
def test_no_chart_of_random_machines_and_mutations_misses_chatter_that_a_second_method_finds() -> None:
    judged, wrong = failing(6)
    assert judged >= 8
    assert wrong == []


@pytest.mark.slow
def test_no_chart_of_five_thousand_misses_chatter_that_a_second_method_finds() -> None:
    judged, wrong = failing(int(os.environ.get("JOINTLIB_CHARTS", "4200")))
    assert judged >= 5000 or "JOINTLIB_CHARTS" in os.environ
    assert wrong == []
