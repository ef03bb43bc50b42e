"""What goes on behind the window: keys and the mouse change the View, the renderer follows it. No method waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from raytracer import STAGES, SceneError, interpreter, probe_pixel, render_scene
from raytracer.camera import make_raster
from raytracer.compare import DIFFERENCES_LEGEND
from raytracer.course import BLANK
from raytracer.methods import CERTIFIED
from raytracer.plug_process import PATIENCE, PlugRunner, echo
from sketch import controls
from sketch.controls import DIFFERENCE, OWN, WIPE, View
from sketch.files import save_beside
from sketch.orbit import seen_from
from sketch.overlay import (
    Layout,
    Legend,
    Panel,
    causes_panel,
    compose,
    error_panel,
    help_panel,
    status,
    story_panel,
    through_lens,
)
from sketch.pace import FrameRate
from sketch.rays import Ink, ink_of, lines_of
from sketch.watch import Watcher
from sketch.worker import Drawing, Renderer, Request

_PATIENCE = 5.0  # seconds that the end waits for a picture to be saved


class Story(NamedTuple):
    """What is shown of a pixel."""

    pixel: tuple[int, int]
    lines: tuple[str, ...]
    ink: Ink | None  # its rays over the picture


class Session:
    """One user looking at one folder. `changed` is called, on any thread, when `content` would be another."""

    def __init__(self, view: View, size: int, patience: float = PATIENCE) -> None:
        self.layout = Layout(size)
        self.changed: Callable[[], object] = lambda: None
        self._view = view
        self._composed: Drawing | None = None  # the last that was part of the content
        self._frames = FrameRate()
        self._turn = threading.Lock()  # keys, the mouse and chores change the view one after the other
        self._story: Story | None = None
        self._chores = ThreadPoolExecutor(1, "chores")  # what takes a moment and is not drawing
        self._failure: BaseException | None = None  # of a chore
        self._plug = PlugRunner(view.plug, patience, echo, ahead=True) if view.plug is not None else None
        self._renderer = Renderer(lambda: self.changed(), self._plug)
        self._watcher = Watcher(self._watched, lambda path: self._change(lambda view: controls.saved(view, path)))
        self._renderer.post(self._request(view))

    @property
    def failure(self) -> BaseException | None:
        """A mistake of this program, made in the background: raise it."""
        return self._renderer.failure or self._failure

    @property
    def wants_to_quit(self) -> bool:
        return self._view.wish == "quit"

    def press(self, key: str) -> None:
        self._change(lambda view: controls.press(view, key))

    def grip(self, x: int, y: int) -> None:
        """The mouse takes hold at a place of the window."""
        pixel = self.layout.pixel(x, y)
        if pixel is not None:
            self._change(lambda view: controls.grip(view, pixel))

    def drag(self, x: int, y: int) -> None:
        """The mouse has gone to a place of the window, or of the screen beside it."""
        corner = self.layout.corner
        self._change(lambda view: controls.drag(view, (x - corner, y - corner)))

    def hover(self, x: int, y: int) -> None:
        """The mouse goes to a place of the window with no button held."""
        pixel = self.layout.pixel(x, y)
        if self._view.lens == WIPE and pixel is not None:
            self._change(lambda view: controls.hover(view, pixel))

    def release(self) -> None:
        """The mouse lets go."""
        self._change(controls.release)

    def wheel(self, notches: int) -> None:
        """The wheel turns, away from the user where notches are above 0."""
        self._change(lambda view: controls.wheel(view, notches))

    def content(self, out: np.ndarray | None = None) -> np.ndarray:
        """All that the window shows: uint8 (height, width, 3), or `out` filled with it."""
        view, drawing, size = self._view, self._renderer.drawing, self.layout.size
        self._count(drawing)
        picture = np.full((size, size, 3), BLANK, np.uint8) if drawing is None else through_lens(view, drawing)
        panel = self._panel(view, drawing)
        legend = () if panel is not None and not panel.is_banner else self._legend(view, drawing)
        lines = status(view, drawing, size, self._frames.a_second)
        story = self._told(view)
        return compose(self.layout, picture, lines, panel, view.pixel, legend, story and story.ink, out)

    def _count(self, drawing: Drawing | None) -> None:
        """Count the frames that are shown while the camera moves."""
        if drawing is None or not drawing.moving:
            self._frames.rest()
        elif drawing is not self._composed:
            self._frames.shown()
        self._composed = drawing

    def was_shown(self) -> None:
        """The content has been shown: now there is time to get ready for what comes next."""
        self._renderer.get_faster()

    def close(self) -> None:
        """End all work. Pictures that are being saved are finished first, unless that takes too long."""
        self._watcher.close()
        self._renderer.close()
        with suppress(TimeoutError):
            self._chores.submit(int).result(_PATIENCE)  # a chore that does nothing, behind all others

    def _change(self, step: Callable[[View], View]) -> None:
        """Take a step to another view, and set going whatever that view wants."""
        with self._turn:
            before, self._view = self._view, step(self._view)
            view = self._view
        request = self._request(view)
        if request != self._request(before):
            self._watcher.look()  # what is saved from now on is another version than the one that will be read
            self._renderer.post(request)
        if view.pixel is not None and view.pixel != before.pixel:
            self._story = None
            self._chores.submit(self._do, lambda: self._tell(view.pixel))
        if view.wish == "save":
            self._chores.submit(self._do, lambda: self._save(view, request))
        self.changed()

    def _request(self, view: View) -> Request:
        return Request(
            view.scene, view.stage, self.layout.size, view.method, view.readings, view.orbit, view.samples_of_stage,
            0 if view.plug is None else view.plug_readings + 1, view.seen_through != OWN,
        )  # fmt: skip

    def _watched(self) -> list[Path]:
        view, plug = self._view, self._plug
        return [view.scene] if plug is None else [view.scene, plug.path, *(set(plug.files) - {plug.path})]

    def _panel(self, view: View, drawing: Drawing | None) -> Panel | None:
        """What lies over the picture."""
        if view.help:
            return help_panel()
        if (story := self._told(view)) is not None:
            return story_panel(story.lines, over_rays=story.ink is not None)
        if drawing is not None and drawing.error:
            return error_panel(drawing)
        reference = None if drawing is None else drawing.reference
        if reference is not None and reference.causes and view.legend and view.seen_through in (DIFFERENCE, WIPE):
            return causes_panel(reference.causes)
        return None

    def _told(self, view: View) -> Story | None:
        """The story of the view's pixel, once it is known."""
        story = self._story
        return story if story is not None and story.pixel == view.pixel else None

    @staticmethod
    def _legend(view: View, drawing: Drawing | None) -> Legend:
        """What the colours of the picture mean, if its stage says so."""
        if drawing is None or not view.legend:
            return ()
        if view.seen_through == DIFFERENCE and drawing.reference is not None:
            return DIFFERENCES_LEGEND
        return STAGES[drawing.request.stage].legend

    # Chores have a thread of their own, so that no handler waits for them.

    def _do(self, chore: Callable[[], str]) -> None:
        """Do a chore; what it returns is the answer to the key."""
        try:
            note = chore()
        except (SceneError, OSError, MemoryError) as error:
            note = str(error) or "not enough memory"
        except BaseException as failure:
            self._failure = failure
            note = ""
        if note:
            with self._turn:
                self._view = replace(self._view, note=note)
        self.changed()

    def _tell(self, pixel: tuple[int, int] | None) -> str:
        """Print a pixel's story, and show it in short."""
        drawing = self._seen()
        if drawing is None or drawing.scene is None:
            return "there is no picture yet"
        if pixel is not None and pixel == self._view.pixel:  # else another click or key has come since
            request = drawing.request
            size, stage, method = request.size, request.stage, request.method
            told = probe_pixel(drawing.scene, *pixel, size, size, stage, method=method)
            lines = lines_of(told.rays, make_raster(drawing.scene.camera, size, size))
            own = self._own(drawing, pixel)
            self._story = Story(pixel, (*told.lines(), *own), ink_of(lines, size, size) if told.rays else None)
            print(*told.story(), *own, sep="\n", flush=True)  # noqa: T201 (a click prints)
        return ""

    @staticmethod
    def _own(drawing: Drawing, pixel: tuple[int, int]) -> list[str]:
        """What a plugged file has made of a pixel."""
        red, green, blue = drawing.picture[pixel[1], pixel[0]].tolist()
        return [f"{drawing.parts.partition(':')[0]} drew ({red}, {green}, {blue})"] if drawing.parts else []

    def _save(self, view: View, request: Request) -> str:
        """Save what was seen, or on its way, when the key was pressed."""
        latest = self._renderer.drawing
        seen = self._seen()
        if latest is not None and latest.error:  # the message lies over an earlier picture: that is what is seen
            if seen is None:
                return "not saved: there is no picture"
            request = seen.request
        if seen is not None and seen.full and seen.request == request:
            if request.compared and seen.reference is None:
                return "not saved: the comparison is not finished"
            picture = through_lens(view, seen)
        elif request.plug or request.compared:
            return "not saved: the picture is not finished"
        else:  # not finished, given up for the next one, or coarse
            size, scene = request.size, seen_from(interpreter(request.path), request.orbit)
            picture = render_scene(scene, request.stage, size, size, method=request.method)
        return f"saved {save_beside(_file_name(request, view), picture)}"

    def _seen(self) -> Drawing | None:
        """Whose picture is seen: under the message about a broken scene, still that of the one before."""
        latest = self._renderer.drawing
        return self._renderer.whole if latest is not None and latest.error else latest


def _file_name(request: Request, view: View) -> str:
    """What a saved picture is called, without .png."""
    method = () if request.method == CERTIFIED else (request.method,)
    plug = () if view.plug is None else (view.plug.stem,)
    return "-".join([request.path.stem, request.stage, *method, *plug, *([view.lens] if request.compared else [])])
