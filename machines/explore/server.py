"""The page on the network: this computer alone unless asked, no name but its own, nothing fetched from elsewhere."""

from __future__ import annotations

import ipaddress
import logging
import socket
from html import escape
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from dash import Dash, set_props

from jointlib.errors import InputError, told

from .designs import connect_designs
from .page import grouped, layout
from .pictures import connect_pictures, connect_readings
from .scene import Explorer
from .sliders import connect_sliders
from .view import ADDRESSES, connect_view
from .writing import Export, connect_files

if TYPE_CHECKING:
    from werkzeug.serving import BaseWSGIServer

LOOPBACK = "127.0.0.1"
PORT = 8050
PATIENCE = 30.0
"""s for which a client may be silent in the middle of a request or an answer."""
_MOST_BYTES = 4_000_000
_OWN = ("same-origin", "none")
"""What a browser says of a request that the page made itself, or the user; other programs say nothing."""
_log = logging.getLogger(__name__)


def explorer_app(explorer: Explorer, name: str, folder: Path, export: Export, alone: bool = True) -> tuple[Dash, Lock]:
    """The page of one machine, ``name`` that of its file; ``alone``: for this computer only.

    The lock is held while files are written.
    """
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    app = Dash(
        "jointlib",
        assets_folder=str(Path(__file__).parent / "assets"),
        serve_locally=True,
        external_stylesheets=list(ADDRESSES[:1]),
        external_scripts=list(ADDRESSES[1:]),
        compress=False,
        title=escape(f"{explorer.base.name} – jointlib"),
        update_title="",
        add_log_handler=False,
        on_error=_told,
        enable_mcp=False,
    )
    app.enable_dev_tools(
        debug=False, dev_tools_ui=False, dev_tools_disable_version_check=True, dev_tools_silence_routes_logging=True
    )
    controls = grouped(explorer.controls)
    study = explorer.scatter()
    first = explorer.curves({})
    seen = first, study, any(explorer.records), explorer.leading(first)
    app.layout = layout(explorer.base.name, name, str(folder), controls, *seen)
    connect_sliders(app, controls)
    connect_pictures(app, explorer, controls)
    connect_readings(app, explorer, controls)
    connect_view(app, explorer, controls)
    writing = connect_files(app, explorer, controls, folder, export)
    if study is not None:
        connect_designs(app, study)
    _guarded(app, alone)
    return app, writing


def _told(error: Exception) -> None:
    """The page keeps what it shows and says why: it was sent rubbish, or, with the rest in the terminal, a fault."""
    if isinstance(error, InputError):
        _log.warning("refused: %s", told(str(error)))
        set_props("status", {"children": f"Refused: {error}"})
        return
    _log.error("a callback failed", exc_info=error)
    said = f"The program met a fault of its own ({type(error).__name__}); nothing was changed."
    set_props("status", {"children": said})


def _guarded(app: Dash, alone: bool) -> None:
    """Refuse strangers: other names for this computer (DNS rebinding) and pages of other sites."""
    from flask import Response, request
    from werkzeug.exceptions import HTTPException

    server = app.server
    server.config["MAX_CONTENT_LENGTH"] = _MOST_BYTES
    scripts = " ".join(["'self'", *app.csp_hashes()])
    policy = (
        f"default-src 'self'; script-src {scripts}; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )

    def refused(why: str) -> Response:
        return Response(f"{why}\n", 403, mimetype="text/plain")

    @server.before_request
    def known() -> Response | None:
        host = urlsplit(f"//{request.host}").hostname or ""
        if alone and not is_this_computer(host):
            return refused(f"{host}: not the name of this page, open it at http://{LOOPBACK}")
        if request.headers.get("Sec-Fetch-Site", "none") not in _OWN:
            return refused("another page may not use this one")
        origin = request.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != request.host:
            return refused(f"{origin}: another page may not use this one")
        return None

    @server.after_request
    def closed(response: Response) -> Response:
        response.headers["Content-Security-Policy"] = policy
        response.headers["X-Content-Type-Options"] = "nosniff"
        response.headers["Referrer-Policy"] = "no-referrer"
        return response

    @server.errorhandler(Exception)
    def in_words(error: Exception) -> Any:
        if isinstance(error, HTTPException):
            return error
        _log.error("a request failed: %s", told(repr(error)))
        return Response("this request cannot be answered\n", 400, mimetype="text/plain")


def is_this_computer(host: str) -> bool:
    """Whether a name or address is that of the loopback."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def bound(host: str = LOOPBACK, port: int | None = None) -> socket.socket:
    """A place that listens; without ``port`` 8050, or any that is free."""
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
    except OSError:
        raise InputError(f"--host: {host!r} is no address of this computer, expected {LOOPBACK} for instance") from None
    reason = ""
    for wanted in (port,) if port is not None else (PORT, 0):
        place = socket.socket(family, kind)
        place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            place.bind((address[0], wanted))
            place.listen(128)
            return place
        except OSError as error:
            place.close()
            reason = error.strerror or str(error)
    raise InputError(f"--port {port} on {host}: {reason}, expected a free port (leave --port out for any)")


def listening(app: Dash, place: socket.socket) -> BaseWSGIServer:
    """The server of an app, which answers once its ``serve_forever`` runs; ``place`` is used up."""
    from werkzeug.serving import WSGIRequestHandler, make_server

    # Who neither sends nor takes anything for so long is let go, else each would hold a thread for good.
    impatient = type("Impatient", (WSGIRequestHandler,), {"timeout": PATIENCE})
    with place:
        host, port = place.getsockname()[:2]
        return make_server(host, port, app.server, threaded=True, request_handler=impatient, fd=place.fileno())
