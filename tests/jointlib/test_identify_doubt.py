"""Where a fit may end wrong: false minima, slow lines that drown the motion, laws that miss something."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_samples import GUIDE, PERIOD, RATE, noisy, shaken
from test_identify_files import RIG

from jointlib.answers.identify import identify
from jointlib.errors import InputError
from jointlib.identification import Identification
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins
from jointlib.loop.balance.floor import Floor, excited_band
from jointlib.loop.balance.spectra import Spectra

LAWS = ("hertz-guide", "viscous")
SLIPPING = Joint((*GUIDE.laws, Jenkins(4e7, 30.0)))
FORCE = '  { name = "P", quantity = "force", unit = "N" },\n]\n'
BAND = "band = [2000, 20000]\n"


def told(
    folder: Path, levels: tuple[float, ...], joint: Joint = GUIDE, band: str = BAND, slow: float = 0.0
) -> Identification:
    """A fit of simulated records; ``slow`` m/s² of a1 at 100 Hz repeat as what folds down from beyond the band does."""
    hum = slow * np.sin(2 * np.pi * 100 * np.arange(4 * PERIOD) / RATE)
    files = []
    for one in noisy(shaken(joint, levels), seed=1):
        np.savez(folder / one.source.file.name, **{**one.channels, "a1": one.channels["a1"] + hum})  # type: ignore[arg-type]
        files.append(f'{{ file = "{one.source.file.name}" }}')
    head = RIG[: RIG.index("]\nrecord = ")].replace(BAND, band) + FORCE
    (folder / "rig.measurement.toml").write_text(f"{head}record = [ {', '.join(files)} ]\n")
    return identify(folder / "rig.measurement.toml", laws=LAWS, output=folder / "guide.joint.toml")


@pytest.mark.thorough
def test_a_guide_shaken_far_past_lift_off_is_found_from_the_default_start(tmp_path: Path) -> None:
    found = told(tmp_path, (1500.0,))
    assert found.parameters["hertz_guide.preload"].value == pytest.approx(612, rel=0.03)
    assert found.parameters["hertz_guide.kappa"].value == pytest.approx(3.98e-8, rel=0.01)


@pytest.mark.thorough
def test_slow_lines_that_drown_the_motion_are_left_out_where_no_band_is_given(tmp_path: Path) -> None:
    found = told(tmp_path, (60.0, 150.0), band="", slow=3.0)
    assert found.parameters["hertz_guide.preload"].value == pytest.approx(612, rel=0.03)
    assert found.joint.validity["frequency"][0] > 1000
    assert any("no band is given" in m for m in found.messages)


def test_a_preload_hidden_by_what_the_law_leaves_is_not_laid_to_the_amplitudes(tmp_path: Path) -> None:
    found = told(tmp_path, (60.0, 150.0), band="band = [50, 20000]\n", slow=3.0)
    (said,) = (m for m in found.messages if m.startswith("hertz_guide.preload"))
    assert "too small" not in said
    assert "N where noise explains" in said


@pytest.mark.thorough
def test_a_law_that_misses_something_is_said_with_both_numbers(tmp_path: Path) -> None:
    found = told(tmp_path, (60.0, 150.0), SLIPPING)
    (error,) = found.errors
    assert error.noise is not None
    assert error.rms > 3 * error.noise
    (said,) = (m for m in found.messages if "not fit" in m)
    assert f"{error.rms:.4g} N are left where noise explains {error.noise:.3g} N" in said
    source = tmp_path / "rig.measurement.toml"
    assert f"jointlib trace {source} --joint {tmp_path / 'guide.joint.toml'} -o traced" in said
    assert found.parameters["viscous.damping"].doubted
    assert not found.parameters["hertz_guide.contact_angle"].doubted
    assert "it does not fit" in found.finding()


def test_a_law_that_fits_is_silent(tmp_path: Path) -> None:
    found = told(tmp_path, (60.0, 150.0))
    (error,) = found.errors
    assert error.noise is not None
    assert error.rms == pytest.approx(error.noise, rel=0.3)
    assert not any("not fit" in m for m in found.messages)
    assert not any(p.doubted for p in found.parameters.values())


def test_a_record_in_which_nothing_stands_out_of_the_noise_is_refused_by_name() -> None:
    drive = np.ones(257, dtype=complex)
    record = Spectra("still.npz", "", "", RATE, 4, 128, {"a1": drive})
    with pytest.raises(InputError, match=r"still\.npz: no line of a1 stands out of its noise"):
        excited_band([record], [Floor({"a1": np.full(257, 10.0)}, "scatter", {})], None)
