"""The picture of a machine file, for ``jointlib inspect -o``."""

from __future__ import annotations

from pathlib import Path


def draw(file: Path, output: Path) -> list[str]:
    """Write the machine of a file as SVG or HTML, by the suffix; what is to be said of it."""
    from jointlib.io.atomic import write_text
    from machines.files import read_machine
    from machines.view import scene
    from machines.view.page import page
    from machines.view.svg import picture

    drawn = scene(read_machine(file))
    write_text(output, page(drawn) if output.suffix == ".html" else picture(drawn))
    return [*drawn.placeless, f"wrote {output}"]
