"""What an identification found, for programs."""

from __future__ import annotations

from typing import Any

from jointlib.identification.result import Identification


def identified(found: Identification) -> dict[str, Any]:
    """The promised keys, and the preload sweep where there is one."""
    data: dict[str, Any] = {
        "parameters": found.parameters,
        "rms": found.rms,
        "rms_unit": found.rms_unit,
        "errors": found.errors,
        "messages": found.messages,
    }
    if found.static is not None:
        s = found.static
        data["sweep"] = {"preload": s.preloads, "kappa": s.kappas, "rms": s.rms_by_preload}
    if found.orders:
        data["orders"] = found.orders
    return data
