"""`jointlib import` of 400 000 samples of 8 channels as text, beside pandas.read_csv on the same file.

Run it as a script. Each reading is a process of its own on one core; memory is its peak. pandas is told separator,
decimal mark, encoding and the lines above; jointlib finds them.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

NAMES = ("t [s]", "force [N]", "z [mm]", *(f"acc_{k} [g]" for k in range(1, 7)))

MEASURED = """
import pathlib, re, time
begun = time.perf_counter()
{code}
spent = time.perf_counter() - begun
status = pathlib.Path("/proc/self/status").read_text()  # ru_maxrss would count what this process was forked from
print(spent, int(re.search(r"VmHWM:\\s+(\\d+)", status)[1]) / 1024)
"""
IMPORT = """
import contextlib, io
from jointlib.cli.main import cli
with contextlib.redirect_stdout(io.StringIO()):
    cli.main(["import", {path!r}, "-o", {output!r}], prog_name="jointlib", standalone_mode=False)
"""
READ = """
from pathlib import Path
from jointlib.io.measurement_file import read_measurement, read_records
m = read_measurement(Path({output!r}))
read_records(m, m.records)
"""
PANDAS = """
import pandas
pandas.read_csv({path!r}, sep={separator!r}, decimal={decimal!r}, encoding={encoding!r}, skiprows=1)
"""


def written(path: Path, samples: int, separator: str, decimal: str, encoding: str) -> None:
    rng = np.random.default_rng(0)
    table = np.column_stack([np.arange(samples) / 51200, rng.normal(size=(samples, len(NAMES) - 1))])
    rows = [separator.join(f"{v:.7f}" for v in row).replace(".", decimal) for row in table.tolist()]
    path.write_text("\n".join(["Messung 7", separator.join(NAMES), *rows]) + "\n", encoding)


def measured(code: str) -> tuple[float, float]:
    """Seconds and MiB of a process; the best of three."""
    runs = []
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", MEASURED.format(code=code)], capture_output=True, text=True, check=True
        )
        runs.append(tuple(float(word) for word in done.stdout.split()))
    return min(t for t, _ in runs), min(m for _, m in runs)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=400_000)
    samples = parser.parse_args().samples
    dialects = {
        "comma, point, UTF-8": (",", ".", "utf-8"),
        "semicolon, decimal comma, Latin-1": (";", ",", "latin-1"),
        "tab, point, UTF-16": ("\t", ".", "utf-16"),
    }
    print(f"{samples} samples, {len(NAMES)} columns; s and MiB of a process with its imports")
    with tempfile.TemporaryDirectory() as folder:
        path, output = Path(folder) / "record.csv", Path(folder) / "m.measurement.toml"
        for name, (separator, decimal, encoding) in dialects.items():
            written(path, samples, separator, decimal, encoding)
            given = {"path": str(path), "output": str(output), "separator": separator, "decimal": decimal}
            peer = measured(PANDAS.format(**given, encoding=encoding))
            for what, code in (("import", IMPORT), ("read", READ)):
                own = measured(code.format(**given))
                print(
                    f"{name}: {what} {own[0]:.2f} s, {own[1]:.0f} MiB; pandas {peer[0]:.2f} s, {peer[1]:.0f} MiB; "
                    f"{own[0] / peer[0]:.1f} times the time"
                )
            output.unlink()


if __name__ == "__main__":
    main()
