"""The page of a machine on this computer: sliders, responses, lobes, designs of a study."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock, Thread
from typing import TYPE_CHECKING

from jointlib.answers.given import File, files_of
from jointlib.errors import InputError
from jointlib.io.atomic import to_write
from jointlib.joint import Joint
from jointlib.registry import plugin
from jointlib.shown.progress import Progress, Silent

from ..files.machine_file import read_machine
from ..files.opened import with_tool
from ..road.open_joints import with_joints

if TYPE_CHECKING:
    from werkzeug.serving import BaseWSGIServer

    from ..explore import Explorer


@dataclass(eq=False, repr=False)
class ExplorerPage:
    """A page that answers while it is served; as a context it is closed at the end."""

    explorer: Explorer
    """What it shows, for programs."""
    address: str
    alone: bool
    """Whether it is shown to this computer alone."""
    remarks: tuple[str, ...]
    server: BaseWSGIServer
    writing: Lock
    """Held while files are written."""
    _thread: Thread | None = field(default=None, init=False)

    def __repr__(self) -> str:
        return f"ExplorerPage: {self.address} shows {self.explorer.machine}"

    def _repr_html_(self) -> str:
        return f'<a href="{self.address}">{self.address}</a>'

    def serve(self) -> None:
        """Answer until Ctrl-C."""
        self.server.serve_forever()

    def start(self) -> None:
        """Answer beside the program."""
        self._thread = Thread(target=self.server.serve_forever, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the page, after the file that is being written."""
        if self._thread is not None:
            self.server.shutdown()
            self._thread.join()
        with self.writing:
            self.server.server_close()

    def __enter__(self) -> ExplorerPage:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def explore(
    machine: File,
    *,
    study: File | None = None,
    results: File | None = None,
    output: File = "explore",
    measured: File | Iterable[File] = (),
    tool: str | None = None,
    port: int | None = None,
    host: str = "127.0.0.1",
    wait: bool = False,
    progress: Progress | None = None,
) -> ExplorerPage:
    """Show a machine on a page that answers to sliders: ``jointlib explore``.

    The page asks nothing of the internet and is shown to this computer alone. It is served beside the program until it
    is closed, ``page.close()`` or by ``with``.

    Parameters
    ----------
    machine
        The file of a machine.
    study, results
        Study file whose designs are shown, and the folder of its results.
    output
        Folder for the files that the page writes.
    measured
        Measurement files of kind "frf" to lay over it.
    tool
        Which of several named tools is in the machine.
    port
        8050, or any that is free, where none is given; 0: any that is free.
    host
        Address to listen at; of another than this computer's the page can be used over the network.
    wait
        Leave it to ``page.serve()``, which ends at Ctrl-C, or to ``page.start()`` that it answers.
    progress
        Told of every part that takes long.
    """
    if importlib.util.find_spec("dash") is None:
        raise InputError("explore: needs the package dash, install it with pip install 'jointlib[explore]'")
    if (study is None) != (results is None):
        raise InputError("--study and --results: expected both, the study file and the folder of its results")
    from ..explore.scene import Explorer
    from ..explore.server import bound, explorer_app, is_this_computer, listening

    file, folder, during = Path(machine), to_write(output, "output", folder=True), progress or Silent()
    with bound(host, port) as place:
        alone = is_this_computer(place.getsockname()[0])
        with during.step("reading the machine"):
            joints, remarks = identified(file, with_tool(tool))
            designs, folder_of = (None if path is None else Path(path) for path in (study, results))
            explorer = Explorer(file, designs, folder_of, joints, tool or "", files_of(measured))
            app, writing = explorer_app(explorer, file.stem, folder, exported, alone)
        server = listening(app, place)
    name = f"[{server.host}]" if ":" in server.host else server.host
    page = ExplorerPage(explorer, f"http://{name}:{server.port}", alone, tuple(remarks), server, writing)
    if not wait:
        page.start()
    return page


def identified(path: Path, changes: dict[str, str] | None = None) -> tuple[dict[str, Joint], Sequence[str]]:
    """Joints that the machine leaves to be identified, and what is to be said of them."""
    machine = read_machine(path, changes)
    open_ones = {c.name for c in machine.connections if c.identify is not None}
    found, remarks = with_joints(machine)
    return {c.name: c.joint for c in found.connections if c.name in open_ones and c.joint is not None}, remarks


def exported(machine: Path, target: Path) -> Sequence[str]:
    """The machine of a file as an FMU; which runtime it has, and what else there is to say."""

    model, remarks = with_joints(read_machine(machine))
    done = plugin("jointlib.exports", "fmu", "explore")(model, target)
    runtime = "native code (C)" if done.runtime == "c" else "Python, because no C compiler was found"
    verified = f"verified with {', '.join(done.verified_with)}" if done.verified_with else "not verified"
    return [f"It computes in {runtime}, {verified}.", *done.messages, *remarks]
