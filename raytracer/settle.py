"""What float64 leaves open is decided here: in two-fold float64, and what that leaves open in integers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from types import ModuleType
from typing import NamedTuple, Protocol

import numpy as np

from raytracer import exact
from raytracer.arrays import Candidates, Hits, Nearest, Seen, Sides, TwofoldRays
from raytracer.certified import CLOSE, U, contends
from raytracer.plain import known_sides, rough_meeting
from raytracer.scene import vector

_CHUNK = 1 << 14  # pairs of a ray and a sphere that are looked at together

Index = tuple[np.ndarray, ...]


class Targets(NamedTuple):
    """The spheres that rays are traced against, and who traces."""

    balls: np.ndarray  # (s, 4): x, y, z, radius
    sides: Sides  # what is known of c from where all rays start
    path: ModuleType  # `raytracer.plain` or `raytracer.kernels`


class Bundle(NamedTuple):
    """Some rays, as the levels above float64 want them."""

    origins: np.ndarray  # (n, 3)
    rays: TwofoldRays  # (n,)
    exact_direction: Callable[[int], tuple[Sequence[float], int]]  # of ray k of these: numbers, and their divisor


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
    """What two-fold arithmetic makes of these rays."""
    balls, sides, path = targets
    found = Nearest.nothing_yet((len(bundle.origins),))
    path.nearest_twofold(bundle.origins, bundle.rays, candidates, balls, sides, found)
    return found


def polish(hits: Hits, which: Index, source: Source, targets: Targets) -> None:
    """Bring the t of these hits to the last digit."""
    if not which[0].size:
        return
    bundle, (balls, sides, path), spheres = source.bundle(which), targets, hits.index[which]
    t = path.polish(bundle.origins, bundle.rays, balls[spheres], known_sides(sides, spheres))
    for k in np.flatnonzero(~np.isfinite(t)).tolist():
        direction, unit = bundle.exact_direction(k)
        t[k], _ = exact.nearest_of([*bundle.origins[k].tolist(), *balls[spheres[k]].tolist()], direction, unit)
    hits.t[which] = t


def _settle_exactly(found: Nearest, bundle: Bundle, candidates: Candidates, targets: Targets) -> None:
    """Decide what two-fold arithmetic left open, in integers, among the spheres that float64 cannot rule out."""
    open_rays = np.flatnonzero(found.unsure)
    pairs = np.cumsum(np.diff(candidates.starts)[open_rays])
    cuts = np.searchsorted(pairs, np.arange(_CHUNK, pairs[-1], _CHUNK))
    for some in np.split(open_rays, np.unique(cuts)):
        contend = _contenders(bundle, candidates.of(some), some, targets)
        lengths, ids = targets.balls[contend.ids].ravel().tolist(), contend.ids.tolist()
        starts, ts, indices = contend.starts.tolist(), [], []
        rays = zip(some.tolist(), bundle.origins[some].tolist(), starts, starts[1:], strict=False)
        for k, origin, start, end in rays:
            t, i = exact.nearest_of(origin + lengths[4 * start : 4 * end], *bundle.exact_direction(k))
            ts.append(t)
            indices.append(ids[start + i] if i >= 0 else -1)
        found.t[some], found.index[some] = ts, indices


def _contenders(bundle: Bundle, candidates: Candidates, some: np.ndarray, targets: Targets) -> Candidates:
    """Those candidates of some rays which float64 cannot rule out."""
    row, ids = candidates.rows(np.arange(len(some))), candidates.ids
    rays = TwofoldRays._make(array[some][row] for array in bundle.rays)
    t, error, low = rough_meeting(bundle.origins[some][row], rays, targets.balls[ids])
    farthest = np.full(len(some), np.inf)
    np.fmin.at(farthest, row, t + error)
    contend = contends(t, error, low, farthest[row], 0.0)
    starts = np.concatenate([[0], np.cumsum(np.bincount(row[contend], minlength=len(some)))])
    return Candidates(starts.astype(np.int64), ids[contend])
