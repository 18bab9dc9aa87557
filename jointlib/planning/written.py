"""The folder of a plan: what to play, the measurement file to fill, and the plan as numbers."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from jointlib.io.atomic import Fill, text_in, write_together
from jointlib.planning.measurement_text import record_names, text_to_fill
from jointlib.planning.multisine import phases, unit_force
from jointlib.planning.plan import Plan
from jointlib.planning.told import as_json, sentences
from jointlib.shown.json_values import plain


def write_plan(plan: Plan, folder: Path, joint: str) -> tuple[Path, ...]:
    """``measurement.toml``, ``excitation.csv`` (one period of every record in N), ``play_*.wav`` (whole records, 32 bit
    floats that are 1 at the largest force of all) and ``plan.json``; ``joint`` is the file that is to be traced."""
    bench = plan.bench
    c, names = bench.campaign, record_names(bench.campaign)
    once = [level * bench.drive * unit_force(phases(c, i, bench.seed), c.period, 1) for i, level in enumerate(c.drives)]
    scale = max(float(np.abs(x).max()) for x in once)
    said = [*sentences(plan), f"In play_*.wav a sample of 1 stands for {scale:.6g} N."]
    to_fill = text_to_fill(bench.setup, c, bench.drive, said, joint)
    time = np.arange(c.period) / c.sample_rate
    rows = [",".join(f"{x:.9g}" for x in row) for row in zip(time, *once, strict=True)]
    table = "\n".join([",".join(["time [s]", *(f"{n} [N]" for n in names)]), *rows, ""])
    files: dict[Path, Fill] = {folder / "measurement.toml": text_in(to_fill), folder / "excitation.csv": text_in(table)}
    for name, x in zip(names, once, strict=True):
        files[folder / f"play_{name}.wav"] = partial(
            _wav, once=x / scale, periods=c.settle + c.periods, rate=round(c.sample_rate)
        )
    made = (*files, folder / "plan.json")
    told: dict[str, Any] = {**as_json(plan), "wav_full_scale_N": scale, "files": [str(p) for p in made]}
    files[made[-1]] = text_in(json.dumps(plain(told), indent=1, allow_nan=False) + "\n")
    write_together(files)
    return made


def _wav(file: IO[bytes], once: NDArray[np.float64], periods: int, rate: int) -> None:
    from scipy.io import wavfile

    wavfile.write(file, rate, np.tile(once, periods).astype(np.float32))
