"""The rig under the measured force again, laws with memory in steady state, and the ceiling. All records simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from integrated_rig import FREQUENCY, INVERSE, LINEAR, M1, PEAK, Array, C, K, drive, integrated, observed
from numpy.typing import NDArray
from rig_samples import PERIOD, RATE

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.dahl import Dahl
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.quadratic import Quadratic
from jointlib.laws.structural_damping import StructuralDamping
from jointlib.laws.viscous import Viscous
from jointlib.loop.balance.ceiling import ceiling
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.resimulation import compared, resimulated, steady_motion
from jointlib.loop.balance.steady import steady_force


def linear_record(level: float = 1.0, stiffness: float = K, loss: complex | Array = 0.0, seed: int = 3) -> Observed:
    """A record of a linear rig, in closed form; ``loss`` is what it adds to the dynamic stiffness over j, N/m."""
    w = 2 * np.pi * FREQUENCY
    P, D = drive(level, seed), stiffness + 1j * w * C + 1j * loss
    Z = P / M1 / (INVERSE * D - w**2)
    return observed(P, np.asarray((P - D * Z) / M1, dtype=complex), np.asarray(D * Z, dtype=complex), seed)


SLIP, REACH = 0.03 * K * PEAK, 0.1 * PEAK
RELAXATION_TIME = 1 / (2 * np.pi * 4e3)


def cubic_rate(y: Array) -> tuple[float, Array]:
    return K * y[0] + C * y[1] + 0.1 * K / PEAK**2 * y[0] ** 3, np.zeros(0)


def coulomb_rate(y: Array) -> tuple[float, Array]:
    return K * y[0] + C * y[1] + SLIP * np.tanh(y[1] / 5e-3), np.zeros(0)


def jenkins_rate(y: Array) -> tuple[float, Array]:
    """The stretch of the spring follows ż unless it stands at the reach and is pulled further."""
    s, v = y[2], y[1]
    held = abs(s) >= REACH and s * v > 0
    return 0.8 * K * y[0] + C * v + 0.2 * K * s, np.array([0.0 if held else v])


def maxwell_rate(y: Array) -> tuple[float, Array]:
    """A spring of 0.2 K whose stretch is lost within the relaxation time."""
    return 0.8 * K * y[0] + C * y[1] + 0.2 * K * y[2], np.array([y[1] - y[2] / RELAXATION_TIME])


CASES = {
    "cubic": (Cubic(0.1 * K / PEAK**2), K, cubic_rate, 0),
    "coulomb": (Coulomb(SLIP, 5e-3), K, coulomb_rate, 0),
    "jenkins": (Jenkins(0.2 * K, 0.2 * K * REACH), 0.8 * K, jenkins_rate, 1),
    "maxwell": (Maxwell(0.2 * K, 0.2 * K * RELAXATION_TIME), 0.8 * K, maxwell_rate, 1),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_harmonic_balance_finds_the_motion_that_time_integration_settles_to(name: str) -> None:
    law, stiffness, rate, states = CASES[name]
    P = drive(1.0)
    z, f = integrated(P, rate, states)
    # The record the balance starts from is that of the linear rig: another motion.
    found = steady_motion(linear_record(), Joint((Linear(stiffness), Viscous(C), law)))
    assert found is not None
    difference = [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in ((found[0], z), (found[1], f))]
    print(name, difference)
    assert max(difference) < 1e-3  # noise of P (6e-5), steps across the corner of the slider (2e-4)


def test_a_linear_rig_comes_out_as_its_receptance() -> None:
    o, w = linear_record(), 2 * np.pi * FREQUENCY
    found = steady_motion(o, Joint((Linear(1.2 * K), Viscous(2 * C))))
    assert found is not None
    P = np.zeros(len(FREQUENCY), dtype=complex)
    lines = o.significant("P")[o.on_period]
    P[1 : len(lines) + 1] = lines / o.spectra.samples
    Z = P / M1 / (INVERSE * (1.2 * K + 2j * w * C) - w**2)
    n = len(found[0])
    np.testing.assert_allclose(found[0], np.fft.irfft(Z, n) * n, atol=1e-9 * np.abs(found[0]).max())


def test_the_true_joint_predicts_the_record_down_to_its_noise_and_a_wrong_one_does_not() -> None:
    o = linear_record()
    true, stiff = resimulated(o, Joint(LINEAR)), resimulated(o, Joint((Linear(1.1 * K), Viscous(C))))
    assert true is not None
    assert stiff is not None
    # 70 dB on P, a1, a2 over the band: a few parts in ten thousand.
    assert max(true.values()) < 2e-3
    assert min(stiff.values()) > 0.1
    table = compared(([o], Joint((Linear(1.1 * K), Viscous(C)))), ([o], Joint(LINEAR)))
    assert table["a1"] == {"before": pytest.approx(stiff["a1"]), "after": pytest.approx(true["a1"])}


def test_a_law_of_the_frequency_domain_takes_part() -> None:
    o = linear_record(loss=0.03 * K)
    with_loss = resimulated(o, Joint((*LINEAR, StructuralDamping(0.03 * K))))
    without = resimulated(o, Joint(LINEAR))
    assert with_loss is not None
    assert without is not None
    assert with_loss["a1"] < 2e-3 < 0.02 < without["a1"]


def test_a_relaxing_law_takes_part_line_by_line() -> None:
    corner = 1j * FREQUENCY / 4e3
    o = linear_record(loss=0.03 * K * corner / (1 + corner) / 1j)
    relaxing = resimulated(o, Joint((*LINEAR, Maxwell(0.03 * K, 0.03 * K * RELAXATION_TIME))))
    without = resimulated(o, Joint(LINEAR))
    assert relaxing is not None
    assert without is not None
    assert relaxing["a1"] < 2e-3 < 0.02 < without["a1"]


def test_a_free_rig_floats_to_where_the_mean_force_vanishes() -> None:
    found = steady_motion(linear_record(), Joint((*LINEAR, Quadratic(0.2 * K / PEAK))))
    assert found is not None
    z, f = found
    assert abs(f.mean()) < 1e-4 * np.abs(f).max()
    assert z.mean() == pytest.approx(-0.2 / PEAK * np.mean(z**2), rel=1e-3)


def test_without_a_force_there_is_no_prediction() -> None:
    o = linear_record()
    unforced = replace(o, rig=replace(o.rig, has_force=False))
    assert resimulated(unforced, Joint(LINEAR)) is None
    assert compared(([unforced], Joint(LINEAR)), ([unforced], Joint(LINEAR))) == {}


def swing(count: int, samples: int = 2048, seed: int = 5) -> tuple[Array, Array, float]:
    """Periodic z in m and ż of several records, falling in size."""
    w = 2 * np.pi * FREQUENCY[: samples // 4]
    inside = (w > 2 * np.pi * 2e3) & (w < 2 * np.pi * 8e3)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (count, len(w)))
    Z = np.where(inside, np.exp(1j * phases), 0)
    z = np.fft.irfft(Z, samples).T
    scale = PEAK * 0.6 ** np.arange(count) / np.abs(z).max(axis=0)
    return z * scale, np.fft.irfft(1j * w * Z, samples).T * scale, PERIOD / RATE / samples


def laws(d: Array) -> dict[str, JointLaw]:
    """Laws with memory whose parameters are a grid over the slip distance d in m."""
    one = np.ones_like(d)
    return {
        "jenkins": Jenkins(1.0, d),  # type: ignore[arg-type]
        "jenkins with play": Jenkins(1.0, d, 0.1 * d),  # type: ignore[arg-type]
        "iwan": Iwan((0.5 * one, 0.5 * one), (0.2 * d, d)),  # type: ignore[arg-type]
        "dahl": Dahl(1.0, d),  # type: ignore[arg-type]
        "bouc-wen": BoucWen(1.0, d, 2 * one, 0.5 * one),  # type: ignore[arg-type]
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", list(laws(np.ones(1))))
def test_segments_side_by_side_reach_the_steady_state_of_plain_stepping(name: str) -> None:
    z, v, h = swing(3)
    z, v = z[:, None], v[:, None]
    law = laws(PEAK * np.geomspace(0.02, 0.9, 4)[:, None])[name]
    state, plain = law.initial_state(np.zeros((4, 3)) + (z.max(axis=0) + z.min(axis=0)) / 2), np.empty((len(z), 4, 3))
    for _ in range(30):
        before = plain.copy()
        for i in range(len(z)):
            plain[i], state = law.step(Motion(z[i], v[i], h), state)
    unsettled = np.abs(plain - before).max()
    force = steady_force(law, z, v, h)
    np.testing.assert_allclose(force, plain, atol=1e-7 * np.abs(plain).max() + 10 * unsettled)


def test_a_law_on_one_path_needs_no_further_axes() -> None:
    z, v, h = swing(2)
    law = Jenkins(1e8, 20.0)
    both = steady_force(law, z, v, h)
    np.testing.assert_allclose(steady_force(law, z[:, 1], v[:, 1], h), both[:, 1], atol=1e-12 * np.abs(both).max())


def left_by(joint_of_truth: Joint) -> list[NDArray[np.complex128]]:
    """Whitened residuals of the linear joint where the truth adds a force along the same motion."""
    out = []
    for o in RECORDS:
        r = np.zeros((len(o.frequency), 3), dtype=complex)
        rng = np.random.default_rng(1)
        r += (rng.standard_normal(r.shape) + 1j * rng.standard_normal(r.shape)) / np.sqrt(2)
        z, v, h = o.path
        force = sum(steady_force(law, z, v, h) for law in joint_of_truth.laws)
        out.append(
            np.where(o.valid, r + o.whitened_force(o.lines_of(np.asarray(force))), 0) if joint_of_truth.laws else r
        )
    return out


RECORDS = [linear_record(level, seed=seed) for level, seed in ((0.5, 3), (1.0, 4), (1.0, 5))]


def test_a_smooth_law_without_memory_lies_under_the_ceiling_and_noise_has_none() -> None:
    assert ceiling(RECORDS, left_by(Joint())) is None
    smooth = ceiling(RECORDS, left_by(Joint((Cubic(0.02 * K / PEAK**2),))))
    assert smooth is not None
    assert smooth > 0.99


def test_what_no_function_of_the_motion_explains_lies_above_the_ceiling() -> None:
    rng = np.random.default_rng(9)
    stray = [
        10 * np.where(o.on_period[:, None] & o.valid, np.exp(2j * np.pi * rng.random((len(o.frequency), 3))), 0)
        for o in RECORDS
    ]
    share = ceiling(RECORDS, stray)
    assert share is not None
    assert share < 0.1
