"""What ``jointlib lobes`` says of the vibration that the teeth of the cut force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.shown.progress import Progress
from jointlib.shown.text import table

_SIGNS = "Above 0 too much is cut away, below material is left standing (surface location error)."


def forced(
    model: Any, chart: Any, depth: Sequence[float], pocket: Any, safe: tuple[Any, Any], progress: Progress
) -> tuple[dict[str, Any], list[str], Any]:
    """As JSON, told, and for a picture: over the speeds of a chart at rest and depths, and in the recommended pocket.

    Nothing where nothing forces a vibration: without a feed, in turning. ``safe`` are the limits (m) at the
    speeds, and between them. Where very many joints depend on amplitude they are held as at rest.
    """
    from ...cutting.forced.forced_field import forced_field
    from ...cutting.forced.forced_vibration import too_many, unforced
    from ...cutting.forced.held_at_rest import held_if_many
    from ...cutting.forced.quiet_pocket import pocket_in_cut
    from ...cutting.process.cutting import Cutting

    cutting = Cutting(**(model.cutting or {}))
    if cutting.feed is not None and cutting.process == "milling" and (left := unforced(model)):
        return {}, [f"The vibration that the teeth force is {left}."], None
    bent = too_many(model)
    with progress.step("computing the vibration that the teeth force"):
        model, as_at_rest = held_if_many(model, float(np.median(chart.speed)))
        field = forced_field(model, chart, np.array(sorted(depth)) if depth else None)
        if field is None:
            return {}, [], None
        cut, quiet, said = (None, None, []) if pocket is None else pocket_in_cut(model, chart.speed, *safe, pocket)
        said += field.words() + _walls(field, depth)
        said = [*as_at_rest, *said] if said else []
    keys = ("speed", "depth", "amplitude", "limit", "surface_error")
    data = {key: getattr(field, key) for key in keys} | ({"held_at_rest": bent} if as_at_rest else {})
    data |= {} if cut is None else {"pocket": cut.data}
    data |= {} if quiet is None else {"quieter": {"speed": quiet.speed, "depth": quiet.depth, "margin": quiet.margin}}
    return {"forced": data}, said, field


def _walls(field: Any, depth: Sequence[float]) -> list[str]:
    """Where the finished wall stands: a table over the cuts that were asked for."""
    error = field.surface_error
    if not depth or not np.any(np.isfinite(error)):
        return []
    header = ("speed [rpm]", *(f"wall at {b * 1e3:g} mm [um]" for b in sorted(depth)))
    told = np.where(
        np.array(sorted(depth)) > field.rest[:, None], "chatters", np.vectorize("{:+.3g}".format)(1e6 * error)
    )
    rows = [(f"{n:g}", *map(str, row)) for n, row in zip(field.speed, told, strict=True)]
    return [*table(header, rows), _SIGNS]
