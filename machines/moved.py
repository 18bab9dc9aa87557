"""Import paths that pages of the documentation named before the rooms were made; they go with the next release."""

from __future__ import annotations

import importlib
import importlib.util
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MOVED = {
    "machines.component": "machines.components.component",
    "machines.comparison": "machines.compare.comparison",
    "machines.response_band": "machines.uncertainty.response_band",
    "machines.lobes.forced_vibration": "machines.cutting.forced.forced_vibration",
    "machines.lobes.frozen_modes": "machines.cutting.amplitude.frozen_modes",
    "machines.lobes.shaken_limits": "machines.cutting.forced.shaken_limits",
    "machines.lobes.tool_point": "machines.tool.tool_point",
    "machines.lobes.unstable_depths": "machines.cutting.amplitude.unstable_depths",
}
"""Module by the path that it had."""


class _Called(ModuleType):
    """A module under a name that is also that of a function: the import puts it in the function's place."""

    def __call__(self, *given: Any, **named: Any) -> Any:
        """What the function of the same name gives."""
        return vars(self)[self.__name__.rpartition(".")[2]](*given, **named)


class Moved(MetaPathFinder, Loader):
    """Finds a module by the path that it had, with a `DeprecationWarning`."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A spec for what has moved, None for all else."""
        return importlib.util.spec_from_loader(fullname, self) if fullname in MOVED else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """An empty module under the old name."""
        return _Called(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Fill it with what the module holds now."""
        new = MOVED[module.__name__]
        warnings.warn(f"{module.__name__} is {new} now; public names are in machines and machines.lobes",
                      DeprecationWarning, stacklevel=2)  # fmt: skip
        names = vars(importlib.import_module(new))
        vars(module).update({name: value for name, value in names.items() if not name.startswith("__")})
