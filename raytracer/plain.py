"""The numpy path: spheres one after the other, each against many rays at once.

`raytracer.kernels` has the same functions compiled, but for the eye rays of `certified`, for which it has more
(`raytracer.screen`); this is what runs where numba is not installed, and for small pictures. Both hit the same shapes
and draw the same bytes; t to the last digit is the same but for once in a million hits, where the neighbour is as good.
"""

from __future__ import annotations

import numpy as np

from raytracer.arrays import (
    Balls,
    Candidates,
    Facets,
    First,
    Grid,
    Nearest,
    Rays,
    Seen,
    Sides,
    TwofoldRays,
    UsualRays,
    View,
)
from raytracer.boxes import Lens, beside, box_of
from raytracer.camera import fine_ray, squares
from raytracer.certified import (
    K_ERROR,
    Three,
    U,
    approach,
    approach_facet,
    arrive,
    beside_edges,
    contends,
    edge_of,
    inner,
    look,
    look_twofold,
    meet,
    meet_twofold,
    nearer,
    refine,
    side_of,
)
from raytracer.methods import Method, Vector, row_of
from raytracer.twofold import select


def bound(lens: Lens, origin: np.ndarray, balls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boxes that hold every pixel whose ray may hit: int32 (s, 4), left, right, top, bottom, ends excluded.

    And whether the sphere is known to be in front of the eye as a whole: bool (s,). The box of one behind the eye is
    empty, that of one around the eye or beside it is the whole picture.
    """
    x, y, z = xyz(balls[:, :3] - origin)
    box, (c, square) = box_of(lens, x, y, z, balls[:, 3]), side_of(x, y, z, balls[:, 3])
    hidden = (box.known & (box.ahead <= 0.0)) | (~box.known & beside(lens, x, y, z, c, square, balls[:, 3]))
    whole = np.array([0, lens.width, 0, lens.rows])
    sides = np.stack(box[:4], axis=-1)
    front = box.known & (box.ahead > 0.0)
    sides = np.where(front[:, None], sides, np.where(hidden[:, None], 0.0, whole))
    return sides.astype(np.int32), front


def see(grid: Grid | View, kappa: float, origin: np.ndarray, balls: np.ndarray, front: np.ndarray) -> Seen:
    """All spheres (s, 4), x, y, z, radius, as seen from one origin (3,).

    front is what `bound` says; kappa is κ (see `certified`), or 0 where that is not known or too large for `approach`.
    """
    eye, places, radii = xyz(origin), xyz(balls), np.ascontiguousarray(balls[:, 3])
    x, y, z, c, _, _ = look(*eye, *places, radii)
    square = inner(x, y, z, x, y, z) + radii * radii
    edge = np.where(front, edge_of(c, square, grid.reach, kappa), 0.0)
    _, _, _, _, _, _, fine_c, _, c_error, size = look_twofold(*eye, *places, radii, np.nan, 0.0, 0.0)
    c = select(edge > 0.0, c, fine_c)
    return Seen(
        x, y, z, inner(*grid.u, x, y, z), inner(*grid.v, x, y, z), -inner(*grid.back, x, y, z),
        c, U * abs(fine_c) + c_error, size, radii, edge,
    )  # fmt: skip


def first_of_grid(grid: Grid, seen: Seen, boxes: np.ndarray, rows: slice, first: First) -> None:
    """What rays of one origin meet first of the spheres seen from it, each looked for in its box of pixels only.

    boxes is int32 (s, 4): left, right, top, bottom, right and bottom excluded, in pixels of the whole picture; `first`
    is of these rows of it.
    """
    for i in np.flatnonzero((boxes[:, 2] < rows.stop) & (boxes[:, 3] > rows.start)).tolist():
        left, right, top, bottom = boxes[i].tolist()
        box = slice(max(top, rows.start), min(bottom, rows.stop)), slice(left, right)
        part = First._make(array[box[0].start - rows.start : box[0].stop - rows.start, left:right] for array in first)
        k, wins, unsure = _meet_grid(grid, *box, Seen._make(array[i] for array in seen), part.k)
        part.k[...] = np.where(wins, k, part.k)
        part.index[wins] = i
        part.unsure[...] |= unsure


def first_facets_of_grid(grid: Grid, facets: Facets, boxes: np.ndarray, rows: slice, first: First, number: int) -> None:
    """The same for triangles, of which the first has this number."""
    for i in np.flatnonzero((boxes[:, 2] < rows.stop) & (boxes[:, 3] > rows.start)).tolist():
        left, right, top, bottom = boxes[i].tolist()
        box = slice(max(top, rows.start), min(bottom, rows.stop)), slice(left, right)
        part = First._make(array[box[0].start - rows.start : box[0].stop - rows.start, left:right] for array in first)
        across, up = grid.across[None, box[1]], grid.up[box[0], None]
        values = [across * u + (up * v + w) for u, v, w in facets.rows[i].reshape(4, 3)]
        low, _ = beside_edges(*values[:3])
        k, wins, unsure = approach_facet(low, values[3], facets.distance[i], squares(grid, *box), part.k)
        part.k[...] = np.where(wins, k, part.k)
        part.index[wins] = number + i
        part.unsure[...] |= unsure


def _meet_grid(grid: Grid, rows: slice, columns: slice, sphere: Seen, best: np.ndarray) -> Three:
    h = grid.across[None, columns] * sphere.hu + (grid.up[rows, None] * sphere.hv + sphere.hw)
    a = squares(grid, rows, columns)
    if sphere.edge > 0.0:
        return approach(h, a, sphere.c, sphere.edge, best)
    t, _, low = meet(h, a, sphere.c, sphere.c_error, sphere.size, sphere.radius, grid.reach, K_ERROR / 2)
    return arrive(t, low, a, best)


def nearest_given(origins: np.ndarray, rays: Rays, balls: np.ndarray, nearest: Nearest) -> None:
    """Rays (n,) from origins (n, 3) against all spheres (s, 4), x, y, z, radius."""
    for i, ball in enumerate(balls):
        radius = ball[3]
        lx, ly, lz, c, c_error, size = look(*xyz(origins), *ball)
        h = inner(rays.x, rays.y, rays.z, lx, ly, lz)
        update(nearest, *meet(h, rays.square, c, c_error, size, radius, rays.reach), i)


def refine_given(
    origins: np.ndarray, rays: Rays, balls: np.ndarray, t: np.ndarray, index: np.ndarray, unsure: np.ndarray
) -> np.ndarray:
    """Bring the t of certain hits to the last digit, in place; returns those of which that is not certain, int (n,)."""
    which = np.flatnonzero((index >= 0) & ~unsure)
    zero, spheres = np.zeros(len(which)), balls[index[which]]
    x, y, z = ((component[which], zero) for component in rays[:3])
    finer, sure = refine(t[which], x, y, z, *xyz(origins[which]), *xyz(spheres), spheres[:, 3])
    t[which] = np.where(sure, finer, t[which])
    open_rays: np.ndarray = which[~sure]
    return open_rays


def fine_rays(
    across: np.ndarray, up: np.ndarray, height: float, u: Three, v: Three, w: Three, back: float
) -> TwofoldRays:
    """`camera.fine_ray` of many rays."""
    return TwofoldRays._make(fine_ray(across, up, height, u, v, w, back))


def nearest_twofold(
    origins: np.ndarray,
    rays: TwofoldRays,
    candidates: Candidates,
    balls: np.ndarray,
    sides: Sides,
    nearest: Nearest,
) -> None:
    """Rays (n,) from origins (n, 3) against their candidates, in two-fold arithmetic where float64 says not "behind".

    sides is what is known of some spheres, seen from all these origins. A sphere equal to one that came earlier in the
    file cannot win, and is passed over.
    """
    t_low = np.zeros_like(nearest.t)
    row = candidates.rows(np.arange(len(origins)))
    by_sphere = np.argsort(candidates.ids, kind="stable")
    cuts = np.flatnonzero(np.diff(candidates.ids[by_sphere])) + 1
    for pairs in np.split(by_sphere, cuts) if len(by_sphere) else ():
        i, some = int(candidates.ids[pairs[0]]), row[pairs]
        ball = balls[i]
        directions = TwofoldRays._make(array[some] for array in rays)
        best = nearest.index[some]
        twin = (best >= 0) & (balls[best] == ball).all(axis=1)
        rough = rough_meeting(origins[some], directions, ball)
        open_ = contends(*rough, nearest.t[some], nearest.error[some]) & ~twin
        some, directions = some[open_], TwofoldRays._make(array[open_] for array in directions)
        if some.size:
            centre, known = xyz(ball), known_sides(sides, np.array(i))
            seen = look_twofold(*xyz(origins[some]), *centre, ball[3], *known)
            so_far = nearest.t[some], t_low[some], nearest.error[some], nearest.index[some], nearest.unsure[some]
            found = nearer(*so_far, *meet_twofold(*seen, *directions), i)
            for array, value in zip((nearest.t, t_low, *nearest[1:]), found, strict=True):
                array[some] = value


def rough_meeting(origins: np.ndarray, rays: TwofoldRays, balls: np.ndarray) -> Three:
    """`meet` for rays that are known to twice the digits: one sphere (4,) for all rays (n,), or one each (n, 4)."""
    radius = balls[..., 3]
    lx, ly, lz, c, c_error, size = look(*xyz(origins), *xyz(balls), radius)
    square = inner(rays.x, rays.y, rays.z, rays.x, rays.y, rays.z)
    return meet(inner(rays.x, rays.y, rays.z, lx, ly, lz), square, c, c_error, size, radius, rays.reach)


def known_sides(sides: Sides, which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """c, its rest and its error of these spheres; NaN where nothing is known."""
    place = np.searchsorted(sides.which, which)
    found = np.append(sides.which, -1)[place] == which
    c, low, error = (np.append(array, 0.0)[place] for array in sides[1:])
    return np.where(found, c, np.nan), np.where(found, low, 0.0), np.where(found, error, 0.0)


def candidates_of(boxes: np.ndarray, xs: np.ndarray, ys: np.ndarray) -> Candidates:
    """The spheres in whose boxes (s, 4) the pixels in columns xs and rows ys lie."""
    found = [np.flatnonzero((boxes[:, 0] <= x) & (x < boxes[:, 1]) & (boxes[:, 2] <= y) & (y < boxes[:, 3]))
             for x, y in zip(xs.tolist(), ys.tolist(), strict=True)]  # fmt: skip
    starts = np.cumsum([0, *map(len, found)], dtype=np.int64)
    return Candidates(starts, np.concatenate([np.empty(0, np.int32), *found]).astype(np.int32))


def usual_eye(
    method: str | Method,
    origin: Vector,
    rays: UsualRays,
    spheres: Balls,
    boxes: np.ndarray,
    first_row: int,
    t: np.ndarray,
    index: np.ndarray,
) -> None:
    """What rays (rows, width) of one origin meet first by a usual method; boxes and rows as for `first_of_grid`."""
    function = row_of(method).function
    assert function is not None
    for i, (left, right, top, bottom) in enumerate(boxes.tolist()):
        box = np.s_[max(top - first_row, 0) : max(min(bottom - first_row, len(t)), 0), left:right]
        if t[box].size:
            some = (tuple(component[box] for component in vector) for vector in rays)
            found = function(origin, *some, xyz(spheres.centres[i]), spheres.radii[i])
            index[box][found < t[box]] = i
            np.minimum(t[box], found, out=t[box])


def usual_given(
    method: str | Method, origins: np.ndarray, rays: UsualRays, spheres: Balls, t: np.ndarray, index: np.ndarray
) -> None:
    """What rays (n,) from origins (n, 3) meet first by a usual method."""
    function = row_of(method).function
    assert function is not None
    for i in range(len(spheres.radii)):
        found = function(xyz(origins), *rays, xyz(spheres.centres[i]), spheres.radii[i])
        index[found < t] = i
        np.minimum(t, found, out=t)


def polish(origins: np.ndarray, rays: TwofoldRays, balls: np.ndarray, known: tuple[np.ndarray, ...]) -> np.ndarray:
    """t of rays (n,), each against its own sphere (n, 4), to the last digit; +inf where that is not certain.

    known is what `known_sides` says of those spheres.
    """
    t: np.ndarray = meet_twofold(*look_twofold(*xyz(origins), *xyz(balls), balls[:, 3], *known), *rays)[0]
    return t


def xyz(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The columns of vectors (n, 3), or the components of one."""
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def update(nearest: Nearest, t: np.ndarray, error: np.ndarray, low: np.ndarray, i: int) -> None:
    best_t, best_error, best_index, unsure = nearest
    found = nearer(best_t, 0.0, best_error, best_index, unsure, t, 0.0, error, low, i)
    for array, value in zip(nearest, (found[0], *found[2:]), strict=True):
        array[...] = value
