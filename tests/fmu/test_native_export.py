"""Native FMUs: valid for every law, the same physics as the Python law, made from sources that travel along."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import re
import struct
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fmpy import platform, platform_tuple, read_model_description, simulate_fmu
from fmpy.build import build_platform_binary
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from fmpy.validation import validate_fmu
from host import GUIDE, JOINTS, label, law_force, path, running
from repeats import repeats
from samples import LAWS
from scipy.integrate import solve_ivp
from tools import require

from fmu.code.c_kernel import FOLDER, count, read_kernel
from fmu.export import Export, export_fmu
from fmu.members.archive import archive_bytes, read_archive, unpack
from fmu.members.build import PLATFORMS, Compiler, compilers, library
from fmu.members.description import Card, description_text
from fmu.members.native import native_parts, native_variables
from fmu.members.native_members import native_sources
from fmu.playback.replay import replay
from fmu.system.system import system_of_joint
from fmu.verify import verify_fmu
from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.gap import Gap
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous

EVERYTHING = Joint(tuple(law for law in LAWS if law.in_time), "everything")
"""Every law in one joint: one compilation for all kernels."""
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")
every_joint = pytest.mark.parametrize("joint", [*JOINTS, EVERYTHING], ids=label)
all_at_once = pytest.mark.parametrize(
    "joint", repeats([*JOINTS, EVERYTHING], lambda joint: joint is EVERYTHING), ids=label
)
both_versions = pytest.mark.parametrize("fmi", [2, 3])
one_version = pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 3))


@functools.cache
def _native(name: str, fmi: int) -> Export:
    joint = {"everything": EVERYTHING, "guide": GUIDE}[name]
    return export_fmu(joint, Path(_FOLDER.name) / f"{name}{fmi}.fmu", fmi=fmi, runtime="c")


def native(joint: Joint, fmi: int) -> Export:
    """The native export of the guide or of everything."""
    require("cc")
    return _native(joint.name, fmi)


def described(joint: Joint, fmi: int) -> str:
    return description_text(system_of_joint(joint), Card("model", "token", "c", fmi, 1e-5, 1.0, ("all.c",)))


def forces(file: Path, fmi: int, z: Array, v: Array, h: float, folder: Path) -> list[Array]:
    """Force after each step of h seconds, in two runs with a reset between."""
    unpack(file, read_archive(file), folder)
    read = read_model_description(str(folder))
    request = {
        "fmi": fmi,
        "guid": read.guid,
        "identifier": read.coSimulation.modelIdentifier,
        "folder": str(folder),
        "inputs": [1, 2],
        "outputs": [3],
        "time": [i * h for i in range(len(z))],
        "values": np.column_stack([z, v]).tolist(),
    }
    return [np.array(run)[:, 0] for run in replay(request)]


@both_versions
@all_at_once
def test_fmpy_finds_no_problem_in_the_description_of_any_law(joint: Joint, fmi: int, tmp_path: Path) -> None:
    for name, text in native_sources(system_of_joint(joint), fmi, "model", "token").items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "modelDescription.xml").write_text(described(joint, fmi))
    assert validate_fmu(str(tmp_path)) == []
    read = read_model_description(str(tmp_path))
    assert read.coSimulation.modelIdentifier == read.modelExchange.modelIdentifier == "model"


@all_at_once
def test_generated_c_pleases_a_strict_compiler(joint: Joint, tmp_path: Path) -> None:
    gcc = require("gcc")
    for name, text in native_sources(system_of_joint(joint), 3, "model", "token").items():
        (tmp_path / Path(name).name).write_text(text)
    flags = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I."]
    done = subprocess.run([gcc, *flags, "joint.c"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@every_joint
def test_c_kernels_declare_the_states_of_the_python_laws(joint: Joint) -> None:
    parts = native_parts(system_of_joint(joint))
    assert tuple(name for part in parts for name, _ in part.states) == joint.states
    assert parts[-1].parameters[1] == len(joint.parameters)
    units = {v.name: v.unit for v in native_variables(system_of_joint(joint))}
    for part in parts:
        for name, state in part.states:
            assert state.unit == units[name]


@pytest.mark.slow
@both_versions
def test_every_kernel_follows_its_python_law(fmi: int, tmp_path: Path) -> None:
    z, v = path()
    first, second = forces(native(EVERYTHING, fmi).file, fmi, z, v, 1e-5, tmp_path)
    expected = law_force(EVERYTHING, z, v, 1e-5)
    assert first == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))
    assert np.array_equal(first, second)


def test_guide_follows_its_python_law_and_both_versions_agree_bit_for_bit(tmp_path: Path) -> None:
    z, v = path()
    runs = [forces(native(GUIDE, fmi).file, fmi, z, v, 1e-5, tmp_path / str(fmi))[0] for fmi in (2, 3)]
    expected = law_force(GUIDE, z, v, 1e-5)
    assert runs[0] == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))
    assert np.array_equal(*runs)


@both_versions
def test_fmpy_finds_no_problem_in_the_whole_fmu(fmi: int) -> None:
    told = native(GUIDE, fmi)
    assert validate_fmu(str(told.file)) == []
    assert (told.runtime, told.platforms[0] if len(told.platforms) == 1 else platform) == (
        "c",
        platform if fmi == 2 else platform_tuple,
    )
    assert verify_fmu(told.file).difference <= 1e-12


@pytest.mark.slow
def test_library_starts_from_the_values_of_the_description(tmp_path: Path) -> None:
    with running([native(EVERYTHING, 2).file], tmp_path) as (fmu,):
        fmu.fmu.setupExperiment()
        fmu.fmu.enterInitializationMode()
        started = {v.name: float(v.start) for v in fmu.description.modelVariables if v.start is not None}
        assert {name: fmu.get(name) for name in started} == started
        fmu.fmu.exitInitializationMode()
    assert {name: started[name] for name in EVERYTHING.parameters} == EVERYTHING.parameters


RELAXING = Joint((Maxwell(4e7, 1.2e4),), "relaxing")
OMEGA = 2 * np.pi * 300.0


def relaxing(t: Array | float) -> tuple[Array, Array, Array]:
    """Displacement (m), velocity (m/s) and steady force (N) of a Maxwell element that swings by a micrometre.

    Spring k and damper c in series have the complex stiffness iωkc/(k + iωc).
    """
    maxwell = RELAXING.laws[0]
    k, c = maxwell.stiffness, maxwell.damping  # type: ignore[attr-defined]
    swing = 1e-6 * np.exp(1j * OMEGA * np.asarray(t))
    gain = 1j * OMEGA * k * c / (k + 1j * OMEGA * c)
    return swing.real, (1j * OMEGA * swing).real, (gain * swing).real


class Exchange:
    """An instance for model exchange that is past its first event."""

    def __init__(self, folder: Path, fmi: int) -> None:
        self.read = read_model_description(str(folder))
        self.place = {str(v.name): v.valueReference for v in self.read.modelVariables}
        self.rates = [str(u.variable.name) for u in self.read.derivatives]
        self.size = len(self.rates)
        self.fmu = (FMU2Model if fmi == 2 else FMU3Model)(
            guid=self.read.guid,
            modelIdentifier=self.read.modelExchange.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="exchange",
        )
        self.fmu.instantiate()
        if fmi == 2:
            self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        (self.fmu.newDiscreteStates if fmi == 2 else self.fmu.updateDiscreteStates)()
        self.fmu.enterContinuousTimeMode()
        self.read_values, self.write = (
            (self.fmu.getReal, self.fmu.setReal) if fmi == 2 else (self.fmu.getFloat64, self.fmu.setFloat64)
        )
        self.derivatives = self.fmu.getDerivatives if fmi == 2 else self.fmu.getContinuousStateDerivatives

    def at(self, t: float, z: float, v: float, x: Array) -> None:
        """Put time, inputs and continuous states."""
        self.fmu.setTime(t)
        self.write([1, 2], [z, v])
        self.fmu.setContinuousStates((ctypes.c_double * self.size)(*x), self.size)

    def moved(self) -> Array:
        """Rates of the continuous states."""
        rates = (ctypes.c_double * self.size)()
        self.derivatives(rates, self.size)
        return np.array(rates)

    def force(self) -> float:
        return float(self.read_values([3])[0])


def unpacked(joint: Joint, fmi: int, folder: Path) -> Path:
    """The native FMU of a joint in a folder."""
    require("cc")
    file = export_fmu(joint, folder / "a.fmu", fmi=fmi, runtime="c").file
    unpack(file, read_archive(file), folder / "a")
    return folder / "a"


@one_version
def test_spring_that_the_importer_integrates_relaxes_as_its_complex_stiffness_says(fmi: int, tmp_path: Path) -> None:
    fmu = Exchange(unpacked(RELAXING, fmi, tmp_path), fmi)
    assert fmu.rates == ["der(maxwell.stretch)"]

    def rate(t: float, x: Array) -> Array:
        z, v, _ = relaxing(t)
        fmu.at(t, float(z), float(v), x)
        return fmu.moved()

    # What the start leaves behind has decayed by exp(-2 k/c 2π/ω), or 2e-10, after two cycles.
    t = np.linspace(2.0, 3.0, 41) * 2 * np.pi / OMEGA
    solved = solve_ivp(rate, (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-7, atol=1e-16)
    z, v, expected = relaxing(t)
    found = []
    for i in range(len(t)):
        fmu.at(t[i], z[i], v[i], solved.y[:, i])
        found.append(fmu.force())
    assert found == pytest.approx(expected, rel=0, abs=1e-5 * np.max(np.abs(expected)))


@one_version
def test_co_simulation_comes_to_the_same_force_as_its_step_falls(fmi: int, tmp_path: Path) -> None:
    require("cc")
    file = export_fmu(RELAXING, tmp_path / "a.fmu", fmi=fmi, runtime="c").file

    def error(samples: int) -> float:
        """Of the force in the third cycle, relative to its amplitude."""
        h = 2 * np.pi / (OMEGA * samples)
        z, v, expected = relaxing(h * np.arange(3 * samples))
        found = forces(file, fmi, z, v, h, tmp_path / str(samples))[0]
        return float(np.max(np.abs(found - expected)[-samples:]) / np.max(np.abs(expected)))

    # A step follows the chord of the path: the error falls with the square of the step.
    coarse, fine = error(50), error(100)
    assert coarse < (2 * np.pi / 50) ** 2
    assert fine == pytest.approx(coarse / 4, rel=0.05)


@pytest.mark.slow
@both_versions
def test_importer_that_finds_the_events_comes_to_the_path_of_the_python_law(fmi: int, tmp_path: Path) -> None:
    require("cc")
    joint = Joint((LuGre(4e7, 300.0, 36.0, 50.0, 0.02), Jenkins(4e7, 36.0, 2e-7), Gap(6e8, 1.5e-6)))
    file = str(export_fmu(joint, tmp_path / "a.fmu", fmi=fmi, runtime="c").file)
    end, dense = 2.5 * 2 * np.pi / OMEGA, np.linspace(0.0, 2.5 * 2 * np.pi / OMEGA, 20_001)
    expected = law_force(joint, 8e-6 * np.sin(OMEGA * dense), 8e-6 * OMEGA * np.cos(OMEGA * dense), float(dense[1]))

    def error(samples: int) -> float:
        """Root mean square over the path, relative to the largest force."""
        t = np.linspace(0.0, end, samples + 1)
        rows = list(zip(t, 8e-6 * np.sin(OMEGA * t), 8e-6 * OMEGA * np.cos(OMEGA * t), strict=True))
        signal = np.array(rows, dtype=[(name, float) for name in ("time", "displacement", "velocity")])
        given = {"fmi_type": "ModelExchange", "input": signal, "output": ["force"], "solver": "Euler"}
        result = simulate_fmu(file, stop_time=end, step_size=t[1], output_interval=t[1], **given)
        assert len(result) > samples + 1  # an event is written twice
        off = result["force"] - np.interp(result["time"], dense, expected)
        return float(np.sqrt(np.mean(off**2)) / np.max(np.abs(expected)))

    # Euler's method is of first order: a sample late at the largest tangent stiffness.
    coarse, fine = error(400), error(1600)
    assert coarse < 6.8e8 * 8e-6 * OMEGA * end / 400 / np.max(np.abs(expected))
    assert fine < coarse / 3


@pytest.mark.slow
@both_versions
@pytest.mark.parametrize("joint", JOINTS, ids=label)
def test_every_law_exports_validates_and_repeats_its_reference_run(joint: Joint, fmi: int, tmp_path: Path) -> None:
    told = export_fmu(joint, tmp_path / "a.fmu", fmi=fmi, runtime="c")
    assert validate_fmu(str(told.file)) == []
    unpack(told.file, read_archive(told.file), tmp_path / "a")
    fmu = Exchange(tmp_path / "a", fmi)
    fmu.at(0.0, 1e-6, 1e-3, np.zeros(fmu.size))
    assert np.isfinite([fmu.force(), *fmu.moved()]).all()


@pytest.mark.slow
@one_version
@pytest.mark.parametrize(
    ("laws", "least", "most"),
    [
        ((Viscous(30.0), Gap(6e8, 1.5e-6)), 0.0, 1e-5),
        pytest.param((Maxwell(4e7, 1.2e4),), 1e-9, 0.05, marks=pytest.mark.thorough),
    ],
    ids=["no memory", "a spring that relaxes"],
)
def test_model_exchange_is_run_beside_co_simulation_and_told(
    laws: tuple[JointLaw, ...], least: float, most: float, fmi: int, tmp_path: Path
) -> None:
    """A force without memory is the same in both, to the width of an event; one with states is held over intervals."""
    require("cc")
    file = export_fmu(Joint(laws), tmp_path / "a.fmu", fmi=fmi, runtime="c").file
    done = verify_fmu(file, exchange=True)
    assert done.exchange is not None
    assert least <= done.exchange <= most
    assert done.exchange_said == ""
    assert verify_fmu(file).exchange is None


@pytest.mark.thorough
def test_an_fmu_without_model_exchange_says_so(tmp_path: Path) -> None:
    file = export_fmu(GUIDE, tmp_path / "a.fmu", runtime="python").file
    assert verify_fmu(file, exchange=True).exchange_said == "the FMU offers none"


@pytest.mark.parametrize("law", [BoucWen(4e7, 36.0, 1.5), Viscous(10.0)], ids=["pow", "none"])
def test_a_library_by_gcc_runs_on_systems_of_ten_years_ago(law: JointLaw, tmp_path: Path) -> None:
    """Its symbols are of glibc 2.17 or before: exp, log and pow have had newer versions since 2.29."""
    require("gcc")
    told = export_fmu(Joint((law,)), tmp_path / "a.fmu", runtime="c")
    folder = platform if platform in told.platforms else platform_tuple
    (name,) = (n for n in read_archive(told.file) if n.startswith(f"binaries/{folder}/"))
    found = {int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", read_archive(told.file)[name])}
    assert found
    assert max(found) <= 17


@pytest.mark.parametrize(("fmi3", "oldest"), [("x86_64-darwin", (10, 9)), ("aarch64-darwin", (11, 0))])
def test_a_library_for_macos_runs_on_old_releases(fmi3: str, oldest: tuple[int, int]) -> None:
    """The least release stands in a load command of the Mach-O file; zig itself asks for macOS 15."""
    pytest.importorskip("ziglang")
    (compiler,) = (c for c in compilers() if c.platform.fmi3 == fmi3)
    shown = '__attribute__((visibility("default"))) int f(void) { return 1; }\n'
    data = library(compiler, {"all.c": shown}, "all.c", "f")
    (count_of,), at = struct.unpack_from("<I", data, 16), 32
    found = []
    for _ in range(count_of):
        command, size = struct.unpack_from("<II", data, at)
        if command in {0x24, 0x32}:  # LC_VERSION_MIN_MACOSX, LC_BUILD_VERSION
            (release,) = struct.unpack_from("<I", data, at + (8 if command == 0x24 else 12))
            found.append((release >> 16, release >> 8 & 255))
        at += size
    assert found == [oldest]


@pytest.mark.thorough
def test_force_and_rates_depend_on_what_is_declared_and_on_nothing_else(tmp_path: Path) -> None:
    joint = Joint((Maxwell(4e7, 1.2e4), LuGre(4e7, 300.0, 36.0, 50.0, 0.02), Viscous(10.0)))
    fmu = Exchange(unpacked(joint, 2, tmp_path), 2)
    unknowns = [*fmu.read.outputs, *fmu.read.derivatives]
    declared = {str(u.variable.name): {str(v.name) for v in u.dependencies} for u in unknowns}
    known = ["displacement", "velocity", *(str(u.variable.derivative.name) for u in fmu.read.derivatives)]
    found: dict[str, set[str]] = {name: set() for name in declared}
    rng = np.random.default_rng(5)
    for _ in range(5):
        fmu.at(0.0, 1e-6 * rng.normal(), 1e-2 * rng.normal(), rng.normal(0, 3e-7, 2))
        for name in known:
            slopes = fmu.fmu.getDirectionalDerivative([fmu.place[u] for u in declared], [fmu.place[name]], [1.0])
            for unknown, slope in zip(declared, slopes, strict=True):
                if slope != 0.0:
                    found[unknown].add(name)
    # In co-simulation the springs follow the displacement within a step, so the force declares it too.
    assert found == {**declared, "force": declared["force"] - {"displacement"}}


@pytest.mark.slow
def test_same_joint_compiled_twice_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    once = native(GUIDE, 3).file.read_bytes()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert export_fmu(GUIDE, "again.fmu", fmi=3, runtime="c").file.read_bytes() == once
    kept = [file for file in (tmp_path / "cache" / "jointlib").rglob("*") if file.is_file()]
    assert len(kept) == len(native(GUIDE, 3).platforms)


@pytest.mark.slow
@one_version
def test_sources_inside_compile_to_an_fmu_that_repeats_the_reference_run(fmi: int, tmp_path: Path) -> None:
    require("cmake")
    members = read_archive(native(GUIDE, fmi).file)
    sources = {name: data for name, data in members.items() if not name.startswith("binaries/")}
    unpack(tmp_path, sources, tmp_path / "a")
    (tmp_path / "build").mkdir()
    build_platform_binary(tmp_path / "a", tmp_path / "build")
    (library,) = (tmp_path / "a" / "binaries").rglob("*.so")
    made = {**sources, str(library.relative_to(tmp_path / "a")): library.read_bytes()}
    (tmp_path / "made.fmu").write_bytes(archive_bytes(made))
    assert verify_fmu(tmp_path / "made.fmu").difference <= 1e-12


def test_source_that_was_changed_is_noticed(tmp_path: Path) -> None:
    members = read_archive(native(GUIDE, 2).file)
    joint = members["sources/joint.c"]
    members["sources/joint.c"] = joint.replace(b"return p[0] * v;", b"return 2.0 * p[0] * v;")
    assert members["sources/joint.c"] != joint
    (tmp_path / "a.fmu").write_bytes(archive_bytes(members))
    with pytest.raises(CheckFailed, match="the guid does not belong to this content"):
        verify_fmu(tmp_path / "a.fmu")


def test_licences_and_headers_travel_with_the_sources() -> None:
    members = read_archive(native(GUIDE, 2).file)
    assert sum(name.startswith("sources/fmi") and name.endswith("Functions.h") for name in members) == 2
    notice = members["documentation/licenses/fmi-headers.txt"].decode()
    assert 'Modelica Association Project "FMI"' in notice
    assert "Redistributions in binary form must reproduce the above copyright notice" in notice
    assert "documentation/licenses/jointlib.txt" in members
    assert not any(name.startswith("resources/") for name in members)


@both_versions
def test_errors_and_range_of_the_identification_travel_as_annotations(fmi: int) -> None:
    joint = dataclasses.replace(
        Joint((Viscous(503.0),)),
        validity={"amplitude": (0.0, 3e-6), "velocity": (0.0, 0.1)},
        covariance=Covariance(("viscous.damping",), np.array([[4.0]])),
    )
    root = ElementTree.fromstring(described(joint, fmi))
    (found,) = root.iter("Parameter")
    assert found.attrib == {"name": "viscous.damping", "standardError": "2.0", "unit": "N s/m"}
    told = {v.get("quantity"): (v.get("high"), v.get("unit")) for v in root.iter("Validity")}
    assert told == {"amplitude": ("3e-06", "m"), "velocity": ("0.1", "m/s")}
    source = native_sources(system_of_joint(joint), fmi, "model", "token")["sources/joint.c"]
    assert "jl_validity[] = { -3e-06, 3e-06, -0.1, 0.1 }" in source


def test_only_fmi_3_has_time_and_event_indicators_as_variables() -> None:
    names = {
        fmi: [v.get("name") for v in ElementTree.fromstring(described(GUIDE, fmi)).find("ModelVariables") or ()]
        for fmi in (2, 3)
    }
    assert names[3][-1] == "time"
    extra = [name for name in names[3] if name not in names[2]]
    assert set(names[2]) < set(names[3])
    assert all(name == "time" or ".indicator[" in str(name) for name in extra)


def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fmu.export.can_compile", lambda: False)


def _broken_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    (own,) = (p for p in PLATFORMS if p.fmi3 == platform_tuple)
    monkeypatch.setattr("fmu.members.build.compilers", lambda: (Compiler(own, ("false",)),))


@pytest.mark.parametrize(
    ("spoil", "asked", "said"),
    [
        (_no_compiler, {"fmi": 3}, "fmi is 3, which needs the native runtime, and there is no C compiler here"),
        (_broken_compiler, {"runtime": "c"}, "false: cannot compile the FMU for"),
    ],
)
def test_missing_compiler_is_told_in_a_sentence(
    spoil: Callable[[pytest.MonkeyPatch], None],
    asked: dict[str, object],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spoil(monkeypatch)
    with pytest.raises(InputError) as error:
        export_fmu(GUIDE, tmp_path / "a.fmu", **asked)  # type: ignore[arg-type]
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.thorough
def test_without_a_compiler_the_python_runtime_is_taken_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _no_compiler(monkeypatch)
    told = export_fmu(GUIDE, tmp_path / "a.fmu")
    assert told.runtime == "python"
    assert any("has the Python runtime, as there is no C compiler here" in text for text in told.messages)


@pytest.mark.thorough
def test_with_a_compiler_the_native_runtime_is_taken(tmp_path: Path) -> None:
    require("cc")
    told = export_fmu(Joint((Viscous(10.0),)), tmp_path / "a.fmu")
    assert told.runtime == "c"
    assert not any("hosts that bring Python" in text for text in told.messages)


def test_compiler_that_fails_for_another_platform_leaves_that_platform_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("cc")
    foreign = next(p for p in PLATFORMS if p.fmi3 != platform_tuple)
    own = tuple(compiler for compiler in compilers() if compiler.platform.fmi3 == platform_tuple)
    monkeypatch.setattr("fmu.members.build.compilers", lambda: (*own, Compiler(foreign, ("false",))))
    told = export_fmu(Joint((Viscous(10.0),)), tmp_path / "a.fmu")
    assert told.platforms == (platform,)
    assert any(f"It has no library for {foreign.fmi2}, as its compiler failed: false" in text for text in told.messages)
    (others,) = (text for text in told.messages if "brings a compiler" in text)
    assert foreign.fmi2 not in re.split("[ ,:]+", others)


@pytest.mark.thorough
def test_a_platform_asked_for_by_name_stands_beside_this_computer_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("cc")
    (own,) = (compiler for compiler in compilers() if compiler.platform.fmi3 == platform_tuple)
    # This computer's library in place of those of other platforms, which would ask for other compilers.
    others = [Compiler(p, own.command) for p in PLATFORMS if p != own.platform and p.suffix == own.platform.suffix]
    monkeypatch.setattr("fmu.members.build.compilers", lambda: (own, *others))
    foreign = others[0].platform
    for fmi, name in ((2, foreign.fmi2), (3, foreign.fmi3)):
        told = export_fmu(Joint((Viscous(10.0),)), tmp_path / "a.fmu", fmi=fmi, platforms=[name])
        assert set(told.platforms) == {own.platform.folder(fmi), foreign.folder(fmi)}
    monkeypatch.setattr("fmu.members.build.compilers", lambda: (own, Compiler(foreign, ("false",))))
    with pytest.raises(InputError, match="cannot compile the FMU for"):
        export_fmu(Joint((Viscous(10.0),)), tmp_path / "b.fmu", platforms=[foreign.fmi2])
    assert not (tmp_path / "b.fmu").exists()


@one_version
def test_law_that_only_steps_makes_an_fmu_for_co_simulation_only(
    fmi: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require("cc")
    text = (FOLDER / "jenkins.h").read_text().replace("exchange: yes", "exchange: no")
    (tmp_path / "jenkins.h").write_text(text)
    (tmp_path / "gap.h").write_text((FOLDER / "gap.h").read_text())
    monkeypatch.setattr("fmu.code.c_kernel.FOLDER", tmp_path)
    joint = Joint((Jenkins(4e7, 36.0), Gap(6e8, 1.5e-6)))
    told = export_fmu(joint, tmp_path / "a.fmu", fmi=fmi, runtime="c")
    assert "The FMU does co-simulation only, as the importer cannot integrate jenkins." in told.messages
    assert not any("model exchange" in text for text in told.messages)
    assert validate_fmu(str(told.file)) == []
    read = read_model_description(str(told.file))
    assert read.modelExchange is None
    assert read.eventIndicators == read.derivatives == []
    z, v = path()
    expected = law_force(joint, z, v, 1e-5)
    found = forces(told.file, fmi, z, v, 1e-5, tmp_path / "a")[0]
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))


def test_kernel_without_its_declarations_is_refused() -> None:
    with pytest.raises(InputError, match=r"spring\.h: 0 lines 'inputs:', expected one in the first comment"):
        read_kernel("spring", "/* exchange: yes */\n")
    sound = read_kernel(
        "spring", "/*\n states: slider[i] m continuous\n modes: 2*n[0] + 1\n inputs: z\n exchange: yes\n*/"
    )
    assert [name for name, _ in sound.state_names((2,))] == ["slider[0]", "slider[1]"]
    assert count(sound.modes, (3,)) == 7
    assert sound.indicators == "0"


@pytest.mark.thorough
@pytest.mark.parametrize("exponent", [2.0, 120.0, 165.0])
def test_rates_of_a_sharp_bouc_wen_loop_pull_a_trial_beyond_it_back(exponent: float, tmp_path: Path) -> None:
    """A solver may try points that the law never reaches: 2 lengths are 2^165 in the power."""
    law = BoucWen(4e7, 36.0, exponent)
    fmu = Exchange(unpacked(Joint((law,)), 2, tmp_path), 2)
    length = 36.0 / 4e7
    for u, v in ((2.0, 0.1), (-2.0, -0.1), (1e3, 0.1)):
        fmu.at(0.0, u * length, v, np.array([u * length]))
        rate = float(fmu.moved()[0])
        assert np.isfinite(rate)
        assert rate * u < 0, "back into the loop"
    omega, travel = 200.0, 4e-6

    def rate_at(t: float, x: Array) -> Array:
        fmu.at(t, travel * np.sin(omega * t), travel * omega * np.cos(omega * t), x)
        return fmu.moved()

    time = np.linspace(0.0, 1.5 * 2 * np.pi / omega, 61)
    # While it slides nothing changes, and a step without bound passes over the next reversal.
    bound = {"max_step": 2 * np.pi / omega / 200, "rtol": 1e-8, "atol": 1e-16}
    solved = solve_ivp(rate_at, (0.0, time[-1]), [0.0], method="LSODA", t_eval=time, **bound)
    fine = np.linspace(0.0, time[-1], 60 * 200 + 1)
    expected = law.along(travel * np.sin(omega * fine), travel * omega * np.cos(omega * fine), fine[1])[::200]
    assert solved.success
    assert 4e7 * solved.y[0] == pytest.approx(expected, abs=2e-4 * 36.0)
