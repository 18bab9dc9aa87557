"""Names from files, wherever they stand in them, are text in reports and FMUs, and come back from what was imported."""

from __future__ import annotations

import csv
import json
import re
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import LIBRARY, jointlib
from repeats import repeats

from jointlib.io.measurement_file import read_measurement, read_records

MARKUP = "<img src=x onerror=alert(1)></script>'&\\\""
CODE = ('*/ #error in C "; system(1); //', MARKUP, "%s%n\\", "${7*7}")
COLUMNS = (
    'a"b',
    "a\\b",
    "a'b",
    "#x",
    "[x]",
    "a=b",
    "a.b",
    '"""',
    "'''",
    "a,b",
    "{x}",
    "%s",
    "-1",
    "true",
    "a:b",
    "ü µ",
    MARKUP,
)


def only_text(page: Path) -> None:
    """The markup is in a page as text, and as such alone."""
    text = page.read_text("utf-8")
    assert "&lt;img src=x onerror" in text
    assert "<img src=x" not in re.sub(r"<script\b[^>]*>.*?</script>", "", text, flags=re.DOTALL)
    assert text.count("</script") == len(re.findall(r"<script\b", text))


def two_mode_tool(more: str) -> str:
    """A machine whose part has ``more`` in its name, as its machine has."""
    text = (LIBRARY / "two_mode_tool.toml").read_text("utf-8")
    return re.sub(r'"(cutter|two-mode tool)(\.\w+)?"', lambda m: json.dumps(m[1] + more + (m[2] or "")), text)


@pytest.mark.thorough
def test_a_part_is_text_in_the_report_of_a_run(here: Path) -> None:
    Path("<img src=x onerror=alert(1)>.toml").write_text(two_mode_tool(MARKUP), "utf-8")
    done = jointlib(["run", "<img src=x onerror=alert(1)>.toml", "-o", "out"])
    assert done.status == 0, done.err
    only_text(Path("out/report.html"))


@pytest.mark.thorough
def test_a_record_its_condition_and_a_joint_are_text_in_the_report_of_a_trace(here: Path) -> None:
    shutil.copytree(LIBRARY / "guide_mill", "mill")
    text = Path("mill/rig.measurement.toml").read_text("utf-8")
    for name in set(re.findall(r'^file = "(.*)"', text, re.MULTILINE)):
        Path("mill", name).rename(Path("mill", f"<img src=x onerror=alert(1)>{name}"))
    text = re.sub(r'^(file = ")', r"\g<1><img src=x onerror=alert(1)>", text, flags=re.MULTILINE)
    text = re.sub(
        r'^condition = "(.*)"', lambda m: f"condition = {json.dumps(m[1] + MARKUP)}", text, flags=re.MULTILINE
    )
    Path("mill/rig.measurement.toml").write_text(text, "utf-8")
    joint = Path("mill/start.joint.toml").read_text("utf-8")
    Path("mill/start.joint.toml").write_text(joint.replace('"guide"', json.dumps(MARKUP), 1), "utf-8")
    done = jointlib("trace mill/rig.measurement.toml --joint mill/start.joint.toml -o out")
    assert done.status == 0, done.err
    only_text(Path("out/report.html"))


@pytest.mark.thorough
@pytest.mark.parametrize("name", CODE)
def test_a_part_is_no_code_and_no_markup_in_the_fmu_of_its_machine(name: str, here: Path) -> None:
    Path("m.toml").write_text(two_mode_tool(name), "utf-8")
    done = jointlib("fmu m.toml -o m.fmu")
    assert done.status == 0, done.err
    with zipfile.ZipFile("m.fmu") as archive:
        pages = [archive.read(member) for member in archive.namelist() if member.endswith((".html", ".xml"))]
    assert pages
    assert not any(b"<img" in page or b"</script" in page for page in pages)


@pytest.mark.parametrize("name", repeats(COLUMNS, lambda name: name in COLUMNS[:6]))
def test_what_import_writes_is_read_whatever_a_column_is_called(name: str, here: Path) -> None:
    t = np.arange(400) / 1000
    with Path("r.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["time [s]", f"{name} force [N]", f"{name} [m]"])
        rows.writerows(np.column_stack([t, np.sin(300 * t), 1e-6 * np.cos(300 * t)]).tolist())
    done = jointlib("import r.csv --kind static -o m.measurement.toml")
    assert done.status == 0, done.err
    found = read_measurement(Path("m.measurement.toml"))
    assert sum(name.strip('"') in str(channel.column or channel.name) for channel in found.channels) == 2
    (record,) = read_records(found, found.records)
    assert len(record.channels) >= 2
