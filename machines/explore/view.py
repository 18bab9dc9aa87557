"""The machine of a setting in three dimensions, and its modes in motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dash import ClientsideFunction, Dash, Input, Output, State
from dash.exceptions import PreventUpdate
from flask import Response

from jointlib.errors import CheckFailed, InputError

from ..view.page import STYLE, VIEWER
from .controls import Control
from .scene import Explorer
from .state import State as Sliders

ADDRESSES = ("/viewer.css", "/viewer.js")


def connect_view(app: Dash, explorer: Explorer, controls: Sequence[Control]) -> None:
    """Draw the machine once the sliders rest; the script and its style come from the package of the picture."""

    @app.callback(
        Output("view", "data"),
        Input("settled", "data"),
        State("state", "data"),
        prevent_initial_call=True,
    )
    def settled(rested: Any, state: Any) -> Any:
        if rested is None:
            raise PreventUpdate
        try:
            return explorer.moment(Sliders.read(state, controls).values).built.view
        except (InputError, CheckFailed):
            raise PreventUpdate from None  # the status line says why; the picture stays

    app.clientside_callback(
        ClientsideFunction("explorer", "view"), Output("view-said", "children"), Input("view", "data")
    )
    style, script = ADDRESSES
    app.server.add_url_rule(style, style, lambda: Response(STYLE.read_text("utf-8"), mimetype="text/css"))
    app.server.add_url_rule(script, script, lambda: Response(VIEWER.read_text("utf-8"), mimetype="text/javascript"))
