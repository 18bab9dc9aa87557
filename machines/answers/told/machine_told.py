"""What ``jointlib inspect`` says of a machine: parts, joints, stiffness, modes, and what looks wrong in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jointlib.shown.text import table

if TYPE_CHECKING:
    from ...mistakes.elements import Element
    from ...model.machine import Machine
    from ...modes.natural_modes import NaturalModes

_ROWS = 12
"""Connections up to which each has a line of its own."""
_MODES = 10
_SHOWN = {"N/m^2": ("N/mm^2", 1e-6), "m": ("mm", 1e3), "rad": ("deg", 57.29577951308232), "1": ("", 1.0)}


def told(machine: Machine, contacts: bool, further: Sequence[str] = ()) -> tuple[list[str], list[str]]:
    """The lines, and those of them that name what looks wrong; ``contacts`` has a line for every connection.

    ``further`` is what looks wrong with it beside.
    """
    import numpy as np

    from ...mistakes import may_be_solved, mistakes
    from ...mistakes.materials import oversized

    each = contacts or len(machine.connections) <= _ROWS
    known = all(c.joint is not None for c in machine.flexible)
    lines = [f"machine {machine.name!r}: {len(machine.components)} components, {len(machine.connections)} connections"]
    wrong: list[str] = []
    modes = None
    # Values far out of range overflow here; what comes of it is told as a mistake.
    with np.errstate(all="ignore"):
        if may_be_solved(machine):
            modes = _modes(machine)
        if known:
            wrong = list(mistakes(machine, modes))
    wrong += further
    lines += [f"looks wrong: {sentence}" for sentence in wrong]
    lines += _parts(machine)
    if oversized(machine):
        return lines, wrong
    lines += machine.remarks()
    lines += _connections(machine) if each else _summary(machine)
    lines += [axis.words() for axis in machine.axes]
    lines += [f"tool {axis}: {dof}" for axis, dof in machine.tool.items()]
    if machine.cutting:
        lines.append("cutting: " + ", ".join(_cut(machine.cutting)))
    if known:
        lines += _under_load(machine, each, wrong)
        lines += _stiffness(machine)
    if modes is not None:
        lines += _first_modes(modes)
    return lines, wrong


def _cut(cutting: Mapping[str, Any]) -> Iterator[str]:
    """What the cut is, each key with its unit."""
    from ...files.cutting_table import CUTTING_UNITS

    units = {**CUTTING_UNITS, "speed": "rpm", "pitch": "deg", "helix": "deg", "runout": "m"}
    for key, value in cutting.items():
        unit, factor = _SHOWN.get(units.get(key, ""), (units.get(key, ""), 1.0))
        if key == "covariance":
            continue
        if isinstance(value, str) or key not in units:
            yield f"{key} = {value}"
        elif isinstance(value, Sequence):
            yield f"{key} = {' '.join(f'{one * factor:.6g}' for one in value)} {unit}"
        else:
            yield f"{key} = {value * factor:.6g} {unit}".rstrip()


def _modes(machine: Machine) -> NaturalModes | None:
    """None where they cannot be computed, which is then among the mistakes."""
    import numpy as np

    from jointlib.errors import InputError

    from ...modes.natural_modes import natural_modes

    try:
        return natural_modes(machine)
    except (InputError, np.linalg.LinAlgError, ValueError):
        return None


def _parts(machine: Machine) -> list[str]:
    from ...model.masses import part_masses, whole_mass

    lines = []
    parts = part_masses(machine)
    for component, part in zip(machine.components, parts, strict=True):
        mass = "" if part.mass is None else f", {part.mass:.4g} kg"
        at = "" if part.centre is None else f" at ({_point(part.centre)}) m"
        dofs = ", ".join(component.dofs) if len(component.dofs) <= 6 else f"{len(component.dofs)} degrees of freedom"
        lines.append(f"component {component.name}: {type(component).kind}{mass}{at}, {dofs}")
    whole = whole_mass(parts)
    if whole.mass is not None and len(parts) > 1:
        unknown = [p.name for p in parts if p.mass is None]
        at = "" if whole.centre is None else f", centre of gravity at ({_point(whole.centre)}) m"
        lines.append(f"whole: {whole.mass:.4g} kg{at}" + (f" (without {', '.join(unknown)})" if unknown else ""))
    return lines


def _point(vector: Any) -> str:
    return ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in vector)


def _what(connection: Any) -> str:
    joint = " + ".join(law.kind for law in connection.joint.laws) if connection.joint else ""
    return joint or ("rigid" if connection.rigid else "to be identified from its records")


def _connections(machine: Machine) -> list[str]:
    return [f"connection {c.name}: {' – '.join(c.between)}, {_what(c)}" for c in machine.connections]


def _summary(machine: Machine) -> list[str]:
    """Connections by bundle; those outside any bundle by what they join and by what."""
    from ...model.joint_places import element_names

    groups: dict[tuple[str, ...], list[str]] = {}
    for c, element in zip(machine.connections, element_names(machine.connections), strict=True):
        bundle = c.bundle or (element if c.joint is not None and element != c.name else "")
        sides = tuple(side.partition(".")[0] for side in c.between)
        groups.setdefault((bundle, " – ".join(sides), _what(c)), []).append(c.name)
    lines = []
    for (bundle, between, what), names in groups.items():
        name = bundle or (names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}")
        count = f", {len(names)} contacts" if len(names) > 1 else ""
        lines.append(f"connection {name}: {between}, {what}{count}")
    return [*lines, "(--contacts: every connection on a line of its own)"]


def _under_load(machine: Machine, each: bool, wrong: Sequence[str]) -> list[str]:
    import numpy as np

    from jointlib.errors import InputError

    from ...bundles.bundle import said_by
    from ...model.joint_places import bundles
    from ...statics.statics import UNHELD, static_point

    lines = list(said_by(machine.joints()))
    if machine.static is None:
        return lines
    try:
        point = static_point(machine)
    except InputError as error:  # what is wrong with the load stands among the mistakes, and this beside it
        said = str(error).removeprefix(f"{machine.where}: ")
        follows = wrong and said.startswith(UNHELD)  # a mistake that explains it is named
        return lines if follows else [*lines, said]
    groups: Mapping[str, Any] = bundles(machine.flexible)
    if each:
        groups = {name: [i] for i, name in enumerate(point.connections)}
    force = np.where(np.abs(point.force) > 1e-12 * np.max(np.abs(point.force), initial=0.0), point.force, 0.0)
    turned = [name for name, members in groups.items() if machine.flexible[members[0]].rotates]
    for header, names in (
        (("under static load", "at [um]", "force [N]"), [name for name in groups if name not in turned]),
        (("turned by the load", "at [urad]", "moment [N m]"), turned),
    ):
        rows = [
            (name, _span(1e6 * point.displacement[groups[name]], "{:.4f}"), _span(force[groups[name]], "{:.4g}"))
            for name in names
        ]
        lines += table(header, rows) if rows else []
    return [*lines, *point.warnings]


def _span(values: Any, form: str) -> str:
    """The least and the largest of several numbers, or the only one; what rounding leaves of 0 is 0."""
    ends = [form.format(x) for x in (values.min(), values.max())]
    ends = [form.format(0.0) if float(end) == 0 else end for end in ends]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _stiffness(machine: Machine) -> list[str]:
    """Stiffness of every bundle, and of what else joins two parts, in six directions."""
    from ...mistakes.elements import elements

    rows: list[Sequence[str]] = []
    alone: dict[tuple[str, str], list[Element]] = {}
    every = elements(machine, by_place=False)
    for e in every:
        if e.kind and e.at is not None:
            rows.append((e.name, *_six(e.six)))
        elif e.at is not None:
            alone.setdefault(e.words, []).append(e)
    for sides, members in alone.items():
        name = " – ".join(sides) if len(members) > 1 else members[0].name
        rows.append((name, *_six(_together(members).six)))
    lines = table(("stiffness [N/um, kN m/rad]", "x", "y", "z", "rx", "ry", "rz"), rows) if rows else []
    for header, turns, factor in (
        (("stiffness along itself", "[N/um]"), False, 1e-6),
        (("stiffness of a rotation", "[kN m/rad]"), True, 1e-3),
    ):
        plain = [
            (e.name, f"{float(e.stiffness.sum()) * factor:.4g}")
            for e in every
            if e.at is None and machine.flexible[e.rows[0]].rotates == turns
        ]
        lines += table(header, plain) if plain else []
    return lines


def _together(members: list[Element]) -> Element:
    import numpy as np

    from ...mistakes.elements import Element

    first = members[0]
    stacked = [np.concatenate([getattr(e, key) for e in members]) for key in ("rows", "at", "direction")]
    held = [np.concatenate([getattr(e, key) for e in members]) for key in ("stiffness", "damping")]
    return Element(first.name, first.kind, first.sides, first.words, *stacked, *held)


def _six(values: Any) -> list[str]:
    # What rounding leaves: of its own kind, and of a rotation where a lever arm would be a micrometre.
    least = 1e-12 * max(abs(values[:3]).max(), 1e-300)
    floor = 1e-9 * max(abs(values[:3]).max(), 1e-300), max(1e-9 * abs(values[3:]).max(), least)
    shown = [v if abs(v) > floor[i // 3] else 0.0 for i, v in enumerate(values)]
    return [f"{v * 1e-6:.4g}" for v in shown[:3]] + [f"{v * 1e-3:.4g}" for v in shown[3:]]


def _first_modes(modes: NaturalModes) -> list[str]:
    from ...modes.mode_energy import mode_energies
    from ...modes.mode_words import holders, largest, movers

    energies = mode_energies(modes)
    rows = [
        (
            f"{modes.frequency[i]:.5g}",
            f"{100 * modes.damping_ratio[i]:.3g}",
            largest(movers(modes, energies, i)),
            largest(holders(modes, energies, i)),
        )
        for i in range(min(_MODES, len(modes.pole)))
    ]
    free = modes.free.shape[1]
    lines = [f"{free} free motion{'s' if free > 1 else ''}, which nothing holds"] if free else []
    return lines + (table(("mode [Hz]", "damping [%]", "what moves", "what bends"), rows) if rows else [])
