"""Where on the screen a small sphere is, at a glance: in single precision, with room for what that is off.

With (x, y, z) the centre as seen from the eye along the camera's axes, z ahead, and all lengths by z, U = x / z,
V = y / z, ρ = r / z, the ellipse that the sphere covers reaches (see `boxes`, for a frame of length 1 at right angles)

    from  (U − ρ √(U² + 1 − ρ²)) / (1 − ρ²)  to  (U + ρ √(U² + 1 − ρ²)) / (1 − ρ²),

and likewise for V; in pixels that is times f, the focal length, from the picture's middle on. For ρ ≤ ¼, with u = 2⁻²⁴:
x, y, z are off by 5u|(x, y, z)|, so U and V by 5u(m + |U| m + |U|) where m² = 1 + U² + V², and what is made of them in
pixels by less than 20 f m²u, and 4u of the pixels that have a place on the screen: see `Glance.pad` and `slack`. The
half width is off by a few times 2⁻¹⁴ of itself where the roots are rough, and so is 1 / (1 − ρ²) by ρ² times that.

A sphere of which z is above 4r in front of the eye, and one of which −z is, behind it, is far enough outside for
`certified.approach`: l² is then at most 17/15 c, far below what it may be.
"""

from __future__ import annotations

import numpy as np

from raytracer.arrays import Glance
from raytracer.camera import Raster, in_pixels, is_right
from raytracer.scene import Vector

_U = 2.0**-24
_LARGEST = 1 << 22  # pixels across: below, each has a number in single precision


def make_glance(raster: Raster, spread: float) -> Glance:
    """What is to be known of a picture. Not usable for a crooked frame, or where κ is not known (spread 0)."""
    camera, (focus, middle_x, middle_y) = raster.camera, in_pixels(raster)
    size = raster.width + raster.height + abs(middle_x) + abs(middle_y)
    usable = bool(is_right(camera) and spread > 0.0 and focus < _LARGEST and size < _LARGEST)
    numbers = focus, middle_x, middle_y, 32.0 * _U * focus, 16.0 * _U * size, raster.width, raster.height
    axes = _single(camera.u), _single(camera.v), _single(camera.w)
    return Glance(usable, *axes, *map(np.float32, numbers))


def _single(axis: Vector) -> tuple[np.float32, np.float32, np.float32]:
    x, y, z = map(np.float32, axis)
    return x, y, z
