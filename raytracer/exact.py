"""The truth, in integers: what a ray hits when nothing is ever rounded. No kernel, no float arithmetic, no numpy.

Every finite float64 is an integer times a power of two, so a ray and its spheres can be scaled, exactly, until all of
their numbers are integers. Then

    the ray's line meets the sphere  ⇔  |D × L|² ≤ r² · D·D        (the distance of the centre from the line)
    the roots are (−D·L ± √Δ) / D·D  with Δ = r² · D·D − |D × L|²

where L = origin − centre. Signs of integers are certain, and two roots are put in order by squaring.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import MAX_EMAX, MIN_EMIN, Decimal, localcontext
from fractions import Fraction
from math import inf, isqrt, lcm
from typing import NamedTuple

Exact = float | Fraction  # a finite float64 stands for itself, exactly


class Root(NamedTuple):
    """The number (base + sign · √radicand) · over / under, all of them integers, under above 0."""

    base: int
    sign: int
    radicand: int
    over: int
    under: int

    def is_nearer(self, other: Root) -> bool:
        """Whether this root comes before another of the same ray."""
        return _sign_with_two_roots(self.base - other.base, self.sign, self.radicand, other.sign, other.radicand) < 0

    def nearest_float(self) -> float:
        """The float64 nearest to the root: +inf beyond the largest."""
        bits = 0
        while True:
            scaled = self.radicand << 2 * bits
            root = isqrt(scaled)
            exact = root * root == scaled
            low = (self.base << bits) + self.sign * root
            high = low if exact else low + self.sign
            nearest = _ratio(low * self.over, self.under << bits)
            if exact or nearest == _ratio(high * self.over, self.under << bits):
                return nearest
            bits = 2 * bits or 64

    def decimal(self, digits: int) -> Decimal:
        """The root, to so many digits: off by less than one in the last."""
        bits = 0
        while True:
            root = isqrt(self.radicand << 2 * bits)
            number = (self.base << bits) + self.sign * root
            exact = root * root == self.radicand << 2 * bits
            if exact or abs(number) > 10 ** (digits + 1):
                return quotient(number * self.over, self.under << bits, digits)
            bits = 2 * bits or 64


class Line(NamedTuple):
    """A whole line and a sphere: the quadratic a·t² + 2h·t + c = 0 of their meeting, and its roots if it has any."""

    a: Fraction
    h: Fraction
    c: Fraction
    disc: Fraction  # h² − a·c
    near: Root | None
    far: Root | None


def line(origin: Sequence[Exact], direction: Sequence[Exact], centre: Sequence[Exact], radius: Exact) -> Line:
    """Everything about the line of a ray and a sphere."""
    away = [Fraction(o) - Fraction(c) for o, c in zip(origin, centre, strict=True)]
    a = sum((Fraction(x) ** 2 for x in direction), Fraction(0))
    h = sum((Fraction(x) * y for x, y in zip(direction, away, strict=True)), Fraction(0))
    c = side(origin, centre, radius)
    (*numbers, size), unit = _integers([*origin, *centre, radius])
    steps, step_unit = _integers(direction)
    eye, middle = numbers[:3], numbers[3:]
    return Line(a, h, c, h * h - a * c, *_roots(eye, steps, [*middle, size], step_unit, unit))


def quotient(numerator: int, denominator: int, digits: int) -> Decimal:
    """numerator / denominator, rounded to so many digits."""
    with localcontext() as context:
        context.prec = digits
        context.Emax, context.Emin = MAX_EMAX, MIN_EMIN
        return Decimal(numerator) / Decimal(denominator)


def nearest_hit(
    origin: Sequence[Exact], direction: Sequence[Exact], spheres: Iterable[tuple[Sequence[Exact], Exact]], unit: int = 1
) -> tuple[float, int]:
    """What a ray hits first of spheres (centre, radius): t, rounded to the nearest float64, and which; or (+inf, −1).

    The ray's direction is `direction` / `unit`. Only t > 0 counts; a tangent ray hits; from inside, the far root is the
    hit; of equal roots the first sphere's wins.
    """
    return nearest_of(_flat(origin, spheres), direction, unit)


def nearest_of(lengths: list[Exact], direction: Sequence[Exact], unit: int = 1) -> tuple[float, int]:
    """`nearest_hit`, its lengths in one list: the origin, then centre and radius of each sphere."""
    best, index = None, -1
    for i, root in enumerate(_hits(lengths, direction, unit)):
        if root is not None and (best is None or root.is_nearer(best)):
            best, index = root, i
    return (inf, -1) if best is None else (best.nearest_float(), index)


def hits(
    origin: Sequence[Exact], direction: Sequence[Exact], spheres: Iterable[tuple[Sequence[Exact], Exact]], unit: int = 1
) -> list[Root | None]:
    """The smallest positive root of each sphere, or None for a miss; the ray's direction is `direction` / `unit`."""
    return _hits(_flat(origin, spheres), direction, unit)


def _flat(origin: Sequence[Exact], spheres: Iterable[tuple[Sequence[Exact], Exact]]) -> list[Exact]:
    numbers = [*origin]
    for centre, radius in spheres:
        numbers += (*centre, radius)
    return numbers


def _hits(lengths: list[Exact], direction: Sequence[Exact], unit: int) -> list[Root | None]:
    whole, length_unit = _integers(lengths)
    steps, step_unit = _integers(direction)
    over, eye = step_unit * unit, whole[:3]
    return [_hit(eye, steps, whole[k : k + 4], over, length_unit) for k in range(3, len(whole), 4)]


def side(origin: Sequence[Exact], centre: Sequence[Exact], radius: Exact) -> Fraction:
    """c = |origin − centre|² − radius²: negative inside the sphere, zero on it, positive outside."""
    distances = (Fraction(o) - Fraction(c) for o, c in zip(origin, centre, strict=True))
    return sum((x * x for x in distances), Fraction(0)) - Fraction(radius) ** 2


def _hit(eye: list[int], steps: list[int], sphere: list[int], over: int, under: int) -> Root | None:
    middle, radicand, a = _reduced(eye, steps, sphere)
    if radicand < 0:
        return None
    square = middle * middle
    if middle > 0 and square > radicand:
        return Root(middle, -1, radicand, over, a * under)
    if middle > 0 or square < radicand:
        return Root(middle, 1, radicand, over, a * under)
    return None


def _roots(
    eye: list[int], steps: list[int], sphere: list[int], over: int, under: int
) -> tuple[Root, Root] | tuple[None, None]:
    middle, radicand, a = _reduced(eye, steps, sphere)
    if radicand < 0:
        return None, None
    return Root(middle, -1, radicand, over, a * under), Root(middle, 1, radicand, over, a * under)


def _reduced(eye: list[int], steps: list[int], sphere: list[int]) -> tuple[int, int, int]:
    """−D·L, Δ and D·D."""
    (ox, oy, oz), (dx, dy, dz), (cx, cy, cz, radius) = eye, steps, sphere
    lx, ly, lz = ox - cx, oy - cy, oz - cz
    a = dx * dx + dy * dy + dz * dz
    x, y, z = dy * lz - dz * ly, dz * lx - dx * lz, dx * ly - dy * lx
    radicand = radius * radius * a - (x * x + y * y + z * z)
    return -(dx * lx + dy * ly + dz * lz), radicand, a


def _sign_with_root(base: int, sign: int, radicand: int) -> int:
    """The sign of base + sign · √radicand."""
    if base * sign >= 0:
        return _sign(base) or (sign if radicand else 0)
    return _sign(base) * _sign(base * base - radicand)


def _sign_with_two_roots(base: int, sign: int, radicand: int, less_sign: int, less_radicand: int) -> int:
    """The sign of base + sign · √radicand − less_sign · √less_radicand."""
    roots = sign if sign != less_sign else sign * _sign(radicand - less_radicand)
    if sign != less_sign and radicand == less_radicand == 0:
        roots = 0
    if roots * base >= 0:
        return _sign(base) or roots
    # |base| against |roots|: base² − (√radicand ∓ √less_radicand)²
    rest = base * base - radicand - less_radicand
    return _sign(base) * _sign_with_root(rest, sign * less_sign, 4 * radicand * less_radicand)


def _sign(number: int) -> int:
    return (number > 0) - (number < 0)


def _integers(numbers: Iterable[Exact]) -> tuple[list[int], int]:
    """Integers, and how many of them make 1: numbers = integers / that."""
    ratios = [number.as_integer_ratio() for number in numbers]
    whole = lcm(*[d for _, d in ratios])
    if whole == 1:
        return [n for n, _ in ratios], 1
    return [n * (whole // d) for n, d in ratios], whole


def _ratio(numerator: int, denominator: int) -> float:
    """Rounded to nearest; Python's division of integers is, but for its refusal to overflow."""
    try:
        return numerator / denominator
    except OverflowError:
        return inf
