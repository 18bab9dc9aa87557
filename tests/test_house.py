"""The house: imports run one way, the command line answers at once, names are one table."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
ALLOWED = {"jointlib": {"jointlib"}, "machines": {"machines", "jointlib"}, "fmu": {"fmu", "jointlib", "machines"}}


def imports(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module)
    return found


def test_imports_run_one_way() -> None:
    for package, allowed in ALLOWED.items():
        for path in (ROOT / package).rglob("*.py"):
            if path.is_relative_to(ROOT / "jointlib" / "cli"):
                continue
            ours = {name.split(".")[0] for name in imports(path)} & set(ALLOWED)
            assert ours <= allowed, f"{path} imports {ours - allowed}"


def test_only_a_machine_export_lets_fmu_see_machines() -> None:
    for path in (ROOT / "fmu").rglob("*.py"):
        if "machine" not in path.stem:
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


def test_modules_stay_small() -> None:
    for folder in ALLOWED:
        for path in (ROOT / folder).rglob("*.py"):
            assert len(path.read_text().splitlines()) <= 300, path
