"""Which pixels can see a sphere: the bounding box of the ellipse that it covers on the screen.

With M = (u, v, −d·w) the frame's matrix and n₁, n₂, n₃ the rows of M⁻¹, the sphere's centre is at x = n₁·(C − O),
y = n₂·(C − O), z = n₃·(C − O) in the coordinates of the screen, and a ray is (U, V, 1) there. The lines that touch the
ellipse are those of the dual conic K, Kᵢⱼ = xᵢ xⱼ − r² nᵢ·nⱼ (R. Hartley, A. Zisserman, Multiple View Geometry, 8.3),
so U lies between the roots of K₃₃ U² − 2 K₁₃ U + K₁₁ = 0:

    U = (K₁₃ ± r √(|x n₃ − z n₁|² − r² |n₁ × n₃|²)) / K₃₃

and V likewise. Written so, the root's argument does not cancel for small spheres.

A sphere is in front where K₃₃ is well above 0 and z too: then no part of it reaches the plane of the eye. In float64
the middle is off by less than 8u·κ·|n₁||D|, and the half width by 8u·κ·|n₃||D| / (K₃₃ / z²) of itself, both below what
is added for them, for frames that magnify errors by no more than `camera.inverse_frame` allows.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from math import frexp, hypot, inf, ldexp, nan, sqrt
from typing import NamedTuple

import numpy as np

from raytracer.camera import SAMPLINGS, Raster, axes_of, directions_of, inverse_frame
from raytracer.certified import inner
from raytracer.twofold import Number, select

_PAD_HALF, _PAD = 1e-6, 1e-9  # added to the ellipse's half width, relative; to its middle, relative and absolute
_CROSSES = 1e-6  # K₃₃ / z² below this, for a frame that magnifies nothing: the ellipse opens up
_SHALLOW = 1e-6  # a corner's depth, of its distance, below which its place on the screen is not worked out
_FARTHEST_APART = 1000  # powers of two between the lengths of the rows n

Row = tuple[float, float, float]
Three = tuple[Number, Number, Number]
Four = tuple[Number, Number, Number, Number]


class Lens(NamedTuple):
    """What the boxes of a picture share. Each row n is without a power of two, so that its squares are in range."""

    nx: Row  # n₁
    ny: Row  # n₂
    nz: Row  # n₃
    zz: float  # n₃·n₃
    xz: float  # n₁·n₃
    yz: float
    cross_x: float  # |n₁ × n₃|²
    cross_y: float
    scale_x: float  # U is what the rows give, times this
    scale_y: float
    size_x: float  # |n₁|
    size_y: float
    size_z: float
    crosses: float
    width: float  # in pixels
    height: float  # of the whole picture
    first_row: float  # of those that are drawn
    rows: float  # that are drawn
    shift: float  # of the ray in its pixel, in half pixels
    axis: Row  # the direction of the picture's middle, of length 1
    cos: float  # of the widest angle between it and a ray of the picture
    sin: float


def _cone(raster: Raster) -> tuple[Row, float, float]:
    """The axis of a cone that holds all rays of a picture, and cos and sin of its angle, whose widest are corners."""
    (across, up), axes = raster.ends(), axes_of(raster.camera)
    rays = [_unit(directions_of(axes, x, y)) for x in across for y in up]
    axis = _unit([sum(column) for column in zip(*rays, strict=True)])
    cos = min(inner(*axis, *ray) for ray in rays)
    if not cos > 0.0:  # wider than half of all directions: the sum of both angles may be more than half a turn
        return axis, nan, nan
    return axis, cos, sqrt(max(0.0, 1.0 - cos * cos))


def _unit(vector: Iterable[float]) -> Row:
    x, y, z = vector
    length = hypot(x, y, z)
    return (x / length, y / length, z / length) if 0.0 < length < inf else (nan, nan, nan)


class Box(NamedTuple):
    """Columns from left to right, rows from top to bottom, ends excluded: whole numbers, and nothing if left ≥ right.

    known: nothing else can see the sphere; else the box may be too small. ahead: above 0 if all of the sphere is in
    front of the eye, below if all of it is behind.
    """

    left: Number
    right: Number
    top: Number
    bottom: Number
    known: Number
    ahead: Number


@lru_cache(maxsize=8)
def make_lens(raster: Raster) -> Lens:
    """Of a frame that magnifies rounding errors too much, one that knows no box."""
    rows, magnification = inverse_frame(raster.camera) or ([[1.0, 0.0, 0.0]] * 3, inf)
    exponents = [frexp(max(map(abs, row)))[1] for row in rows]
    nx, ny, nz = ((ldexp(x, -e), ldexp(y, -e), ldexp(z, -e)) for (x, y, z), e in zip(rows, exponents, strict=True))
    cross_x, cross_y = cross(nx, nz), cross(ny, nz)
    width, height, shift = float(raster.width), float(raster.whole_height), float(SAMPLINGS[raster.sampling])
    first_row, rows_drawn = float(raster.first_row), float(raster.height)
    up_x, up_y = exponents[0] - exponents[2], exponents[1] - exponents[2]
    if max(abs(up_x), abs(up_y)) > _FARTHEST_APART:
        up_x, up_y, magnification = 0, 0, inf
    return Lens(
        nx, ny, nz, inner(*nz, *nz), inner(*nx, *nz), inner(*ny, *nz), inner(*cross_x, *cross_x),
        inner(*cross_y, *cross_y), ldexp(1.0, up_x), ldexp(1.0, up_y), hypot(*nx), hypot(*ny), hypot(*nz),
        _CROSSES * magnification, width, height, first_row, rows_drawn, shift, *_cone(raster),
    )  # fmt: skip


def beside(lens: Lens, qx: Number, qy: Number, qz: Number, c: Number, square: Number, radius: Number) -> Number:
    """Whether a sphere is certainly beside all rays of the picture, or behind the eye: c and l² as in `certified`.

    The rays that meet it make an angle of at most asin(r/l) with Q, those of the picture one of θ with the axis; so it
    is beside them if the angle between Q and the axis is above the sum of both: axis·Q < l·cos(θ + asin(r/l)).
    """
    along = inner(lens.axis[0], lens.axis[1], lens.axis[2], qx, qy, qz)
    return (c > 0.0) & (along < lens.cos * np.sqrt(c) - lens.sin * radius - _PAD * np.sqrt(square))


def box_of(lens: Lens, qx: Number, qy: Number, qz: Number, radius: Number) -> Box:
    """The box of pixels that may see a sphere, Q = centre − eye and its radius in one unit of length.

    Plain arithmetic (see `twofold`); what is beyond it, or not a number, is not known.
    """
    nx, ny, nz = lens.nx, lens.ny, lens.nz
    x = inner(nx[0], nx[1], nx[2], qx, qy, qz)
    y = inner(ny[0], ny[1], ny[2], qx, qy, qz)
    z = inner(nz[0], nz[1], nz[2], qx, qy, qz)
    r2 = radius * radius
    zz, r2zz = z * z, r2 * lens.zz
    k33 = zz - r2zz
    part, half = 1.0 / k33, radius / k33
    low_x, high_x = _range(x, z, r2, part, half, nx, nz, lens.xz, lens.cross_x, lens.scale_x)
    low_y, high_y = _range(y, z, r2, part, half, ny, nz, lens.yz, lens.cross_y, lens.scale_y)
    # U = (2x + shift − W) / H and V = (H − 2y − shift) / H, solved for x and y
    left, right = _pixels(low_x, high_x, lens.height, lens.width - lens.shift, 0.0, lens.width)
    top, bottom = _pixels(-high_y, -low_y, lens.height, lens.height - lens.shift, lens.first_row, lens.rows)
    known = (k33 > lens.crosses * (zz + r2zz)) & (right >= 0.0) & (bottom >= 0.0)
    return Box(left, right, top, bottom, known, z)


def facet_boxes(lens: Lens, a: np.ndarray) -> np.ndarray:
    """The boxes of pixels that may see triangles, a = corner − eye (n, 3, 3): int32 (n, 4), as for spheres."""
    first, second, third = np.ascontiguousarray(np.moveaxis(a, 0, -1))
    return np.stack(np.broadcast_arrays(*facet_box(lens, first, second, third)), axis=-1).astype(np.int32)


def facet_box(lens: Lens, a: Three, b: Three, c: Three) -> Four:
    """The box of pixels that may see a triangle whose corners are these, as seen from the eye.

    That of a triangle which reaches behind the eye is the whole picture; of one that is all behind it, empty. Plain
    arithmetic (see `twofold`).
    """
    ahead, behind, left, right, top, bottom = _seen_of_corner(lens, a)
    for corner in (b, c):
        front, back, low_x, high_x, low_y, high_y = _seen_of_corner(lens, corner)
        ahead, behind = ahead & front, behind & back
        left, right = select(low_x < left, low_x, left), select(high_x > right, high_x, right)
        top, bottom = select(low_y < top, low_y, top), select(high_y > bottom, high_y, bottom)
    known = ahead & (lens.crosses < inf)
    left, right = _pixels(left, right, lens.height, lens.width - lens.shift, 0.0, lens.width)
    top, bottom = _pixels(top, bottom, lens.height, lens.height - lens.shift, lens.first_row, lens.rows)
    return (
        select(known, left, 0.0), select(known, right, select(behind, 0.0, lens.width)),
        select(known, top, 0.0), select(known, bottom, select(behind, 0.0, lens.rows)),
    )  # fmt: skip


def _seen_of_corner(lens: Lens, a: Three) -> tuple[Number, Number, Number, Number, Number, Number]:
    """Whether a corner is certainly ahead, with a known place on the screen, or behind; and between which U and −V."""
    (ax, ay, az), nx, ny, nz = a, lens.nx, lens.ny, lens.nz
    x, y = inner(nx[0], nx[1], nx[2], ax, ay, az), inner(ny[0], ny[1], ny[2], ax, ay, az)
    z, length = inner(nz[0], nz[1], nz[2], ax, ay, az), np.sqrt(inner(ax, ay, az, ax, ay, az))
    depth = lens.size_z * length
    low_x, high_x = _widened(x, z, length, depth, lens.size_x, lens.scale_x)
    low_y, high_y = _widened(-y, z, length, depth, lens.size_y, lens.scale_y)
    found = (low_x > -inf) & (high_x < inf) & (low_y > -inf) & (high_y < inf)
    return (z > depth * _SHALLOW) & found, z < -(depth * _SHALLOW), low_x, high_x, low_y, high_y


def _widened(
    part: Number, z: Number, length: Number, depth: Number, size: float, scale: float
) -> tuple[Number, Number]:
    """Where a corner is along one axis of the screen, and by how much that may be off."""
    middle, error = scale * (part / z), _PAD + scale * (_PAD * size * length / abs(z))
    error = error + _PAD * abs(middle) * (depth / abs(z))
    return middle - error, middle + error


def _range(
    x: Number, z: Number, r2: Number, part: Number, half: Number, n: Row, nz: Row, dot: float, cross: float,
    scale: float,
) -> tuple[Number, Number]:  # fmt: skip
    """The ellipse's extent along one axis of the screen, padded; `part` is 1 / K₃₃, `half` is r / K₃₃."""
    ax, ay, az = x * nz[0] - z * n[0], x * nz[1] - z * n[1], x * nz[2] - z * n[2]
    root = np.sqrt(inner(ax, ay, az, ax, ay, az) - r2 * cross)
    middle = (x * z - r2 * dot) * part
    wide = half * root * (1.0 + _PAD_HALF) + _PAD * abs(middle)
    return scale * (middle - wide) - _PAD, scale * (middle + wide) + _PAD


def _pixels(low: Number, high: Number, unit: float, offset: float, start: float, size: float) -> tuple[Number, Number]:
    """The first pixel from `low` on, and the one after the last up to `high`, within so many from `start` on."""
    first = np.ceil((low * unit + offset) * 0.5) - start
    end = np.floor((high * unit + offset) * 0.5) + 1.0 - start
    return _clipped(first, size), _clipped(end, size)


def _clipped(x: Number, size: float) -> Number:
    low = select(x > 0.0, x, 0.0 * x)  # what is not a number stays so
    return select(low < size, low, size + 0.0 * low)


def cross(a: Three, b: Three) -> Three:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
