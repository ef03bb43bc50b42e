"""The window on py5: it shows a session's content and hands keys and the mouse on.

Seen with py5 0.10: `redraw()` is forgotten when it comes during `draw`, so the sketch loops while there is something
new and stops looping when it has shown it. `np_pixels` takes an array a few times as fast as an image that is made of
one. An exception in a handler leaves a process that hangs, and Java's own way out takes a second, so the process ends
itself.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from typing import NoReturn

import py5_tools

from sketch.session import Session

py5_tools.add_options("-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC")  # halves the time until the window opens
if sys.platform != "darwin":
    py5_tools.add_options("-Xrs")  # leaves Ctrl-C to Python; on macOS the main thread is Java's

import py5  # noqa: E402 (starts Java)


def run_window(session: Session) -> NoReturn:
    """Open the window and stay until it closes; then end the process."""
    window = Window(session)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # from now on there is something to close
    try:
        window.run_sketch(block=True)  # macOS knows no other way
    except KeyboardInterrupt:
        window.leave(130)
    window.leave(0)


def guarded(handler: Callable[..., None]) -> Callable[..., None]:
    """A handler whose exception is reported and ends the process."""

    @wraps(handler)
    def guard(window: Window, *event: object) -> None:
        try:
            handler(window, *event)
        except Exception:
            traceback.print_exc()
            window.leave(1)

    return guard


class Window(py5.Sketch):  # type: ignore[misc] # py5 has no types
    """The methods are py5's, called on threads of Java's."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session

    @guarded
    def settings(self) -> None:
        self.size(self.session.layout.width, self.session.layout.height)
        self.pixel_density(1)  # one pixel of ours is one of the window's, on dense displays too

    @guarded
    def setup(self) -> None:
        self.get_surface().set_title("raytracer")
        self.load_np_pixels()
        self.np_pixels[..., 0] = 255  # opaque; the colours follow
        self.session.changed = self.loop

    @guarded
    def draw(self) -> None:
        self.no_loop()  # first: whoever has something new from here on makes it loop again
        if self.session.failure:
            raise self.session.failure
        self.session.content(out=self.np_pixels[..., 1:])
        self.update_np_pixels()
        self.session.was_shown()

    @guarded
    def key_pressed(self) -> None:
        self.session.press(str(self.key))
        if self.session.wants_to_quit:
            self.leave(0)

    @guarded
    def mouse_pressed(self) -> None:
        if self.mouse_button == self.LEFT:
            self.session.grip(self.mouse_x, self.mouse_y)

    @guarded
    def mouse_dragged(self) -> None:
        self.session.drag(self.mouse_x, self.mouse_y)

    @guarded
    def mouse_moved(self) -> None:
        self.session.hover(self.mouse_x, self.mouse_y)

    @guarded
    def mouse_released(self) -> None:
        if self.mouse_button == self.LEFT:
            self.session.release()

    @guarded
    def mouse_wheel(self, event: py5.Py5MouseEvent) -> None:
        self.session.wheel(-event.get_count())

    @guarded
    def exiting(self) -> None:
        self.leave(0)

    def leave(self, status: int) -> NoReturn:
        """End the process with this exit status."""
        self.session.close()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
