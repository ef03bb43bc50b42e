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

import numpy as np

from raytracer import exact
from raytracer.arrays import Facets, Grid, Nearest, Rays, TwofoldRays, View
from raytracer.certified import FACET_ERROR, K_ERROR, LARGEST, SMALLEST, STEEP, Three
from raytracer.plain import update
from raytracer.scene import Camera, vector
from raytracer.twofold import Twofold, add, divide, dot, multiply, two_sum

_NEXT = [1, 2, 0]

TwofoldVector = tuple[Twofold, Twofold, Twofold]
Measures = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def see_facets(grid: Grid | View, kappa: float, origin: np.ndarray, corners: np.ndarray) -> Facets:
    """All triangles (n, 3, 3) as seen from an origin (3,), for the rays of a picture; κ as for `plain.see`."""
    measures = a, edges, sizes, lengths, normals = _measure(origin, corners)
    volume, known, planes = _planes(origin, corners, measures)
    known &= kappa > 0.0
    extent = (lengths[:, 0] * lengths[:, 1])[:, None]
    sign, scale = np.sign(volume)[:, None], np.where(known, 1.0 / grid.reach, 0.0)[:, None]
    sides = np.cross(a, edges) * (sign * scale / (sizes * lengths))[:, :, None]
    vectors = np.concatenate([sides, (normals * (sign * scale / extent))[:, None]], axis=1)
    rows = np.where(known[:, None, None], vectors @ np.array([grid.u, grid.v, np.negative(grid.back)]).T, 0.0)
    distance = np.where(known, np.abs(volume) * (scale / extent)[:, 0], 0.0)
    return Facets(rows.reshape(len(a), 12), distance, planes, volume != 0.0)


def true_zeros(origin: np.ndarray, corners: np.ndarray, camera: Camera) -> np.ndarray:
    """What of e₁, e₂, e₃ of triangles (n, 3, 3) is 0 without any rounding: float64 (n, 3).

    1 + 2 + 4 for what it is of across, of up, and besides. A difference is 0 only if it is so in truth, and a product
    of such; so eᵢ is exactly 0 for rays through edges in the planes of an axis that go through the eye.
    """
    a, edges, i, j = corners - origin, corners[:, _NEXT] - corners, [1, 2, 0], [2, 0, 1]
    side = ((a[..., i] == 0.0) | (edges[..., j] == 0.0)) & ((a[..., j] == 0.0) | (edges[..., i] == 0.0))
    zero = (side[:, :, None] | (np.array([camera.u, camera.v, camera.w]) == 0.0)).all(axis=3)
    return zero @ np.array([1.0, 2.0, 4.0])


def planes_of(origin: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The planes of triangles (n, 3, 3) as seen from an origin (3,): see `Facets.planes`."""
    return _planes(origin, corners, _measure(origin, corners))[2]


def _measure(origin: np.ndarray, corners: np.ndarray) -> Measures:
    """Corners from the origin, edges, how long these are, and normals."""
    a, edges = corners - origin, corners[:, _NEXT] - corners
    return a, edges, _length(a), _length(edges), normals_of(corners)


def _planes(origin: np.ndarray, corners: np.ndarray, measures: Measures) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """V, whether all lengths are of a usual size, and the planes."""
    a, _, sizes, lengths, normals = measures
    nearest = a[np.arange(len(a)), np.argmin(sizes, axis=1)]
    volume, most = _dot(normals, nearest), lengths[:, 0] * lengths[:, 1] * sizes.min(axis=1)
    usual = (sizes > SMALLEST) & (sizes < LARGEST) & (lengths > SMALLEST) & (lengths < LARGEST)
    known = np.asarray(usual.all(axis=1))
    for i in np.flatnonzero(~(np.abs(volume) > STEEP * most) | ~known).tolist():
        volume[i] = _volume(origin, corners[i])
    facing = -np.sign(volume)[:, None] * _unit_normals(corners)
    return volume, known, np.column_stack([facing, _dot(facing, nearest)])


def normals_of(corners: np.ndarray) -> np.ndarray:
    """Normals of triangles (n, 3, 3), of no special length: (n, 3)."""
    normals: np.ndarray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 1])
    return normals


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    """`normals_of`, of length 1, for triangles however large or small."""
    largest = np.abs(corners).max(axis=(1, 2), initial=0.0)
    edges = np.diff(np.ldexp(corners, -np.frexp(largest)[1][:, None, None] - 1), axis=1)
    exponents = np.frexp(np.abs(edges).max(axis=2))[1]
    first, second = np.moveaxis(np.ldexp(edges, -exponents[:, :, None]), 1, 0)
    normals = np.cross(first, second)
    return normals / _length(normals)[:, None]


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
    return (side > FACET_ERROR * size).any(axis=1) & (side < -FACET_ERROR * size).any(axis=1)


def fine_distance(origins: np.ndarray, rays: TwofoldRays, corners: np.ndarray) -> np.ndarray:
    """Where rays (n,) meet the planes of their triangles (n, 3, 3), to the last digit: t = n·a / n·D."""
    first, second, third = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = _fine_cross(_difference(second, first), _difference(third, second))
    x, y, z, x_low, y_low, z_low, _ = rays
    over = _fine_dot(normal, _difference(first, origins))
    return divide(*over, *_fine_dot(normal, ((x, x_low), (y, y_low), (z, z_low))))[0]


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


def _volume(origin: np.ndarray, corners: np.ndarray) -> float:
    """V, rounded once, but never to 0."""
    whole = exact.volume(vector(origin), corners.reshape(-1).tolist())
    sign = float((whole > 0) - (whole < 0))
    try:
        return float(whole) or sign * SMALLEST
    except OverflowError:
        return sign * LARGEST


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product = a * b
    return product[..., 0] + product[..., 1] + product[..., 2]


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(vectors, vectors))
