"""The buttons that write files, all into one folder of the computer that runs the program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from dash import Dash, Input, Output, State
from dash.exceptions import PreventUpdate

from jointlib.errors import CheckFailed, InputError

from .controls import Control
from .save import free_target
from .scene import Explorer
from .state import State as Sliders
from .state import order_sent

WAIT = "Writing; an FMU is compiled and verified, a report computes exact lobes: up to a minute …"
Export = Callable[[Path, Path], Sequence[str]]
"""Machine file and FMU to write; returns sentences about it."""


def connect_files(app: Dash, explorer: Explorer, controls: Sequence[Control], folder: Path, export: Export) -> Lock:
    """The returned lock is held while a file is written, so that a program that ends can wait for it."""
    writing = Lock()
    buttons = ("save", "export", "report")

    @app.callback(
        Output("status", "children", allow_duplicate=True),
        Input("order-write", "data"),
        State("state", "data"),
        prevent_initial_call=True,
        running=[
            *((Output(button, "disabled"), True, False) for button in buttons),
            (Output("busy", "children"), WAIT, ""),
        ],
    )
    def write(order: Any, data: Any) -> str:
        if not order:
            raise PreventUpdate
        try:
            asked, state = order_sent(order, *buttons), Sliders.read(data, controls)
            with writing:
                return _write(asked["what"], explorer, state, folder, asked.get("name"), export)
        except (InputError, CheckFailed) as error:
            return f"Nothing was written: {error}"
        except OSError as error:
            return f"Nothing was written: {folder}: {error.strerror or error}"

    return writing


def _write(button: str, explorer: Explorer, state: Sliders, folder: Path, name: object, export: Export) -> str:
    if button == "report":
        return f"Wrote {explorer.report(state.values, folder, name)}."
    if button == "save":
        written = explorer.save(state.values, folder, name)
        more = len(written) - 1
        beside = f" and {more} file{'s' if more > 1 else ''} that it names" if more else ""
        return f"Wrote {written[0]}{beside}."
    target = free_target(folder, name, ".fmu")
    with TemporaryDirectory() as beside_it:
        machine = explorer.save(state.values, Path(beside_it), target.stem)[0]
        folder.mkdir(parents=True, exist_ok=True)
        return " ".join([f"Wrote {target}.", *export(machine, target)])
