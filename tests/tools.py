"""Programs and packages that some tests need beside our own."""

from __future__ import annotations

import importlib.util
import os
import shutil
from pathlib import Path
from typing import NoReturn

import pytest


def require(tool: str) -> str:
    """Path of a program; without it the test skips, or fails where ``JOINTLIB_REQUIRE_TOOLS`` names it."""
    return shutil.which(tool) or absent(tool, f"{tool} is not installed")


def package(name: str) -> Path:
    """Folder of an installed package; without it the test skips, or fails as for a program."""
    found = importlib.util.find_spec(name)
    if found is None or found.origin is None:
        absent(name, f"{name} is not installed (pip install 'jointlib[test]' brings it where it runs)")
    return Path(found.origin).parent


def absent(name: str, reason: str) -> NoReturn:
    if name in os.environ.get("JOINTLIB_REQUIRE_TOOLS", "").split():
        pytest.fail(reason)
    pytest.skip(reason)
