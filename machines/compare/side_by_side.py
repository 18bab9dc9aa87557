"""Two of a kind side by side: machines, joints, measured frequency responses, runs; see also `study.design_sides`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib import read_joint, read_measurement
from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, reason
from jointlib.joint import Joint

from ..files.opened import machine_of
from ..loop.records import open_frfs
from ..model.machine import Machine
from ..model.named_files import read
from .comparison import paired, share
from .computed_peaks import matched
from .machine_side import of_machine
from .measured_peaks import Resonance, at_the_peaks, resonances
from .sides import Curve, Fact, Side

_SURE = 2.0
"""Standard errors of a difference below which it is none."""
_SAME, _LITTLE = 1e-6, 1e-3
"""Share by which numbers must differ: those that stand in a file or have an error, and computed ones without one."""
_READ = {"m": (1e3, "mm"), "m/N": (1e6, "um/N"), "m^3/s": (60e6, "cm³/min")}
_PARTLY = ", as far as it was looked for"


@dataclass(frozen=True)
class Difference:
    """One number on both sides; nan where a side does not have it."""

    what: str
    unit: str
    first: float
    other: float
    against: str
    """The name of the other side."""

    def words(self) -> str:
        """``mode of x at 345 Hz, damping: -12 %``, or which side lacks it."""
        if np.isnan(self.first) or np.isnan(self.other):
            return f"{self.what}: only in {'the first' if np.isnan(self.other) else self.against}"
        if self.first == 0:
            factor, unit = _READ.get(self.unit, (1.0, self.unit))
            return f"{self.what}: {self.other * factor:.4g} {unit} instead of 0".replace("  ", " ")
        return f"{self.what}: {share(self.other / self.first - 1)}"


def there(path: Path) -> None:
    """Refuse what is no file and no folder of a run, before anything is computed of the others."""
    if path.is_dir() and not (path / "run.json").is_file():
        raise InputError(f"{path}: a folder without run.json, expected that of a run, or a file")
    if not path.exists():
        raise InputError(f"{path}: no such file, expected a machine, a joint, a measurement or the folder of a run")


def side(path: Path | Machine | Joint, tool: str | None = None) -> Side:
    """What to compare of a machine or a joint, of a file, by its schema, or of the folder of a run.

    ``tool`` names which of several is in the machine.
    """
    if isinstance(path, Machine):
        return of_machine(path.where, machine_of(path, tool))
    if tool is not None and (isinstance(path, Joint) or path.is_dir() or _kind(path) != "machine"):
        named = f"joint {path.name!r}" if isinstance(path, Joint) else path
        raise InputError(f"--tool: {named} is no machine, expected machines with several tools")
    if isinstance(path, Joint):
        return _of_joint(f"joint {path.name!r}", path)
    there(path)
    if path.is_dir():
        return _of_run(path)
    kind = _kind(path)
    if kind == "joint":
        return _of_joint(str(path), read_joint(path))
    if kind == "machine":
        return of_machine(str(path), machine_of(path, tool))
    if kind == "measurement":
        return _of_measurement(path)
    raise InputError(f"{path}: cannot be compared, expected a machine, a joint, a measurement or the folder of a run")


def _kind(path: Path) -> str:
    return next(iter(str(read(path).get("schema", "")).split("/")[1:2]), "")


def _of_joint(called: str, joint: Joint) -> Side:
    facts = {}
    for name, value in joint.parameters.items():
        error = joint.covariance.standard_error(name) if joint.covariance else 0.0
        facts[name] = Fact(float(value), joint.units[name], float(error) if np.isfinite(error) else 0.0)
    return Side(called, "joint", facts)


def _of_measurement(path: Path) -> Side:
    measurement = read_measurement(path)
    if measurement.kind != "frf":
        raise InputError(
            f"{path}: kind is {measurement.kind!r}, expected 'frf'; of other measurements compare the joints that "
            "`jointlib identify` makes of them"
        )
    records = open_frfs(measurement, measurement.records)
    curves = {
        f"{r.response} for {r.force:g} N on {r.drive}": Curve(r.frequency, r.receptance, at_the_peaks(r))
        for r in records
    }
    return Side(str(path), "measurement", {}, curves)


def _of_run(path: Path) -> Side:
    """Errors of the loop, peaks of the tool and lowest depths, as the files of the run hold them."""
    facts = {}
    data = _json(path / "run.json")
    for key in ("error_before", "error_after"):
        if data.get(key) is not None:
            facts[key.replace("_", " ")] = Fact(data[key])
    lobes = _json(path / "lobes.json")
    for size, depth in zip(lobes.get("amplitude", ()), lobes.get("minimum_depth", ()), strict=True):
        if depth is not None:
            at = f"a tool amplitude of {size * 1e6:g} µm" if size else "vanishing vibration"
            facts[f"lowest stable depth at {at}"] = Fact(depth, "m")
    peaks = _json(path / "frf.json").get("tool_peaks", ())
    for i, peak in enumerate(peaks):
        before = [p for p in peaks[:i] if all(p[k] == peak[k] for k in ("output", "drive", "force"))]
        name = f"peak {len(before) + 1} of {peak['output']} for {peak['force']:g} N on {peak['drive']}"
        facts[f"{name}, frequency"] = Fact(peak["frequency"], "Hz")
        facts[f"{name}, compliance"] = Fact(peak["compliance"], "m/N")
    return Side(str(path), "run", facts)


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    try:
        loaded = json.loads(bytes_of(path, "the results of a run"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: no JSON ({reason(error)})") from None
    return loaded if isinstance(loaded, dict) else {}


def differences(first: Side, other: Side) -> tuple[Difference, ...]:
    """What differs by more than its uncertainty, resonance by resonance and number by number."""
    if first.kind != other.kind:
        raise InputError(f"{other.name} is a {other.kind}, {first.name} a {first.kind}: expected two of a kind")
    found, least = [], _SAME if first.kind == "joint" else _LITTLE
    for key in dict.fromkeys([*first.facts, *other.facts]):
        a, b = first.facts.get(key), other.facts.get(key)
        unit = (a or b or Fact(0.0)).unit
        name = key + _PARTLY if any(fact is not None and fact.partly for fact in (a, b)) else key
        if a is None or b is None:
            x, y = (np.nan if f is None else f.value for f in (a, b))
            found.append(Difference(name, unit, x, y, other.name))
        elif _differ(a, b, least):
            found.append(Difference(name, unit, a.value, b.value, other.name))
    for name in dict.fromkeys([*first.curves, *other.curves]):
        if name not in first.curves or name not in other.curves:
            have = name in first.curves
            found.append(Difference(name, "", 1.0 if have else np.nan, np.nan if have else 1.0, other.name))
            continue
        found += _of_resonances(name, first.curves[name], other.curves[name], other.name)
    return tuple(found)


def _differ(a: Fact, b: Fact, least: float = _LITTLE) -> bool:
    if a.value == b.value or (np.isnan(a.value) and np.isnan(b.value)):
        return False
    spread = float(np.hypot(a.error, b.error))
    if a.samples is not None and b.samples is not None and len(a.samples) > 1:
        # Both stand on the same samples, so what these have in common is no doubt about the difference.
        apart = b.samples - a.samples
        spread = float(np.std(apart, ddof=1) / np.sqrt(len(apart))) if np.all(np.isfinite(apart)) else 0.0
    floor = (_SAME if spread > 0 else least) * max(abs(a.value), abs(b.value))
    return not abs(b.value - a.value) <= max(_SURE * spread, floor)


def _pairs(a: Curve, b: Curve) -> Iterable[tuple[Resonance | None, Resonance | None]]:
    """The resonances of two receptances that are one and the same, or that one of them lacks."""
    if a.tops is not None and b.tops is not None:
        return matched(a.tops, b.tops)
    read = (resonances(curve.frequency, curve.receptance, curve.deviation) for curve in (a, b))
    return [(pair.measured, pair.predicted) for pair in paired(*read)]


def _of_resonances(name: str, a: Curve, b: Curve, against: str) -> list[Difference]:
    found = []
    for p, q in _pairs(a, b):
        if p is None or q is None:
            only = p or q
            assert only is not None
            at = f"{name}, resonance at {only.frequency:.5g} Hz"
            ends = (only.frequency, np.nan) if q is None else (np.nan, only.frequency)
            found.append(Difference(at, "Hz", *ends, against))
            continue
        for word, key, error, unit in (
            ("frequency", "frequency", "frequency_error", "Hz"),
            ("damping", "damping_ratio", "damping_error", ""),
            ("compliance", "compliance", "compliance_error", "m/N"),
        ):
            x, y = Fact(getattr(p, key), unit, getattr(p, error)), Fact(getattr(q, key), unit, getattr(q, error))
            if not np.isnan(x.value) and not np.isnan(y.value) and _differ(x, y):
                at = f"{name}, resonance at {p.frequency:.5g} Hz, {word}"
                found.append(Difference(at, unit, x.value, y.value, against))
    return found


def as_told(difference: Difference) -> tuple[str, str, str, str, str]:
    """A row of it in the units in which such numbers are read, mm of depth, µm/N, % of damping, with digits known."""
    unit = difference.unit
    factor, word = (100.0, "%") if unit == "" and difference.what.endswith("damping") else _READ.get(unit, (1.0, unit))
    digits = 4 if difference.what.endswith(_PARTLY) or word == "%" else 6
    first, other = (f"{factor * x:.{digits}g}" if x == x else "–" for x in (difference.first, difference.other))
    return difference.what, first, other, word or "–", difference.against


def sentence(first: Side, others: Sequence[Side], found: Sequence[Difference]) -> str:
    """The largest differences, those of the depth of cut first, or that there is none above the uncertainty."""
    names = " and ".join(other.name for other in others)
    if not found:
        floor = "" if first.kind == "joint" else f" and {100 * _LITTLE:g} %"
        return f"{names} and {first.name}: no difference above the uncertainty{floor}."
    both = [d for d in found if not np.isnan(d.first) and not np.isnan(d.other)]
    largest = sorted(both, key=lambda d: -abs(np.log(abs(d.other / d.first))) if d.first and d.other else -np.inf)
    told = [d.words() for d in sorted(largest or found, key=lambda d: "depth" not in d.what)[:3]]
    more = f"; {len(found) - len(told)} more" if len(found) > len(told) else ""
    return f"{names} against {first.name}: {'; '.join(told)}{more}."
