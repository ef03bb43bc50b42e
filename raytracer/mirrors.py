"""Plane mirrors: in one of them the eye sees what it would see of the world's mirror image.

    eye ────── plane ────── mirror image      a ray that is thrown back goes on, unfolded, as if nothing had been there

So eye rays that shapes in one plane throw back share an origin too, and what they may hit next is told by the boxes of
the mirror images on the same screen. Those boxes are sorted into square cells, a list of shapes each (`kernels.cells`).
They only say where to look: whether a ray hits is found from where it starts, as everywhere.

Rounding moves such a ray by less than 2⁻³⁶ of all lengths that come together in it; the images are larger by that.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

import numpy as np

from raytracer.arrays import Cells, Mirrors
from raytracer.boxes import Lens, cross
from raytracer.lookup import resolution_for
from raytracer.scene import Triangles, Vector

_MOST_PLANES = 6  # the walls of a room; shapes in further planes have to do without
_FEW = 8  # shapes that are tested one after the other anyway
_SAME_PLANE = 2.0**-40  # of a normal of length 1; and of a plane's distance from the origin, and of its corners'
_SMALLEST, _LARGEST = 3, 7  # of a cell, as powers of two in pixels: what a kernel does at once lies in one

NO_MIRRORS = Mirrors(np.empty(0, np.int32), Cells(np.empty(0, np.int64), np.empty(0, np.int32), 0, 0), 0)


@lru_cache(maxsize=8)
@np.errstate(all="ignore")
def mirror_planes(triangles: Triangles, spheres: int, unit: int) -> tuple[list[list[float]], np.ndarray]:
    """The planes of the largest triangles that are mirrors, and of each shape the number of its plane, −1 for none.

    Planes are rows n, n·X, lengths in 2**unit (see `units`). The numbers, int32, are those of so many rows of spheres
    and then of the triangles. Where there are few shapes, all is told to be in none.
    """
    numbers = np.full(spheres + len(triangles), -1, np.int32)
    planes: list[list[float]] = []
    if len(numbers) <= _FEW:
        return planes, numbers
    left = np.flatnonzero(triangles.materials.table[triangles.material, 10] > 0.0)
    left = left[np.argsort(-np.ptp(triangles.vertices[left], axis=1).max(axis=1, initial=0.0), kind="stable")]
    corners = np.ldexp(triangles.vertices[left], -unit)
    normals = np.stack(cross(*(np.moveaxis(corners[:, i] - corners[:, 0], -1, 0) for i in (1, 2))), axis=-1)
    normals /= np.abs(normals).max(axis=1, keepdims=True)
    normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    while len(left) and len(planes) < _MOST_PLANES:
        normal, distance = normals[0], normals[0] @ corners[0, 0]
        turned = np.where(normals @ normal < 0.0, -1.0, 1.0)[:, None] * normals
        off, reach = np.abs(corners @ normal - distance), np.abs(corners).sum(axis=2) + abs(distance)
        inside = (np.abs(turned - normal) <= _SAME_PLANE).all(axis=1) & (off <= _SAME_PLANE * reach).all(axis=1)
        inside[0] = True
        numbers[spheres + left[inside]] = len(planes)
        planes.append([*normal.tolist(), float(distance)])
        left, corners, normals = left[~inside], corners[~inside], normals[~inside]
    return planes, numbers


def see_mirrors(
    lens: Lens, eye: Vector, balls: np.ndarray, corners: np.ndarray, triangles: Triangles, unit: int, path: ModuleType
) -> Mirrors:
    """Where on a screen the mirror images of all shapes are: of spheres' `balls` and triangles' corners, in units."""
    shapes, (planes, numbers) = len(balls) + len(corners), mirror_planes(triangles, len(balls), unit)
    if not planes:
        return NO_MIRRORS
    boxes = np.empty((len(planes), shapes, 4), np.int32)
    for plane, own in zip(planes, boxes, strict=True):
        path.bound_images(lens, eye, tuple(plane), balls.reshape(-1), corners, own.reshape(-1))
    edge = int(max(lens.width, lens.rows)) // resolution_for(shapes)
    shift = min(max(edge.bit_length() - 1, _SMALLEST), _LARGEST)
    columns, rows = (-(-int(size) >> shift) for size in (lens.width, lens.rows))
    starts, entries = path.sort_into_cells(boxes, columns, rows, shift, 0)
    return Mirrors(numbers, Cells(starts, entries, columns, columns * rows), shift)
