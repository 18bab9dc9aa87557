"""A user of the explorer without a browser: what its page would send, and what comes back."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from command_line import LIBRARY
from explorer_site import Site

if TYPE_CHECKING:
    from machines.explore.controls import Control


@dataclass
class User:
    """One page that is open, with the sliders as they stand there."""

    site: Site
    callbacks: Mapping[str, Any]
    """By the first thing that each of them answers with."""
    controls: Sequence[Control]
    state: Any
    serial: int = 0
    drawn: Any = None

    @classmethod
    def of(cls, site: Site, machine: str) -> User:
        """Open the page of a machine of the library."""
        from machines.explore import Explorer
        from machines.explore.page import grouped
        from machines.explore.state import State

        controls = grouped(Explorer(LIBRARY / machine).controls)
        user = cls(site, {}, controls, State.start(controls).data(controls))
        listed = json.loads(user.asked("GET", "_dash-dependencies", None, {})[1])
        user.callbacks = {_names(one)[0]: one for one in listed if not one["clientside_function"]}
        return user

    def asked(self, method: str, path: str, body: Any, headers: Mapping[str, str]) -> tuple[int, bytes]:
        """Status and text of one request in a connection of its own."""
        connection = http.client.HTTPConnection("127.0.0.1", self.site.port, timeout=120)
        try:
            said = None if body is None else json.dumps(body)
            connection.request(method, f"/{path}", said, {"Content-Type": "application/json", **headers})
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def status(self, method: str, path: str, body: Any, headers: Mapping[str, str]) -> int:
        """Status of one request."""
        return self.asked(method, path, body, headers)[0]

    def bodies(self) -> Iterator[dict[str, Any]]:
        """A request for every callback, with nothing but the sliders filled in."""
        for name, one in self.callbacks.items():
            first = one["inputs"][0]
            yield self.body(name, f"{first['id']}.{first['property']}", {"state.data": self.state})

    def act(self, control: int, text: str) -> Mapping[str, Any]:
        """Type a text into the field of a control; the pictures that follow."""
        self.serial += 1
        action = {"serial": self.serial, "control": control, "kind": "field", "text": text}
        changed = self._called("state.data", "action.data", {"action.data": action, "state.data": self.state})
        self.state = changed.get("state", {}).get("data", self.state)
        given = {"action.data": action, "state.data": self.state, "answer.data": changed["answer"]["data"]}
        found = self._called("lobes.figure", "action.data", {**given, "drawn.data": self.drawn})
        self.drawn = found["drawn"]["data"]
        return found

    def read(self, speed: float) -> Any:
        """What is read off at a speed in rpm."""
        given = {"speed.data": speed, "state.data": self.state}
        return self._called("read-off.data", "speed.data", given)["read-off"]["data"]

    def _called(self, name: str, changed: str, given: Mapping[str, Any]) -> Any:
        status, text = self.asked("POST", "_dash-update-component", self.body(name, changed, given), {})
        assert status in (200, 204), (status, text[:300])
        return json.loads(text)["response"] if text else {}

    def body(self, name: str, changed: str, given: Mapping[str, Any]) -> dict[str, Any]:
        """The request for a callback: what is ``given`` by name, all else empty."""
        one = self.callbacks[name]

        def of_all(part: str, what: str, **more: Any) -> list[Any]:
            return [{"id": {"control": i, "part": part}, "property": what, **more} for i in range(len(self.controls))]

        def filled(listed: list[Any]) -> list[Any]:
            return [
                of_all(json.loads(entry["id"])["part"], entry["property"], value="")
                if entry["id"].startswith("{")
                else {**entry, "value": given.get(f"{entry['id']}.{entry['property']}")}
                for entry in listed
            ]

        outputs: list[Any] = []
        for identity, what in (whole.rsplit(".", 1) for whole in _names(one)):
            if identity.startswith("{"):
                outputs.append(of_all(json.loads(identity)["part"], what))
            else:
                outputs.append({"id": identity, "property": what})
        return {
            "output": one["output"],
            "outputs": outputs if one["output"].startswith("..") else outputs[0],
            "inputs": filled(one["inputs"]),
            "changedPropIds": [changed],
            "state": filled(one["state"]),
        }


def _names(callback: Mapping[str, Any]) -> list[str]:
    """What a callback answers with."""
    return str(callback["output"]).strip(".").split("...")
