"""A real window: its own X server, keys and clicks by xdotool, the screen's pixels by Pillow.

Where something is missing for that, the tests are skipped and say what; with REQUIRE_WINDOW=1 they fail instead.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from PIL import features
from window_driver import PATIENCE, Sketch

from sketch import display as displays
from sketch import java


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    missing = what_is_missing()
    if missing and os.environ.get("REQUIRE_WINDOW") != "1":
        for item in items:
            if {"display", "lasting_display"} & set(getattr(item, "fixturenames", ())):
                item.add_marker(pytest.mark.skip(reason=f"no window to test: {missing}"))


def what_is_missing() -> str:
    for program in ("Xvfb", "xdotool"):
        if shutil.which(program) is None:
            return f"{program} is not installed"
    if not features.check("xcb"):
        return "this Pillow cannot read the screen"
    if libraries := [name for name in displays.LIBRARIES if not displays._loads(name)]:
        return f"{', '.join(libraries)} cannot be loaded"
    chosen = java.find_java()
    return "" if chosen.found else chosen.why


@contextmanager
def run_display() -> Iterator[str]:
    """The name of an X server for one sketch alone, on a display number that the server finds free itself."""
    if missing := what_is_missing():
        pytest.fail(f"no window to test: {missing}")
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1000x800x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as answer:
        number = answer.readline().strip()
    assert number, "Xvfb did not start"
    try:
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(PATIENCE)


@pytest.fixture
def display() -> Iterator[str]:
    with run_display() as name:
        yield name


@pytest.fixture(scope="module")
def lasting_display() -> Iterator[str]:
    with run_display() as name:
        yield name


@pytest.fixture
def start(display: str, tmp_path: Path) -> Iterator[Callable[..., Sketch]]:
    """Starts sketches, and ends those that a failed test has left."""
    started: list[Sketch] = []

    def start_one(*arguments: object, program: tuple[str, ...] = ("-m", "sketch")) -> Sketch:
        started.append(Sketch(display, tmp_path, *arguments, program=program))
        return started[-1].find_window()

    yield start_one
    for sketch in started:
        sketch.process.kill()
        sketch.process.wait()
