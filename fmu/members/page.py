"""The page inside an FMU that a colleague can read: what it is, its joints in pictures and numbers, how good it is."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.modulation import CONDITIONS
from jointlib.units import rounded

from ..system.step_limit import operating_range
from ..system.system import Signal, System
from .description import VALIDITY_UNITS

_WIDE, _HIGH, _EDGE = 380, 250, 58
_MOST_JOINTS = 12
"""Pictures beyond that many would make a long page, not a better one."""
_HEAD = """<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title>
<style>body{{font-family:sans-serif;max-width:52em;margin:2em auto;padding:0 1em}} table{{border-collapse:collapse}}
td,th{{border:1px solid #bbb;padding:.2em .6em;text-align:left}} svg{{max-width:100%}}</style></head>
<body>
"""


def documentation_text(system: System, messages: tuple[str, ...], figures: Sequence[tuple[str, str]] = ()) -> str:
    """The page that an importer shows; ``figures`` are what the export measured, as rows of a table."""
    lone = system.lone
    title = html.escape(f"Joint {lone.name}: {', '.join(law.kind for law in lone.laws)}" if lone else system.title)
    lines = [f"<h1>{title}</h1>", *(f"<p>{html.escape(text)}</p>" for text in messages)]
    if figures:
        lines += ["<h2>What it takes and how good it is</h2>", _table(("", ""), figures)]
    signals = [(s.name, kind, s.unit, s.description) for kind, of in _sides(system) for s in of]
    lines += ["<h2>Inputs and outputs</h2>", _table(("name", "kind", "unit", "what it is"), signals)]
    for prefix, joint in system.joints[:_MOST_JOINTS]:
        lines += _joint(prefix, joint, system)
    if left := len(system.joints) - _MOST_JOINTS:
        lines += [f"<p>{left} more joints are described by their variables only.</p>"] if left > 0 else []
    return _HEAD.format(title=title) + "\n".join(lines) + "\n</body>\n</html>\n"


def _sides(system: System) -> tuple[tuple[str, Sequence[Signal]], ...]:
    return ("input", system.inputs), ("output", system.outputs)


def _joint(prefix: str, joint: Joint, system: System) -> list[str]:
    """Pictures of one joint, its parameters with their errors, where it holds and where it comes from."""
    lines = [f"<h2>{html.escape(f'Joint {prefix}' if prefix else 'The joint')}</h2>"]
    if joint.laws and all(law.in_time for law in joint.laws):
        turns = prefix in system.turning
        lines += [_force_picture(joint, turns), _gain_picture(joint, turns)]
    columns = joint.columns()
    rows = []
    for name, value, unit, error, fixed in zip(*(columns[key][0] for key in columns), strict=True):
        told, known = rounded(value, error, 6)
        known = known or ("assumed" if fixed else "no error known")
        rows.append((str(name), told, system.unit(prefix, str(unit)), known))
    lines.append(_table(("parameter", "value", "unit", "standard error"), rows))
    for m in joint.modulations:
        points = "; ".join(f"{x:.6g} {CONDITIONS[m.condition]}: {y:.6g}" for x, y in m.table)
        late = f", with a lag of {m.lag:g} s" if m.lag else ""
        lines.append(f"<p>Its {m.role.value} times a factor that follows the {m.condition}{late}: {points}.</p>")
    for quantity, (low, high) in joint.validity.items():
        unit = system.unit(prefix, VALIDITY_UNITS.get(quantity, ""))
        lines.append(f"<p>Valid for {html.escape(quantity)} from {low:.4g} to {high:.4g} {unit}.</p>")
    if not joint.validity:
        lines.append("<p>The joint states no range in which it holds.</p>")
    if joint.provenance:
        lines.append(_table(("provenance", ""), [(str(k), _in_words(v)) for k, v in joint.provenance.items()]))
    return lines


def _in_words(value: object) -> str:
    """An entry of the provenance: a file by its name and the beginning of its hash, lists as their parts."""
    if isinstance(value, Mapping):
        return " ".join(str(v)[:12] if k == "sha256" else _in_words(v) for k, v in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_in_words, value))
    return ("yes" if value else "no") if isinstance(value, bool) else str(value)


def _force_picture(joint: Joint, turns: bool) -> str:
    """Force over displacement along slow harmonic motions of three sizes, the last cycle of each.

    Of a joint that ``turns``, moment over angle.
    """
    over = operating_range(joint)
    angle, curves = np.linspace(0, 4 * np.pi, 401), []
    for part in (0.25, 0.5, 1.0):
        z, v = part * over.amplitude * np.sin(angle), part * 1e-3 * over.velocity * np.cos(angle)
        force = joint.force_along(z, v, 1e-3)
        curves.append((z[200:] * 1e6, force[200:]))
    if turns:
        return _picture(curves, "angle, µrad", "moment, N m", "Moment along slow cycles")
    return _picture(curves, "displacement, µm", "force, N", "Force along slow cycles")


def _gain_picture(joint: Joint, turns: bool) -> str:
    """Equivalent stiffness over the amplitude at the middle of its band."""
    over = operating_range(joint)
    low, high = joint.validity.get("frequency", (100.0, 100.0))
    at = float(np.sqrt(max(low, high / 100) * high))
    A = np.linspace(over.amplitude / 100, over.amplitude, 80)
    gain = joint.first_harmonic(A, 2 * np.pi * at).gain
    curves = [(A * 1e6, gain.real * 1e-6), (A * 1e6, gain.imag * 1e-6)]
    head = f"Describing function at {at:.4g} Hz: real part, imaginary part dashed"
    length, stiffness = ("µrad", "N m/µrad") if turns else ("µm", "N/µm")
    return _picture(curves, f"amplitude, {length}", stiffness, head, dashed=1)


def _picture(
    curves: Sequence[tuple[Array, Array]], below: str, beside: str, head: str, dashed: int | None = None
) -> str:
    """Curves in a frame as SVG, with the ends of the axes in numbers."""
    x, y = (np.concatenate([c[i] for c in curves]) for i in (0, 1))
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(y))):
        return "<p>The picture has no finite values.</p>"
    ends = [(float(np.min(a)), float(np.max(a))) for a in (x, y)]
    (x0, x1), (y0, y1) = ((low, high if high > low else low + 1.0) for low, high in ends)

    def placed(a: Array, b: Array) -> str:
        u = _EDGE + (a - x0) / (x1 - x0) * (_WIDE - 2 * _EDGE)
        w = _HIGH - _EDGE - (b - y0) / (y1 - y0) * (_HIGH - 2 * _EDGE)
        return " ".join(f"{p:.1f},{q:.1f}" for p, q in zip(u, w, strict=True))

    lines = [
        f'<polyline points="{placed(a, b)}" fill="none" stroke="#1f5ea8" stroke-width="1.5"'
        + (' stroke-dasharray="4 3"/>' if i == dashed else "/>")
        for i, (a, b) in enumerate(curves)
    ]
    box = f'x="{_EDGE}" y="{_EDGE}" width="{_WIDE - 2 * _EDGE}" height="{_HIGH - 2 * _EDGE}"'
    frame = f'<rect {box} fill="none" stroke="#888"/>'
    words = [
        (_EDGE, _HIGH - _EDGE + 14, "middle", f"{x0:.3g}"),
        (_WIDE - _EDGE, _HIGH - _EDGE + 14, "middle", f"{x1:.3g}"),
        (_WIDE / 2, _HIGH - 12, "middle", below),
        (_EDGE - 4, _HIGH - _EDGE, "end", f"{y0:.3g}"),
        (_EDGE - 4, _EDGE + 8, "end", f"{y1:.3g}"),
        (_EDGE, _EDGE - 8, "start", beside),
        (_EDGE, 16, "start", head),
    ]
    said = [
        f'<text x="{u:g}" y="{w:g}" text-anchor="{where}">{html.escape(text)}</text>' for u, w, where, text in words
    ]
    drawn = "".join([frame, *lines, *said])
    return f'<svg viewBox="0 0 {_WIDE} {_HIGH}" width="{_WIDE}" font-size="10">{drawn}</svg>'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    first = [row(head, "th")] if any(head) else []
    return "<table>" + "".join([*first, *(row(cells, "td") for cells in rows)]) + "</table>"
