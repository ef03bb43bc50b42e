"""How far off the colours of a tile may be in single precision, from what its spheres and lights have in common.

           · tile ·
       ·  ──────────  ·      all that its rays can hit is in a cone about the one through its middle, no nearer to the
    eye ─────── middle       eye than the nearest sphere and no farther away than the farthest: so no closer to a light
       ·  ──────────  ·      than these are

The bounds are those of `quick`.
"""

import numpy as np

from raytracer.kernels.compiler import inlined
from raytracer.kernels.lanes import smallest_of, spread
from raytracer.kernels.sixteen import greater, lesser
from raytracer.quick import LIGHT, coarseness_of, flattest_of
from raytracer.twofold import select

_TOO_CLOSE = 64.0  # of how far a light and how large a sphere is: there errors are no longer small
_ROUGHLY = 1.0 - 2.0**-12  # for rough roots


@inlined
def largest(lanes):
    """The largest of eight lanes."""
    return -smallest_of(-lanes)


@inlined
def no_extremes():
    """Of no spheres: the largest 1 / w, the largest radius, the smallest depth and the largest."""
    return spread(0.0), spread(0.0), spread(np.inf), spread(0.0)


@inlined
def widened(extremes, listed, blur, radius, depth):
    """The extremes, in each of eight lanes, after another eight spheres, or those of them that are listed."""
    blurriest, widest, nearest, farthest = extremes
    return (
        select(listed, greater(blur, blurriest), blurriest),
        select(listed, greater(radius, widest), widest),
        select(listed, lesser(depth, nearest), nearest),
        select(listed, greater(depth, farthest), farthest),
    )


@inlined
def limits_of(quick, tile, longest, extremes):
    """How far off colours are, (A·ρ + B) · c₁ times a sphere's colour, where ρ = w / √disc; and for which ρ that is so.

    `longest` is the length of the tile's longest ray, in pixels; w and disc are in parts of a pixel.
    """
    blurs, radii, depths, farthest = extremes
    blur, radius, depth = largest(blurs), largest(radii), (smallest_of(depths), largest(farthest))
    s = longest / quick.focus
    weight, error = quick.weight, quick.rounding
    for i in range(0, len(quick.lights), LIGHT):
        x, y, z = np.float64(quick.lights[i]), np.float64(quick.lights[i + 1]), np.float64(quick.lights[i + 2])
        nearness, strength = nearness_of(quick, tile, s, x, y, z, radius, depth), np.float64(quick.lights[i + 6])
        weight += strength * (radius * nearness)
        error += strength * (quick.lights[i + 7] * nearness)
    coarsest, by_cos = coarseness_of(quick.parts, blur, s, quick.focus, quick.widest), longest * quick.parts
    steepest = _ROUGHLY / (4.0 * np.sqrt(coarsest) * by_cos)
    return np.float32(weight * by_cos), np.float32(flattest_of(weight, error, s)), np.float32(steepest)


@inlined
def nearness_of(quick, tile, s, x, y, z, radius, depth):
    """1 by the least distance of a light, in the camera's axes, from what a tile shows; infinite if it is too close."""
    u, v = 0.5 * (tile.left + tile.right) - quick.middle_x, quick.middle_y - 0.5 * (tile.top + tile.bottom)
    length2, away2 = u * u + v * v + quick.focus * quick.focus, x * x + y * y + z * z
    half2 = (0.5 * (tile.right - tile.left) + 1.0) ** 2 + (0.5 * (tile.bottom - tile.top) + 1.0) ** 2
    sine2, along, away = half2 / length2, (x * u + y * v - z * quick.focus) / np.sqrt(length2), np.sqrt(away2)
    distance = max(depth[0] - radius - away, away - (depth[1] + radius) * s)
    if sine2 < 1.0:  # of the angle between the tile's middle and its corners
        across = away if along < 0.0 else np.sqrt(max(away2 - along * along, 0.0))
        distance = max(distance, across * np.sqrt(1.0 - sine2) - max(along, 0.0) * np.sqrt(sine2))
    return 1.0 / distance if distance * _TOO_CLOSE > away + radius else np.inf
