"""Where to look for what a ray from a shape may hit. Kept from picture to picture, as long as the shapes stay.

Rays towards a light: the directions from it are cut into the cells of a cube, each with a list of the shapes that the
light may see there. Each face of the cube is a picture of the shapes as an eye at the light would see it, a cell being
a pixel, and the boxes of pixels are those of `boxes`, widened from the corners of pixels to all of their area.
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

import numpy as np

from raytracer import plain
from raytracer.arrays import Tree
from raytracer.boxes import Lens, facet_boxes, make_lens
from raytracer.camera import make_raster
from raytracer.scene import Camera, Spheres, Triangles, Vector, vector

Cells = tuple[np.ndarray, np.ndarray]  # where each cell's list begins, int64; and the numbers of shapes, int32

_MOST = 512  # cells along an edge of the cube
_KEPT = 8  # scenes' cubes, and trees
_LARGE = 8.0  # times the size that half of the shapes do not exceed
_WIDER = 2.0**-46  # of a box, and of its distance from the origin
_NO_STARTS, _NO_IDS = np.empty(0, np.int64), np.empty(0, np.int32)


def resolution_for(shapes: int) -> int:
    """How many cells an edge of the cube has."""
    return min(_MOST, 1 << max(0, int(np.ceil(np.log2(2.0 * np.sqrt(max(shapes, 1)))))))


@lru_cache(maxsize=_KEPT)
def light_cells(
    spheres: Spheres, triangles: Triangles, unit: int, lights: tuple[Vector, ...], path: ModuleType
) -> Cells:
    """The lists of the cubes of all lights, given by their places, one cube behind the other."""
    balls, corners = _in_units(spheres, triangles, unit)
    cubes = [_light_cells(balls[: len(spheres)], corners, np.ldexp(light, -unit), path) for light in lights]
    ends = np.cumsum([0, *(len(ids) for _, ids in cubes)])
    starts = [starts + end for (starts, _), end in zip(cubes, ends[:-1], strict=True)]
    ids = np.concatenate([*(ids for _, ids in cubes), _NO_IDS])
    return np.concatenate([*starts, _NO_STARTS]), _numbers(ids, spheres)


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


def _light_cells(balls: np.ndarray, corners: np.ndarray, light: np.ndarray, path: ModuleType) -> Cells:
    size = resolution_for(len(balls) + len(corners))
    faces = [_face_boxes(balls, corners, light, size, axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
    starts, ids = path.sort_into_cells(np.stack(faces), size)
    return starts, ids


def _face_boxes(
    balls: np.ndarray, corners: np.ndarray, light: np.ndarray, size: int, axis: int, sign: float
) -> np.ndarray:
    """The boxes of cells of all shapes on one face: int32 (shapes, 4)."""
    u, v, w = (np.zeros(3) for _ in range(3))
    u[(axis + 1) % 3], v[(axis + 2) % 3], w[axis] = 1.0, -1.0, -sign
    camera = Camera((0.0, 0.0, 0.0), vector(u), vector(v), vector(w), 90.0)
    lens = make_lens(make_raster(camera, size, size))
    spheres = _widened(plain.bound(lens, light, balls)[0], size)
    return np.concatenate([spheres, _triangles(lens, light, corners, size)]) if len(corners) else spheres


def _triangles(lens: Lens, light: np.ndarray, corners: np.ndarray, size: int) -> np.ndarray:
    """What both a triangle's corners and a sphere about it allow."""
    middle = corners.mean(axis=1)
    reach = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1)) * (1.0 + 1e-9)
    about = _widened(plain.bound(lens, light, np.column_stack([middle, reach]))[0], size)
    own = _widened(facet_boxes(lens, corners - light), size)
    low, high = np.maximum(about, own), np.minimum(about, own)
    return np.stack([low[:, 0], high[:, 1], low[:, 2], high[:, 3]], axis=-1)


def _widened(boxes: np.ndarray, size: int) -> np.ndarray:
    """From pixels whose corner sees a shape to those of which any part may. Empty boxes between two corners as well."""
    left, right, top, bottom = boxes.T
    hidden = (right == 0) & (left == 0) & (top == 0) & (bottom == 0)
    wide = np.stack([np.maximum(left - 1, 0), right, np.maximum(top - 1, 0), bottom], axis=-1)
    return np.where(hidden[:, None], 0, wide).astype(np.int32)
