"""Eye rays, sphere by sphere: the numpy path of `certified`, and every usual method.

What `certified` does once the compiler is there is another thing: see `raytracer.screen`.
"""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

import numpy as np

from raytracer import backend, plain
from raytracer.arrays import Balls, Candidates, Facets, First, Grid, Hits, Seen
from raytracer.boxes import Lens, facet_boxes, make_lens
from raytracer.camera import Raster, eye_grid, factors_of, fine_columns, fine_rows, rows_of, spread, squares
from raytracer.certified import LARGEST_SPREAD, fine_direction, refine
from raytracer.facets import see_facets
from raytracer.methods import CERTIFIED, Method
from raytracer.plain import candidates_of, xyz
from raytracer.scene import Scene
from raytracer.settle import Bundle, Index, Targets, in_twofold, known_in_integers, polish, settle
from raytracer.usual import balls, usual_rows

# A NaN or an infinity makes a decision uncertain, and the next level takes it.
_NOT_A_NUMBER_IS_NO_ERROR = np.errstate(all="ignore")


class Eye(NamedTuple):
    """All that the rays of one picture share."""

    raster: Raster
    unit: int  # lengths below are counted in 2**unit of the scene's
    origin: np.ndarray  # (3,)
    order: np.ndarray  # int32 (s + n,), the places in the file of the shapes in view: spheres, then triangles
    all_shapes: bool  # whether these are all shapes of the file, in its order
    targets: Targets  # the shapes in view
    grid: Grid
    seen: Seen  # the spheres
    facets: Facets  # the triangles
    boxes: np.ndarray  # int32 (s + n, 4), see `plain.bound`
    method: str | Method  # a row of METHODS, by name, or one that is in no table
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
            hits = usual_rows(self.method, self.raster, self.balls, self.boxes[: self.spheres], rows, self.path)
            self._add_facets(hits, rows)
            return Hits(hits.t, self._places(hits.index))
        first = self._first(rows)
        t = first.k / squares(rows_of(self.grid, rows))
        hits = Hits(np.where(first.index >= 0, t, np.inf), first.index)  # inf / inf is no number
        settle(hits, first.unsure, self._pixels_of(rows), self.targets)
        if polished:
            sure = (hits.index >= 0) & ~first.unsure
            left = self._refine(hits, rows, sure & (hits.index < self.spheres))
            polish(hits, np.nonzero(left | (sure & (hits.index >= self.spheres))), self._pixels_of(rows), self.targets)
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

    @_NOT_A_NUMBER_IS_NO_ERROR
    def doubtful(self, rows: slice) -> np.ndarray:
        """Which pixels of these rows float64 is not certain of: bool (rows, width)."""
        return self._first(rows).unsure

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
        plain.first_of_grid(self.grid, self.seen, self.boxes[: self.spheres], rows, first)
        plain.first_facets_of_grid(self.grid, self.facets, self.boxes[self.spheres :], rows, first, self.spheres)
        return first

    def _add_facets(self, hits: Hits, rows: slice) -> None:
        """The triangles for a usual method, which is one for spheres: float64, nothing checked."""
        first = First.nothing_yet(hits.t.shape)
        squares_, boxes = squares(rows_of(self.grid, rows)), self.boxes[self.spheres :]
        first.k[...] = np.ldexp(hits.t, -self.unit) * squares_
        plain.first_facets_of_grid(self.grid, self.facets, boxes, rows, first, self.spheres)
        wins = first.index >= 0
        hits.t[wins], hits.index[wins] = np.ldexp(first.k[wins] / squares_[wins], self.unit), first.index[wins]

    @property
    def spheres(self) -> int:
        """How many spheres are in view."""
        return len(self.targets.balls)

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


def bundle_of(raster: Raster, origin: np.ndarray, xs: np.ndarray, ys: np.ndarray, path: ModuleType = plain) -> Bundle:
    """The rays of single pixels, columns xs and rows ys."""
    origins = np.repeat(origin[None], len(xs), axis=0)
    rays = path.fine_rays(*factors_of(raster, xs, ys))
    return Bundle(origins, rays, lambda k: raster.whole_direction(int(xs[k]), int(ys[k])), True)


@_NOT_A_NUMBER_IS_NO_ERROR
def open_eye(scene: Scene, raster: Raster, method: str | Method = CERTIFIED, path: ModuleType | None = None) -> Eye:
    """Everything about the picture's spheres that does not depend on the pixel; those out of view are left out.

    `path` traces; by default it is chosen.
    """
    spheres, grid, lens = scene.spheres, eye_grid(raster), make_lens(raster)
    unit, origin, everything, corners = scene.in_units
    everything = everything[: len(spheres)]
    boxes, front = plain.bound(lens, origin, everything)
    in_view = _not_empty(boxes)
    kappa, seen_balls = usable_spread(raster), everything[in_view]
    facets, facets_boxes, kept = _facets(grid, lens, kappa, origin, corners)
    order, boxes = (
        np.concatenate(parts)
        for parts in ((spheres.order[in_view], scene.triangles.order[kept]), (boxes[in_view], facets_boxes))
    )
    known = None
    if method != CERTIFIED:  # a usual method is given the scene's own numbers
        known = balls(method, spheres.centres[in_view], spheres.radii[in_view])
    left, right, top, bottom = boxes.astype(np.int64).T
    tests = int(((right - left) * (bottom - top)).sum())
    seen = plain.see(grid, kappa, origin, seen_balls, front[in_view])
    seen, sides = known_in_integers(origin, seen_balls, seen)
    chosen = path or backend.choose(tests, len(raster.bands()) * len(boxes))
    targets = Targets(seen_balls, sides, chosen, corners[kept], order)
    in_order = len(order) == len(scene) and not (len(spheres) and len(corners))
    return Eye(
        raster, unit, origin, order, in_order, targets, grid, seen, facets, boxes, method, known, tests
    )  # fmt: skip


def _facets(
    grid: Grid, lens: Lens, kappa: float, origin: np.ndarray, corners: np.ndarray
) -> tuple[Facets, np.ndarray, np.ndarray]:
    """The triangles in view, their boxes, and which they are: int (n,)."""
    boxes = facet_boxes(lens, corners - origin)
    kept = np.flatnonzero(_not_empty(boxes))
    facets = see_facets(grid, kappa, origin, corners[kept])
    kept, facets = kept[facets.faces], Facets._make(array[facets.faces] for array in facets)
    return facets, boxes[kept], kept


def _not_empty(boxes: np.ndarray) -> np.ndarray:
    return (boxes[:, 1] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 2])


def usable_spread(raster: Raster) -> float:
    """κ, or 0 where it is not known or too large for `approach`."""
    kappa = spread(raster)
    return kappa if kappa <= LARGEST_SPREAD else 0.0


def count_tests(boxes: np.ndarray, raster: Raster) -> np.ndarray:
    """In how many boxes (s, 4) each pixel lies: int32 (height, width)."""
    left, right, top, bottom = boxes[_not_empty(boxes)].T
    width, size = raster.width + 1, (raster.height + 1) * (raster.width + 1)
    steps = np.zeros(size, np.int64)
    for row, column, step in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
        steps += step * np.bincount(row.astype(np.int64) * width + column, minlength=size)
    return steps.reshape(-1, width).cumsum(axis=0).cumsum(axis=1).astype(np.int32)[:-1, :-1]
