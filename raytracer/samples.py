"""More than one sample a pixel: everywhere, or only where it matters.

With n × n samples the picture is drawn n times as wide and as high, and each n × n block of its pixels becomes their
mean: the mean of what is drawn, bytes that is, so that a highlight far above white does not outshine its neighbours.
A block's rays fill its pixel's area from the corner, or evenly about the centre, as `sampling` says of the single one.

`adaptive` draws one sample a pixel, looks where neighbours differ, be it for another shape, a shadow's border or a
highlight, and paints only those pixels of the large picture. That is never there as a whole: a strip of it at a time, a
tile high.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import isqrt

import numpy as np

from raytracer.arrays import FullPaints, Hits, Paints
from raytracer.camera import BAND_PIXELS
from raytracer.eye import Eye
from raytracer.image import Depth, check_fits_memory
from raytracer.plan import Plan
from raytracer.render import (
    Easel,
    Progress,
    Watch,
    colours_of,
    draw,
    fitting,
    open_tracer,
    paints_of,
    share_pieces,
)
from raytracer.screen import ALL, Screen, make_canvas
from raytracer.stages import Block, Stage

ADAPTIVE = "adaptive"
SAMPLES = (1, 4, 16, 64, 256, ADAPTIVE)
SIDE = 8  # of the block of samples of a pixel, where `adaptive` takes more than one
DIFFERS = 16  # of 255 by which neighbours differ that are looked at more closely
_TILE_WIDTH, _TILE_HEIGHT = 128, 32  # pixels of the large picture
_PAINTED = 32  # pixels that a kernel paints in the memory of one that numpy is at work on

Samples = int | str


def takes_samples(stage: Stage) -> bool:
    """Whether a stage may have more than one sample a pixel; those that are about single pixels may not."""
    return not (stage.needs_whole or stage.needs_truth or stage.needs_tests)


def check_samples(samples: Samples, plan: Plan) -> None:
    """ValueError for a number of samples that there is not, or a stage that has but one."""
    if samples not in SAMPLES:
        raise ValueError(f"found {samples!r} samples, expected one of {', '.join(map(str, SAMPLES))}")
    if samples != 1 and not takes_samples(plan.stage):
        raise ValueError(f"found {samples} samples, expected 1: stage {plan.name} is about single pixels")


def draw_samples(
    plan: Plan,
    samples: Samples,
    *,
    threads: int | None = None,
    out: np.ndarray | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> np.ndarray:
    """`draw` with so many samples a pixel, a row of `SAMPLES`."""
    check_samples(samples, plan)
    if samples == 1:
        return draw(plan, threads=threads, out=out, progress=progress, cancelled=cancelled)
    raster, side = plan.raster, SIDE if samples == ADAPTIVE else isqrt(int(samples))
    size = raster.height, raster.width, 3
    fine = replace(plan, raster=raster.finer(side))
    strip = min(_TILE_HEIGHT, fine.raster.height) * fine.raster.width
    check_fits_memory(raster.width, raster.height, max(strip // _PAINTED if fine.painter else strip, BAND_PIXELS))
    if samples == ADAPTIVE:
        picture = draw(plan, threads=threads, out=out, cancelled=cancelled)
        wanted = differing(picture, plan.depth)
    else:
        picture = np.empty(size, plan.depth.kind) if out is None else fitting(out, size, plan.depth.kind)
        wanted = np.ones(size[:2], bool)
    _draw_means(fine, side, wanted, picture, Watch(threads, progress, cancelled))
    return picture


def _draw_means(fine: Plan, side: int, wanted: np.ndarray, picture: np.ndarray, watch: Watch) -> None:
    """Draw the large picture, a strip at a time, and put the means of its blocks where they are wanted."""
    height = _TILE_HEIGHT // side
    strips = [slice(row, min(row + height, len(wanted))) for row in range(0, len(wanted), height)]
    with open_tracer(fine, watch.threads) as tracer:
        paints = paints_of(fine, tracer) if fine.painter and isinstance(tracer, Screen) else None

        def one(rows: slice, worker: int) -> slice:
            if wanted[rows].any():
                _draw_strip(fine, tracer, paints, rows, side, wanted[rows], picture[rows], worker)
            return rows

        share_pieces(strips, watch, one)


def differing(picture: np.ndarray, depth: Depth = Depth.BYTE) -> np.ndarray:
    """Which pixels of a picture (height, width, 3) differ visibly from one of their eight neighbours: bool."""
    height, width, _ = picture.shape
    around = np.pad(picture, ((1, 1), (1, 1), (0, 0)), "edge")
    low, high = picture, picture
    for y in range(3):
        for x in range(3):
            shifted = around[y : y + height, x : x + width]
            low, high = np.minimum(low, shifted), np.maximum(high, shifted)
    return np.asarray((high - low > DIFFERS * depth.white // 255).any(axis=2))


def _draw_strip(
    fine: Plan, tracer: Eye | Screen, paints: Paints | FullPaints | None, rows: slice, side: int, wanted: np.ndarray,
    picture: np.ndarray, worker: int,
) -> None:  # fmt: skip
    """Draw what is wanted of some rows, bool (rows, width), into those of the picture."""
    large_rows = slice(rows.start * side, rows.stop * side)
    if paints is None or isinstance(tracer, Eye):
        hits, (ys, xs) = tracer.hits(large_rows, worker), np.nonzero(wanted)
        for few in np.array_split(np.arange(len(ys)), -(-len(ys) * side * side // BAND_PIXELS)):
            picture[ys[few], xs[few]] = _means(fine, large_rows, hits, side, ys[few], xs[few])
        return
    kernels = tracer.kernels
    assert (kernels.TILE_WIDTH, kernels.TILE_HEIGHT) == (_TILE_WIDTH, _TILE_HEIGHT)
    large = np.empty((large_rows.stop - large_rows.start, fine.raster.width, 3), np.uint8)
    eights = _any_of(wanted.repeat(side, axis=1), 8)
    some = ALL if wanted.all() else eights.repeat(side, axis=0).astype(np.uint8)
    canvas = make_canvas(large, large_rows.start, some)
    assert canvas is not None
    easel = Easel(fine, tracer, paints, large, canvas)
    for run in _runs(np.asarray(_any_of(eights, _TILE_WIDTH // 8).any(axis=0))):
        easel.paint(tracer.tiles_of(large_rows, run), worker)
    easel.finish(worker)
    kernels.mean_of_blocks(large, side, wanted, picture)


def _any_of(flags: np.ndarray, columns: int) -> np.ndarray:
    """Whether any of so many columns side by side is set: bool (rows, columns // that, rounded up)."""
    padded = np.pad(flags, ((0, 0), (0, -flags.shape[1] % columns)))
    return np.asarray(padded.reshape(len(flags), -1, columns).any(axis=2))


def _runs(wanted: np.ndarray) -> Iterator[slice]:
    """Where tiles are wanted one after the other."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], wanted, [False]])))
    yield from map(slice, ends[::2].tolist(), ends[1::2].tolist())


def _means(fine: Plan, rows: slice, hits: Hits, side: int, ys: np.ndarray, xs: np.ndarray) -> np.ndarray:
    """The means of the blocks of some pixels of these rows, no others being worked out: (n, 3)."""
    steps, shape = np.arange(side), (len(ys), side, side)
    y = np.broadcast_to((ys[:, None] * side + steps)[:, :, None], shape).reshape(-1)
    x = np.broadcast_to((xs[:, None] * side + steps)[:, None, :], shape).reshape(-1)
    block = Block(fine.scene, fine.raster, rows.start + y, Hits(hits.t[y, x], hits.index[y, x]), fine.lights, x)
    total = colours_of(fine, block).reshape(len(ys), -1, 3).sum(axis=1, dtype=np.uint32)
    means: np.ndarray = ((total + side * side // 2) // (side * side)).astype(fine.depth.kind)
    return means
