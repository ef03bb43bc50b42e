"""Eye rays, sphere by sphere: the numpy path of `certified`, and every usual method.

What `certified` does once the compiler is there is another thing: see `raytracer.screen`.
"""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

import numpy as np

from raytracer import backend, plain
from raytracer.arrays import Balls, Candidates, First, Grid, Hits, Seen
from raytracer.boxes import make_lens
from raytracer.camera import Raster, eye_grid, fine_columns, fine_rows, rows_of, spread, squares, twofold_eye_rays
from raytracer.certified import LARGEST_SPREAD, fine_direction, refine
from raytracer.methods import CERTIFIED
from raytracer.plain import candidates_of, xyz
from raytracer.scene import Scene
from raytracer.settle import Bundle, Index, Targets, in_twofold, known_in_integers, polish, settle
from raytracer.units import sphere_units
from raytracer.usual import balls, usual_rows

# A NaN or an infinity makes a decision uncertain, and the next level takes it.
_NOT_A_NUMBER_IS_NO_ERROR = np.errstate(all="ignore")


class Eye(NamedTuple):
    """All that the rays of one picture share."""

    raster: Raster
    unit: int  # lengths below are counted in 2**unit of the scene's
    origin: np.ndarray  # (3,)
    order: np.ndarray  # int32 (s,), the places in the file of the spheres in view
    all_shapes: bool  # whether these are all shapes of the file
    targets: Targets  # the spheres in view
    grid: Grid
    seen: Seen
    boxes: np.ndarray  # int32 (s, 4), see `plain.bound`
    method: str  # a row of METHODS
    balls: Balls | None  # the spheres in view as that method sees them, if it is a usual one
    tests: int  # how many times a ray is tested against a sphere, in float64

    def bands(self, shading: float = 0.0) -> list[slice]:
        """The picture's rows, cut into pieces that are drawn one at a time, each in a moment."""
        return self.raster.bands(self.tests / (self.raster.width * self.raster.height) + shading)

    @property
    def path(self) -> ModuleType:
        return self.targets.path

    @_NOT_A_NUMBER_IS_NO_ERROR
    def hits(self, rows: slice, worker: int = 0, polished: bool = False) -> Hits:
        """What the rays of these rows of the picture hit first: t good enough to be shaded, or to the last digit."""
        if self.balls is not None:
            t, index = usual_rows(self.method, self.raster, self.balls, self.boxes, rows, self.path)
            return Hits(t, self._places(index))
        first = self._first(rows)
        hits = Hits(first.k / squares(rows_of(self.grid, rows)), first.index)
        settle(hits, first.unsure, self._pixels_of(rows), self.targets)
        if polished:
            left = self._refine(hits, rows, (hits.index >= 0) & ~first.unsure)
            polish(hits, np.nonzero(left), self._pixels_of(rows), self.targets)
        return Hits(np.ldexp(hits.t, self.unit) if self.unit else hits.t, self._places(hits.index))

    @_NOT_A_NUMBER_IS_NO_ERROR
    def level(self, x: int, y: int) -> str:
        """What it takes to be certain of a pixel: float64, two-fold float64 or integers."""
        row, pixel = slice(y, y + 1), (np.array([0]), np.array([x]))
        if not self._first(row).unsure[0, x]:
            return "float64"
        source = self._pixels_of(row)
        found = in_twofold(source.bundle(pixel), source.candidates(pixel), self.targets)
        return "integers" if found.unsure[0] else "two-fold float64"

    def _refine(self, hits: Hits, rows: slice, which: np.ndarray) -> np.ndarray:
        """Bring the t of these hits to the last digit, and return those of which that is not certain."""
        ys, xs = which.nonzero()
        ys += rows.start
        across, low = fine_columns(self.raster)
        components = zip(self.grid.u, fine_rows(self.raster), strict=True)
        x, y, z = (fine_direction(across[xs], low[xs], u, rest[ys], rest_low[ys]) for u, (rest, rest_low) in components)
        balls = self.targets.balls[hits.index[which]]
        t, sure = refine(hits.t[which], x, y, z, *xyz(self.origin), *xyz(balls), balls[:, 3])
        hits.t[which] = np.where(sure, t, hits.t[which])
        left = which.copy()
        left[which] = ~sure
        return left

    def _first(self, rows: slice) -> First:
        """What float64 makes of these rows."""
        first = First.nothing_yet((rows.stop - rows.start, self.raster.width))
        plain.first_of_grid(self.grid, self.seen, self.boxes, rows, first)
        return first

    def _pixels_of(self, rows: slice) -> PixelsOf:
        return PixelsOf(self.raster, self.origin, self.boxes, rows.start)

    def _places(self, index: np.ndarray) -> np.ndarray:
        """Places in the file in place of numbers of spheres in view."""
        if self.all_shapes:
            return index
        return np.where(index >= 0, self.order[index], np.int32(-1)) if len(self.order) else index


class PixelsOf(NamedTuple):
    """The rays of pixels of some rows, as the levels above float64 want them."""

    raster: Raster
    origin: np.ndarray
    boxes: np.ndarray
    first_row: int

    def bundle(self, which: Index) -> Bundle:
        return bundle_of(self.raster, self.origin, which[1], which[0] + self.first_row)

    def candidates(self, which: Index) -> Candidates:
        return candidates_of(self.boxes, which[1], which[0] + self.first_row)


def bundle_of(raster: Raster, origin: np.ndarray, xs: np.ndarray, ys: np.ndarray) -> Bundle:
    """The rays of single pixels, columns xs and rows ys."""
    origins = np.repeat(origin[None], len(xs), axis=0)
    rays = twofold_eye_rays(raster, xs, ys)
    return Bundle(origins, rays, lambda k: raster.whole_direction(int(xs[k]), int(ys[k])))


@_NOT_A_NUMBER_IS_NO_ERROR
def open_eye(scene: Scene, raster: Raster, method: str = CERTIFIED, path: ModuleType | None = None) -> Eye:
    """Everything about the picture's spheres that does not depend on the pixel; those out of view are left out.

    `path` traces; by default it is chosen.
    """
    spheres, grid, lens = scene.spheres, eye_grid(raster), make_lens(raster)
    unit, origin, everything = sphere_units(scene.camera.eye, spheres)
    everything = everything[: len(spheres)]
    boxes, front = plain.bound(lens, origin, everything)
    in_view = (boxes[:, 1] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 2])
    order, boxes, seen_balls = spheres.order[in_view], boxes[in_view], everything[in_view]
    known = None
    if method != CERTIFIED:  # a usual method is given the scene's own numbers
        known = balls(method, spheres.centres[in_view], spheres.radii[in_view])
    left, right, top, bottom = boxes.astype(np.int64).T
    tests = int(((right - left) * (bottom - top)).sum())
    seen = plain.see(grid, usable_spread(raster), origin, seen_balls, front[in_view])
    seen, sides = known_in_integers(origin, seen_balls, seen)
    targets = Targets(seen_balls, sides, path or backend.choose(tests, len(raster.bands()) * len(boxes)))
    return Eye(
        raster, unit, origin, order, len(order) == len(scene), targets, grid, seen, boxes, method, known, tests
    )  # fmt: skip


def usable_spread(raster: Raster) -> float:
    """κ, or 0 where it is not known or too large for `approach`."""
    kappa = spread(raster)
    return kappa if kappa <= LARGEST_SPREAD else 0.0


def count_tests(boxes: np.ndarray, raster: Raster) -> np.ndarray:
    """In how many boxes (s, 4) each pixel lies: int32 (height, width)."""
    left, right, top, bottom = boxes[(boxes[:, 0] < boxes[:, 1]) & (boxes[:, 2] < boxes[:, 3])].T
    width, size = raster.width + 1, (raster.height + 1) * (raster.width + 1)
    steps = np.zeros(size, np.int64)
    for row, column, step in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
        steps += step * np.bincount(row.astype(np.int64) * width + column, minlength=size)
    return steps.reshape(-1, width).cumsum(axis=0).cumsum(axis=1).astype(np.int32)[:-1, :-1]
