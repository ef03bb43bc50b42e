"""Rays where methods fail, by the bundle: seeded, and as many as wanted.

A family makes bundles of `RAYS` rays that share one to three spheres. What is difficult about it is in its name and its
row of `FAMILIES`; the first row is what ordinary scenes look like. `level`, where a family has one, is the power of ten
that makes it difficult: distance over radius, radius over height, size of all lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

RAYS = 64


@dataclass(frozen=True)
class Bundle:
    """Rays and the spheres that they are traced against: float64 (n, 3), (n, 3), (s, 3), (s,)."""

    origins: np.ndarray
    directions: np.ndarray
    centres: np.ndarray
    radii: np.ndarray


@dataclass(frozen=True)
class Family:
    """One row of `FAMILIES`."""

    make: Callable[[np.random.Generator], Bundle]
    about: str
    ordinary: bool = False


def bundles(name: str, rays: int, seed: int) -> Iterator[Bundle]:
    """Bundles of a family, at least so many rays; the same for the same seed."""
    rng = np.random.default_rng([seed, *name.encode()])
    for _ in range(-(-rays // RAYS)):
        yield FAMILIES[name].make(rng)


def ordinary(rng: np.random.Generator) -> Bundle:
    centres = rng.uniform(-3, 3, (3, 3)) - [0, 0, 7]
    return _aimed(rng, np.zeros((RAYS, 3)), centres, rng.uniform(0.1, 1.5, 3), 1.3)


def far_small(rng: np.random.Generator, level: float | None = None) -> Bundle:
    level = rng.uniform(2, 12) if level is None else level
    centre = _units(rng, 1) * 10.0**level
    return _aimed(rng, rng.uniform(-1, 1, (RAYS, 3)), centre, np.ones(1), 1.5)


def ground(rng: np.random.Generator, level: float | None = None) -> Bundle:
    radius = 10.0 ** (rng.uniform(4, 12) if level is None else level)
    origins = np.zeros((RAYS, 3))
    origins[:, 1] = rng.uniform(0.5, 3, RAYS)
    directions = rng.uniform(-1, 1, (RAYS, 3))
    directions[:, 1] = -(10.0 ** rng.uniform(-3, 0, RAYS))
    return Bundle(origins, directions, np.array([[0.0, -radius, 0.0]]), np.array([radius]))


def tangent(rng: np.random.Generator) -> Bundle:
    """Integers: the columns of n times a rotation matrix are orthogonal and of length n, so distances are exact."""
    along, across, length = _integer_frame(rng)
    k = float(rng.integers(1, 1 << 10))
    centre = rng.integers(-(1 << 28), 1 << 28, 3).astype(float)
    steps = rng.integers(-(1 << 10), 1 << 10, RAYS).astype(float)
    origins = centre + k * across + steps[:, None] * along
    return Bundle(origins, np.tile(along, (RAYS, 1)), centre[None], np.array([k * length]))


def nearly_tangent(rng: np.random.Generator) -> Bundle:
    bundle = tangent(rng)
    radius = bundle.radii + rng.choice([-1, 1]) * rng.integers(1, 9) * np.spacing(bundle.radii)
    return Bundle(bundle.origins, bundle.directions, bundle.centres, radius)


def grazing(rng: np.random.Generator) -> Bundle:
    centre = _units(rng, 1) * rng.uniform(2, 30)
    return _aimed(rng, rng.uniform(-1, 1, (RAYS, 3)), centre, np.ones(1), 1.0, rim=10.0 ** rng.uniform(-15, -2))


def on_surface(rng: np.random.Generator) -> Bundle:
    _, across, length = _integer_frame(rng)
    centre = rng.integers(-(1 << 28), 1 << 28, 3).astype(float)
    turns = np.sign(rng.uniform(-1, 1, (RAYS, 1)))
    return Bundle(centre + turns * across, rng.uniform(-1, 1, (RAYS, 3)), centre[None], np.array([length]))


def off_surface(rng: np.random.Generator) -> Bundle:
    bundle = on_surface(rng)
    radius = bundle.radii + rng.choice([-1, 1]) * rng.integers(1, 9) * np.spacing(bundle.radii)
    return Bundle(bundle.origins, bundle.directions, bundle.centres, radius)


def long_and_short(rng: np.random.Generator) -> Bundle:
    bundle = ordinary(rng)
    return _changed(bundle, direction=10.0 ** rng.choice([-150.0, 150.0], (RAYS, 1)))


def tiny(rng: np.random.Generator) -> Bundle:
    return sized(rng, -170.0)


def huge(rng: np.random.Generator) -> Bundle:
    return sized(rng, 160.0)


def sized(rng: np.random.Generator, level: float) -> Bundle:
    """An ordinary bundle, all of its lengths made 10**level times as large."""
    return _changed(ordinary(rng), length=10.0**level)


def stepped(rng: np.random.Generator, level: float) -> Bundle:
    """An ordinary bundle, its directions made 10**level times as long."""
    return _changed(ordinary(rng), direction=10.0**level)


def far_from_origin(rng: np.random.Generator) -> Bundle:
    bundle = ordinary(rng)
    shift = rng.uniform(-1, 1, 3) * 10.0 ** rng.uniform(6, 12)
    return Bundle(bundle.origins + shift, bundle.directions, bundle.centres + shift, bundle.radii)


def nearly_coincident(rng: np.random.Generator) -> Bundle:
    bundle = ordinary(rng)
    centre, radius = bundle.centres[:1], bundle.radii[:1]
    steps = rng.integers(-2, 3, 4)
    other = centre + steps[:3] * np.spacing(np.abs(centre))
    both = np.concatenate([centre, other]), np.concatenate([radius, radius + steps[3] * np.spacing(radius)])
    return _aimed(rng, bundle.origins, both[0], both[1], 0.99, target=0)


def shells(rng: np.random.Generator, level: float | None = None) -> Bundle:
    """Two spheres about one centre, the outer one second, their radii different by 10**-level of one."""
    level = rng.uniform(4, 15.6) if level is None else level
    centre, radius = _units(rng, 1) * rng.uniform(2, 9), rng.uniform(0.5, 1.5)
    outer = max(radius * (1 + 10.0**-level), np.nextafter(radius, 2))
    return _aimed(rng, np.zeros((RAYS, 3)), np.repeat(centre, 2, axis=0), np.array([radius, outer]), 0.9, target=0)


def creased(rng: np.random.Generator) -> Bundle:
    """Two spheres that cut each other; the rays aim at the circle in which they do."""
    axis, across, _ = _frame(rng)
    middle, half, rim = _units(rng, 1)[0] * rng.uniform(3, 9), rng.uniform(0.2, 1), rng.uniform(0.2, 1)
    angle = rng.uniform(0, 2 * np.pi, (RAYS, 1))
    third = np.cross(axis, across)
    points = middle + rim * (np.cos(angle) * across + np.sin(angle) * third)
    centres = np.stack([middle - half * axis, middle + half * axis])
    return Bundle(np.zeros((RAYS, 3)), points, centres, np.full(2, np.hypot(half, rim)))


def tied(rng: np.random.Generator) -> Bundle:
    """Two spheres that mirror each other in a plane of integers; the rays lie in that plane, so all roots tie."""
    along, across, _ = _integer_frame(rng)
    third = np.cross(along, across)  # of length n², in integers
    middle = rng.integers(2, 40) * along + rng.integers(-3, 4) * across
    radius = np.linalg.norm(third) * rng.uniform(1.1, 3)
    weights = rng.integers(-8, 9, (RAYS, 1))
    directions = rng.integers(4, 40, (RAYS, 1)) * along + weights * across
    return Bundle(np.zeros((RAYS, 3)), directions, np.stack([middle + third, middle - third]), np.full(2, radius))


FAMILIES = {
    "ordinary": Family(ordinary, "spheres as in the course's scenes", ordinary=True),
    "far small": Family(far_small, "distance 10² to 10¹² radii"),
    "ground": Family(ground, "a radius of 10⁴ to 10¹², seen from a man's height"),
    "tangent": Family(tangent, "exactly tangent"),
    "nearly tangent": Family(nearly_tangent, "the radius 1 to 8 ulp off"),
    "grazing": Family(grazing, "within 10⁻² to 10⁻¹⁵ radii of tangent"),
    "on the surface": Family(on_surface, "the origin exactly on the sphere"),
    "off the surface": Family(off_surface, "the radius 1 to 8 ulp off"),
    "long and short": Family(long_and_short, "directions of length 10⁻¹⁵⁰ and 10¹⁵⁰"),
    "tiny": Family(tiny, "lengths of 10⁻¹⁷⁰: squares underflow"),
    "huge": Family(huge, "lengths of 10¹⁶⁰: squares overflow"),
    "far from the origin": Family(far_from_origin, "ordinary, moved by 10⁶ to 10¹²"),
    "nearly coincident": Family(nearly_coincident, "two spheres, up to 2 ulp apart"),
    "shells": Family(shells, "two spheres about one centre, radii 10⁻⁴ to 10⁻¹⁶ apart"),
    "creased": Family(creased, "two spheres, rays at the circle in which they cut"),
    "tied": Family(tied, "two spheres, hit at the same t"),
}


def _aimed(
    rng: np.random.Generator,
    origins: np.ndarray,
    centres: np.ndarray,
    radii: np.ndarray,
    reach: float,
    rim: float | None = None,
    target: int | None = None,
) -> Bundle:
    """Rays that pass a sphere's centre at up to `reach` radii, or at 1 ± rim radii."""
    which = rng.integers(0, len(radii), len(origins)) if target is None else np.full(len(origins), target)
    to_centre = centres[which] - origins
    beside = np.cross(to_centre, _units(rng, len(origins)))
    beside /= np.linalg.norm(beside, axis=1, keepdims=True)
    off = rng.uniform(0, reach, (len(origins), 1)) if rim is None else 1 + rng.choice([-rim, rim], (len(origins), 1))
    # A ray to the tangent plane at distance s meets the sphere's rim at the angle arcsin(r / distance).
    distance = np.linalg.norm(to_centre, axis=1, keepdims=True)
    sine = np.clip(off * radii[which][:, None] / distance, 0, 0.999)
    directions = to_centre + beside * distance * sine / np.sqrt(1 - sine * sine)
    return Bundle(origins, directions / rng.uniform(0.5, 20, (len(origins), 1)), centres, radii)


def _changed(bundle: Bundle, length: float = 1.0, direction: np.ndarray | float = 1.0) -> Bundle:
    return Bundle(
        bundle.origins * length, bundle.directions * direction, bundle.centres * length, bundle.radii * length
    )


def _units(rng: np.random.Generator, count: int) -> np.ndarray:
    vectors = rng.normal(size=(count, 3))
    units: np.ndarray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return units


def _frame(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three unit vectors at right angles."""
    x, y, z = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return x, y, z


def _integer_frame(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """Two integer vectors at right angles, and their common length, an integer: a quaternion's rotation matrix."""
    while True:
        a, b, c, d = rng.integers(-80, 81, 4).tolist()
        length = a * a + b * b + c * c + d * d
        if length:
            along = [a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)]
            across = [2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b)]
            return np.array(along, float), np.array(across, float), float(length)
