"""`python -m sketch` in a process of its own, seen and used through an X server as a user would."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageGrab

PROJECT = Path(__file__).resolve().parent.parent.parent
PATIENCE = 20.0  # seconds until something that should happen counts as not happening


class Sketch:
    """One run of the sketch."""

    def __init__(
        self, display: str, cwd: Path, *arguments: object, program: tuple[str, ...] = ("-m", "sketch")
    ) -> None:
        self.display = display
        self.cwd = cwd
        self.environment = {**os.environ, "DISPLAY": display, "PYTHONPATH": str(PROJECT)}
        self.stdout, self.stderr = cwd / "stdout.txt", cwd / "stderr.txt"
        with self.stdout.open("w") as out, self.stderr.open("w") as err:
            command = [sys.executable, *program, *map(str, arguments)]
            self.process = subprocess.Popen(command, cwd=cwd, env=self.environment, stdout=out, stderr=err)
        self.window, self.left, self.top, self.width, self.height = 0, 0, 0, 0, 0

    def find_window(self) -> Sketch:
        """Wait for the window, and click beside its picture: without a window manager it gets no keys before."""
        self.wait_until(lambda: bool(self._search()), "a window")
        self.window = int(self._search()[-1])
        shell = self.xdotool("getwindowgeometry", "--shell", str(self.window))
        figures = dict(line.split("=") for line in shell.split())
        self.left, self.top = int(figures["X"]), int(figures["Y"])
        self.width, self.height = int(figures["WIDTH"]), int(figures["HEIGHT"])
        self.wait_until(lambda: self.screen().any(), "something in the window")
        self.click(self.width // 2, self.height - 5)
        return self

    def _search(self) -> list[str]:
        return self.xdotool("search", "--onlyvisible", "--name", "^raytracer$", check=False).split()

    def xdotool(self, *arguments: str, check: bool = True) -> str:
        command = ["xdotool", *arguments]
        return subprocess.run(command, env=self.environment, check=check, capture_output=True, text=True).stdout

    def press(self, *keys: str) -> None:
        self.xdotool("key", *keys)

    def click(self, x: int, y: int) -> None:
        self.xdotool("mousemove", str(self.left + x), str(self.top + y), "click", "1")

    def drag(self, right: int, down: int, release: bool = True) -> None:
        """Take hold in the window's middle and pull, in four steps."""
        x, y = self.left + self.width // 2, self.top + self.width // 2
        self.xdotool("mousemove", str(x), str(y), "mousedown", "1")
        for part in (1, 2, 3, 4):
            self.xdotool("mousemove", str(x + right * part // 4), str(y + down * part // 4))
        if release:
            self.release()

    def release(self) -> None:
        self.xdotool("mouseup", "1")

    def wheel(self, notches: int) -> None:
        """Turn the wheel over the window's middle, away from the user where notches are above 0."""
        self.xdotool("mousemove", str(self.left + self.width // 2), str(self.top + self.width // 2))
        self.xdotool("click", "--repeat", str(abs(notches)), "4" if notches > 0 else "5")

    def screen(self) -> np.ndarray:
        """What the window shows: uint8 (height, width, 3)."""
        image = ImageGrab.grab(xdisplay=self.display)
        box = (self.left, self.top, self.left + self.width, self.top + self.height)
        return np.asarray(image.crop(box).convert("RGB"))

    def picture(self, size: int) -> np.ndarray:
        return self.screen()[:size, :size]

    def wait_until(self, happened: Callable[[], bool], what: str) -> None:
        end = time.monotonic() + PATIENCE
        while not happened():
            assert self.process.poll() is None, f"the sketch ended while waiting for {what}: {self.stderr.read_text()}"
            if time.monotonic() > end:
                Image.fromarray(self.screen()).save(self.cwd / "screen.png")
                pytest.fail(f"waited for {what}; the screen is in {self.cwd / 'screen.png'}")
            time.sleep(0.02)

    def wait_for_picture(self, expected: np.ndarray, what: str) -> None:
        """Until the screen shows these very bytes."""
        self.wait_until(lambda: np.array_equal(self.picture(len(expected)), expected), what)

    def end(self) -> int:
        """The exit status, which must come by itself."""
        return self.process.wait(PATIENCE)

    def close_window(self) -> None:
        """What a window manager sends when its close button is pressed."""
        _send_delete_window(self.display, self.window)

    def interrupt(self) -> None:
        self.process.send_signal(signal.SIGINT)


def is_written(path: Path) -> bool:
    """Whether a saved file is there: its name is taken by an empty one while it is written."""
    return path.exists() and path.stat().st_size > 0


class _ClientMessage(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
        ("room", ctypes.c_long * 24),
    )


def _send_delete_window(display: str, window: int) -> None:
    x11 = ctypes.CDLL("libX11.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XInternAtom.restype = ctypes.c_ulong
    connection = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    protocols = x11.XInternAtom(connection, b"WM_PROTOCOLS", 0)
    message = _ClientMessage(type=33, window=window, message_type=protocols, format=32)
    message.data[0] = x11.XInternAtom(connection, b"WM_DELETE_WINDOW", 0)
    x11.XSendEvent(connection, ctypes.c_ulong(window), 0, ctypes.c_long(0), ctypes.byref(message))
    x11.XCloseDisplay(connection)
