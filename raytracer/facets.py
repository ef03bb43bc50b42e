"""Triangles as seen from one origin, which eye rays share: four linear functions of a ray's direction each.

With a, b, c from the origin to the corners, V = a·(b × c) and n = (b − a) × (c − b),

    eᵢ = D·(aᵢ × aᵢ₊₁)      on which side of an edge a ray passes      all eᵢ / V ≥ 0: it meets the triangle
    t = n·a / n·D           where it meets the plane

(A. Möller, B. Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997, with the volumes of J. Amanatides and
K. Choi, 1995.) The products are taken with edges in place of corners, aᵢ × (aᵢ₊₁ − aᵢ), which loses no digits for
triangles that are small and far away. Each function is divided by the largest value that it can have, so that one
bound of the error is good for all, and by V's sign.

Triangles whose plane goes through the origin are met by no ray. Where float64 does not know, V comes from integers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer import exact
from raytracer.arrays import Facets, Grid, Nearest, Rays, TwofoldRays
from raytracer.boxes import cross
from raytracer.certified import FACET_ERROR, K_ERROR, LARGEST, SMALLEST, STEEP, Three
from raytracer.methods import inner, minus, scaled
from raytracer.plain import update
from raytracer.scene import vector
from raytracer.twofold import Number, Twofold, add, divide, dot, exponent, multiply, select, two_sum

_NEXT = [1, 2, 0]

TwofoldVector = tuple[Twofold, Twofold, Twofold]
ThreeVectors = tuple[Three, Three, Three]
Four = tuple[Number, Number, Number, Number]


class Measures(NamedTuple):
    """A triangle's corners from the origin, its edges, how long these are, a normal, and the nearest corner."""

    corners: ThreeVectors
    edges: ThreeVectors
    sizes: Three
    lengths: Three
    normal: Three
    nearest: Three
    size: Number  # of the nearest corner


def measure(origin: Three, corners: ThreeVectors) -> Measures:
    """Plain arithmetic (see `twofold`), as all down to `zero_sides`."""
    a, b, c = corners
    ab, bc, ca = minus(b, a), minus(c, b), minus(a, c)
    a, b, c = minus(a, origin), minus(b, origin), minus(c, origin)
    x, y, z = _size(a), _size(b), _size(c)
    second, third = y < x, z < select(y < x, y, x)
    nearest = (
        select(third, c[0], select(second, b[0], a[0])),
        select(third, c[1], select(second, b[1], a[1])),
        select(third, c[2], select(second, b[2], a[2])),
    )
    size = select(third, z, select(second, y, x))
    return Measures((a, b, c), (ab, bc, ca), (x, y, z), (_size(ab), _size(bc), _size(ca)), cross(ab, bc), nearest, size)


def volume_of(of: Measures) -> tuple[Number, Number, Number]:
    """V, whether all lengths are of a usual size, and whether V's sign is certain too."""
    volume, usual = inner(of.normal, of.nearest), _usual(of.sizes) & _usual(of.lengths)
    return volume, usual, usual & (abs(volume) > STEEP * (of.lengths[0] * of.lengths[1] * of.size))


def plane_of(normal: Three, nearest: Three, volume: Number) -> Four:
    """A row of `Facets.planes`, for a normal of length 1."""
    sign = -sign_of(volume)
    x, y, z = sign * normal[0], sign * normal[1], sign * normal[2]
    return x, y, z, inner((x, y, z), nearest)


def unit_normal(corners: ThreeVectors) -> Three:
    """The normal of length 1 of a triangle however large or small."""
    a, b, c = corners
    down = -exponent(_larger(_larger(_largest(a), _largest(b)), _largest(c))) - 1
    a, b, c = scaled(a, down), scaled(b, down), scaled(c, down)
    ab, bc = minus(b, a), minus(c, b)
    return of_length_1(cross(scaled(ab, -exponent(_largest(ab))), scaled(bc, -exponent(_largest(bc)))))


def of_length_1(normal: Three) -> Three:
    """`unit_normal` from a normal of usual size: the same bits, as powers of two change none."""
    size = _size(normal)
    return normal[0] / size, normal[1] / size, normal[2] / size


def side_of_edge(of: Measures, i: int, volume: Number, over_reach: Number) -> Three:
    """eᵢ as a vector, of which a ray's direction makes a number."""
    x, y, z = cross(of.corners[i], of.edges[i])
    by = sign_of(volume) * over_reach / (of.sizes[i] * of.lengths[i])
    return x * by, y * by, z * by


def slope_of(of: Measures, volume: Number, over_reach: Number) -> tuple[Three, Number]:
    """n as a vector likewise, and n·a in its unit."""
    (x, y, z), extent = of.normal, of.lengths[0] * of.lengths[1]
    by = sign_of(volume) * over_reach / extent
    return (x * by, y * by, z * by), abs(volume) * (over_reach / extent)


def zero_side(of: Measures, i: int, u: Three, v: Three, w: Three) -> Number:
    """What of eᵢ is 0 without any rounding: 1 + 2 + 4 for what it is of across, of up, and besides.

    A difference is 0 only if it is so in truth, and a product of such; so eᵢ is exactly 0 for rays through edges in the
    planes of an axis that go through the eye.
    """
    a, e = of.corners[i], of.edges[i]
    x = ((a[1] == 0.0) | (e[2] == 0.0)) & ((a[2] == 0.0) | (e[1] == 0.0))
    y = ((a[2] == 0.0) | (e[0] == 0.0)) & ((a[0] == 0.0) | (e[2] == 0.0))
    z = ((a[0] == 0.0) | (e[1] == 0.0)) & ((a[1] == 0.0) | (e[0] == 0.0))
    return _if_all_vanish(x, y, z, u, 1.0) + _if_all_vanish(x, y, z, v, 2.0) + _if_all_vanish(x, y, z, w, 4.0)


def _if_all_vanish(x: Number, y: Number, z: Number, axis: Three, number: float) -> Number:
    return select((x | (axis[0] == 0.0)) & (y | (axis[1] == 0.0)) & (z | (axis[2] == 0.0)), number, 0.0)


def sign_of(x: Number) -> Number:
    """−1, 0 or 1."""
    return select(x > 0.0, 1.0, select(x < 0.0, -1.0, 0.0))


def _size(a: Three) -> Number:
    return np.sqrt(inner(a, a))


def _largest(a: Three) -> Number:
    return _larger(_larger(abs(a[0]), abs(a[1])), abs(a[2]))


def _larger(a: Number, b: Number) -> Number:
    return select(a < b, b, a)


def _usual(sizes: Three) -> Number:
    least = select(sizes[1] < sizes[0], sizes[1], sizes[0])
    least, most = select(sizes[2] < least, sizes[2], least), _larger(_larger(sizes[0], sizes[1]), sizes[2])
    return (least > SMALLEST) & (most < LARGEST)


def see_facets(grid: Grid, kappa: float, origin: np.ndarray, corners: np.ndarray) -> Facets:
    """All triangles (n, 3, 3) as seen from an origin (3,), for the rays of a picture; κ as for `plain.see`."""
    of, volume, usual = _measured(origin, corners)
    over_reach = np.where(usual & (kappa > 0.0), 1.0 / grid.reach, 0.0)
    normal, distance = slope_of(of, volume, over_reach)
    vectors = [side_of_edge(of, i, volume, over_reach) for i in range(3)] + [normal]
    axes = grid.u, grid.v, tuple(np.negative(grid.back))
    parts = [inner(vector, axis) for vector in vectors for axis in axes]
    rows = np.where(over_reach > 0.0, parts, 0.0).T
    planes = np.column_stack(plane_of(unit_normal(vectors_of(corners)), of.nearest, volume))
    return Facets(rows, np.where(over_reach > 0.0, distance, 0.0), planes, volume != 0.0)


def planes_of(origin: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The planes of triangles (n, 3, 3) as seen from an origin (3,): see `Facets.planes`."""
    of, volume, _ = _measured(origin, corners)
    return np.column_stack(plane_of(unit_normal(vectors_of(corners)), of.nearest, volume))


def _measured(origin: np.ndarray, corners: np.ndarray) -> tuple[Measures, np.ndarray, np.ndarray]:
    """Measures, V and whether all lengths are of a usual size."""
    of = measure(vector(origin), vectors_of(corners))
    volume, usual, certain = volume_of(of)
    for i in np.flatnonzero(~certain):
        volume[i] = exact_volume(origin, corners[i])
    return of, volume, usual


def vectors_of(corners: np.ndarray) -> ThreeVectors:
    """Triangles (n, 3, 3) as three corners of three arrays (n,) each."""
    a, b, c = (tuple(corner) for corner in np.ascontiguousarray(np.moveaxis(corners, 0, -1)))
    return a, b, c


def normals_of(corners: np.ndarray) -> np.ndarray:
    """Normals of triangles (n, 3, 3), of no special length: (n, 3)."""
    normals: np.ndarray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    return normals


def nearest_facets(origins: np.ndarray, rays: Rays, corners: np.ndarray, nearest: Nearest, number: int) -> None:
    """What rays (n,) from origins (n, 3) meet of triangles (m, 3, 3), beside what they have met already, in place.

    The first triangle has this number.
    """
    direction = np.stack(rays[:3], axis=-1)
    for i, triangle in enumerate(corners):
        update(nearest, *_meet(origins, direction, rays.reach, triangle), number + i)


def _meet(origins: np.ndarray, direction: np.ndarray, reach: np.ndarray, triangle: np.ndarray) -> Three:
    """`certified.meet` for rays (n,) and a triangle (3, 3): t, a bound of its error, and `low`: 0 if not certain."""
    a, edges = triangle - origins[:, None], triangle[_NEXT] - triangle
    sizes, lengths, extent = _length(a), _length(edges), _length(edges[:1]) * _length(edges[1:2])
    normal = normals_of(triangle[None])[0]
    nearest = a[np.arange(len(a)), np.argmin(sizes, axis=1)]
    volume, slope = _dot(normal, nearest) / (extent * sizes.min(axis=1)), _dot(normal, direction) / (extent * reach)
    sides = _dot(np.cross(a, edges), direction[:, None]) / (sizes * lengths * reach[:, None]) * np.sign(volume)[:, None]
    least, most, slope = sides.min(axis=1), sides.max(axis=1), slope * np.sign(volume)
    beside = (least < -FACET_ERROR) & ((most > FACET_ERROR) | (np.abs(volume) > STEEP))
    sure = (least > FACET_ERROR) & (np.abs(volume) > STEEP) & (slope > STEEP)
    t = np.abs(volume) * sizes.min(axis=1) / (slope * reach)
    return np.where(sure, t, np.inf), np.where(sure, K_ERROR * t, 0.0), np.where(sure | beside, np.inf, 0.0)


def certain_misses(origins: np.ndarray, rays: TwofoldRays, corners: np.ndarray) -> np.ndarray:
    """Which rays (n,) certainly pass beside their triangles (n, 3, 3): bool (n,)."""
    a, edges = corners - origins[:, None], corners[:, _NEXT] - corners
    size = _length(a) * _length(edges) * rays.reach[:, None]
    side = _dot(np.cross(a, edges), np.stack(rays[:3], axis=-1)[:, None])
    missed: np.ndarray = (side > FACET_ERROR * size).any(axis=1) & (side < -FACET_ERROR * size).any(axis=1)
    return missed


def fine_distance(origins: np.ndarray, rays: TwofoldRays, corners: np.ndarray) -> np.ndarray:
    """Where rays (n,) meet the planes of their triangles (n, 3, 3), to the last digit: t = n·a / n·D."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = _fine_cross(_difference(second, first), _difference(third, second))
    x, y, z, x_low, y_low, z_low, _ = rays
    over = _fine_dot(normal, _difference(first, origins))
    t: np.ndarray = divide(*over, *_fine_dot(normal, ((x, x_low), (y, y_low), (z, z_low))))[0]
    return t


def _difference(a: np.ndarray, b: np.ndarray) -> TwofoldVector:
    x, y, z = (two_sum(a[:, axis], -b[:, axis]) for axis in range(3))
    return x, y, z


def _fine_cross(a: TwofoldVector, b: TwofoldVector) -> TwofoldVector:
    def component(i: int, j: int) -> Twofold:
        minus, minus_low = multiply(*a[j], *b[i])
        return add(*multiply(*a[i], *b[j]), -minus, -minus_low)

    return component(1, 2), component(2, 0), component(0, 1)


def _fine_dot(a: TwofoldVector, b: TwofoldVector) -> Twofold:
    (ax, ax_low), (ay, ay_low), (az, az_low) = a
    (bx, bx_low), (by, by_low), (bz, bz_low) = b
    return dot(ax, ay, az, ax_low, ay_low, az_low, bx, by, bz, bx_low, by_low, bz_low)


def exact_volume(origin: np.ndarray, corners: np.ndarray) -> float:
    """V of a triangle (3, 3), rounded once, but never to 0."""
    whole = exact.volume(vector(origin), corners.reshape(-1).tolist())
    sign = float((whole > 0) - (whole < 0))
    try:
        return float(whole) or sign * SMALLEST
    except OverflowError:
        return sign * LARGEST


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product = a * b
    dot: np.ndarray = product[..., 0] + product[..., 1] + product[..., 2]
    return dot


def _length(vectors: np.ndarray) -> np.ndarray:
    length: np.ndarray = np.sqrt(_dot(vectors, vectors))
    return length
