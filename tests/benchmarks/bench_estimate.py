"""Time and memory of frequency responses from 400 000 samples of 8 channels, against sdypy-FRF where it is installed.

``python tests/benchmarks/bench_estimate.py`` prints seconds, the largest memory and, with sdypy-FRF in the environment,
the same responses by it in the same run and the ratio of the times.
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from jointlib import read_measurement
from jointlib.estimation.estimate import estimate

RATE, SAMPLES, SENSORS, HITS = 25600, 400_000, 7, 12
BLOCK = 32768


def records(folder: Path) -> tuple[Path, dict[str, np.ndarray]]:
    """Hits every 32 000 samples, and what seven sensors show: decaying sums of three sines."""
    rng = np.random.default_rng(0)
    columns = {"F": rng.normal(0, 0.05, SAMPLES)}
    t = np.arange(BLOCK) / RATE
    pulse = np.zeros(BLOCK)
    pulse[:26] = np.sin(np.pi * np.arange(26) / 26) ** 2
    decay = [np.exp(-60 * t) * np.sin(2 * np.pi * f * t) for f in (310.0, 720.0, 1500.0)]
    struck = [np.convolve(one, pulse[:26])[:BLOCK] for one in decay]
    starts = [1000 + k * 33000 for k in range(HITS)]
    for k in range(SENSORS):
        columns[f"x{k}"] = rng.normal(0, 0.01, SAMPLES)
    for start in starts:
        size = rng.uniform(200, 400)
        end = min(start + BLOCK, SAMPLES)
        columns["F"][start:end] += size * pulse[: end - start]
        for k in range(SENSORS):
            weights = np.cos(np.arange(3) * (k + 1))
            weights[weights < 0] *= 1.0 if k else -1.0
            signal = sum(w * s for w, s in zip(weights, struck, strict=True))
            columns[f"x{k}"][start:end] += size * signal[: end - start]
    np.savez(folder / "hits.npz", **columns)
    channels = '[[channel]]\nname = "F"\nquantity = "force"\nunit = "N"\ndof = "t.p0"\n'
    for k in range(SENSORS):
        channels += f'[[channel]]\nname = "x{k}"\nquantity = "displacement"\nunit = "m"\ndof = "t.p{k}"\n'
    (folder / "m.toml").write_text(
        f'schema = "jointlib/measurement/1"\nkind = "impact"\nsimulated = true\nsample_rate = {RATE}\n'
        "band = [10, 3000]\n"
        f'{channels}[[record]]\nfile = "hits.npz"\n[estimate]\nlength = {BLOCK / RATE}\n'
    )
    return folder / "m.toml", {
        name: np.array([c[s - 100 : s - 100 + BLOCK] for s in starts[:-1]]) for name, c in columns.items()
    }


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        file, blocks = records(Path(name))
        start = time.perf_counter()
        found = estimate(read_measurement(file))
        ours = time.perf_counter() - start
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{SAMPLES} samples of {SENSORS + 1} channels: {ours:.2f} s, at most {memory:.0f} MiB; {found.finding()}")
    try:
        from sdypy import FRF as peer  # type: ignore[import-not-found]
    except ImportError:
        print("sdypy-FRF is not installed, nothing to compare with")
        return
    start = time.perf_counter()
    made = peer.FRF(
        sampling_freq=RATE,
        exc=blocks["F"][:, None],
        resp=np.stack([blocks[f"x{k}"] for k in range(SENSORS)], axis=1),
        exc_type="f",
        resp_type="d",
    )
    H = made.get_H1()
    theirs = time.perf_counter() - start
    f = made.get_f_axis()
    worst = 0.0
    for k, frf in enumerate(found.frfs):
        at = np.searchsorted(f, frf.frequency - 1e-6)
        other = H[k, 0, at]
        worst = max(worst, float(np.linalg.norm(other - frf.value) / np.linalg.norm(frf.value)))
    print(f"sdypy-FRF: {theirs:.2f} s, ratio {theirs / ours:.2f}; the responses differ by {worst:.2g} in norm")


if __name__ == "__main__":
    main()
