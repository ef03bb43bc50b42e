"""The nearest hit of every ray, certain: float64 first, then two-fold float64, then integers, each for what is open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from types import ModuleType
from typing import NamedTuple

import numpy as np

from raytracer import backend, exact
from raytracer.arrays import Balls, Boxed, First, Grid, Hits, Nearest, Seen, Sides, TwofoldRays
from raytracer.boxes import screen_boxes
from raytracer.camera import (
    Raster,
    eye_grid,
    given_rays,
    spread,
    twofold_eye_rays,
    twofold_given_rays,
)
from raytracer.certified import CLOSE, LARGEST_SPREAD, U, contends, look, meet
from raytracer.methods import CERTIFIED, check_method
from raytracer.plain import xyz
from raytracer.scene import Scene, vector
from raytracer.units import in_units, unit_directions
from raytracer.usual import balls, usual_given, usual_rows

_CHUNK = 1 << 14  # rays that are traced together: their arrays fit a core's cache

# A NaN or an infinity makes a decision uncertain, and the next level takes it.
_NOT_A_NUMBER_IS_NO_ERROR = np.errstate(all="ignore")

Index = tuple[np.ndarray, ...]


class Targets(NamedTuple):
    """The spheres that rays are traced against, and who traces."""

    centres: np.ndarray  # (s, 3)
    radii: np.ndarray  # (s,)
    sides: Sides  # what is known of c from where all rays start
    path: ModuleType  # `raytracer.plain` or `raytracer.kernels`


class Eye(NamedTuple):
    """All that the rays of one picture share."""

    raster: Raster
    unit: int  # lengths below are counted in 2**unit of the scene's
    origin: np.ndarray  # (3,)
    order: np.ndarray  # int32 (s,), the places in the file of the spheres in view
    all_shapes: bool  # whether these are all shapes of the file
    targets: Targets  # the spheres in view
    seen: Seen
    boxes: np.ndarray  # int32 (s, 4), see `screen_boxes`
    method: str  # a row of METHODS
    balls: Balls  # the spheres in view as that method sees them, if it is a usual one
    kappa: float  # see `first_of_grid`
    tests: int  # how many times a ray is tested against a sphere, in float64


@_NOT_A_NUMBER_IS_NO_ERROR
def open_eye(scene: Scene, raster: Raster, method: str = CERTIFIED) -> Eye:
    """Everything about the picture's spheres that does not depend on the pixel; those out of view are left out."""
    spheres = scene.spheres
    unit, (origin, centres, radii) = in_units(np.array(scene.camera.eye), spheres.centres, spheres.radii)
    boxes = screen_boxes(raster, origin, centres, radii)
    in_view = (boxes[:, 1] > boxes[:, 0]) & (boxes[:, 3] > boxes[:, 2])
    order, boxes, centres, radii = spheres.order[in_view], boxes[in_view], centres[in_view], radii[in_view]
    known = Balls(centres, radii)
    if method != CERTIFIED:  # a usual method is given the scene's own numbers
        known = balls(method, spheres.centres[in_view], spheres.radii[in_view])
    left, right, top, bottom = boxes.astype(np.int64).T
    tests = int(((right - left) * (bottom - top)).sum())
    path = backend.choose(tests, len(raster.bands()) * len(radii))
    seen = path.see(origin, centres, radii)
    sides = _settle_sides(origin, centres, radii, seen)
    kappa = spread(raster)
    return Eye(
        raster,
        unit,
        origin,
        order,
        len(order) == len(scene),
        Targets(centres, radii, sides, path),
        seen,
        boxes,
        method,
        known,
        kappa if kappa <= LARGEST_SPREAD else 0.0,
        tests,
    )


@_NOT_A_NUMBER_IS_NO_ERROR
def trace_rows(eye: Eye, rows: slice) -> Hits:
    """What the eye rays of these rows of the picture hit first: t good enough to be shaded, not to the last digit."""
    if eye.method != CERTIFIED:
        return _usual_rows(eye, rows)
    return _in_file_order(eye, _trace_rows(eye, rows)[0])


@_NOT_A_NUMBER_IS_NO_ERROR
def polished_rows(eye: Eye, rows: slice) -> Hits:
    """`trace_rows`, with t to the last digit that the method gives."""
    if eye.method != CERTIFIED:
        return _usual_rows(eye, rows)
    hits, unsure = _trace_rows(eye, rows)
    _polish(hits, unsure, _pixels_of(eye, rows), eye.targets)
    return _in_file_order(eye, hits)


def ray_intersect_scene(
    origins: np.ndarray, directions: np.ndarray, centres: np.ndarray, radii: np.ndarray, method: str = CERTIFIED
) -> Hits:
    """What each of n rays hits first of s spheres: `Hits` of shape (n,), `index` counting the spheres given.

    origins and directions are (n, 3), centres (s, 3), radii (s,), all finite, in one unit of length; directions need
    no normalising, t counts multiples of them. Which sphere is hit is what exact arithmetic says: only t > 0 counts, a
    tangent ray hits, from inside the far root is the hit, and of equal t the sphere that comes first wins. With another
    method of `METHODS`, it is what that method makes of it.

    A t beyond the range of float64 is +inf or 0, its index says that it is a hit all the same.

    ValueError: there is no such method, a direction is zero, a number is not finite, a radius is not positive, or the
    shapes do not fit.
    """
    origins, directions = _vectors("origins", origins), _vectors("directions", directions)
    centres, radii = _vectors("centres", centres), np.ascontiguousarray(radii, np.float64)
    _refuse_bad_rays(origins, directions, centres, radii)
    check_method(method)
    path = backend.choose(len(origins) * len(radii), -(-len(origins) // _CHUNK) * len(radii))
    return trace_given(origins, directions, centres, radii, method, path)


@_NOT_A_NUMBER_IS_NO_ERROR
def trace_given(
    origins: np.ndarray, directions: np.ndarray, centres: np.ndarray, radii: np.ndarray, method: str, path: ModuleType
) -> Hits:
    """`ray_intersect_scene` on a path of one's choice, of arrays that are known to be good."""
    if method != CERTIFIED:
        return usual_given(method, origins, directions, centres, radii, path)
    unit, (origins, centres, radii) = in_units(origins, centres, radii)
    exponents, directions = unit_directions(directions)
    targets = Targets(centres, radii, Sides.unknown(len(radii)), path)
    hits = Hits(np.empty(len(origins)), np.empty(len(origins), np.int32))
    for start in range(0, len(origins), _CHUNK):
        some = slice(start, start + _CHUNK)
        hits.t[some], hits.index[some] = _trace_given(origins[some], directions[some], targets)
    return Hits(np.ldexp(hits.t, unit - exponents), hits.index)


def _trace_given(origins: np.ndarray, directions: np.ndarray, targets: Targets) -> Hits:
    nearest = Nearest.nothing_yet((len(origins),))
    targets.path.nearest_given(origins, given_rays(directions), targets.centres, targets.radii, nearest)

    def rays_of(which: Index) -> Bundle:
        chosen = directions[which]
        nowhere = np.zeros(len(chosen), np.int32)  # all in one pixel, which is in every box
        boxed = Boxed(nowhere, nowhere, np.tile(np.array([0, 1, 0, 1], np.int32), (len(targets.radii), 1)))
        rays = twofold_given_rays(chosen)
        return Bundle(origins[which], rays, boxed, lambda k: (chosen[k].tolist(), 1))

    hits = Hits(nearest.t, nearest.index)
    _settle(hits, nearest.unsure, rays_of, targets)
    _polish(hits, nearest.unsure, rays_of, targets)
    return hits


def _usual_rows(eye: Eye, rows: slice) -> Hits:
    t, index = usual_rows(eye.method, eye.raster, eye.balls, eye.boxes, rows, eye.targets.path)
    return Hits(t, _places(eye, index))


def _trace_rows(eye: Eye, rows: slice) -> tuple[Hits, np.ndarray]:
    """Hits of the spheres in view, in the eye's units, and of which of them float64 was unsure."""
    grid, first = _first(eye, rows)
    hits = Hits(eye.targets.path.distances(grid, eye.seen, first), first.index)
    _settle(hits, first.unsure, _pixels_of(eye, rows), eye.targets)
    return hits, first.unsure


def _first(eye: Eye, rows: slice) -> tuple[Grid, First]:
    """What float64 makes of these rows."""
    grid = eye_grid(eye.raster, rows)
    first = First.nothing_yet((len(grid.up), len(grid.across)))
    eye.targets.path.first_of_grid(grid, eye.seen, eye.boxes, rows.start, eye.kappa, first)
    return grid, first


def _in_file_order(eye: Eye, hits: Hits) -> Hits:
    return Hits(np.ldexp(hits.t, eye.unit) if eye.unit else hits.t, _places(eye, hits.index))


def _places(eye: Eye, index: np.ndarray) -> np.ndarray:
    """Places in the file in place of numbers of spheres in view."""
    if eye.all_shapes:
        return index
    return np.where(index >= 0, eye.order[index], np.int32(-1)) if len(eye.order) else index


class Bundle(NamedTuple):
    """Some of the rays, as the levels above float64 want them."""

    origins: np.ndarray  # (n, 3)
    rays: TwofoldRays  # (n,)
    boxed: Boxed
    exact_direction: Callable[[int], tuple[Sequence[float], int]]  # of ray k of these: numbers, and their divisor


@_NOT_A_NUMBER_IS_NO_ERROR
def level(eye: Eye, x: int, y: int) -> str:
    """What it takes to be certain of a pixel: float64, two-fold float64 or integers."""
    row = slice(y, y + 1)
    _, first = _first(eye, row)
    if not first.unsure[0, x]:
        return "float64"
    found = _in_twofold(_pixels_of(eye, row)((np.array([0]), np.array([x]))), eye.targets)
    return "integers" if found.unsure[0] else "two-fold float64"


def _settle_sides(origin: np.ndarray, centres: np.ndarray, radii: np.ndarray, seen: Seen) -> Sides:
    """Work out c in integers for the spheres that the origin is close to, and put it into `seen` as well.

    Where c cannot be held in a float64 it stays unknown.
    """
    sides = Sides.unknown(len(radii))
    for i in np.flatnonzero(~(np.abs(seen.c) > CLOSE * seen.size * seen.size) | ~np.isfinite(seen.c)):
        c = exact.side(vector(origin), vector(centres[i]), float(radii[i]))
        if c == 0 or 1e-280 < abs(c) < 1e280:
            high = float(c)
            sides.c[i], sides.c_low[i], sides.c_error[i] = high, float(c - Fraction(high)), U * U * abs(high)
            seen.c[i], seen.c_error[i], seen.rim[i] = high, U * abs(high), 0.0
    return sides


def _pixels_of(eye: Eye, rows: slice) -> Callable[[Index], Bundle]:
    def rays_of(which: Index) -> Bundle:
        ys, xs = which[0] + rows.start, which[1]
        origins = np.repeat(eye.origin[None], len(xs), axis=0)
        boxed = Boxed(xs.astype(np.int32), ys.astype(np.int32), eye.boxes)
        rays = twofold_eye_rays(eye.raster, xs, ys)
        return Bundle(origins, rays, boxed, lambda k: eye.raster.whole_direction(int(xs[k]), int(ys[k])))

    return rays_of


def _settle(hits: Hits, unsure: np.ndarray, rays_of: Callable[[Index], Bundle], targets: Targets) -> None:
    """Decide what float64 left open: in two-fold arithmetic, and what that leaves open in integers."""
    if not unsure.any():
        return
    pending = np.nonzero(unsure)
    bundle = rays_of(pending)
    found = _in_twofold(bundle, targets)
    if found.unsure.any():
        _settle_exactly(found, bundle, targets)
    hits.t[pending], hits.index[pending] = found.t, found.index


def _in_twofold(bundle: Bundle, targets: Targets) -> Nearest:
    """What two-fold arithmetic makes of these rays."""
    centres, radii, sides, path = targets
    found = Nearest.nothing_yet((len(bundle.origins),))
    path.nearest_twofold(bundle.origins, bundle.rays, bundle.boxed, centres, radii, sides, found)
    return found


def _settle_exactly(found: Nearest, bundle: Bundle, targets: Targets) -> None:
    """Decide what two-fold arithmetic left open, in integers, among the spheres that float64 cannot rule out."""
    open_rays = np.flatnonzero(found.unsure)
    at_once = max(1, _CHUNK // max(1, len(targets.radii)))
    balls = np.column_stack([targets.centres, targets.radii])
    for start in range(0, len(open_rays), at_once):
        some = open_rays[start : start + at_once]
        origins, contend = bundle.origins[some].tolist(), _contenders(bundle, some, targets)
        for k, origin, row in zip(some.tolist(), origins, contend, strict=True):
            which = row.nonzero()[0]
            direction, unit = bundle.exact_direction(k)
            found.t[k], i = exact.nearest_of([*origin, *balls[which].ravel().tolist()], direction, unit)
            found.index[k] = which[i] if i >= 0 else -1


def _contenders(bundle: Bundle, rays: np.ndarray, targets: Targets) -> np.ndarray:
    """Which spheres float64 cannot rule out for these rays: bool (rays, s)."""
    x, y, z, reach = (component[rays, None] for component in bundle.rays[:3] + bundle.rays[-1:])
    ox, oy, oz = (component[:, None] for component in xyz(bundle.origins[rays]))
    seen = look(ox, oy, oz, *xyz(targets.centres), targets.radii)
    t, error, low = meet(*seen, targets.radii, x, y, z, x * x + y * y + z * z, reach)
    return np.asarray(contends(t, error, low, (t + error).min(axis=1, keepdims=True), 0.0))


def _polish(hits: Hits, unsure: np.ndarray, rays_of: Callable[[Index], Bundle], targets: Targets) -> None:
    """Bring the t of hits to the last digit; those that float64 was unsure of have it already."""
    which = np.nonzero((hits.index >= 0) & ~unsure)
    bundle, (centres, radii, sides, path), spheres = rays_of(which), targets, hits.index[which]
    known = Sides._make(array[spheres] for array in sides)
    t = path.polish(bundle.origins, bundle.rays, centres[spheres], radii[spheres], known)
    for k in np.flatnonzero(~np.isfinite(t)).tolist():
        sphere = vector(centres[spheres[k]]), float(radii[spheres[k]])
        direction, unit = bundle.exact_direction(k)
        t[k], _ = exact.nearest_hit(bundle.origins[k].tolist(), direction, [sphere], unit)
    hits.t[which] = t


def _vectors(name: str, vectors: np.ndarray) -> np.ndarray:
    array = np.ascontiguousarray(vectors, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: found an array of shape {array.shape}, expected (n, 3)")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: row {np.argmin(np.isfinite(array).all(axis=1))} is not finite")
    return array


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
