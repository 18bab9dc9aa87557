"""The tool point and the cut of a machine, as many times as it is drawn from what is known of its errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed, InputError

from ..cutting.amplitude.chattering_tool import chattering_receptance
from ..cutting.process.cutting import Cutting
from ..indices import Index
from ..model.machine import Machine
from ..tool.chatter_band import chatter_band
from ..tool.tool_model import ToolModel
from ..uncertainty.drawn_machines import sampled_machines

_REFUSED = 0.05
"""Share of the samples that may come to nothing."""
_MOST_DAMPED = 0.7
_FELT = 0.05
"""Share of the highest peak from which on a mode is one that can be doubted."""
_BELOW, _ABOVE, _MOST = 0.5, 1.7, 700
"""Times the lowest and highest mode between which the borders are looked for, and lines at most."""
_SAME = 1e-9
"""Share of the largest by which samples that are alike differ."""
_PER_WIDTH, _PER_WAVE = 5.0, 24.0
"""Lines to the half width of a mode, and to a wave more between two teeth."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a suspect changes: modes as in `SampledTool`, coefficients, and C of process damping in N/m, by sample.

    ``active`` is how many flutes of the cutter cut, one after the other, in each sample; None where all do.
    """

    poles: ComplexArray
    residue: ComplexArray
    tangential: Array
    normal: Array
    damping: Array
    active: Array | None = None

    def of(self, rows: Index) -> Drawn:
        """Some of the samples, in an order, any of them several times."""
        forces = self.tangential[rows], self.normal[rows], self.damping[rows]
        return Drawn(self.poles[rows], self.residue[rows], *forces)

    def moved(self, mode: int, frequency: Array, ratio: Array) -> Drawn:
        """A mode with its frequency and its damping ratio times factors, (samples,), mass and shape kept."""
        s = self.poles[:, mode]
        size, zeta = np.abs(s) * frequency, np.minimum(-s.real / np.abs(s) * ratio, _MOST_DAMPED)
        new = size * (-zeta + 1j * np.sqrt(1 - zeta**2))
        poles, residue = self.poles.copy(), self.residue.copy()
        poles[:, mode] = new
        residue[:, mode] *= (s.imag / new.imag)[:, None, None]
        return replace(self, poles=poles, residue=residue)


@dataclass(frozen=True, eq=False)
class SampledTool:
    """Samples of a tool point, all at once.

    Parameters
    ----------
    poles, residue, direct
        G(ω) = Σ R/(jω − s) + conjugates + D: s in rad/s, (samples, modes), those with Im > 0 by size; R, (samples,
        modes, axes, axes); D in m/N. Empty where the tool is known by lines alone.
    receptance
        On ``lines``, where it is known by those alone.
    tangential, normal
        Coefficients of each sample in N/m², (samples,); in turning the first is that along the chip.
    lines
        Hz on which borders are looked for.
    certain
        Whether nothing was drawn: all samples are the machine as it is.
    """

    poles: ComplexArray
    residue: ComplexArray
    direct: Array
    receptance: ComplexArray | None
    tangential: Array
    normal: Array
    lines: Array
    axes: tuple[str, ...]
    certain: bool
    nominal: ToolModel | None = None
    """The machine as it is, by modes."""
    left_out: int = 0

    @property
    def count(self) -> int:
        """Samples."""
        return len(self.tangential)

    @property
    def modal(self) -> bool:
        """Whether the tool is known by modes, one of which may be doubted."""
        return self.receptance is None

    def drawn(self) -> Drawn:
        """What a suspect may change of it."""
        return Drawn(self.poles, self.residue, self.tangential, self.normal, np.zeros(self.count))

    @property
    def freedom(self) -> int:
        """Standard normal numbers that the modes of a draw are told by, see `placed`."""
        return 0 if self.certain or not self.modal else 2 * len(self.felt())

    @cached_property
    def _spread(self) -> tuple[Array, Array]:
        """ln|s| and ln ζ of the modes that the tool feels: their mean, and a root of their covariance."""
        found = features(self.poles[:, self.felt()])
        size, vectors = np.linalg.eigh(np.atleast_2d(np.cov(found, rowvar=False)))
        return np.mean(found, axis=0), np.asarray(vectors * np.sqrt(np.maximum(size, 0.0)))

    @cached_property
    def alike(self) -> bool:
        """Whether samples differ in nothing but where their felt modes stand."""
        if not self.modal:
            return False
        shape = self.residue * self.poles.imag[:, :, None, None]
        others = np.delete(self.poles, self.felt(), axis=1)
        parts = [shape.real, shape.imag, others.real, others.imag, self.tangential, self.normal]
        return all(bool(np.all(np.ptp(x, axis=0) <= _SAME * np.max(np.abs(x), initial=0.0))) for x in parts)

    def placed(self, drawn: Drawn, z: Array) -> Drawn:
        """Draws whose felt modes stand where standard normal numbers, (draws, `freedom`), put them.

        The samples tell how the logarithms of frequencies and damping ratios scatter together; between them every value
        is possible, so that the cuts may narrow them further than samples lie apart.
        """
        if not z.shape[1]:
            return drawn
        modes = self.felt()
        mean, root = self._spread
        wanted = np.exp(mean + z @ root.T - features(drawn.poles[:, modes]))
        for i, mode in enumerate(modes):
            drawn = drawn.moved(mode, wanted[:, i], wanted[:, len(modes) + i])
        return drawn

    def response(self, changed: Drawn, rows: Index) -> ComplexArray:
        """G in m/N on the lines, (draws, lines, axes, axes), of draws that stand on some of the samples."""
        if self.receptance is not None:
            return np.asarray(self.receptance[rows])
        return receptance(changed.poles, changed.residue, self.direct[rows], self.lines)

    def felt(self) -> list[int]:
        """The modes of the middle sample that the tool feels, by frequency."""
        return list(self._felt)

    @cached_property
    def _felt(self) -> tuple[int, ...]:
        if not self.modal:
            return ()
        peak = np.linalg.norm(np.median(np.abs(self.residue), axis=0), axis=(1, 2))
        peak /= np.median(np.abs(self.poles.real), axis=0)
        return tuple(int(k) for k in np.flatnonzero(peak > _FELT * np.max(peak)))

    @cached_property
    def highest(self) -> float:
        """Hz of the highest mode that the tool feels."""
        return max(self.frequency(mode) for mode in self.felt())

    def frequency(self, mode: int) -> float:
        """Hz, of a mode in the middle sample."""
        return float(np.median(np.abs(self.poles[:, mode]))) / (2 * np.pi)


def features(poles: ComplexArray) -> Array:
    """ln|s| and ln ζ of poles, (samples, 2·modes)."""
    size = np.abs(poles)
    return np.asarray(np.concatenate([np.log(size), np.log(np.maximum(-poles.real / size, 1e-9))], axis=1))


def receptance(poles: ComplexArray, residue: ComplexArray, direct: Array, lines: Array) -> ComplexArray:
    """G in m/N on lines in Hz, (samples, lines, axes, axes)."""
    jw = 2j * np.pi * lines
    n, a = len(poles), residue.shape[-1]
    flat = residue.reshape(n, -1, a * a)
    up = 1 / (jw[:, None] - poles[:, None])
    down = 1 / (jw[:, None] - poles.conj()[:, None])
    return np.asarray((up @ flat + down @ flat.conj()).reshape(n, len(lines), a, a) + direct[:, None])


def sampled_tool(machine: Machine, count: int, seed: int, slowest: float) -> SampledTool:
    """Draw the machine; ``slowest`` is the lowest tooth frequency in Hz that borders are asked at."""
    assert machine.cutting is not None
    try:
        machines, certain = sampled_machines(machine, count, seed)[0], False
    except InputError as error:
        if "nothing to sample" not in str(error):
            raise
        machines, certain = [machine], True
    nominal = chatter_band(machine)
    if nominal.model is None:
        return _on_lines(machine, machines, count, certain)
    models, kept = [], []
    for one in machines:
        try:
            model = chatter_band(one).model
        except (CheckFailed, InputError):
            continue
        if model is not None and len(model.poles) == len(nominal.model.poles):
            models.append(model)
            kept.append(one)
    if len(machines) - len(kept) > _REFUSED * len(machines):
        raise InputError(
            f"{machine.where}: {len(machines) - len(kept)} of {len(machines)} samples have no modes to tell "
            "borders by, expected smaller errors of joints and modes"
        )
    poles, residue, direct = (np.array(part) for part in zip(*(_arrays(model) for model in models), strict=True))
    lines = _lines(poles, nominal.felt, slowest)
    tangential, normal = _coefficients(kept)
    times = count if certain else 1
    return SampledTool(
        poles=np.repeat(poles, times, axis=0),
        residue=np.repeat(residue, times, axis=0),
        direct=np.repeat(direct, times, axis=0),
        receptance=None,
        tangential=np.repeat(tangential, times),
        normal=np.repeat(normal, times),
        lines=lines,
        axes=machine.tool_axes,
        certain=certain,
        nominal=nominal.model,
        left_out=len(machines) - len(kept),
    )


def _arrays(model: ToolModel) -> tuple[ComplexArray, ComplexArray, Array]:
    """Poles by size, residues and the direct part of a model."""
    order = np.argsort(np.abs(model.poles))
    weight = (model.weight / 2)[:, None, None]
    residue = weight * model.outputs[:, :, None] * model.inputs[:, None, :]
    return model.poles[order], residue[order], model.direct


def _on_lines(machine: Machine, machines: Sequence[Machine], count: int, certain: bool) -> SampledTool:
    band = chatter_band(machine)
    lines = band.lines
    cutting = Cutting(**dict(machine.cutting or {}))
    found = np.array([chattering_receptance(one, cutting, lines, 0.0) for one in machines])
    tangential, normal = _coefficients(machines)
    if certain:
        found, tangential, normal = (np.repeat(part, count, axis=0) for part in (found, tangential, normal))
    none = np.zeros((len(found), 0), dtype=complex)
    axes = len(machine.tool_axes)
    empty, direct = np.zeros((len(found), 0, axes, axes), dtype=complex), np.zeros((len(found), axes, axes))
    return SampledTool(none, empty, direct, found, tangential, normal, lines, machine.tool_axes, certain)


def _lines(poles: ComplexArray, felt: Array, slowest: float) -> Array:
    """Even lines, close enough for every mode that the tool feels and for the waves between two teeth."""
    low, high = _BELOW * float(felt[0]), _ABOVE * float(felt[-1])
    near = np.abs(poles) / (2 * np.pi)
    inside = (near > 0.8 * felt[0]) & (near < 1.2 * felt[-1])
    width = float(np.quantile(np.abs(poles.real[inside]) / (2 * np.pi), 0.1))
    spacing = min(width / _PER_WIDTH, slowest / _PER_WAVE)
    return np.linspace(low, high, min(_MOST, int((high - low) / spacing) + 2))


def _coefficients(machines: Sequence[Machine]) -> tuple[Array, Array]:
    """K_t and K_n of each machine; in turning K_s and nothing."""
    cuts = [Cutting(**dict(one.cutting or {})) for one in machines]
    tangential = [cut.specific if cut.specific is not None else cut.tangential for cut in cuts]
    return np.array(tangential, dtype=float), np.array([cut.normal or 0.0 for cut in cuts], dtype=float)
