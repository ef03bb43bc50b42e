"""The pipeline: a plan, hits, stage colours, bytes; one band of rows after the other, on as many threads as there are.

from raytracer import interpreter, render_scene
picture = render_scene(interpreter("scenes/01_one_sphere.cli"), stage="diffuse")
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed

import numpy as np

from raytracer.arrays import Hits
from raytracer.camera import Raster, make_raster
from raytracer.image import to_bytes
from raytracer.methods import CERTIFIED, check_method
from raytracer.plan import Plan, make_plan
from raytracer.scene import Scene
from raytracer.stages import Block, Whole
from raytracer.trace import open_eye, polished_rows, trace_rows

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
    threads: int | None = None,
    out: np.ndarray | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> np.ndarray:
    """The picture of a scene at a stage: uint8 (height, width, 3), red, green, blue, the top row first.

    `out` is an array of that shape to draw into. `progress(done, total, rows)` is called after each band of rows, with
    those that are finished, from the calling thread; `cancelled()` before each, from the threads that draw. Raises
    ValueError for a stage, size, sampling or method that there is not, `PictureTooLargeError` before anything is drawn,
    and `Cancelled`.
    """
    plan = make_plan(scene, stage, width, height, sampling, method)
    return draw(plan, threads=threads, out=out, progress=progress, cancelled=cancelled)


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
    picture = np.empty(shape, np.uint8) if out is None else _fitting(out, shape)
    whole = trace_whole(plan, threads, progress, cancelled) if plan.stage.needs_whole else None

    def draw_band(rows: slice) -> slice:
        picture[rows] = to_bytes(draw_rows(plan, rows, whole))
        return rows

    _each_band(plan.bands, draw_band, threads, progress, cancelled, done=len(plan.bands) if whole else 0)
    return picture


def draw_rows(plan: Plan, rows: slice, whole: Whole | None) -> np.ndarray:
    """The stage's colours for some rows, neither clipped nor rounded: float64 (rows, width, 3)."""
    truth = None
    if whole is not None:
        hits = Hits(whole.hits.t[rows], whole.hits.index[rows])
    elif plan.truth is not None:
        hits, truth = polished_rows(plan.eye, rows), polished_rows(plan.truth, rows)
    else:
        hits = trace_rows(plan.eye, rows)
    with np.errstate(all="ignore"):
        return plan.stage.colours(Block(plan.scene, plan.raster, rows, hits, plan.lights, whole, truth))


def trace_whole(
    plan: Plan,
    threads: int | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Whole:
    """The hits of the whole picture, for a stage that wants them before it draws the first pixel: half of its work."""
    hits = _empty_hits(plan.raster)

    def trace(rows: slice) -> slice:
        hits.t[rows], hits.index[rows] = trace_rows(plan.eye, rows)
        return slice(rows.start, rows.start)

    _each_band(plan.bands, trace, threads, progress, cancelled, ahead=len(plan.bands))
    return Whole(hits)


def eye_hits(
    scene: Scene,
    width: int = 320,
    height: int = 320,
    *,
    sampling: str = "corner",
    method: str = CERTIFIED,
    threads: int | None = None,
) -> Hits:
    """What each pixel's eye ray hits first: t (float64, +inf for a miss) and index (int32, −1), both (height, width).

    index is the shape's place among all shapes of the file; `scene.shape(index)` is the shape. t counts multiples of
    the ray's direction, which is not normalised.
    """
    raster = make_raster(scene.camera, width, height, sampling)
    check_method(method)
    eye, hits = open_eye(scene, raster, method), _empty_hits(raster)

    def trace(rows: slice) -> slice:
        hits.t[rows], hits.index[rows] = polished_rows(eye, rows)
        return rows

    _each_band(raster.bands(eye.tests / (raster.width * raster.height)), trace, threads, None, None)
    return hits


def _each_band(
    bands: list[slice],
    work: Callable[[slice], slice],
    threads: int | None,
    progress: Progress | None,
    cancelled: Callable[[], bool] | None,
    done: int = 0,
    ahead: int = 0,
) -> None:
    """Do the work for all bands, on a pool of threads; the first exception ends it.

    Work returns the rows of the picture that it has finished. `done` and `ahead` count bands of other work.
    """

    def one(rows: slice) -> slice:
        if cancelled is not None and cancelled():
            raise Cancelled
        return work(rows)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        try:
            for count, future in enumerate(as_completed([pool.submit(one, rows) for rows in bands]), done + 1):
                rows = future.result()
                if progress is not None:
                    progress(count, done + len(bands) + ahead, rows)
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _empty_hits(raster: Raster) -> Hits:
    shape = (raster.height, raster.width)
    return Hits(np.empty(shape), np.empty(shape, np.int32))


def _fitting(out: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if not isinstance(out, np.ndarray) or out.shape != shape or out.dtype != np.uint8:
        found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise ValueError(f"out: found {found}, expected uint8 {shape}")
    return out
