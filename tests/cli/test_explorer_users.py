"""The explorer under many users, long use, slow clients and long bodies; asked as its page asks, without a browser."""

from __future__ import annotations

import gc
import http.client
import json
import os
import random
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from command_line import LIBRARY
from explorer_site import Site, serving
from explorer_users import User
from tools import package

STIFFNESS, SPEED = 1, 6000.0
USERS = 50


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    with _served("two_mass.toml", tmp_path) as site:
        yield site


def _served(machine: str, folder: Path) -> Any:
    package("dash")
    from machines.explore import Explorer

    return serving(Explorer(LIBRARY / machine), folder / "out")


def _drawn(user: User, share: float) -> list[Any]:
    """What a user sees of three settings that are no other user's."""
    low, high = user.controls[STIFFNESS].low, user.controls[STIFFNESS].high
    seen = []
    for part in (0.0, 0.4, 0.8):
        text = f"{low + (high - low) * (share + part) / 2:.8g}"
        found = user.act(STIFFNESS, text)
        seen.append([float(text), found["frf"], found["lobes"], found["gain"], found["headline"], found["drawn"]])
        assert user.state["values"][user.controls[STIFFNESS].key] == float(text)
    return seen


@pytest.mark.slow
def test_fifty_users_at_once_each_get_their_own(site: Site, tmp_path: Path) -> None:
    shares = [i / USERS for i in range(USERS)]
    found: dict[float, list[Any]] = {}
    users = [User.of(site, "two_mass.toml") for _ in shares]
    together = threading.Barrier(USERS)

    def use(user: User, share: float) -> None:
        together.wait(60)
        found[share] = _drawn(user, share)

    threads = [threading.Thread(target=use, args=one) for one in zip(users, shares, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert not any(thread.is_alive() for thread in threads)
    with _served("two_mass.toml", tmp_path / "alone") as other:
        for share in shares[::7]:
            assert found[share] == _drawn(User.of(other, "two_mass.toml"), share)
    assert len({str(one) for seen in found.values() for one in seen}) == 3 * USERS


def _held() -> tuple[float, int, int, int]:
    """MB of memory, objects, threads and open files of this process."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    objects, files = len(gc.get_objects()), len(os.listdir("/proc/self/fd"))
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6, objects, threading.active_count(), files


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is told as on Linux")
@pytest.mark.parametrize("machine", ["two_mass.toml", "two_mode_tool.toml"])
def test_memory_is_flat_over_ten_thousand_actions(machine: str, tmp_path: Path) -> None:
    """Sliders anywhere, texts that are refused, readings; a new page every hundred actions."""
    rng = random.Random(7)
    with _served(machine, tmp_path) as site:
        held = []
        for number in range(10_001):
            if number % 100 == 0:
                user = User.of(site, machine)
            if number % 2500 == 0:
                held.append(_held())
            at = rng.choice([i for i, control in enumerate(user.controls) if not control.choices])
            control = user.controls[at]
            value = rng.uniform(control.low, control.high)
            if number % 7 == 0:
                user.act(at, "rubbish")
            elif number % 10 == 0:
                user.read(rng.uniform(4000, 20000))
            else:
                user.act(at, str(int(value)) if control.whole else f"{value:.6g}")
    (memory, objects, *others), *_, last = held[1:]
    assert last[1] < objects + 1000, held
    # What the allocator keeps of freed arrays wavers by a few megabytes; a leak of 10 kB an action would be 75.
    assert last[0] < memory + 50, held
    assert last[2] <= others[0] + 1, held
    assert last[3] <= others[1] + 4, held


def _half(site: Site, count: int) -> list[socket.socket]:
    """Clients that begin a request and do not end it."""
    held = []
    for number in range(count):
        client = socket.create_connection(("127.0.0.1", site.port), timeout=30)
        head = f"POST /_dash-update-component HTTP/1.1\r\nHost: 127.0.0.1:{site.port}\r\nContent-Length: 1000\r\n"
        client.sendall((head if number % 2 else f"{head}Content-Type: application/json\r\n\r\n{{").encode())
        held.append(client)
    return held


@pytest.mark.slow
def test_slow_clients_hold_up_nobody_and_are_let_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package("dash")
    monkeypatch.setattr("machines.explore.server.PATIENCE", 2.0)
    with _served("two_mass.toml", tmp_path) as site:
        before = threading.active_count()
        slow = _half(site, USERS)
        user = User.of(site, "two_mass.toml")
        assert _drawn(user, 0.3)
        end = time.monotonic() + 30
        while threading.active_count() > before and time.monotonic() < end:
            time.sleep(0.1)
        assert threading.active_count() <= before
        for client in slow:
            client.close()
        assert _drawn(user, 0.5)


@pytest.mark.parametrize("chunked", [False, True])
def test_a_body_beyond_four_megabytes_is_refused(site: Site, chunked: bool) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", site.port, timeout=30)
    body: Sequence[bytes] = [b"[" * 65536] * 100
    headers = {"Content-Type": "application/json"}
    if not chunked:
        headers["Content-Length"] = str(sum(map(len, body)))
    try:
        connection.request("POST", "/_dash-update-component", iter(body), headers, encode_chunked=chunked)
        # Of a body of unknown length the first four megabytes are looked at, which are no JSON.
        assert connection.getresponse().status == (400 if chunked else 413)
    except (BrokenPipeError, ConnectionResetError):
        pass  # it was hung up on while it was still talking
    finally:
        connection.close()
    assert _drawn(User.of(site, "two_mass.toml"), 0.5)


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Origin": "http://evil.example"},
        {"Sec-Fetch-Site": "cross-site"},
    ],
)
def test_no_callback_and_no_other_address_answers_a_stranger(site: Site, headers: dict[str, str]) -> None:
    user = User.of(site, "two_mass.toml")
    for path in ("", "_dash-layout", "_dash-dependencies", "viewer.js", "viewer.css", "assets/explorer.js", "none"):
        assert user.status("GET", path, None, headers) == 403, path
    for body in user.bodies():
        assert user.status("POST", "_dash-update-component", body, headers) == 403, body["output"]
        assert user.status("POST", "_dash-update-component", body, {}) in (200, 204), body["output"]


RUBBISH = (1e308, "x" * 3000, "../../x", [[]], {"a": {}}, {"kind": "field", "serial": 1, "control": 10**9, "text": "3"})


@pytest.mark.parametrize("rubbish", RUBBISH)
def test_rubbish_in_a_callback_writes_nothing_and_disturbs_nobody(site: Site, rubbish: Any, tmp_path: Path) -> None:
    """A page sends none, but another program on this computer may."""
    user = User.of(site, "two_mass.toml")
    for body in user.bodies():
        given = [one for one in (*body["inputs"], *body["state"]) if isinstance(one, dict)]
        for one in given:
            one["value"] = rubbish
        status, text = user.asked("POST", "_dash-update-component", body, {})
        assert status in (200, 204, 400), body["output"]
        assert b"Traceback" not in text
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
    assert _drawn(user, 0.5)


def test_a_request_that_fails_is_told_on_one_line(site: Site, caplog: pytest.LogCaptureFixture) -> None:
    user = User.of(site, "two_mass.toml")
    assert user.status("GET", "_dash-component-suites/dash/../../etc/passwd", None, {}) == 400
    assert user.status("GET", "", None, {"Origin": "http://[::1"}) == 400
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 2
    assert all(len(line) <= 320 and line.isprintable() for line in said)


def test_no_name_becomes_markup_in_the_page(tmp_path: Path) -> None:
    """What the page is first sent; what follows are data that its script puts in as text."""
    package("dash")
    from machines.explore import Explorer

    name = "<img src=x onerror=alert(1)>"
    for source, target in (("two_mass.toml", f"{name}.toml"), ("two_mass.joint.toml", "two_mass.joint.toml")):
        (tmp_path / target).write_bytes((LIBRARY / source).read_bytes())
    with serving(Explorer(tmp_path / f"{name}.toml"), tmp_path / "out") as site:
        user = User(site, {}, (), None)
        page = user.asked("GET", "", None, {})[1]
        assert b"<img" not in page
        assert b"jointlib</title>" in page
        assert name in json.dumps(json.loads(user.asked("GET", "_dash-layout", None, {})[1]))
