"""The rig that is there: its bodies, its sensors with their noise, and how far its joint may be moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.loop.balance.bodies import rig_of
from jointlib.measurement import Measurement
from jointlib.motion import Motion

RIG_CHANNELS = {"a1": "m/s^2", "a2": "m/s^2", "a3": "m/s^2", "P": "N"}
"""What a rig measures, and in which unit."""
_RATES = tuple(base * scale for scale in (1.0, 10.0, 100.0) for base in (1024.0, 2048.0, 2560.0, 5120.0))
_DRIVEN, _CARRIED = 1.0, 2.0
"""kg of the bodies of a rig that nobody described."""
_SAMPLES_A_CYCLE = 16.0
"""Of the joint's resonance: three harmonics of twice its frequency below 0.8 of half the rate."""
_DECIBEL = 60.0
_OF_LIFT_OFF, _OF_RANGE = 0.8, 0.95


@dataclass(frozen=True)
class Setup:
    """A rig m1 a1 = P − f, (m2 + m3) a2 = f, and what may be done with it."""

    m1: float
    """kg, the driven body."""
    carried: tuple[float, float]
    """kg that ride with a2 and with a3; the second is 0 where there is no a3."""
    channels: tuple[str, ...]
    noise: Mapping[str, float]
    """Standard deviation of a sample in m/s² or N, by channel; for those that are missing see ``quieter``."""
    sample_rate: float
    """Hz."""
    reach: float
    """m; largest abs(z) that is asked of the joint."""
    stiffness: float
    """N/m at rest."""
    damping: float
    """N s/m at rest."""
    declared: Measurement | None
    assumed: tuple[str, ...]
    quieter: float = 1e-3
    """Noise over the rms of a channel at the top level, where no noise is given for it."""

    @property
    def behind(self) -> float:
        """kg behind the joint."""
        return sum(self.carried)

    @property
    def inverse_mass(self) -> float:
        """1/kg of the relative motion."""
        return 1 / self.m1 + 1 / self.behind

    @property
    def resonance(self) -> float:
        """Hz of the free rig on the joint."""
        return float(np.sqrt(self.stiffness * self.inverse_mass)) / (2 * np.pi)

    @property
    def half_width(self) -> float:
        """Hz between the resonance and where its response has fallen to half power."""
        return self.damping * self.inverse_mass / (4 * np.pi)


def setup_of(
    joint: Joint,
    declared: Measurement | None,
    noise: Mapping[str, float],
    amplitude: float | None,
    sample_rate: float | None,
    decibel: float | None = None,
) -> Setup:
    """The rig of a measurement file, or one that is assumed; every assumption in a sentence."""
    assumed: list[str] = []
    k, c = (float(x) for x in joint.jacobian(Motion(np.zeros(()), np.zeros(())), joint.initial_state(0.0)))
    if not (np.isfinite(k) and np.isfinite(c)):
        k, c = _secant(joint, _reach_of(joint, amplitude, []))
    if k <= 0:
        raise InputError(f"joint {joint.name!r}: it has no stiffness at rest, expected one that holds a rig together")
    reach = _reach_of(joint, amplitude, assumed)
    if declared is None:
        m1, carried, channels = _DRIVEN, (_CARRIED / 2, _CARRIED / 2), tuple(RIG_CHANNELS)
        assumed.append(
            f"a rig of {_DRIVEN:g} kg driven by P and {_CARRIED:g} kg behind the joint, a2 and a3 on halves of it; "
            "give yours with --rig"
        )
    else:
        rig = rig_of(declared)
        if rig.m1 is None:
            raise InputError(f"{declared.source}: the mass of {declared.driven!r} is unknown, expected kg for a plan")
        if any(k or c for k, c in rig.suspensions.values()):
            assumed.append("bodies that nothing holds to ground, though the measurement file declares a suspension")
        m1, carried = rig.m1, (rig.m2, rig.m3) if rig.has_third else (rig.passive_mass, 0.0)
        channels = tuple(n for n in RIG_CHANNELS if n in {c.name for c in declared.channels})
        if "P" not in channels:
            raise InputError(f"{declared.source}: no channel P, expected the driving force, which a plan is made of")
    for name in noise:
        if name not in channels:
            raise InputError(f"--noise: no channel {name!r} on this rig, it has {', '.join(channels)}")
    f0 = float(np.sqrt(k * (1 / m1 + 1 / sum(carried)))) / (2 * np.pi)
    rate = sample_rate or (declared.sample_rate if declared is not None else None)
    if rate is None:
        rate = next((r for r in sorted(_RATES) if r >= _SAMPLES_A_CYCLE * f0), _SAMPLES_A_CYCLE * f0)
        assumed.append(f"a sample rate of {rate:g} Hz, {rate / f0:.0f} times the {f0:.4g} Hz of the rig on its joint")
    if rate < 6 * f0:
        raise InputError(
            f"the sample rate is {rate:g} Hz and the rig moves on its joint at {f0:.4g} Hz, expected six times as "
            "many samples, or heavier bodies"
        )
    if c <= 0:
        c = 0.01 * 2 * k / (2 * np.pi * f0)
    silent = [n for n in channels if n not in noise]
    if silent and decibel is None:
        assumed.append(f"noise {_DECIBEL:g} dB below the top level in {', '.join(silent)}; give yours with --noise")
    quieter = float(10 ** (-(_DECIBEL if decibel is None else decibel) / 20))
    return Setup(m1, carried, channels, dict(noise), rate, reach, k, c, declared, tuple(assumed), quieter)


def _reach_of(joint: Joint, amplitude: float | None, assumed: list[str]) -> float:
    """How far the joint may be moved: as said, as identified, or short of where its contacts lift off."""
    known = joint.validity.get("amplitude")
    if amplitude is not None:
        if known is not None and amplitude > known[1] * (1 + 1e-9):
            assumed.append(f"{1e6 * amplitude:.3g} µm as asked for, beyond the {1e6 * known[1]:.3g} µm of its validity")
        return amplitude
    if known is not None and known[1] > 0:
        assumed.append(f"motion within {_OF_RANGE:g} of the {1e6 * known[1]:.3g} µm that the joint is valid for")
        return _OF_RANGE * known[1]
    lifts = [law.lift_off_displacement for law in joint.laws if isinstance(law, HertzGuide)]
    if lifts:
        assumed.append(f"motion within {_OF_LIFT_OFF:g} of the {1e6 * min(lifts):.3g} µm at which a row lifts off")
        return _OF_LIFT_OFF * min(lifts)
    raise InputError(
        f"joint {joint.name!r}: neither a validity nor a preload says how far it may be moved, expected --amplitude"
    )


def _secant(joint: Joint, reach: float) -> tuple[float, float]:
    """Stiffness and damping at half the reach, where the joint has no tangent at rest."""
    gain = complex(np.ravel(joint.first_harmonic(reach / 2, 1e3).gain)[0])
    return gain.real, gain.imag / 1e3
