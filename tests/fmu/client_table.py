"""The table client × case of docs/fmu.md, from the clients that are installed: largest difference from the Python laws.

    python tests/fmu/client_table.py          prints the table
    python tests/fmu/client_table.py --write  puts it into docs/fmu.md, between its two marks

Inputs are held over steps of 2 µs. Joints are compared with their law, machines with the Python simulation, each by a
force, of whose largest value the differences are shares. A client that is not installed keeps a column of dashes.
"""

from __future__ import annotations

import csv
import importlib.metadata
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
for extra in (HERE, HERE.parent, HERE.parent / "jointlib"):
    sys.path.insert(0, str(extra))

from exported_library import GUIDE, RUBBING  # noqa: E402
from fmpy import read_model_description, simulate_fmu  # noqa: E402
from host import law_force  # noqa: E402

from fmu.export import export_fmu  # noqa: E402
from fmu.members.machine_system import system_of_machine  # noqa: E402
from fmu.playback.simulation import simulate  # noqa: E402
from fmu.verify import verify_fmu  # noqa: E402
from jointlib.arrays import Array  # noqa: E402
from jointlib.errors import CheckFailed  # noqa: E402
from jointlib.joint import Joint  # noqa: E402
from machines import Machine, read_machine  # noqa: E402

DOCS, BEGIN, END = ROOT / "docs" / "fmu.md", "<!-- client table -->", "<!-- end of client table -->"
STEP, STEPS = 2e-6, 200


@dataclass(frozen=True)
class Case:
    """One FMU under inputs, and the force that is expected behind each step."""

    file: Path
    fmi: int
    inputs: dict[str, Array]
    output: str
    expected: Array

    def reference(self, name: str) -> int:
        """Value reference."""
        return next(
            int(v.valueReference) for v in read_model_description(str(self.file)).modelVariables if v.name == name
        )


def held(case: Case) -> Array:
    """FMPy's ``simulate_fmu``; a row more at the end, as it reads inputs at the start of steps."""
    n = len(case.expected)
    columns = [np.append(x, x[-1]) for x in case.inputs.values()]
    names = ["time", *case.inputs]
    rows = list(zip(STEP * np.arange(n + 1), *columns, strict=True))
    signal = np.array(rows, dtype=[(name, float) for name in names])
    given = {"input": signal, "output": [case.output], "stop_time": n * STEP, "output_interval": STEP}
    found = simulate_fmu(str(case.file), fmi_type="CoSimulation", step_size=STEP, **given)
    return np.asarray(found[case.output][1:])


def exchange(case: Case) -> float:
    """FMPy's solver beside its own co-simulation, along sines as large as those of the FMU's reference run."""
    found = verify_fmu(case.file, exchange=True)
    if found.exchange is None:
        raise CheckFailed(found.exchange_said)
    return found.exchange


def libcosim(case: Case) -> Array:
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        request = {
            "file": str(case.file),
            "step": STEP,
            "inputs": [case.reference(name) for name in case.inputs],
            "outputs": [case.reference(case.output)],
            "values": np.column_stack(list(case.inputs.values())).tolist(),
            "answer": str(answer),
        }
        client = [sys.executable, str(HERE / "libcosim_client.py")]
        subprocess.run(client, input=json.dumps(request), capture_output=True, text=True, check=True)
        return np.array(json.loads(answer.read_text()))


def ecos(case: Case) -> Array:
    home = importlib.util.find_spec("ecospy")
    assert home is not None
    assert home.origin is not None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copyfile(Path(home.origin).parent / "binaries" / "ecos", folder / "ecos")
        (folder / "ecos").chmod(0o755)
        actions = [
            f'<ecos:Action t="{i * STEP!r}" eps="{STEP / 100!r}"><ecos:Variable id="instance::{variable}">'
            f'<ecos:real value="{float(x)!r}"/></ecos:Variable></ecos:Action>'
            for variable, values in case.inputs.items()
            for i, x in enumerate(values)
        ]
        scenario = f'<?xml version="1.0"?><ecos:Scenario name="held">{"".join(actions)}</ecos:Scenario>'
        (folder / "held.xml").write_text(scenario)
        command = [str(folder / "ecos"), "simulate", "--path", str(case.file), "--scenarioConfig", "held.xml"]
        command += ["--stepSize", repr(STEP), "--stopTime", repr((len(case.expected) + 0.5) * STEP)]
        libraries = os.pathsep.join(filter(None, [str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH")]))
        environment = {"LD_LIBRARY_PATH": libraries, "PATH": os.defpath}
        subprocess.run(command, capture_output=True, cwd=folder, env=environment, check=True)
        (table,) = folder.glob("*.csv")
        with table.open(newline="") as file:
            rows = list(csv.DictReader(file, skipinitialspace=True))
        return np.array([float(row[f"instance::{case.output}[REAL]"]) for row in rows[1:]])


def container(case: Case) -> Array:
    """One FMU in a container of fmucontainer, which FMPy steps."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copyfile(case.file, folder / "one.fmu")
        description = {
            "name": "box.fmu",
            "fmu": ["one.fmu"],
            "step_size": STEP,
            "auto_input": False,
            "auto_output": False,
            "input": [[variable, "one.fmu", variable] for variable in case.inputs],
            "output": [["one.fmu", case.output, "out"]],
        }
        (folder / "box.json").write_text(json.dumps(description))
        command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmucontainer", "-fmi", str(case.fmi)]
        command += ["-fmu-directory", ".", "-container", "box.json"]
        subprocess.run(command, capture_output=True, cwd=folder, check=True)
        return held(Case(folder / "box.fmu", case.fmi, case.inputs, "out", case.expected))


CLIENTS: dict[str, tuple[str, Callable[[Case], Array | float]]] = {
    "FMPy, co-simulation": ("fmpy", held),
    "FMPy, model exchange (CVode)": ("fmpy", exchange),
    "libcosim": ("libcosimpy", libcosim),
    "Ecos, which prints six decimals": ("ecospy", ecos),
    "fmucontainer": ("fmu-manipulation-toolbox", container),
}
ONLY = {"libcosim": 2}
"""The version of FMI that a client does."""


def cases(folder: Path) -> dict[str, Case]:
    """By their titles."""
    angle = np.linspace(0, 8 * np.pi, STEPS)
    z, v = 4e-6 * np.linspace(0, 1, STEPS) * np.sin(angle), 0.05 * np.cos(angle)
    found = {}
    for title, model in {
        "guide: Hertz contact, drag, Coulomb, Jenkins": GUIDE,
        "guide: Hertz contact, LuGre": RUBBING,
        "machine `two_mass`": read_machine(ROOT / "machines" / "library" / "two_mass.toml"),
        "machine `three_joints`": read_machine(ROOT / "machines" / "library" / "three_joints.toml"),
    }.items():
        for fmi in (2, 3):
            file = export_fmu(model, folder / f"{len(found)}.fmu", fmi=fmi, runtime="c").file
            found[f"{title}, FMI {fmi}"] = _case(model, file, fmi, z, v)
    return found


def _case(model: Joint | Machine, file: Path, fmi: int, z: Array, v: Array) -> Case:
    if isinstance(model, Joint):
        inputs = {"displacement": z, "velocity": v}
        force = law_force(model, *(np.append(0.0, x) for x in inputs.values()), STEP)[1:]
        return Case(file, fmi, inputs, "force", force)
    system = system_of_machine(model)
    size = system.inputs[0].size
    inputs = {s.name: size * np.sin(np.linspace(0, 12, STEPS)) for s in system.inputs}
    u = np.column_stack([np.append(0.0, x) for x in inputs.values()])
    place = next(i for i, s in enumerate(system.outputs) if s.name.endswith(".force"))
    return Case(file, fmi, inputs, system.outputs[place].name, simulate(system, u, STEP)[1:, place])


def told(case: Case, client: str) -> str:
    """The difference, or why there is none."""
    distribution, run = CLIENTS[client]
    try:
        importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "–"
    if ONLY.get(client, case.fmi) != case.fmi:
        return "does FMI 2.0 only"
    try:
        found = run(case)
    except CheckFailed:
        return "gives up"
    except Exception as error:  # clients raise whatever they like
        return f"fails ({type(error).__name__})"
    if isinstance(found, float):
        return f"{found:.0e}"
    return f"{np.max(np.abs(found[: len(case.expected)] - case.expected)) / np.max(np.abs(case.expected)):.0e}"


def table() -> str:
    """In Markdown."""
    with tempfile.TemporaryDirectory(prefix="jointlib-") as folder:
        every = cases(Path(folder))
        versions = {c: importlib.metadata.version(d) for c, (d, _) in CLIENTS.items() if _installed(d)}
        head = [f"{c} {versions.get(c, '')}".strip() for c in CLIENTS]
        lines = [f"| case | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
        lines += [f"| {title} | {' | '.join(told(case, c) for c in CLIENTS)} |" for title, case in every.items()]
    return "\n".join(lines)


def _installed(distribution: str) -> bool:
    return any(True for _ in importlib.metadata.distributions(name=distribution))


def main() -> None:
    """Print the table, or write it."""
    found = table()
    print(found)
    if "--write" in sys.argv[1:]:
        text = DOCS.read_text(encoding="utf-8")
        before, rest = text.split(BEGIN)
        DOCS.write_text(f"{before}{BEGIN}\n{found}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
