"""Test cuts simulated in time: many at once, stepped by angle, with loss of contact, as a microphone hears them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array


@dataclass(frozen=True)
class Shop:
    """A mill: modes of the tool by axis (Hz, ζ, kg), and what its cut pushes with; SI."""

    x: tuple[tuple[float, float, float], ...] = ((600.0, 0.03, 0.8),)
    y: tuple[tuple[float, float, float], ...] = ((680.0, 0.03, 0.7),)
    tangential: float = 7e8
    normal: float = 2.1e8
    teeth: int = 2
    arc: tuple[float, float] = (np.pi / 2, np.pi)
    feed: float = 5e-5
    damping: float = 0.0
    """C of process damping in N/m."""
    diameter: float = 0.02
    softens: float = 0.0
    """Share by which every frequency falls per 10 000 rpm."""


def vibration(shop: Shop, speed: Array, depth: Array, revolutions: int = 60, steps: int = 120) -> Array:
    """Displacement of the tool in m, (steps in time, cuts, axes), steps of a tooth period over ``steps`` each.

    Every mode by steps that are exact where it rings freely, with the chip met by every tooth from what the one before
    left; the edge leaves the cut where that is negative.
    """
    count = len(speed)
    dt = 60 / (speed * shop.teeth * steps)
    modes = [(axis, *mode) for axis, several in enumerate((shop.x, shop.y)) for mode in several]
    axis = np.array([m[0] for m in modes])
    omega = 2 * np.pi * np.array([m[1] for m in modes])[:, None] * (1 - shop.softens * speed / 1e4)
    zeta, mass = np.array([m[2] for m in modes])[:, None], np.array([m[3] for m in modes])[:, None]
    kept = np.exp(-2 * zeta * omega * dt)
    turned = np.cos(omega * np.sqrt(1 - zeta**2) * dt)
    pulled = (1 + kept - 2 * np.sqrt(kept) * turned) / dt
    z, v = np.zeros((len(modes), count)), np.zeros((len(modes), count))
    total = revolutions * shop.teeth * steps
    out = np.zeros((total, count, 2))
    pick = np.array([axis == 0, axis == 1], dtype=float)
    cutting_speed = np.pi * shop.diameter * speed / 60
    angles = 2 * np.pi * np.arange(shop.teeth) / shop.teeth
    for i in range(total):
        q = pick @ z
        before = out[i - steps - 1] if i > steps else np.zeros((count, 2))
        rate = pick @ v
        force = np.zeros((2, count))
        for phi in (angles + 2 * np.pi * (i + 0.5) / (steps * shop.teeth)) % (2 * np.pi):
            if not shop.arc[0] < phi < shop.arc[1]:
                continue
            s, c = np.sin(phi), np.cos(phi)
            chip = shop.feed * s + (q[0] - before[:, 0]) * s + (q[1] - before[:, 1]) * c
            cuts = chip > 0
            rubbing = shop.damping / cutting_speed * (rate[0] * s + rate[1] * c) * cuts
            Ft = shop.tangential * depth * np.maximum(chip, 0)
            Fn = shop.normal * depth * np.maximum(chip, 0) + depth * rubbing
            force[0] += -Ft * c - Fn * s
            force[1] += Ft * s - Fn * c
        v = kept * v - pulled * (z - (pick.T @ force) / (mass * omega**2))
        z = z + dt * v
        out[i] = (pick @ z).T
    return out


def sounds(
    shop: Shop, speed: Array, depth: Array, rate: float = 8192.0, noise: float = 0.02, seed: int = 0
) -> list[Array]:
    """What a microphone records of each cut once it has settled: the speed of the surface, in no unit, with noise."""
    speed, depth = np.asarray(speed, dtype=float), np.asarray(depth, dtype=float)
    steps, rng = 120, np.random.default_rng(seed)
    q = vibration(shop, speed, depth, steps=steps)
    heard = []
    for k in range(len(speed)):
        dt = 60 / (speed[k] * shop.teeth * steps)
        velocity = np.gradient(q[:, k, 0] + 0.7 * q[:, k, 1], dt)
        time = np.arange(len(velocity)) * dt
        at = np.arange(0.5 * time[-1], time[-1], 1 / rate)
        x = np.interp(at, time, velocity)
        heard.append(x + noise * np.std(x) * rng.standard_normal(len(x)))
    return heard


def written(
    folder: Path, shop: Shop, speed: Array, depth: Array, rate: float = 8192.0, records: bool = True, seed: int = 0
) -> Path:
    """A measurement of cuts with the sound of each."""
    text = 'schema = "jointlib/measurement/1"\nkind = "cuts"\nsimulated = true\n'
    text += f'sample_rate = {rate}\n[cutting]\nteeth = {shop.teeth}\nmode = "down"\nimmersion = 0.5\n'
    text += '[[channel]]\nname = "microphone"\nquantity = "sound"\nunit = "Pa"\n'
    for k, x in enumerate(sounds(shop, speed, depth, rate, seed=seed)):
        np.savez(folder / f"cut_{k}.npz", microphone=x)
        text += f'[[cut]]\nname = "cut {k}"\nspeed = {speed[k]}\ndepth = {depth[k]}\nfile = "cut_{k}.npz"\n'
    (folder / "cuts.measurement.toml").write_text(text)
    return folder / "cuts.measurement.toml"
