"""The scalar kernels of the laws: physics only, one small standard-library file for each law."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from pathlib import Path

from jointlib.errors import InputError
from jointlib.law import JointLaw

from .c_kernel import c_kernel_of
from .kernel_file import kernel_file, word_of

_FOLDER = Path(__file__).parents[1] / "python_kernels"


@dataclass(frozen=True)
class Kernel:
    """What one kernel file defines for a law named ``word`` (``hertz_guide``).

    Without memory ``<word>_force(z, v, *, parameters)``; with memory ``<word>_initial(z, *, parameters)`` and
    ``<word>_step(z, v, h, state, *, parameters)``, which returns the force at the end of the step and the new state.
    ``<word>_check(*, parameters)`` may refuse parameters that do not go together.
    """

    word: str
    source: str
    """The definitions, without the module's docstring and imports."""
    functions: frozenset[str]
    inputs: frozenset[str]
    """Which of ``z`` and ``v`` the force uses."""
    state_units: dict[str, str] = field(default_factory=dict)
    """SI units of the internal states."""

    def has(self, purpose: str) -> bool:
        """True if the file defines ``<word>_<purpose>``."""
        return f"{self.word}_{purpose}" in self.functions


def kernel_of(law: JointLaw) -> Kernel:
    """The kernel of a law, or one sentence that says why the law cannot be exported.

    Of a law that has a C kernel alone it has no functions, and inputs and units are those that kernel declares.
    """
    if not law.in_time:
        raise InputError(f"{law.kind}: a law of the frequency domain only, expected laws that act in time for an FMU")
    word = word_of(law)
    file = kernel_file(law, _FOLDER / f"{word}.py", f"{word}_kernel.py")
    if file is not None:
        return _read(word, file.read_text(encoding="utf-8"))
    native = c_kernel_of(law)
    if native is None:
        raise InputError(
            f"{law.kind}: no FMU kernel for this law, expected {word}.h (native) or {word}_kernel.py (Python runtime) "
            "beside the module of the law"
        )
    units = {state.name.split("[")[0]: state.unit for state in native.states}
    return Kernel(word, "", frozenset(), native.inputs, units)


def _read(word: str, text: str) -> Kernel:
    pieces: list[str] = []
    functions: set[str] = set()
    inputs: set[str] = set()
    units: dict[str, str] = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            functions.add(node.name)
            if node.name in {f"{word}_force", f"{word}_step"}:
                used = {n.id for statement in node.body for n in ast.walk(statement) if isinstance(n, ast.Name)}
                inputs |= used & {"z", "v"}
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == f"{word}_state_units":
            units = ast.literal_eval(node.value)
            continue
        elif isinstance(node, ast.Expr | ast.Import | ast.ImportFrom):
            continue
        pieces.append(ast.get_source_segment(text, node) or "")
    return Kernel(word, "\n\n\n".join(pieces), frozenset(functions), frozenset(inputs), units)
