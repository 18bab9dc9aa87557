"""A mass on a dry slide: its amplitude falls by a straight line and it stops beside where the spring has no force."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib import read_measurement
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.ringdown.identify import Ringdown, identify_ringdown

RATE, OMEGA, FIRST, MASS = 5000.0, 2 * np.pi * 11.0, 3e-3, 12.0
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
RELEASED, LASTS = 0.2, 2.0
"""s."""


def slide(share: float) -> dict[str, Array]:
    """Let go from 3 mm at 0.2 s: between turning points the spring swings about ±F/k, without loss; F/k is ``share`` of
    3 mm. Where the spring pulls with less than F at a turning point it stays."""
    t = np.arange(round(RATE * LASTS)) / RATE - RELEASED
    x, v, a = np.full(len(t), FIRST), np.zeros(len(t)), np.zeros(len(t))
    turn, beside = FIRST, share * FIRST
    half = np.pi / OMEGA
    for i in range(1000):
        middle = beside if turn > 0 else -beside
        if abs(turn) <= beside:
            x[t >= i * half] = turn
            break
        now = (t >= i * half) & (t < (i + 1) * half)
        swing, phase = turn - middle, OMEGA * (t[now] - i * half)
        x[now] = middle + swing * np.cos(phase)
        v[now], a[now] = -OMEGA * swing * np.sin(phase), -(OMEGA**2) * swing * np.cos(phase)
        turn = middle - swing
    return {"displacement": x, "velocity": v, "acceleration": a}


def told(folder: Path, motion: Array, quantity: str, laws: list[str] | None = None) -> Ringdown:
    np.savetxt(folder / "x.csv", motion, header="x", comments="")
    file = folder / "x.measurement.toml"
    file.write_text(
        f'schema = "jointlib/measurement/1"\nkind = "ringdown"\nsample_rate = {RATE}\nmodal_mass = {MASS}\n'
        f'[[channel]]\nname = "x"\nquantity = "{quantity}"\nunit = "{UNITS[quantity]}"\n[[record]]\nfile = "x.csv"\n'
    )
    return identify_ringdown(read_measurement(file), laws)


def heard(share: float, quantity: str, decibel: float, seed: int) -> Array:
    """With noise and an offset."""
    x = slide(share)[quantity]
    size = float(np.max(np.abs(x)))
    return (
        x + 0.2 * size + 10 ** (-decibel / 20) * size / np.sqrt(2) * np.random.default_rng(seed).standard_normal(len(x))
    )


@pytest.mark.parametrize("quantity", list(UNITS))
@pytest.mark.parametrize("share", [0.015, 0.03, 0.045], ids=["16 cycles", "8 cycles", "5 cycles"])
def test_a_dry_slide_tells_its_friction_and_its_spring(tmp_path: Path, share: float, quantity: str) -> None:
    found = told(tmp_path, heard(share, quantity, 60, 0), quantity, ["linear", "coulomb"])
    assert found.fit is not None
    values = found.fit.joint.parameters
    stiffness = MASS * OMEGA**2
    assert values["coulomb.slip_force"] == pytest.approx(share * FIRST * stiffness, rel=0.02)
    assert values["linear.stiffness"] == pytest.approx(stiffness, rel=4e-3)


@pytest.mark.parametrize("quantity", list(UNITS))
def test_errors_of_a_dry_slide_hold_the_truth(tmp_path: Path, quantity: str) -> None:
    off = list[Array]()
    for seed in range(4):
        (b,) = told(tmp_path, heard(0.03, quantity, 45, seed), quantity).modes[0]
        ratio = 2 / np.pi * 0.03 * FIRST / b.amplitude
        off.append(np.array([(b.omega - OMEGA) / b.omega_error, (b.damping_ratio - ratio) / b.ratio_error]))
    for deviations in np.concatenate(off, axis=1):
        assert 0.05 < np.sqrt(np.mean(deviations**2)) < 1.6


def test_a_dry_slide_that_stops_too_soon_is_refused_with_its_frequency(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"motion at 1[01]\.\d+ Hz stand out"):
        told(tmp_path, heard(0.09, "displacement", 60, 0), "displacement")
