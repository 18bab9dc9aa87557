"""Errors of the rig equations before and after, on the sealed record, else on records left out in turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.arrays import ComplexArray
from jointlib.joint import Joint
from jointlib.loop.balance import excess
from jointlib.loop.balance.bench import Raw
from jointlib.loop.balance.equations import Observed
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.contest.model import prediction_error


def errors(fitted: Fitted, sealed: Sequence[Raw], given: Joint | None = None) -> dict[str, Any]:
    """Sizes of the residuals where they decide, with the in-sample and held-out ones beside.

    ``given`` is a joint as it came in, whose error is told as ``as_given``.
    """
    inside = excess.sizes(fitted.records, fitted.whitened())
    heldout: dict[str, float] = {}
    left_out: list[ComplexArray] = []
    if len(fitted.raws) > 1:
        left_out = fitted.layout.spectra(prediction_error(fitted.model))
        heldout = excess.sizes(fitted.records, left_out)
    records: Sequence[Observed]
    if sealed:
        opened = fitted.on(sealed)
        where, records, whitened = "sealed", opened.records, opened.whitened()
    elif left_out:
        where, records, whitened = "condition folds", fitted.records, left_out
    else:
        where, records, whitened = "in sample", fitted.records, fitted.whitened()
    out = {
        **excess.sizes(records, whitened),
        "where": where,
        "in_sample": inside["relative"],
        "heldout": heldout.get("relative"),
        "heldout_condition": heldout.get("relative"),
        "per_class": excess.per_class(excess.localisation(records, whitened)),
        "per_record": [{"record": o.spectra.name, **_brief(o, r)} for o, r in zip(records, whitened, strict=True)],
    }
    if given is not None:
        plain = Fitted(tuple(sealed) or fitted.raws, given)
        out["as_given"] = excess.sizes(plain.records, plain.whitened())["relative"]
    return out


def _brief(o: Observed, whitened: ComplexArray) -> dict[str, float]:
    sizes: Mapping[str, float] = excess.sizes([o], [whitened])
    return {k: sizes[k] for k in ("relative", "joint_N", "chi2")}
