"""What ``jointlib lobes`` says of the vibration that the teeth of the cut force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.shown.progress import Progress


def forced(
    model: Any, chart: Any, depth: Sequence[float], pocket: Any, safe: Any, progress: Progress
) -> tuple[dict[str, Any], list[str], Any]:
    """As JSON, told, and for a picture: over the speeds of a chart at rest and depths, and in the recommended pocket.

    Nothing where nothing forces a vibration: without a feed, in turning. ``safe`` are the limits (m) of the pocket.
    """
    from ...cutting.forced.forced_field import forced_field
    from ...cutting.forced.forced_vibration import too_many
    from ...cutting.forced.quiet_pocket import pocket_in_cut
    from ...cutting.process.cutting import Cutting

    cutting = Cutting(**(model.cutting or {}))
    if cutting.feed is not None and cutting.process == "milling" and not cutting.plain:
        return {}, [f"The vibration that the teeth force is not computed with {cutting.unlike}."], None
    if bent := too_many(model):
        return {}, [f"The vibration that the teeth force is not computed: {bent} joints depend on amplitude."], None
    with progress.step("computing the vibration that the teeth force"):
        field = forced_field(model, chart, np.array(sorted(depth)) if depth else None)
        if field is None:
            return {}, [], None
        cut, quiet, said = (None, None, []) if pocket is None else pocket_in_cut(model, chart.speed, safe, pocket)
        said += field.words()
    keys = ("speed", "depth", "amplitude", "limit")
    data = {key: getattr(field, key) for key in keys} | ({} if cut is None else {"pocket": cut.data})
    data |= {} if quiet is None else {"quieter": {"speed": quiet.speed, "depth": quiet.depth, "margin": quiet.margin}}
    return {"forced": data}, said, field
