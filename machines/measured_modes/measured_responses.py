"""The frequency responses of measurement files, together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jointlib.errors import FrequencyMismatch, InputError, nearest
from jointlib.io.measurement_file import read_measurement
from jointlib.measurement import RecordSource
from jointlib.modal_fit.responses import Responses

from ..loop.records import LevelFRF, open_frfs

_SAME = 1e-9


def read_responses(
    files: Sequence[Path], band: tuple[float, float] | None = None, condition: str | None = None
) -> Responses:
    """Receptances of all records to be fitted in measurements of kind "frf", on their common lines.

    Records that repeat a pair under one condition are averaged by their variances. ``condition`` chooses among several;
    a record without one has its force for it, as "50 N". Of all lines those in ``band`` (Hz).
    """
    opened: list[tuple[str, LevelFRF]] = []
    for file in files:
        m = read_measurement(file)
        if m.kind != "frf":
            more = ""
            if m.kind in ("impact", "shaker"):
                more = f"; `jointlib estimate {file} -o frf.measurement.toml` makes one of it"
            raise InputError(
                f"{file}: kind is {m.kind!r}, expected a machine file or a measurement of kind 'frf'{more}"
            )
        sources = m.with_role("fit")
        opened += zip(map(_condition, sources), open_frfs(m, sources), strict=True)
    chosen = _chosen(files[0], opened, condition)
    first = chosen[0].frequency
    for frf in chosen:
        f = frf.frequency
        if f.shape != first.shape or np.any(np.abs(f - first) > _SAME * first[-1]):
            raise FrequencyMismatch(
                f"{files[0]}: {frf.name} stands on {len(f)} lines from {f[0]:.6g} to {f[-1]:.6g} Hz, {chosen[0].name} "
                f"on {len(first)} from {first[0]:.6g} to {first[-1]:.6g} Hz, expected the same lines"
            )
    dofs = tuple(dict.fromkeys(name for frf in chosen for name in (frf.drive, frf.response)))
    groups: dict[tuple[int, int], list[LevelFRF]] = {}
    for frf in chosen:
        groups.setdefault((dofs.index(frf.response), dofs.index(frf.drive)), []).append(frf)
    values, deviations = [], []
    for same in groups.values():
        weight = np.array([1 / frf.deviation**2 for frf in same])
        values.append(np.sum(weight * np.array([frf.receptance for frf in same]), axis=0) / weight.sum(axis=0))
        deviations.append(1 / np.sqrt(weight.sum(axis=0)))
    found = Responses(first, np.array(values), np.array(deviations), tuple(groups), _short(dofs))
    return found if band is None else found.within(*band)


def _condition(source: RecordSource) -> str:
    assert source.sweep is not None
    return source.condition or source.sweep.level


def _chosen(file: Path, opened: Sequence[tuple[str, LevelFRF]], condition: str | None) -> list[LevelFRF]:
    known = dict.fromkeys(word for word, _ in opened)
    if condition is not None:
        if condition not in known:
            raise InputError(f"--condition: {condition!r} is none of {file}, {nearest(condition, known)}")
        return [frf for word, frf in opened if word == condition]
    for pair in dict.fromkeys((frf.response, frf.drive) for _, frf in opened):
        of_pair = dict.fromkeys(word for word, frf in opened if (frf.response, frf.drive) == pair)
        if len(of_pair) > 1:
            raise InputError(
                f"{file}: {pair[0]} from {pair[1]} stands there at several levels, {', '.join(of_pair)}; expected "
                f"--condition with one of them, such as --condition {next(iter(of_pair))!r}"
            )
    return [frf for _, frf in opened]


def _short(dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Names of degrees of freedom without that of the component, where they have one in common."""
    parts = {name.partition(".")[0] for name in dofs}
    if len(parts) == 1 and all("." in name for name in dofs):
        return tuple(name.partition(".")[2] for name in dofs)
    return dofs
