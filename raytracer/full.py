"""The stage `full`, course part B: ambient, diffuse and specular light, hard shadows, mirrors.

    C = ambient + Σ over lights that nothing blocks of light · (diffuse · max(0, N·L) + specular · max(0, H·N)^power)
        + k_refl · C of the mirrored ray

This is the numpy path: all hits of a block at once, one shape after the other. `kernels.full` is the same, compiled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from raytracer.arrays import CORNERS
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
from raytracer.facets import planes_of
from raytracer.scene import Materials, Scene
from raytracer.shading import Four, Three, cosine, highlight, land_on_any, raised_to_whole, towards, unit_of

_MOST_BITS = 12  # of a power that is worked out by squaring


@dataclass(frozen=True)
class Terms:
    """Which terms of the formula can be anything but 0 in a scene."""

    specular: bool
    mirrors: bool
    shadows: bool
    bits: int  # of the largest power, if all are whole numbers, else −1


def terms_of(scene: Scene, lit: bool) -> Terms:
    """The terms of a scene, `lit` by any light or by none."""
    shiny, mirrors, bits = _asked_by(scene.materials)
    return Terms(shiny and lit, mirrors, lit and (len(scene) > 1 or shiny), bits)


@lru_cache(maxsize=8)
def _asked_by(materials: Materials) -> tuple[bool, bool, int]:
    """Whether any material is shiny, whether any is a mirror, and `Terms.bits`."""
    table = materials.table
    shiny = table[table[:, 6:9].any(axis=1)]
    powers = shiny[:, 9]
    whole = bool(((powers == np.floor(powers)) & (powers >= 0.0) & (powers < 1 << _MOST_BITS)).all())
    bits = int(powers.max(initial=0.0)).bit_length() if whole else -1
    return bool(len(shiny)), bool((table[:, 10] > 0.0).any()), bits


@lru_cache(maxsize=8)
def surfaces_of(materials: Materials) -> np.ndarray:
    """As three rows of four each: diffuse, power; ambient, k_refl; specular, 0: float64 (3 m, 4)."""
    table = materials.table
    rows = np.zeros((len(table), 3, 4))
    rows[:, :, :3] = table[:, :9].reshape(-1, 3, 3)
    rows[:, 0, 3], rows[:, 1, 3] = table[:, 9], np.maximum(table[:, 10], 0.0)
    return rows.reshape(-1, 4)


def corners_of(origin: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Corners (n, 3, 3) as seen from an origin, and the largest distance among them: float64 (n, 12)."""
    rows = np.zeros((len(corners), CORNERS))
    away = corners - origin
    rows[:, :9] = away.reshape(-1, 9)
    rows[:, 9] = np.abs(away).sum(axis=2).max(axis=1, initial=0.0)
    return rows


@dataclass(frozen=True)
class World:
    """All shapes as seen from the eye, in units: rows of spheres, then of triangles, as in `View.balls`."""

    scene: Scene
    lights: tuple[tuple[Three, Three], ...]  # place as seen from the eye, colour

    @property
    def unit(self) -> int:
        """Lengths are counted in 2**unit of the scene's."""
        return self.scene.in_units[0]

    @cached_property
    def eye(self) -> Three:
        x, y, z = self.scene.in_units[1].tolist()
        return x, y, z

    @cached_property
    def rows(self) -> np.ndarray:
        _, eye, balls, corners = self.scene.in_units
        return np.concatenate([balls, planes_of(eye, corners)]) if len(corners) else balls

    @cached_property
    def first_facet(self) -> int:
        return len(self.scene.spheres.balls)

    @cached_property
    def corners(self) -> np.ndarray:
        _, eye, _, corners = self.scene.in_units
        return corners_of(eye, corners)

    @cached_property
    def surfaces(self) -> np.ndarray:
        return surfaces_of(self.scene.materials)

    @cached_property
    def terms(self) -> Terms:
        return terms_of(self.scene, bool(self.lights))

    @cached_property
    def shapes(self) -> list[int]:
        """The numbers of all shapes."""
        return [*range(len(self.scene.spheres)), *range(self.first_facet, len(self.rows))]

    def row_of(self, where: np.ndarray) -> Four:
        x, y, z, w = self.rows[where].T
        return x, y, z, w

    def radiance(self, t: np.ndarray, d: Three, where: np.ndarray) -> np.ndarray:
        """The colours that come along eye rays D from hits at t on shapes `where`: (n, 3)."""
        p, n, radius = land_on_any(t, d, self.eye, self.row_of(where), where >= self.first_facet)
        colours, weight, which = np.zeros((len(t), 3)), np.ones(len(t)), np.arange(len(t))
        surfaces, material = self.surfaces, self.scene.numbered[1]
        for bounce in range(MOST_REFLECTIONS + 1):
            of = 3 * material[where].astype(np.int64)
            ambient = surfaces[of + 1]
            light = self._light(p, n, radius, d, where, surfaces[of], surfaces[of + 2])
            colours[which] += weight[:, None] * (ambient[:, :3] + light)
            weight = weight * ambient[:, 3]
            on = weight > 0.0
            if bounce == MOST_REFLECTIONS or not on.any():
                break
            p, n, d = _some(p, on), _some(n, on), _some(d, on)
            radius, where, weight, which = radius[on], where[on], weight[on], which[on]
            d, facing = reflected(d, n, radius)
            t, found = self._nearest(p, d, where, facing < 0.0)
            missed = found < 0
            colours[which[missed]] += weight[missed, None] * np.array(self.scene.background)
            on = ~missed
            p, d, t, where, weight, which = _some(p, on), _some(d, on), t[on], found[on], weight[on], which[on]
            p, n, radius = land_again(t, p, d, self.row_of(where), self.eye, where >= self.first_facet)
        return colours

    def _light(
        self,
        p: Three,
        n: Three,
        radius: np.ndarray,
        d: Three,
        where: np.ndarray,
        diffuse: np.ndarray,
        shiny: np.ndarray,
    ) -> np.ndarray:
        """What all lights add: (n, 3)."""
        total, size, unit = np.zeros((len(where), 3)), size_of(p), unit_of(d)
        for place, colour in self.lights:
            shine, spark = self.answers(p, n, radius, unit, place, shiny[:, :3], diffuse[:, 3])
            lit = (shine > 0.0) | (spark > 0.0)
            if self.terms.shadows and lit.any():
                lit[lit] = ~self._blocked(_some(p, lit), place, where[lit], size[lit])
            added = diffuse[:, :3] * shine[:, None] + shiny[:, :3] * spark[:, None]
            total += np.where(lit[:, None], np.array(colour) * added, 0.0)
        return total

    def answers(
        self, p: Three, n: Three, radius: np.ndarray, unit: Three, place: Three, colour: np.ndarray, power: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """max(0, N·L) and max(0, H·N)^power of a light at points where unit rays arrived: (n,), (n,).

        The latter is 0 where the specular colour, (n, 3), is black.
        """
        facing, square = towards(p, n, place)
        shine = cosine(facing, square, radius)
        if not self.terms.specular:
            return shine, np.zeros(len(power))
        spark = _raised(highlight(p, n, radius, place, square, unit), power, self.terms.bits)
        return shine, np.where(colour.any(axis=1), spark, 0.0)

    def _blocked(self, p: Three, light: Three, where: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Whether something stands between P and a light: bool (n,)."""
        d = light[0] - p[0], light[1] - p[1], light[2] - p[2]
        a = inner(*d, *d)
        blocked, over_a = np.zeros(len(where), bool), 1.0 / a
        for j in self.shapes:
            own, row = where == j, self.rows[j]
            if j < self.first_facet:
                blocked |= blocks_sphere(away_from(tuple(row), p, self.eye), d, a, over_a, row[3], size, own)
            else:
                over, under = plane_ahead(p, d, tuple(row), self.corners[j - self.first_facet, 9], size, own)
                between = (over > 0.0) & (over < under)
                if between.any():
                    blocked |= between & self._within(j, p, d)
        return blocked

    def _nearest(
        self, p: Three, d: Three, where: np.ndarray, from_outside: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What rays from P hit first: t and the numbers of shapes, −1 for none."""
        best, index = np.full(len(where), np.inf), np.full(len(where), -1, np.int32)
        a, size = inner(*d, *d), size_of(p)
        over_a = 1.0 / a
        for j in self.shapes:
            own, row = where == j, self.rows[j]
            if j < self.first_facet:
                t = meet_sphere(away_from(tuple(row), p, self.eye), d, a, over_a, row[3], size, own, from_outside)
                closer = t < best
            else:
                over, under = plane_ahead(p, d, tuple(row), self.corners[j - self.first_facet, 9], size, own)
                t = over / under
                closer = (over > 0.0) & (t < best)
                if closer.any():
                    closer &= self._within(j, p, d)
            best, index = np.where(closer, t, best), np.where(closer, np.int32(j), index)
        return best, index

    def _within(self, j: int, p: Three, d: Three) -> np.ndarray:
        ax, ay, az, bx, by, bz, cx, cy, cz, *_ = self.corners[j - self.first_facet].tolist()
        within: np.ndarray = within_edges(p, d, (ax, ay, az), (bx, by, bz), (cx, cy, cz))
        return within


def _some(vectors: Three, which: np.ndarray) -> Three:
    return vectors[0][which], vectors[1][which], vectors[2][which]


def _raised(x: np.ndarray, power: np.ndarray, bits: int) -> np.ndarray:
    if bits >= 0:
        return np.asarray(raised_to_whole(x, power, bits))
    return np.array([_power(a, b) for a, b in zip(x.tolist(), power.tolist(), strict=True)])


def _power(x: float, power: float) -> float:
    """As C's `pow`: beyond float64 it is infinite."""
    try:
        return math.pow(x, power)
    except (OverflowError, ValueError):
        return math.inf
