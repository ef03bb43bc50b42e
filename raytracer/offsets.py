"""`OFFSETS`: ways to start a ray on a surface, so that it does not hit where it starts.

P, where an eye ray O + t·D hits, is rounded: it lies a little above or below its surface, and a ray that starts there
may hit the surface again. Usually P is moved along the normal, by a length that has to be above what P is off and below
the gaps of the scene. This project's rays start at P itself and know what they leave (see `bounce`).

The comparison is of the starts alone. Every method is given the same t, of which float64 has all digits, and all but
`bounce` meet shapes by the same formulas that lose the fewest digits, all in the method's own precision. `contacts`
counts what goes wrong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from raytracer import bounce, exact
from raytracer.certified import inner, look_twofold, meet_twofold
from raytracer.facets import planes_of
from raytracer.shading import Three, land_on_any

Move = Callable[[np.ndarray, np.ndarray], np.ndarray]  # P and N, the unit normal on the ray's side, (n, 3) each, to P


@dataclass(frozen=True)
class Leaving:
    """Rays that leave shapes; a row each. Shapes are spheres, centre and radius (n, 4), or triangles (n, 3, 3)."""

    eyes: np.ndarray  # (n, 3)
    looks: np.ndarray  # (n, 3): the directions of eye rays
    own: np.ndarray  # the shapes that eye rays hit, and that the other rays leave
    directions: np.ndarray  # (n, 3): of the rays that leave, on the side of the eye

    @cached_property
    def t(self) -> np.ndarray:
        """Where eye rays hit their shapes: (n,), correct to about the last digit."""
        return meets_exactly(self.eyes, self.looks, self.own)

    @cached_property
    def landed(self) -> tuple[Three, np.ndarray]:
        """P as the project finds it, seen from the eye, and N on the side of the eye: (n, 3)."""
        zero, looks = np.zeros(len(self.t)), _three(self.looks)
        own = seen_from(self.own, self.eyes)
        x, y, z, w = own.T if _are_spheres(own) else planes_of(np.zeros(3), own).T
        with np.errstate(all="ignore"):
            p, n, _ = land_on_any(self.t, looks, (zero, zero, zero), (x, y, z, w), not _are_spheres(own))
            return p, _facing(np.stack(n, axis=-1), self.looks)


@dataclass(frozen=True)
class Offset:
    """One row of `OFFSETS`: a way to start a ray that leaves a shape."""

    move: Move | None  # None: not moved, but with its own shape known, as in `bounce`
    precision: type[np.floating[Any]]
    about: str
    source: str

    def meets(self, rays: Leaving, other: np.ndarray) -> np.ndarray:
        """t of the first hit of each ray on a shape other than its own, +inf for none: (n,)."""
        return _meet_usual(self, rays, other) if self.move else _meet_bounced(rays, other, np.False_)

    def self_hits(self, rays: Leaving) -> np.ndarray:
        """Which rays hit the shape that they leave: bool (n,). From outside a sphere, or a triangle, none should."""
        own = rays.own
        return (_meet_usual(self, rays, own) if self.move else _meet_bounced(rays, own, np.True_)) < np.inf


def not_moved(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    return p


def moved_by_a_length(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    moved: np.ndarray = p + p.dtype.type(1e-4) * n
    return moved


def moved_by_ulps(p: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Each coordinate by up to 256 ulps along N; near 0, where ulps are too small, by a fixed part of N.

    C. Wächter, N. Binder, A Fast and Robust Method for Avoiding Self-Intersection, Ray Tracing Gems 6 (2019), with the
    paper's constants for float32: origin = 1/32, float_scale = 1/65536, int_scale = 256. For float64 float_scale is
    2²⁹ times smaller, as its ulps are. (The paper takes P from a triangle's corners, which brings it closer to the
    triangle than O + t·D does. A sphere has no corners.)
    """
    single = p.dtype == np.float32
    whole, float_scale = (np.int32, 2.0**-16) if single else (np.int64, 2.0**-45)
    ulps = (np.where(p < 0.0, -256.0, 256.0) * n).astype(whole)
    by_ulps = (p.view(whole) + ulps).view(p.dtype)
    moved: np.ndarray = np.where(np.abs(p) < 1.0 / 32.0, p + p.dtype.type(float_scale) * n, by_ulps)
    return moved


_COURSES = "the advice of most courses, as P. Shirley, Ray Tracing in One Weekend, 6: “shadow acne”"
_GEMS = "C. Wächter, N. Binder, Ray Tracing Gems 6"
OFFSETS = {
    "none": Offset(not_moved, np.float64, "P as it is rounded; every t > 0 counts", "the quadratic as it stands"),
    "fixed 1e-4": Offset(moved_by_a_length, np.float64, "P + 10⁻⁴ N", _COURSES),
    "fixed 1e-4, float32": Offset(moved_by_a_length, np.float32, "P + 10⁻⁴ N, all in float32", _COURSES),
    "wächter_binder": Offset(moved_by_ulps, np.float32, "P moved by up to 256 ulps, in float32", _GEMS),
    "wächter_binder, float64": Offset(moved_by_ulps, np.float64, "the same with the ulps of float64", _GEMS),
    "bounce": Offset(None, np.float64, "P as it is; what goes through it is left", "raytracer/bounce.py"),
}


def seen_from(shapes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Shapes moved by −points, a point each: (n, 3)."""
    if _are_spheres(shapes):
        return np.column_stack([shapes[:, :3] - points, shapes[:, 3]])
    seen: np.ndarray = shapes - points[:, None]
    return seen


def meets_exactly(points: np.ndarray, directions: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """t of the first hit of each ray on its own sphere, +inf for none: (n,). Two-fold float64, and integers where
    that cannot tell. For triangles, whose edges are not looked at, where the ray meets the plane, in float64.
    """
    t: np.ndarray
    if not _are_spheres(shapes):
        normal = np.cross(shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 1])
        t = ((shapes[:, 0] - points) * normal).sum(axis=1) / (directions * normal).sum(axis=1)
        return np.where(t > 0.0, t, np.inf)
    d, zero, unknown = _three(directions), np.zeros(len(points)), np.full(len(points), np.nan)
    (x, y, z), (cx, cy, cz, r) = _three(points), shapes.T
    with np.errstate(all="ignore"):
        ball = look_twofold(x, y, z, cx, cy, cz, r, unknown, unknown, unknown)
        t, _, _, low = meet_twofold(*ball, *d, zero, zero, zero, np.sqrt(inner(*d, *d)))
    for i in np.flatnonzero(low < np.inf).tolist():
        *centre, radius = shapes[i].tolist()
        t[i] = exact.nearest_hit(points[i].tolist(), directions[i].tolist(), [(centre, radius)])[0]
    return t


@np.errstate(all="ignore")
def _meet_usual(offset: Offset, rays: Leaving, shapes: np.ndarray) -> np.ndarray:
    """As most tracers do it: P = O + t·D, moved; t > 0 of shapes given in the world's coordinates."""
    assert offset.move is not None
    eyes, looks, t, n, own, shapes, directions = (
        array.astype(offset.precision)
        for array in (rays.eyes, rays.looks, rays.t, rays.landed[1], rays.own, shapes, rays.directions)
    )
    p = eyes + t[:, None] * looks
    if _are_spheres(own):
        n = _facing((p - own[:, :3]) / own[:, 3:], looks)
    starts, d = _three(offset.move(p, n)), _three(directions)
    if _are_spheres(shapes):
        return _meet_spheres(starts, d, shapes)
    return _meet_triangles(starts, d, shapes)


@np.errstate(all="ignore")
def _meet_spheres(p: Three, d: Three, spheres: np.ndarray) -> np.ndarray:
    """`bounce.meet_sphere` of a ray that knows nothing of a surface it may start on."""
    x, y, z, radius = spheres.T
    o = p[0] - x, p[1] - y, p[2] - z
    a, h, r2 = inner(*d, *d), inner(*d, *o), radius * radius
    c, s = inner(*o, *o) - r2, h / a
    beside = o[0] - s * d[0], o[1] - s * d[1], o[2] - s * d[2]
    half = r2 - inner(*beside, *beside)
    q = np.abs(h) + np.sqrt(a * half)
    t = np.where((h < 0.0) & (c <= 0.0), q / a, np.abs(c) / q)
    return np.where((half >= 0.0) & ((h < 0.0) | (c < 0.0)) & (t > 0.0), t, np.inf)


@np.errstate(all="ignore")
def _meet_triangles(p: Three, d: Three, triangles: np.ndarray) -> np.ndarray:
    first, second, third = np.moveaxis(triangles, 1, 0)
    normal = _three(np.cross(second - first, third - second))
    away = first[:, 0] - p[0], first[:, 1] - p[1], first[:, 2] - p[2]
    t = inner(*normal, *away) / inner(*normal, *d)
    within = bounce.within_edges(p, d, _three(first), _three(second), _three(third))
    return np.where((t > 0.0) & within, t, np.inf)


@np.errstate(all="ignore")
def _meet_bounced(rays: Leaving, shapes: np.ndarray, own: np.bool_) -> np.ndarray:
    """As the stage `full` does it: all as seen from the eye, own shapes known."""
    (p, _), d, shapes = rays.landed, _three(rays.directions), seen_from(shapes, rays.eyes)
    a, size = inner(*d, *d), np.abs(p[0]) + np.abs(p[1]) + np.abs(p[2])
    if _are_spheres(shapes):
        x, y, z, radius = shapes.T
        o = p[0] - x, p[1] - y, p[2] - z
        t: np.ndarray = bounce.meet_sphere(o, d, a, 1.0 / a, radius, size, own, False)
        return t
    x, y, z, w = planes_of(np.zeros(3), shapes).T
    reach = np.abs(shapes).sum(axis=2).max(axis=1)
    over, under = bounce.plane_ahead(p, d, (x, y, z, w), reach, size, own)
    first, second, third = (_three(corner) for corner in np.moveaxis(shapes, 1, 0))
    return np.where((over > 0.0) & bounce.within_edges(p, d, first, second, third), over / under, np.inf)


def _are_spheres(shapes: np.ndarray) -> bool:
    return shapes.ndim == 2


def _facing(normals: np.ndarray, looks: np.ndarray) -> np.ndarray:
    """Unit normals, turned to where eye rays come from."""
    normals = normals / np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    return np.where((normals * looks).sum(axis=1, keepdims=True) > 0.0, -normals, normals)


def _three(vectors: np.ndarray) -> Three:
    x, y, z = vectors.T
    return x, y, z
