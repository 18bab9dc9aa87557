"""Clients that others wrote run an exported joint with memory: the force is that of the Python law."""

from __future__ import annotations

import csv
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from client_table import BEGIN, CLIENTS, DOCS, END, table
from exported_library import GUIDE, RUBBING, exported, unpacked
from fmpy import simulate_fmu
from host import law_force
from tools import absent, package, require

from fmu.playback.replay import replay
from jointlib.arrays import Array
from jointlib.joint import Joint

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="starts Linux programs")
both_versions = pytest.mark.parametrize("fmi", [2, 3])
STEP = 2e-6
"""s; libcosim counts whole nanoseconds."""


def travel() -> tuple[Array, Array]:
    """Displacement (m) and velocity (m/s) at the start of each step: rest, presliding, sliding, lift-off, jumps."""
    rng = np.random.default_rng(7)
    angle = np.linspace(0, 8 * np.pi, 160)
    size = np.linspace(0, 6e-6, 160)
    z = np.concatenate([np.zeros(5), size * np.sin(angle), rng.uniform(-6e-6, 6e-6, 40), np.zeros(5)])
    v = np.concatenate([np.zeros(5), 0.1 * size / 6e-6 * np.cos(angle), rng.normal(0, 0.05, 40), np.zeros(5)])
    return z, v


def expected(joint: Joint) -> Array:
    """Force in N after each step, of a joint that starts from rest at zero."""
    z, v = travel()
    return law_force(joint, np.concatenate([[0.0], z]), np.concatenate([[0.0], v]), STEP)[1:]


def agree(found: Array, joint: Joint, rounding: float = 0.0) -> None:
    """Within 1e-12 of the largest force, and ``rounding`` in N of what the client prints."""
    force = expected(joint)
    largest = float(np.max(np.abs(force)))
    assert largest > 100.0
    assert found == pytest.approx(force, rel=0, abs=1e-12 * largest + rounding)


@pytest.mark.thorough
@both_versions
def test_fmpy_computes_the_force_of_the_law_from_a_table_of_inputs(fmi: int) -> None:
    z, v = travel()
    time = STEP * np.arange(len(z) + 1)
    rows = list(zip(time, np.append(z, 0.0), np.append(v, 0.0), strict=True))
    signal = np.array(rows, dtype=[(name, float) for name in ("time", "displacement", "velocity")])
    given = {"fmi_type": "CoSimulation", "input": signal, "output": ["force"], "output_interval": STEP}
    result = simulate_fmu(str(exported(RUBBING, fmi).file), stop_time=time[-1], step_size=STEP, **given)
    agree(result["force"][1:], RUBBING)


def test_libcosim_computes_the_force_of_the_law(tmp_path: Path) -> None:
    package("libcosimpy")
    fmu, answer = exported(RUBBING, 2), tmp_path / "answer.json"
    request = {
        "file": str(fmu.file),
        "step": STEP,
        "inputs": [fmu.references["displacement"], fmu.references["velocity"]],
        "outputs": [fmu.references["force"]],
        "values": np.column_stack(travel()).tolist(),
        "answer": str(answer),
    }
    client = Path(__file__).with_name("libcosim_client.py")
    done = subprocess.run(
        [sys.executable, str(client)],
        input=json.dumps(request),
        capture_output=True,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    assert not {"[warning]", "[error]", "[fatal]"} & set((done.stdout + done.stderr).split())
    agree(np.array(json.loads(answer.read_text())), RUBBING)


def scenario(z: Array, v: Array) -> str:
    """Inputs over time in the words of Ecos."""
    actions = []
    for i in range(len(z)):
        values = {"displacement": float(z[i]), "velocity": float(v[i])}
        variables = "".join(
            f'<ecos:Variable id="instance::{name}"><ecos:real value="{value!r}"/></ecos:Variable>'
            for name, value in values.items()
        )
        actions.append(f'<ecos:Action t="{i * STEP!r}" eps="{STEP / 100!r}">{variables}</ecos:Action>')
    return f'<?xml version="1.0"?><ecos:Scenario name="travel">{"".join(actions)}</ecos:Scenario>'


@both_versions
def test_ecos_which_brings_no_python_computes_the_force_of_the_law(fmi: int, tmp_path: Path) -> None:
    ecos = tmp_path / "ecos"
    shutil.copyfile(package("ecospy") / "binaries" / "ecos", ecos)
    ecos.chmod(0o755)
    libraries = os.pathsep.join(filter(None, [str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH")]))
    environment = {"LD_LIBRARY_PATH": libraries, "PATH": os.defpath, "TMPDIR": str(tmp_path)}
    needed = subprocess.run([require("ldd"), str(ecos)], capture_output=True, text=True, env=environment).stdout
    if "libtbb.so.12 => not found" in needed:
        absent("ecospy", "libtbb.so.12 is not installed (Debian libtbb12, PyPI tbb), which Ecos needs")
    assert "python" not in needed
    z, v = travel()
    (tmp_path / "travel.xml").write_text(scenario(z, v))
    command = [str(ecos), "simulate", "--path", str(exported(RUBBING, fmi).file), "--scenarioConfig", "travel.xml"]
    # Half a step more: the last step must not hang on the rounding of its time.
    command += ["--stepSize", repr(STEP), "--stopTime", repr((len(z) + 0.5) * STEP)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "[warning]" not in done.stdout
    (table,) = tmp_path.glob("*.csv")
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file, skipinitialspace=True))
    found = np.array([float(row["instance::force[REAL]"]) for row in rows[1:]])
    # Ecos prints six decimals.
    agree(found, RUBBING, rounding=0.5000001e-6)


@pytest.mark.thorough
@both_versions
def test_container_of_two_joints_and_both_versions_keeps_each_force(fmi: int, tmp_path: Path) -> None:
    package("fmu_manipulation_toolbox")
    joints = {"rubbing2.fmu": RUBBING, "rubbing3.fmu": RUBBING, "guide2.fmu": GUIDE, "guide3.fmu": GUIDE}
    for name, joint in joints.items():
        shutil.copyfile(exported(joint, int(name[-5])).file, tmp_path / name)
    ports = ("displacement", "velocity")
    description = {
        "name": "box.fmu",
        "fmu": list(joints),
        "step_size": STEP,
        "auto_input": False,
        "auto_output": False,
        "input": [[f"{name[:-4]}_{port}", name, port] for name in joints for port in ports],
        "output": [[name, "force", f"{name[:-4]}_force"] for name in joints],
    }
    (tmp_path / "box.json").write_text(json.dumps(description))
    module = "fmu_manipulation_toolbox.cli.fmucontainer"
    command = [sys.executable, "-m", module, "-fmi", str(fmi), "-fmu-directory", ".", "-container", "box.json"]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    box = unpacked(tmp_path / "box.fmu", tmp_path / "box", fmi)
    z, v = travel()
    rows = np.column_stack([np.append(0.0, z), np.append(0.0, v)])
    request = {
        "fmi": fmi,
        "guid": box.token,
        "identifier": box.identifier,
        "folder": str(box.folder),
        "inputs": [box.references[f"{name[:-4]}_{port}"] for name in joints for port in ports],
        "outputs": [box.references[f"{name[:-4]}_force"] for name in joints],
        "time": [i * STEP for i in range(len(rows))],
        "values": np.tile(rows, len(joints)).tolist(),
    }
    first = np.array(replay(request)[0])[1:]
    for column, joint in zip(first.T, joints.values(), strict=True):
        agree(column, joint)


def test_the_docs_have_the_table_of_every_client_and_no_native_one_is_far_off() -> None:
    text = DOCS.read_text(encoding="utf-8").split(BEGIN)[1].split(END)[0]
    head, _, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in text.strip().splitlines())
    assert [name for name in CLIENTS if not any(cell.startswith(name) for cell in head[1:])] == []
    assert len(rows) == 8
    place = next(i for i, cell in enumerate(head) if cell.startswith("FMPy, co-simulation"))
    assert max(float(row[place]) for row in rows) < 1e-6


@pytest.mark.slow
def test_the_table_of_clients_is_what_they_do_here() -> None:
    found = [line.strip("|").split("|")[1] for line in table().splitlines()[2:]]
    assert max(map(float, found)) < 1e-6
