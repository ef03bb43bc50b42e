"""Drawing in the background: post a request, look at what has come of it whenever you like. The latest request wins."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

import numpy as np

from raytracer import Cancelled, Scene, SceneError, backend, interpreter, make_plan
from raytracer.image import to_bytes
from raytracer.methods import CERTIFIED
from raytracer.render import draw
from raytracer.stages import FALSE_HIT, FALSE_MISS, WRONG_SHAPE
from raytracer.trace import Eye

BLANK = 40  # the grey of pixels that nothing was drawn on yet
_PATIENCE = 1 / 30  # seconds between two looks at a picture that grows


@dataclass(frozen=True)
class Request:
    """Which picture is wanted."""

    path: Path
    stage: str
    size: int
    method: str = CERTIFIED
    readings: int = 0  # another number means that the file is to be read again


@dataclass(frozen=True)
class Drawing:
    """How far a request has come. Pixels that are not drawn yet are those of the last whole picture."""

    request: Request
    picture: np.ndarray  # uint8 (size, size, 3)
    scene: Scene | None = None  # None until the file is read, and when it cannot be
    done: float = 0.0  # the part of the picture that is drawn
    milliseconds: float = 0.0  # that drawing took
    wrong: int | None = None  # pixels whose hit or shape is wrong; None where the stage does not tell
    warnings: tuple[str, ...] = ()
    error: str = ""  # what is wrong with the scene, in one line

    @property
    def whole(self) -> bool:
        return self.done == 1.0


class Renderer:
    """A thread that draws what is asked for. `changed` is called on that thread whenever there is more to see."""

    def __init__(self, changed: Callable[[], object]) -> None:
        self.drawing: Drawing | None = None  # the latest
        self.whole: Drawing | None = None  # the last one that was finished
        self.failure: BaseException | None = None  # a mistake of this program, not of a scene's author: end it
        self._changed = changed
        self._wanted: Request | None = None
        self._closed = False
        self._news = threading.Condition()
        self._read: tuple[Path, int, Scene] | None = None
        self._thread = threading.Thread(target=self._work, name="renderer", daemon=True)
        self._thread.start()
        self._loader = threading.Thread(target=self._load, name="loader", daemon=True)

    def post(self, request: Request) -> None:
        """Ask for a picture; one that is being drawn is given up."""
        with self._news:
            self._wanted = request
            self._news.notify()

    def close(self) -> None:
        """Give up whatever is being drawn, and end the thread."""
        with self._news:
            self._closed = True
            self._news.notify()

    def get_faster(self) -> None:
        """Once there is a picture, load the compiled path for those to come. Nobody waits for it, not even the end."""
        with self._news:
            if self.whole is not None and self._loader.ident is None:
                self._loader.start()

    def join(self, timeout: float | None = None) -> None:
        self._thread.join(timeout)

    def _work(self) -> None:
        try:
            while (request := self._next()) is not None:
                self._answer(request)
        except BaseException as failure:
            self.failure = failure
            self._changed()

    def _load(self) -> None:
        try:
            if self.whole is not None and bring_in_kernels(self.whole):
                backend.load()
        except BaseException as failure:
            self.failure = failure
            self._changed()

    def _next(self) -> Request | None:
        with self._news:
            self._news.wait_for(lambda: self._closed or self._wanted is not None)
            request, self._wanted = self._wanted, None
            return None if self._closed else request

    def _answer(self, request: Request) -> None:
        self.drawing = Drawing(request, self._canvas(request.size))
        try:
            self._draw(self.drawing)
        except Cancelled:
            return
        except (SceneError, OSError, MemoryError) as error:
            message = str(error) or f"{request.path}: not enough memory"
            self.drawing = Drawing(request, self._canvas(request.size), error=message)
        self._changed()

    def _draw(self, drawing: Drawing) -> None:
        request, looked = drawing.request, time.perf_counter()
        scene = self._scene(request)
        start = time.perf_counter()
        plan = make_plan(scene, request.stage, request.size, request.size, method=request.method)
        self.drawing = drawing = replace(drawing, scene=scene, warnings=plan.warnings)

        def progress(done: int, total: int, rows: slice) -> None:
            nonlocal looked
            now = time.perf_counter()
            if done < total and now - looked > _PATIENCE:
                looked = now
                self.drawing = replace(drawing, done=done / total)
                self._changed()

        draw(plan, out=drawing.picture, progress=progress, cancelled=self._superseded)
        elapsed = 1000 * (time.perf_counter() - start)
        wrong = _count_wrong(drawing.picture) if request.stage == "error" else None
        self.drawing = self.whole = replace(drawing, done=1.0, milliseconds=elapsed, wrong=wrong)

    def _superseded(self) -> bool:
        return self._closed or self._wanted is not None

    def _scene(self, request: Request) -> Scene:
        """The request's scene; its file is read only when it is another one, or when that is asked for."""
        if self._read is None or self._read[:2] != (request.path, request.readings):
            self._read = None
            self._read = request.path, request.readings, interpreter(request.path)
        return self._read[2]

    def _canvas(self, size: int) -> np.ndarray:
        if self.whole is not None and self.whole.request.size == size:
            return self.whole.picture.copy()
        return np.full((size, size, 3), BLANK, np.uint8)


def bring_in_kernels(seen: Drawing) -> bool:
    """Draw a few pixels of what is seen with the compiled kernels, so that their machine code is there, found or made.

    To make it takes seconds, once; so the backend learns of the kernels only afterwards, and draws without them in the
    meantime. False: there is no compiler.
    """
    try:
        kernels = import_module("raytracer.kernels")
    except ImportError:
        return False

    def compiled(eye: Eye) -> Eye:
        kernels.see(eye.origin, eye.targets.centres, eye.targets.radii)
        return eye._replace(targets=eye.targets._replace(path=kernels))

    assert seen.scene is not None
    plan = make_plan(seen.scene, seen.request.stage, 8, 8, method=seen.request.method)
    draw(replace(plan, eye=compiled(plan.eye), truth=plan.truth and compiled(plan.truth)))
    return True


def _count_wrong(picture: np.ndarray) -> int:
    """How many pixels of a picture at stage `error` have a colour that says wrong."""
    return sum(
        int(np.logical_and.reduce([picture[..., k] == byte for k, byte in enumerate(to_bytes(np.array(colour)))]).sum())
        for colour in (WRONG_SHAPE, FALSE_HIT, FALSE_MISS)
    )
