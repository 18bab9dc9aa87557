"""The house: imports run one way, the command line answers at once, names are one table."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from collections.abc import Collection
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from machines.moved import MOVED

ROOT = Path(__file__).parents[1]
ALLOWED = {"jointlib": {"jointlib"}, "machines": {"machines", "jointlib"}, "fmu": {"fmu", "jointlib", "machines"}}

ROOMS = (
    "shapes",
    "components",
    "bundles",
    "model",
    "coupling",
    "statics",
    "harmonic_balance",
    "operating",
    "stability",
    "continuation",
    "tool",
    "forced_response",
    "cutting/process",
    "cutting/loops",
    "cutting/cutters",
    "cutting/rest",
    "cutting/amplitude",
    "cutting/in_time",
    "cutting/forced",
    "modes",
    "uncertainty",
    "files",
    "loop",
    "cut_loop",
    "planning",
    "measured_modes",
    "uncoupling",
    "compare",
    "view",
    "study",
    "mistakes",
    "report",
    "explore",
    "road",
    "answers",
    "verbs",
)
"""Rooms of ``machines``; each imports those before it alone."""
WINGS = {
    "jointlib.loop": ("answer", "balance", "contest", "path", "periodic", "decay", ""),
    "fmu": ("loop_step", "kernels", "python_kernels", "code", "system", "members", "playback", "systems", "", "verbs"),
}
"""Rooms of other packages, in the same order; what stands beside them comes last."""
CATALOGUES = {"jointlib/effects", "jointlib/laws", "fmu/kernels", "fmu/python_kernels"}
MOST_FILES = 20


@functools.cache
def statements(path: Path) -> list[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Every statement of a file that imports, inside functions too, and whether it does so for types alone."""
    found = []
    left: list[tuple[ast.AST, bool]] = [(ast.parse(path.read_text()), False)]
    while left:
        node, typed = left.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append((node, typed))
        elif not isinstance(node, ast.expr):
            typed = typed or (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
            left += [(inner, typed) for inner in ast.iter_child_nodes(node)]
    return found


def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node, _ in statements(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif node.level == 0 and node.module:
            found.add(node.module)
    return found


def test_imports_run_one_way() -> None:
    for package, allowed in ALLOWED.items():
        for path in (ROOT / package).rglob("*.py"):
            ours = {name.split(".")[0] for name in imports(path)} & set(ALLOWED)
            assert ours <= allowed, f"{path} imports {ours - allowed}"


def test_only_a_machine_export_lets_fmu_see_machines() -> None:
    for path in (ROOT / "fmu").rglob("*.py"):
        if "machine" not in path.stem and not path.is_relative_to(ROOT / "fmu" / "verbs"):
            assert not any(name.split(".")[0] == "machines" for name in imports(path)), path


def test_analysis_never_looks_at_the_rig_that_made_the_records() -> None:
    for folder in ("jointlib", "machines", "fmu"):
        for path in (ROOT / folder).rglob("*.py"):
            if not path.is_relative_to(ROOT / "jointlib" / "rig"):
                assert not any(name.startswith("jointlib.rig") for name in imports(path)), path


def test_the_package_fmu_shares_its_name_with_other_distributions() -> None:
    line = '__path__ = __import__("pkgutil").extend_path(__path__, __name__)\n'
    assert (ROOT / "fmu" / "__init__.py").read_text() == line
    taken = {"config", "dataio", "tools", "settings", "datamodels", "pem", "sumo", "ensemble"}
    for folder in ("fmu", "machines"):
        assert not taken & {p.stem for p in (ROOT / folder).iterdir()}


def test_fmu_and_machines_import_themselves_relatively() -> None:
    for folder in ("fmu", "machines"):
        for path in (ROOT / folder).rglob("*.py"):
            assert not any(name.split(".")[0] == folder for name in imports(path)), path


def test_help_imports_no_numerics() -> None:
    code = (
        "import sys, jointlib.cli.main; print(sorted({'numpy', 'scipy', 'control', 'fmpy', 'pint'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


SLOW_TO_LOAD = {
    *("scipy.stats", "scipy.optimize", "scipy.signal", "scipy.interpolate", "scipy.integrate", "scipy.sparse"),
    *("pint", "dask", "pandas", "matplotlib", "plotly", "trimesh", "control", "fmpy"),
}


@pytest.mark.parametrize("verb", ["inspect", "modes", "frf", "lobes --speed 9000", "estimate"])
def test_a_verb_loads_what_it_uses(verb: str, tmp_path: Path) -> None:
    library = ROOT / "machines" / "library"
    file = library / ("tap_test/hits.measurement.toml" if verb == "estimate" else "two_mode_tool.toml")
    written = {"inspect": [], "modes": [], "estimate": ["-o", str(tmp_path / "out.measurement.toml")]}
    out = written.get(verb, ["-o", str(tmp_path / "out.npz")])
    arguments = [*verb.split()[:1], str(file), *verb.split()[1:], *out]
    code = (
        "import sys; from jointlib.cli.main import main\n"
        f"sys.argv = {['jointlib', *arguments]}\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        f"print(sorted({SLOW_TO_LOAD} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_modules_stay_small() -> None:
    for folder in ALLOWED:
        for path in (ROOT / folder).rglob("*.py"):
            assert len(path.read_text().splitlines()) <= 300, path


def modules() -> dict[str, Path]:
    """Every module of the house by its dotted name."""
    found = {}
    for folder in ALLOWED:
        for path in (ROOT / folder).rglob("*.py"):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = path
    return found


def imported(name: str, path: Path, known: Collection[str]) -> set[str]:
    """Modules of the house that one imports, inside functions too; not those for types alone."""
    return _imported(name, path, frozenset(known))


@functools.cache
def _imported(name: str, path: Path, known: frozenset[str]) -> set[str]:
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    for node, typed in statements(path):
        if typed:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        else:
            parts = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*parts, *([node.module] if node.module else [])])
            for alias in node.names:
                inside = f"{base}.{alias.name}"
                found.add(inside if inside in known else base)
    return found & set(known)


def room_of(name: str) -> str:
    """The room of a module of ``machines``; empty for what stands before all rooms."""
    parts = name.split(".")[1:]
    return "/".join(parts[:2] if parts[0] == "cutting" else parts[:1]) if len(parts) > 1 else ""


def test_rooms_of_machines_import_those_before_them() -> None:
    known = modules()
    order = ["", *ROOMS]
    outside = {"machines", "machines.lobes"}
    for name, path in known.items():
        if not name.startswith("machines.") or name in outside or path.name == "__init__.py":
            continue
        for other in imported(name, path, known):
            assert other not in outside or room_of(name) == "verbs", f"{name} imports {other}"
            if other.startswith("machines."):
                assert order.index(room_of(other)) <= order.index(room_of(name)), f"{name} imports {other}"


def test_rooms_of_the_loop_and_of_fmu_import_those_before_them() -> None:
    known = modules()
    for package, order in WINGS.items():
        for name, path in known.items():
            for other in imported(name, path, known) if name.startswith(f"{package}.") else ():
                if other.startswith(f"{package}."):
                    here, there = (_wing(one, package, order) for one in (name, other))
                    assert order.index(there) <= order.index(here), f"{name} imports {other}"


def _wing(name: str, package: str, order: tuple[str, ...]) -> str:
    """The room of a module of ``package``; a module that stands by itself counts as one where ``order`` names it."""
    first, _, inside = name.removeprefix(f"{package}.").partition(".")
    return first if inside or first in order else ""


def test_every_room_says_what_it_is() -> None:
    rooms = [f"machines/{room}" for room in (*ROOMS, "cutting")]
    rooms += [f"{package.replace('.', '/')}/{room}" for package, order in WINGS.items() for room in order if room]
    for room in rooms:
        path = ROOT / room / "__init__.py"
        if path.parent.name in ("kernels", "python_kernels", "loop_step"):
            continue
        assert ast.get_docstring(ast.parse(path.read_text())), path


def test_no_files_import_each_other_in_a_circle() -> None:
    known = modules()
    graph = {name: imported(name, path, known) - {name} for name, path in known.items()}
    waiting = TopologicalSorter(graph)
    waiting.prepare()


def test_no_folder_is_a_hall() -> None:
    for folder in {path.parent for path in modules().values()}:
        if str(folder.relative_to(ROOT)) not in CATALOGUES:
            held = [p.name for p in folder.glob("*.py") if p.name != "__init__.py"]
            assert len(held) <= MOST_FILES, f"{folder} holds {len(held)}"


def test_no_two_names_in_a_folder_differ_by_an_ending() -> None:
    endings = ("s", "es", "d", "ed", "er", "ing", "ion", "y")
    for folder in {path.parent for path in modules().values()}:
        names = {p.stem for p in folder.glob("*.py")}
        stems = {name[: -len(end)] for name in names for end in endings if name.endswith(end)}
        assert not names & stems, f"{folder}: {names & stems}"


@pytest.mark.thorough
def test_paths_that_pages_named_lead_on_with_a_warning() -> None:
    code = f"""
import importlib, warnings
for old, new in {MOVED!r}.items():
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        module, there = importlib.import_module(old), importlib.import_module(new)
    assert any(f"{{old}} is {{new}} now" in str(one.message) for one in said), old
    names = [name for name in vars(there) if not name.startswith("__")]
    assert names and all(getattr(module, name) is getattr(there, name) for name in names), old
from machines.lobes import tool_point  # a module now, as the import above has put it there
assert tool_point(lambda f: f[:, None, None] + 0j, ("x",), [1.0, 2.0, 3.0]).axes == ("x",)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_verbs_are_found_and_helped_without_numerics() -> None:
    code = "import sys, machines.verbs.run, machines.verbs.new; print(sorted({'scipy', 'control'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_name_that_machines_offers_is_there() -> None:
    import machines

    assert set(machines.__all__) == {*machines._HOME, *machines._ROOMS}
    assert all(getattr(machines, name) is not None for name in machines.__all__)
