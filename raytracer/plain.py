"""The numpy path: spheres one after the other, each against many rays at once.

`raytracer.kernels` holds the same four functions, compiled; `plain` is what runs where numba is not installed. Both
call the formulas of `certified`, and so find the same bits.
"""

from __future__ import annotations

import numpy as np

from raytracer.arrays import Balls, Boxed, First, Grid, Nearest, Rays, Seen, Sides, TwofoldRays, UsualRays
from raytracer.camera import directions
from raytracer.certified import (
    K_ERROR,
    Three,
    U,
    approach,
    arrive,
    contends,
    distance,
    look,
    look_twofold,
    meet,
    meet_twofold,
    nearer,
    rim_of,
)
from raytracer.methods import METHODS, Vector


def see(origin: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> Seen:
    """All spheres, centres (s, 3) and radii (s,), as seen from one origin (3,)."""
    x, y, z, _, _, _, c, _, c_error, size = look_twofold(*xyz(origin), *xyz(centres), radii, np.nan, 0.0, 0.0)
    return Seen(x, y, z, c, U * abs(c) + c_error, size, radii, rim_of(c, size))


def first_of_grid(grid: Grid, seen: Seen, boxes: np.ndarray, first_row: int, kappa: float, first: First) -> None:
    """What rays of one origin meet first of the spheres seen from it, each looked for in its box of pixels only.

    boxes is int32 (s, 4): left, right, top, bottom, right and bottom excluded, in pixels of the whole picture; the
    grid's rows are those from first_row on. kappa is κ (see `certified`), or 0 where that is not known or too large for
    `approach`.
    """
    for i, (left, right, top, bottom) in enumerate(boxes.tolist()):
        rows = slice(max(top - first_row, 0), max(min(bottom - first_row, len(grid.up)), 0))
        if rows.start < rows.stop and left < right:
            sphere = Seen._make(array[i] for array in seen)
            part = First._make(array[rows, left:right] for array in first)
            k, wins, unsure = _meet_grid(grid, rows, slice(left, right), sphere, kappa, part.k)
            part.k[...] = np.where(wins, k, part.k)
            part.index[wins] = i
            part.unsure[...] |= unsure


def distances(grid: Grid, seen: Seen, first: First) -> np.ndarray:
    """t of the first hits, +inf where there is none."""
    hit = first.index >= 0
    dx, dy, dz = (component[hit] for component in directions(grid))
    lx, ly, lz, c = (array[first.index[hit]] for array in (seen.x, seen.y, seen.z, seen.c))
    t = np.full(hit.shape, np.inf)
    h, a = dx * lx + dy * ly + dz * lz, dx * dx + dy * dy + dz * dz
    t[hit] = distance(h, a, c, np.sqrt(abs(h * h - a * c)))
    return t


def _meet_grid(grid: Grid, rows: slice, columns: slice, sphere: Seen, kappa: float, best: np.ndarray) -> Three:
    dx, dy, dz = directions(grid, rows, columns)
    lx, ly, lz, c, c_error, size, radius, rim = sphere
    a, m = dx * dx + dy * dy + dz * dz, grid.reach[rows, None]
    if rim * kappa > 0.0:
        h = dx * lx + dy * ly + dz * lz
        return approach(h, a, c, m * size, rim * kappa, best)
    t, _, low = meet(lx, ly, lz, c, c_error, size, radius, dx, dy, dz, a, m, K_ERROR / 2)
    return arrive(t, low, a, best)


def nearest_given(origins: np.ndarray, rays: Rays, centres: np.ndarray, radii: np.ndarray, nearest: Nearest) -> None:
    """Rays (n,) from origins (n, 3) against all spheres, centres (s, 3) and radii (s,)."""
    for i, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        _update(nearest, *meet(*look(*xyz(origins), *xyz(centre), radius), radius, *rays), i)


def nearest_twofold(
    origins: np.ndarray,
    rays: TwofoldRays,
    boxed: Boxed,
    centres: np.ndarray,
    radii: np.ndarray,
    sides: Sides,
    nearest: Nearest,
) -> None:
    """Rays (n,) from origins (n, 3) against all spheres, in two-fold arithmetic where float64 does not say "behind".

    sides is what is known of the spheres, seen from all these origins. A sphere equal to one that came earlier in the
    file cannot win, and is passed over.
    """
    t_low = np.zeros_like(nearest.t)
    x, y, z, reach = rays.x, rays.y, rays.z, rays.reach
    in_float64 = np.stack([x, y, z, x * x + y * y + z * z, reach])
    for i, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        left, right, top, bottom = boxed.boxes[i]
        some = np.flatnonzero((left <= boxed.x) & (boxed.x < right) & (top <= boxed.y) & (boxed.y < bottom))
        dx, dy, dz, square, m = in_float64[:, some]
        rough = meet(*look(*xyz(origins[some]), *xyz(centre), radius), radius, dx, dy, dz, square, m)
        best = nearest.index[some]
        twin = (best >= 0) & (radii[best] == radius) & (centres[best] == centre).all(axis=1)
        some = some[contends(*rough, nearest.t[some], nearest.error[some]) & ~twin]
        if some.size:
            seen = look_twofold(*xyz(origins[some]), *xyz(centre), radius, *Sides._make(array[i] for array in sides))
            so_far = nearest.t[some], t_low[some], nearest.error[some], nearest.index[some], nearest.unsure[some]
            found = nearer(*so_far, *meet_twofold(*seen, *TwofoldRays._make(array[some] for array in rays)), i)
            for array, value in zip((nearest.t, t_low, *nearest[1:]), found, strict=True):
                array[some] = value


def usual_eye(
    method: str,
    origin: Vector,
    rays: UsualRays,
    spheres: Balls,
    boxes: np.ndarray,
    first_row: int,
    t: np.ndarray,
    index: np.ndarray,
) -> None:
    """What rays (rows, width) of one origin meet first by a usual method; boxes and rows as for `first_of_grid`."""
    function = METHODS[method].function
    assert function is not None
    for i, (left, right, top, bottom) in enumerate(boxes.tolist()):
        box = np.s_[max(top - first_row, 0) : max(min(bottom - first_row, len(t)), 0), left:right]
        if t[box].size:
            some = (tuple(component[box] for component in vector) for vector in rays)
            found = function(origin, *some, xyz(spheres.centres[i]), spheres.radii[i])
            index[box][found < t[box]] = i
            np.minimum(t[box], found, out=t[box])


def usual_given(
    method: str, origins: np.ndarray, rays: UsualRays, spheres: Balls, t: np.ndarray, index: np.ndarray
) -> None:
    """What rays (n,) from origins (n, 3) meet first by a usual method."""
    function = METHODS[method].function
    assert function is not None
    for i in range(len(spheres.radii)):
        found = function(xyz(origins), *rays, xyz(spheres.centres[i]), spheres.radii[i])
        index[found < t] = i
        np.minimum(t, found, out=t)


def polish(origins: np.ndarray, rays: TwofoldRays, centres: np.ndarray, radii: np.ndarray, sides: Sides) -> np.ndarray:
    """t of rays (n,), each against its own sphere, to the last digit; +inf where two-fold arithmetic is not certain."""
    t, _, _, _ = meet_twofold(*look_twofold(*xyz(origins), *xyz(centres), radii, *sides), *rays)
    return t


def xyz(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The columns of vectors (n, 3), or the components of one."""
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def _update(nearest: Nearest, t: np.ndarray, error: np.ndarray, low: np.ndarray, i: int) -> None:
    best_t, best_error, best_index, unsure = nearest
    found = nearer(best_t, 0.0, best_error, best_index, unsure, t, 0.0, error, low, i)
    for array, value in zip(nearest, (found[0], *found[2:]), strict=True):
        array[...] = value
