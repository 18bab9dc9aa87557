"""A joint along a path that lacks a spring or a damper, which no friction and no late channel may stand for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.effect import Scale
from jointlib.effects.damper import MissingDamper
from jointlib.effects.spring import MissingSpring
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.viscous import Viscous
from jointlib.loop.trace import trace
from jointlib.measurement import Channel, Measurement, RecordSource

RATE, STIFFNESS, DAMPING = 200.0, 5000.0, 60.0
TONE = 2 * np.pi


def springy_damper(folder: Path) -> Measurement:
    """A spring beside a damper, moved by a tone at three levels; noise of a thousandth of the force."""
    rng, t = np.random.default_rng(5), np.arange(0, 12, 1 / RATE)
    records = []
    for level in (2e-3, 5e-3, 10e-3):
        z, v = level * np.sin(TONE * t), level * TONE * np.cos(TONE * t)
        force = STIFFNESS * z + DAMPING * v + 0.05 * rng.standard_normal(len(t))
        np.savez(folder / f"{level}.npz", allow_pickle=False, z=z, F=force)
        records.append(RecordSource(folder / f"{level}.npz", "fit"))
    channels = Channel("z", "displacement", "m", "m", 1.0), Channel("F", "force", "N", "N", 1.0)
    return Measurement(folder / "m.toml", "path", channels, tuple(records), sample_rate=RATE)


@pytest.mark.parametrize(
    ("start", "family"), [(Viscous(100.0), "linear"), (Linear(4000.0), "viscous")], ids=["spring", "damper"]
)
def test_what_is_lacking_is_named_and_no_late_force(tmp_path: Path, start: JointLaw, family: str) -> None:
    """It was a force that comes 2.2 s late, or 12 ms early."""
    report = trace(springy_damper(tmp_path), Joint((start,)))
    assert report.chosen is not None
    assert report.chosen.family == family
    assert report.mended.parameters["linear.stiffness"] == pytest.approx(STIFFNESS, rel=2e-3)
    assert report.mended.parameters["viscous.damping"] == pytest.approx(DAMPING, rel=2e-2)
    assert report.error_after["relative"] < 3e-3


SCALE = Scale(1e-3, 1e-2, 0.0)


def test_a_spring_is_lacking_where_nothing_answers_a_displacement_that_is_held() -> None:
    slip = Jenkins(1e6, 10.0)
    for without in (Viscous(1.0), Coulomb(1.0, 1e-3), slip):
        assert MissingSpring().shapes(SCALE, Joint((without, Viscous(1.0)))) == ({},)
        for spring in (Linear(1.0), HertzContact(100.0, 1e-7)):
            assert MissingSpring().shapes(SCALE, Joint((without, spring))) == ()


def test_a_damper_is_lacking_where_no_force_grows_with_the_speed() -> None:
    for undamped in (Linear(1.0), Coulomb(1.0, 1e-3), QuadraticDamping(1.0)):
        assert MissingDamper().shapes(SCALE, Joint((undamped,))) == ({},)
    assert MissingDamper().shapes(SCALE, Joint((Viscous(1.0), Linear(1.0)))) == ()
    assert MissingDamper().apply(np.array([-1.0]), {}, Joint((Linear(1.0),))) is None
