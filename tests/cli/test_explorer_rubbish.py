"""What another program on this computer may send to the callbacks of the explorer, which no page does."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from typing import Any

import pytest
from explorer_site import Site, serving_study
from explorer_users import User

STUDY = """
schema = "jointlib/study/1"
base = "lathe.toml"
[[factor]]
name = "guide"
path = "connection.guide.joint.linear.stiffness"
range = ["100 N/um", "900 N/um"]
levels = 3
[[objective]]
quantity = "static-compliance"
goal = "min"
"""
NEARLY: tuple[Any, ...] = (
    {"kind": "launch", "serial": 1},
    {"kind": "move", "serial": 1, "control": True, "position": 3},
    {"kind": "move", "serial": 1, "control": -1, "position": 3},
    {"kind": "move", "serial": 1, "control": 0, "position": 10**400},
    {"kind": "field", "serial": "1", "control": 0, "text": []},
    {"kind": "wish", "serial": 1, "values": [], "words": {}},
    {"kind": "wish", "serial": 1, "values": {"tool.use": [[]]}, "words": ""},
    {"what": "launch", "name": "x"},
    {"what": ["export"], "name": {}},
    {"what": "export"},
    {"values": {"amplitude": {}}, "locked": [[], {}], "order": 3},
    {"speed": 6000.0, "values": {}, "found": {"depth": "deep", "more": 1}},
    {"points": [{"x": "fast", "customdata": [3]}]},
    {"points": [3]},
    {"points": {}},
    {"design": 10**9, "again": "x"},
    {"count": []},
    [{"props": 3}, 7],
    10**400,
    -3,
    True,
    "\u202e\n'<b>",
)
"""Beside what is nothing of the kind, what is right but for one thing."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with serving_study(tmp_path_factory.mktemp("rubbish"), STUDY) as site:
        yield site


def _user(site: Site) -> User:
    return User.of(site, str(site.folder.parent / "lathe.toml"))


def _spoiled(user: User, rubbish: Any) -> Iterator[dict[str, Any]]:
    """Every request with one thing in it spoiled, called by each of the things that call."""
    for body in user.bodies():
        for part in ("inputs", "state"):
            for at, one in enumerate(body[part]):
                spoiled = json.loads(json.dumps(body))
                if isinstance(one, dict):
                    spoiled[part][at]["value"] = rubbish
                else:
                    spoiled[part][at] = [{**each, "value": rubbish} for each in one]
                if part == "inputs" and isinstance(one, dict):
                    spoiled["changedPropIds"] = [f"{one['id']}.{one['property']}"]
                yield spoiled


@pytest.mark.parametrize("rubbish", NEARLY, ids=range(len(NEARLY)))
def test_rubbish_is_refused_in_a_sentence_and_is_no_fault_of_the_program(
    site: Site, rubbish: Any, caplog: pytest.LogCaptureFixture
) -> None:
    user = _user(site)
    for body in _spoiled(user, rubbish):
        status, text = user.asked("POST", "_dash-update-component", body, {})
        assert status in (200, 204), (body, text[:300])
        assert b"fault of its own" not in text, body
    assert not [record for record in caplog.records if record.levelno >= logging.ERROR or record.exc_info]
    assert all(len(record.getMessage().splitlines()) == 1 for record in caplog.records)
    assert not site.folder.exists()
    assert site.exported == []


@pytest.mark.parametrize(("order", "words"), [("order-write", "save, export, report"), ("order-keep", "keep, forget")])
def test_a_button_that_there_is_not_does_nothing(site: Site, order: str, words: str) -> None:
    user = _user(site)
    name = next(name for name, one in user.callbacks.items() if one["inputs"][0]["id"] == order)
    given = {f"{order}.data": {"what": "launch", "name": "x"}, "state.data": user.state}
    status, said = user.asked("POST", "_dash-update-component", user.body(name, f"{order}.data", given), {})
    assert status == 200
    assert f"'launch', expected one of {words}" in said.decode()
    assert site.exported == []
    assert not site.folder.exists()
