"""The export as a whole: same bytes, honest limits, refusals, nothing half done."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from host import GUIDE, exported
from samples import KAPPA

from fmu.export import export_fmu
from fmu.playback.reference import ReferenceRun, reference_run
from fmu.system.step_limit import Range, operating_range, step_limit
from fmu.verify import verify_fmu
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous


def test_same_joint_from_two_folders_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    again = export_fmu(GUIDE, "other.fmu", runtime="python")
    assert again.file.read_bytes() == exported(GUIDE).file.read_bytes()


def test_export_tells_what_its_user_must_know() -> None:
    told = exported(GUIDE)
    assert told.runtime == "python"
    assert set(told.platforms) >= {"linux64", "win64"}
    assert told.verified_with[0].startswith("FMPy ")
    assert "runs only in hosts that bring Python" in told.messages[0]
    assert any("2c/(3k)" in text and f"{told.max_step:.3g} s" in text for text in told.messages)


def test_verification_repeats_the_reference_run_and_reads_the_limit() -> None:
    found = verify_fmu(exported(GUIDE).file)
    assert found.max_step == exported(GUIDE).max_step
    assert found.platforms == exported(GUIDE).platforms
    assert found.difference <= 1e-12
    assert found.samples > 300


def test_limit_takes_the_stiffest_and_least_damped_point_of_the_validity_range() -> None:
    joint = dataclasses.replace(
        Joint((HertzGuide(630.0, KAPPA), Viscous(503.0))), validity={"amplitude": (0.0, 3e-6), "velocity": (0.0, 0.1)}
    )
    limit = step_limit(joint, operating_range(joint))
    # K0/2 [sqrt(1+u) + sqrt(1-u)] is largest at rest while both rows touch.
    assert limit.stiffness == pytest.approx(joint.laws[0].stiffness, rel=1e-9)  # type: ignore[attr-defined]
    assert limit.max_step == pytest.approx(2 * 503.0 / (3 * limit.stiffness), rel=1e-12)
    wide = dataclasses.replace(joint, validity={"amplitude": (0.0, 20e-6), "velocity": (0.0, 0.1)})
    assert step_limit(wide, operating_range(wide)).stiffness > 1.1 * limit.stiffness


def test_limit_counts_a_spring_that_acts_only_in_a_narrow_band_beside_its_play() -> None:
    joint = Joint((Jenkins(4e7, 4e7 * 1e-7, clearance=31e-6), Viscous(10.0)))
    wide = dataclasses.replace(joint, validity={"amplitude": (0.0, 1e-3), "velocity": (0.0, 0.1)})
    assert step_limit(wide, operating_range(wide)).stiffness == pytest.approx(4e7)


@pytest.mark.parametrize(("factor", "grows"), [(0.9, False), (1.1, True)])
def test_mass_on_the_joint_is_stable_just_below_the_limit_and_not_above(factor: float, grows: bool) -> None:
    k, c, m = 1e7, 1e3, 10.0
    joint = Joint((Linear(k), Viscous(c)))
    limit = step_limit(joint, operating_range(joint)).max_step
    assert limit is not None
    h = factor * limit
    # Mass and joint exchange values at the end of each step: the force that acts was computed from older values.
    move = np.array([[1.0, h], [0.0, 1.0]])
    push = np.array([h**2 / 2, h]) / m
    loop = np.zeros((3, 3))
    loop[:2, :2], loop[:2, 2], loop[2, :2] = move, -push, [k, c]
    radius = np.max(np.abs(np.linalg.eigvals(loop)))
    assert (radius > 1.0) == grows


@pytest.mark.thorough
def test_joint_without_damping_gets_no_step_but_advice(tmp_path: Path) -> None:
    told = export_fmu(Joint((Linear(1e7), Coulomb(5.0))), tmp_path / "a.fmu")
    assert told.max_step is None
    assert any("model exchange" in text for text in told.messages)
    assert verify_fmu(told.file).max_step is None


@pytest.mark.thorough
def test_joint_without_stiffness_sets_no_limit(tmp_path: Path) -> None:
    told = export_fmu(Joint((Viscous(10.0),), "1 Dämpfer & <Co>"), tmp_path / "a.fmu")
    assert told.max_step is None
    assert any("no stiffness" in text for text in told.messages)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"runtime": "rust"}, "runtime is 'rust', expected 'c' or 'python'"),
        ({"fmi": 3, "runtime": "python"}, "fmi is 3, which needs the native runtime; leave the runtime out or use 'c'"),
        ({"fmi": 1}, "fmi is 1, expected 2 or 3"),
        ({"path": "a.zip"}, "a.zip: the file name of an FMU, expected one that ends in .fmu"),
        ({"joint": Joint()}, "no laws, expected at least one"),
        ({"joint": dataclasses.replace(GUIDE, name="a\nb")}, "joint name is 'a\\nb', expected printable characters"),
        (
            {"joint": Joint((Viscous(np.array([1.0, 2.0])),))},  # type: ignore[arg-type]
            "viscous.damping is an array, expected one number for an FMU",
        ),
    ],
)
def test_what_cannot_be_exported_is_refused_in_a_sentence(
    change: dict[str, object], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = {"joint": GUIDE, "path": "a.fmu", **change}
    with pytest.raises(InputError) as error:
        export_fmu(**asked)  # type: ignore[arg-type]
    assert said in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
def test_fmu_that_contradicts_the_law_is_not_handed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def off_by_a_millionth(joint: Joint, over: Range) -> ReferenceRun:
        run = reference_run(joint, over)
        run.rows[100, 3] *= 1 + 1e-6
        return run

    monkeypatch.setattr("fmu.export.reference_run", off_by_a_millionth)
    (tmp_path / "a.fmu").write_bytes(b"the old file")
    with pytest.raises(CheckFailed, match=r"a\.fmu: force at t = .* the reference has"):
        export_fmu(GUIDE, tmp_path / "a.fmu")
    assert (tmp_path / "a.fmu").read_bytes() == b"the old file"
    assert len(list(tmp_path.iterdir())) == 1
