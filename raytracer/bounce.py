"""Rays that start on a shape: towards a light, and thrown back by a mirror. No epsilon.

P, where a ray starts, is a point of a shape, rounded; `shading.land_on_any` brings it so close that its distance from
the shape is only what rounding makes of it. Whatever else goes through P within that bound cannot be told from a shape
that the ray just leaves, and is taken for one:

    a sphere    c = |P − C|² − r² is taken for 0; the roots are then 0, which does not count, and −2h/a exactly
    a triangle  its plane is met at t = 0, which does not count

So there is no false hit on the shape itself, however large it is and however far away; and no contact is missed that
is farther away than P is off. (The usual remedy, to move P along its normal, needs a length that is right for no scene:
C. Wächter, N. Binder, A Fast and Robust Method for Avoiding Self-Intersection, Ray Tracing Gems 6.)

A sphere's discriminant is that of Haines (Ray Tracing Gems 7), good for small ones and far ones. A triangle's edges are
volumes of corners in an order that does not depend on the triangle, so that two which share an edge find the same
number with opposite signs, and no ray passes between them (S. Woop, C. Benthin, I. Wald, Watertight Ray/Triangle
Intersection, JCGT 2, 2013).

Plain arithmetic on numbers, arrays or lanes alike (see `twofold`). All lengths are as seen from the eye, in units.
"""

from __future__ import annotations

import numpy as np

from raytracer.certified import inner
from raytracer.shading import Four, Three, land
from raytracer.twofold import Number, select

LEAVING = 2.0**-47  # of all lengths that come together in a distance from a shape: how far P may be off
MOST_REFLECTIONS = 10


def blocks_sphere(o: Three, d: Three, a: Number, over_a: Number, radius: Number, size: Number, own: Number) -> Number:
    """Whether a sphere stands between P and P + D, o = P − C; size is at least |P|; `own` where P is on it."""
    h, c, r2 = _line(o, d, radius, size, own)
    beyond = (a + h) + (h + c)  # c as seen from P + D
    enters = (c > 0.0) & (h < 0.0) & (_beside(h * over_a, o, d) <= r2) & ((beyond < 0.0) | (-h < a))
    leaves = (c <= 0.0) & (beyond > 0.0) & ((c < 0.0) | (h < 0.0))
    return enters | leaves


def blocks_own(o: Three, d: Three, a: Number) -> Number:
    """`blocks_sphere` where P is on the sphere."""
    h = inner(d[0], d[1], d[2], o[0], o[1], o[2])
    return (h < 0.0) & ((a + h) + h > 0.0)


def meet_sphere(
    o: Three, d: Three, a: Number, over_a: Number, radius: Number, size: Number, own: Number, from_outside: Number
) -> Number:
    """t of the first hit, +inf for none. `from_outside`: where P is on this sphere, the ray came from outside."""
    hit, h, c, disc = hits_sphere(o, d, a, over_a, radius, size, own, from_outside)
    return select(hit, sphere_hit_at(h, c, disc, over_a), np.inf)


def hits_sphere(
    o: Three, d: Three, a: Number, over_a: Number, radius: Number, size: Number, own: Number, from_outside: Number
) -> tuple[Number, Number, Number, Number]:
    """What `meet_sphere` asks first: whether the ray hits; and h, c and h² − a·c for `sphere_hit_at`."""
    h, c, r2 = _line(o, d, radius, size, own)
    half, on = r2 - _beside(h * over_a, o, d), c == 0.0
    hit = (on | (half >= 0.0)) & ((h < 0.0) | (c < 0.0)) & ~(own & from_outside)
    return hit, h, c, select(on, h * h, a * half)


def sphere_hit_at(h: Number, c: Number, disc: Number, over_a: Number) -> Number:
    """t of a hit: from c = 0 it is −2h/a, whose root is not to be rounded."""
    q = abs(h) + select(c == 0.0, abs(h), np.sqrt(disc))
    return select((h < 0.0) & (c <= 0.0), q * over_a, abs(c) / q)


def _line(o: Three, d: Three, radius: Number, size: Number, own: Number) -> Three:
    """h, c and r²; c is 0 where P cannot be told from a point of the sphere."""
    square, r2 = inner(o[0], o[1], o[2], o[0], o[1], o[2]), radius * radius
    c = square - r2
    c = select(own | (abs(c) <= LEAVING * (square + r2 + radius * size)), 0.0, c)
    return inner(d[0], d[1], d[2], o[0], o[1], o[2]), c, r2


def _beside(s: Number, o: Three, d: Three) -> Number:
    """The squared distance of a sphere's centre from the ray's line."""
    x, y, z = o[0] - s * d[0], o[1] - s * d[1], o[2] - s * d[2]
    return x * x + y * y + z * z


def away_from(row: Four, p: Three, eye: Three) -> Three:
    """P − C for a sphere's row, its centre being in the scene's place, P as seen from the eye."""
    return p[0] + (eye[0] - row[0]), p[1] + (eye[1] - row[1]), p[2] + (eye[2] - row[2])


def plane_ahead(p: Three, d: Three, plane: Four, reach: Number, size: Number, own: Number) -> tuple[Number, Number]:
    """Where a ray meets a triangle's plane, as numerator and denominator of t, both above 0 if it does, else 0 and 1.

    reach is at least the distance of the triangle's corners from the eye.
    """
    x, y, z, distance = plane
    gap, slope = distance - inner(x, y, z, p[0], p[1], p[2]), inner(x, y, z, d[0], d[1], d[2])
    over, under = select(slope < 0.0, -gap, gap), abs(slope)
    ahead = (over > LEAVING * (reach + size)) & ~own
    return select(ahead, over, 0.0), select(ahead, under, 1.0)


def within_edges(p: Three, d: Three, first: Three, second: Three, third: Three) -> Number:
    """Whether the ray's line goes through a triangle with these corners, its edges included."""
    a = first[0] - p[0], first[1] - p[1], first[2] - p[2]
    b = second[0] - p[0], second[1] - p[1], second[2] - p[2]
    c = third[0] - p[0], third[1] - p[1], third[2] - p[2]
    e, f, g = _volume(d, a, b), _volume(d, b, c), _volume(d, c, a)
    return ((e >= 0.0) & (f >= 0.0) & (g >= 0.0)) | ((e <= 0.0) & (f <= 0.0) & (g <= 0.0))


def _volume(d: Three, a: Three, b: Three) -> Number:
    """D·(a × b), of which D·(b × a) is the exact negative."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return d[0] * x + d[1] * y + d[2] * z


def size_of(p: Three) -> Number:
    """At least |P|."""
    return abs(p[0]) + abs(p[1]) + abs(p[2])


def reflected(d: Three, n: Three, radius: Number) -> tuple[Three, Number]:
    """D + 2 (N·−D) N, and N·D, for n = r·N."""
    facing = inner(d[0], d[1], d[2], n[0], n[1], n[2])
    twice = (facing + facing) / (radius * radius)
    return (d[0] - twice * n[0], d[1] - twice * n[1], d[2] - twice * n[2]), facing


def land_again(t: Number, p: Three, d: Three, row: Four, eye: Three, flat: Number) -> tuple[Three, Three, Number]:
    """`shading.land_on_any` of a ray from P; a triangle faces where the ray comes from."""
    x, y, z, w = row
    step, n = land(t, d, away_from(row, p, eye), w)
    slope = inner(x, y, z, d[0], d[1], d[2])
    along, side = (w - inner(x, y, z, p[0], p[1], p[2])) / slope, select(slope > 0.0, -1.0, 1.0)
    step = (
        select(flat, along * d[0], step[0]), select(flat, along * d[1], step[1]), select(flat, along * d[2], step[2]),
    )  # fmt: skip
    n = select(flat, side * x, n[0]), select(flat, side * y, n[1]), select(flat, side * z, n[2])
    return (p[0] + step[0], p[1] + step[1], p[2] + step[2]), n, select(flat, 1.0, w)
