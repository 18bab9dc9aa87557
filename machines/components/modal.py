"""Modal component: natural frequencies, damping ratios and mode shapes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.mode_files import read_modes
from jointlib.io.toml import Section

from .component import Component, SecondOrder, checked_dofs
from .static_load import axis_of


@dataclass(frozen=True, eq=False)
class Modal(Component):
    """H = Σ_r φ_r φ_rᵀ / (m_r (ω_r² − ω² + 2jζ_r ω_r ω)); a mode at 0 Hz is a free motion.

    Parameters
    ----------
    frequency
        Natural frequencies in Hz, shape (modes,).
    damping_ratio
        ζ, shape (modes,).
    shapes
        One column per mode, one row per degree of freedom.
    modal_mass
        kg, shape (modes,); 1 where the shapes are normalised to unit modal mass.
    mass
        kg of the whole part, for its weight; modes do not tell it.
    carries
        Degrees of freedom at which the weight acts, one per machine axis at most (the axis is told by the name: x, uy,
        z_2); default: all that are named after an axis.
    notes
        What was said on reading.
    frequency_error, damping_ratio_error
        Standard errors of both, in Hz and as a number, shape (modes,); None where they are not known.
    """

    name: str
    dofs: tuple[str, ...]
    frequency: Array
    damping_ratio: Array
    shapes: Array
    modal_mass: Array | None = None
    mass: float | None = None
    carries: tuple[str, ...] | None = None
    notes: tuple[str, ...] = ()
    frequency_error: Array | None = None
    damping_ratio_error: Array | None = None

    kind: ClassVar[str] = "modal"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        dofs = checked_dofs(where, self.dofs)
        frequency = np.array(self.frequency, dtype=float)
        modes = frequency.size
        mass = np.ones(modes) if self.modal_mass is None else np.array(self.modal_mass, dtype=float)
        values = {
            "frequency": frequency,
            "damping_ratio": np.array(self.damping_ratio, dtype=float),
            "modal_mass": mass,
        }
        for key, value in values.items():
            if value.shape != (modes,) or modes == 0:
                raise InputError(f"{where}: {key} has {value.size} values, expected one per mode ({modes})")
            low = np.min(value)
            if not np.all(np.isfinite(value)) or low < 0 or (key == "modal_mass" and low == 0):
                raise InputError(f"{where}: {key} is {value.tolist()}, expected finite and positive values")
        shapes = np.array(self.shapes, dtype=float)
        if shapes.shape != (len(dofs), modes) or not np.all(np.isfinite(shapes)):
            raise InputError(
                f"{where}: shapes has shape {shapes.shape}, expected finite values of shape {(len(dofs), modes)}: "
                "a row per dof, a column per mode"
            )
        for key, value in {**values, "shapes": shapes}.items():
            object.__setattr__(self, key, value)
        object.__setattr__(self, "dofs", dofs)
        for key in ("frequency_error", "damping_ratio_error"):
            if getattr(self, key) is not None:
                error = np.array(getattr(self, key), dtype=float)
                if error.shape != (modes,) or not np.all(np.isfinite(error) & (error >= 0)):
                    raise InputError(
                        f"{where}: {key} is {error.tolist()}, expected a standard error per mode ({modes})"
                    )
                object.__setattr__(self, key, error)
        if self.mass is not None and not (np.isfinite(self.mass) and self.mass > 0):
            raise InputError(f"{where}: mass is {self.mass!r} kg, expected more than 0")
        for dof in self.carries or ():
            if dof not in dofs or axis_of(dof) is None:
                raise InputError(
                    f"{where}: carries names {dof!r}, expected dofs named after an axis, such as z or uz_2"
                )

    @classmethod
    def from_section(cls, section: Section) -> Modal:
        if section.has("file"):
            return cls._from_file(section)
        mass = section.numbers("modal_mass", "kg", None)
        return cls(
            section.text("name"),
            section.words("dofs"),
            np.array(section.numbers("frequency", "Hz")),
            np.array(section.numbers("damping_ratio", "1")),
            np.array(section.matrix("shapes", "1")),
            None if mass is None else np.array(mass),
            section.number("mass", "kg", None),
            section.words("carries", None),
            (),
            *_errors(section),
        )

    @classmethod
    def _from_file(cls, section: Section) -> Modal:
        name, dofs, path = section.text("name"), section.words("dofs"), Path(section.path("file"))
        frequency, given = section.numbers("frequency", "Hz", None), section.numbers("damping_ratio", "1", None)
        mass = section.numbers("modal_mass", "kg", None)
        try:
            modes = read_modes(path, dofs, section.words("at", None))
        except InputError as error:
            raise InputError(f"{section.where}: {error}") from None
        ratio = modes.damping_ratio if given is None else np.array(given)
        if ratio is None:
            raise InputError(f"{section.where}: {path} tells no damping, expected damping_ratio, one per mode")
        for key, own in (("frequency", frequency), ("modal_mass", mass)):
            if own is not None and len(own) != len(modes.frequency):
                raise InputError(
                    f"{section.where}: {key} has {len(own)} value{'s' * (len(own) != 1)}, expected one for each of the "
                    f"{len(modes.frequency)} modes of {path.name}"
                )
        weight = section.number("mass", "kg", None), section.words("carries", None)
        found = (
            *(name, dofs, modes.frequency if frequency is None else np.array(frequency), ratio, modes.shapes),
            modes.modal_mass if mass is None else np.array(mass),
        )
        return cls(*found, *weight, modes.notes, *_errors(section))

    @property
    def uncertain(self) -> bool:
        """Whether a standard error of a mode is known."""
        return self.frequency_error is not None or self.damping_ratio_error is not None

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        natural = 2 * np.pi * self.frequency
        w = omega[:, None]
        assert self.modal_mass is not None
        denominator = self.modal_mass * (natural**2 - w**2 + 2j * self.damping_ratio * natural * w)
        if not np.all(denominator):
            _, r = np.argwhere(denominator == 0)[0]
            raise InputError(
                f"component {self.name!r}: its undamped mode at {self.frequency[r]:g} Hz lies on a line, where it has "
                "no finite answer; expected a damping_ratio above 0"
            )
        modal = 1 / denominator
        left, right = rows @ self.shapes, columns @ self.shapes
        return np.asarray((left * modal[:, None, :]) @ right.T)

    def remarks(self) -> tuple[str, ...]:
        return tuple(f"{self.name}: {note}" for note in self.notes)

    def second_order(self) -> SecondOrder:
        natural = 2 * np.pi * self.frequency
        mass = self.modal_mass
        assert mass is not None
        return SecondOrder(
            np.diag(mass), np.diag(2 * self.damping_ratio * natural * mass), np.diag(natural**2 * mass), self.shapes
        )

    def weight(self, gravity: Array) -> Array | None:
        """The whole weight at the dofs that carry it; an axis along which there is none is taken as held rigidly."""
        if self.mass is None:
            return None
        out, taken = np.zeros(len(self.dofs)), set()
        for i, dof in enumerate(self.dofs):
            axis = axis_of(dof)
            if axis is None or (self.carries is not None and dof not in self.carries):
                continue
            if axis in taken:
                raise InputError(
                    f"component {self.name!r}: several dofs move along {'xyz'[axis]}, expected carries with the ones "
                    "that carry the weight"
                )
            taken.add(axis)
            out[i] = self.mass * gravity[axis]
        return out


def _errors(section: Section) -> tuple[Array | None, Array | None]:
    """Standard errors of frequencies in Hz and of damping ratios, where a file has them."""
    frequency, ratio = section.numbers("frequency_error", "Hz", None), section.numbers("damping_ratio_error", "1", None)
    return None if frequency is None else np.array(frequency), None if ratio is None else np.array(ratio)
