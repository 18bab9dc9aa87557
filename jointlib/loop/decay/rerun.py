"""Free decays run by a joint, and the curves that show them."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.loop.decay.fitted import Fitted
from jointlib.ringdown.evidence import Evidence
from jointlib.ringdown.predicted import predict


def run_again(evidence: Evidence, before: Fitted, after: Fitted) -> dict[str, Any]:
    """How far the amplitude of a decay, run from its first value on, goes off the record before and after: rms of
    the logarithm."""
    out: dict[str, Any] = {}
    for word, one in (("before", before), ("after", after)):
        try:
            off = []
            lowest = float(evidence.amplitudes[0]) / 3
            model = predict(
                one.joint, evidence.modal_mass, lowest, float(evidence.amplitudes[-1]), alone=evidence.alone
            )
            for b in evidence.backbones:
                run = model.decay(float(b.amplitude[0]), b.time - b.time[0])[0]
                off.append(np.log(np.where(np.isfinite(run), run, lowest) / b.amplitude))
            out[word] = float(np.sqrt(np.mean(np.concatenate(off) ** 2)))
        except InputError as error:
            out[word], out["why"] = None, str(error)
    return out


def pictures(evidence: Evidence, before: Fitted, after: Fitted) -> dict[str, Array]:
    """Frequency (Hz) and damping ratio over amplitude (m), measured and by the joint before and after."""
    every = evidence.backbones
    plots = {
        "decay_amplitude": np.concatenate([b.amplitude for b in every]),
        "decay_frequency": np.concatenate([b.omega for b in every]) / (2 * np.pi),
        "decay_damping": np.concatenate([b.damping_ratio for b in every]),
        "decay_frequency_error": np.concatenate([b.omega_error for b in every]) / (2 * np.pi),
        "decay_damping_error": np.concatenate([b.ratio_error for b in every]),
    }
    a = evidence.amplitudes
    for word, one in (("before", before), ("after", after)):
        try:
            model = predict(one.joint, evidence.modal_mass, float(a[0]), float(a[-1]), alone=evidence.alone)
        except InputError:
            continue
        plots[f"decay_model_amplitude_{word}"] = model.amplitude
        plots[f"decay_model_frequency_{word}"] = model.omega / (2 * np.pi)
        plots[f"decay_model_damping_{word}"] = model.damping_ratio
    return plots
