"""What a hit looks like: the formulas of the built-in stages, for one pixel or for many.

Plain arithmetic on numbers, arrays or lanes alike (see `twofold`): numpy and the kernels draw the same bytes. A hit is
given by t, its ray's direction D and L = eye − centre, all in one unit of length. P = t·D is the hit point as seen from
the eye, and P + L as seen from the centre, which is r·N: neither needs the point itself, whose digits may be too few.
"""

from __future__ import annotations

import numpy as np

from raytracer.twofold import Number, select

Three = tuple[Number, Number, Number]
Four = tuple[Number, Number, Number, Number]

_SMALL_STEP = 2.0**-20
_FARTHEST_GREY = 0.15


def land(t: Number, d: Three, away: Three, radius: Number) -> tuple[Three, Three]:
    """P and n = r·N of a hit, after one Newton step that brings n as close to the sphere as float64 does."""
    p = t * d[0], t * d[1], t * d[2]
    n = away[0] + p[0], away[1] + p[1], away[2] + p[2]
    slope = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
    step = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - radius * radius) / (slope + slope)
    step = select(abs(step) < _SMALL_STEP * t, step, 0.0)  # a ray that only grazes leads anywhere
    x, y, z = step * d[0], step * d[1], step * d[2]
    return (p[0] - x, p[1] - y, p[2] - z), (n[0] - x, n[1] - y, n[2] - z)


def land_on_any(t: Number, d: Three, eye: Three, row: Four, flat: Number) -> tuple[Three, Three, Number]:
    """P, n = r·N and r of a hit on a sphere, its row being centre and radius, or where `flat` on a triangle.

    A triangle's row is as in `Facets.planes`; r is 1, and P is where the ray meets the plane, whatever t is.
    """
    x, y, z, w = row
    p, n = land(t, d, (eye[0] - x, eye[1] - y, eye[2] - z), w)
    q = land_on_plane(d, row)
    p = select(flat, q[0], p[0]), select(flat, q[1], p[1]), select(flat, q[2], p[2])
    n = select(flat, x, n[0]), select(flat, y, n[1]), select(flat, z, n[2])
    return p, n, select(flat, 1.0, w)


def land_on_plane(d: Three, row: Four) -> Three:
    """P where a ray meets a triangle's plane."""
    x, y, z, w = row
    along = w / (x * d[0] + y * d[1] + z * d[2])
    return along * d[0], along * d[1], along * d[2]


def unit_of(d: Three) -> Three:
    """D, of length 1."""
    over = 1.0 / np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    return d[0] * over, d[1] * over, d[2] * over


def towards(p: Three, n: Three, light: Three) -> tuple[Number, Number]:
    """n·T and T·T for T from the point P to a light, both as seen from the eye."""
    x, y, z = light[0] - p[0], light[1] - p[1], light[2] - p[2]
    return n[0] * x + n[1] * y + n[2] * z, x * x + y * y + z * z


def cosine(facing: Number, square: Number, radius: Number) -> Number:
    """max(0, N·L) from what `towards` says, n = r·N; 0 where the light is at the point."""
    return select(facing > 0.0, facing / (radius * np.sqrt(square)), 0.0)


def highlight(p: Three, n: Three, radius: Number, light: Three, square: Number, ray: Three) -> Number:
    """max(0, H·N) for H halfway between the light, whose T·T is `square`, and where the unit ray came from."""
    over = 1.0 / np.sqrt(square)
    x, y, z = (light[0] - p[0]) * over - ray[0], (light[1] - p[1]) * over - ray[1], (light[2] - p[2]) * over - ray[2]
    return cosine(n[0] * x + n[1] * y + n[2] * z, x * x + y * y + z * z, radius)


def raised_to_whole(x: Number, power: Number, bits: int) -> Number:
    """x to a whole power from 0 to 2**bits − 1, by squaring: the same bits everywhere, as no library's power is."""
    result = 0.0 * power + 1.0
    for _ in range(bits):
        half = np.floor(power * 0.5)
        result = select(power - (half + half) > 0.0, result * x, result)
        x, power = x * x, half
    return result


def grey_of(t: Number, near: float, far: float) -> Number:
    """Linear in 1 / t: 1 where t = near, and darker up to t = far."""
    if near < far:
        return _FARTHEST_GREY + (1.0 - _FARTHEST_GREY) * ((near / t - near / far) / (1.0 - near / far))
    return 0.0 * (near / t) + 1.0


def to_byte(colour: Number) -> Number:
    """255 · clip(C, 0, 1) + ½, to be cut off to a whole number; what is not a number is black."""
    positive = select(colour > 0.0, colour, 0.0)
    return select(positive < 1.0, positive, 1.0) * 255.0 + 0.5
