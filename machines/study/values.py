"""Every value of a study put into its machine once, so that what does not fit is said before hours are spent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint

from ..model.joint_places import changed_joints, joint_units
from .factors import IDENTIFICATION
from .sampling import plan
from .settings import setting
from .study import Study
from .variants import Machines, with_joints

_MOST = 300
"""Configurations that are looked at."""


def check_values(study: Study, joints: Mapping[str, Joint]) -> None:
    """Refuse, in a sentence, a value that a machine cannot take: of lists each, of ranges the ends that are planned.

    They are tried in configurations of the plan, of a search in those of its first generation; ``joints`` are those
    that the base machine leaves to be identified. Nothing is computed but the machine itself.
    """
    if study.searched:
        study = replace(study, found=plan(study.design, "latin-hypercube", study.population, study.seed))
    numbers = study.numbers()
    looked = dict.fromkeys([0])
    for i, factor in enumerate(study.factors):
        if factor.path == IDENTIFICATION:
            continue
        column = numbers[:, i]
        ends = np.array([np.argmin(column), np.argmax(column)])
        for row in np.unique(column, return_index=True)[1] if factor.choices else ends:
            looked[int(row)] = None
    machines = Machines(dict(joints))
    places = joint_units(machines.of(study.base, study.with_tools[0]).machine, (f.path for f in study.factors))
    for row in list(looked)[:_MOST]:
        try:
            of = setting(study, numbers[row], study.case(row), places)
            machine = machines.of(of.file, of.document).machine
            with_joints(machine, changed_joints(machine, of.joints))
            if machine.cutting is not None:
                machines.cut(of)
        except InputError as error:
            told = zip(study.factors, numbers[row], strict=True)
            words = [f"{f.name} {f.words(float(n))}" for f, n in told if f.path != IDENTIFICATION]
            said = str(error).removeprefix(f"{study.source}: ")
            raise InputError(f"{study.source}: with {', '.join(words)}: {said}") from None
