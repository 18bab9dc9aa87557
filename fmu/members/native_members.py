"""The files of a native FMU: one library for each platform, its whole source, and the licences."""

from __future__ import annotations

from xml.etree import ElementTree

from jointlib.errors import InputError

from ..system.system import System
from .build import Compiler, here, library
from .description import VERSIONS, document
from .headers import headers, licence
from .source import TRANSLATION_UNIT, source_files

SOURCES = "sources/"
BUILD = f"{SOURCES}buildDescription.xml"
"""What FMI 3.0 says about the sources."""


def native_sources(system: System, fmi: int, identifier: str, token: str) -> dict[str, str]:
    """The members from which anyone can compile the FMU again, by their names in the archive."""
    files = source_files(system, identifier, token) | headers()
    members = {f"{SOURCES}{name}": text for name, text in files.items()}
    if fmi == 3:
        members[BUILD] = _build_description(identifier)
    return members


def _build_description(identifier: str) -> str:
    """FMI 3.0's sources/buildDescription.xml."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion=VERSIONS[3])
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=identifier)
    group = ElementTree.SubElement(configuration, "SourceFileSet", language="C99")
    ElementTree.SubElement(group, "SourceFile", name=TRANSLATION_UNIT)
    # Part of the C library on Windows.
    ElementTree.SubElement(configuration, "Library", name="m", description="where the C library has it apart")
    return document(root)


def native_members(
    sources: dict[str, str], fmi: int, identifier: str, compilers: tuple[Compiler, ...], *, all_needed: bool = False
) -> tuple[dict[str, bytes], dict[str, str]]:
    """Sources, the libraries compiled from them, and the licence of the FMI headers; and what was left out, and why.

    A platform whose compiler fails is left out, unless it is this computer's own or ``all_needed``.
    """
    left = {}
    members = {name: text.encode("utf-8") for name, text in sources.items()}
    members["documentation/licenses/fmi-headers.txt"] = licence().encode("utf-8")
    files = {name.removeprefix(SOURCES): text for name, text in sources.items() if name.endswith((".c", ".h"))}
    for compiler in compilers:
        place = f"binaries/{compiler.platform.folder(fmi)}/{identifier}{compiler.platform.suffix}"
        try:
            members[place] = library(compiler, files, TRANSLATION_UNIT, identifier)
        except InputError as error:
            if all_needed or compiler.platform.fmi3 == here():
                raise  # what cannot run here cannot be verified; another platform does without
            left[compiler.platform.folder(fmi)] = str(error)
    return members, left
