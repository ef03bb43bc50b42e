"""Plane mirrors: in one of them the eye sees what it would see of the world's mirror image.

    eye ────── plane ────── mirror image      a ray that is thrown back goes on, unfolded, as if nothing had been there

So eye rays that shapes in one plane throw back share an origin too, and what they may hit next is told by the boxes of
the mirror images on the same screen. Those boxes are sorted into square cells, a list of shapes each (`kernels.cells`).
They only say where to look: whether a ray hits is found from where it starts, as everywhere.

Rounding moves such a ray by less than 2⁻⁴⁰ of all lengths that come together in it; the images are larger by that.
"""

from __future__ import annotations

from functools import lru_cache
from math import inf
from types import ModuleType

import numpy as np

from raytracer.arrays import CELL_BITS, Cells, Mirrors
from raytracer.boxes import Lens, cross
from raytracer.lookup import resolution_for
from raytracer.scene import Triangles, Vector

_SLIVER = 2.0**-6  # of the square of a triangle's longest edge: of a smaller normal too few digits are known
_MOST_PLANES = 6  # the walls of a room; shapes in further planes have to do without
_FEW = 8  # shapes that are tested one after the other anyway
_SAME_PLANE = 2.0**-46  # of a normal of length 1; and of a plane's distance from the origin, and of its corners'
_MOST_ENTRIES = 1 << 22  # of all lists: more of them take too long to make
_LEAST_BITS = 3  # a cell is at least 2**3 pixels wide: what a kernel does at once lies in one

Plane = tuple[float, float, float, float, float]  # n, n·X, and how far its triangles reach from the origin

NO_MIRRORS = Mirrors(np.empty(0, np.int32), Cells(np.empty(0, np.int64), np.empty(0, np.int32), 0, 0), 0)


@lru_cache(maxsize=8)
@np.errstate(all="ignore")
def mirror_planes(triangles: Triangles, spheres: int, unit: int) -> tuple[list[Plane], np.ndarray]:
    """The planes of the largest triangles that are mirrors, and of each shape the number of its plane, −1 for none.

    Lengths are in 2**unit (see `units`). The numbers, int32, are those of so many rows of spheres and then of the
    triangles. Where there are few shapes, all is told to be in none.
    """
    numbers = np.full(spheres + len(triangles), -1, np.int32)
    planes: list[Plane] = []
    if len(numbers) <= _FEW:
        return planes, numbers
    left = np.flatnonzero(triangles.materials.table[triangles.material, 10] > 0.0)
    corners = np.ldexp(triangles.vertices[left], -unit)
    normals = np.stack(cross(*(np.moveaxis(corners[:, i] - corners[:, 0], -1, 0) for i in (1, 2))), axis=-1)
    sizes = np.sqrt((normals * normals).sum(axis=1))
    edges = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1, initial=0.0)
    order = np.argsort(-edges, kind="stable")
    order = order[(sizes >= _SLIVER * edges)[order] & (sizes > 0.0)[order]]
    left, corners, normals = left[order], corners[order], (normals / sizes[:, None])[order]
    while len(left) and len(planes) < _MOST_PLANES:
        normal, distance = normals[0], normals[0] @ corners[0, 0]
        turned = np.where(normals @ normal < 0.0, -1.0, 1.0)[:, None] * normals
        off, reach = np.abs(corners @ normal - distance), np.abs(corners).sum(axis=2) + abs(distance)
        inside = (np.abs(turned - normal) <= _SAME_PLANE).all(axis=1) & (off <= _SAME_PLANE * reach).all(axis=1)
        inside[0] = True
        numbers[spheres + left[inside]] = len(planes)
        (x, y, z), far = normal.tolist(), reach[inside].max()
        planes.append((x, y, z, float(distance), float(far)))
        left, corners, normals = left[~inside], corners[~inside], normals[~inside]
    return planes, numbers


def see_mirrors(
    lens: Lens, eye: Vector, balls: np.ndarray, corners: np.ndarray, triangles: Triangles, unit: int,
    shown: np.ndarray, path: ModuleType,
) -> Mirrors:  # fmt: skip
    """Where on a screen the mirror images of all shapes are: of spheres' `balls` and triangles' corners, in units.

    shown are the boxes that the triangles themselves have there, int32 (n, 4). None where no mirror is seen, or a
    frame is so flat that boxes are not known.
    """
    shapes, (planes, numbers) = len(balls) + len(corners), mirror_planes(triangles, len(balls), unit)
    if not planes or lens.crosses == inf:
        return NO_MIRRORS
    left, right, top, bottom = shown[numbers[len(balls) :] >= 0].T
    if not ((left < right) & (top < bottom)).any():
        return NO_MIRRORS
    boxes = np.empty((len(planes), shapes, 4), np.int32)
    for plane, own in zip(planes, boxes, strict=True):
        path.bound_images(lens, eye, plane, balls.reshape(-1), corners, own.reshape(-1))
    edge = int(max(lens.width, lens.rows)) // resolution_for(shapes)
    shift = min(max(edge.bit_length() - 1, _LEAST_BITS), CELL_BITS)
    columns, rows = (-(-int(size) >> shift) for size in (lens.width, lens.rows))
    starts, entries = path.sort_into_cells(boxes, columns, rows, shift, 0, _MOST_ENTRIES)
    if not len(starts):
        return NO_MIRRORS
    return Mirrors(numbers, Cells(starts, entries, columns, columns * rows), shift)
