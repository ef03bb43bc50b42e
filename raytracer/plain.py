"""The numpy path: spheres one after the other, each against many rays at once.

`raytracer.kernels` holds the same four functions, compiled; `plain` is what runs where numba is not installed. Both
call the formulas of `certified`, and so find the same bits.
"""

from __future__ import annotations

import numpy as np

from raytracer.arrays import Boxed, Nearest, Rays, Seen, TwofoldRays
from raytracer.certified import U, contends, look, look_twofold, meet, meet_twofold, nearer


def see(origin: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> Seen:
    """All spheres, centres (s, 3) and radii (s,), as seen from one origin (3,)."""
    x, y, z, _, _, _, c, _, c_error, size = look_twofold(*xyz(origin), *xyz(centres), radii, False)
    return Seen(x, y, z, c, U * abs(c) + c_error, size, radii)


def nearest_eye(rays: Rays, seen: Seen, boxes: np.ndarray, first_row: int, nearest: Nearest) -> None:
    """Rays (rows, width) of one origin against the spheres seen from it, each within its box of pixels.

    boxes is int32 (s, 4): left, right, top, bottom, right and bottom excluded, in pixels of the whole picture; the rays
    are those of its rows from first_row on.
    """
    rows = len(rays.x)
    for i, (left, right, top, bottom) in enumerate(boxes.tolist()):
        box = np.s_[max(top - first_row, 0) : min(max(bottom - first_row, 0), rows), left:right]
        if rays.x[box].size:
            t, error, low = meet(*Seen._make(array[i] for array in seen), *Rays._make(array[box] for array in rays))
            _update(Nearest(*(array[box] for array in nearest)), t, error, low, i)


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
    on: np.ndarray,
    nearest: Nearest,
) -> None:
    """Rays (n,) from origins (n, 3) against all spheres, in two-fold arithmetic where float64 does not say "behind".

    on is bool (s,): spheres on which all these origins are known to lie exactly. A sphere equal to one that came
    earlier in the file cannot win, and is passed over.
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
            seen = look_twofold(*xyz(origins[some]), *xyz(centre), radius, on[i])
            so_far = nearest.t[some], t_low[some], nearest.error[some], nearest.index[some], nearest.unsure[some]
            found = nearer(*so_far, *meet_twofold(*seen, *TwofoldRays._make(array[some] for array in rays)), i)
            for array, value in zip((nearest.t, t_low, *nearest[1:]), found, strict=True):
                array[some] = value


def polish(
    origins: np.ndarray, rays: TwofoldRays, centres: np.ndarray, radii: np.ndarray, on: np.ndarray
) -> np.ndarray:
    """t of rays (n,), each against its own sphere, to the last digit; +inf where two-fold arithmetic is not certain."""
    t, _, _, _ = meet_twofold(*look_twofold(*xyz(origins), *xyz(centres), radii, on), *rays)
    return t


def xyz(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The columns of vectors (n, 3), or the components of one."""
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def _update(nearest: Nearest, t: np.ndarray, error: np.ndarray, low: np.ndarray, i: int) -> None:
    best_t, best_error, best_index, unsure = nearest
    found = nearer(best_t, 0.0, best_error, best_index, unsure, t, 0.0, error, low, i)
    for array, value in zip(nearest, (found[0], *found[2:]), strict=True):
        array[...] = value
