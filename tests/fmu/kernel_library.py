"""A law's C kernel as a shared library of its own, called from Python one function at a time."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from fmu.code.c_kernel import FOLDER, CKernel, count, read_kernel
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.parameter import parameters_of

FLAGS = ("-std=c99", "-pedantic", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
_LAW = "const double *p, const int *n"
_POINT = f"{_LAW}, const double *s, const int *m, double z, double v"
SIGNATURES = {
    "check": ("const char *", _LAW),
    "initial": ("void", f"{_LAW}, double z, double *s, int *m"),
    "step": ("double", f"{_LAW}, const double *s, double z, double v, double h, double *after"),
    "step_partials": ("void", f"{_LAW}, const double *s, double z, double v, double *dF"),
    "force": ("double", _POINT),
    "rates": ("void", f"{_POINT}, double *rate"),
    "indicators": ("void", f"{_POINT}, double *g"),
    "event": ("int", f"{_LAW}, double *s, int *m, double z, double v"),
    "partials": ("void", f"{_POINT}, double *dF, double *dR"),
}
_RESULTS = {"void": None, "double": ctypes.c_double, "int": ctypes.c_int, "const char *": ctypes.c_char_p}
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-kernels-")


def words() -> list[str]:
    """The laws that have a C kernel."""
    return sorted(file.stem for file in FOLDER.glob("*.h"))


@functools.cache
def kernel(word: str) -> CKernel:
    """The header of a law, read."""
    return read_kernel(word, (FOLDER / f"{word}.h").read_text(encoding="utf-8"))


def source(included: Iterable[str]) -> str:
    """C that includes kernels and shows each of their functions to the outside."""
    lines = []
    for word in included:
        lines.append(f'#include "{FOLDER / f"{word}.h"}"')
        for purpose, (result, arguments) in SIGNATURES.items():
            if kernel(word).has(purpose):
                names = ", ".join(argument.split()[-1].lstrip("*") for argument in arguments.split(","))
                call = f"{'' if result == 'void' else 'return '}{word}_{purpose}({names});"
                lines.append(f"{result} show_{word}_{purpose}({arguments}) {{ {call} }}")
    return "\n".join(lines) + "\n"


@functools.cache
def compiled(*included: str) -> ctypes.CDLL:
    """A shared library of kernels, in one translation unit; any warning is an error."""
    stem = Path(_FOLDER.name) / f"{included[0]}_{len(included)}"
    stem.with_suffix(".c").write_text(source(included), encoding="utf-8")
    command = ["gcc", *FLAGS, "-shared", "-fPIC", "-o", f"{stem}.so", f"{stem}.c", "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(f"{stem}.so")


@dataclasses.dataclass
class Point:
    """States and modes of one element, in C's own arrays."""

    s: ctypes.Array[ctypes.c_double]
    m: ctypes.Array[ctypes.c_int]

    def copy(self) -> Point:
        return Point(type(self.s)(*self.s), type(self.m)(*self.m))


class Element:
    """One law with its numbers, as C sees it."""

    def __init__(self, law: JointLaw) -> None:
        self.law, self.word = law, law.kind.replace("-", "_")
        self.kernel = kernel(self.word)
        self.p = _doubles(Joint((law,)).parameters.values())
        lengths = [size for q in parameters_of(law) for size in np.shape(getattr(law, q.name))]
        self.n = (ctypes.c_int * (len(lengths) + 1))(*lengths)
        self.states = [state for _, state in self.kernel.state_names(lengths)]
        self.modes, self.indicator_count = (count(x, lengths) for x in (self.kernel.modes, self.kernel.indicators))

    @functools.cached_property
    def call(self) -> dict[str, Callable[..., Any]]:
        """The functions of the kernel, compiled when the first is called."""
        return {purpose: self._bound(purpose) for purpose in SIGNATURES if self.kernel.has(purpose)}

    def _bound(self, purpose: str) -> Callable[..., Any]:
        function = getattr(compiled(self.word), f"show_{self.word}_{purpose}")
        function.restype = _RESULTS[SIGNATURES[purpose][0]]
        return functools.partial(function, self.p, self.n)

    def start(self, z: float) -> Point:
        """The virgin element at a displacement in m."""
        point = Point(_doubles([0.0] * len(self.states)), (ctypes.c_int * max(self.modes, 1))())
        if "initial" in self.call:
            self.call["initial"](_d(z), point.s, point.m)
        return point

    def stepped(self, s: ctypes.Array[ctypes.c_double], z: float, v: float, h: float) -> tuple[float, ctypes.Array]:
        """Force of co-simulation after a step, and the states then."""
        if not self.states:
            return self.call["force"](s, None, _d(z), _d(v)), s
        after = _doubles([0.0] * len(self.states))
        return self.call["step"](s, _d(z), _d(v), _d(h), after), after

    def step_slopes(self, s: ctypes.Array[ctypes.c_double], z: float, v: float) -> list[float]:
        """∂f/∂z and ∂f/∂ż of co-simulation, the stored state held."""
        dF = _doubles([0.0, 0.0])
        if self.states:
            self.call["step_partials"](s, _d(z), _d(v), dF)
        else:
            self.call["partials"](s, None, _d(z), _d(v), dF, _doubles([0.0]))
        return list(dF)

    def pull(self, point: Point, z: float, v: float) -> float:
        """Force of model exchange."""
        return float(self.call["force"](point.s, point.m, _d(z), _d(v)))

    def rate(self, point: Point, z: float, v: float) -> np.ndarray:
        """Rate of every state, 0 of one that is not integrated."""
        rate = _doubles([0.0] * len(self.states))
        if "rates" in self.call:
            self.call["rates"](point.s, point.m, _d(z), _d(v), rate)
        return np.array(rate[: len(self.states)])

    def seen(self, point: Point, z: float, v: float) -> np.ndarray:
        """Event indicators."""
        g = _doubles([0.0] * self.indicator_count)
        if self.indicator_count:
            self.call["indicators"](point.s, point.m, _d(z), _d(v), g)
        return np.array(g[: self.indicator_count])

    def settle(self, point: Point, z: float, v: float) -> Point:
        """The point after an event."""
        after = point.copy()
        if self.modes:
            self.call["event"](after.s, after.m, _d(z), _d(v))
        return after

    def slopes(self, point: Point, z: float, v: float) -> tuple[np.ndarray, np.ndarray]:
        """Partials of the force and of each rate by z, v and the states."""
        size = len(self.states)
        dF, dR = _doubles([np.nan] * (2 + size)), _doubles([np.nan] * (size * (2 + size)))
        self.call["partials"](point.s, point.m, _d(z), _d(v), dF, dR)
        return np.array(dF[: 2 + size]), np.array(dR[: size * (2 + size)]).reshape(size, 2 + size)


def _d(value: float) -> ctypes.c_double:
    return ctypes.c_double(value)


def _doubles(values: Iterable[float]) -> ctypes.Array[ctypes.c_double]:
    held = [float(value) for value in values]
    return (ctypes.c_double * max(len(held), 1))(*held)
