"""The folder of a machine's plan: the stepped sines to play, the measurement file to fill, and the plan as numbers."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.io.atomic import Fill, text_in, write_together
from jointlib.shown.json_values import plain

from .plan import MachinePlan
from .probe import SEALED, Bench, record_name
from .told import as_json, sentences

_CYCLES, _SHORTEST = 20, 0.25
"""Of the sine on each line, and s."""
_PER_CYCLE = 12.0
_RATES = tuple(base * scale for scale in (1.0, 10.0, 100.0) for base in (1024.0, 2048.0, 2560.0, 5120.0))


def write_plan(plan: MachinePlan, folder: Path, machine: str) -> tuple[Path, ...]:
    """``measurement.toml``, ``schedule.csv`` (when which line is played), ``play_*N.wav`` (a stepped sine for every
    force, 32 bit floats that are 1 at the top force) and ``plan.json``."""
    b, t = plan.bench, plan.test
    rate = next((r for r in sorted(_RATES) if r >= _PER_CYCLE * b.lines[-1]), float(np.ceil(_PER_CYCLE * b.lines[-1])))
    samples = np.ceil(rate * np.maximum(_CYCLES / b.lines, _SHORTEST)).astype(int)
    begin = np.concatenate([[0], np.cumsum(samples)[:-1]]) / rate
    rows = [f"{f:.9g},{at:.9g},{n / rate:.9g}" for f, at, n in zip(b.lines, begin, samples, strict=True)]
    table = "\n".join(["frequency [Hz],begins [s],lasts [s]", *rows, ""])
    to_fill = _to_fill(plan, machine)
    files: dict[Path, Fill] = {folder / "measurement.toml": text_in(to_fill), folder / "schedule.csv": text_in(table)}
    one = _stepped(b.lines, samples, rate)
    for n in sorted({*t.levels, SEALED}):
        played = partial(_wav, samples=one, size=b.forces[n] / b.top, rate=round(rate))
        files[folder / f"play_{b.forces[n]:.3g}N.wav"] = played
    made = (*files, folder / "plan.json")
    told: dict[str, Any] = {**as_json(plan), "wav_full_scale_N": b.top, "files": [str(p) for p in made]}
    files[made[-1]] = text_in(json.dumps(plain(told), indent=1, allow_nan=False) + "\n")
    write_together(files)
    return made


def _stepped(lines: Array, samples: NDArray[np.int64], rate: float) -> Array:
    """A sine whose frequency steps from line to line without a jump of its phase."""
    phase = np.concatenate([[0.0], np.cumsum(2 * np.pi * np.repeat(lines, samples) / rate)[:-1]])
    return np.asarray(np.sin(phase))


def _to_fill(plan: MachinePlan, machine: str) -> str:
    b: Bench = plan.bench
    parts = [
        "# To fill: the frequency responses to what play_*.wav makes, one CSV each (frequency,re,im), or .uff.",
        *(f"# {line}" for line in sentences(plan)),
        f"# In play_*.wav a sample of 1 stands for {b.top:.6g} N (peak); schedule.csv says when each line begins.",
        '# From records in time: a measurement of kind "shaker" and `jointlib estimate`.',
        f"# Then: jointlib inspect measurement.toml, and jointlib trace measurement.toml --machine {machine} -o traced",
        tomli_w.dumps({"schema": "jointlib/measurement/1", "kind": "frf"}).rstrip(),
    ]
    for p, n, sealed in plan.test.rows():
        record = {
            "file": f"{record_name(b, p, n)}.csv",
            "drive": b.drive,
            "response": b.places[p],
            "quantity": "receptance",
            "force": f"{b.forces[n]:.6g} N",
            **({"role": "sealed"} if sealed else {}),
        }
        why = "; opened once, for the error before and after" if sealed else ""
        parts += ["", f"# play_{b.forces[n]:.3g}N.wav{why}", f"[[record]]\n{tomli_w.dumps(record)}".rstrip()]
    return "\n".join(parts) + "\n"


def _wav(file: IO[bytes], samples: Array, size: float, rate: int) -> None:
    from scipy.io import wavfile

    wavfile.write(file, rate, (samples * size).astype(np.float32))
