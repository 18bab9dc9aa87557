"""Run an unpacked FMU along smooth inputs by model exchange and by co-simulation in FMPy, in a process of its own.

Reads a JSON request on standard input and writes the answer to the file named in it: the FMU may print.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .fresh_process import answering

_PERIODS = 2.5
"""Periods of the motion that are run."""
_INTERVALS = 400
"""Communication and output intervals a period."""
_TOLERANCE = 1e-8
"""Relative, of the solver, which is CVode."""


def both(request: dict[str, Any]) -> dict[str, Any]:
    """Outputs of both kinds on the same intervals, (samples, outputs), or what FMPy said of model exchange."""
    from fmpy import simulate_fmu

    step = request["period"] / _INTERVALS
    t = step * np.arange(round(_PERIODS * _INTERVALS) + 1)
    angle = 2 * np.pi * t / request["period"]
    columns = [
        size * (np.cos(angle) if rate else np.sin(angle))
        for size, rate in zip(request["sizes"], request["rates"], strict=True)
    ]
    signal = np.array(
        list(zip(t, *columns, strict=True)), dtype=[(name, float) for name in ("time", *request["inputs"])]
    )
    given = {"input": signal, "output": request["outputs"], "stop_time": t[-1], "output_interval": step}
    stepped = simulate_fmu(request["folder"], fmi_type="CoSimulation", step_size=step, **given)
    try:
        solved = simulate_fmu(
            request["folder"], fmi_type="ModelExchange", solver="CVode", relative_tolerance=_TOLERANCE, **given
        )
    except Exception as error:  # FMPy raises plain exceptions
        return {"said": f"{type(error).__name__}: {error}"}
    # Where an event happened there are two rows, of which the first is before it.
    at = [np.searchsorted(solved["time"], x - step / 4) for x in stepped["time"]]
    kept = [i for i, place in enumerate(at) if place < len(solved)]
    return {
        kind: [[float(rows[name][i]) for name in request["outputs"]] for i in places]
        for kind, rows, places in (("stepped", stepped, kept), ("solved", solved, [at[i] for i in kept]))
    }


if __name__ == "__main__":
    answering(both)
