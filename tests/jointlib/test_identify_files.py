"""From measurement files to a joint with its errors, range and origin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_samples import GUIDE, noisy, shaken

from jointlib.errors import InputError
from jointlib.identification import Identification, identify
from jointlib.io.joint_file import read_joint, write_joint
from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous
from jointlib.measurement import Measurement
from jointlib.rig.static import StaticRig, push_and_pull

LIBRARY = Path(__file__).parents[2] / "machines" / "library" / "guide_mill"

RIG = """schema = "jointlib/measurement/1"
kind = "rig"
sample_rate = 102400
period = 1024
band = [2000, 20000]
driven = "runner"
bodies = { runner = 0.942, rail = 1.1, block = 1.1 }
channel = [
  { name = "a1", quantity = "acceleration", body = "runner" , unit = "m/s^2" },
  { name = "a2", quantity = "acceleration", body = "rail", unit = "m/s^2" },
  { name = "a3", quantity = "acceleration", body = "block", unit = "m/s^2" },
]
record = [ { file = "r0.npz" }, { file = "r1.npz" }, { file = "never_written.npz", role = "sealed" } ]
"""
STATIC = """schema = "jointlib/measurement/1"
kind = "static"
channel = [
  { name = "left", quantity = "displacement", unit = "um" },
  { name = "right", quantity = "displacement", unit = "um" },
  { name = "load", quantity = "force", unit = "kN" },
]
record = [ { file = "curve.csv" } ]
"""
PATH = """schema = "jointlib/measurement/1"
kind = "path"
sample_rate = 1000
carriage = "unknown"
channel = [ { name = "x", quantity = "position", unit = "m" }, { name = "F", quantity = "force", unit = "N" } ]
record = [ { file = "drive.npz" } ]
"""


def rig(folder: Path) -> Measurement:
    for one in noisy(shaken(), seed=1):
        np.savez(folder / one.source.file.name, **dict[str, Any](one.channels))
    (folder / "rig.measurement.toml").write_text(RIG)
    return read_measurement(folder / "rig.measurement.toml")


def static(folder: Path) -> Measurement:
    z, f = StaticRig(Joint(GUIDE.laws[:1])).curve(np.random.default_rng(2), push_and_pull(7.4e-6, 40))
    tilt = 0.3e-6
    table = np.column_stack([1e6 * (z + tilt), 1e6 * (z - tilt), f / 1000])
    np.savetxt(folder / "curve.csv", table, delimiter=",", header="left,right,load", comments="")
    (folder / "static.measurement.toml").write_text(STATIC)
    return read_measurement(folder / "static.measurement.toml")


def path(folder: Path) -> Measurement:
    t = np.arange(20000) / 1000
    x = 0.1 * np.sin(2 * np.pi * 0.37 * t) + 0.03 * np.sin(2 * np.pi * 1.9 * t)
    v = np.gradient(x, 1e-3)
    force = 95 * np.gradient(v, 1e-3) + 204 * v + 20 * np.tanh(v / 1e-3) - 3
    noise = np.random.default_rng(3).standard_normal(len(t))
    np.savez(folder / "drive.npz", x=x, F=force + 2 * noise)
    (folder / "path.measurement.toml").write_text(PATH)
    return read_measurement(folder / "path.measurement.toml")


def within(found: Identification, name: str, truth: float, errors: float = 4.0) -> bool:
    one = found.parameters[name]
    assert one.standard_error is not None
    return abs(one.value - truth) < errors * one.standard_error


def test_static_test_tells_the_guide_and_the_shaken_one_the_damping(tmp_path: Path) -> None:
    start = Joint((HertzGuide(500.0, 5e-8), Viscous(300.0)), "slide", frozenset({"hertz_guide.contact_angle"}))
    found = identify((static(tmp_path), rig(tmp_path)), start=start)
    assert within(found, "hertz_guide.preload", 612.0)
    assert within(found, "hertz_guide.kappa", 3.98e-8)
    assert found.parameters["viscous.damping"].value == pytest.approx(480.0, rel=0.02)
    assert found.parameters["hertz_guide.contact_angle"].status == "assumed"
    assert found.parameters["viscous.damping"].status == "fitted"
    assert [e.kind for e in found.errors] == ["static", "rig"]
    assert found.errors[0].rms == pytest.approx(16, rel=0.15)
    assert found.rms_unit == "N"
    assert found.static is not None
    assert found.joint.name == "slide"
    assert len(found.surfaces) == 2
    assert any("45 deg is assumed" in m for m in found.messages)
    assert any("1 sealed record left closed" in m for m in found.messages)


def test_range_and_origin_come_from_the_data(tmp_path: Path) -> None:
    found = identify((static(tmp_path), rig(tmp_path)), laws=("hertz-guide", "viscous"))
    largest = np.max(np.abs(shaken().displacement))
    assert found.joint.validity["amplitude"][1] == pytest.approx(largest, rel=0.2)
    assert found.joint.validity["frequency"] == (2000.0, 20000.0)
    assert found.joint.validity["velocity"][1] == pytest.approx(np.max(np.abs(shaken().velocity)), rel=0.01)
    names = [f["file"] for f in found.joint.provenance["files"]]
    assert [said.split(":")[0] for said in found.joint.provenance["residuals"]] == [e.measurement for e in found.errors]
    assert all(said.endswith("% of the largest") for said in found.joint.provenance["residuals"])
    assert names == ["static.measurement.toml", "curve.csv", "rig.measurement.toml", "r0.npz", "r1.npz"]


def test_shaken_records_alone_tell_the_guide_where_it_nearly_lifts_off(tmp_path: Path) -> None:
    found = identify((rig(tmp_path),), laws=("hertz-guide", "viscous"))
    for name, truth in (("hertz_guide.preload", 612.0), ("hertz_guide.kappa", 3.98e-8), ("viscous.damping", 480.0)):
        assert within(found, name, truth)


@pytest.mark.thorough
def test_small_motion_tells_the_stiffness_but_no_preload(tmp_path: Path) -> None:
    steady = shaken(GUIDE, (2.0, 3.0))
    m = rig(tmp_path)
    for one in noisy(steady, seed=5):
        np.savez(tmp_path / one.source.file.name, **dict[str, Any](one.channels))
    found = identify((m,), start=Joint((HertzGuide(500.0, 5e-8), Viscous(300.0))))
    assert found.parameters["hertz_guide.preload"].value == 500.0
    assert found.parameters["hertz_guide.preload"].status == "assumed"
    guide, true = found.joint.laws[0], GUIDE.laws[0]
    assert isinstance(guide, HertzGuide)
    assert isinstance(true, HertzGuide)
    assert guide.stiffness == pytest.approx(true.stiffness, rel=2e-3)
    assert any("too small to tell it (the records reach" in m for m in found.messages)


def test_fixed_parameters_never_move(tmp_path: Path) -> None:
    fixed = frozenset({"hertz_guide.preload", "viscous.damping"})
    start = Joint((HertzGuide(612.0, 5e-8), Viscous(300.0)), fixed=fixed)
    found = identify((static(tmp_path), rig(tmp_path)), start=start)
    assert found.parameters["hertz_guide.preload"].value == 612.0
    assert found.parameters["viscous.damping"].value == 300.0
    assert found.parameters["viscous.damping"].status == "fixed"
    assert found.parameters["viscous.damping"].standard_error is None
    assert found.joint.covariance is not None
    assert found.joint.covariance.names == ("hertz_guide.kappa",)
    assert found.joint.fixed == fixed


def test_surface_from_files_with_chosen_and_given_order(tmp_path: Path) -> None:
    m = rig(tmp_path)
    chosen = identify((m,), laws=("chebyshev",))
    assert len(chosen.orders) == 28
    assert chosen.errors[0].relative < 0.01
    given = identify((m,), laws=("polynomial",), order=(3, 1))
    assert given.parameters["polynomial.coefficients[1][0]"].value == pytest.approx(640e6, rel=0.02)
    assert given.parameters["polynomial.coefficients[3][0]"].value < 0
    again = identify((m,), start=given.joint)
    assert again.joint.parameters == given.joint.parameters


def test_moved_carriage_tells_mass_friction_and_offset(tmp_path: Path) -> None:
    start = Joint((Viscous(100.0), Coulomb(5.0, 1e-3)), fixed=frozenset({"coulomb.smoothing_velocity"}))
    found = identify((path(tmp_path),), start=start)
    for name, truth in (("carriage", 95.0), ("viscous.damping", 204.0), ("coulomb.slip_force", 20.0), ("offset", -3.0)):
        assert found.parameters[name].value == pytest.approx(truth, rel=0.02)
    assert found.errors[0].rms < 2.0
    assert "carriage" not in found.joint.parameters


def test_same_files_give_the_same_joint_file(tmp_path: Path) -> None:
    m = static(tmp_path), rig(tmp_path)
    texts = []
    for name in ("one.toml", "two.toml"):
        joint = identify(m, laws=("hertz-guide", "viscous")).joint
        write_joint(tmp_path / name, joint)
        assert read_joint(tmp_path / name).parameters == joint.parameters
        texts.append((tmp_path / name).read_bytes())
    assert texts[0] == texts[1]


def test_what_cannot_be_fitted_is_refused_in_a_sentence(tmp_path: Path) -> None:
    curve, shaker = static(tmp_path), rig(tmp_path)
    with pytest.raises(InputError, match="either laws or a start joint"):
        identify((curve,))
    with pytest.raises(InputError, match="no measurement"):
        identify((), laws=("viscous",))
    with pytest.raises(InputError, match=r"viscous\.damping has no data"):
        identify((curve,), laws=("hertz-guide", "viscous"))
    with pytest.raises(InputError, match=r"viscous\.damping has no data"):
        identify((curve,), laws=("linear", "viscous"))
    with pytest.raises(InputError, match="expected a surface alone"):
        identify((shaker,), laws=("chebyshev", "viscous"))
    with pytest.raises(InputError, match="no surface among the laws"):
        identify((shaker,), laws=("viscous",), order=(3, 1))
    with pytest.raises(InputError, match="rig and path measurements together"):
        identify((shaker, path(tmp_path)), laws=("viscous",))
    with pytest.raises(InputError, match="did you mean 'viscous'"):
        identify((shaker,), laws=("vicsous",))


def test_static_curve_alone_takes_any_elastic_law(tmp_path: Path) -> None:
    found = identify((static(tmp_path),), laws=("linear", "cubic"))
    assert found.parameters["cubic.stiffness3"].value < 0
    surface = identify((static(tmp_path),), laws=("chebyshev",))
    assert np.shape(surface.joint.laws[0].coefficients)[1] == 1  # type: ignore[attr-defined]
    assert surface.errors[0].rms < found.errors[0].rms


def test_shipped_guide_is_identified_and_leaves_more_than_noise() -> None:
    tests = [read_measurement(LIBRARY / f"{n}.measurement.toml") for n in ("static", "rig")]
    found = identify(tests, start=read_joint(LIBRARY / "start.joint.toml"))
    # Preload round 600 N from the catalogue of such guides, stiffness round 600 N/um as the paper's.
    assert 500 < found.parameters["hertz_guide.preload"].value < 700
    assert found.joint.provenance["simulated"] is True
    # The quiet record bounds what sensors can do: 0.32 m/s² on 2.2 kg, averaged over four periods, below half a newton.
    assert found.rms > 10
    assert any("simulated" in m for m in found.messages)


@pytest.mark.parametrize("gain", [1, -1])
def test_a_force_whose_sign_is_turned_is_told(tmp_path: Path, gain: int) -> None:
    """Stiffness and damping come out below zero, which no joint has that stands by itself."""
    time = np.arange(2000) / 1000
    z, v = 8e-6 * np.sin(2 * np.pi * 2 * time), 8e-6 * 4 * np.pi * np.cos(2 * np.pi * 2 * time)
    force = 8e7 * z + 3e4 * v + np.random.default_rng(1).normal(size=len(z))
    np.savez(tmp_path / "p.npz", x=z, F=force)
    (tmp_path / "p.measurement.toml").write_text(
        'schema = "jointlib/measurement/1"\nkind = "path"\nsample_rate = 1000\nchannel = [ { name = "x", quantity = '
        f'"displacement", unit = "m" }}, {{ name = "F", quantity = "force", unit = "N", gain = {gain} }} ]\n'
        'record = [ { file = "p.npz" } ]\n'
    )
    found = identify([read_measurement(tmp_path / "p.measurement.toml")], laws=["linear"])
    told = [said for said in found.messages if "below zero: it pushes on the way it is moved" in said]
    assert len(told) == (gain < 0)
    assert found.parameters["linear.stiffness"].value == pytest.approx(8e7 * gain, rel=1e-2)
