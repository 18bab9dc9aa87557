"""Makes ``taps.png``: hits of the tap test that ships, one clean and two left out; ``python docs/taps_picture.py``."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointlib import read_measurement, read_records
from jointlib.shown.pictures import write_picture

DOCS = Path(__file__).parent
HITS = (
    (0.058, "a clean hit"),
    (1.703, "a double hit: left out"),
    (2.804, "an overload: left out"),
)


def main() -> None:
    """The force in its first milliseconds, and the motion in the whole block."""
    from matplotlib.figure import Figure

    m = read_measurement(DOCS.parent / "machines" / "library" / "tap_test" / "hits.measurement.toml")
    (record,) = read_records(m, m.records)
    rate = record.sample_rate
    axes = Figure(figsize=(10.0, 4.6), layout="constrained").subplots(2, 3, sharey="row")
    for column, (at, title) in enumerate(HITS):
        force = record.channels["hammer"]
        first = int((at - 0.002) * rate) + int(np.argmax(np.abs(force[int((at - 0.002) * rate) :][:400]) > 50)) - 20
        for row, (name, unit, length) in enumerate((("hammer", "force [N]", 0.012), ("acc", "motion [m/s²]", 0.08))):
            part = record.channels[name][first : first + int(length * rate)]
            axes[row, column].plot(1e3 * np.arange(len(part)) / rate, part, linewidth=1.1)
            axes[row, column].set(xlabel="time [ms]")
            axes[row, 0].set(ylabel=unit)
        axes[0, column].set_title(title)
    write_picture(DOCS / "taps.png", axes[0, 0])


if __name__ == "__main__":
    main()
