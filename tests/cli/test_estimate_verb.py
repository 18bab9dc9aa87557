"""``jointlib estimate`` and ``modes`` of what it wrote: from hits to lobes, the promised keys, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

from jointlib import read_measurement
from jointlib.rig.tap_test import MODES

HITS = Path("machines/library/tap_test/hits.measurement.toml")
MACHINE = """
schema = "jointlib/machine/1"
[[component]]
name = "tool"
file = "tool.component.toml"
[tool]
x = "tool.x"
[response]
frequency = ["100 Hz", "2400 Hz"]
force = ["200 N"]
[cutting]
process = "turning"
specific = "1000 N/mm^2"
speed = [2000, 6000]
"""


@pytest.fixture
def tapped(here: Path) -> Path:
    """The frequency response of the tap test that ships."""
    assert jointlib(f"estimate {HITS} -o tip.measurement.toml").status == 0
    return Path("tip.measurement.toml")


def test_its_keys_tell_the_responses_and_what_was_left_out(here: Path) -> None:
    done = jointlib(f"estimate {HITS} -o tip.measurement.toml --plot tip.svg --json")
    assert (done.status, done.complaints) == (0, [])
    data = done.json
    assert data["file"] == "tip.measurement.toml"
    (frf,) = data["frfs"]
    assert {"drive", "response", "lines", "averages", "coherence"} <= set(frf)
    assert (frf["drive"], frf["response"], frf["averages"]) == ("tool.x", "tool.x", 6)
    assert ["double hit" in said for said in data["left_out"]] == [True, False]
    assert ["clipped in hammer" in said for said in data["left_out"]] == [False, True]
    assert all(Path(path).is_file() for path in data["files"])
    assert Path("tip.svg").read_text("utf-8").count("<svg") == 1
    written = read_measurement(Path("tip.measurement.toml"))
    assert (written.kind, written.simulated) == ("frf", True)


def test_the_same_records_give_the_same_bytes(tapped: Path) -> None:
    files = [tapped, *Path().glob("tip_*.csv")]
    before = [path.read_bytes() for path in files]
    assert len(files) == 2
    jointlib(f"estimate {HITS} -o {tapped}")
    assert [path.read_bytes() for path in files] == before


@pytest.mark.slow
def test_modes_of_what_was_estimated_are_those_that_made_the_records(tapped: Path) -> None:
    done = jointlib(f"modes {tapped} -o tool.component.toml --plot chart.png --json")
    assert (done.status, done.complaints) == (0, [])
    data = done.json
    assert [set(mode) for mode in data["modes"]] == [
        {"frequency", "damping_ratio", "frequency_error", "damping_ratio_error"}
    ] * 3
    for mode, (f, zeta, _) in zip(data["modes"], MODES, strict=True):
        assert abs(mode["frequency"] - f) < 4 * mode["frequency_error"] < 2e-4 * f
        assert abs(mode["damping_ratio"] - zeta) < 4 * mode["damping_ratio_error"] < 0.01 * zeta
    assert 0 < data["fit_error"] < 0.01
    assert data["proportional"]
    assert Path("chart.png").read_bytes().startswith(b"\x89PNG")
    said = jointlib("inspect tool.component.toml").out
    assert said.startswith("modal component, dofs x\n")


def test_the_component_leads_to_lobes_and_lies_under_the_measured_lines(tapped: Path) -> None:
    assert jointlib(f"modes {tapped} -o tool.component.toml").status == 0
    Path("tool.toml").write_text(MACHINE)
    depth = jointlib("lobes tool.toml --speed 3000 --json").json["minimum_depth"]
    # Turning: the least depth is 1/(2·Ks·|min Re G|).
    f = np.linspace(100.0, 2400.0, 40001)
    s = 2j * np.pi * f
    G = sum(1 / m / (s**2 + 2 * z * 2 * np.pi * fn * s + (2 * np.pi * fn) ** 2) for fn, z, m in MODES)
    assert depth == pytest.approx(-1 / (2e9 * np.min(np.real(G))), rel=5e-3)
    (laid,) = jointlib(f"frf tool.toml --measured {tapped} -o f.npz --json").json["measured"]
    assert laid["frac"] > 0.99


def test_measured_lines_are_a_component_of_their_own(tapped: Path) -> None:
    lines = 'kind = "frf"\ndofs = ["x"]\nmeasurement = "tip.measurement.toml"\ninterpolation = "rational"'
    Path("tool.toml").write_text(MACHINE.replace('file = "tool.component.toml"', lines))
    band = jointlib("lobes tool.toml --speed 3000 --samples 40 --json").json["band"]
    low, middle, high = (row[0] for row in band["depth"])
    assert 0 < low <= middle <= high < 1.05 * low


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (f"estimate {HITS} -o {HITS}", "is the measurement itself"),
        ("estimate machines/library/guide_mill/rig.measurement.toml -o x.toml", "kind is 'rig', expected 'impact' or"),
        (f"modes {HITS}", "`jointlib estimate"),
        (f"identify {HITS} --law linear -o x.joint.toml", "kind is 'impact', identify needs"),
        (f"trace {HITS} --joint machines/library/guide.joint.toml -o out", "the frequency responses that `jointlib"),
        ("modes machines/library/lathe.toml -o x.component.toml", "-o: given with machines/library/lathe.toml"),
        ("modes tip.measurement.toml --all", "--all: given with measurements"),
        ("modes tip.measurement.toml --band 10:50 -o x.component.toml", "lines"),
        ("modes machines/library/lathe.toml machines/library/lathe.toml", "a second machine"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_sentence(tapped: Path, command: str, said: str) -> None:
    done = jointlib(command)
    assert done.status == 2
    assert said in done.err
    assert done.err.count("\n") == 1
    assert not list(Path().glob("x.*"))
