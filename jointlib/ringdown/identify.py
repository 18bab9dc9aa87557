"""From free decays to frequency and damping over amplitude, and to a joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.identification.first_values import Size, first_laws
from jointlib.identification.result import FitError, Found, Identification
from jointlib.io.atomic import write_text
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.refit import refit
from jointlib.measurement import RINGDOWN, Measurement, Record
from jointlib.ringdown.backbone import Backbone, backbones
from jointlib.ringdown.evidence import Evidence, evidence_of, free_of
from jointlib.shown.pictures import MEASURED, axes_of
from jointlib.shown.result import Columns, Shown

_ROWS = 8
"""Of one decay, in a table for people."""
_DIFFER = 0.02, 0.2
"""In frequency and damping, by which zero crossings may tell something else before it is said."""


@dataclass(frozen=True, repr=False)
class Ringdown(Shown):
    """Frequency and damping over amplitude of every mode of every decay, and the joint that was fitted to them."""

    measurement: Measurement
    modes: tuple[tuple[Backbone, ...], ...]
    """By record."""
    messages: tuple[str, ...]
    fit: Identification | None = None
    """None where no laws were asked for."""

    def _all(self) -> list[tuple[int, Backbone]]:
        return [(k + 1, b) for modes in self.modes for k, b in enumerate(modes)]

    def rows(self) -> list[tuple[str, ...]]:
        """Record, mode, amplitude in µm, frequency and damping with their errors, as people read them."""
        out = list[tuple[str, ...]]()
        for number, b in self._all():
            for i in np.unique(np.linspace(0, len(b) - 1, _ROWS).astype(int)):
                out.append((
                    b.record,
                    str(number),
                    f"{1e6 * b.amplitude[i]:.4g}",
                    f"{b.omega[i] / (2 * np.pi):.6g}",
                    f"± {b.omega_error[i] / (2 * np.pi):.1g}",
                    f"{100 * b.damping_ratio[i]:.4g}",
                    f"± {100 * b.ratio_error[i]:.1g}",
                ))  # fmt: skip
        return out

    def as_json(self) -> dict[str, Any]:
        """``backbones``, a list: record, mode, and lists over amplitude (m) of frequency (Hz) and damping ratio."""
        told = [
            {
                "record": b.record,
                "mode": number,
                "amplitude": b.amplitude.tolist(),
                "frequency": (b.omega / (2 * np.pi)).tolist(),
                "frequency_error": (b.omega_error / (2 * np.pi)).tolist(),
                "damping_ratio": b.damping_ratio.tolist(),
                "damping_ratio_error": b.ratio_error.tolist(),
            }
            for number, b in self._all()
        ]
        return {"backbones": told, "messages": self.messages}

    def finding(self) -> str:
        """How frequency and damping go with amplitude."""
        said = []
        for number, b in self._all():
            f, z = b.omega / (2 * np.pi), 100 * b.damping_ratio
            said.append(
                f"{b.record}, mode {number}: {f[0]:.5g} Hz and {z[0]:.3g} % at {1e6 * b.amplitude[0]:.3g} µm, "
                f"{f[-1]:.5g} Hz and {z[-1]:.3g} % at {1e6 * b.amplitude[-1]:.3g} µm"
            )
        return "\n".join(said)

    def columns(self) -> Columns:
        """A row per piece of a decay."""
        every = self._all()
        told: dict[str, tuple[Any, str]] = {
            "record": ([b.record for _, b in every for _ in range(len(b))], ""),
            "mode": ([n for n, b in every for _ in range(len(b))], ""),
        }
        for name, key, factor, unit in _COLUMNS:
            told[name] = ([float(v) * factor for _, b in every for v in getattr(b, key)], unit)
        return told

    def plot(self, ax: Any = None) -> Any:
        """Frequency in Hz over the amplitude in µm."""
        axes = axes_of(ax)
        for number, b in self._all():
            axes.plot(1e6 * b.amplitude, b.omega / (2 * np.pi), ".", color=MEASURED, label=f"{b.record}, mode {number}")
        axes.set(xlabel="amplitude [µm]", ylabel="frequency [Hz]", xscale="log")
        return axes


_COLUMNS = (
    ("time", "time", 1.0, "s"),
    ("amplitude", "amplitude", 1.0, "m"),
    ("frequency", "omega", 1 / (2 * np.pi), "Hz"),
    ("frequency_error", "omega_error", 1 / (2 * np.pi), "Hz"),
    ("damping_ratio", "damping_ratio", 1.0, ""),
    ("damping_ratio_error", "ratio_error", 1.0, ""),
)


def identify_ringdown(
    measurement: Measurement, laws: Sequence[str] | None = None, start: Joint | None = None
) -> Ringdown:
    """Frequency and damping over amplitude; with laws or a joint to start from the joint that makes them."""
    if measurement.kind != RINGDOWN:
        raise InputError(f"{measurement.source}: kind is {measurement.kind!r}, expected {RINGDOWN!r}")
    records = read_records(measurement, measurement.with_role("fit"))
    found = backbones(measurement, records)
    messages = said_of(found)
    fit = None
    if laws or start is not None:
        evidence = evidence_of(measurement, found)
        joint = Joint(first_laws(laws, size_of(evidence))) if laws else start
        assert joint is not None
        fit = _fitted(measurement, records, evidence, joint)
    return Ringdown(measurement, found, tuple(messages), fit)


def said_of(found: Sequence[Sequence[Backbone]]) -> list[str]:
    """What there is to say of the decays, and where zero crossings tell something else."""
    said = list[str]()
    for modes in found:
        for b in modes:
            said += b.messages
            for value, most, word in zip(b.checked, _DIFFER, ("frequency", "damping"), strict=True):
                if abs(value) > most:
                    said.append(f"{b.record}: zero crossings tell another {word}, by {100 * value:.2g} %.")
        if len(modes) > 1:
            listed = ", ".join(f"{float(np.median(b.omega)) / (2 * np.pi):.4g} Hz" for b in modes)
            said.append(f"{modes[0].record}: modes at {listed}; a joint is fitted to the first, band chooses another.")
    return said


def size_of(evidence: Evidence) -> Size:
    """Sizes over all decays."""
    a, k = evidence.amplitudes[-1] / np.sqrt(2), evidence.modal_mass * float(np.median(evidence.omegas)) ** 2
    return Size(float(a), float(a * np.median(evidence.omegas)), float(a * k), float(k))


def _fitted(m: Measurement, records: Sequence[Record], evidence: Evidence, joint: Joint) -> Identification:
    free = free_of(joint)
    found, chi2 = refit(joint, evidence.residual, free)
    known = found.covariance
    parameters = {
        name: Found(
            value,
            found.units[name],
            known.standard_error(name) if known is not None and name in known.names else None,
            "fitted" if name in free else "fixed" if name in joint.fixed else "assumed",
        )
        for name, value in found.parameters.items()
    }
    mass = m.carriage
    messages = []
    if mass is not None and mass.uncertainty and mass.value:
        messages.append(
            f"The modal mass is known to {100 * mass.uncertainty / mass.value:.2g} %; stiffness, damping and forces "
            "are off by as much as it is, which their standard errors do not contain."
        )
    if chi2 > 4:
        messages.append(
            f"The laws miss frequency and damping by {chi2**0.5:.2g} times what is known of them; a trace tells what "
            "may be missing."
        )
    left = evidence.left(found)
    by_record = {
        b.record: float(np.sqrt(np.mean(np.abs(r * b.amplitude) ** 2) / 2))
        for b, r in zip(evidence.backbones, left, strict=True)
    }
    rms = float(np.sqrt(np.mean(np.square(list(by_record.values())))))
    error = FitError(m.source.name, m.kind, rms, "N", evidence.share(found), by_record)
    omegas = evidence.omegas / (2 * np.pi)
    made = replace(
        found,
        validity={
            **found.validity,
            "amplitude": (0.0, float(max(b.amplitude[0] for b in evidence.backbones))),
            "frequency": (float(np.min(omegas)), float(np.max(omegas))),
        },
        provenance={
            "program": f"jointlib {version('jointlib')}",
            "simulated": m.simulated,
            "files": [{"file": r.source.file.name, "sha256": r.sha256} for r in records],
        },
    )
    return Identification(made, parameters, (error,), messages=tuple(messages))


def write_backbones(path: Path, found: Ringdown) -> None:
    """The table over amplitude as .csv, SI and Hz."""
    columns = found.columns()
    lines = [",".join(f"{name} [{unit}]" if unit else name for name, (_, unit) in columns.items())]
    lines += [",".join(map(str, row)) for row in zip(*(values for values, _ in columns.values()), strict=True)]
    write_text(path, "\n".join(lines) + "\n")
