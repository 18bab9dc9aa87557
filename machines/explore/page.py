"""The page as it is first sent: sliders in groups, pictures, readings, what to write; all texts, no behaviour."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from dash import dcc, html

from .controls import Control
from .curves import Curves
from .figures import BRUSHED, CONFIG, labelled
from .state import STEPS, State, position

if TYPE_CHECKING:
    from .scatter import Scatter

ORDERS = ("order-write", "order-keep", "order-refine")
"""What is to be done once the sliders are where the page has them."""

_OPEN = 6
"""Groups of sliders that are open at first."""


def ident(part: str, control: Any) -> dict[str, Any]:
    """Identity of the part of one control; ``ALL`` for every control."""
    return {"control": control, "part": part}


def _dom(identity: dict[str, Any]) -> str:
    """The same as the browser knows it."""
    return json.dumps(identity, sort_keys=True, separators=(",", ":"))


def grouped(controls: Sequence[Control]) -> tuple[Control, ...]:
    """Controls of one group side by side, groups in the order in which they appear."""
    groups = list(dict.fromkeys(c.group for c in controls))
    return tuple(sorted(controls, key=lambda c: groups.index(c.group)))


def layout(
    title: str,
    name: str,
    folder: str,
    controls: Sequence[Control],
    first: Curves,
    study: Scatter | None,
    measured: bool = False,
    leading: str | None = None,
) -> Any:
    """The whole page for controls in the order of :func:`grouped`.

    ``title`` is what the machine is called, ``name`` the file that is offered to be written; ``measured`` says whether
    records are laid over it, ``leading`` whose describing function is shown first.
    """
    start = State.start(controls)
    empty = ("kept", "action", "answer", "speed", "read-off", "exact", "settled", "drawn", "view", "wish", *ORDERS)
    stores = {"state": start.data(controls), **dict.fromkeys(empty)}
    return html.Div(
        [
            *(dcc.Store(id=key, data=data) for key, data in stores.items()),
            html.Header(
                [
                    html.H1(title),
                    html.P("", id="headline"),
                    html.P("", id="status", role="status"),
                    html.Span("computing …", id="working"),
                ]
            ),
            html.Div(
                [_sliders(controls, start), _pictures(name, folder, first, study, measured, leading)],
                className="columns",
            ),
        ],
        id="explorer",
    )


def _sliders(controls: Sequence[Control], start: State) -> Any:
    groups: dict[str, list[Any]] = {}
    for number, control in enumerate(controls):
        groups.setdefault(control.group, []).append(_control(number, control, start.values[control.key]))
    buttons = [
        _button("reset-all", "Reset all", "Every unlocked slider back to the machine file"),
        _button("keep", "Keep as A", "Keep the present curves, thin, to compare with"),
        _button("back", "Back to A", "Every unlocked slider back to A", disabled=True),
        _button("forget", "Forget A", "Take A away", disabled=True),
    ]
    # A machine of many joints would else be a page of its own.
    fields = [
        html.Details([html.Summary(group), *rows], open=number < _OPEN)
        for number, (group, rows) in enumerate(groups.items())
    ]
    return html.Aside([html.Div(buttons, className="buttons"), *fields], **{"aria-label": "Sliders"})


def _control(number: int, control: Control, value: float) -> Any:
    slider, field = ident("slider", number), ident("field", number)
    unit, place = html.Span(control.unit, className="unit"), str(position(control, value))
    return html.Div(
        [
            html.Div([html.Label(control.label, htmlFor=_dom(slider)), unit], className="label"),
            html.Label(f"{control.label}, number", htmlFor=_dom(field), className="unseen"),
            dcc.Input(
                id=field,
                type="text",
                inputMode="text" if control.choices else "decimal",
                debounce=True,
                value=control.told(value),
                className="field",
            ),
            _button(ident("lock", number), "lock", f"lock {control.label}", className="small", pressed=False),
            _button(ident("reset", number), "reset", f"reset {control.label}", className="small"),
            # The style sheet writes the ends: every part of Dash costs time at every slider that moves.
            html.Div(
                dcc.Input(id=slider, type="range", min=0, max=STEPS, step=1, value=place, className="slider"),
                className="travel",
                **{"data-low": control.told(control.low), "data-high": control.told(control.high)},
            ),
            html.Div("", id=ident("said", number), className="said", role="alert"),
        ],
        id=ident("row", number),
        className="control",
    )


def _pictures(name: str, folder: str, first: Curves, study: Scatter | None, measured: bool, leading: str | None) -> Any:
    reading = html.Div(
        [
            html.Label("read at", htmlFor="read-at"),
            dcc.Input(id="read-at", type="text", inputMode="decimal", debounce=True, className="field"),
            html.Span("rpm", className="unit"),
            _button("read", "Read", "Read depth and chatter frequency at this speed"),
            _button("refine", "Exact lobes", "The whole chart by the method of jointlib lobes: takes seconds"),
            html.Span("", id="refining", role="status"),
            html.Output("", id="reading", **{"aria-live": "polite"}),
        ],
        className="reading",
    )
    connection = html.Div(
        [
            html.Label("of", htmlFor="connection"),
            dcc.Dropdown(list(first.gains), leading, id="connection", clearable=False, searchable=False),
        ],
        className="pick",
    )
    sections = [
        _section(
            "Stability lobes: stable below the curve", _graph("lobes", "tall"), reading, seen=len(first.speed) > 0
        ),
        html.Div(
            [
                _section("Receptance at the tool point", _graph("frf")),
                html.Section(
                    [html.Div([html.H2("Describing function"), connection], className="head"), _graph("gain")],
                    hidden=not first.gains,
                ),
            ],
            className="pair",
        ),
        _section("Measured over predicted", html.Div(id="measured"), seen=measured),
        _section("The machine and its modes at rest", html.Div(id="machine-view"), html.P("", id="view-said")),
        _section("What this stands on", html.Ul(id="notes")),
        _section("A against now", html.Div("Nothing is kept as A yet.", id="differences")),
        _section(
            "Write files",
            html.P(["Into the folder ", html.Code(folder), " of the computer that runs jointlib."]),
            html.Div(
                [
                    html.Label("name", htmlFor="name"),
                    dcc.Input(id="name", type="text", value=name, className="name"),
                    _button("save", "Save machine file", "A ready machine file with these values"),
                    _button("export", "Export FMU", "The machine as a verified FMU"),
                    _button("report", "Write report", "One HTML file with these pictures"),
                ],
                className="reading",
            ),
            html.P("", id="busy", role="status"),
        ),
    ]
    if study is not None:
        sections.append(_study(study))
    return html.Main(sections)


def _study(study: Scatter) -> Any:
    names = [labelled(name, unit) for name, unit in zip(study.names, study.units, strict=True)]
    options = [{"label": label, "value": i} for i, label in enumerate(names)]
    last = len(names) - 1
    picks = [
        html.Label("across", htmlFor="across"),
        dcc.Dropdown(options, max(last - 1, 0), id="across", clearable=False, searchable=False),
        html.Label("up", htmlFor="up"),
        dcc.Dropdown(options, last, id="up", clearable=False, searchable=False),
    ]
    by_number = [
        html.Label("designs", htmlFor="designs"),
        dcc.Input(id="designs", type="text", debounce=True, placeholder="3, 8-12", className="name"),
        _button("pick", "Highlight", "Highlight the designs of these numbers"),
        _button("clear", "Clear", "Highlight no design"),
    ]
    return _section(
        "Designs of the study",
        html.P("Draw a box to highlight designs, click one to set the unlocked sliders to it."),
        html.Div(picks, className="pick"),
        _graph("scatter"),
        html.Div(by_number, className="reading"),
        dcc.Store(id="chosen", data=[]),
        html.Div("No design is highlighted.", id="chosen-list", **{"aria-live": "polite"}),
    )


def _section(title: str, *content: Any, seen: bool = True) -> Any:
    # What a machine has nothing for stays on the page, unseen, so that the page is one for all machines.
    return html.Section([html.H2(title), *content], hidden=not seen)


def _graph(identity: str, size: str = "") -> Any:
    graph = dcc.Graph(id=identity, config=BRUSHED if identity == "scatter" else CONFIG, responsive=True)
    return html.Div(graph, className=f"graph {size}".strip())


def _button(identity: Any, text: str, says: str, pressed: bool | None = None, **more: Any) -> Any:
    # The name that is read out begins with the words that are seen.
    aria = {"aria-label": says} if more.get("className") == "small" else {}
    if pressed is not None:
        aria["aria-pressed"] = str(pressed).lower()
    return html.Button(text, id=identity, type="button", title=says, n_clicks=0, **aria, **more)
