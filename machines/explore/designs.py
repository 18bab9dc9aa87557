"""The designs of a study on the page: a picture to brush, and a click that sets the sliders."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from dash import ALL, Dash, Input, Output, State, ctx, html, no_update

from jointlib.errors import InputError

from .controls import shown
from .figures import labelled, scatter_figure
from .page import ident
from .scatter import Scatter
from .state import entries, number_sent, point_sent

_MOST = 20
"""Rows that are listed; the others are counted."""


def connect_designs(app: Dash, study: Scatter) -> None:
    """Axes, brush, numbers typed, and the sliders set to a design."""

    @app.callback(
        Output("scatter", "figure"),
        Output("chosen-list", "children"),
        Input("across", "value"),
        Input("up", "value"),
        Input("chosen", "data"),
        Input("wish", "data"),
    )
    def draw(across: Any, up: Any, chosen: Any, wish: Any) -> Any:
        listed = chosen if isinstance(chosen, list) else []
        numbers = [n for n in listed if isinstance(n, int) and 0 <= n < len(study.rows)]
        here = _among(entries(wish, "wish", design=int)["design"], len(study.rows)) if wish else None
        x, y = (_among(number_sent(axis, "axis"), len(study.names)) for axis in (across, up))
        return scatter_figure(study, x, y, numbers, here), _listed(study, numbers)

    @app.callback(
        Output("chosen", "data"),
        Output("status", "children", allow_duplicate=True),
        Input("scatter", "selectedData"),
        Input("pick", "n_clicks"),
        Input("designs", "n_submit"),
        Input("clear", "n_clicks"),
        State("designs", "value"),
        prevent_initial_call=True,
    )
    def choose(brushed: Any, picked: Any, submitted: Any, cleared: Any, text: Any) -> Any:
        if ctx.triggered_id == "clear":
            return [], ""
        if ctx.triggered_id == "scatter":
            # A picture drawn anew tells of an empty box; that is nobody's choice.
            points = entries(brushed, "box", points=list)["points"] if brushed else []
            if not points:
                return no_update, no_update
            given = [point_sent({"points": [point]}, "customdata") for point in points]
            return sorted({int(number) for number in given if number is not None}), ""
        try:
            return numbers_in(str(text or ""), len(study.rows)), ""
        except InputError as error:
            return no_update, str(error)

    @app.callback(
        Output("wish", "data"),
        Input("scatter", "clickData"),
        Input(ident("design", ALL), "n_clicks"),
        State("wish", "data"),
        prevent_initial_call=True,
    )
    def take(click: Any, pressed: Any, wish: Any) -> Any:
        caller = ctx.triggered_id
        place = None
        if caller == "scatter" and click:
            place = point_sent(click, "customdata")
        elif caller != "scatter" and isinstance(pressed, list) and any(pressed):
            place = entries(caller, "button", control=int)["control"]
        if place is None:
            return no_update
        number = _among(place, len(study.rows))
        values = dict(study.values[number])
        words = f"The unlocked sliders are set to design {number}"
        words += f", except {', '.join(study.unset)}, which no slider moves." if study.unset else "."
        again = entries(wish, "wish", again=int)["again"] + 1 if wish else 1
        return {"design": number, "values": values, "words": words, "again": again}


def _among(number: float, count: int) -> int:
    """The number of a design or of an axis, of so many."""
    if not 0 <= number < count:
        raise InputError(f"designs: {number:g}, expected a number from 0 to {count - 1}")
    return int(number)


def numbers_in(text: str, count: int) -> list[int]:
    """Numbers and ranges such as ``3, 8-12``."""
    found: set[int] = set()
    for part in filter(None, (p.strip() for p in text.split(","))):
        match = re.fullmatch(r"(\d{1,9})(?:\s*[-–]\s*(\d{1,9}))?", part)
        if match is None:
            raise InputError(f"designs: {part!r}, expected numbers and ranges such as 3, 8-12")
        low, high = int(match[1]), int(match[2] or match[1])
        if not low <= high < count:
            raise InputError(f"designs: {part!r}, expected numbers from 0 to {count - 1}")
        found |= set(range(low, high + 1))
    return sorted(found)


def _listed(study: Scatter, numbers: Sequence[int]) -> Any:
    if not numbers:
        return "No design is highlighted."
    factors = list(study.words[0])
    quantities = range(len(factors), len(study.names))
    labels = ["design", *factors, *(labelled(study.names[i], study.units[i]) for i in quantities), ""]
    rows = []
    for number in numbers[:_MOST]:
        use = html.Button(
            "use", id=ident("design", number), type="button", n_clicks=0, **{"aria-label": f"use design {number}"}
        )
        cells = [html.Td(word) for word in study.words[number].values()]
        cells += [html.Td(shown(float(study.rows[number][i]))) for i in quantities]
        rows.append(html.Tr([html.Th(str(number), scope="row"), *cells, html.Td(use)]))
    head = html.Thead(html.Tr([html.Th(label, scope="col") for label in labels]))
    more = len(numbers) - _MOST
    table = html.Div(html.Table([head, html.Tbody(rows)]), className="scroll")
    return [html.P(f"{len(numbers)} highlighted" + (f", the first {_MOST} below." if more > 0 else ".")), table]
