"""The cutting process: what the ``[cutting]`` table of a machine file says, and the mean stiffness of the cut."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from numbers import Integral

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, together
from jointlib.joint import Covariance

from .flank import checked_flank
from .flutes import checked_damping, checked_helix, checked_pitch, checked_runout, unlike
from .given import finite, positive, pressure, refuse, speed_range, turned, word
from .materials import material_of

PROCESSES = ("milling", "turning", "boring")
MODES = ("up", "down", "slot")
_MILLING_ONLY = (
    *("teeth", "tangential", "normal", "mode", "immersion", "pitch", "helix", "runout"),
    *("edge_tangential", "edge_normal", "material", "flute_length"),
)
_SIZES = ("feed", "diameter", "flute_length")


@dataclass(frozen=True)
class Cutting:
    """A cutting operation; the fields are the keys of the ``[cutting]`` table.

    Tooth angles φ run clockwise from +y (the normal to the feed x). A tooth in the cut feels
    F_t = K_t·b·h and F_n = K_n·b·h at axial depth b and chip thickness h.

    Parameters
    ----------
    process
        ``"milling"``, ``"turning"`` or ``"boring"`` (turning inside a bore, the same equations).
    teeth
        Number of teeth, evenly spaced unless ``pitch`` says otherwise (milling).
    tangential, normal
        K_t and K_n in N/m², both as pressures; a ratio K_r stands for K_n = K_r·K_t (milling).
    mode, immersion
        ``"up"``, ``"down"`` or ``"slot"``, and radial immersion a/D in (0, 1] (milling; a slot needs none).
    specific
        K_s in N/m² along the chip thickness, the tool's x axis unless ``feed_direction`` says otherwise (turning).
    feed
        m per tooth (milling) or per revolution (turning); loss of contact and the removal rate need it.
    diameter
        m, of the cutter (milling) or of the workpiece (turning); the removal rate, ``helix`` and ``process_damping``
        need it.
    flute_length
        m from the tip up to which the cutter has edges (milling): no deeper cut is advised.
    speed
        Lowest and highest spindle speed of interest in rpm.
    exponent
        q of a force ∝ h^q; the pressures above are then the tangent values at the nominal feed.
    feed_direction
        Angle in rad from the tool's x axis to the feed (milling) or to the chip thickness (turning), towards y.
    pitch
        Degrees from each tooth to the next one that cuts, one a tooth, 360 together (milling); default: all alike.
    helix
        Helix angle in degrees, of all flutes or one a flute, from 0 to below 90 (milling); default: straight edges.
    process_damping
        C in N/m: an edge in the cut is damped along the chip thickness by C·b/v at cutting speed v = π·D·n, as where
        its flank rubs on the waves that it cuts (Chiou & Liang 1998).
    indentation, wear_land, clearance
        K_sp in N/m³, L in m and degrees: the flank by its shape, in place of ``process_damping`` = K_sp·L²/2, see
        `flank`; behind the land it falls off by the clearance.
    edge_tangential, edge_normal
        K_te and K_ne in N/m: forces of an edge in the cut per depth, whatever the chip (milling).
    material
        One of `MATERIALS`: gives the pressures and edge forces that are not given (milling).
    runout
        m by which each tooth stands out from the mean radius, one a tooth (milling).
    covariance
        Of coefficients that came from a cutting file, by the names of fields here; what is drawn for bands.
    """

    process: str = ""
    teeth: int | None = None
    tangential: float | None = None
    normal: float | None = None
    mode: str | None = None
    immersion: float | None = None
    specific: float | None = None
    feed: float | None = None
    diameter: float | None = None
    flute_length: float | None = None
    speed: tuple[float, float] | None = None
    exponent: float = 1.0
    feed_direction: float = 0.0
    pitch: tuple[float, ...] | None = None
    helix: float | tuple[float, ...] | None = None
    process_damping: float | None = None
    indentation: float | None = None
    wear_land: float | None = None
    clearance: float | None = None
    edge_tangential: float | None = None
    edge_normal: float | None = None
    runout: tuple[float, ...] | None = None
    material: str | None = None
    covariance: Covariance | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if self.process == "":
            raise InputError(f"[cutting]: 'process' is missing, expected one of {', '.join(PROCESSES)}")
        word("process", self.process, PROCESSES)
        if self.material is not None and self.process == "milling":
            given = material_of(self.material)
            for key in ("tangential", "normal", "edge_tangential", "edge_normal"):
                if getattr(self, key) is None:
                    object.__setattr__(self, key, getattr(given, key))
        checks: list[Callable[[], object]] = [partial(turned, "feed_direction", self.feed_direction)]
        checks += [partial(positive, k, getattr(self, k)) for k in _SIZES if getattr(self, k) is not None]
        if self.speed is not None:
            checks.append(partial(speed_range, self.speed))
        if self.process_damping is not None:
            checks.append(partial(checked_damping, self.process_damping, self.diameter))
        edges = ("edge_tangential", "edge_normal")
        checks += [partial(finite, key, getattr(self, key)) for key in edges if getattr(self, key) is not None]
        checks.append(partial(checked_flank, self))
        process = self._check_milling if self.process == "milling" else self._check_turning
        together(process, *checks, partial(positive, "exponent", self.exponent))
        if self.speed is not None:
            object.__setattr__(self, "speed", speed_range(self.speed))
        if self.wear_land is not None and self.indentation is not None:
            object.__setattr__(self, "process_damping", self.indentation * self.wear_land**2 / 2)
        for key in ("pitch", "helix", "runout"):
            if isinstance(getattr(self, key), list):
                object.__setattr__(self, key, tuple(getattr(self, key)))

    def _check_milling(self) -> None:
        needed = ("teeth", "tangential", "normal", "mode") + (() if self.mode == "slot" else ("immersion",))
        missing = [key for key in needed if getattr(self, key) is None]
        said = [f"[cutting]: milling needs {key!r}, which is missing" for key in missing]
        if self.specific is not None:
            said.append("[cutting]: 'specific' belongs to turning; milling takes 'tangential' and 'normal'")
        checks: dict[str, Callable[[], object]] = {
            "teeth": self._check_teeth,
            "tangential": partial(pressure, "tangential", self.tangential),
            "normal": partial(finite, "normal", self.normal),
            "mode": partial(word, "mode", self.mode, MODES),
            "immersion": self._check_immersion,
        }
        if self.pitch is not None:
            checks["pitch"] = partial(checked_pitch, self.pitch, self.teeth)
        if self.runout is not None:
            checks["runout"] = partial(checked_runout, self.runout, self.teeth)
        if self.helix is not None:
            checks["helix"] = partial(checked_helix, self.helix, self.teeth, self.diameter)
        together(partial(refuse, said), *(check for key, check in checks.items() if key not in missing))

    def _check_teeth(self) -> None:
        if not isinstance(self.teeth, Integral) or isinstance(self.teeth, bool) or self.teeth < 1:
            raise InputError(f"[cutting]: teeth is {self.teeth!r}, expected a whole number from 1")

    def _check_immersion(self) -> None:
        if self.immersion is None:
            return
        positive("immersion", self.immersion)
        if self.immersion > 1:
            raise InputError(f"[cutting]: immersion is {self.immersion!r}, expected a/D of at most 1")
        if self.mode == "slot" and self.immersion != 1:
            raise InputError(f"[cutting]: immersion is {self.immersion!r}, but a slot is cut at 1; leave it out")

    def _check_turning(self) -> None:
        foreign = [key for key in _MILLING_ONLY if getattr(self, key) is not None]
        said = [f"[cutting]: {key!r} belongs to milling; {self.process} takes 'specific'" for key in foreign]
        if self.specific is None:
            said.append(f"[cutting]: {self.process} needs 'specific', which is missing")
        together(
            partial(refuse, said), *([] if self.specific is None else [partial(pressure, "specific", self.specific)])
        )

    @property
    def cuts_per_revolution(self) -> int:
        """How often a cut surface is met again in one revolution: the teeth, or 1 in turning."""
        return 1 if self.teeth is None else int(self.teeth)

    @property
    def plain(self) -> bool:
        """Whether the teeth are evenly spaced, straight and rub on nothing: one delay, a border linear in depth.

        What is not plain is computed by `machines.cutting.cutters`.
        """
        return not self.unlike

    @property
    def unlike(self) -> str:
        """What makes the cut not `plain`, in words; empty where nothing does."""
        return unlike(self.pitch, self.helix, self.process_damping)

    def refuse_unlike(self, what: str) -> None:
        """Raise where ``what`` is known for a `plain` cut only."""
        if not self.plain:
            raise InputError(
                f"{what}: not computed with {self.unlike}; expected equal pitches, straight edges, no rubbing"
            )

    @property
    def entry_angle(self) -> float:
        """φ_st in rad: 0 in up-milling and slots, arccos(2a/D − 1) in down-milling."""
        self._require_milling("an entry angle")
        return math.acos(2 * self.immersion - 1) if self.mode == "down" and self.immersion is not None else 0.0

    @property
    def exit_angle(self) -> float:
        """φ_ex in rad: arccos(1 − 2a/D) in up-milling, π in down-milling and slots."""
        self._require_milling("an exit angle")
        return math.acos(1 - 2 * self.immersion) if self.mode == "up" and self.immersion is not None else math.pi

    @property
    def interrupted(self) -> bool:
        """Whether there are moments without any tooth in the cut."""
        if self.process != "milling":
            return False
        pitch = 2 * math.pi / self.cuts_per_revolution
        return self.exit_angle - self.entry_angle < pitch * (1 - 1e-12)

    @property
    def directional_factors(self) -> Array:
        """Average directional factors [[α_xx, α_xy], [α_yx, α_yy]] of one tooth, dimensionless.

        Altintas & Budak 1995, with K_r = K_n/K_t; α = −(2/K_t)·∫H₁dφ over the arc of cut, where −b·H₁·Δq is the
        force of one tooth on the tool.
        """
        self._require_milling("directional factors")
        assert self.tangential is not None
        assert self.normal is not None
        ratio = self.normal / self.tangential
        ends = np.array([self.entry_angle, self.exit_angle])
        s, c = np.sin(2 * ends), np.cos(2 * ends)
        primitive = 0.5 * np.array(
            [
                [c - 2 * ratio * ends + ratio * s, -s - 2 * ends + ratio * c],
                [-s + 2 * ends + ratio * c, -c - 2 * ratio * ends - ratio * s],
            ]
        )
        return np.asarray(primitive[..., 1] - primitive[..., 0])

    @property
    def mean_stiffness(self) -> Array:
        """Time-averaged stiffness D of the cut per depth in N/m², so that F = −b·D·[q(t) − q(t−τ)].

        Along the tool's x and y. Milling: (N/2π)∫H₁dφ = −(N·K_t/4π)·α, turned into the direction of the feed, shape
        (2, 2); turning: K_s along the chip thickness, shape (1, 1).
        """
        if self.specific is not None:
            return np.array([[self.specific]], dtype=float)
        assert self.tangential is not None
        mean = -self.cuts_per_revolution * self.tangential / (4 * np.pi) * self.directional_factors
        return np.asarray(self.rotation.T @ mean @ self.rotation)

    @property
    def rotation(self) -> Array:
        """R: the feed and its normal in the tool's axes, one per row."""
        s, c = math.sin(self.feed_direction), math.cos(self.feed_direction)
        return np.array([[c, s], [-s, c]])

    def tooth(self, angle: Array) -> tuple[Array, Array]:
        """Directions u (N/m²) and v of a tooth at angles φ in the tool's axes, shape (…, 2) each.

        Its force on the tool is −b·u·(vᵀΔq): v = (sin φ, cos φ) is along the chip thickness,
        u = (K_t·cos φ + K_n·sin φ, −K_t·sin φ + K_n·cos φ), and u·vᵀ is H₁(φ), all turned into the direction of the
        feed. In turning v is the direction of the chip thickness and u = K_s·v at any angle.
        """
        if self.specific is not None:
            across = np.broadcast_to(self.rotation[0], (*angle.shape, 2))
            return self.specific * across, across
        assert self.tangential is not None
        assert self.normal is not None
        s, c = np.sin(angle), np.cos(angle)
        force = np.stack([self.tangential * c + self.normal * s, -self.tangential * s + self.normal * c], axis=-1)
        return force @ self.rotation, np.stack([s, c], axis=-1) @ self.rotation

    def edge(self, angle: Array) -> Array:
        """Force in N/m of depth that an edge at angles φ feels whatever the chip, to be taken off the tool's, (…, 2).

        (K_te·cos φ + K_ne·sin φ, −K_te·sin φ + K_ne·cos φ) as `tooth` has it of the pressures.
        """
        s, c = np.sin(angle), np.cos(angle)
        t, n = self.edge_tangential or 0.0, self.edge_normal or 0.0
        return np.asarray(np.stack([t * c + n * s, -t * s + n * c], axis=-1) @ self.rotation)

    def speeds(self, count: int = 400) -> Array:
        """Evenly spaced spindle speeds in rpm over the range of the table."""
        if self.speed is None:
            raise InputError("[cutting]: no range of spindle speeds is given, expected speed = [low, high] in rpm")
        return np.linspace(*self.speed, count)

    def _require_milling(self, what: str) -> None:
        if self.process != "milling":
            raise InputError(f"[cutting]: {what} was asked of {self.process}, only milling has one")
