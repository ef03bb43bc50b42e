"""A picture drawn by functions in the course's own style, which see one ray, one shape or one hit at a time.

`eye_ray`, `intersect`, `intersect_triangle` and `shade` may each be somebody's own; for those that are not given, the
tracer's own parts stand in. Pixels are drawn from coarse to fine: first every eighth of every eighth row, as squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from math import hypot, inf
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from raytracer.arrays import Hits
from raytracer.camera import Vectors, directions_of, eye_grid
from raytracer.facets import normals_of
from raytracer.image import to_bytes
from raytracer.plan import Plan, make_plan
from raytracer.render import colours_of, hits_of, open_tracer
from raytracer.scene import Light, Material, Scene, Shape, Sphere, Triangle, Vector, vector
from raytracer.stages import Block, Whole
from raytracer.trace import ray_intersect_scene

STRIDES = (8, 4, 2, 1)  # pixels from one to the next, pass by pass
BLANK = 40  # the grey of what is not drawn yet
_CHUNK = 256  # pixels that are drawn before anybody is told

Functions = Mapping[str, Callable[..., Any]]


class WrongResultError(Exception):
    """A function has returned what it should not."""

    def __init__(self, function: Callable[..., Any], found: object, expected: str) -> None:
        super().__init__(
            f"{getattr(function, '__name__', 'the function')} returned {_shortened(found)}, expected {expected}"
        )
        self.function = function


class Ray(NamedTuple):
    """origin + t · direction, t > 0. The direction need not be of length 1."""

    origin: Vector
    direction: Vector


@dataclass(frozen=True)
class Hit:
    """What a ray meets first: all that a function `shade` is told."""

    ray: Ray
    t: float
    point: Vector
    normal: Vector  # of length 1: a sphere's outwards, a triangle's to where the ray comes from
    shape: Shape
    scene: Scene
    nearest: Callable[[Ray], Hit | None] = field(repr=False)

    @property
    def material(self) -> Material:
        """diffuse, ambient and specular colour, power and k_refl."""
        return self.shape.material

    @property
    def lights(self) -> tuple[Light, ...]:
        """Those of the scene, each with its position and its colour."""
        return self.scene.lights

    def trace(self, origin: Vector, direction: Vector) -> Hit | None:
        """What another ray meets first, such as one towards a light or off a mirror; None for a miss."""
        return self.nearest(Ray(origin, direction))


def draw_one_by_one(
    functions: Functions, plan: Plan, shaded: bool, tell: Callable[[np.ndarray, float], object]
) -> np.ndarray:
    """The picture of a plan with these functions in place of the tracer's: uint8 (height, width, 3).

    Colours are those of `shade` where `shaded`, of the plan's stage otherwise. `tell(picture, done)` is called now and
    then with the picture as far as it has come, and the part of its pixels that are drawn. Raises `WrongResultError`,
    and whatever the functions raise.
    """
    height, width = plan.raster.height, plan.raster.width
    picture, loop = np.full((height, width, 3), BLANK, np.uint8), _Loop(functions, plan, shaded)
    hits = Hits(np.full((height, width), inf), np.full((height, width), -1, np.int32))
    drawn, at_once = 0, shaded or not plan.stage.needs_whole
    for stride, ys, xs in chunks(height, width):
        block = loop.block(ys, xs)
        hits.t[ys, xs], hits.index[ys, xs] = block.hits
        if at_once:
            for y, x, colour in zip(ys.tolist(), xs.tolist(), loop.colours(block), strict=True):
                picture[y : y + stride, x : x + stride] = colour
        drawn += len(ys)
        tell(picture, drawn / (height * width))
    if not at_once:
        picture[...] = colours_of(
            plan, Block(plan.scene, plan.raster, slice(0, height), hits, plan.lights, whole=Whole(hits))
        )
    return picture


def hits_one_by_one(functions: Functions, plan: Plan) -> Hits:
    """What the eye's rays hit, by these functions: t and index, (height, width)."""
    height, width = plan.raster.height, plan.raster.width
    loop = _Loop(functions, plan, False)
    ys, xs = (grid.reshape(-1) for grid in np.mgrid[0:height, 0:width])
    return Hits(*(array.reshape(height, width) for array in loop.block(ys, xs).hits))


def hits_of_rays(functions: Functions, scene: Scene, origins: np.ndarray, directions: np.ndarray) -> Hits:
    """What rays (n, 3) from origins (n, 3) hit, by these functions: t and index, (n,)."""
    return _Loop(functions, make_plan(scene, "hit", 1, 1), False).traced(origins, directions)


def chunks(height: int, width: int) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """All pixels, each once, coarse ones first: how large they are drawn, rows (n,) and columns (n,)."""
    for stride in STRIDES:
        pixels = (
            (y, x)
            for y in range(0, height, stride)
            for x in range(0, width, stride)
            if stride == STRIDES[0] or y % (2 * stride) or x % (2 * stride)
        )
        while some := list(islice(pixels, _CHUNK)):
            ys, xs = np.array(some, np.intp).T
            yield stride, ys, xs


class _Loop:
    """What all pixels of a picture share."""

    def __init__(self, functions: Functions, plan: Plan, shaded: bool) -> None:
        self._functions, self._plan, self._shaded = functions, plan, shaded
        self._asked = _asked(functions, plan.scene)
        self._truth = hits_of(plan, plan.truth, polished=True) if plan.stage.needs_truth and not shaded else None
        self._hits: Hits | None = None  # of the whole picture, where nobody else is asked for them
        if not functions.keys() & {"eye_ray", "intersect", "intersect_triangle"}:
            with open_tracer(plan) as tracer:
                self._hits = hits_of(plan, tracer)

    def block(self, ys: np.ndarray, xs: np.ndarray) -> Block:
        """Some pixels, and what their rays hit."""
        rays, pixels = self._rays(ys, xs), (ys, xs)
        if self._hits is not None:
            hits = Hits(*(array[pixels] for array in self._hits))
        else:
            directions = np.stack(rays, axis=1)
            hits = self.traced(np.broadcast_to(self._plan.scene.camera.eye, directions.shape), directions)
        truth = None if self._truth is None else Hits(*(array[pixels] for array in self._truth))
        return Block(self._plan.scene, self._plan.raster, ys, hits, self._plan.lights, xs, truth=truth, rays=rays)

    def colours(self, block: Block) -> np.ndarray:
        """uint8 (n, 3)."""
        if not self._shaded:
            return colours_of(self._plan, block)
        shade = self._functions["shade"]
        expected = "a colour, three numbers from 0 to 1"
        shades = [three_numbers(shade, shade(hit), expected) for hit in self._hits_of(block)]
        painted = block.paint(np.array(shades).reshape(-1, 3), elsewhere=self._plan.scene.background)
        return to_bytes(painted)

    def _hits_of(self, block: Block) -> Iterator[Hit]:
        scene, eye = self._plan.scene, self._plan.scene.camera.eye
        with np.errstate(all="ignore"):
            points, normals = block.points.tolist(), block.normals.tolist()
        directions = np.stack(block.rays or (), axis=1)[block.hit].tolist()
        hits = zip(block.hits.t[block.hit].tolist(), block.hits.index[block.hit].tolist(), strict=True)
        for (t, index), direction, point, normal in zip(hits, directions, points, normals, strict=True):
            ray = Ray(eye, tuple(direction))
            yield Hit(ray, t, tuple(point), tuple(normal), scene.shape(index), scene, self._nearest)

    def _rays(self, ys: np.ndarray, xs: np.ndarray) -> Vectors:
        raster, ask = self._plan.raster, self._functions.get("eye_ray")
        if ask is None:
            grid = eye_grid(raster)
            return directions_of(grid.axes, grid.across[xs], grid.up[ys])
        size = raster.width, raster.height
        found = [
            three_numbers(ask, ask(raster.camera, x, y, *size), "a direction, three numbers")
            for y, x in zip(ys.tolist(), xs.tolist(), strict=True)
        ]
        x, y, z = np.array(found).T
        return x, y, z

    def traced(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """What rays (n, 3) from origins (n, 3) hit: by the functions that are there, of other shapes by the tracer."""
        scene, asked = self._plan.scene, self._asked
        balls, corners = (scene.spheres.centres, scene.spheres.radii), scene.triangles.vertices
        if "intersect" in self._functions:
            balls = np.empty((0, 3)), np.empty(0)
        if "intersect_triangle" in self._functions:
            corners = corners[:0]
        orders: list[ArrayLike] = [
            scene.spheres.order[: len(balls[0])],
            scene.triangles.order[: len(corners)],
            [-1],
        ]  # the last for a miss
        found = ray_intersect_scene(origins, directions, *balls, self._plan.method, triangles=corners)
        hits = Hits(found.t, np.concatenate(orders).astype(np.int32)[found.index])
        if asked:
            rays = zip(origins.tolist(), directions.tolist(), strict=True)
            for k, (origin, direction) in enumerate(rays):
                best = _first(Ray(tuple(origin), tuple(direction)), asked, (float(hits.t[k]), int(hits.index[k])))
                hits.t[k], hits.index[k] = best
        return hits

    def _nearest(self, ray: Ray) -> Hit | None:
        """What a ray from anywhere meets first."""
        scene, hits = self._plan.scene, self.traced(np.array([ray.origin], float), np.array([ray.direction], float))
        t, index = float(hits.t[0]), int(hits.index[0])
        if index < 0:
            return None
        shape, point = scene.shape(index), _along(ray, t)
        return Hit(ray, t, point, normal_of(shape, point, ray), shape, scene, self._nearest)


Asked = tuple[int, Shape, Callable[[Ray, Shape], object]]  # a shape's place, the shape, and who says where it is met


def _asked(functions: Functions, scene: Scene) -> list[Asked]:
    """The shapes that a function of somebody's own is asked about."""
    names = {Sphere: "intersect", Triangle: "intersect_triangle"}
    if not functions.keys() & set(names.values()):
        return []
    shapes = ((index, scene.shape(index)) for index in range(len(scene)))
    return [(i, shape, functions[names[type(shape)]]) for i, shape in shapes if names[type(shape)] in functions]


def _first(ray: Ray, asked: list[Asked], best: tuple[float, int]) -> tuple[float, int]:
    """The smallest t, and the place of its shape; of equal ones the shape that comes first."""
    for index, shape, ask in asked:
        t = ask(ray, shape)
        if t is None or (isinstance(t, bool | np.bool_) and not t):  # who only asks whether it is hit says False
            continue
        if not isinstance(t, Real | np.bool_):
            raise WrongResultError(ask, t, "t, a number, or None for a miss")
        if t < best[0] or (t == best[0] and index < best[1]):
            best = float(t), index
    return best


def normal_of(shape: Shape, point: Vector, ray: Ray) -> Vector:
    """The unit normal of a shape at a point: a sphere's outwards, a triangle's to where the ray comes from."""
    if isinstance(shape, Sphere):
        normal = np.subtract(point, shape.centre)
    else:
        normal = normals_of(np.array([shape.vertices]))[0]
        normal = -normal if normal @ np.array(ray.direction) > 0 else normal
    return vector(normal / hypot(*normal))


def three_numbers(function: Callable[..., Any], found: Any, expected: str) -> Vector:
    """What a function has returned, as a vector or a colour. Raises `WrongResultError`."""
    try:
        x, y, z = found
        return float(x), float(y), float(z)
    except (TypeError, ValueError):
        raise WrongResultError(function, found, expected) from None


def _along(ray: Ray, t: float) -> Vector:
    x, y, z = (o + t * d for o, d in zip(ray.origin, ray.direction, strict=True))
    return x, y, z


def _shortened(found: object) -> str:
    text = f"{found.dtype} {found.shape}" if isinstance(found, np.ndarray) else repr(found)
    return text if len(text) <= 60 else f"{text[:59]}…"
