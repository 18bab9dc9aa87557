"""Stiffness and damping of joints that no machine element has, and signs that are the wrong way round."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.arrays import Array
from jointlib.laws.gap import Gap

from ..components.connection import GROUND
from ..model.machine import Machine
from .elements import Element
from .preloads import wrong_preload
from .scale import outside

_STIFFNESS = {
    "linear-guide": (1e7, 3e10),
    "ball-screw": (4e6, 1e10),
    "bearing-pair": (5e6, 3e10),
    "bolted-face": (5e7, 1e14),
    "taper": (5e7, 1e14),
}
"""N/m in the stiffest direction. Makers' catalogues give carriages 20 (miniature) to 5000 N/µm (rollers, size 65 and
more), nuts and screws 10 to 3000, pairs of angular-contact bearings 20 to 3000; faces have contact stiffnesses of 10¹¹
to 10¹³ N/m³ (Back, Burdekin, Cowley, Proc. 13th MTDR, 1973)."""
_WORD = {"linear-guide": "a carriage", "ball-screw": "a ball screw", "bearing-pair": "a pair of bearings"}
_GROUNDED = (2e4, 1e13)
_BETWEEN = (2e6, 1e13)
"""N/m of a connection to the ground, which may be an air spring, and of one between two parts of a machine: the softest
of those, a belt or a miniature nut, has some N/µm."""
_DAMPED = 3.0
"""Damping force over elastic force at 100 Hz; guides and bearings have 0.005 to 0.1."""
_SLIGHTLY, _PLAIN = 1e-4, 2e-5
"""The least of it that guides, screws and bearings have, and other connections; faces are far stiffer than that."""
_PLAY = 5e-4
"""m of clearance of a joint; guides and nuts have none or up to 0.05 mm, worn ones 0.2 mm."""
_ONE_WAY = 0.01
_NAMED = 4
"""Of elements that the same is wrong with."""
_NOTHING = 1e-9


def wrong_contacts(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    """Elements out of scale, with signs reversed, or that do not hold what their kind holds; what is wrong with several
    of them alike, as carriages of one bundle, is told once."""
    alike: dict[str, list[str]] = {}
    for sentence in _each(machine, found):
        name, _, said = sentence.partition(": ")
        alike.setdefault(said, []).append(name)
    for said, names in alike.items():
        shown = names if len(names) <= _NAMED else [*names[: _NAMED - 1], f"{len(names) - _NAMED + 1} more"]
        yield f"{' and '.join(filter(None, [', '.join(shown[:-1]), shown[-1]]))}: {said}"


def _each(machine: Machine, found: Sequence[Element]) -> Iterator[str]:
    for element in found:
        K, C = element.stiffness, element.damping
        negative = K + _NOTHING * np.max(np.abs(K), initial=0.0) < 0
        if np.any(negative):
            yield (
                f"{element.name}: its stiffness is {np.min(K) * 1e-6:.4g} N/um, so it pushes on "
                "what moves "
                "away; expected more than 0: is its sign right?"
            )
            continue
        if np.any(C + _NOTHING * np.max(np.abs(C), initial=0.0) < 0):
            yield f"{element.name}: its damping is {np.min(C):.4g} N s/m, so it yields energy; expected 0 or more"
        wrong = [*_of_kind(element)] if element.kind else []
        yield from wrong
        if not wrong:  # else what follows from it would be said as well
            yield from wrong_preload(machine, element)
            yield from _damped(element)
    yield from _plain([e for e in found if not e.kind])
    yield from _wide(machine)


def _damped(element: Element) -> Iterator[str]:
    """Damping that holds more than the stiffness, or next to nothing."""
    K, omega_C = element.stiffness, 2 * np.pi * 100.0 * element.damping
    stiff, slow = float(np.sum(K)), float(np.sum(omega_C))
    least = _SLIGHTLY if element.kind in _WORD else 0.0 if element.kind else _PLAIN
    if np.any((omega_C > _DAMPED * K) & (K > 0)):
        worst = int(np.argmax(np.where(K > 0, omega_C / np.where(K > 0, K, 1.0), 0.0)))
        C, holds = element.damping[worst], f"{omega_C[worst] / K[worst]:.3g} times as much as its stiffness"
    elif 0 < slow < least * stiff:
        C, holds = float(np.sum(element.damping)), f"{slow / stiff:.2g} of what its stiffness holds"
    else:
        return
    yield (
        f"{element.name}: at 100 Hz its damping, {C:.4g} N s/m, holds {holds}; joints have 0.005 to 0.1 of it: is its "
        "unit right?"
    )


def _of_kind(element: Element) -> Iterator[str]:
    """A bundle: the stiffest direction out of scale, a guide that carries nothing across its travel."""
    low, high = _STIFFNESS.get(element.kind, (0.0, np.inf))
    if element.direction is None:
        value, across = float(np.sum(element.stiffness)), np.inf
        along = np.zeros(3)
    else:
        values, vectors = np.linalg.eigh(element.holds)
        value, across, along = float(values[-1]), float(values[1]), vectors[:, 1]
    what = f"{element.name}: the stiffness of {_WORD.get(element.kind, f'a {element.kind}')}"
    said = outside(value, low, high, what, "N/um", 1e-6)
    if said:
        yield said
    elif element.kind == "linear-guide" and across < _ONE_WAY * value:
        yield (
            f"{element.name}: it carries {across / value * 100:.2g} % of its stiffness along {words(along)}, "
            "next to nothing "
            "across its travel: is its contact_angle right?"
        )


def _plain(found: Sequence[Element]) -> Iterator[str]:
    """Connections of their own; of many between two parts each may be as much softer."""
    for element in found:
        if any(word.rpartition(".")[2].lstrip("u") in ("rx", "ry", "rz") for word in element.words if "." in word):
            continue
        K = float(element.stiffness[0])
        if K <= 0:
            continue
        many = sum(other.words == element.words for other in found)
        low, high = _GROUNDED if GROUND in element.sides else _BETWEEN
        said = outside(K, low / many, high, f"{element.name}: its stiffness", "N/um", 1e-6)
        if said:
            yield said


def _wide(machine: Machine) -> Iterator[str]:
    """Play between two parts that could be seen; towards the ground it may be a stop."""
    for connection in machine.flexible:
        laws = () if connection.joint is None or GROUND in connection.between else connection.joint.laws
        if connection.rotates:
            continue
        for law in laws:
            if isinstance(law, Gap) and law.clearance > _PLAY:
                yield (
                    f"{connection.name}: its {law.kind} has a clearance of {law.clearance * 1e3:.4g} mm, expected "
                    f"micrometres, at most {_PLAY * 1e3:g} mm: is its unit right?"
                )


def words(vector: Array) -> str:
    """A direction, its largest part positive: ``(0, 0, 1)``."""
    v = vector * np.sign(vector[int(np.argmax(np.abs(vector)))])
    return "(" + ", ".join(f"{round(float(x), 3) + 0.0:g}" for x in v) + ")"
