"""The rays behind one pixel at the stage `full`: the eye's, those towards the lights, and those off mirrors.

    colour = Σ over the rays of share · (ambient + what each light adds), or share · background for one that misses

This is `full.World` once more, by the same formulas, and where that only adds up, this keeps what it adds: one ray at a
time, all shapes at once, where a picture takes all rays at once, one shape after the other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from raytracer.bounce import (
    MOST_REFLECTIONS,
    away_from,
    blocks_sphere,
    land_again,
    meet_sphere,
    plane_ahead,
    reflected,
    size_of,
    within_edges,
)
from raytracer.certified import inner
from raytracer.full import World
from raytracer.scene import Colour, Light, Shape, Vector, vector
from raytracer.shading import Three, highlight, land_on_any, towards, unit_of
from raytracer.stages import Block


@dataclass(frozen=True)
class LightRay:
    """A ray from a hit to a light.

    Nothing is looked for between the two where the light would add nothing anyway: where it shines on the other side.
    """

    position: Vector
    light: Colour
    cosine: float  # N·L, also below 0
    halfway: float  # max(0, H·N)
    blocker: int | None  # which shape stands between, the one nearest to the hit: its place in the file
    stop: Vector  # where that shape is met; else the light's position
    adds: Colour  # to the pixel's colour

    @property
    def is_behind(self) -> bool:
        """Whether the light shines on the other side of the surface."""
        return self.blocker is None and not self.cosine > 0.0 and not any(self.adds)


@dataclass(frozen=True)
class Hit:
    """What a ray meets. Of the ambient colour and the lights, what they add to the pixel's colour."""

    index: int  # the shape's place among all shapes of the file
    shape: Shape
    point: Vector
    normal: Vector  # of length 1; a sphere's outwards, a triangle's to where the ray came from
    ambient: Colour
    lights: tuple[LightRay, ...]


@dataclass(frozen=True)
class Ray:
    """The eye's ray, or one off a mirror. What a ray brings back is weighed by its share of the pixel's colour."""

    origin: Vector
    direction: Vector  # of any length
    k_refl: float  # of the mirror that threw it back, 1 for the eye's
    share: float  # the product of all k_refl so far
    hit: Hit | None  # None for a miss
    adds: Colour  # to the pixel's colour: what the hit shows by itself, without its mirror, or the background


class _Landing(NamedTuple):
    """Where a ray has landed, as `World` has it: in its units, as seen from the eye, arrays of one."""

    p: Three
    n: Three
    radius: np.ndarray
    d: Three  # of the ray that came
    where: np.ndarray  # the shape's number


def rays_of(block: Block, x: int, direction: Vector) -> tuple[Ray, ...]:
    """The eye's ray through column x of a block of one row, and those off mirrors, in their order: 1 to 11 rays."""
    if not block.hit[0, x]:
        return (Ray(block.scene.camera.eye, direction, 1.0, 1.0, None, block.scene.background),)
    k = int(np.count_nonzero(block.hit[0, :x]))
    t, (dx, dy, dz), where = block.arrivals
    one = slice(k, k + 1)
    return tuple(_follow(block.world, block.lights, t[one], (dx[one], dy[one], dz[one]), where[one]))


def _follow(world: World, lights: tuple[Light, ...], t: np.ndarray, d: Three, where: np.ndarray) -> Iterator[Ray]:
    """The rays from an eye ray D on that meets shape `where` at t: arrays of one, as for `World.radiance`."""
    share, k_refl, start = 1.0, 1.0, world.scene.camera.eye
    landing = _Landing(*land_on_any(t, d, world.eye, world.row_of(where), where >= world.first_facet), d, where)
    for bounce in range(MOST_REFLECTIONS + 1):
        hit = _look_about(world, lights, landing, share)
        yield Ray(start, _vector(landing.d), k_refl, share, hit, _sum([hit.ambient, *(ray.adds for ray in hit.lights)]))
        k_refl, start = max(hit.shape.material.k_refl, 0.0), hit.point
        share *= k_refl
        if bounce == MOST_REFLECTIONS or not share > 0.0:
            return
        d, thrown = _throw_back(world, landing)
        if thrown is None:
            yield Ray(start, _vector(d), k_refl, share, None, vector(share * np.array(world.scene.background)))
            return
        landing = thrown


def _look_about(world: World, lights: tuple[Light, ...], landing: _Landing, share: float) -> Hit:
    """What there is to see where a ray has landed."""
    order, material = (int(column[landing.where[0]]) for column in world.scene.numbered)
    shape, ambient = world.scene.shape(order), world.surfaces[3 * material + 1, :3]
    point = _in_scene(world, np.array(_vector(landing.p)))
    normal = np.array(_vector(landing.n)) / landing.radius
    places = (place for place, _ in world.lights)
    seen = tuple(_look_at(world, landing, *pair, share) for pair in zip(lights, places, strict=True))
    return Hit(order, shape, point, vector(normal), vector(share * ambient), seen)


def _look_at(world: World, landing: _Landing, light: Light, place: Three, share: float) -> LightRay:
    """The ray to a light whose place is as seen from the eye."""
    p, n, radius, d, where = landing
    material = 3 * int(world.scene.numbered[1][where[0]])
    diffuse, shiny, unit = world.surfaces[material], world.surfaces[material + 2], unit_of(d)
    facing, square = towards(p, n, place)
    halfway = highlight(p, n, radius, place, square, unit)
    shine, spark = world.answers(p, n, radius, unit, place, shiny[None, :3], diffuse[3:])
    blocker, stop, adds = None, light.position, np.zeros(3)
    if shine > 0.0 or spark > 0.0:
        way = place[0] - p[0], place[1] - p[1], place[2] - p[2]
        number, part = _nearest_blocker(world, p, way, where) if world.terms.shadows else (-1, 1.0)
        if number < 0:
            adds = share * (np.array(light.colour) * (diffuse[:3] * shine + shiny[:3] * spark))
        else:
            blocker = int(world.scene.numbered[0][number])
            stop = _in_scene(world, np.array(_vector(p)) + part * np.array(_vector(way)))
    cosine = float((facing / (radius * np.sqrt(square)))[0])
    return LightRay(light.position, light.colour, cosine, float(halfway[0]), blocker, stop, vector(adds))


def _nearest_blocker(world: World, p: Three, way: Three, where: np.ndarray) -> tuple[int, float]:
    """The first shape on the way from P to a light, and at which part of the way; −1 and 1 where there is none."""
    t, blocks = _meet_all(world, p, way, where, np.array([False]))
    if not blocks.any():
        return -1, 1.0
    t = np.where(blocks, np.minimum(t, 1.0), np.inf)
    return int(np.argmin(t)), float(t.min())


def _throw_back(world: World, landing: _Landing) -> tuple[Three, _Landing | None]:
    """The direction in which a mirror throws a ray back, and where that lands, if anywhere."""
    p, n, radius, d, where = landing
    d, facing = reflected(d, n, radius)
    t, _ = _meet_all(world, p, d, where, facing < 0.0)
    found = np.array([np.argmin(t)], np.int32)
    if not t[found] < np.inf:
        return d, None
    again = land_again(t[found], p, d, world.row_of(found), world.eye, found >= world.first_facet)
    return d, _Landing(*again, d, found)


def _meet_all(
    world: World, p: Three, d: Three, where: np.ndarray, from_outside: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """t of a ray from P on shape `where` for each shape, +inf for none; which stand between P and P + D: (shapes,)."""
    first, planes, a, size = world.first_facet, world.rows[world.first_facet :].T, inner(*d, *d), size_of(p)
    x, y, z, radius = world.rows[:first].T
    own, o = where == np.arange(len(world.rows)), away_from((x, y, z, radius), p, world.eye)
    t = meet_sphere(o, d, a, 1.0 / a, radius, size, own[:first], from_outside)
    blocks = blocks_sphere(o, d, a, 1.0 / a, radius, size, own[:first])
    over, under = plane_ahead(
        p, d, (planes[0], planes[1], planes[2], planes[3]), world.corners[:, 9], size, own[first:]
    )
    ax, ay, az, bx, by, bz, cx, cy, cz = world.corners[:, :9].T
    met = (over > 0.0) & within_edges(p, d, (ax, ay, az), (bx, by, bz), (cx, cy, cz))
    t = np.concatenate([t, np.where(met, over / under, np.inf)])
    return np.where(t < np.inf, t, np.inf), np.concatenate([blocks, met & (over < under)])


def _in_scene(world: World, p: np.ndarray) -> Vector:
    """A point as seen from the eye, in units, as the file counts."""
    return vector(world.scene.camera.eye + np.ldexp(p, world.unit))


def _vector(three: Three) -> Vector:
    """Three arrays of one."""
    return vector(np.concatenate(three))


def _sum(colours: list[Colour]) -> Colour:
    return vector(np.sum(colours, axis=0))
