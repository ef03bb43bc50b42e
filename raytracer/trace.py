"""What rays given by the caller hit first, from anywhere in any direction."""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from raytracer import backend, exact, plain
from raytracer.arrays import Candidates, Hits, Nearest, Sides, Tree
from raytracer.camera import given_rays, twofold_given_rays
from raytracer.facets import nearest_facets
from raytracer.methods import CERTIFIED, Method, row_of
from raytracer.pool import share
from raytracer.settle import NO_CORNERS, Bundle, Index, Targets, polish, settle
from raytracer.units import in_units, unit_directions
from raytracer.usual import usual_given

_CHUNK = 1 << 14  # rays that are traced together: their arrays fit a core's cache
_FEW = 16  # spheres, up to which every ray is tested against every sphere

# A NaN or an infinity makes a decision uncertain, and the next level takes it.
_NOT_A_NUMBER_IS_NO_ERROR = np.errstate(all="ignore")


def ray_intersect_scene(
    origins: ArrayLike,
    directions: ArrayLike,
    centres: ArrayLike,
    radii: ArrayLike,
    method: str | Method = CERTIFIED,
    *,
    triangles: ArrayLike | None = None,
) -> Hits:
    """What each of n rays hits first of s spheres: `Hits` of shape (n,), `index` counting the spheres given.

    origins and directions are (n, 3), centres (s, 3), radii (s,), all finite, in one unit of length; directions need
    no normalising, t counts multiples of them. Which sphere is hit is what exact arithmetic says: only t > 0 counts, a
    tangent ray hits, from inside the far root is the hit, and of equal t the sphere that comes first wins. With another
    method of `METHODS`, it is what that method makes of it.

    triangles are corners (m, 3, 3), counted after the spheres. Their edges belong to them, and a ray in a triangle's
    plane does not hit it. They are the same for all methods, which are for spheres, but only certain for `certified`.

    A t beyond the range of float64 is +inf or 0, its index says that it is a hit all the same.

    ValueError: there is no such method, a direction is zero, a number is not finite, a radius is not positive, a
    triangle has no area, or the shapes do not fit.
    """
    origins, directions = _vectors("origins", origins), _vectors("directions", directions)
    centres, radii = _vectors("centres", centres), np.ascontiguousarray(radii, np.float64)
    corners = np.empty((0, 3, 3)) if triangles is None else np.ascontiguousarray(triangles, np.float64)
    _refuse_bad_rays(origins, directions, centres, radii)
    _refuse_bad_triangles(corners)
    row_of(method)
    path = backend.choose(len(origins) * len(radii), -(-len(origins) // _CHUNK) * len(radii))
    path = plain if isinstance(method, Method) else path
    return trace_given(origins, directions, centres, radii, method, path, corners)


@_NOT_A_NUMBER_IS_NO_ERROR
def trace_given(
    origins: np.ndarray,
    directions: np.ndarray,
    centres: np.ndarray,
    radii: np.ndarray,
    method: str | Method,
    path: ModuleType,
    corners: np.ndarray = NO_CORNERS,
) -> Hits:
    """`ray_intersect_scene` on a path of one's choice, of arrays that are known to be good."""
    if method != CERTIFIED:
        hits = usual_given(method, origins, directions, centres, radii, path)
        nearest = Nearest(hits.t, np.zeros(hits.t.shape), hits.index, np.zeros(hits.t.shape, bool))
        nearest_facets(origins, given_rays(directions), corners, nearest, len(radii))
        return hits
    unit, (origins, balls, corners) = in_units(origins, np.column_stack([centres, radii]), corners)
    exponents, directions = unit_directions(directions)
    order = np.arange(len(balls) + len(corners), dtype=np.int32)
    targets = Targets(balls, Sides.unknown(), path, corners, order)
    tree = _plant(balls, path) if path is not plain and len(balls) > _FEW else None
    hits = Hits(np.empty(len(origins)), np.empty(len(origins), np.int32))

    @_NOT_A_NUMBER_IS_NO_ERROR
    def trace(some: slice, worker: int) -> None:
        rays = GivenRays(origins[some], directions[some], targets, tree)
        hits.t[some], hits.index[some] = rays.hits()

    share([slice(start, start + _CHUNK) for start in range(0, len(origins), _CHUNK)], trace)
    return Hits(np.ldexp(hits.t, unit - exponents), hits.index)


def _plant(balls: np.ndarray, kernels: ModuleType) -> Tree:
    """The tree over spheres (s, 4)."""
    tree: Tree = kernels.build(balls, np.argsort(kernels.along_curve(balls)))
    return tree


class GivenRays(NamedTuple):
    """Some rays, and the spheres that they are traced against."""

    origins: np.ndarray  # (n, 3)
    directions: np.ndarray  # (n, 3)
    targets: Targets
    tree: Tree | None

    def hits(self) -> Hits:
        """What they hit, t to the last digit."""
        nearest, rays = Nearest.nothing_yet((len(self.origins),)), given_rays(self.directions)
        balls, path = self.targets.balls, self.targets.path
        if self.tree is None:
            path.nearest_given(self.origins, rays, balls, nearest)
        else:
            path.nearest_in_tree(self.origins, rays, balls, self.tree, nearest)
        hits = Hits(nearest.t, nearest.index)
        left = path.refine_given(self.origins, rays, balls, hits.t, hits.index, nearest.unsure)
        if len(self.targets.corners):
            nearest_facets(self.origins, rays, self.targets.corners, nearest, len(balls))
            certain = ~nearest.unsure
            facets = np.flatnonzero((nearest.index >= len(balls)) & certain)
            left = np.concatenate([left[(nearest.index[left] < len(balls)) & certain[left]], facets])
        settle(hits, nearest.unsure, self, self.targets)
        polish(hits, (left,), self, self.targets)
        return hits

    def bundle(self, which: Index) -> Bundle:
        chosen = self.directions[which]
        return Bundle(self.origins[which], twofold_given_rays(chosen), lambda k: (chosen[k].tolist(), 1))

    def candidates(self, which: Index) -> Candidates:
        spheres, facets = len(self.targets.balls), len(self.targets.corners)
        if self.tree is None:
            return Candidates.all(len(which[0]), spheres + facets)
        rays, origins = given_rays(self.directions[which]), self.origins[which]
        of_spheres = Candidates(*self.targets.path.candidates_in_tree(origins, rays, self.targets.balls, self.tree))
        return of_spheres.and_all(spheres, facets) if facets else of_spheres


def _vectors(name: str, vectors: ArrayLike) -> np.ndarray:
    array = np.ascontiguousarray(vectors, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: found an array of shape {array.shape}, expected (n, 3)")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: row {np.argmin(np.isfinite(array).all(axis=1))} is not finite")
    return array


def _refuse_bad_triangles(corners: np.ndarray) -> None:
    if corners.ndim != 3 or corners.shape[1:] != (3, 3):
        raise ValueError(f"triangles: found an array of shape {corners.shape}, expected (m, 3, 3)")
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if bad.size:
        raise ValueError(f"triangles: number {bad[0]} has a corner that is not finite")
    for i, numbers in enumerate(corners.reshape(-1, 9).tolist()):
        if not exact.has_area(numbers):
            raise ValueError(f"triangles: the corners of number {i} lie on one line")


def _refuse_bad_rays(origins: np.ndarray, directions: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> None:
    if len(origins) != len(directions):
        raise ValueError(f"found {len(origins)} origins and {len(directions)} directions, expected as many")
    if radii.shape != (len(centres),):
        raise ValueError(f"radii: found shape {radii.shape}, expected ({len(centres)},), one a centre")
    zero = np.flatnonzero(~directions.any(axis=1))
    if zero.size:
        raise ValueError(f"directions: row {zero[0]} is zero, and points nowhere")
    bad = np.flatnonzero(~((radii > 0) & np.isfinite(radii)))
    if bad.size:
        raise ValueError(f"radii: number {bad[0]} is {radii[bad[0]]}, expected a finite number above 0")
