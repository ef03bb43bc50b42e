"""How a ray meets a sphere: the usual methods, one function and one row of `METHODS` each, beside the certain one.

A method is a function of a ray's origin, its direction, a sphere's centre and its radius; vectors are tuples of three
numbers, or of three arrays. It returns t of the hit, the smallest positive root, and +inf for a miss. It is plain
arithmetic (see `twofold`), so that numpy runs it on arrays and the compiler on single numbers, in float32 or float64; a
literal other than 0 would make a float32 a float64, and has no place in a method that is offered in float32.

L = O − C, a = D·D, h = D·L, c = L·L − r², as everywhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from raytracer.certified import discriminant, magnitude
from raytracer.twofold import (
    Number,
    Twofold,
    add,
    dekker_product,
    divide,
    dot,
    exponent,
    multiply,
    scale,
    select,
    square_root,
    two_product,
    two_sum,
)

Vector = tuple[Number, Number, Number]


def textbook(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """(−b ± √(b² − 4ac)) / 2a, with b = 2h."""
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    b, ac = h + h, a * c
    disc = b * b - (ac + ac + ac + ac)
    root = np.sqrt(abs(disc))
    return nearest_ahead(disc, (-b - root) / (a + a), (-b + root) / (a + a))


def half_b(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """(−h ± √(h² − a·c)) / a."""
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    disc = h * h - a * c
    root = np.sqrt(abs(disc))
    return nearest_ahead(disc, (-h - root) / a, (-h + root) / a)


def geometric(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """Along the unit ray to the point nearest to the centre, and half a chord back or on."""
    to_centre = minus(centre, origin)
    length = np.sqrt(inner(direction, direction))
    along = inner(direction, to_centre) / length
    chord2 = r * r - (inner(to_centre, to_centre) - along * along)
    half_chord = np.sqrt(abs(chord2))
    return nearest_ahead(chord2, (along - half_chord) / length, (along + half_chord) / length)


def stable(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """`half_b` without the subtraction of what is almost equal: one root is q / a, the other c / q."""
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    return from_discriminant(h * h - a * c, h, a, c)


def kahan(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """`stable`, with the errors of the products h² and a·c put back before one is taken from the other."""
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    square, square_low = dekker_product(h, h)
    product, product_low = dekker_product(a, c)
    return from_discriminant((square - product) + (square_low - product_low), h, a, c)


def haines(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """`stable`, its discriminant from the distance between the centre and the ray, which cancels less."""
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    s = h / a
    beside = minus(away, (s * direction[0], s * direction[1], s * direction[2]))
    return from_discriminant(a * (r * r - inner(beside, beside)), h, a, c)


def compensated(origin: Vector, direction: Vector, centre: Vector, r: Number) -> Number:
    """`haines` with an error-free O − C, with c, h and the distance in twice the digits, in units of powers of two."""
    unit, step = largest_exponent(origin, centre, r), largest_exponent(direction, direction, direction[0])
    d, r = scaled(direction, -step), scale(r, -unit)
    away, away_low = error_free_minus(scaled(origin, -unit), scaled(centre, -unit))
    h, h_low = inner_twofold(d, (0.0, 0.0, 0.0), away, away_low)
    a, a_low = inner_twofold(d, (0.0, 0.0, 0.0), d, (0.0, 0.0, 0.0))
    c, _ = side(away, away_low, r)
    s, s_low = divide(h, h_low, a, a_low)
    x = minus_multiple(away[0], away_low[0], s, s_low, d[0])
    y = minus_multiple(away[1], away_low[1], s, s_low, d[1])
    z = minus_multiple(away[2], away_low[2], s, s_low, d[2])
    return scale(from_discriminant(a * (r * r - inner((x, y, z), (x, y, z))), h, a, c), unit - step)


def double_double(origin: Vector, direction: Vector, direction_low: Vector, centre: Vector, r: Number) -> Number:
    """`stable` with every operation in two-fold float64, in units of powers of two."""
    unit, step = largest_exponent(origin, centre, r), largest_exponent(direction, direction, direction[0])
    d, d_low, r = scaled(direction, -step), scaled(direction_low, -step), scale(r, -unit)
    away, away_low = error_free_minus(scaled(origin, -unit), scaled(centre, -unit))
    h, h_low = inner_twofold(d, d_low, away, away_low)
    a, a_low = inner_twofold(d, d_low, d, d_low)
    c, c_low = side(away, away_low, r)
    disc, disc_low = discriminant(h, h_low, a, a_low, c, c_low)
    root, root_low = square_root(*magnitude(disc, disc_low))
    root, root_low = select(disc > 0.0, root, 0.0), select(disc > 0.0, root_low, 0.0)
    q, q_low = add(*magnitude(h, h_low), root, root_low)
    size, size_low = magnitude(c, c_low)
    by_q, _ = divide(size, size_low, q, q_low)
    by_a, _ = divide(q, q_low, a, a_low)
    ahead = h < 0.0
    t = select(c > 0.0, select(ahead, by_q, np.inf), select(ahead, by_a, select(c < 0.0, by_q, np.inf)))
    return scale(select(disc >= 0.0, t, np.inf), unit - step)


def from_discriminant(disc: Number, h: Number, a: Number, c: Number) -> Number:
    """The smallest positive root, with q = −(h ± √disc), its sign such that nothing cancels."""
    q = -(h + np.copysign(np.sqrt(abs(disc)), h))
    first, second = q / a, c / q
    return nearest_ahead(disc, select(first < second, first, second), select(first < second, second, first))


def nearest_ahead(disc: Number, near: Number, far: Number) -> Number:
    """The first of two roots that is above 0; +inf if none is, or where disc is negative or not a number."""
    return select(disc >= 0.0, select(near > 0.0, near, select(far > 0.0, far, np.inf)), np.inf)


def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def inner(a: Vector, b: Vector) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def scaled(a: Vector, n: Number) -> Vector:
    """a · 2ⁿ."""
    return scale(a[0], n), scale(a[1], n), scale(a[2], n)


def largest_exponent(a: Vector, b: Vector, c: Number) -> Number:
    """n such that the largest of these seven numbers is below 2ⁿ, and not below 2ⁿ⁻¹."""
    of_a = np.maximum(np.maximum(abs(a[0]), abs(a[1])), abs(a[2]))
    of_b = np.maximum(np.maximum(abs(b[0]), abs(b[1])), abs(b[2]))
    return exponent(np.maximum(np.maximum(of_a, of_b), abs(c)))


def error_free_minus(a: Vector, b: Vector) -> tuple[Vector, Vector]:
    """a − b, rounded, and what was rounded off."""
    x, x_low = two_sum(a[0], -b[0])
    y, y_low = two_sum(a[1], -b[1])
    z, z_low = two_sum(a[2], -b[2])
    return (x, y, z), (x_low, y_low, z_low)


def inner_twofold(a: Vector, a_low: Vector, b: Vector, b_low: Vector) -> Twofold:
    return dot(a[0], a[1], a[2], a_low[0], a_low[1], a_low[2], b[0], b[1], b[2], b_low[0], b_low[1], b_low[2])


def side(away: Vector, away_low: Vector, r: Number) -> Twofold:
    """c = L·L − r² in two-fold float64."""
    square, square_low = inner_twofold(away, away_low, away, away_low)
    r2, r2_low = two_product(r, r)
    return add(square, square_low, -r2, -r2_low)


def minus_multiple(x: Number, x_low: Number, s: Number, s_low: Number, d: Number) -> Number:
    """x − s·d, subtracted in two-fold float64 and then rounded."""
    step, step_low = multiply(s, s_low, d, 0.0)
    difference, _ = add(x, x_low, -step, -step_low)
    return difference


@dataclass(frozen=True)
class Limits:
    """Powers of ten up to which a method is right, and well above which it is seen to fail. None: no such limit.

    Right is: hits and misses are, but within a hundredth of the radius of tangent, and t is to a thousandth.
    """

    far: float | None = None  # distance / radius
    ground: float | None = None  # radius / height above the sphere
    size: float | None = None  # of all lengths, both up and down
    step: float | None = None  # of the direction, both up and down
    apart: float | None = None  # two hits, by what part of the radius: the limit is the power of its inverse


@dataclass(frozen=True)
class Method:
    """One row of `METHODS`: a way for a ray to meet a sphere.

    * `function`: from origin, direction, centre (three numbers each) and radius to the nearest t > 0, +inf for a miss,
      in plain arithmetic; None for one with a tracer of its own
    * `about`, `source`: the formula in a line, and where it is from
    * `limits`: how far it goes before it is wrong, in powers of ten
    * `precision`: what it computes in, float64 or float32
    """

    function: Callable[..., Number] | None  # None: it has a tracer of its own
    about: str
    source: str
    limits: Limits
    precision: type[np.floating] = np.float64
    twofold: bool = False  # the function takes the direction's low parts too


_TEXTBOOK = "any textbook"
_SHIRLEY = "P. Shirley, Ray Tracing in One Weekend, 6"
_GLASSNER = "A. Glassner (ed.), An Introduction to Ray Tracing, 2.1"
_RECIPES = "W. Press et al., Numerical Recipes, 5.6"
_KAHAN = "W. Kahan, On the Cost of Floating-Point Computation Without Extra-Precise Arithmetic, 2004"
_HAINES = (
    "E. Haines, J. Günther, T. Akenine-Möller, Precision Improvements for Ray/Sphere Intersection, Ray Tracing Gems 7"
)
_OGITA = "T. Ogita, S. Rump, S. Oishi, Accurate Sum and Dot Product, 2005"
_JOLDES = "M. Joldes, J.-M. Muller, V. Popescu, ACM TOMS 44, 2017"
_SINGLE = np.float32

_DOUBLE = Limits(far=6, ground=11, size=140, step=140, apart=13)
_FLOAT = Limits(far=2, ground=3, size=16, step=16, apart=4.5)

CERTIFIED = "certified"

METHODS = {
    CERTIFIED: Method(None, "float64 with a bound of its error, two-fold float64, integers", "certified.py", Limits()),
    "textbook": Method(textbook, "the guide's −b ± √(b² − 4ac)", _TEXTBOOK, _DOUBLE),
    "half_b": Method(half_b, "−h ± √(h² − ac)", _SHIRLEY, _DOUBLE),
    "geometric": Method(geometric, "the centre projected onto the ray", _GLASSNER, _DOUBLE),
    "stable": Method(stable, "half_b, but q / a and c / q for the roots", _RECIPES, _DOUBLE),
    "kahan": Method(kahan, "stable, h² − ac from exact products", _KAHAN, _DOUBLE),
    "haines": Method(haines, "stable, r² minus the squared distance from the ray", _HAINES, replace(_DOUBLE, far=13)),
    "compensated": Method(compensated, "haines, O − C without error, c and h two-fold", _OGITA, Limits(apart=13)),
    "double_double": Method(double_double, "stable in two-fold float64", _JOLDES, Limits(apart=14), twofold=True),
    "textbook32": Method(textbook, "textbook in float32", _TEXTBOOK, _FLOAT, _SINGLE),
    "half_b32": Method(half_b, "half_b in float32", _SHIRLEY, _FLOAT, _SINGLE),
    "geometric32": Method(geometric, "geometric in float32", _GLASSNER, _FLOAT, _SINGLE),
    "stable32": Method(stable, "stable in float32", _RECIPES, _FLOAT, _SINGLE),
    "haines32": Method(haines, "haines in float32", _HAINES, replace(_FLOAT, far=5), _SINGLE),
}


def row_of(method: str | Method) -> Method:
    """A method by its name, or one that is in no table; ValueError if there is no such method."""
    if isinstance(method, Method):
        return method
    if method not in METHODS:
        raise ValueError(f"found method {method!r}, expected one of {', '.join(METHODS)}")
    return METHODS[method]
