"""Small spheres in single precision: sixteen pixels at a time, and float64 wherever that is not certain.

What a picture of many spheres costs is float64: half as many lanes, divisions and roots. Single precision has rough
roots that cost no more than a sum, but may be used only where it is known how far off it is. That is worked out here;
`kernels.quick` does the arithmetic. Single precision decides what can be seen, and which byte a colour is only where
float64 is sure to say the same: the picture is float64's, byte for byte.

Everything is counted in pixels from the middle of a tile, where whole numbers are exact, and a sphere is seen where its
centre is, at (X, Y), w = f·ρ pixels large, f the focal length in pixels and ρ the radius by the depth z of the centre.
With x, y from there, to the right and down, (U, V, −1) the centre's ray and m = 1 + U² + V², a ray meets the sphere
where the discriminant, divided by r²,

    disc = m + e₁x + e₂y − (a x² + b xy + c y²) / w²,  a = 1 + V² − ρ²,  b = 2UV,  c = 1 + U² − ρ²,

is above 0: a quadratic form about the sphere's own middle, in which nothing cancels (h² − a·c of `certified` does, the
more the smaller a sphere is). k = D·D·t = z(m + (Ux − Vy)/f) − r√disc.

**Whether a pixel is hit.** u = 2⁻²⁴. By m, let T be (a x² + c y²) / w², and s = 1/(1 − θ) with θ = |UV| / √(ac), so
that the whole form is at least T/s; where disc is near 0, T ≤ s(1.05 + 16ρ) for ρ ≤ ¼ and s ≤ 8. Coefficients are
rounded once, each product and sum once: (4 + 5θ)T + 4(e₁x + e₂y)/m + 3 times u. x = (column − rest of X) + whole
numbers is off by (4.5 + 1.1|x|)u, of which disc has 2.2√T + 0.5 times 1/w, and y likewise. Together, by m,

    error = u (14.2 T + 4 + (9.9 T + 14.4) / w)

and a pixel with |disc| ≤ 4 · error · m is left to float64. For all others √disc is within 0.27 √(error · m), and k
within (2.5ρ(√error/4 + 8u) + 24u)k, as it is from 0.7 to 1.301 times zm (the sine of the angle between a ray and the
middle's is at most ρ): nearer to each other than the sum of both, two spheres are left to float64, too. A factor of
disc, by whose root r is divided, makes one number of these two limits: the smaller of |disc| and the difference of k is
compared with it. s is below 2ac / ((1 − ρ²)(m − ρ²)), which for one m is largest where U = V.

**What colour it has.** In pixels, with D = (u, v, −f), the hit is at n = δ + τD from the sphere's middle, where
δ = (x, y, 0), τ = −(g + √(g² + a(w² − δ²))) / a, g = δ·D, a = D·D. Let s² be the largest a/f² of a pixel of the tile,
and t² = s² − 1; then |δ| ≤ 1.05sw. u and v are exact; X and Y are rounded to whole parts of a pixel, of which it has
2ᵏ, and x and y, whole numbers of those, are rounded once; so δ is off by √2ηw, η = 2⁻ᵏ/2w + 0.75su; f and w are rounded
once. So g is off by √a·w(1.42η + 2.1tu), the root's argument by aw²·2c₁, and n by w·q, where cos is the root by
its largest value and

    q = c₀ + c₁/cos,  c₁ = 1.5(s + t)η + (2.2t² + 3.85s² + 2)u,  c₀ = 2.84η + (7.4t + 6.5)u

as long as cos² > 16c₁. (What float64 leaves of the error of its k, 2⁻²⁶, is after a Newton step below 2⁻⁵³m/(ρ² cos),
and added to c₁.) The point P is off by r·q and by 4u|P|, the light's place by u of itself; so the direction towards it
by (r·q + 5u|light|) / |T| + 5u, as |P| ≤ |T| + |light|. n·T, the rough root of T·T and their product are off by 8u,
colours by 2u, each light's sum by 1u. So a channel is off by 255 · (its diffuse colour) times

    Σ light · (q (1 + r/|T|) + 5u|light|/|T| + (16 + lights)u)

and what comes that close to the border of two bytes is shaded anew, in float64. `kernels.limits` puts into this how
close a tile's spheres are to the lights at most; c₁ is a sphere's own, and 1/cos = √a·w / √disc a pixel's. With e for
all that is added to c₀, (c₀ + e) / c₁ is at most the larger of what it is for η = 0.75su, and of 2.84 / (1.5(s + t)).
"""

from __future__ import annotations

from math import frexp, hypot

import numpy as np

from raytracer.arrays import Quick
from raytracer.camera import Raster, focal_length, in_pixels, is_right
from raytracer.certified import inner
from raytracer.scene import Colour, Light
from raytracer.stages import light_from_eye
from raytracer.twofold import Number

U = 2.0**-24
ONE_BYTE = 65536.0  # bytes have so many parts here
_LONGEST = 2.0**16  # focal length in pixels
_BEYOND = 0.25  # how far beyond the picture's U and V a sphere's middle may be
_STEEPEST = 8.0
NEAREST, FARTHEST = 1e-10, 1e10  # lengths whose squares single precision holds
_BRIGHTEST = 1e4
_SPARE = 1.1  # for squares of errors
_ROOT = 2.0**-9  # about √error
_LEAST = 15 / 16  # 1 − ρ²
LIGHT = 8  # numbers of a light
_FROM_MIDDLE = 128.0  # pixels of a tile; a sphere is at most 1.05 · √m · f/4 large


def error_of(steep: float, rho: Number, blur: Number) -> Number:
    """How much disc may be off, relatively to m, for the largest s, ρ and 1 / w."""
    form = steep * (1.05 + 16.0 * rho)
    return U * (14.2 * form + 4.0 + (9.9 * form + 14.4) * blur)


def near_of(rho: Number, error: Number) -> Number:
    """How much k may be off, relatively, twice and a little more: √error ≤ (error / g + g) / 2 for any g."""
    return 2.1 * (2.5 * rho * ((error / _ROOT + _ROOT) * 0.125 + 8.0 * U) + 24.0 * U)


def flatness_of(parts: float, blur: Number, s: float) -> Number:
    """c₀, for 2ᵏ, 1 / w and s."""
    return _SPARE * (2.84 * _off(parts, blur, s) + U * (7.4 * np.sqrt(s * s - 1.0) + 6.5))


def coarseness_of(parts: float, blur: Number, s: float, focus: float, widest: float) -> Number:
    """c₁, for 2ᵏ, 1 / w, s, f and the largest m."""
    t2 = s * s - 1.0
    form = 1.5 * (s + np.sqrt(t2)) * _off(parts, blur, s) + U * (2.2 * t2 + 3.85 * s * s + 2.0)
    return _SPARE * form + (2.0**-53 * widest * focus * focus) * (blur * blur)


def flattest_of(weight: float, error: float, s: float) -> float:
    """The largest (c₀ · weight + error) / c₁ for any 1 / w, for s."""
    least = weight * flatness_of(1.0, 0.0, s) + error
    return float(max(least / coarseness_of(1.0, 0.0, s, 0.0, 0.0), weight * 2.84 / (1.5 * (s + np.sqrt(s * s - 1.0)))))


def _off(parts: float, blur: Number, s: float) -> Number:
    """η."""
    return blur * (0.5 / parts) + 0.75 * U * s


def _parts_of(focus: float, widest: float) -> int:
    """Of how many parts a pixel is, a power of two: from the middle of a tile to any sphere's, int32 holds them."""
    _, bits = frexp(_FROM_MIDDLE + 0.3 * widest**0.5 * focus)
    return int(2 ** max(0, 31 - bits))


def make_quick(
    raster: Raster, lights: tuple[Light, ...], unit: int, diffuse: tuple[float, float], background: Colour, flat: Colour
) -> Quick:
    """What the kernels have to know of a picture, whose diffuse colours are in that range; the two others are bytes.

    It is not usable for a frame that is crooked, or where lights and colours are beyond single precision.
    """
    camera, (focus, middle_x, middle_y) = raster.camera, in_pixels(raster)
    across, up = (max(map(abs, ends)) / focal_length(camera.fov) for ends in raster.ends())
    rows, weight, farthest, darkest = [], 0.0, 0.0, 0.0
    for light in lights:
        away = light_from_eye(light, camera, unit)
        strength, darkest = max(map(abs, light.colour)), min(darkest, *light.colour)
        distance = hypot(*away)
        weight, farthest = weight + strength, max(farthest, distance)
        place = (inner(*axis, *away) for axis in (camera.u, camera.v, camera.w))
        halves = (0.5 * channel for channel in light.colour)  # of what twice a cosine is multiplied by
        rows.append([*place, *halves, strength, 5 * U * distance])
    widest = 1.0 + (across + _BEYOND) ** 2 + (up + _BEYOND) ** 2
    steep = 0.5 * (1.0 + widest) ** 2 / (_LEAST * (widest - 1.0 + _LEAST))
    usable = bool(
        is_right(camera) and steep < _STEEPEST and 1.0 < focus < _LONGEST
        and farthest < FARTHEST and min(darkest, diffuse[0]) >= 0.0
        and max(weight, diffuse[1], weight * diffuse[1]) < _BRIGHTEST
    )  # fmt: skip
    return Quick(
        usable, camera.u, camera.v, camera.w, focus,
        middle_x, middle_y, float(raster.whole_height), focal_length(camera.fov), steep, widest,
        np.array(rows if usable else [], np.float32).reshape(-1),
        weight, 5 * U * farthest, (16 + len(rows)) * U * weight, _parts_of(focus, widest),
        packed(background), packed(flat),
    )  # fmt: skip


def packed(colour: Colour) -> int:
    """Three bytes as one number, red the lowest."""
    red, green, blue = (int(channel) for channel in colour)
    return red | green << 8 | blue << 16
