"""Programs that some tests need beside Python."""

from __future__ import annotations

import os
import shutil

import pytest


def require(tool: str) -> str:
    """Path of a program; without it the test skips, or fails where ``JOINTLIB_REQUIRE_TOOLS`` names it."""
    path = shutil.which(tool)
    if path is None:
        reason = f"{tool} is not installed"
        if tool in os.environ.get("JOINTLIB_REQUIRE_TOOLS", "").split():
            pytest.fail(reason)
        pytest.skip(reason)
    return path
