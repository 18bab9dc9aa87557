"""A Chromium driven by its DevTools protocol: tabs of their own, real clicks and keys, a log of the network."""

from __future__ import annotations

import base64
import json
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)
_KEYS = {
    "Tab": (9, ""),
    "Enter": (13, "\r"),
    "Space": (32, " "),
    "ArrowLeft": (37, ""),
    "ArrowRight": (39, ""),
    "Home": (36, ""),
    "End": (35, ""),
}


def look(browser: str, folder: Path, report: Path, *words: str) -> str:
    """What a Chromium started with these words for one page prints; its profile lies in the folder."""
    command = [browser, *FLAGS, f"--user-data-dir={folder / 'profile'}", *words, report.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout


class Tab:
    """One page in a context of its own: its cookies and its storage are nobody else's."""

    def __init__(self, browser: Browser, session: str, target: str) -> None:
        self._browser, self._session, self.target = browser, session, target
        for domain in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        # Whatever other page was opened last: without the focus of its window nothing in a page is seen to have it.
        self.call("Emulation.setFocusEmulationEnabled", enabled=True)

    def call(self, method: str, **parameters: Any) -> Any:
        return self._browser.call(method, self._session, **parameters)

    def events(self, method: str) -> list[dict[str, Any]]:
        """All that was told under this name so far."""
        return [e["params"] for e in self._browser.heard if e["method"] == method and e["session"] == self._session]

    @property
    def requested(self) -> list[str]:
        """Every address that the page has asked for, sockets included."""
        asked = [e["request"]["url"] for e in self.events("Network.requestWillBeSent")]
        return asked + [e["url"] for e in self.events("Network.webSocketCreated")]

    @property
    def complaints(self) -> list[str]:
        """Errors in the console of the page."""
        thrown = [e["exceptionDetails"]["text"] for e in self.events("Runtime.exceptionThrown")]
        logged = [e["entry"] for e in self.events("Log.entryAdded")]
        return thrown + [entry["text"] for entry in logged if entry["level"] == "error"]

    def evaluate(self, expression: str) -> Any:
        done = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in done, f"{expression}: {done['exceptionDetails']}"
        return done["result"].get("value")

    def until(self, expression: str, seconds: float = 60.0) -> Any:
        """The value of an expression once it is true."""
        return self._browser.until(lambda: self.evaluate(expression), seconds, expression)

    def wait(self, found: Callable[[], Any], what: str) -> None:
        """Until a condition holds."""
        self._browser.until(found, 60.0, what)

    def text(self, selector: str) -> str:
        return str(self.evaluate(f"document.querySelector({json.dumps(selector)}).textContent"))

    def box(self, selector: str) -> tuple[float, float, float, float]:
        """Left, top, width and height of an element, which is brought into view."""
        x, y, width, height = self.evaluate(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'nearest'}); const r = e.getBoundingClientRect();"
            "return [r.x, r.y, r.width, r.height]; })()"
        )
        return x, y, width, height

    def click_on(self, selector: str) -> None:
        x, y, width, height = self.box(selector)
        self.click(x + width / 2, y + height / 2)

    def focus(self, selector: str) -> None:
        self.evaluate(f"document.querySelector({json.dumps(selector)}).focus()")

    def type_into(self, selector: str, text: str) -> None:
        """Replace the text of a field and press Enter."""
        self.focus(selector)
        self.evaluate("document.activeElement.select()")
        self.write(text)
        self.press("Enter")

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)

    def size(self, width: int, height: int) -> None:
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def picture(self, path: Path, whole: bool = False) -> None:
        done = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(done["data"]))

    def press(self, key: str, times: int = 1) -> None:
        """A key, as a keyboard sends it."""
        code, text = _KEYS[key]
        name = " " if key == "Space" else key
        for _ in range(times):
            down = {"key": name, "code": key, "windowsVirtualKeyCode": code, **({"text": text} if text else {})}
            self.call("Input.dispatchKeyEvent", type="keyDown" if text else "rawKeyDown", **down)
            self.call("Input.dispatchKeyEvent", type="keyUp", key=name, code=key, windowsVirtualKeyCode=code)

    def write(self, text: str) -> None:
        self.call("Input.insertText", text=text)

    def click(self, x: float, y: float) -> None:
        self.drag((x, y))

    def drag(self, *points: tuple[float, float]) -> None:
        """Press at the first point, move to the others, let go at the last."""
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=points[0][0], y=points[0][1])
        button = {"button": "left", "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=points[0][0], y=points[0][1], **button)
        for x, y in points[1:]:
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="left", buttons=1)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=points[-1][0], y=points[-1][1], **button)


class Browser:
    """A running Chromium and what it has told."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._sent = socket, 0
        self.heard: list[dict[str, Any]] = []

    def call(self, method: str, session: str | None = None, **parameters: Any) -> Any:
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters}
        self._socket.send(json.dumps(message | ({"sessionId": session} if session else {})))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == self._sent:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            if "method" in answer:
                self.heard.append(
                    {"method": answer["method"], "params": answer["params"], "session": answer.get("sessionId")}
                )

    def until(self, found: Callable[[], Any], seconds: float, what: str) -> Any:
        end = time.monotonic() + seconds
        while True:
            value = found()
            if value:
                return value
            assert time.monotonic() < end, f"not within {seconds:g} s: {what}"
            time.sleep(0.05)

    def tab(self, width: int = 1280, height: int = 800) -> Tab:
        context = self.call("Target.createBrowserContext")["browserContextId"]
        target = self.call("Target.createTarget", url="about:blank", browserContextId=context)["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        tab = Tab(self, session, target)
        tab.size(width, height)
        return tab

    def close(self, tab: Tab) -> None:
        self.call("Target.closeTarget", targetId=tab.target)


@contextmanager
def running(chromium: str, profile: Path) -> Iterator[Browser]:
    """A Chromium with a profile of its own."""
    import websocket

    command = [chromium, *FLAGS, f"--user-data-dir={profile}", "--remote-debugging-port=0", "about:blank"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            socket = websocket.create_connection(_address(profile, process), timeout=60, suppress_origin=True)
            try:
                browser = Browser(socket)
                yield browser
                browser.call("Browser.close")
                process.wait(timeout=30)
            finally:
                socket.close()
        finally:
            process.terminate()


def _address(profile: Path, process: subprocess.Popen[bytes]) -> str:
    """Where Chromium listens, as it writes it into its profile."""
    end = time.monotonic() + 60
    while time.monotonic() < end and process.poll() is None:
        try:
            port, path = (profile / "DevToolsActivePort").read_text().split()
        except (OSError, ValueError):
            time.sleep(0.05)
            continue
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/version", timeout=10) as answer:
            assert answer.status == 200
        return f"ws://127.0.0.1:{port}{path}"
    raise AssertionError("Chromium did not start")
