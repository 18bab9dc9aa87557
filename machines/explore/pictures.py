"""What the page shows of a setting: curves at once, a reading when the sliders rest, exact lobes when asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from dash import Dash, Input, Output, State, ctx, html, no_update
from dash.exceptions import PreventUpdate

from jointlib.errors import CheckFailed, InputError
from jointlib.units import quantity

from . import figures
from .compare import Setting, differences, headline, measured_over, reading_words
from .controls import Control
from .scene import Explorer, Reading
from .sliders import acted
from .state import State as Sliders
from .state import action_sent, entries, number_sent, order_sent, point_sent

FAULTS = (InputError, CheckFailed)
"""What is told in its own sentence; anything else is a fault of the program and told as such."""
_STALE = "The pictures are those of the last setting that could be computed."


def connect_pictures(app: Dash, explorer: Explorer, controls: Sequence[Control]) -> None:
    """Curves of the state and of A."""

    def setting(state: Sliders, exact: bool) -> Setting:
        curves = explorer.curves(state.values, exact=exact)
        return Setting(state.values, curves, explorer.moment(state.values).built.static_compliance)

    @app.callback(
        {
            "lobes": Output("lobes", "figure"),
            "frf": Output("frf", "figure"),
            "gain": Output("gain", "figure"),
            "headline": Output("headline", "children"),
            "notes": Output("notes", "children"),
            "differences": Output("differences", "children"),
            "measured": Output("measured", "children"),
            "reading": Output("reading", "children"),
            "drawn": Output("drawn", "data"),
            "look": Output("explorer", "className"),
            "status": Output("status", "children", allow_duplicate=True),
        },
        {
            "action": Input("action", "data"),
            "kept": Input("kept", "data"),
            "speed": Input("speed", "data"),
            "read": Input("read-off", "data"),
            "exact": Input("exact", "data"),
            "connection": Input("connection", "value"),
            "data": State("state", "data"),
            "answered": State("answer", "data"),
            "drawn": State("drawn", "data"),
            "shown": State("notes", "children"),
            "look": State("explorer", "className"),
        },
        prevent_initial_call="initial_duplicate",
        running=[(Output("working", "className"), "on", "")],
    )
    def draw(
        action: Any,
        kept: Any,
        speed: Any,
        read: Any,
        exact: Any,
        connection: Any,
        data: Any,
        answered: Any,
        drawn: Any,
        shown: Any,
        look: Any,
    ) -> dict[str, Any]:
        names = ("lobes", "frf", "gain", "headline", "notes", "differences", "measured", "reading", "status", "look")
        answer: dict[str, Any] = dict.fromkeys(names, no_update)
        count = entries(drawn, "drawn", count=int)["count"] + 1 if drawn else 1
        action = action_sent(action, controls) if action else None
        answered = entries(answered, "answer", serial=int) if answered else None
        kept = entries(kept, "A") if kept else None
        speed = None if speed is None else number_sent(speed, "speed")
        answer["drawn"] = {"count": count}
        try:
            state = Sliders.read(data, controls)
            after, words = acted(action, state, kept, controls) if action else (state, "")
            if action and (not answered or answered["serial"] < action["serial"]):
                # The page has the sliders as they were before this action until that is answered.
                state = after
            if words and action.get("control") is None and "action.data" in ctx.triggered_prop_ids:
                answer["status"] = words
            values = dict(state.values)
            answer["drawn"] = {"count": count, "values": values}
            before = Sliders.read(kept, controls) if kept else None
            now = setting(state, exact == values)
            old = setting(before, bool(kept.get("exact"))) if before else None
            pair = now.curves, old.curves if old else None
            reading = _reading(read, speed, values)
            answer |= {
                "lobes": figures.lobes_figure(*pair, speed, reading, explorer.tried),
                "frf": figures.response_figure(*pair, explorer.records[0]),
                "gain": figures.gain_figure(*pair, str(connection)),
                "headline": headline(now.curves),
                "differences": differences(controls, old, now),
                "measured": measured_over(explorer.laid_over(now.curves), explorer.records),
                "reading": _told(read, speed, reading, values),
            }
            if not isinstance(shown, list) or list(map(_note, shown)) != list(now.curves.notes):
                answer["notes"] = [html.Li(note) for note in now.curves.notes]
            if look:
                answer["look"] = ""
        except FAULTS as error:
            answer |= {"status": f"{error} {_STALE}", "look": "stale"}
        return answer


def _note(shown: Any) -> Any:
    """The text of a note that the page shows."""
    props = shown.get("props") if isinstance(shown, dict) else None
    return props.get("children") if isinstance(props, dict) else None


def _reading(read: Any, speed: Any, values: Mapping[str, float]) -> Reading | None:
    """What was read off, if it is of this speed and these sliders."""
    if not _is_of(read, speed, values) or "words" in read:
        return None
    number = (int, float)
    found = entries(read.get("found"), "reading", speed=number, kind=str, lobe=int, method=str)
    depth, chatter = (found.get(name) for name in ("depth", "chatter_frequency"))
    return Reading(
        found["speed"],
        np.inf if depth is None else number_sent(depth, "depth"),
        np.nan if chatter is None else number_sent(chatter, "chatter frequency"),
        found["kind"],
        found["lobe"],
        found["method"],
        (),
    )


def _is_of(read: Any, speed: Any, values: Mapping[str, float]) -> bool:
    return bool(isinstance(read, dict) and read and read.get("speed") == speed and read.get("values") == values)


def _told(read: Any, speed: Any, reading: Reading | None, values: Mapping[str, float]) -> str:
    if reading is not None:
        return reading_words(reading)
    if speed is None:
        return "Click on the chart, or type a speed."
    if _is_of(read, speed, values):
        return str(read.get("words", ""))
    return f"reading at {speed:g} rpm …"


def connect_readings(app: Dash, explorer: Explorer, controls: Sequence[Control]) -> None:
    """A click or a typed speed, exact lobes, and A."""

    @app.callback(
        Output("speed", "data"),
        Output("read-at", "value"),
        Output("status", "children", allow_duplicate=True),
        Input("lobes", "clickData"),
        Input("read", "n_clicks"),
        Input("read-at", "n_submit"),
        State("read-at", "value"),
        prevent_initial_call=True,
    )
    def choose(click: Any, pressed: Any, submitted: Any, text: Any) -> Any:
        if ctx.triggered_id == "lobes":
            speed = number_sent(point_sent(click, "x"), "click")
            return speed, f"{speed:.6g}", ""
        try:
            return quantity(str(text or "").replace(",", ".").strip(), "rpm", "read at"), no_update, ""
        except InputError as error:
            return no_update, no_update, str(error)

    @app.callback(
        Output("read-off", "data"),
        Input("speed", "data"),
        Input("settled", "data"),
        State("state", "data"),
        prevent_initial_call=True,
    )
    def read(speed: Any, settled: Any, data: Any) -> Any:
        if speed is None:
            return no_update
        speed, values = number_sent(speed, "speed"), dict(Sliders.read(data, controls).values)
        told = {"speed": speed, "values": values}
        try:
            found = explorer.at(values, speed)
        except FAULTS as error:
            return {**told, "words": str(error)}
        # JSON has neither infinity nor NaN: a depth without bound becomes null, its chatter frequency too.
        plain = {k: None if isinstance(v, float) and not np.isfinite(v) else v for k, v in asdict(found).items()}
        return {**told, "found": plain}

    @app.callback(
        Output("exact", "data"),
        Output("status", "children", allow_duplicate=True),
        Input("order-refine", "data"),
        State("state", "data"),
        prevent_initial_call=True,
        running=[
            (Output("refine", "disabled"), True, False),
            (Output("refining", "children"), "computing exact lobes …", ""),
        ],
    )
    def refine(order: Any, data: Any) -> Any:
        if not order:
            raise PreventUpdate
        try:
            values = dict(Sliders.read(data, controls).values)
            explorer.curves(values, exact=True)
        except FAULTS as error:
            return no_update, str(error)
        return values, ""

    @app.callback(
        Output("kept", "data"),
        Output("back", "disabled"),
        Output("forget", "disabled"),
        Input("order-keep", "data"),
        State("state", "data"),
        State("exact", "data"),
        prevent_initial_call=True,
    )
    def keep(order: Any, data: Any, exact: Any) -> Any:
        if not order:
            raise PreventUpdate
        if order_sent(order, "keep", "forget")["what"] == "forget":
            return None, True, True
        state = Sliders.read(data, controls)
        return {**state.data(controls), "exact": exact == dict(state.values)}, False, False
