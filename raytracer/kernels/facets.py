"""Triangles as seen from the eye, one after the other: what their pixels have to know of them, and their boxes.

corners   three times x y z each   float64 (n, 3, 3)
  ↓ `facets`, `boxes.facet_box`
table     12 of `Facets.rows`, `distance`, 3 of `zero_side`, the numbers of the corners; FACET each, flat
planes    see `Facets.planes`, flat
away      the corners as seen from the eye and their largest distance, see `full.corners_of`; CORNERS each, flat
boxes     as those of spheres, int32, flat
"""

import numpy as np

from raytracer.arrays import CORNERS, FACET
from raytracer.boxes import facet_box
from raytracer.certified import SMALLEST, inner
from raytracer.facets import (
    measure,
    of_length_1,
    plane_of,
    side_of_edge,
    slope_of,
    unit_normal,
    volume_of,
    zero_side,
)
from raytracer.kernels.compiler import borrowing, inlined


@borrowing
def see_facets(lens, frame, reach, kappa, eye, corners, numbers, volumes, table, planes, away, boxes):
    """Fill table, planes, away and boxes; frame is u, v, −back and w, and `volumes` is V, or NaN.

    Returns how many V are not certain in float64. They are put into `volumes` as NaN, the others as they are.
    """
    unsure, (u, v, ahead, w) = 0, frame
    for i in range(np.uint64(len(corners))):
        triangle = _corner(corners, i, 0), _corner(corners, i, 1), _corner(corners, i, 2)
        of = measure(eye, triangle)
        volume, usual, certain = volume_of(of)
        if not certain:
            volume = volumes[i]
            unsure += np.isnan(volume)
        volumes[i] = volume
        _put_corners(away, np.uint64(CORNERS) * i, eye, triangle)
        at, known = np.uint64(FACET) * i, usual and kappa > 0.0
        slope, distance = slope_of(of, volume, 1.0 / reach)
        table[at + np.uint64(12)] = distance if known else 0.0
        _put(table, at + np.uint64(9), slope, u, v, ahead, known)
        for edge in range(3):
            side = side_of_edge(of, edge, volume, 1.0 / reach)
            _put(table, at + np.uint64(3 * edge), side, u, v, ahead, known)
            table[at + np.uint64(13 + edge)] = zero_side(of, edge, u, v, w)
            table[at + np.uint64(16 + edge)] = numbers[i, edge]
        x, y, z = of.normal
        normal = of_length_1(of.normal) if usual and inner(x, y, z, x, y, z) > SMALLEST else unit_normal(triangle)
        plane = plane_of(normal, of.nearest, volume)
        box = facet_box(lens, of.corners[0], of.corners[1], of.corners[2])
        for side in range(4):
            planes[np.uint64(4) * i + np.uint64(side)] = plane[side]
            boxes[np.uint64(4) * i + np.uint64(side)] = np.int32(box[side]) if volume != 0.0 else np.int32(0)
    return unsure


@inlined
def _corner(corners, i, corner):
    return corners[i, corner, 0], corners[i, corner, 1], corners[i, corner, 2]


@inlined
def _put_corners(away, at, eye, triangle):
    farthest = 0.0
    for corner in triangle:
        x, y, z = corner[0] - eye[0], corner[1] - eye[1], corner[2] - eye[2]
        away[at], away[at + np.uint64(1)], away[at + np.uint64(2)] = x, y, z
        farthest, at = max(farthest, abs(x) + abs(y) + abs(z)), at + np.uint64(3)
    away[at] = farthest


@inlined
def _put(table, at, vector, u, v, ahead, known):
    """What a linear function is of across, of up, and besides."""
    (x, y, z), place = vector, at
    for axis in (u, v, ahead):
        table[place] = inner(x, y, z, axis[0], axis[1], axis[2]) if known else 0.0
        place += np.uint64(1)
