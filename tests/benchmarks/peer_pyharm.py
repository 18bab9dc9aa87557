"""The two masses of the benchmark in pyHarm (PyPI pyharm-os, Apache-2.0), as JSON on standard output.

Run by a Python that has pyharm-os: python tests/benchmarks/peer_pyharm.py FORCE LOW HIGH HARMONICS STEP [MASSES]
With MASSES the chain of so many masses whose first spring is the joint. Units inside: µm, N, ms, kg.
"""

from __future__ import annotations

import json
import logging
import sys
import time

import numpy as np


def matrices(masses: int) -> dict[str, np.ndarray]:
    """Mass, damping and stiffness with the linear part of the joint in them."""
    m = np.array([0.942, 2.2]) if masses == 2 else np.random.default_rng(0).uniform(0.8, 2.2, masses)
    K, C = np.zeros((masses, masses)), np.zeros((masses, masses))
    for i in range(masses - 1):
        b = np.zeros(masses)
        b[i], b[i + 1] = 1.0, -1.0
        K += 654.164 * np.outer(b, b)
        C += 0.463062 * np.outer(b, b)
    K[-1, -1] += 200.0
    C[-1, -1] += 0.2
    return {"M": np.diag(m), "C": C, "K": K, "G": np.zeros((masses, masses))}


def main() -> None:
    """Print frequency (Hz), complex relative displacement (µm) of the first harmonic and seconds taken."""
    import pyHarm

    logging.disable(logging.CRITICAL)
    force, low, high = (float(a) for a in sys.argv[1:4])
    harmonics, step = [int(h) for h in sys.argv[4].split(",")], float(sys.argv[5])
    pair = {"connect": {"s": [0], "INTERNAL": [1]}, "dirs": [0]}
    data = {
        "system": {"type": "Base", "nh": harmonics, "nti": 64},
        "substructures": {
            "s": {
                "matrix": matrices(int(sys.argv[6]) if len(sys.argv) > 6 else 2),
                "ndofs": 1,
                "nmodes": 0,
            }
        },
        "connectors": {
            "cubic": {"type": "CubicSpring", **pair, "k": -1.7083},
            "force": {"type": "CosinusForcing", "connect": {"s": [0]}, "dirs": [0], "amp": force},
        },
        "kinematics": {},
        "coordinates": {},
        "analysis": {
            "frf": {
                "study": "frf",
                "puls_inf": 2e-3 * np.pi * low,
                "puls_sup": 2e-3 * np.pi * high,
                "ds0": 0.05 * step,
                "ds_max": 0.1 * step,
                "ds_min": 1e-10,
                "verbose": False,
                "solver_options": {"root": {"method": "hybr", "options": {"xtol": 1e-13}}, "residual_tolerance": 1e-8},
            }
        },
    }
    # The first run compiles.
    for _ in range(2):
        machine = pyHarm.Maestro(data)
        start = time.process_time()
        machine.operate()
        taken = time.process_time() - start
    table = machine.system.expl_dofs
    first = table[table["harm"] == 1]
    at = {(n, s): int(first[(first["node_num"] == n) & (first["cs"] == s)].index[0]) for n in (0, 1) for s in "cs"}
    found = [s for s in machine.nls["frf"].SolList if s.flag_accepted]
    x = np.array([s.x for s in found])
    z = x[:, at[0, "c"]] - x[:, at[1, "c"]] - 1j * (x[:, at[0, "s"]] - x[:, at[1, "s"]])
    out = {
        "frequency": (x[:, -1] / (2e-3 * np.pi)).tolist(),
        "real": z.real.tolist(),
        "imag": z.imag.tolist(),
        "seconds": taken,
    }
    print(json.dumps(out))


if __name__ == "__main__":
    main()
