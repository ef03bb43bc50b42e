"""Where to look for what a ray from a shape may hit. Kept from picture to picture, as long as the shapes stay.

Rays towards a light: the directions from it are cut into the cells of a cube, each with a list of the shapes that the
light may see there. Each face of the cube is a picture of the shapes as an eye at the light would see it, a cell being
a pixel, and the boxes of pixels are those of `boxes`, widened from the corners of pixels to all of their area.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

import numpy as np

from raytracer.arrays import Cells, Tree
from raytracer.boxes import Lens, make_lens
from raytracer.camera import make_raster
from raytracer.scene import Camera, Spheres, Triangles, Vector, vector

_MOST = 512  # cells along an edge of the cube
_KEPT = 8  # scenes' cubes, and trees
_LARGE = 8.0  # times the size that half of the shapes do not exceed
_WIDER = 2.0**-46  # of a box, and of its distance from the origin
_SHIFT = 7  # a cell is 2**_SHIFT pixels wide and high
_NO_PLANE = (0.0, 0.0, 0.0, 0.0)


def resolution_for(shapes: int) -> int:
    """How many cells an edge of the cube has: the power of two from 2 √shapes on."""
    return min(_MOST, 1 << ((max(4 * shapes, 4) - 1).bit_length() + 1) // 2)


@lru_cache(maxsize=_KEPT)
def light_cells(
    spheres: Spheres, triangles: Triangles, unit: int, lights: tuple[Vector, ...], path: ModuleType
) -> Cells:
    """The lists of the cubes of all lights, given by their places, one cube behind the other."""
    balls, corners = _in_units(spheres, triangles, unit)
    size = resolution_for(len(spheres) + len(triangles))
    cubes = [_light_cells(balls, corners, np.ldexp(light, -unit), size, path) for light in lights]
    ends = np.cumsum([0, *(len(entries) // 2 for _, entries in cubes)])
    starts = [starts[:-1] + end for (starts, _), end in zip(cubes, ends[:-1], strict=True)]
    entries = np.concatenate([*(entries for _, entries in cubes), np.empty(0, np.int32)])
    return Cells(np.concatenate([*starts, ends[-1:]]), entries, size, size * size)


@lru_cache(maxsize=_KEPT)
def tree_of(spheres: Spheres, triangles: Triangles, unit: int, path: ModuleType) -> Tree:
    """The tree over all shapes, which are numbered as in `View.balls`."""
    balls, corners = _in_units(spheres, triangles, unit)
    centres, radii = balls[: len(spheres), :3], balls[: len(spheres), 3:]
    low = np.concatenate([centres - radii, corners.min(axis=1, initial=np.inf)])
    high = np.concatenate([centres + radii, corners.max(axis=1, initial=-np.inf)])
    wider = _WIDER * (np.abs(low) + np.abs(high)).sum(axis=1, keepdims=True)
    about = np.column_stack([(low + high) / 2.0, (high - low).max(axis=1) / 2.0])
    order = _order(path.along_curve(about), about[:, 3]) if len(about) else np.empty(0, np.int64)
    tree: Tree = path.enclose(low - wider, high + wider, order, np.empty(0))
    return tree._replace(ids=_numbers(tree.ids, spheres))


def _numbers(places: np.ndarray, spheres: Spheres) -> np.ndarray:
    """The numbers in `View.balls` of shapes of which the triangles follow the spheres at once: int32."""
    return np.where(places < len(spheres), places, places + (len(spheres.balls) - len(spheres))).astype(np.int32)


def _in_units(spheres: Spheres, triangles: Triangles, unit: int) -> tuple[np.ndarray, np.ndarray]:
    """Balls and corners, counted in 2**unit (see `units`)."""
    return np.ldexp(spheres.balls, -unit), np.ldexp(triangles.vertices, -unit)


def _order(along: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Shapes along the curve, and those much larger than most in leaves of their own, which else all be as large."""
    order = np.argsort(along)
    large = (sizes > _LARGE * np.median(sizes))[order]
    empty = np.full(-np.count_nonzero(~large) % 8, -1)
    return np.concatenate([order[~large], empty, order[large]])


def _light_cells(
    balls: np.ndarray, corners: np.ndarray, light: np.ndarray, size: int, path: ModuleType
) -> tuple[np.ndarray, np.ndarray]:
    """The cells of a cube's six faces: a pixel may be seen through all of its area, not from its corner alone."""
    boxes = np.empty((6, len(balls) + len(corners), 4), np.int32)
    for lens, face in zip(_lenses(size), boxes, strict=True):
        path.bound_images(lens, vector(light), _NO_PLANE, balls.reshape(-1), corners, face.reshape(-1))
    starts, entries = path.sort_into_cells(boxes, size, size, _SHIFT, 1)
    return starts, entries


@lru_cache(maxsize=16)
def _lenses(size: int) -> list[Lens]:
    """The faces of a cube of so many cells an edge: those of x, −x, y, −y, z, −z."""
    lenses = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            u, v, w = (np.zeros(3) for _ in range(3))
            u[(axis + 1) % 3], v[(axis + 2) % 3], w[axis] = 1.0, -1.0, -sign
            camera = Camera((0.0, 0.0, 0.0), vector(u), vector(v), vector(w), 90.0)
            lenses.append(make_lens(make_raster(camera, size, size).finer(1 << _SHIFT)))
    return lenses
