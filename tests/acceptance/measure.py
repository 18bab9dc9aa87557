"""A simulated test: five records and one with the exciter off, sensors, noise, written as a measurement file."""

from __future__ import annotations

import zlib
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from effects import COLOUR, KAPPA, PRELOAD, Channels, Injected, Maker, Scale, guide_stiffness
from excitation import PERIOD, RATE, SIGNALS, force
from generator import (
    Array,
    ComplexArray,
    Equation,
    Motion,
    NoMotion,
    Rig,
    by_mixture,
    by_steps,
    linear_motion,
    no_force,
    sampled,
)
from scipy.signal import cont2discrete, lfilter

STORED_SEED = 20260314
LEVELS = (0.35, 0.6, 1.0, 1.0, 0.8)
"""Of the drive; the last record is sealed. The highest level is there twice, with phases of its own."""
SETTLE, KEPT = 2, 4
"""Periods of run-in, which are in the file, and periods used."""
PEAK = 3e-6
"""m; peak relative motion of the declared rig at the highest level."""
_OFF_PEAK, _DRIVES = 0.2, 6
DECLARED = Rig()
FEED = 0.4
"""m/s; the slide moves at a constant speed in every record."""
SAMPLES = (SETTLE + KEPT) * PERIOD


@dataclass(frozen=True)
class Simulated:
    """Clean channels, (records, samples) each; the last row is the quiet record."""

    channels: Channels
    position: Array
    truth: Injected
    guide: bool
    """True where the declared joint is a preloaded ball guide."""
    weaker: float = 1.0
    """The effect was made this much smaller because no periodic motion was found at its drawn size."""


def seeds(*words: str | int) -> np.random.Generator:
    """Random numbers that belong to these words alone."""
    return np.random.default_rng([STORED_SEED, *(zlib.crc32(str(w).encode()) for w in words)])


def simulate(
    name: str, makers: tuple[Maker, ...], signal: str, seed: int, size: float = 1.0, even: bool = False
) -> Simulated:
    """A test with the effects ``makers`` hidden in it; ``size`` scales all of them, ``even`` sizes them alike."""
    rng = seeds(name, signal, seed)
    guide = "preload" in name.split("+")
    declared = Rig(stiffness=guide_stiffness(PRELOAD)) if guide else DECLARED
    lines = np.array([SIGNALS[signal](rng) for _ in LEVELS]) * np.array(LEVELS)[:, None]
    once = force(lines, 1, 8)
    z, v = linear_motion(declared, once, 1 / (8 * RATE))
    gain = PEAK / float(np.abs(z[2:4]).max())
    lines, v = lines * gain, v * gain
    scale = Scale(
        z=PEAK,
        v=float(np.abs(v[2:4]).max()),
        v_rms=float(np.sqrt(np.mean(v[2:4] ** 2))),
        force=declared.stiffness * PEAK,
        records=len(LEVELS),
        window=SAMPLES / RATE,
        position=rng.uniform(0.0, 0.5, len(LEVELS)),
        feed=FEED,
    )
    shares = rng.uniform(0.02, 0.06, len(makers))
    if even:
        shares = evened(makers, shares, deepcopy(rng), scale, z * gain, v)
    state = rng.bit_generator.state
    for weaker in (1.0, 0.7, 0.5, 0.35, 0.25):
        rng.bit_generator.state = state
        truth = combined([make(rng, scale, size * weaker * share) for make, share in zip(makers, shares, strict=True)])
        try:
            motion = driven_to_peak(truth, declared, lines, signal)
            break
        except NoMotion:
            # Near its resonance a rig with a strong effect may have several motions, or none that repeats.
            continue
    else:
        raise NoMotion(f"{name}, {signal}, seed {seed}: no periodic motion even at a quarter of its size")
    time = np.arange(SAMPLES) / RATE
    channels = clean(truth, motion)
    for shown in truth.sensors:
        channels = shown(channels, time)
    position = scale.position[:, None] + FEED * time
    return Simulated(channels, np.concatenate([position, position[:1] * 0 + 0.25]), truth, guide, weaker)


def evened(
    makers: tuple[Maker, ...], shares: Array, rng: np.random.Generator, scale: Scale, z: Array, v: Array
) -> Array:
    """Shares that give every force the same weight in the records, not at the peak of the motion.

    What spring and damper cannot take up of it has half the drawn share of the *rms* joint force (1 to 3 %), as the
    gains and masses have by themselves. At equal peaks dry friction outweighs a cubic spring twenty times.
    """
    z, v = (np.tile(x, (1, SETTLE + KEPT)) for x in (z, v))
    time = np.arange(z.shape[1]) / (8 * RATE)
    omega = 2 * np.pi * np.fft.rfftfreq(z.shape[1], 1 / (8 * RATE))
    out = shares.copy()
    for i, make in enumerate(makers):
        part = make(rng, scale, float(shares[i]))
        f = part.hidden(z, v, time) + np.fft.irfft(part.dynamic(omega) * np.fft.rfft(z), z.shape[1])
        known = np.array([x.ravel() for x in (z, v, np.ones_like(z))])
        left = f.ravel() - np.linalg.lstsq(known @ known.T, known @ f.ravel())[0] @ known
        if np.any(f):
            out[i] *= 0.5 * shares[i] * scale.force * np.std(z) / scale.z / np.std(left)
    return out


def combined(parts: list[Injected]) -> Injected:
    """Several effects at once, the first one first."""
    if len(parts) == 1:
        return parts[0]
    return Injected(
        families=tuple(f for p in parts for f in p.families),
        site=" ".join(p.site or "-" for p in parts),
        hidden=lambda z, v, t: np.asarray(sum(p.hidden(z, v, t) for p in parts)),
        dynamic=lambda omega: np.asarray(sum(p.dynamic(omega) for p in parts)),
        rig=next((p.rig for p in parts if p.rig), None),
        sensors=tuple(s for p in parts for s in p.sensors),
        rocking=next((p.rocking for p in parts if p.rocking), None),
        inputs={q: x for p in parts for q, x in p.inputs.items()},
        louder={c: noise for p in parts for c, noise in p.louder.items()},
        memory=any(p.memory for p in parts),
        whole_record=any(p.whole_record for p in parts),
    )


def driven_to_peak(truth: Injected, declared: Rig, lines: ComplexArray, signal: str) -> Motion:
    """The motion under a drive turned up, or down, until the highest level moves by PEAK again.

    Shares are of the peak joint force *in the records*. Friction near a resonance may well stop most of the motion of
    the linear rig; under the same drive a share of the linear force would be several times as much of what is left.
    """
    for _ in range(_DRIVES):
        motion = moved(truth, declared, lines, signal)
        reached = float(np.abs(motion.z[2:4]).max())
        if abs(reached / PEAK - 1) < _OFF_PEAK:
            return motion
        lines = lines * np.clip(PEAK / reached, 0.5, 2.0)
    raise NoMotion(f"no drive brings the motion to {PEAK:g} m: {reached:.2e} m at the last one")


def moved(truth: Injected, declared: Rig, lines: ComplexArray, signal: str) -> Motion:
    """The steady motion on the fine grid: one period, or the whole record where no period repeats."""
    periods, fine = (SETTLE + KEPT, 4) if truth.whole_record else (1, 8)
    drive = force(lines, periods, fine)
    peak = np.abs(drive).max()
    drive = drive + truth.distortion * drive**3 / peak**2
    base = truth.rig or declared
    rig = replace(base, hidden=truth.hidden, dynamic=truth.dynamic)
    equation = Equation(rig, drive, 1 / (fine * RATE))
    if truth.memory or truth.whole_record or truth.hidden is no_force:
        return by_mixture(equation)
    if signal == "AM":
        # Close to the resonance a softening rig may jump to far more than its box: the drive is lowered then.
        return by_steps(equation, 4, (2, PEAK))
    try:
        return by_mixture(equation)
    except NoMotion:
        return by_steps(equation, 4)


def clean(truth: Injected, motion: Motion) -> Channels:
    """What perfect sensors show, the quiet record last."""
    a2, a3 = motion.a2, motion.a2
    if truth.rocking:
        X = rocked(motion.drive, SAMPLES // PERIOD, truth.rocking)
        X *= truth.rocking[2] * np.sqrt(np.mean(a2**2) / np.mean(X**2))
        a2, a3 = a2 + X, a3 - X
    out = {}
    for name, x in {"a1": motion.a1, "a2": a2, "a3": a3, "P": motion.drive}.items():
        periods = 6 if truth.whole_record else 1
        record = np.tile(sampled(x, periods * PERIOD), (1, 6 // periods))
        out[name] = np.concatenate([record, np.zeros((1, SAMPLES))])
    return out


def rocked(drive: Array, turns: int, mode: tuple[float, float, float]) -> Array:
    """Acceleration of an oscillator pushed by the drive, stepped in time until it is steady; size is arbitrary."""
    omega, zeta = 2 * np.pi * mode[0], mode[1]
    fine = 8 * RATE
    system = [1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega**2]
    b, a, _ = cont2discrete(system, 1 / fine, method="foh")  # type: ignore[call-overload]
    x = lfilter(np.ravel(b), a, np.tile(drive, (1, turns)), axis=-1)
    return np.asarray(x[:, -drive.shape[1] :])


HEAD = """schema = "jointlib/measurement/1"
kind = "rig"
simulated = true
sample_rate = "102400 Hz"
period = {period}
settle = {settle}
band = ["2 kHz", "20 kHz"]
driven = "runner_block"
[bodies]
runner_block = 0.942
rail = 1.1
block = 1.1
"""
CHANNEL = '[[channel]]\nname = "{name}"\nquantity = "{quantity}"\nunit = "{unit}"\n'
INPUT = {"temperature": "K"}
LINEAR = 'kind = "linear"\nstiffness = 5.9e8\n'
GUIDE = f'kind = "hertz-guide"\npreload = {PRELOAD}\nkappa = {1.05 * KAPPA}\nfixed = ["preload", "contact_angle"]\n'


def write(test: Simulated, folder: Path, decibel: float, name: str, seed: int) -> tuple[Path, Path]:
    """Measurement and joint file of a test whose channels carry noise ``decibel`` below their own size."""
    rng = seeds("noise", name, f"{decibel:g}", seed)
    shown = {c: x + noise(rng, x, COLOUR[c], decibel) for c, x in test.channels.items()}
    for c, (times, colour) in test.truth.louder.items():
        further = noise(rng, test.channels[c], colour, decibel)
        shown[c] = shown[c] + times * further * np.array([*LEVELS, 0.0])[:, None]
    shown = {c: rounded_to_counts(x) for c, x in shown.items()}
    shown["pos"] = test.position + 1e-7 * rng.standard_normal(test.position.shape)
    body = {"a1": "runner_block", "a2": "rail", "a3": "block"}
    text = HEAD.format(period=PERIOD, settle=SETTLE)
    for c in shown:
        quantity, unit = ("acceleration", "m/s^2") if c in body else ("force", "N") if c == "P" else ("position", "m")
        text += CHANNEL.format(name=c, quantity=quantity, unit=unit) + (f'body = "{body[c]}"\n' if c in body else "")
    for quantity, x in test.truth.inputs.items():
        shown[quantity] = x
        text += CHANNEL.format(name=quantity, quantity=quantity, unit=INPUT[quantity]) + "input = true\n"
    for r in range(len(LEVELS) + 1):
        role = "quiet" if r == len(LEVELS) else "sealed" if r == len(LEVELS) - 1 else "fit"
        np.savez(folder / f"r{r}.npz", allow_pickle=False, **{c: x[r] for c, x in shown.items()})
        level = "off" if role == "quiet" else f"level {LEVELS[r]:g}"
        text += f'[[record]]\nfile = "r{r}.npz"\nrole = "{role}"\ncondition = "{level}"\n'
    measurement, joint = folder / "rig.measurement.toml", folder / "start.joint.toml"
    measurement.write_text(text)
    spring = GUIDE if test.guide else LINEAR
    joint.write_text(
        f'schema = "jointlib/joint/1"\nname = "guide"\n[[law]]\n{spring}[[law]]\nkind = "viscous"\ndamping = 400.0\n'
    )
    return measurement, joint


def noise(rng: np.random.Generator, x: Array, colour: float, decibel: float) -> Array:
    """Noise of first order; its strength follows from the records to fit and is the same in all."""
    white = rng.standard_normal((len(x), x.shape[1] + 200))
    coloured = lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white, axis=-1)[:, 200:]
    size = np.sqrt(np.mean(x[: len(LEVELS) - 1] ** 2)) * 10 ** (-decibel / 20)
    return np.asarray(size * coloured)


def rounded_to_counts(x: Array) -> Array:
    """A converter of 16 bits over 1.3 times what it has to show."""
    count = 2.6 * np.abs(x).max() / 2**16
    return np.asarray(np.rint(x / count) * count)
