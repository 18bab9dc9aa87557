"""What becomes of the sliders when something on the page is moved, typed or pressed."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from dash import ALL, ClientsideFunction, Dash, Input, Output, State, no_update
from dash.exceptions import PreventUpdate

from jointlib.errors import InputError

from .controls import Control
from .page import ident
from .state import State as Sliders
from .state import action_sent, entries, value_at

_BUTTONS = ("reset-all", "back", "keep", "forget", "refine", "save", "export", "report")


def connect_sliders(app: Dash, controls: Sequence[Control]) -> None:
    """Whatever is done on the page goes into one line (``assets/explorer.js``) and comes here one by one.

    What the sliders look like then is answered here, what follows from them at the same time in ``pictures``.
    """
    slider, field, lock, reset = (ident(part, ALL) for part in ("slider", "field", "lock", "reset"))
    app.clientside_callback(
        ClientsideFunction("explorer", "acted"),
        Input(slider, "value"),
        Input(field, "value"),
        Input(lock, "n_clicks"),
        Input(reset, "n_clicks"),
        *(Input(button, "n_clicks") for button in _BUTTONS),
        Input("wish", "data"),
        State("state", "data"),
        State(ident("said", ALL), "children"),
        prevent_initial_call=True,
    )
    app.clientside_callback(
        ClientsideFunction("explorer", "answered"), Input("answer", "data"), prevent_initial_call=True
    )
    app.clientside_callback(
        ClientsideFunction("explorer", "drawn"),
        Input("drawn", "data"),
        prevent_initial_call=True,
    )

    @app.callback(
        {
            "state": Output("state", "data"),
            "places": Output(slider, "value"),
            "fixed": Output(slider, "disabled"),
            "texts": Output(field, "value"),
            "closed": Output(field, "disabled"),
            "pressed": Output(lock, "aria-pressed"),
            "stuck": Output(reset, "disabled"),
            "rows": Output(ident("row", ALL), "className"),
            "said": Output(ident("said", ALL), "children"),
            "answer": Output("answer", "data"),
        },
        {
            "action": Input("action", "data"),
            "data": State("state", "data"),
            "kept": State("kept", "data"),
            "said": State(ident("said", ALL), "children"),
        },
        prevent_initial_call=True,
    )
    def change(action: Any, data: Any, kept: Any, said: list[Any]) -> dict[str, Any]:
        if not action:
            raise PreventUpdate
        action, old = action_sent(action, controls), Sliders.read(data, controls)
        number, count = action.get("control"), len(controls)
        said = entries({"said": said}, "what was said", said=list)["said"][:count]
        said = [*said, *[""] * (count - len(said))]
        new, words = acted(action, old, kept, controls)
        refused = [s or "" for s in said] if number is not None else [""] * len(controls)
        if number is not None:
            refused[number] = words
        touched = {i for i, words in enumerate(said) if words} | {number}
        answer = _changed(_look(controls, old, said), _look(controls, new, refused), touched)
        if action["kind"] == "move":
            # The slider is in somebody's hand and stays where that hand has it.
            answer["places"] = [no_update] * len(controls)
        answered = {"serial": action["serial"], "changed": new != old}
        state = new.data(controls) if new != old else no_update
        return {**answer, "state": state, "answer": answered}


def acted(action: Mapping[str, Any], old: Sliders, kept: Any, controls: Sequence[Control]) -> tuple[Sliders, str]:
    """The sliders after an action, and what is to be said: of one control why it was refused, else what was done."""
    number = action.get("control")
    try:
        if number is None:
            return _all_moved(action, old, kept, controls)
        return _one_moved(action, old, controls[number]), ""
    except InputError as error:
        return old, str(error)


def _changed(
    old: Mapping[str, list[Any]], new: Mapping[str, list[Any]], touched: Collection[int | None]
) -> dict[str, Any]:
    """What the page must be told: what differs, and all of a control that was touched or had refused a text."""
    return {
        name: [
            now if i in touched or now != was else no_update
            for i, (was, now) in enumerate(zip(old[name], new[name], strict=True))
        ]
        for name in new
    }


def _one_moved(action: Mapping[str, Any], old: Sliders, control: Control) -> Sliders:
    kind = action["kind"]
    if kind == "move":
        return old.moved(control, value_at(control, action["position"]))
    if kind == "field":
        # A few digits are shown of a value; they do not stand for another one.
        text = str(action["text"]).strip()
        text = text if control.choices else text.replace(",", ".")
        return old if text == control.told(old.values[control.key]) else old.moved(control, text)
    if kind == "lock":
        return old.toggled(control.key)
    return old.taken({control.key: control.value})


def _all_moved(action: Mapping[str, Any], old: Sliders, kept: Any, controls: Sequence[Control]) -> tuple[Sliders, str]:
    kind = action["kind"]
    if kind == "wish":
        known = {c.key: c for c in controls}
        wish = {key: known[key].checked(value) for key, value in action["values"].items() if key in known}
        return old.taken(wish), str(action["words"])
    if kind == "back" and kept:
        return old.taken(Sliders.read(kept, controls).values), "All unlocked sliders are back at A."
    if kind == "reset-all":
        return old.taken({c.key: c.value for c in controls}), "All unlocked sliders are as in the file."
    return old, ""


def _look(controls: Sequence[Control], state: Sliders, refused: Sequence[str]) -> dict[str, list[Any]]:
    """How every part of every control looks in a state; a refused text stays to be mended."""
    locked = [c.key in state.locked for c in controls]
    data = state.data(controls)
    return {
        "said": list(refused),
        "places": [str(place) for place in data["order"]],
        "fixed": locked,
        "texts": [no_update if no else text for text, no in zip(data["texts"], refused, strict=True)],
        "closed": locked,
        "pressed": [str(on).lower() for on in locked],
        "stuck": locked,
        "rows": ["control" + " locked" * on + " refused" * bool(no) for on, no in zip(locked, refused, strict=True)],
    }
