"""The arrays that travel between the parts of the tracer: all of it that a kernel ever sees.

Structures of arrays, as NamedTuples because the compiler takes those apart by itself. All numbers are float64 and all
arrays of one structure have one shape, unless a comment says otherwise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Hits(NamedTuple):
    """What rays hit first; whoever needs the point, the normal or the material computes it, once, from these two."""

    t: np.ndarray  # the hit is at origin + t · direction; +inf for a miss
    index: np.ndarray  # type: ignore[assignment]  # int32, the shape's place among all shapes of the file; −1 for a miss


class Rays(NamedTuple):
    """Directions in float64, with what the error bounds want to know of them.

    Each component of the true direction is within 5u·reach of the one given (u = 2⁻⁵³), for eye rays; the directions
    of rays given in float64 are the true ones. For both, reach ≥ |D|.
    """

    x: np.ndarray  # float64, as all
    y: np.ndarray
    z: np.ndarray
    square: np.ndarray  # D·D
    reach: np.ndarray


class Grid(NamedTuple):
    """The rays of some rows of a picture, D = across·u + up·v − back, in factors."""

    across: np.ndarray  # float64 (width,), U of each column
    up: np.ndarray  # float64 (rows,), V of each row
    u: tuple[float, float, float]
    v: tuple[float, float, float]
    back: tuple[float, float, float]  # d·w
    reach: np.ndarray  # float64 (rows,), at least the reach of each ray of the row


class TwofoldRays(NamedTuple):
    """Directions in two-fold float64: each component of the true one is within 2⁻¹⁰²·reach of high + low."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    x_low: np.ndarray
    y_low: np.ndarray
    z_low: np.ndarray
    reach: np.ndarray


# The directions of rays for a usual method, in its own precision: x, y, z; and, where it takes them, their low parts.
UsualRays = tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]


class Boxed(NamedTuple):
    """Which rays can hit which spheres at all: those whose pixel lies in the sphere's box."""

    x: np.ndarray  # int32 (n,), a column for each ray
    y: np.ndarray  # int32 (n,), a row for each ray
    boxes: np.ndarray  # int32 (s, 4), left, right, top, bottom of each sphere, right and bottom excluded


class Sides(NamedTuple):
    """What is known of c = L·L − r² from integers: arrays of shape (spheres,). c is NaN where nothing is."""

    c: np.ndarray
    c_low: np.ndarray
    c_error: np.ndarray  # 0 where c is exactly 0: the origin lies on the sphere

    @classmethod
    def unknown(cls, spheres: int) -> Sides:
        return cls(np.full(spheres, np.nan), np.zeros(spheres), np.zeros(spheres))


class Seen(NamedTuple):
    """Spheres as seen from one origin: arrays of shape (spheres,)."""

    x: np.ndarray  # L = origin − centre, rounded once
    y: np.ndarray
    z: np.ndarray
    c: np.ndarray  # L·L − r²
    c_error: np.ndarray  # a bound of c's error; 0 where c is exactly 0
    size: np.ndarray  # √(L·L + r²)
    radius: np.ndarray
    rim: np.ndarray  # see `certified.rim_of`; 0 if `certified.approach` is not for this sphere


class Balls(NamedTuple):
    """Spheres as a usual method sees them, in its own precision."""

    centres: np.ndarray  # (s, 3)
    radii: np.ndarray  # (s,)


class First(NamedTuple):
    """The first sphere that each eye ray meets so far; filled in place."""

    k: np.ndarray  # a·t, relative error at most `certified.K_ERROR`; +inf for none
    index: np.ndarray  # type: ignore[assignment]  # int32, among the spheres
    unsure: np.ndarray  # bool: the next level has to decide

    @classmethod
    def nothing_yet(cls, shape: tuple[int, ...]) -> First:
        return cls(np.full(shape, np.inf), np.full(shape, -1, np.int32), np.zeros(shape, bool))


class Nearest(NamedTuple):
    """The nearest hit of each ray so far; filled in place."""

    t: np.ndarray
    error: np.ndarray  # a bound of t's error
    index: np.ndarray  # type: ignore[assignment]  # int32, among the spheres
    unsure: np.ndarray  # bool: the next level has to decide

    @classmethod
    def nothing_yet(cls, shape: tuple[int, ...]) -> Nearest:
        return cls(np.full(shape, np.inf), np.zeros(shape), np.full(shape, -1, np.int32), np.zeros(shape, bool))
