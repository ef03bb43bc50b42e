"""Packages that nobody has to have: their tests are skipped without them, and fail where all tests have to run."""

import os
from types import ModuleType

import pytest


def optional(name: str) -> ModuleType:
    """The package; skips the test without it, or fails it if REQUIRE_OPTIONAL is 1."""
    if os.environ.get("REQUIRE_OPTIONAL") == "1":
        return __import__(name)
    return pytest.importorskip(name)
