"""Designs of a finished study side by side: their results, the machine that each is, its receptance and its lobes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint

from ...compare.machine_side import receptances
from ...compare.sides import Fact, Limits, Side
from ...cutting.amplitude.frozen_lobes import lobes_at_amplitude
from ...cutting.rest.together import preview
from ...model.joint_places import changed_joints
from ...model.machine import Machine
from .. import words
from ..evaluation import Evaluation
from ..run import begin, planned
from ..study import QUANTITIES, Study
from ..variants import Machines, with_joints
from .best import worst_setting
from .verdict import Ranking, design_of, judge, over_samples


def design_sides(study: Study, results: Path, designs: Sequence[int], joints: Mapping[str, Joint]) -> tuple[Side, ...]:
    """Some designs of a study by number, by default the best and the second; ``results`` is the folder of its run.

    Of what is uncertain the results are those over the samples, which all designs have in common; receptance and
    lobes are those of the machine in its worst condition with what is uncertain at its median, as `write_best` writes
    it. ``joints`` are those that the base machine leaves to be identified.
    """
    store = begin(study, results)
    if missing := len(store.missing()):
        raise InputError(f"{results}: {missing} of {store.blocks} blocks are still to do, see `jointlib study resume`")
    study = planned(study, results)
    verdict = judge(study, store.results())
    chosen = list(designs) or [design.number for design in verdict.leading[:2]]
    if len(chosen) < 2:
        raise InputError(f"{results}: {verdict.feasible} of its designs meet the constraints, name two by --designs")
    for number in chosen:
        if not 0 <= number < len(verdict.ranking.numbers):
            raise InputError(f"--designs: {number}, expected numbers from 0 to {len(verdict.ranking.numbers) - 1}")
    evaluate = Evaluation(study.source.resolve(), tuple(sorted(joints.items())), tools=study.asked_tools)
    return tuple(_side(study, evaluate, verdict.ranking, number, joints) for number in chosen)


def _side(study: Study, evaluate: Evaluation, ranking: Ranking, number: int, joints: Mapping[str, Joint]) -> Side:
    design = design_of(study, ranking, number)
    name = f"design {number} ({', '.join(f'{factor} {value}' for factor, value in design.factors.items())})"
    facts = {}
    for quantity, values in ranking.worst.items():
        told = float(over_samples(study, quantity, values[number]))
        facts[words.named(quantity)] = Fact(told, QUANTITIES[quantity][0], samples=values[number])
    setting, case, _ = worst_setting(study, evaluate, ranking, number)
    found = Machines(joints).of(setting.file, (*setting.document, *setting.cutting)).machine
    machine = with_joints(found, changed_joints(found, setting.joints)) if setting.joints else found
    remarks = (f"{name}: curves are those at its worst condition, {case.name}.",) if case.name else ()
    try:
        limits = _limits(study, machine)
    except (CheckFailed, InputError) as refused:
        limits, remarks = None, (*remarks, f"{name}: no lobes: {refused}")
    return Side(name, "design", facts, receptances(machine), remarks, limits)


def _limits(study: Study, machine: Machine) -> Limits | None:
    """The lowest limit over the amplitudes of the study, by its method; None without a cut."""
    cutting = machine.cutting
    if cutting is None or not (len(study.speeds) or cutting.get("speed")):
        return None
    speeds = study.speeds
    if not len(speeds):
        low, high = cutting["speed"]
        speeds = np.linspace(low, high, study.speed_count)
    machine = replace(machine, cutting={**cutting, "speed": (float(speeds[0]), float(speeds[-1]))})
    method = study.lobes or preview(cutting["process"])
    charts = [lobes_at_amplitude(machine, speeds, A, method) for A in study.amplitudes]
    lowest, rows = np.argmin([chart.depth for chart in charts], axis=0), np.arange(len(speeds))
    depth, frequency = np.array([c.depth for c in charts]), np.array([c.chatter_frequency for c in charts])
    return Limits(speeds, depth[lowest, rows], frequency[lowest, rows])
