"""The measurement file of a planned test, with its reasons as comments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import tomli_w

from jointlib.io.toml_file import parsed
from jointlib.planning.campaign import Campaign
from jointlib.planning.setup import RIG_CHANNELS, Setup

QUIET = "quiet"


def record_names(campaign: Campaign) -> tuple[str, ...]:
    """Names of the driven records, the sealed one last."""
    return (*(f"fit_{i}" for i in range(1, len(campaign.levels) + 1)), "sealed")


def simulated_text(setup: Setup, campaign: Campaign) -> str:
    """The declaration of simulated records, in SI and without a run-in."""
    table = {**_head(setup, campaign, 0), "simulated": True, **_bodies(setup), "channel": _channels(setup)}
    return tomli_w.dumps({**table, "record": _records(campaign, ".npz")})


def text_to_fill(setup: Setup, campaign: Campaign, drive: float, said: Sequence[str], joint: str) -> str:
    """What the reader completes: their channels where they gave them, SI columns where not."""
    declared: dict[str, Any] = {}
    if setup.declared is not None:
        declared = parsed(setup.declared.source)[1]
    bodies: dict[str, Any] = {k: declared[k] for k in ("driven", "bodies") if k in declared} or _bodies(setup)
    channels = declared.get("channel") or _channels(setup)
    corrections = [c for c in declared.get("correction", []) if "record" not in c]
    about = "as in the measurement file that was given" if declared else "assumed: put in what you weighed"
    wire = "as in the measurement file that was given" if declared else "columns of your files, with their units"
    rms = {name: level * drive for name, level in zip(record_names(campaign), campaign.drives, strict=True)}
    parts = [
        "# To fill: record what play_*.wav makes of the rig, one file a record, and name the files below.",
        *(f"# {line}" for line in said),
        f"# Then: jointlib inspect measurement.toml, and jointlib trace measurement.toml --joint {joint} -o traced",
        tomli_w.dumps(_head(setup, campaign, campaign.settle)).rstrip(),
        *([tomli_w.dumps({"text": declared["text"]}).rstrip()] if "text" in declared else []),
        "",
        f"# Bodies in kg, {about}; {{ mass = …, u = … }} where the balance has a standard uncertainty.",
        tomli_w.dumps(bodies).rstrip(),
        "",
        f"# Channels: {wire}. With `range` (full scale) clipping can be told.",
        *(_entry("channel", c) for c in channels),
        *(_entry("correction", c) for c in corrections),
    ]
    reason = {
        "fit": "play {file}.wav: {rms:.3g} N rms",
        "sealed": "play {file}.wav: {rms:.3g} N rms; opened once, for the error before and after",
        "quiet": "exciter off, everything else as in the test",
    }
    for record in _records(campaign, ".csv"):
        name = record["file"].removesuffix(".csv")
        words = reason[record["role"]].format(file=f"play_{name}", rms=rms.get(name, 0.0))
        parts += ["", f"# {words}", _entry("record", record).rstrip()]
    return "\n".join(parts) + "\n"


def _entry(name: str, table: Mapping[str, Any]) -> str:
    """One table of a list, as people write it."""
    return f"[[{name}]]\n{tomli_w.dumps(table)}"


def _head(setup: Setup, campaign: Campaign, settle: int) -> dict[str, Any]:
    return {
        "schema": "jointlib/measurement/1",
        "kind": "rig",
        "sample_rate": f"{campaign.sample_rate:.10g} Hz",
        "period": campaign.period,
        "settle": settle,
    }


def _bodies(setup: Setup) -> dict[str, Any]:
    two, three = setup.carried
    bodies = {"driven": setup.m1, "behind": two, **({"behind_too": three} if three else {})}
    return {"driven": "driven", "bodies": bodies}


def _channels(setup: Setup) -> list[dict[str, Any]]:
    sits = {"a1": "driven", "a2": "behind", "a3": "behind_too" if setup.carried[1] else "behind"}
    out = []
    for name in setup.channels:
        quantity = "force" if name == "P" else "acceleration"
        out.append({"name": name, "quantity": quantity, "unit": RIG_CHANNELS[name]})
        if name in sits:
            out[-1]["body"] = sits[name]
    return out


def _records(campaign: Campaign, ending: str) -> list[dict[str, Any]]:
    rows = []
    for name, level in zip(record_names(campaign), campaign.drives, strict=True):
        role = "sealed" if name == "sealed" else "fit"
        rows.append({"file": f"{name}{ending}", "role": role, "condition": f"level {level:g}"})
    return [*rows, {"file": f"{QUIET}{ending}", "role": "quiet", "condition": "off"}]
