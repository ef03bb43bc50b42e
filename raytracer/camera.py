"""Eye rays: the one ray that leaves the eye through each pixel.

    U = (2x − W) / H        V = (H − 2y) / H        d = 1 / tan(fov / 2)
    D = U·u + V·v − d·w     ray(t) = eye + t · D

for pixel column x and row y, counted from the top left, of a picture of W × H pixels. That goes through the pixel's
upper left corner; `sampling="centre"` goes through (x + ½, y + ½). U and V are rational numbers: `numerators` gives
them times H, which are integers, so that nobody who needs them exactly has to guess. A picture may be drawn in bands of
rows, each on its own: a band's rays, and whatever is worked out for all of them, are the same as in the whole.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from math import hypot, inf, isfinite
from operator import index
from typing import NamedTuple

import numpy as np

from raytracer.arrays import Grid, Rays, TwofoldRays
from raytracer.certified import Three, in_range, inner
from raytracer.image import check_fits_memory
from raytracer.scene import Camera, Vector
from raytracer.twofold import Number, Twofold, add, multiply, two_product

SAMPLINGS = {"corner": 0, "centre": 1}  # what is added to 2x and 2y

_LARGEST_SIDE = (1 << 31) - 1  # that a PNG can name
_CROOKED = 2.0**-44  # a frame whose vectors are no more than this off unit length and right angles is taken for right
_SKEWED = 1e3  # a frame whose inverse magnifies rounding by more than this
_BAND_TESTS = 1 << 22
BAND_PIXELS = 1 << 15  # enough to outweigh what a task costs, few enough to stay in a core's cache

_CAMERA = Camera()  # any

Vectors = tuple[np.ndarray, np.ndarray, np.ndarray]

_PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")
_DIGITS = 80


@lru_cache(maxsize=64)
def is_right(camera: Camera) -> bool:
    """Whether u, v, w are of length 1, and at right angles."""
    axes = camera.u, camera.v, camera.w
    pairs = ((i, j) for i in range(3) for j in range(3))
    return all(abs(inner(*axes[i], *axes[j]) - float(i == j)) <= _CROOKED for i, j in pairs)


def in_pixels(raster: Raster) -> tuple[float, float, float]:
    """The focal length in pixels, and the column and the row, of those drawn, of the ray (0, 0, −1)."""
    shift = SAMPLINGS[raster.sampling]
    focus = focal_length(raster.camera.fov) * raster.whole_height / 2
    return focus, (raster.width - shift) / 2, (raster.whole_height - shift) / 2 - raster.first_row


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


def make_raster(camera: Camera, width: int, height: int, sampling: str = "corner", rows: slice | None = None) -> Raster:
    """The rays of a picture, or of some of its rows.

    ValueError for a size or a sampling that there is not, or `PictureTooLargeError`.
    """
    width, height = index(width), index(height)
    if width < 1 or height < 1:
        raise ValueError(f"a picture of {width} x {height} pixels has nothing to show; expected at least 1 x 1")
    if max(width, height) > _LARGEST_SIDE:
        raise ValueError(f"found a side of more than {_LARGEST_SIDE} pixels, expected a smaller picture")
    if sampling not in SAMPLINGS:
        raise ValueError(f"found sampling {sampling!r}, expected one of {', '.join(SAMPLINGS)}")
    _check_camera(camera)
    if rows is None:
        rows = slice(0, height)
    check_fits_memory(width, rows.stop - rows.start, max(width, BAND_PIXELS))
    return Raster(camera, width, rows.stop - rows.start, sampling, rows.start, height)


@lru_cache(maxsize=64)
def _check_camera(camera: Camera) -> None:
    """What the interpreter refuses in a file, for cameras that come from elsewhere."""
    if not (0 < camera.fov < 180 and focal_length(camera.fov) < inf):
        raise ValueError(f"found fov {camera.fov}, expected an angle in degrees above 0 and below 180")
    if not all(map(isfinite, (*camera.eye, *camera.u, *camera.v, *camera.w))):
        raise ValueError("found a camera with a number that is not finite")
    numbers, _ = _whole_frame(camera)
    if not is_right(camera) and not _inner(numbers[:3], _cross(numbers[3:6], numbers[6:])):
        raise ValueError("found dependent vectors u, v, w in a camera, expected three that point out of one plane")


class Raster(NamedTuple):
    """The rays of a picture or of some of its rows: the camera, the size, and where in a pixel its ray goes through."""

    camera: Camera
    width: int
    height: int  # rows, which are counted from 0 everywhere but here
    sampling: str
    first_row: int  # where they begin in the picture
    whole_height: int  # of the picture: H above

    @property
    def of_any_camera(self) -> Raster:
        """For what the camera does not matter to, and is kept while it moves."""
        return self._replace(camera=_CAMERA)

    def finer(self, times: int) -> Raster:
        """So many columns for each, and as many rows."""
        size, place = (self.width * times, self.height * times), (self.first_row * times, self.whole_height * times)
        return Raster(self.camera, *size, self.sampling, *place)

    def bands(self, tests_a_pixel: float = 0.0) -> list[slice]:
        """The picture's rows, cut into pieces that are traced one at a time; none takes long."""
        pixels = min(BAND_PIXELS, _BAND_TESTS / max(tests_a_pixel, 1.0))
        rows = max(1, int(pixels) // self.width)
        return [slice(start, min(start + rows, self.height)) for start in range(0, self.height, rows)]

    def numerators(self, xs: Number, ys: Number) -> tuple[Number, Number]:
        """H·U and H·V for columns xs and rows ys: integers, exactly."""
        shift = SAMPLINGS[self.sampling]
        return 2 * xs + shift - self.width, self.whole_height - 2 * (ys + self.first_row) - shift

    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """U of the first and the last column, V of the first and the last row, of the whole picture."""
        height = self.whole_height
        left, top = self.numerators(0, -self.first_row)
        right, bottom = self.numerators(self.width - 1, height - 1 - self.first_row)
        return (left / height, right / height), (top / height, bottom / height)

    def whole_direction(self, x: int, y: int) -> tuple[tuple[int, int, int], int]:
        """D as the language defines it, without rounding: integers, and what they are to be divided by."""
        (ux, uy, uz, vx, vy, vz, bx, by, bz), unit = _whole_frame(self.camera)
        across, up = self.numerators(x, y)
        height = self.whole_height
        steps = (
            across * ux + up * vx - height * bx,
            across * uy + up * vy - height * by,
            across * uz + up * vz - height * bz,
        )
        return steps, unit * height

    def exact_direction(self, x: int, y: int) -> tuple[Fraction, Fraction, Fraction]:
        """`whole_direction` in fractions."""
        (dx, dy, dz), unit = self.whole_direction(x, y)
        return Fraction(dx, unit), Fraction(dy, unit), Fraction(dz, unit)


@lru_cache(maxsize=64)
def _whole_frame(camera: Camera) -> tuple[list[int], int]:
    """u, v and d·w in integers, and what they are to be divided by, a power of two."""
    over, under = focal_length(camera.fov).as_integer_ratio()
    ratios = [x.as_integer_ratio() for x in camera.u + camera.v]
    ratios += [(n * over, m * under) for n, m in (x.as_integer_ratio() for x in camera.w)]
    unit = max(m for _, m in ratios)
    return [n * (unit // m) for n, m in ratios], unit


@lru_cache(maxsize=8)
def columns_and_rows(raster: Raster) -> tuple[np.ndarray, np.ndarray]:
    """U of each column, V of each row."""
    across, _ = raster.numerators(np.arange(raster.width), 0)
    _, up = raster.numerators(0, np.arange(raster.height))
    return across / raster.whole_height, up / raster.whole_height


@lru_cache(maxsize=8)
def eye_grid(raster: Raster) -> Grid:
    """The rays of a picture, in factors.

    U is rounded once, each product once, each of the two sums once: a component of D is within
    4u·(|U u| + |V v| + |d w|) of the truth, and `reach` is the length of the longest vector of such sums.
    """
    return grid_of(raster, *columns_and_rows(raster.of_any_camera))


def grid_of(raster: Raster, across: np.ndarray, up: np.ndarray) -> Grid:
    """The rays with these U and V, as `eye_grid`."""
    u, v, back = axes_of(raster.camera)
    a1 = 2.0 * (up * inner(*u, *v) - inner(*u, *back))
    a0 = (up * inner(*v, *v) - 2.0 * inner(*v, *back)) * up + inner(*back, *back)
    return Grid(across, up, a1, a0, inner(*u, *u), u, v, back, _reach(raster))


def axes_of(camera: Camera) -> tuple[Vector, Vector, Vector]:
    """What rays are made of: u, v, and d·w, rounded."""
    d, (x, y, z) = focal_length(camera.fov), camera.w
    return camera.u, camera.v, (d * x, d * y, d * z)


@lru_cache(maxsize=8)
def _reach(raster: Raster) -> float:
    widest, highest = (max(map(abs, ends)) for ends in raster.ends())
    sizes = [widest * abs(x) + highest * abs(y) + abs(z) for x, y, z in zip(*axes_of(raster.camera), strict=True)]
    return float(in_range(np.sqrt(_square(*sizes))))


def rows_of(grid: Grid, rows: slice) -> Grid:
    """Some rows of the grid."""
    return grid._replace(up=grid.up[rows], a1=grid.a1[rows], a0=grid.a0[rows])


def squares(grid: Grid, rows: slice = slice(None), columns: slice = slice(None)) -> np.ndarray:
    """D·D of a grid's rays: (rows, columns)."""
    across = grid.across[None, columns]
    found: np.ndarray = (across * grid.a2 + grid.a1[rows, None]) * across + grid.a0[rows, None]
    return found


def directions(grid: Grid, rows: slice = slice(None), columns: slice = slice(None)) -> Vectors:
    """The directions of a grid's rays, or of some of them: x, y, z, each (rows, columns)."""
    return directions_of(grid.axes, grid.across[None, columns], grid.up[rows, None])


def directions_of(axes: tuple[Vector, Vector, Vector], across: Number, up: Number) -> tuple[Number, Number, Number]:
    """The directions of the rays with these U and V, for `axes_of` a camera."""
    x, y, z = (across * u + (up * v - back) for u, v, back in zip(*axes, strict=True))
    return x, y, z


@lru_cache(maxsize=8)
def fine_columns(raster: Raster) -> Twofold:
    """U of each column in two-fold float64: two arrays (width,)."""
    across, _ = raster.numerators(np.arange(raster.width), 0)
    return _ratio(across.astype(float), float(raster.whole_height))


@lru_cache(maxsize=8)
def fine_rows(raster: Raster) -> tuple[Twofold, Twofold, Twofold]:
    """V·v − d·w of each row in two-fold float64: for each component two arrays (height,)."""
    up, back = fine_heights(raster), focal_length(raster.camera.fov)
    x, y, z = (fine_rest(up, v, w, back) for v, w in zip(raster.camera.v, raster.camera.w, strict=True))
    return x, y, z


def fine_heights(raster: Raster) -> Twofold:
    """V of each row in two-fold float64: two arrays (height,)."""
    _, up = raster.numerators(0, np.arange(raster.height))
    return _ratio(up.astype(float), float(raster.whole_height))


def fine_rest(up: Twofold, v: Number, w: Number, back: Number) -> Twofold:
    """One component of V·v − d·w, from twofold V."""
    return add(*multiply(*up, v, 0.0), *two_product(-back, w))


def twofold_eye_rays(raster: Raster, xs: np.ndarray, ys: np.ndarray) -> TwofoldRays:
    """The rays of single pixels, columns xs and rows ys, arrays of shape (n,)."""
    return TwofoldRays._make(fine_ray(*factors_of(raster, xs, ys)))


def factors_of(raster: Raster, xs: np.ndarray, ys: np.ndarray) -> tuple[Number, ...]:
    """What `fine_ray` makes a ray of, for single pixels."""
    across, up = (n.astype(float) for n in raster.numerators(xs, ys))
    camera = raster.camera
    return across, up, float(raster.whole_height), camera.u, camera.v, camera.w, focal_length(camera.fov)


def fine_ray(
    across: Number, up: Number, height: float, u: Three, v: Three, w: Three, back: float
) -> tuple[Number, Number, Number, Number, Number, Number, Number]:
    """A ray in two-fold float64, as `TwofoldRays` has it, from H·U, H·V, H, the camera's frame and d."""
    fine_across, fine_up = _ratio(across, height), _ratio(up, height)
    x, x_low, width = _fine_component(fine_across, fine_up, u[0], v[0], w[0], back)
    y, y_low, depth = _fine_component(fine_across, fine_up, u[1], v[1], w[1], back)
    z, z_low, size = _fine_component(fine_across, fine_up, u[2], v[2], w[2], back)
    return x, y, z, x_low, y_low, z_low, in_range(np.sqrt(_square(width, depth, size)))


def _fine_component(
    across: Twofold, up: Twofold, u: float, v: float, w: float, back: float
) -> tuple[Number, Number, Number]:
    """One component, and the sum of its terms' sizes."""
    x, x_low = multiply(across[0], across[1], u, 0.0)
    y, y_low = multiply(up[0], up[1], v, 0.0)
    z, z_low = two_product(-back, w)
    x, x_low = add(x, x_low, y, y_low)
    x, x_low = add(x, x_low, z, z_low)
    return x, x_low, abs(across[0] * u) + abs(up[0] * v) + abs(back * w)


def given_rays(directions: np.ndarray) -> Rays:
    """Rays whose directions, shape (n, 3), are exactly what is given."""
    x, y, z = np.ascontiguousarray(directions.T)
    square = _square(x, y, z)
    return Rays(x, y, z, square, in_range(np.sqrt(square)))


def twofold_given_rays(directions: np.ndarray) -> TwofoldRays:
    x, y, z, _, reach = given_rays(directions)
    zero = np.zeros_like(x)
    return TwofoldRays(x, y, z, zero, zero, zero, reach)


@lru_cache(maxsize=64)
def inverse_frame(camera: Camera) -> tuple[list[list[float]], float] | None:
    """The rows n₁, n₂, n₃ of (u, v, −d·w)⁻¹ and by how much it magnifies errors; None where that is too much."""
    numbers, unit = _whole_frame(camera)
    u, v, w = numbers[:3], numbers[3:6], [-x for x in numbers[6:]]
    crosses = [_cross(v, w), _cross(w, u), _cross(u, v)]
    determinant = _inner(u, crosses[0])
    try:
        rows = [[x * unit / determinant for x in row] for row in crosses]
        sizes = [hypot(*(x / unit for x in column)) for column in (u, v, w)]
    except OverflowError:
        return None
    magnification = max(hypot(*row) * size for row, size in zip(rows, sizes, strict=True))
    return (rows, magnification) if magnification < _SKEWED else None


def seen_at(raster: Raster, offsets: np.ndarray) -> np.ndarray | None:
    """Where a picture shows what lies in these directions from the eye, (n, 3): s·x, s·y and s, in column x and row y.

    Rays go through whole x and y; s is above 0 ahead of the eye and below 0 behind it. None for a frame that is so flat
    that this is lost in rounding.
    """
    inverse = inverse_frame(raster.camera)
    if inverse is None:
        return None
    across, up, ahead = np.array(inverse[0]) @ offsets.T
    shift = SAMPLINGS[raster.sampling]
    height = raster.whole_height
    x, y = height * across + (raster.width - shift) * ahead, (height - shift) * ahead - height * up
    return np.stack([x / 2, y / 2 - raster.first_row * ahead, ahead], axis=1)


@lru_cache(maxsize=8)
def spread(raster: Raster) -> float:
    """κ: no ray of the picture has a reach of more than κ times its length; +inf where that is not known.

    n₃·D = 1 for all of them, so |D| ≥ 1 / |n₃|.
    """
    inverse, reach = inverse_frame(raster.camera), _reach(raster)
    if inverse is None or not isfinite(reach):
        return inf
    return reach * hypot(*inverse[0][2])


def _square(x: Number, y: Number, z: Number) -> Number:
    return x * x + y * y + z * z


def _ratio(numerator: Number, denominator: float) -> Twofold:
    """numerator ÷ denominator, relative error at most 2u²."""
    quotient = numerator / denominator
    product, product_low = two_product(quotient, denominator)
    return quotient, ((numerator - product) - product_low) / denominator


def _inner(a: list[int], b: list[int]) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: list[int], b: list[int]) -> list[int]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
