"""Eye rays: the one ray that leaves the eye through each pixel.

    U = (2x − W) / H        V = (H − 2y) / H        d = 1 / tan(fov / 2)
    D = U·u + V·v − d·w     ray(t) = eye + t · D

for pixel column x and row y, counted from the top left, of a picture of W × H pixels. That goes through the pixel's
upper left corner; `sampling="centre"` goes through (x + ½, y + ½). U and V are rational numbers: `numerators` gives
them times H, which are integers, so that nobody who needs them exactly has to guess.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from raytracer.arrays import Rays, TwofoldRays
from raytracer.certified import in_range
from raytracer.image import check_fits_memory
from raytracer.scene import Camera
from raytracer.twofold import Number, Twofold, add, multiply, two_product

SAMPLINGS = {"corner": 0, "centre": 1}  # what is added to 2x and 2y

_BAND_PIXELS = 1 << 15  # enough to outweigh what a task costs, few enough to stay in a core's cache

_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")
_DIGITS = 80


@lru_cache(maxsize=64)
def focal_length(fov: float) -> float:
    """The float64 nearest to 1 / tan(fov / 2), fov in degrees, 0 < fov < 180; +inf where that is beyond float64."""
    with localcontext() as context:
        context.prec = _DIGITS
        half = Decimal(fov) * _PI / 360
        return float(_power_series(half, first=0) / _power_series(half, first=1))


def _power_series(x: Decimal, first: int) -> Decimal:
    """cos x (first = 0) or sin x (first = 1) by its power series, to the digits of the context."""
    term = total = x if first else Decimal(1)
    n = first
    while abs(term) > abs(total).scaleb(-_DIGITS):
        n += 2
        term *= -x * x / (n * (n - 1))
        total += term
    return total


def make_raster(camera: Camera, width: int, height: int, sampling: str = "corner") -> Raster:
    """The rays of a picture; ValueError for a size or a sampling that there is not, or `PictureTooLargeError`."""
    if width < 1 or height < 1:
        raise ValueError(f"a picture of {width} x {height} pixels has nothing to show; expected at least 1 x 1")
    if sampling not in SAMPLINGS:
        raise ValueError(f"found sampling {sampling!r}, expected one of {', '.join(SAMPLINGS)}")
    check_fits_memory(width, height)
    return Raster(camera, width, height, sampling)


class Raster(NamedTuple):
    """A picture's rays: the camera, the picture's size, and where in a pixel its ray goes through."""

    camera: Camera
    width: int
    height: int
    sampling: str = "corner"

    @property
    def bands(self) -> list[slice]:
        """The picture's rows, cut into pieces that are drawn one at a time."""
        rows = max(1, _BAND_PIXELS // self.width)
        return [slice(start, min(start + rows, self.height)) for start in range(0, self.height, rows)]

    def numerators(self, xs: Number, ys: Number) -> tuple[Number, Number]:
        """H·U and H·V for columns xs and rows ys: integers, exactly."""
        shift = SAMPLINGS[self.sampling]
        return 2 * xs + shift - self.width, self.height - 2 * ys - shift

    def exact_direction(self, x: int, y: int) -> tuple[Fraction, Fraction, Fraction]:
        """D as the language defines it, without rounding."""
        camera = self.camera
        across, up = (Fraction(n, self.height) for n in self.numerators(x, y))
        back = Fraction(focal_length(camera.fov))
        frame = zip(camera.u, camera.v, camera.w, strict=True)
        dx, dy, dz = (across * Fraction(u) + up * Fraction(v) - back * Fraction(w) for u, v, w in frame)
        return dx, dy, dz


def eye_rays(raster: Raster, rows: slice) -> Rays:
    """The rays of whole rows of the picture, arrays of shape (rows, width).

    U is rounded once, each product once, each of the two sums once: a component is within 4u·(|U u| + |V v| + |d w|)
    of the truth, and `reach` is the length of the vector of those three sums.
    """
    ys, xs = np.arange(rows.start, rows.stop)[:, None], np.arange(raster.width)[None, :]
    across, up = (n / raster.height for n in raster.numerators(xs, ys))
    back = focal_length(raster.camera.fov)
    camera = raster.camera
    axes = list(zip(camera.u, camera.v, camera.w, strict=True))
    x, y, z = (across * u + up * v - back * w for u, v, w in axes)
    sizes = [np.abs(across * u) + np.abs(up * v) + abs(back * w) for u, v, w in axes]
    return Rays(x, y, z, _square(x, y, z), in_range(np.sqrt(_square(*sizes))))


def twofold_eye_rays(raster: Raster, xs: np.ndarray, ys: np.ndarray) -> TwofoldRays:
    """The rays of single pixels, columns xs and rows ys, arrays of shape (n,)."""
    across, up = (_ratio(n.astype(float), float(raster.height)) for n in raster.numerators(xs, ys))
    back = focal_length(raster.camera.fov)
    camera = raster.camera
    components, sizes = [], []
    for u, v, w in zip(camera.u, camera.v, camera.w, strict=True):
        component = add(*multiply(*across, u, 0.0), *multiply(*up, v, 0.0))
        components.append(add(*component, *two_product(-back, w)))
        sizes.append(np.abs(across[0] * u) + np.abs(up[0] * v) + abs(back * w))
    highs, lows = zip(*components, strict=True)
    return TwofoldRays._make([*highs, *lows, in_range(np.sqrt(_square(*sizes)))])


def given_rays(directions: np.ndarray) -> Rays:
    """Rays whose directions, shape (n, 3), are exactly what is given."""
    x, y, z = np.ascontiguousarray(directions.T)
    square = _square(x, y, z)
    return Rays(x, y, z, square, in_range(np.sqrt(square)))


def twofold_given_rays(directions: np.ndarray) -> TwofoldRays:
    x, y, z, _, reach = given_rays(directions)
    zero = np.zeros_like(x)
    return TwofoldRays(x, y, z, zero, zero, zero, reach)


def _square(x: Number, y: Number, z: Number) -> Number:
    return x * x + y * y + z * z


def _ratio(numerator: Number, denominator: float) -> Twofold:
    """numerator ÷ denominator, relative error at most 2u²."""
    quotient = numerator / denominator
    product, product_low = two_product(quotient, denominator)
    return quotient, ((numerator - product) - product_low) / denominator
