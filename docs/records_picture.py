"""Makes ``records.png`` and ``modes.png``: records of hits and what they give; ``python docs/records_picture.py``.

The records are those of the tap test that ships, simulated: as they are, as of an amplifier whose range is far too
large, and with hum and noise of a loose cable.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from jointlib import estimate, fit_modes, read_measurement
from jointlib.modal_fit.responses import Responses
from jointlib.shown.pictures import write_picture

DOCS = Path(__file__).parent
TAPS = DOCS.parent / "machines" / "library" / "tap_test"
RATE = 12800.0
FIRST, LENGTH = 0.055, 0.08
"""s, of what is shown of the motion."""


def spoilt(what: str) -> dict[str, np.ndarray]:
    """Counts of hammer and accelerometer; 5000 m/s² are 32767."""
    with np.load(TAPS / "hits.npz") as held:
        columns = {name: held[name].astype(float) for name in held.files}
    rng, count = np.random.default_rng(1), 32767 / 5000
    t = np.arange(len(columns["acc"])) / RATE
    if what == "range":
        columns["acc"] = 400 * np.round(columns["acc"] / 400)
    elif what == "hum":
        columns["acc"] += count * (40 * np.sin(2 * np.pi * 50 * t) + rng.normal(0, 40, len(t)))
    return columns


def main() -> None:
    """The motion after the first hit above the response with the band of 95 %."""
    from matplotlib.figure import Figure

    axes = Figure(figsize=(10.5, 5.6), layout="constrained").subplots(2, 3, sharey="row")
    cases = (
        ("", "good: at rest before and after"),
        ("range", "bad: steps of a range far too large"),
        ("hum", "bad: hum and noise of a loose cable"),
    )
    for column, (what, title) in enumerate(cases):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            counts = spoilt(what)
            np.savez(folder / "hits.npz", **counts)
            text = (TAPS / "hits.measurement.toml").read_text("utf-8")
            (folder / "hits.measurement.toml").write_text(text, "utf-8")
            (frf,) = estimate(read_measurement(folder / "hits.measurement.toml")).frfs
        t = np.arange(len(counts["acc"])) / RATE
        part = (t >= FIRST) & (t < FIRST + LENGTH)
        axes[0, column].plot(1e3 * (t[part] - FIRST), counts["acc"][part] * 5000 / 32767, linewidth=0.9)
        axes[0, column].set(xlabel="time [ms]")
        axes[0, column].set_title(title, fontsize=10)
        assert frf.radius is not None
        size = 1e6 * np.abs(frf.receptance)
        off = 1e6 * frf.radius / np.abs(frf.quantity.per_receptance(frf.frequency))
        lower = axes[1, column]
        lower.fill_between(frf.frequency, np.maximum(size - off, 1e-3), size + off, alpha=0.3, linewidth=0)
        lower.semilogy(frf.frequency, size, linewidth=0.9)
        lower.set(xlabel="frequency [Hz]", ylim=(2e-3, 5))
        lower.set_title(f"coherence {np.median(frf.coherence):.4f} in the median", fontsize=10)
        if not what:
            assert frf.deviation_together is not None
            modes = fit_modes(
                Responses(frf.frequency, frf.receptance[None], frf.deviation_together[None], ((0, 0),), ("tool.x",))
            )
            write_picture(DOCS / "modes.png", modes.plot())
    axes[0, 0].set(ylabel="motion [m/s²]")
    axes[1, 0].set(ylabel="|x/F| [µm/N], band of 95 %")
    write_picture(DOCS / "records.png", axes[0, 0])


if __name__ == "__main__":
    main()
