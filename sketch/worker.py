"""Drawing in the background: post a request, look at what has come of it whenever you like. The latest request wins.

While the camera moves, a frame is shown when it is finished, as coarse as it must be to keep pace; when the camera has
come to rest, the picture is drawn in full. A plugged file draws only then, since it may take its time.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from raytracer import Cancelled, Scene, backend, interpreter, make_plan
from raytracer.compare import TOLERANCE, Comparison, compare, difference_picture, differences
from raytracer.course import BLANK
from raytracer.faults import FileError
from raytracer.methods import CERTIFIED
from raytracer.mistakes import MOST_SHAPES, recognise
from raytracer.orbit import pivot_of
from raytracer.plan import Plan
from raytracer.plug import Order
from raytracer.plug_process import PlugRunner
from raytracer.render import draw, undecided, warm_up
from raytracer.samples import Samples, draw_samples
from raytracer.scene import Vector
from raytracer.stages import wrong_pixels
from sketch.orbit import HOME, Orbit, seen_from
from sketch.pace import COARSENESS, Pace, enlarged

REST = 0.12  # seconds without a movement until the camera is at rest
_TO_BE_TOLD = FileError, OSError, MemoryError  # under the picture
_PATIENCE = 1 / 30  # seconds: between two looks at a picture that grows; for a frame, when the next one is wanted


@dataclass(frozen=True)
class Request:
    """Which picture is wanted."""

    path: Path
    stage: str
    size: int
    method: str = CERTIFIED
    readings: int = 0  # another number means that the file is to be read again
    orbit: Orbit = HOME  # where the scene is seen from
    samples: Samples = 1  # rays a pixel, once the camera is at rest
    plug: int = 0  # which version of the plugged file draws it; 0 for none
    compared: bool = False  # whether it is compared with the reference

    def is_like(self, other: Request) -> bool:
        """Whether it differs from the other one in nothing but where the scene is seen from."""
        return replace(self, orbit=other.orbit) == other


@dataclass(frozen=True)
class Reference:
    """What a picture ought to be, and how far it is from that."""

    picture: np.ndarray  # uint8 (size, size, 3)
    difference: np.ndarray  # the same shape, in the colours of DIFFERENCES_LEGEND
    comparison: Comparison
    on_edge: int = 0  # of the wrong pixels, those that float64 cannot decide
    causes: tuple[str, ...] = ()  # typical mistakes that make this difference, if any are known to


@dataclass(frozen=True)
class Drawing:
    """How far a request has come. Pixels that are not drawn yet are those of the last whole picture."""

    request: Request
    picture: np.ndarray  # uint8 (size, size, 3)
    scene: Scene | None = None  # with the camera that is seen; None until the file is read, and when it cannot be
    done: float = 0.0  # the part of the picture that is drawn
    moving: bool = False  # whether it is a frame of a movement
    coarse: int = 1  # columns and rows that a pixel is drawn across
    path: str = ""  # that drew it, see `Plan.path_name`
    milliseconds: float = 0.0  # that drawing took
    wrong: int | None = None  # pixels whose hit or shape is wrong; None where the stage does not tell
    warnings: tuple[str, ...] = ()
    parts: str = ""  # of a plugged file that had a part in it, and the file's name
    reference: Reference | None = None  # what it is compared with
    error: str = ""  # what is wrong with the scene, or with the plugged file, in one line
    fault: FileError | None = None  # the same, if it is in a file
    quote: tuple[str, int] | None = None  # the line of that, and after how many characters the fault begins
    compiling: bool = False  # whether it waits for machine code that there was not yet

    @property
    def whole(self) -> bool:
        return self.done == 1.0

    @property
    def full(self) -> bool:
        return self.whole and self.coarse == 1


class Renderer:
    """A thread that draws what is asked for. `changed` is called on that thread whenever there is more to see."""

    def __init__(self, changed: Callable[[], object], plug: PlugRunner | None = None) -> None:
        self.drawing: Drawing | None = None  # the latest
        self.whole: Drawing | None = None  # the last one that was finished, a frame or a picture
        self.failure: BaseException | None = None  # a mistake of this program, not of a scene's author: end it
        self._changed = changed
        self._plug = plug
        self._wanted: Request | None = None
        self._closed = False
        self._news = threading.Condition()
        self._last: Request | None = None  # that was taken up
        self._moving = False  # whether that is a frame
        self._pace = Pace()
        self._read: tuple[Path, int, Scene] | None = None
        self._pivot: Vector | None = None  # of that scene, once it is turned about
        self._thread = threading.Thread(target=self._work, name="renderer", daemon=True)
        self._thread.start()
        self._loader = threading.Thread(target=self._load, name="loader", daemon=True)
        self._maker: threading.Thread | None = None  # of machine code that somebody has waited for

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
        if self._plug is not None:
            self._plug.close()

    def get_faster(self) -> None:
        """Once there is a picture, load the compiled path for those to come. Nobody waits for it, not even the end."""
        with self._news:
            if self.whole is not None and self._loader.ident is None:
                self._loader.start()

    def join(self, timeout: float | None = None) -> None:
        self._thread.join(timeout)

    def _work(self) -> None:
        with self._reporting():
            while (request := self._next()) is not None:
                self._answer(request)

    def _load(self) -> None:
        with self._reporting():
            if self.whole is not None and bring_in_kernels(self.whole):
                backend.load()

    @contextmanager
    def _reporting(self) -> Iterator[None]:
        """An exception on a thread of ours is a failure."""
        try:
            yield
        except BaseException as failure:
            self.failure = failure
            self._changed()

    def _next(self) -> Request | None:
        """The next request; when the camera has come to rest, the last one once more; None at the end."""
        with self._news:
            self._news.wait_for(lambda: self._closed or self._wanted is not None, REST if self._moving else None)
            if self._closed:
                return None
            last, wanted, self._wanted = self._last, self._wanted, None
            if wanted is None:  # it has come to rest
                self._moving = False
                return last
            same = last is not None and wanted.is_like(last)
            self._moving = same and wanted != last
            self._pace = self._pace if same else Pace()
            self._last = wanted
            return wanted

    def _answer(self, request: Request) -> None:
        try:
            if self._moving:
                self._draw_frame(request)
            elif self._shows(request):
                self._come_to_rest(request)
            else:
                self._draw_picture(request)
            if request.compared and not self._moving:
                self._compare()
        except Cancelled:
            return
        except _TO_BE_TOLD as error:
            message = str(error) or f"{request.path}: not enough memory"
            fault = error if isinstance(error, FileError) else None
            quote = fault.quote() if fault is not None else None
            self.drawing = Drawing(request, self._canvas(request.size), error=message, fault=fault, quote=quote)
        self._changed()

    def _draw_frame(self, request: Request) -> None:
        """One frame of a movement. Frames are finished, lest none is ever seen, but for one that takes too long."""
        scene, coarse = self._scene(request), self._pace.choose()
        size, start = -(-request.size // coarse), time.perf_counter()

        def given_up() -> bool:
            late = coarse < COARSENESS[-1] and time.perf_counter() - start > _PATIENCE
            wanted = self._wanted
            return self._closed or (wanted is not None and (late or not wanted.is_like(request)))

        plan = make_plan(scene, request.stage, size, size, method=request.method)
        if self._waits_for(plan):
            self._make_ready(plan, Drawing(request, self._canvas(request.size), scene, moving=True))
            start = time.perf_counter()
        try:
            picture = enlarged(draw(plan, cancelled=given_up), request.size)
        finally:
            elapsed = 1000 * (time.perf_counter() - start)
            self._pace.took(coarse, elapsed, plan.path_name)
        frame = Drawing(request, picture, scene, 1.0, True, coarse, plan.path_name, elapsed, warnings=plan.warnings)
        self.drawing = self.whole = frame

    def _shows(self, request: Request) -> bool:
        """Whether the request's picture is there already, in full: as the last frame, or not compared yet."""
        seen = self.drawing
        if seen is None or not seen.full or replace(seen.request, compared=request.compared) != request:
            return False
        return not seen.moving or (request.samples == 1 and not request.plug)

    def _come_to_rest(self, request: Request) -> None:
        assert self.drawing is not None
        wrong = _wrong(request, self.drawing.picture)
        self.drawing = self.whole = replace(self.drawing, request=request, moving=False, wrong=wrong)

    def _compare(self) -> None:
        """Draw what the picture ought to be, and see how far it is from that."""
        drawing = self.drawing
        assert drawing is not None
        assert drawing.scene is not None
        if drawing.reference is None:
            size = drawing.request.size
            plan = make_plan(drawing.scene, drawing.request.stage, size, size)
            samples = 1 if drawing.parts else drawing.request.samples
            expected = draw_samples(plan, samples, cancelled=self._superseded)
            found = drawing.picture
            difference, comparison = difference_picture(found, expected), compare(found, expected)
            on_edge = _on_edge(drawing.scene, found, expected) if comparison.wrong else 0
            reference = Reference(expected, difference, comparison, on_edge)
            self.drawing = self.whole = drawing = replace(drawing, reference=reference)
            self._changed()
            self._find_causes(drawing, reference)

    def _find_causes(self, drawing: Drawing, reference: Reference) -> None:
        """Draw the usual mistakes, as long as nothing else is wanted, and see which explain the difference."""
        assert drawing.scene is not None
        causes = recognise(
            drawing.picture, drawing.scene, drawing.request.stage, expected=reference.picture,
            cancelled=self._superseded,
        )  # fmt: skip
        self.drawing = self.whole = replace(drawing, reference=replace(reference, causes=causes))

    def _draw_picture(self, request: Request) -> None:
        """The picture in full, seen as it grows."""
        self.drawing = drawing = Drawing(request, self._canvas(request.size))
        scene, looked = self._scene(request), time.perf_counter()
        start, loaded = looked, backend.loaded()
        plan = make_plan(scene, request.stage, request.size, request.size, method=request.method)
        self.drawing = drawing = replace(drawing, scene=scene, warnings=plan.warnings, path=plan.path_name)

        def progress(done: int, total: int, rows: slice) -> None:
            nonlocal looked
            now = time.perf_counter()
            if done < total and now - looked > _PATIENCE:
                looked = now
                self.drawing = replace(drawing, done=done / total)
                self._changed()

        parts = self._draw_by_plug(drawing) if request.plug else ""
        if not parts:
            if self._waits_for(plan):
                self._make_ready(plan, drawing)
                start = time.perf_counter()
            drawn = draw if request.samples == 1 else partial(draw_samples, samples=request.samples)
            drawn(plan, out=drawing.picture, progress=progress, cancelled=self._superseded)
        elapsed = 1000 * (time.perf_counter() - start)
        if loaded is backend.loaded() and not parts:  # else it took the time to load the compiler too
            self._pace.took(1, elapsed, plan.path_name)
        wrong = _wrong(request, drawing.picture)
        self.drawing = self.whole = replace(drawing, done=1.0, milliseconds=elapsed, wrong=wrong, parts=parts)

    def _waits_for(self, plan: Plan) -> bool:
        """Whether the plan's kernel has to be compiled; while another one is, it cannot even be loaded."""
        if not plan.painter or backend.is_loaded(plan.painter):
            return False
        return self._is_making or not backend.is_ready(plan.painter)

    @property
    def _is_making(self) -> bool:
        return self._maker is not None and self._maker.is_alive()

    def _make_ready(self, plan: Plan, drawing: Drawing) -> None:
        """Wait for the machine code of the plan's kernel. Compiling takes long; it goes on if nobody waits any more."""
        maker, self.drawing = None, replace(drawing, compiling=True)
        self._changed()
        while self._waits_for(plan) and (maker is None or maker.is_alive()):
            if not self._is_making:
                self._maker = maker = threading.Thread(target=self._make, args=(drawing,), name="maker", daemon=True)
                maker.start()
            assert self._maker is not None
            self._maker.join(_PATIENCE)
            if self._superseded():
                raise Cancelled

    def _make(self, drawing: Drawing) -> None:
        with self._reporting(), suppress(*_TO_BE_TOLD):  # which whoever draws meets again
            bring_in_kernels(drawing)

    def _draw_by_plug(self, drawing: Drawing) -> str:
        """Have the plugged file draw; which of its parts did, or nothing if it has none in this picture."""
        assert self._plug is not None
        request, picture, name, scene = drawing.request, drawing.picture, self._plug.path.name, drawing.scene
        assert scene is not None
        self.drawing = drawing = replace(drawing, parts=name)

        def tell(so_far: np.ndarray, done: float) -> None:
            picture[...] = so_far
            self.drawing = replace(drawing, done=min(done, 0.999))
            self._changed()

        order = Order(scene, request.stage, request.size, request.size, method=request.method)
        found, names, others = self._plug.draw(order, tell, self._superseded)
        if found is None:
            return ""
        picture[...] = found
        return f"{name}: {', '.join(names)}{''.join(f', not {other}' for other in others)}"

    def _superseded(self) -> bool:
        """Whether another picture is wanted; one that is to be compared too is the same."""
        wanted, last = self._wanted, self._last
        other = wanted is not None and (last is None or replace(wanted, compared=last.compared) != last)
        return self._closed or other

    def _scene(self, request: Request) -> Scene:
        """The request's scene, as it is seen; its file is read only when it is another one, or when asked for."""
        if self._read is None or self._read[:2] != (request.path, request.readings):
            self._read, self._pivot = None, None
            self._read = request.path, request.readings, interpreter(request.path)
        scene = self._read[2]
        if request.orbit != HOME and self._pivot is None:
            self._pivot = pivot_of(scene)
        return seen_from(scene, request.orbit, self._pivot)

    def _canvas(self, size: int) -> np.ndarray:
        if self.whole is not None and self.whole.request.size == size:
            return self.whole.picture.copy()
        return np.full((size, size, 3), BLANK, np.uint8)


def _on_edge(scene: Scene, found: np.ndarray, expected: np.ndarray) -> int:
    """How many pixels are wrong where float64 cannot decide what their rays hit."""
    if len(scene) > MOST_SHAPES:
        return 0
    height, width, _ = found.shape
    return int((undecided(scene, width, height) & (differences(found, expected) > TOLERANCE)).sum())


def bring_in_kernels(seen: Drawing) -> bool:
    """Have the kernels ready for what is seen, machine code and all; False if there is no compiler."""
    assert seen.scene is not None
    return warm_up(seen.scene, seen.request.stage, seen.request.method)


def _wrong(request: Request, picture: np.ndarray) -> int | None:
    """How many pixels of a picture at stage `error` have a colour that says wrong; None for another stage."""
    return wrong_pixels(picture) if request.stage == "error" else None
