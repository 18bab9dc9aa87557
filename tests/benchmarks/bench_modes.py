"""Modes of simulated frequency responses beside sdypy-EMA, where it is installed: time and errors on the same lines.

``python tests/benchmarks/bench_modes.py``. The peer is told the true frequencies, as a user would by picking poles in
its chart; ours picks for itself.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from jointlib.modal_fit.fit import fit_modes

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "jointlib"))
from test_modal_fit import match, random_machine

SEEDS = (11, 12, 16, 18, 20, 22)


def peer_of(responses: object, modes: object) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and damping ratios by sdypy-EMA, nearest to the true ones."""
    from sdypy import EMA  # type: ignore[import-not-found]

    model = EMA.Model(
        responses.value,  # type: ignore[attr-defined]
        responses.frequency,  # type: ignore[attr-defined]
        lower=50,
        upper=1950,
        pol_order_high=40,
        frf_form="receptance",
    )
    model.get_poles(method="lscf", show_progress=False)
    model.select_closest_poles(modes.frequency.tolist())  # type: ignore[attr-defined]
    return np.array(model.nat_freq), np.array(model.nat_xi)


def main() -> None:
    rows: dict[str, list[tuple[float, float, float]]] = {"ours": [], "sdypy-EMA": []}
    for seed in SEEDS:
        modes, responses = random_machine(seed)
        start = time.process_time()
        found = fit_modes(responses)
        spent = time.process_time() - start
        pairs = match(modes, found)
        off = [
            (abs(found.frequency[k] / modes.frequency[r] - 1), abs(found.damping_ratio[k] / modes.damping_ratio[r] - 1))
            for r, k in pairs
        ]
        rows["ours"].append((spent, *(float(np.median(column)) for column in zip(*off, strict=True))))
        try:
            start = time.process_time()
            f, zeta = peer_of(responses, modes)
            spent = time.process_time() - start
        except ImportError:
            continue
        apart = np.abs(f / modes.frequency - 1), np.abs(zeta / modes.damping_ratio - 1)
        rows["sdypy-EMA"].append((spent, float(np.median(apart[0])), float(np.median(apart[1]))))
    for name, found_rows in rows.items():
        if not found_rows:
            print(f"{name} is not installed, nothing to compare with")
            continue
        spent, frequency, damping = np.median(found_rows, axis=0)
        print(
            f"{name}: {spent:.2f} s a machine, error of frequency {frequency:.1e}, of damping {damping:.1e} (medians)"
        )


if __name__ == "__main__":
    main()
