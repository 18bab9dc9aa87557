"""A sensor whose curve is not straight."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Setting, Shape

_STEPS = 100


class SensorNonlinearity(Fault):
    """measured = x + quadratic·x² + cubic·x³: harmonics in one channel that the others do not share."""

    family: ClassVar[str] = "sensor-nonlinearity"
    words: ClassVar[str] = "that the curve of sensor {site} is not straight (sensor-nonlinearity)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "contact-loss": "Exchange the sensor, or measure the driving force and a second acceleration behind the joint.",
        "clipping": "Repeat the top level with a wider input range.",
        "gain": "Run a lower level: a bent curve grows straight, a wrong gain stays wrong.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"quadratic": "1/channel", "cubic": "1/channel^2"}
    experiment: ClassVar[str] = "Exchange the sensor, or measure the driving force too."

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        powers = record.averaged(site) ** [[2], [3]]
        return record.on_channel(site, record.lines_of(powers))

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"quadratic": float(coefficients[0]), "cubic": float(coefficients[1])}

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        return {**channels, site: _straightened(channels[site], parameters["quadratic"], parameters["cubic"], site)}


def _straightened(y: Array, quadratic: float, cubic: float, site: str) -> Array:
    """x of y = x + quadratic·x² + cubic·x³ on the branch through zero, by Newton's method for every sample."""
    turns = np.roots([3 * cubic, 2 * quadratic, 1.0])
    turns = (1 - 1e-9) * turns[turns.imag == 0].real
    low, high = max(turns[turns < 0], default=-np.inf), min(turns[turns > 0], default=np.inf)
    x = np.clip(y, low, high)
    scale = float(np.max(np.abs(y), initial=0.0))
    for _ in range(_STEPS):
        slope = 1 + x * (2 * quadratic + 3 * cubic * x)
        moved = np.clip(x - (x * (1 + x * (quadratic + cubic * x)) - y) / slope, low, high)
        change = float(np.max(np.abs(moved - x), initial=0.0))
        x = moved
        if change <= 1e-14 * scale:
            break
    if np.max(np.abs(x * (1 + x * (quadratic + cubic * x)) - y), initial=0.0) > 1e-9 * scale:
        raise InputError(
            f"correction sensor-nonlinearity: with quadratic = {quadratic:g} and cubic = {cubic:g} the curve of {site} "
            f"turns back below its largest sample, {scale:g}; expected a curve that rises throughout"
        )
    return x
