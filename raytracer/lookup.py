"""Where to look for what a ray from a shape may hit. Kept from picture to picture, as long as the shapes stay.

Rays towards a light: the directions from it are cut into the cells of a cube, each with a list of the shapes that the
light may see there. Each face of the cube is a picture of the shapes as an eye at the light would see it, a cell being
128 × 128 pixels of it, and the boxes of pixels are those of `boxes`, widened from the corners of pixels to all of their
area (see `kernels.cells`).
"""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

import numpy as np

from raytracer.arrays import CELL_BITS, Cells, Tree
from raytracer.boxes import Lens, make_lens
from raytracer.camera import make_raster
from raytracer.scene import Camera, Spheres, Triangles, Vector, vector
from raytracer.walls import Wall, find_walls, walls_of

_MOST = 512  # cells along an edge of the cube
_KEPT = 8  # scenes' cubes, and trees
_LARGE = 8.0  # times the size that half of the shapes do not exceed
_WIDER = 2.0**-46  # of a box, and of its distance from the origin
_ANY_NUMBER = 1 << 62
_ALL_OF_CELL = 0  # as the box of an entry
_MOST_ASKED = 1 << 28  # lights times shapes: beyond, it takes too much memory to know who is asked for walls
_NO_PLANE = (0.0, 0.0, 0.0, 0.0)


def resolution_for(shapes: int) -> int:
    """How many cells an edge of the cube has: the power of two from 2 √shapes on."""
    return min(_MOST, 1 << ((max(4 * shapes, 4) - 1).bit_length() + 1) // 2)


def reach_of(spheres: Spheres, triangles: Triangles, unit: int, eye: Vector) -> float:
    """At least all lengths of a scene, the eye's distance from the origin included: a power of two, in 2**unit.

    Rays are rounded in these; what is kept for one is good for eyes that are not farther away.
    """
    largest = np.ldexp(max(spheres.largest, triangles.largest), -unit)
    return float(np.ldexp(1.0, int(np.frexp(max(largest, *map(abs, eye)))[1]) + 2))


@lru_cache(maxsize=_KEPT)
def light_cells(
    spheres: Spheres, triangles: Triangles, unit: int, reach: float, lights: tuple[Vector, ...], path: ModuleType
) -> tuple[Cells, np.ndarray]:
    """The lists of the cubes of all lights, given by their places, one cube behind the other.

    reach is what `reach_of` says. Each cube ends with one cell more: the list of the light's walls (see `walls`), which
    are in no other. And which shapes are to be asked for those: int32 (lights · shapes,), not 0 where they are; or (0,)
    if none are.
    """
    balls, corners = _in_units(spheres, triangles, unit)
    size, shapes = resolution_for(len(spheres) + len(triangles)), len(balls) + len(corners)
    walls = find_walls(balls, corners, reach) if len(lights) * shapes < _MOST_ASKED else []
    cubes = [_light_cells(balls, corners, walls, reach, np.ldexp(light, -unit), size, path) for light in lights]
    ends = np.cumsum([0, *(len(entries) // 2 for _, entries, _ in cubes)])
    starts = [starts[:-1] + end for (starts, _, _), end in zip(cubes, ends[:-1], strict=True)]
    entries, beyond = (np.concatenate([*(cube[i] for cube in cubes), np.empty(0, np.int32)]) for i in (1, 2))
    if not beyond.any():
        beyond = np.empty(0, np.int32)
    return Cells(np.concatenate([*starts, ends[-1:]]), entries, size, size * size), beyond


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
    balls: np.ndarray,
    corners: np.ndarray,
    walls: list[Wall],
    reach: float,
    light: np.ndarray,
    size: int,
    path: ModuleType,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The cells of a cube's six faces, and of its walls: starts, entries, and which shapes are beyond those.

    A pixel may be seen through all of its area, not from its corner alone.
    """
    rows, beyond = walls_of(walls, light, reach, len(balls) + len(corners))
    boxes = np.empty((6, len(balls) + len(corners), 4), np.int32)
    for lens, face in zip(_lenses(size), boxes, strict=True):
        path.bound_images(lens, vector(light), (*_NO_PLANE, reach), balls.reshape(-1), corners, face.reshape(-1))
    boxes[:, rows] = 0
    starts, entries = path.sort_into_cells(boxes, size, size, CELL_BITS, 1, _ANY_NUMBER)
    last = np.column_stack([rows, np.full(len(rows), _ALL_OF_CELL)]).astype(np.int32)
    return np.append(starts, starts[-1] + len(rows)), np.append(entries, last), beyond


@lru_cache(maxsize=16)
def _lenses(size: int) -> list[Lens]:
    """The faces of a cube of so many cells an edge: those of x, −x, y, −y, z, −z."""
    lenses = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            u, v, w = (np.zeros(3) for _ in range(3))
            u[(axis + 1) % 3], v[(axis + 2) % 3], w[axis] = 1.0, -1.0, -sign
            camera = Camera((0.0, 0.0, 0.0), vector(u), vector(v), vector(w), 90.0)
            lenses.append(make_lens(make_raster(camera, size, size).finer(1 << CELL_BITS)))
    return lenses
