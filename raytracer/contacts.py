"""Rays from one shape to another, where starting them goes wrong: too near, and they hit the shape that they leave; too
far, and they jump over what is close to it.

`false_self_hits` counts the first: rays that leave a sphere or a large triangle outward, at points where eye rays hit
it. `missed_contacts` counts the second: rays to a shape that touches the first, or leaves a narrow gap. By construction
they start in the gap, at a point that is farther from the other shape than P may be off (`bounce.LEAVING`, and the
rounding of the shapes' own places), and hit the other shape. The truth, at which of its two sides, is worked out in
two-fold float64 from the rounded P; the tests compare that with integers. A contact is missed if a method finds
nothing, or the other side.

A scene's `scale` is the length that most of its other lengths are near.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from raytracer.bounce import LEAVING
from raytracer.certified import U
from raytracer.offsets import OFFSETS, Leaving, meets_exactly, seen_from

SCALES = tuple(10.0**power for power in range(-3, 10))
SHELLS_APART = 4e-5

_SEED = 2026
_SAFE = 8.0  # how many times P's bound a gap is wide at least
_WIDEST = 0.1  # gap, in scales


class Count(NamedTuple):
    """What one method got wrong at one scale."""

    offset: str
    scale: float
    wrong: int
    rays: int


class Contact(NamedTuple):
    """Rays that leave one shape for another, which they hit."""

    rays: Leaving
    other: np.ndarray  # as `Leaving.own`


def false_self_hits(rays: int, scales: tuple[float, ...] = SCALES) -> list[Count]:
    """Of so many rays a scale, half of them from spheres and half from triangles, how many hit what they leave."""
    counts = []
    for scale in scales:
        rng = np.random.default_rng([_SEED, round(np.log10(scale)) + 99])
        some = [make(rng, scale, rays // 2) for make in (from_spheres, from_triangles)]
        for name, offset in OFFSETS.items():
            wrong = sum(int(offset.self_hits(part).sum()) for part in some)
            counts.append(Count(name, scale, wrong, sum(len(part.t) for part in some)))
    return counts


def missed_contacts(rays: int, scales: tuple[float, ...] = SCALES) -> list[Count]:
    """Of so many rays a scale, an equal part from each of `CONTACTS`, how many miss what is there."""
    counts = []
    for scale in scales:
        rng = np.random.default_rng([_SEED, round(np.log10(scale)) + 99])
        some = [make(rng, scale, rays // len(CONTACTS)) for make in CONTACTS.values()]
        for name in OFFSETS:
            wrong = sum(int(missed(name, part).sum()) for part in some)
            counts.append(Count(name, scale, wrong, sum(len(part.rays.t) for part in some)))
    return counts


def missed(name: str, contact: Contact) -> np.ndarray:
    """Which rays a method loses: nothing found, or the other root of the right shape: bool (n,)."""
    t, other_root = truth(contact)
    found = OFFSETS[name].meets(contact.rays, contact.other)
    with np.errstate(invalid="ignore"):
        misses: np.ndarray = ~(np.abs(found - t) <= np.abs(found - other_root)) | (found == np.inf)
        return misses


def truth(contact: Contact) -> tuple[np.ndarray, np.ndarray]:
    """t of rays from P, the point rounded as seen from the eye; and the other root, −inf where there is none."""
    rays, other = contact.rays, seen_from(contact.other, contact.rays.eyes)
    p, d = np.stack(rays.landed[0], axis=-1), rays.directions
    t = meets_exactly(p, d, other)
    if other.ndim == 3:
        return t, np.full(len(t), -np.inf)
    away = p - other[:, :3]  # both roots together are −2h/a
    return t, -2.0 * (away * d).sum(axis=1) / (d * d).sum(axis=1) - t


# What is left outward


def from_spheres(rng: np.random.Generator, distance: float, count: int) -> Leaving:
    """Spheres at that distance from the eye, of 10⁻³ to 10⁹ times its radius; rays to any side that is outward."""
    eyes, looks, normals = _places(rng, distance, count), _units(rng, count), _units(rng, count)
    normals = _turned(normals, -looks)
    radii = distance * 10.0 ** rng.uniform(-3, 9, count)
    centres = eyes + distance * looks - radii[:, None] * normals
    return _outward(rng, eyes, looks, np.column_stack([centres, radii]))


def from_triangles(rng: np.random.Generator, distance: float, count: int) -> Leaving:
    """The same from triangles, of the size of their distance to 10³ times that."""
    eyes, looks = _places(rng, distance, count), _units(rng, count)
    triangles = _about(rng, eyes + distance * looks, _units(rng, count), distance * 10.0 ** rng.uniform(0, 3, count))
    return _outward(rng, eyes, looks, triangles)


def _outward(rng: np.random.Generator, eyes: np.ndarray, looks: np.ndarray, own: np.ndarray) -> Leaving:
    rays = Leaving(eyes, looks, own, looks)
    sure = np.isfinite(rays.t)
    rays = Leaving(eyes[sure], looks[sure], own[sure], looks[sure])
    directions = _turned(_units(rng, len(rays.t)), rays.landed[1])
    return Leaving(rays.eyes, rays.looks, rays.own, directions)


# What is close by


def shells(rng: np.random.Generator, scale: float, count: int) -> Contact:
    """Two spheres about one centre, `SHELLS_APART` of their radius, from the inner to the outer."""
    radii, normals, centres = scale * rng.uniform(0.5, 2, count), _units(rng, count), _places(rng, scale, count)
    points = centres + radii[:, None] * normals
    eyes = points + scale * _turned(_units(rng, count), normals)
    rays = Leaving(eyes, points - eyes, np.column_stack([centres, radii]), _turned(_units(rng, count), normals))
    return Contact(rays, np.column_stack([centres, radii * (1.0 + SHELLS_APART)]))


def sheets(rng: np.random.Generator, scale: float, count: int) -> Contact:
    """Two parallel triangles, `SHELLS_APART` of their size, from one to the other."""
    places, normals = _places(rng, scale, count), _units(rng, count)
    own = _about(rng, places, normals, np.full(count, 4 * scale))
    eyes = places + scale * _turned(_units(rng, count), normals)
    slopes = 10.0 ** rng.uniform(-5, 0, (count, 1))
    rays = Leaving(eyes, places - eyes, own, SHELLS_APART * normals + slopes * _beside(rng, normals))
    return Contact(rays, own + SHELLS_APART * scale * normals[:, None])


def touching(rng: np.random.Generator, scale: float, count: int) -> Contact:
    """Two spheres of about one size that touch, from one to the other, near where they do."""
    return _touch(rng, scale * rng.uniform(0.3, 3, count), scale * rng.uniform(0.3, 3, count), scale)


def ball_on_ground(rng: np.random.Generator, scale: float, count: int) -> Contact:
    """A ball on a sphere of 10³ to 10¹² times its radius, from the one to the other, or from the other to the one."""
    ball, ground = np.full(count, scale), scale * 10.0 ** rng.uniform(3, 12, count)
    of_ground = rng.random(count) < 0.5
    return _touch(rng, np.where(of_ground, ground, ball), np.where(of_ground, ball, ground), scale)


def far_from_origin(rng: np.random.Generator, scale: float, count: int) -> Contact:
    """Touching spheres, moved by 10⁶ to 10⁹ times their size."""
    away = _units(rng, count) * (scale * 10.0 ** rng.uniform(6, 9, count))[:, None]
    return _touch(rng, np.full(count, scale), scale * rng.uniform(0.3, 3, count), scale, away)


CONTACTS: dict[str, Callable[[np.random.Generator, float, int], Contact]] = {
    "shells": shells,
    "sheets": sheets,
    "touching spheres": touching,
    "ball on ground": ball_on_ground,
    "far from the origin": far_from_origin,
}


def _touch(
    rng: np.random.Generator, own: np.ndarray, other: np.ndarray, scale: float, away: np.ndarray | float = 0.0
) -> Contact:
    """From a sphere to one that touches it, towards what of this is not farther away than 2 scales.

    At a distance s from the contact, beside it, the gap is s² (1/r + 1/R) / 2, but for terms of s⁴.
    """
    axes, contacts = _units(rng, len(own)), _places(rng, scale, len(own)) + away
    narrow = np.log10(_SAFE * (LEAVING * (own + other + 4.0 * scale) + U * np.abs(contacts).max(axis=1)))
    gaps = 10.0 ** (narrow + (np.log10(_WIDEST * scale) - narrow) * rng.random(len(own)))
    turn = (np.sqrt(2.0 * gaps / (1.0 / own + 1.0 / other)) / own)[:, None]
    beside = _beside(rng, axes)
    normals = np.cos(turn) * axes + np.sin(turn) * beside
    points = contacts + own[:, None] * (np.sin(turn) * beside - 2.0 * np.sin(turn / 2.0) ** 2 * axes)
    eyes = points + scale * (_turned(_units(rng, len(own)), normals) + normals / 4.0)
    depth = np.minimum(other, scale)[:, None]
    aims = contacts + depth * (axes + 0.9 * rng.random((len(own), 1)) * _units(rng, len(own)))
    rays = Leaving(eyes, points - eyes, _balls(contacts, own, -axes), aims - points)
    return _some(Contact(rays, _balls(contacts, other, axes)), ((aims - points) * normals).sum(axis=1) > 0.0)


def _some(contact: Contact, which: np.ndarray) -> Contact:
    rays, other = contact
    own = Leaving(rays.eyes[which], rays.looks[which], rays.own[which], rays.directions[which])
    return Contact(own, other[which])


def _balls(contacts: np.ndarray, radii: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Spheres through these points, their centres along these axes: (n, 4)."""
    return np.column_stack([contacts + radii[:, None] * axes, radii])


def _about(rng: np.random.Generator, places: np.ndarray, normals: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Triangles about places, their corners as far away as their sizes: (n, 3, 3)."""
    first = _beside(rng, normals)
    second, across = -0.5 * first, np.sqrt(0.75) * np.cross(normals, first)
    corners: np.ndarray = places[:, None] + sizes[:, None, None] * np.stack(
        [first, second + across, second - across], axis=1
    )
    return corners


def _places(rng: np.random.Generator, scale: float, count: int) -> np.ndarray:
    return scale * rng.uniform(-1, 1, (count, 3))


def _units(rng: np.random.Generator, count: int) -> np.ndarray:
    vectors = rng.normal(size=(count, 3))
    units: np.ndarray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return units


def _beside(rng: np.random.Generator, axes: np.ndarray) -> np.ndarray:
    """Unit vectors at right angles to these."""
    vectors = np.cross(axes, _units(rng, len(axes)))
    beside: np.ndarray = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return beside


def _turned(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Vectors, or their opposites, on the side of the normals."""
    return np.where((vectors * normals).sum(axis=1, keepdims=True) < 0.0, -vectors, vectors)
