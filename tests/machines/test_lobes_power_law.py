"""A force that grows with a power of the chip: its first harmonic by three routes, and simulated thresholds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from jointlib.errors import InputError
from machines import Lumped, Machine
from machines.cutting.process.power_law import depth_ratio, first_harmonic, touching_ratio
from machines.lobes import minimum_depth_of_mode, notch_delays, witness

MASS, NATURAL, RATIO, SPECIFIC, FEED = 25.0, 100.0, 0.02, 1e9, 1e-4
STIFFNESS = MASS * (2 * np.pi * NATURAL) ** 2


@pytest.mark.parametrize("exponent", [0.6, 0.75, 1.0, 1.3])
@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.99, 1.0, 1.2, 3.0])
def test_first_harmonic_is_the_integral_over_the_cycle(exponent: float, ratio: float) -> None:
    edge = np.arccos(max(-1.0, -1 / ratio))
    integral = quad(lambda t: max(0.0, 1 + ratio * np.cos(t)) ** exponent * np.cos(t), 0, edge, epsabs=1e-12)[0]
    assert float(first_harmonic(ratio, exponent)) == pytest.approx(2 * integral / (np.pi * ratio), rel=1e-9)


def test_small_vibrations_feel_the_tangent() -> None:
    assert float(first_harmonic(0.0, 0.75)) == pytest.approx(0.75, rel=1e-15)
    assert float(depth_ratio(1e-4, 0.75)) == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize(
    ("exponent", "depths", "touch"),
    [(0.75, (0.989501, 0.956527, 0.938595), 0.935049), (0.6, (0.981158, 0.921090, 0.886434), 0.878635)],
)
def test_published_depths_at_which_a_vibration_persists(
    exponent: float, depths: tuple[float, ...], touch: float
) -> None:
    np.testing.assert_allclose(depth_ratio([0.5, 0.9, 0.99], exponent), depths, atol=6e-7)
    assert touching_ratio(exponent) == pytest.approx(touch, abs=6e-7)
    assert float(depth_ratio(1.0, exponent)) == pytest.approx(touching_ratio(exponent), rel=1e-12)


@pytest.mark.parametrize(("chip", "balanced"), [(0.1, 0.997747), (0.2, 0.991049), (0.4, 0.965135)])
def test_the_cubic_expansion_of_the_force_is_left_as_the_chip_varies_more(chip: float, balanced: float) -> None:
    """Five harmonics of the expansion of Kalmár-Nagy, Stépán & Moon, lengths in 12/5 of the feed: 1/(1 + 9B²/40)."""
    expanded, exact = 1 / (1 + 9 / 40 * chip**2), float(depth_ratio(2.4 * chip, 0.75))
    assert expanded == pytest.approx(balanced, abs=2e-4)
    assert 0 < expanded - exact < 0.8 * chip**4
    assert float(depth_ratio(2.4 * 0.4, 0.75)) == pytest.approx(0.9460, abs=5e-5)


def test_a_linear_force_knows_no_amplitude_until_contact_is_lost() -> None:
    np.testing.assert_allclose(depth_ratio([0.1, 0.5, 1.0], 1.0), 1.0, rtol=1e-15)
    after = depth_ratio([1.01, 1.5, 2.0], 1.0)
    assert np.all(np.diff(after) > 0)
    assert after[0] > 1


@pytest.mark.parametrize(("ratio", "exponent"), [(-0.1, 0.75), (0.5, 0.0), (0.5, np.nan)])
def test_what_is_no_vibration_or_no_power_is_refused(ratio: float, exponent: float) -> None:
    with pytest.raises(InputError, match="power law"):
        first_harmonic(ratio, exponent)


def lathe(exponent: float) -> Machine:
    """One linear mode that cuts with a force ∝ h^q."""
    damping = 2 * RATIO * np.sqrt(STIFFNESS * MASS)
    slide = Lumped(
        "slide", ("x",), np.array([[MASS]]), damping=np.array([[damping]]), stiffness=np.array([[STIFFNESS]])
    )
    cut = {"process": "turning", "specific": SPECIFIC, "feed": FEED, "exponent": exponent}
    return Machine((slide,), tool={"x": "slide.x"}, frequency=(50.0, 200.0), cutting=cut)


@pytest.mark.slow
@pytest.mark.parametrize("exponent", [0.75, 0.6])
@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99])
def test_simulated_threshold_is_where_the_first_harmonic_says(ratio: float, exponent: float) -> None:
    """At the first notch; the vibrations that grow leave the cut and settle at 1.0 to 1.6 times the feed."""
    period = notch_delays(NATURAL, RATIO, 1)[0]
    chatter = NATURAL * np.sqrt(1 + 2 * RATIO)
    turned = abs(1 - np.exp(-2j * np.pi * chatter * period))
    amplitude = ratio * FEED / turned
    depth = float(minimum_depth_of_mode(STIFFNESS, RATIO, SPECIFIC) * depth_ratio(ratio, exponent))
    found = witness(lathe(exponent), 60 / period, depth, amplitude * np.geomspace(0.95, 1.25, 6), frequency=chatter)
    threshold = found.cycles[0]
    assert not threshold.stable
    assert threshold.amplitude == pytest.approx(amplitude, rel=5e-3)
    if ratio > 0.5:
        settled = [c.amplitude * turned / FEED for c in found.cycles if c.stable]
        assert len(settled) == 1
        assert 1.0 < settled[0] < 1.6
        assert np.all(found.lost_contact == found.grows) or np.all(found.lost_contact[-2:])
