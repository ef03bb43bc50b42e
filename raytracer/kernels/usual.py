"""The loops of `raytracer.plain` for the usual methods, compiled: one kernel a method, built from its row."""

import numpy as np
from numba.extending import register_jitable

from raytracer.kernels.compiler import compiled
from raytracer.methods import METHODS


def usual_eye(method, origin, rays, spheres, boxes, first_row, t, index):
    """`plain.usual_eye`."""
    _EYE[method](origin, rays, spheres, boxes, first_row, t, index)


def usual_given(method, origins, rays, spheres, t, index):
    """`plain.usual_given`."""
    _GIVEN[method](origins, rays, spheres, t, index)


@register_jitable
def _at(vector, p):
    """Ray p of x, y, z."""
    return vector[0][p], vector[1][p], vector[2][p]


@register_jitable
def _flat(vector):
    return vector[0].reshape(-1), vector[1].reshape(-1), vector[2].reshape(-1)


# What a kernel closes over is a function that can be found again by its name, so that numba can keep the machine code.


def _build_eye(function, twofold):
    @compiled
    def eye(origin, rays, spheres, boxes, first_row, t, index):
        centres, radii = spheres
        rows, width = t.shape
        t, index, direction, low = t.reshape(-1), index.reshape(-1), _flat(rays[0]), _flat(rays[-1])
        for i in range(len(radii)):
            centre, r = (centres[i, 0], centres[i, 1], centres[i, 2]), radii[i]
            for y in range(max(boxes[i, 2] - first_row, 0), min(boxes[i, 3] - first_row, rows)):
                start = np.uint64(y) * np.uint64(width)
                for p in range(start + np.uint64(boxes[i, 0]), start + np.uint64(boxes[i, 1])):
                    if twofold:
                        found = function(origin, _at(direction, p), _at(low, p), centre, r)
                    else:
                        found = function(origin, _at(direction, p), centre, r)
                    wins = found < t[p]
                    t[p] = found if wins else t[p]
                    index[p] = i if wins else index[p]

    return eye


def _build_given(function, twofold):
    @compiled
    def given(origins, rays, spheres, t, index):
        centres, radii = spheres
        for p in range(len(t)):
            origin = origins[p, 0], origins[p, 1], origins[p, 2]
            for i in range(len(radii)):
                centre = centres[i, 0], centres[i, 1], centres[i, 2]
                if twofold:
                    found = function(origin, _at(rays[0], p), _at(rays[-1], p), centre, radii[i])
                else:
                    found = function(origin, _at(rays[0], p), centre, radii[i])
                if found < t[p]:
                    t[p] = found
                    index[p] = i

    return given


_USUAL = {name: method for name, method in METHODS.items() if method.function is not None}
_EYE = {name: _build_eye(method.function, method.twofold) for name, method in _USUAL.items()}
_GIVEN = {name: _build_given(method.function, method.twofold) for name, method in _USUAL.items()}
