"""What holds for the FMU of every law, and of a joint made of several."""

from __future__ import annotations

import ast
import inspect
import runpy
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from host import GUIDE, JOINTS, exported, label, law_force, path, running
from repeats import firsts, repeats

from fmu.code import python_kernel
from fmu.system.variables import variables_of
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.parameter import parameters_of
from jointlib.registry import laws

every_joint = pytest.mark.parametrize("joint", JOINTS, ids=label)
FIRSTS = [label(joint) for joint in firsts(JOINTS, lambda joint: tuple(law.kind for law in joint.laws))]


@pytest.mark.parametrize("kind", sorted(kind for kind, law in laws().items() if law.in_time))
def test_every_installed_law_has_a_kernel_that_takes_its_parameters(kind: str) -> None:
    law, word = laws()[kind], kind.replace("-", "_")
    names = [p.name for p in parameters_of(law)]
    defined = runpy.run_path(str(Path(python_kernel.__file__).parents[1] / "python_kernels" / f"{word}.py"))
    wanted = {"initial", "step"} if law.states else {"force"}
    assert {f"{word}_{purpose}" for purpose in wanted} <= set(defined)
    for purpose in {*wanted, "check"} & {name.removeprefix(f"{word}_") for name in defined}:
        parameters = inspect.signature(defined[f"{word}_{purpose}"]).parameters.values()
        assert [p.name for p in parameters if p.kind is p.KEYWORD_ONLY] == names
    assert tuple(defined.get(f"{word}_state_units", {})) == law.states


@pytest.mark.parametrize(
    "joint", repeats(JOINTS, lambda joint: joint is JOINTS[0], lambda joint: joint in JOINTS[::4]), ids=label
)
def test_fmpy_finds_no_problem(joint: Joint) -> None:
    assert validate_fmu(str(exported(joint).file)) == []


@pytest.mark.parametrize("joint", repeats(JOINTS, lambda joint: label(joint) in FIRSTS), ids=label)
def test_fmu_follows_the_python_law_through_rest_reversal_and_lift_off(joint: Joint, tmp_path: Path) -> None:
    z, v = path()
    expected = law_force(joint, z, v, 1e-5)
    with running([exported(joint).file], tmp_path) as (fmu,):
        found = fmu.run(z, v, 1e-5)
    assert np.max(np.abs(expected)) > 0
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))


@every_joint
def test_force_follows_the_inputs_without_a_step(joint: Joint, tmp_path: Path) -> None:
    z, v = path()
    state = joint.initial_state(0.0)
    for i in range(60):
        state = joint.step(Motion(z[i], v[i], 1e-5), state)[1]
    expected = [float(joint.step(Motion(z[i], v[i]), state)[0]) for i in (70, 100, 200)]
    with running([exported(joint).file], tmp_path) as (fmu,):
        fmu.initialize()
        for i in range(60):
            fmu.step(z[i], v[i])
        found = []
        for i in (70, 100, 200):
            fmu.set(displacement=z[i], velocity=v[i])
            found.append(fmu.get("force"))
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12 * max(map(abs, expected)))


@every_joint
def test_description_and_slave_start_from_the_same_values(joint: Joint, tmp_path: Path) -> None:
    with running([exported(joint).file], tmp_path) as (fmu,):
        fmu.fmu.setupExperiment()
        fmu.fmu.enterInitializationMode()
        listed = fmu.description.modelVariables
        assert [v.valueReference for v in listed] == list(range(len(listed)))
        started = {v.name: float(v.start) for v in listed if v.start is not None}
        assert {name: fmu.get(name) for name in started} == started
    assert {name: started[name] for name in joint.parameters} == joint.parameters


@every_joint
def test_force_depends_on_the_inputs_that_are_declared_and_no_others(joint: Joint, tmp_path: Path) -> None:
    with running([exported(joint).file], tmp_path) as (fmu,):
        declared = {str(v.name) for v in fmu.description.outputs[0].dependencies}
        fmu.initialize()
        moved = set()
        for name, values in (("displacement", path()[0][::8]), ("velocity", path()[1][::8])):
            fmu.set(displacement=1e-6, velocity=1e-3)
            before = fmu.get("force")
            for value in values:
                fmu.put({name: value})
                if fmu.get("force") != before:
                    moved.add(name)
    assert moved == declared


@every_joint
def test_slave_needs_the_standard_library_only(joint: Joint) -> None:
    with zipfile.ZipFile(exported(joint).file) as archive:
        module = archive.read("resources/slavemodule.txt").decode()
        tree = ast.parse(archive.read(f"resources/{module}.py"))
    imported = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported.add(str(node.module))
        elif isinstance(node, ast.Name):
            assert node.id not in {"__import__", "eval", "exec", "open"}
    assert imported == {"__future__", "json", "math", "typing", "pythonfmu", "pythonfmu.enums"}


def test_parameters_carry_units_and_bounds() -> None:
    variables = {v.name: v for v in variables_of(GUIDE)}
    assert variables["hertz_guide.preload"].unit == "N"
    assert variables["hertz_guide.contact_angle"].maximum == np.pi / 2
    assert variables["viscous.damping"].minimum == 0.0
    assert variables["jenkins.slider"].unit == "m"
    assert variables["jenkins.slider"].causality == "local"


def test_a_new_law_without_a_kernel_is_named_in_the_refusal() -> None:
    class Foreign(JointLaw):
        kind = "foreign-law"
        initial_state = step = jacobian = None  # type: ignore[assignment]

    Foreign.__abstractmethods__ = frozenset()
    with pytest.raises(ValueError, match=r"foreign-law: no FMU kernel for this law, expected foreign_law\.h"):
        python_kernel.kernel_of(Foreign())
    Foreign.in_time = False
    with pytest.raises(ValueError, match="foreign-law: a law of the frequency domain only"):
        python_kernel.kernel_of(Foreign())
