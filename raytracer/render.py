"""The pipeline: a plan, hits, stage colours, bytes; one band of rows after the other, on as many threads as there are.

from raytracer import interpreter, render_scene
picture = render_scene(interpreter("scenes/01_one_sphere.cli"), stage="diffuse")
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from raytracer import backend
from raytracer.arrays import Canvas, FullPaints, Hits, Paints, Tiles, aligned
from raytracer.eye import Eye, count_tests
from raytracer.methods import CERTIFIED, Method
from raytracer.notebook import Picture
from raytracer.plan import Plan, make_plan
from raytracer.pool import Call, alone, share, together
from raytracer.scene import Camera, Light, Materials, Scene, Spheres
from raytracer.screen import SPARE, Pixels, Screen, make_canvas, make_full_paints, make_paints, open_screen
from raytracer.shading import to_byte
from raytracer.stages import Block, Whole

_GREY = Materials(np.full((1, 11), 0.5))

Progress = Callable[[int, int, slice], object]


class Cancelled(Exception):  # noqa: N818 (it is no error)
    """The picture was given up because `cancelled()` said so."""


def render_scene(
    scene: Scene,
    stage: str = "diffuse",
    width: int = 320,
    height: int = 320,
    *,
    sampling: str = "corner",
    method: str = CERTIFIED,
    samples: int | str = 1,
    threads: int | None = None,
    out: np.ndarray | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> np.ndarray:
    """The picture of a scene at a stage: uint8 (height, width, 3), red, green, blue, the top row first.

    In a notebook it is shown as a picture (see `raytracer.notebook`).

    `samples` is how many rays a pixel has: 1, 4, 16, 64 or 256, or "adaptive", more of them only where neighbours
    differ (see `raytracer.samples`).

    `out` is an array of that shape to draw into. `progress(done, total, rows)` is called after each band of rows, with
    those that are finished, from the calling thread; `cancelled()` before each, from the threads that draw. Raises
    ValueError for a stage, size, sampling or method that there is not, `PictureTooLargeError` before anything is drawn,
    and `Cancelled`.
    """
    plan = make_plan(scene, stage, width, height, sampling, method)
    from raytracer.samples import draw_samples  # which draws by what is below

    picture = draw_samples(plan, samples, threads=threads, out=out, progress=progress, cancelled=cancelled)
    return picture.view(Picture) if out is None else picture


def draw(
    plan: Plan,
    *,
    threads: int | None = None,
    out: np.ndarray | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> np.ndarray:
    """`render_scene` for whoever has made the plan already."""
    shape = plan.raster.height, plan.raster.width, 3
    picture = np.empty(shape, plan.depth.kind) if out is None else fitting(out, shape, plan.depth.kind)
    canvas = make_canvas(picture) if plan.painter else None
    if plan.painter and canvas is None:
        picture[...] = draw(plan, threads=threads, progress=progress, cancelled=cancelled)
        return picture
    with open_tracer(plan, threads) as tracer:
        watch = Watch(threads, progress, cancelled, rounds=2 if plan.stage.needs_whole else 1)
        if canvas is not None:
            assert isinstance(tracer, Screen)
            if plan.stage.needs_whole:
                _paint_whole(plan, tracer, canvas, watch)
            else:
                _paint(Easel(plan, tracer, paints_of(plan, tracer), picture, canvas), watch)
        else:
            whole = whole_of(plan, tracer, watch)
            share_bands(
                tracer, plan, watch, lambda rows, worker: _draw_rows(plan, tracer, rows, worker, whole, picture)
            )
    return picture


@contextmanager
def open_tracer(plan: Plan, threads: int | None = None) -> Iterator[Eye | Screen]:
    """Who finds the hits of a picture, as long as the context lasts."""
    if plan.on_screen:
        with open_screen(plan.scene, plan.raster, plan.path, threads) as screen:
            yield screen
    else:
        yield plan.eye


@dataclass
class Watch:
    """Who is told how far a picture has come, and who is asked whether it is still wanted."""

    threads: int | None = None
    progress: Progress | None = None
    cancelled: Callable[[], bool] | None = None
    rounds: int = 1  # how often the picture's rows are gone through
    done: int = 0

    def check(self) -> None:
        """Raise `Cancelled` if it is not."""
        if self.cancelled is not None and self.cancelled():
            raise Cancelled

    def tell(self, bands: int, rows: slice, more: int = 1) -> None:
        """One more of so many bands is done, or some, and these rows of the picture."""
        self.done += more
        if self.progress is not None:
            self.progress(self.done, self.rounds * bands, rows)


def share_bands(tracer: Eye | Screen, plan: Plan, watch: Watch, work: Callable[[slice, int], slice]) -> None:
    """Do the work for all rows of the picture, a band at a time, on all threads.

    Work returns the rows of the picture that it has finished.
    """
    share_pieces(tracer.bands(plan.shading), watch, work)


def share_pieces(bands: list[slice], watch: Watch, work: Callable[[slice, int], slice]) -> None:
    """The same for any bands."""

    def one(rows: slice, worker: int) -> slice:
        watch.check()
        return work(rows, worker)

    share(bands, one, watch.threads, lambda rows: watch.tell(len(bands), rows))


def _paint(easel: Easel, watch: Watch) -> None:
    """A stage that a kernel paints; numpy paints the pixels that kernels were not certain of."""

    def paint(rows: slice, call: Call) -> slice:
        easel.paint(easel.screen.tiles_of(rows), call=call)
        return rows

    _paint_together(easel.plan, easel.screen, watch, paint, easel.finish)


def _paint_together(
    plan: Plan, screen: Screen, watch: Watch, work: Callable[[slice, Call], slice], finish: Callable[..., None]
) -> None:
    """Have all threads at work on the same rows, one piece of the picture after the other.

    Work returns the rows of the picture that it has finished, and calls kernels by what it is given. What it leaves to
    be decided, finish(*workers) decides.
    """
    moments, everyone = screen.moments(plan.shading), range(screen.threads)
    pieces, call = screen.pieces(moments), together(screen.workers(moments))
    count = len(pieces) if watch.rounds == 1 else len(screen.bands(plan.shading))  # as in the other round
    for k, rows in enumerate(pieces):
        watch.check()
        done = work(rows, call)
        if len(pieces) > 1 and screen.is_crowded:
            finish(*everyone)
        watch.tell(count, done, count * (k + 1) // len(pieces) - count * k // len(pieces))
    finish(*everyone)


def _hunt(plan: Plan, screen: Screen, watch: Watch, hits: Hits, kind: str) -> None:
    """Find the hits of a whole picture, as `Screen.hunt` says."""
    hunt = screen.hunt(hits, kind)

    def find(rows: slice, call: Call) -> slice:
        hunt.find(rows, call=call)
        return slice(rows.start, rows.start)

    _paint_together(plan, screen, watch, find, hunt.decide)
    hunt.polish()


@dataclass
class Easel:
    """A picture, or some rows of it, while a kernel paints it."""

    plan: Plan
    screen: Screen
    paints: Paints | FullPaints
    picture: np.ndarray  # uint8 (rows, width, 3)
    canvas: Canvas  # its bytes

    def paint(self, tiles: Tiles, worker: int = 0, call: Call = alone) -> None:
        """Paint what is left of some tiles, as `Screen.paint` does; `finish` does the rest."""
        for doubtful in self.screen.paint(self.plan.painter, tiles, self.paints, self.canvas, worker, call):
            self._decide(doubtful, worker)

    def finish(self, *workers: int) -> None:
        """Paint what these workers have found doubtful."""
        for doubtful in self.screen.doubtful(*workers):
            self._decide(doubtful, workers[0])

    def _decide(self, doubtful: Pixels, worker: int) -> None:
        hits, places = doubtful.hits(), (doubtful.ys - self.canvas.first_row, doubtful.xs)
        plan, found = self.plan, self.screen.in_scene(hits)
        if kernel := plan.stage.colours_of:
            self.picture[places] = self.paints.background
            some = hits.index >= 0
            pixels = doubtful._replace(xs=doubtful.xs[some], ys=doubtful.ys[some])
            colours = self.screen.colours(kernel, pixels, Hits(hits.t[some], hits.index[some]), self.paints, worker)
            self.picture[places[0][some], places[1][some]] = to_byte(colours)
            return
        block = Block(plan.scene, plan.raster, doubtful.ys, found, plan.lights, doubtful.xs)
        self.picture[places] = colours_of(plan, block)


def paints_of(plan: Plan, screen: Screen) -> Paints | FullPaints:
    """What a stage is painted with."""
    return make_full_paints(plan, screen) if plan.stage.throws_on else make_paints(plan, screen)


@np.errstate(all="ignore")
def _paint_whole(plan: Plan, screen: Screen, canvas: Canvas, watch: Watch) -> None:
    """A stage that a kernel paints from the hits of the whole picture."""
    width, shape, has_t = plan.raster.width, (plan.raster.height, plan.raster.width), plan.stage.needs_range
    paints, hits = make_paints(plan, screen), screen.room_for_hits(has_t)
    t, index = hits.t[:-SPARE].reshape(shape if has_t else 0), hits.index[:-SPARE].reshape(shape)

    def paint(rows: slice, worker: int) -> slice:
        painter(*hits, near, far, rows.start, rows.stop, width, screen.desks, worker, paints, canvas)
        return rows

    _hunt(plan, screen, watch, Hits(t, index), "rough" if has_t else "shapes")
    if screen.unit:
        np.ldexp(t, screen.unit, out=t)  # in the scene's own unit some may be too small or too large for a float64
    painter = getattr(plan.path, plan.painter)
    near, far = plan.reach or (screen.range_of(t, index) if has_t else (0.0, 0.0))
    share_bands(screen, plan, watch, paint)


def _draw_rows(
    plan: Plan, tracer: Eye | Screen, rows: slice, worker: int, whole: Whole | None, picture: np.ndarray
) -> slice:
    picture[rows] = colours_of(plan, block_of(plan, tracer, rows, worker, whole))
    return rows


@np.errstate(all="ignore")
def colours_of(plan: Plan, block: Block) -> np.ndarray:
    """The stage's colours of a block, as they are written."""
    return plan.depth.write(plan.stage.colours(block))


def block_of(plan: Plan, tracer: Eye | Screen, rows: slice, worker: int = 0, whole: Whole | None = None) -> Block:
    """What the stage has to know of some rows."""
    stage, truth, hits = plan.stage, None, _no_hits(rows, plan.raster.width)
    if whole is not None and whole.hits is not None:
        hits = Hits(whole.hits.t[rows], whole.hits.index[rows])
    elif stage.needs_hits:
        hits = tracer.hits(rows, worker, polished=stage.needs_truth)
    if stage.needs_truth:
        truth = hits if plan.method == CERTIFIED else plan.truth.hits(rows, polished=True)
    tests = None if whole is None or whole.tests is None else whole.tests[rows]
    return Block(plan.scene, plan.raster, rows, hits, plan.lights, None, whole, truth, tests)


def whole_of(plan: Plan, tracer: Eye | Screen, watch: Watch | None = None) -> Whole | None:
    """What a stage wants to know of the whole picture before it draws the first pixel."""
    if plan.stage.needs_tests:
        return Whole(None, count_tests(plan.eye.boxes, plan.raster))
    return Whole(hits_of(plan, tracer, watch), reach=plan.reach) if plan.stage.needs_whole else None


def hits_of(
    plan: Plan, tracer: Eye | Screen, watch: Watch | None = None, polished: bool = False, out: Hits | None = None
) -> Hits:
    """The hits of the whole picture."""
    hits = _no_hits(slice(0, plan.raster.height), plan.raster.width) if out is None else out

    def trace(rows: slice, worker: int) -> slice:
        hits.t[rows], hits.index[rows] = tracer.hits(rows, worker, polished)
        return slice(rows.start, rows.start)

    if not isinstance(tracer, Screen):
        share_bands(tracer, plan, watch or Watch(), trace)
        return hits
    _hunt(plan, tracer, watch or Watch(), hits, "fine" if polished else "rough")
    found = tracer.in_scene(hits)
    if out is None:
        return found
    for array, new in zip(out, found, strict=True):
        if new is not array:
            array[...] = new
    return out


def eye_hits(
    scene: Scene,
    width: int = 320,
    height: int = 320,
    *,
    sampling: str = "corner",
    method: str | Method = CERTIFIED,
    threads: int | None = None,
    out: Hits | None = None,
) -> Hits:
    """What each pixel's eye ray hits first: t (float64, +inf for a miss) and index (int32, −1), both (height, width).

    index is the shape's place among all shapes of the file; `scene.shape(index)` is the shape. t counts multiples of
    the ray's direction, which is not normalised.

    `out` are such hits, of arrays that share nothing, one row behind the other, to be written into. ValueError for
    those that are not, and for a size, sampling or method that there is not, `PictureTooLargeError` before a ray is
    shot.
    """
    plan = make_plan(scene, "hit", width, height, sampling, method)
    room = None if out is None else _room_in(out, (height, width))
    with open_tracer(plan, threads) as tracer:
        hits = hits_of(plan, tracer, Watch(threads), polished=True, out=room)
    return hits if out is None else out


def _room_in(out: Hits, shape: tuple[int, int]) -> Hits:
    """The arrays that hits are written into."""
    if not isinstance(out, Hits):
        raise ValueError(f"out: found {type(out).__name__}, expected Hits")
    for name, array, kind in zip(Hits._fields, out, (np.float64, np.int32), strict=True):
        fitting(array, shape, kind, f"out.{name}")
        if not array.flags.c_contiguous:
            raise ValueError(f"out.{name}: found rows that lie apart, expected one behind the other")
    if np.may_share_memory(*out):
        raise ValueError("out: found arrays that share memory, expected two")
    return Hits(*map(np.asarray, out))  # of a matrix, rows are matrices


def undecided(scene: Scene, width: int, height: int, sampling: str = "corner") -> np.ndarray:
    """Which pixels' eye rays float64 cannot tell a hit or a shape of, such as tangent ones: bool (height, width).

    There a tracer may be right and draw another picture than ours, which is exact. ValueError as for `eye_hits`.
    """
    return make_plan(scene, "hit", width, height, sampling).eye.doubtful(slice(0, height))


def warm_up(scene: Scene, stage: str, method: str = CERTIFIED) -> bool:
    """Have the kernels ready that a picture needs, machine code and all; False if there is no compiler.

    To make machine code takes seconds, once. The backend does not learn of the kernels from this, and draws without
    them in the meantime.
    """
    kernels = backend.import_kernels()
    if kernels is not None:
        for each in (scene, _twins(scene.camera)):
            draw(make_plan(each, stage, 16, 16, method=method, path=kernels))
    return kernels is not None


def _twins(camera: Camera) -> Scene:
    """A scene that takes all levels of certainty: two equal spheres, and the eye within both."""
    spheres = Spheres(np.ones(2), np.array([camera.eye] * 2), np.zeros(2, np.int32), np.arange(2, dtype=np.int32))
    return Scene(camera, lights=(Light(camera.eye, (1.0, 1.0, 1.0)),), materials=_GREY, spheres=spheres)


def _no_hits(rows: slice, width: int) -> Hits:
    shape = (rows.stop - rows.start, width)
    size = shape[0] * shape[1]
    return Hits(aligned(size, np.float64).reshape(shape), aligned(size, np.int32).reshape(shape))


def fitting(out: np.ndarray, shape: tuple[int, ...], kind: type = np.uint8, name: str = "out") -> np.ndarray:
    if not isinstance(out, np.ndarray) or out.shape != shape or out.dtype != kind:
        found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise ValueError(f"{name}: found {found}, expected {np.dtype(kind)} {shape}")
    if not out.flags.writeable:
        raise ValueError(f"{name}: found an array that is read-only, expected one to write into")
    return out
