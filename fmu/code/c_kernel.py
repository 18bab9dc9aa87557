"""The C kernels of the laws: physics only, one header for each law, read for what its first comment declares."""

from __future__ import annotations

import ast
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from jointlib.errors import InputError
from jointlib.law import JointLaw

from .kernel_file import kernel_file, word_of

FOLDER = Path(__file__).parents[1] / "kernels"
_KEYS = ("states", "modes", "indicators", "inputs", "exchange")


@dataclass(frozen=True)
class State:
    """One line of ``states``; a name that ends in ``[i]`` stands for one state of every element of a list law."""

    name: str
    unit: str
    continuous: bool
    """True if model exchange integrates it."""


@dataclass(frozen=True)
class CKernel:
    """What the header ``<word>.h`` declares and defines."""

    word: str
    text: str
    states: tuple[State, ...]
    modes: str
    """Number of modes as an expression in the lengths n[0], n[1], ..."""
    indicators: str
    inputs: frozenset[str]
    """Which of ``z`` and ``v`` the force depends on at the same instant."""
    exchange: bool
    """False for a law that exists in co-simulation only."""

    def has(self, purpose: str) -> bool:
        """True if the file defines ``<word>_<purpose>``."""
        return self._definition(purpose) is not None

    def uses(self, purpose: str) -> frozenset[str]:
        """Which of the arguments ``z``, ``v`` and ``s`` the function ``<word>_<purpose>`` reads."""
        return frozenset(name for name in "zvs" if re.search(rf"\b{name}\b", self._body(purpose)))

    def starts_at_displacement(self, i: int) -> bool:
        """True if the virgin value of the state ``i`` follows the displacement."""
        body = self._body("initial")
        assigned = re.search(rf"\bs\[{i}\]\s*=([^;]*);", body)
        return bool(re.search(r"\bz\b", assigned[1] if assigned else body))

    def _body(self, purpose: str) -> str:
        """The statements of ``<word>_<purpose>``."""
        start = self._definition(purpose)
        if start is None:
            return ""
        depth, end = 1, start
        while depth:
            depth += {"{": 1, "}": -1}.get(self.code[end], 0)
            end += 1
        return re.sub(r"\(void\)\s*\w+\s*;", " ", self.code[start:end])

    @cached_property
    def code(self) -> str:
        """The text without its comments."""
        return re.sub(r"/\*.*?\*/", " ", self.text, flags=re.DOTALL)

    def _definition(self, purpose: str) -> int | None:
        """Where the body of ``<word>_<purpose>`` begins in :attr:`code`, behind its brace."""
        found = re.search(rf"\b{self.word}_{purpose}\s*\([^;{{}}]*\)\s*{{", self.code)
        return found.end() if found else None

    def state_names(self, lengths: Sequence[int]) -> list[tuple[str, State]]:
        """Every state by its name, the states of a list law element by element."""
        out: list[tuple[str, State]] = []
        for state in self.states:
            if state.name.endswith("[i]"):
                out += [(f"{state.name[:-3]}[{i}]", state) for i in range(lengths[0])]
            else:
                out.append((state.name, state))
        return out


def count(expression: str, lengths: Sequence[int]) -> int:
    """Value of a count such as ``2*n[0] + 1``."""
    text = re.sub(r"\bn\[(\d+)\]", lambda match: str(lengths[int(match[1])]), expression)
    return _whole(ast.parse(text, mode="eval").body)


def _whole(node: ast.expr) -> int:
    if isinstance(node, ast.Constant) and isinstance(node.value, int):
        return node.value
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Mult):
        left, right = _whole(node.left), _whole(node.right)
        return left + right if isinstance(node.op, ast.Add) else left * right
    raise ValueError(f"{ast.unparse(node)}: expected a sum or product of whole numbers and lengths")


def c_kernel_of(law: JointLaw) -> CKernel | None:
    """The C kernel of a law; None where there is none."""
    word = word_of(law)
    file = kernel_file(law, FOLDER / f"{word}.h", f"{word}.h")
    return read_kernel(word, _whole_text(file)) if file else None


def _whole_text(file: Path) -> str:
    """A header with those put in that it includes from beside it; what several include guards itself."""

    def put_in(line: re.Match[str]) -> str:
        other = file.parent / line[1]
        return _whole_text(other).strip() if other.is_file() else line[0]

    return re.sub(r'^#include "([^"]+)"$', put_in, file.read_text(encoding="utf-8"), flags=re.MULTILINE)


def read_kernel(word: str, text: str) -> CKernel:
    """A kernel from the text of its header; the first comment declares states, modes, indicators and inputs."""
    comment = re.search(r"/\*(.*?)\*/", text, flags=re.DOTALL)
    told: dict[str, list[str]] = {key: [] for key in _KEYS}
    key = ""
    for line in (comment[1] if comment else "").splitlines():
        found = re.match(rf"[\s*]*({'|'.join(_KEYS)}):\s*(.*?)\s*$", line)
        if found:
            key = found[1]
            told[key].append(found[2])
    for key in ("inputs", "exchange"):
        if len(told[key]) != 1:
            raise InputError(f"{word}.h: {len(told[key])} lines '{key}:', expected one in the first comment")
    states = []
    for entry in told["states"]:
        name, *rest = entry.split() or [""]
        if name in {"", "none", "-", "0"}:
            continue
        continuous = rest[-1:] == ["continuous"]
        states.append(State(name, " ".join(rest[:-1] if continuous else rest), continuous))
    modes, indicators = ((told[key] or [""])[0] or "0" for key in ("modes", "indicators"))
    return CKernel(
        word,
        text,
        tuple(states),
        modes,
        indicators,
        frozenset(told["inputs"][0].split()) & {"z", "v"},
        told["exchange"][0].split()[:1] == ["yes"],
    )
