"""The flank of a worn edge: what it takes out of a vibration, and the chatter that it holds at a size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import InputError
from machines import Lumped, Machine, lobes_at_amplitude, stability_lobes
from machines.cutting.process.flank import flank_damping, linear_down_to
from machines.lobes import Cutting

HERTZ, ZETA, MASS, K_S, DIAMETER = 400.0, 0.02, 1.0, 1e9, 0.002
K_SP = 5e12
SPEED = 6500.0
WORN = Cutting("turning", specific=K_S, indentation=K_SP, wear_land=1e-4, clearance=3.0, diameter=DIAMETER)
V = np.pi * DIAMETER * SPEED / 60


def displaced(y: Array, per_wave: int, wave: float, land: float, slope: float) -> Array:
    """Area under the flank at every moment of a periodic motion, laid over the surface point by point."""
    ds = wave / per_wave
    area = np.zeros_like(y)
    for step in range(int((land + 2 * np.max(np.abs(y)) / slope) / ds) + 1):
        s = (step + 0.5) * ds
        deep = y - (np.roll(y, step) + np.roll(y, step + 1)) / 2
        area += ds * (deep if s < land else np.maximum(deep - (s - land) * slope, 0.0))
    return area


@pytest.mark.thorough
@pytest.mark.parametrize("amplitude", [1e-7, 5e-6, 3e-5])
@pytest.mark.parametrize("hertz", [400.0, 3000.0])
def test_the_damping_is_the_energy_that_the_displaced_area_takes(amplitude: float, hertz: float) -> None:
    count, wave = 4000, V / hertz
    theta = 2 * np.pi * np.arange(count) / count
    area = displaced(amplitude * np.cos(theta), count, wave, 1e-4, np.tan(np.radians(3.0)))
    work = -2 * K_SP * np.mean(area * np.sin(theta)) / (2 * np.pi * hertz * amplitude) * V
    assert flank_damping(WORN, amplitude, hertz, SPEED) == pytest.approx(work, rel=3e-3)


def test_long_flat_waves_feel_the_linear_form_and_others_less_or_more() -> None:
    linear = WORN.process_damping
    assert linear == pytest.approx(K_SP * 1e-8 / 2)
    assert flank_damping(WORN, 0.0, 20.0, SPEED) == pytest.approx(linear, rel=1e-3)
    ends = linear_down_to(WORN, 2000.0, 0.1)
    assert flank_damping(WORN, 0.0, 2000.0, ends) == pytest.approx(0.9 * linear, rel=1e-6)
    sizes = [flank_damping(WORN, A, 400.0, SPEED) for A in (1e-9, 2e-5, 6e-5)]
    assert sizes[0] == pytest.approx(flank_damping(WORN, 0.0, 400.0, SPEED), rel=1e-3)
    assert sizes[0] < sizes[1] < sizes[2]


def lathe() -> Machine:
    k = MASS * (2 * np.pi * HERTZ) ** 2
    tool = Lumped("tool", ("x",), np.array([[MASS]]), np.array([[2 * ZETA * np.sqrt(k * MASS)]]), np.array([[k]]))
    cutting = {"process": "turning", "specific": K_S, "diameter": DIAMETER}
    cutting |= {"indentation": K_SP, "wear_land": 1e-4, "clearance": 3.0}
    return Machine((tool,), (), tool={"x": "tool.x"}, frequency=(100.0, 1500.0), cutting=cutting)


def settled(depth: float, start: Array, revolutions: int, per_wave: int = 120) -> Array:
    """Amplitudes in m at the end, the delay equation stepped from motions of ``start`` over their own waves."""
    natural, dt = 2 * np.pi * HERTZ, 1 / HERTZ / per_wave
    dt = 60 / SPEED / round(60 / SPEED / dt)
    turn = round(60 / SPEED / dt)
    ds, slope = V * dt, np.tan(np.radians(3.0))
    back = int((1e-4 + 2 * 3e-4 / slope) / ds) + 2
    s = ds * np.arange(back)
    held = np.clip((1e-4 - (s - ds / 2)) / ds, 0.0, 1.0)
    beyond = np.maximum(s - 1e-4, 0.0) * slope
    before = max(turn, back)
    y = np.zeros((turn * revolutions + before, len(start)))
    y[:before] = start * np.cos(natural * dt * np.arange(-before, 0))[:, None]
    c, k = 2 * ZETA * natural, natural**2
    for i in range(before - 1, len(y) - 1):
        deep = y[i] - y[i - back + 1 : i + 1][::-1]
        face = np.maximum(deep - beyond[:, None], 0.0)
        area = ds * (held[:, None] * deep + (1 - held[:, None]) * face).sum(axis=0)
        force = -depth * (K_S * (y[i] - y[i - turn]) + K_SP * area) / MASS
        # Central differences: the damper stands between the two steps.
        y[i + 1] = (2 * y[i] - (1 - c * dt / 2) * y[i - 1] + dt**2 * (force - k * y[i])) / (1 + c * dt / 2)
    return np.asarray(np.max(np.abs(y[-turn:]), axis=0))


@pytest.mark.slow
def test_chatter_settles_where_the_face_of_the_flank_meets_its_waves() -> None:
    machine = lathe()
    onset, at = (float(lobes_at_amplitude(machine, [SPEED], A).depth[0]) for A in (1e-9, 2e-5))
    assert at > 1.05 * onset
    ends = settled(at, np.array([1e-5, 8e-5]), 400)
    np.testing.assert_allclose(ends, 2e-5, rtol=0.1)  # told by one line, without what the flank adds in stiffness
    assert settled(0.9 * onset, np.array([1e-5]), 60)[0] < 5e-6


def test_the_limit_at_an_amplitude_takes_the_flank_by_its_shape_and_says_so() -> None:
    machine = lathe()
    small, large = (lobes_at_amplitude(machine, [SPEED, 9000.0], A) for A in (1e-9, 2e-5))
    assert np.all(large.depth > small.depth)
    equal = Cutting(
        "turning",
        specific=K_S,
        diameter=DIAMETER,
        process_damping=flank_damping(WORN, 2e-5, float(large.chatter_frequency[0]), SPEED),
    )
    plain = replace(machine, cutting={k: v for k, v in vars(equal).items() if v is not None})
    assert lobes_at_amplitude(plain, [SPEED]).depth[0] == pytest.approx(large.depth[0], rel=2e-3)
    assert any("takes the same energy" in text for text in large.warnings)
    soft = replace(machine, cutting={**(machine.cutting or {}), "indentation": 1e11})
    slow = lobes_at_amplitude(soft, [1500.0, SPEED])
    assert any("rpm the waves are so short against the wear land" in text for text in slow.warnings)


def test_half_a_flank_is_refused() -> None:
    for more, said in (
        ({"wear_land": None, "process_damping": None, "clearance": None}, "make a flank together, one is missing"),
        ({"wear_land": -1e-4}, "wear_land is -0.0001, expected more than 0"),
        ({"clearance": 95.0}, "clearance is 95 degrees, expected below 89"),
        ({"process_damping": 1e5}, "process_damping is 25000 N/m by indentation and wear_land; give one or the other"),
        ({"diameter": None}, "needs 'diameter'"),
    ):
        with pytest.raises(InputError, match=said):
            replace(WORN, **more)


@pytest.mark.parametrize("speed", [150.0, 700.0, 3000.0])
def test_a_rubbing_flank_is_limited_where_all_frequencies_say_so(speed: float) -> None:
    # Modes at 200 and 800 Hz and one at 20 kHz, whose damping by the flank is a hundred times what the first one feels.
    mass, natural = np.array([20.0, 4.0, 0.01]), 2 * np.pi * np.array([200.0, 800.0, 2e4])

    def G(f: Array) -> Array:
        s = 2j * np.pi * f[:, None]
        return np.sum(1 / (mass * (s**2 + 2 * 0.03 * natural * s + natural**2)), axis=1)

    cutting = Cutting(process="turning", specific=2e9, diameter=0.05, process_damping=3e4)
    lines = np.unique(np.concatenate([np.linspace(20.0, 6e4, 3000), np.linspace(150.0, 1000.0, 2000)]))
    found = stability_lobes(lambda f: G(f)[:, None, None], cutting, [speed], axes=("x",), frequency=lines)
    every = np.arange(20.0, 2.5e4, 0.005 * speed / 60)
    rubbing = 3e4 / (np.pi * 0.05 * speed / 60)
    value = G(every) * (2e9 * (1 - np.exp(-2j * np.pi * every * 60 / speed)) + 2j * np.pi * every * rubbing)
    i = np.flatnonzero((np.sign(value.imag[1:]) != np.sign(value.imag[:-1])) & (value.real[1:] < 0))
    share = value.imag[i] / (value.imag[i] - value.imag[i + 1])
    strongest = np.min(value.real[i] + share * (value.real[i + 1] - value.real[i]))
    assert found.depth[0] == pytest.approx(-1 / strongest, rel=2e-4)
