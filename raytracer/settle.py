"""What float64 leaves open is decided here: in two-fold float64, and what that leaves open in integers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import chain
from types import ModuleType
from typing import NamedTuple, Protocol

import numpy as np

from raytracer import exact
from raytracer.arrays import Candidates, Hits, Nearest, Seen, Sides, TwofoldRays
from raytracer.certified import CLOSE, U, contends
from raytracer.facets import certain_misses, fine_distance
from raytracer.plain import known_sides, rough_meeting
from raytracer.scene import vector

_CHUNK = 1 << 14  # pairs of a ray and a sphere that are looked at together

Index = tuple[np.ndarray, ...]


NO_CORNERS, _NO_PLACES = np.empty((0, 3, 3)), np.empty(0, np.int32)


class Targets(NamedTuple):
    """The shapes that rays are traced against, and who traces. Triangles are numbered after the rows of balls."""

    balls: np.ndarray  # (s, 4): x, y, z, radius
    sides: Sides  # what is known of c from where all rays start
    path: ModuleType  # `raytracer.plain` or `raytracer.kernels`
    corners: np.ndarray = NO_CORNERS  # (n, 3, 3), of triangles
    order: np.ndarray = _NO_PLACES  # int32 (s + n,), places in the file; of no use where there are no triangles

    def numbers_of(self, i: int) -> list[float]:
        """What a shape is made of, for `exact.nearest_of`."""
        flat = self.balls[i] if i < len(self.balls) else self.corners[i - len(self.balls)].reshape(-1)
        numbers: list[float] = flat.tolist()
        return numbers


class Bundle(NamedTuple):
    """Some rays, as the levels above float64 want them."""

    origins: np.ndarray  # (n, 3)
    rays: TwofoldRays  # (n,)
    exact_direction: Callable[[int], tuple[Sequence[float], int]]  # of ray k of these: numbers, and their divisor
    share_origin: bool = False  # and have whole numbers for directions

    def some(self, which: np.ndarray) -> tuple[np.ndarray, TwofoldRays]:
        """Origins and directions of some of them."""
        return self.origins[which], TwofoldRays._make(array[which] for array in self.rays)


class Source(Protocol):
    """Where rays come from. `which` says which of them, as indices of the arrays of their hits."""

    def bundle(self, which: Index) -> Bundle: ...

    def candidates(self, which: Index) -> Candidates: ...


def known_in_integers(origin: np.ndarray, balls: np.ndarray, seen: Seen) -> tuple[Seen, Sides]:
    """Work out c in integers for the spheres that the origin is close to, and put it into a copy of `seen` as well.

    Where c cannot be held in a float64 it stays unknown.
    """
    close = np.flatnonzero(~(np.abs(seen.c) > CLOSE * seen.size * seen.size) | ~np.isfinite(seen.c))
    which, known = [], []
    for i in close.tolist():
        *centre, radius = balls[i].tolist()
        c = exact.side(vector(origin), centre, radius)
        if c == 0 or 1e-280 < abs(c) < 1e280:
            high = float(c)
            which.append(i)
            known.append((high, float(c - Fraction(high)), U * U * abs(high)))
    if not which:
        return seen, Sides.unknown()
    c, c_low, c_error = np.array(known).T
    seen = seen._replace(c=seen.c.copy(), c_error=seen.c_error.copy(), edge=seen.edge.copy())
    seen.c[which], seen.c_error[which], seen.edge[which] = c, U * np.abs(c), 0.0
    return seen, Sides(np.array(which, np.int32), c, c_low, c_error)


def settle(hits: Hits, unsure: np.ndarray, source: Source, targets: Targets) -> None:
    """Decide, in place, the hits that float64 was unsure of."""
    if unsure.any():
        pending = np.nonzero(unsure)
        hits.t[pending], hits.index[pending] = settled(source, pending, targets)


def settled(source: Source, which: Index, targets: Targets) -> Hits:
    """What these rays hit, certain."""
    bundle, candidates = source.bundle(which), source.candidates(which)
    found = in_twofold(bundle, candidates, targets)
    if found.unsure.any():
        _settle_exactly(found, bundle, candidates, targets)
    return Hits(found.t, found.index)


def in_twofold(bundle: Bundle, candidates: Candidates, targets: Targets) -> Nearest:
    """What two-fold arithmetic makes of these rays. Those that may meet a triangle it leaves to the integers."""
    found = Nearest.nothing_yet((len(bundle.origins),))
    if len(targets.corners):
        is_sphere = candidates.ids < len(targets.balls)
        row = candidates.rows(np.arange(len(found.unsure)))
        found.unsure[row[~is_sphere]] = True
        candidates = candidates.only(is_sphere)
    targets.path.nearest_twofold(bundle.origins, bundle.rays, candidates, targets.balls, targets.sides, found)
    return found


def polish(hits: Hits, which: Index, source: Source, targets: Targets) -> None:
    """Bring the t of these hits to the last digit."""
    if not which[0].size:
        return
    bundle, shapes, t = source.bundle(which), hits.index[which], np.empty(len(which[0]))
    first_facet = len(targets.balls)
    spheres, facets = np.flatnonzero(shapes < first_facet), np.flatnonzero(shapes >= first_facet)
    if spheres.size:
        (origins, rays), balls = bundle.some(spheres), targets.balls[shapes[spheres]]
        t[spheres] = targets.path.polish(origins, rays, balls, known_sides(targets.sides, shapes[spheres]))
    if facets.size:
        t[facets] = fine_distance(*bundle.some(facets), targets.corners[shapes[facets] - first_facet])
    for k in np.flatnonzero(~np.isfinite(t)).tolist():
        numbers = targets.numbers_of(int(shapes[k]))
        t[k], _ = exact.nearest_of([*bundle.origins[k].tolist(), *numbers], *bundle.exact_direction(k), [len(numbers)])
    hits.t[which] = t


def _settle_exactly(found: Nearest, bundle: Bundle, candidates: Candidates, targets: Targets) -> None:
    """Decide what two-fold arithmetic left open, in integers, among the shapes that float64 cannot rule out."""
    open_rays, seen = np.flatnonzero(found.unsure), dict[int, exact.Seen]()
    pairs = np.cumsum(np.diff(candidates.starts)[open_rays])
    cuts = np.searchsorted(pairs, np.arange(_CHUNK, pairs[-1], _CHUNK))
    for some in np.split(open_rays, np.unique(cuts)):
        contend = _contenders(bundle, candidates.of(some), some, targets)
        if bundle.share_origin:
            decide = _nearest_seen(bundle, some, contend, targets, seen)
        else:
            decide = _nearest_given(bundle, some, contend, targets)
        ids, starts = contend.ids.tolist(), contend.starts.tolist()
        ts, indices = [], []
        for start, (t, i) in zip(starts, decide, strict=False):
            ts.append(t)
            indices.append(ids[start + i] if i >= 0 else -1)
        found.t[some], found.index[some] = ts, indices


def _nearest_seen(
    bundle: Bundle, some: np.ndarray, contend: Candidates, targets: Targets, seen: dict[int, exact.Seen]
) -> Iterator[tuple[float, int]]:
    """What rays of one origin hit: t and the place among their candidates. `seen` is what is known of shapes."""
    starts, ids, origin = contend.starts.tolist(), contend.ids.tolist(), bundle.origins[0].tolist()
    for k, start, end in zip(some.tolist(), starts, starts[1:], strict=False):
        for i in ids[start:end]:
            if i not in seen:
                seen[i] = exact.seen_from(origin, targets.numbers_of(i))
        direction, unit = bundle.exact_direction(k)
        yield exact.nearest_seen([seen[i] for i in ids[start:end]], [int(x) for x in direction], unit)


def _nearest_given(
    bundle: Bundle, some: np.ndarray, contend: Candidates, targets: Targets
) -> Iterator[tuple[float, int]]:
    """The same for rays of any origin."""
    shapes, sizes = _numbers_of(contend, targets)
    ends = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)[contend.starts].tolist()
    starts = contend.starts.tolist()
    for j, (k, origin) in enumerate(zip(some.tolist(), bundle.origins[some].tolist(), strict=True)):
        kinds = sizes[starts[j] : starts[j + 1]]
        yield exact.nearest_of(origin + shapes[ends[j] : ends[j + 1]], *bundle.exact_direction(k), kinds)


def _numbers_of(candidates: Candidates, targets: Targets) -> tuple[list[float], list[int]]:
    """The numbers of all candidates, one behind the other, and how many each has."""
    if not len(targets.corners):
        return targets.balls[candidates.ids].ravel().tolist(), [4] * len(candidates.ids)
    shapes = [targets.numbers_of(i) for i in candidates.ids.tolist()]
    return list(chain.from_iterable(shapes)), list(map(len, shapes))


def _contenders(bundle: Bundle, candidates: Candidates, some: np.ndarray, targets: Targets) -> Candidates:
    """Those candidates of some rays which float64 cannot rule out, in the order of the file."""
    row, ids = candidates.rows(np.arange(len(some))), candidates.ids
    origins, rays = bundle.some(some[row])
    contend, is_sphere = np.ones(len(ids), bool), ids < len(targets.balls)
    of_spheres = TwofoldRays._make(array[is_sphere] for array in rays)
    t, error, low = rough_meeting(origins[is_sphere], of_spheres, targets.balls[ids[is_sphere]])
    farthest = np.full(len(some), np.inf)
    np.fmin.at(farthest, row[is_sphere], t + error)
    contend[is_sphere] = contends(t, error, low, farthest[row[is_sphere]], 0.0)
    if len(targets.corners):
        corners = targets.corners[ids[~is_sphere] - len(targets.balls)]
        of_facets = TwofoldRays._make(array[~is_sphere] for array in rays)
        contend[~is_sphere] = ~certain_misses(origins[~is_sphere], of_facets, corners)
        in_order = np.lexsort((targets.order[ids], row))
        return Candidates(candidates.starts, ids[in_order]).only(contend[in_order])
    return candidates.only(contend)
