"""The truth, in integers: what a ray hits when nothing is ever rounded. No kernel, no float arithmetic, no numpy.

Every finite float64 is an integer times a power of two, so a ray and its spheres can be scaled, exactly, until all of
their numbers are integers. Then

    the ray's line meets the sphere  ⇔  |D × L|² ≤ r² · D·D        (the distance of the centre from the line)
    the roots are (−D·L ± √Δ) / D·D  with Δ = r² · D·D − |D × L|²

where L = origin − centre. Signs of integers are certain, and two roots are put in order by squaring.

With a, b, c from the origin to the corners of a triangle and V = a·(b × c), not 0, D = Σ eᵢ · corner / V for e₁ =
D·(b × c), e₂ = D·(c × a), e₃ = D·(a × b) (Cramer); so the ray meets the triangle, its edges included, if and only if
all of them have V's sign or are 0, and that at t = V / (e₁ + e₂ + e₃). A ray within the triangle's plane, V = 0, meets
nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import MAX_EMAX, MIN_EMIN, Decimal, localcontext
from fractions import Fraction
from itertools import repeat
from math import frexp, inf, isqrt, lcm, ldexp, trunc
from typing import NamedTuple

Exact = float | Fraction  # a finite float64 stands for itself, exactly

Whole = tuple[int, int, int]  # a vector
Surd = tuple[int, int, int, int]  # (base + sign · √radicand) / divisor, all of them integers, divisor above 0

_MANTISSA = 53  # a float64's bits
_BITS = 128  # of a square root, to begin with: enough for a float64 even if 60 of them cancel


class Root(NamedTuple):
    """The number (base + sign · √radicand) · over / under, all of them integers, under above 0."""

    base: int
    sign: int
    radicand: int
    over: int
    under: int

    def is_nearer(self, other: Root) -> bool:
        """Whether this root comes before another of the same ray."""
        return _is_less((*self[:3], 1), (*other[:3], 1))

    def nearest_float(self) -> float:
        """The float64 nearest to the root: +inf beyond the largest."""
        return _nearest_float((*self[:3], 1), self.over, self.under)

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


def nearest_of(
    lengths: list[Exact], direction: Sequence[Exact], unit: int = 1, sizes: Sequence[int] | None = None
) -> tuple[float, int]:
    """`nearest_hit`, its lengths in one list: the origin, then centre and radius of each sphere.

    Or shapes of both kinds: `sizes` says of each how many numbers it has, 4 for a sphere, 9 for a triangle's corners.
    """
    whole, length_unit = _integers(lengths)
    steps, step_unit = _integers(direction)
    eye, a = whole[:3], _square(steps)
    best, k = None, 3
    for i, size in enumerate(sizes if sizes is not None else repeat(4, len(whole) // 4)):
        found = (_hit if size == 4 else _hit_triangle)(eye, steps, a, whole[k : k + size])
        k += size
        if found is not None and (best is None or _is_less(found, best)):
            best, at = found, i
    return (inf, -1) if best is None else (_nearest_float(best, step_unit * unit, a * length_unit), at)


def hits(
    origin: Sequence[Exact], direction: Sequence[Exact], spheres: Iterable[tuple[Sequence[Exact], Exact]], unit: int = 1
) -> list[Root | None]:
    """The smallest positive root of each sphere, or None for a miss; the ray's direction is `direction` / `unit`."""
    whole, length_unit = _integers(_flat(origin, spheres))
    steps, step_unit = _integers(direction)
    eye, a = whole[:3], _square(steps)
    over, under = step_unit * unit, a * length_unit
    found = [_hit(eye, steps, a, whole[k : k + 4]) for k in range(3, len(whole), 4)]
    return [None if surd is None else Root(*surd[:3], over, under) for surd in found]


def _flat(origin: Sequence[Exact], spheres: Iterable[tuple[Sequence[Exact], Exact]]) -> list[Exact]:
    numbers = [*origin]
    for centre, radius in spheres:
        numbers += (*centre, radius)
    return numbers


def side(origin: Sequence[Exact], centre: Sequence[Exact], radius: Exact) -> Fraction:
    """c = |origin − centre|² − radius²: negative inside the sphere, zero on it, positive outside."""
    distances = (Fraction(o) - Fraction(c) for o, c in zip(origin, centre, strict=True))
    return sum((x * x for x in distances), Fraction(0)) - Fraction(radius) ** 2


def volume(origin: Sequence[float], corners: Sequence[float]) -> Fraction:
    """V = a·(b × c) of three corners, nine numbers: 0 if the origin lies in the triangle's plane."""
    numbers, unit = _integers([*origin, *corners])
    found, _ = _volume_and_sides(numbers[:3], numbers[3:])
    return Fraction(found, unit**3)


def has_area(corners: Sequence[float]) -> bool:
    """Whether three corners, nine numbers, do not lie on one line."""
    (ax, ay, az, *numbers), _ = _integers(corners)
    bx, by, bz, cx, cy, cz = numbers
    return any(_cross((bx - ax, by - ay, bz - az), (cx - ax, cy - ay, cz - az)))


def _hit(eye: list[int], steps: list[int], a: int, sphere: list[int]) -> Surd | None:
    """The smallest root above 0, but for the factor that all roots of the ray share."""
    middle, radicand = _reduced(eye, steps, a, sphere)
    if radicand < 0:
        return None
    square = middle * middle
    if square < radicand:
        return middle, 1, radicand, 1
    if middle <= 0:
        return None
    if square > radicand:
        return middle, -1, radicand, 1
    return 2 * middle, 1, 0, 1  # the origin is on the sphere: one root is 0, and the other has no square root left


def _hit_triangle(eye: list[int], steps: list[int], a: int, corners: list[int]) -> Surd | None:
    """Where the ray meets a triangle, but for the same factor."""
    found = _seen_triangle(_facing(eye, corners, 1), steps)
    return None if found is None else (found[0] * a, *found[1:])


class SeenSphere(NamedTuple):
    """A sphere and an origin, in integers."""

    eye: list[int]
    sphere: list[int]  # centre, radius
    unit: int  # how many of them make 1


class SeenTriangle(NamedTuple):
    """A triangle as seen from an origin, in integers: what rays from there share."""

    volume: int  # V, not below 0; 0 if the origin lies in its plane, so that no ray meets it
    sides: tuple[Whole, ...]  # b × c, c × a, a × b, with V's sign
    unit: int  # how many of them make 1, in length


Seen = SeenSphere | SeenTriangle


def seen_from(origin: Sequence[float], shape: Sequence[float]) -> Seen:
    """A shape, centre and radius or three corners, as seen from an origin."""
    numbers, unit = _integers([*origin, *shape])
    if len(shape) == 4:
        return SeenSphere(numbers[:3], numbers[3:], unit)
    return _facing(numbers[:3], numbers[3:], unit)


def _facing(eye: list[int], corners: list[int], unit: int) -> SeenTriangle:
    found, sides = _volume_and_sides(eye, corners)
    if found < 0:
        found, sides = -found, tuple((-x, -y, -z) for x, y, z in sides)
    return SeenTriangle(found, sides, unit)


def _volume_and_sides(eye: list[int], corners: list[int]) -> tuple[int, tuple[Whole, ...]]:
    """a·(b × c), and b × c, c × a, a × b."""
    ox, oy, oz = eye
    a, b, c = ((x - ox, y - oy, z - oz) for x, y, z in zip(corners[::3], corners[1::3], corners[2::3], strict=True))
    x, y, z = side = _cross(b, c)
    return a[0] * x + a[1] * y + a[2] * z, (side, _cross(c, a), _cross(a, b))


def nearest_seen(shapes: Sequence[Seen], direction: Sequence[int], unit: int) -> tuple[float, int]:
    """`nearest_of` for shapes seen from one origin: t and which, of equal t the first."""
    steps, best = list(direction), None
    a = _square(steps)
    for i, shape in enumerate(shapes):
        found = _seen_triangle(shape, steps) if isinstance(shape, SeenTriangle) else _seen_sphere(shape, steps, a)
        if found is not None and (best is None or _is_less(found, best)):
            best, at = found, i
    return (inf, -1) if best is None else (_nearest_float(best, unit, 1), at)


def _seen_sphere(shape: SeenSphere, steps: list[int], a: int) -> Surd | None:
    found = _hit(shape.eye, steps, a, shape.sphere)
    return None if found is None else (*found[:3], a * shape.unit)


def _seen_triangle(shape: SeenTriangle, steps: list[int]) -> Surd | None:
    if shape.volume == 0:
        return None
    (dx, dy, dz), total = steps, 0
    for x, y, z in shape.sides:
        side = dx * x + dy * y + dz * z
        if side < 0:
            return None
        total += side
    return shape.volume, 1, 0, total * shape.unit


def _cross(a: Whole, b: Whole) -> Whole:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _roots(
    eye: list[int], steps: list[int], sphere: list[int], over: int, under: int
) -> tuple[Root, Root] | tuple[None, None]:
    a = _square(steps)
    middle, radicand = _reduced(eye, steps, a, sphere)
    if radicand < 0:
        return None, None
    return Root(middle, -1, radicand, over, a * under), Root(middle, 1, radicand, over, a * under)


def _square(steps: list[int]) -> int:
    """D·D."""
    x, y, z = steps
    return x * x + y * y + z * z


def _reduced(eye: list[int], steps: list[int], a: int, sphere: list[int]) -> tuple[int, int]:
    """−D·L and Δ, with D·D = a."""
    ox, oy, oz = eye
    dx, dy, dz = steps
    cx, cy, cz, radius = sphere
    lx, ly, lz = cx - ox, cy - oy, cz - oz  # −L: squares do not mind
    x, y, z = dy * lz - dz * ly, dz * lx - dx * lz, dx * ly - dy * lx
    return dx * lx + dy * ly + dz * lz, radius * radius * a - (x * x + y * y + z * z)


def _nearest_float(surd: Surd, over: int, under: int) -> float:
    """The float64 nearest to surd · over / under: +inf beyond the largest.

    As many bits of the surd are worked out as it takes for the float64 to be the same, whatever the others may be.
    """
    base, sign, radicand, divisor = surd
    bits, under = _BITS, under * divisor
    try:
        while radicand:
            up = bits - radicand.bit_length() // 2
            up, down = (up, 0) if up > 0 else (0, -up)
            scaled = radicand << 2 * up >> 2 * down
            root = isqrt(scaled)
            near = (base << up >> down) + sign * root  # the surd is above near − 1, and below near + 2
            top, bottom = over << down, under << up
            nearest = (near - 1) * top / bottom
            if nearest == (near + 2) * top / bottom:
                return nearest
            if not down and root * root == scaled:
                return near * top / bottom
            bits *= 2
        return base * over / under
    except OverflowError:
        return inf


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


def _is_less(surd: Surd, other: Surd) -> bool:
    """Whether one root of a ray comes before another."""
    base, sign, radicand, divisor = surd
    less_base, less_sign, less_radicand, less_divisor = other
    if divisor != less_divisor:
        base, radicand = base * less_divisor, radicand * less_divisor**2
        less_base, less_radicand = less_base * divisor, less_radicand * divisor**2
    return _sign_with_two_roots(base - less_base, sign, radicand, less_sign, less_radicand) < 0


def _integers(numbers: Sequence[Exact]) -> tuple[list[int], int]:
    """Integers, and how many of them make 1: numbers = integers / that.

    In one pass and with one power of two for all: this is most of what a ray costs.
    """
    smallest = inf
    for number in numbers:
        if type(number) is not float:
            return _integers_of_any(numbers)
        if -smallest < number < smallest and number:
            smallest = abs(number)
    bits = max(0, _MANTISSA - frexp(smallest)[1])  # behind the point; no larger number has more
    try:
        return [trunc(ldexp(number, bits)) for number in numbers], 1 << bits
    except OverflowError:  # more than a float64 can hold: the exponents are added to integers instead
        parts = map(frexp, numbers)
        return [trunc(ldexp(part, _MANTISSA)) << bits + exponent for part, exponent in parts], 1 << bits + _MANTISSA


def _integers_of_any(numbers: Sequence[Exact]) -> tuple[list[int], int]:
    """`_integers`, of numbers that are not all floats."""
    whole = [number for number in numbers if type(number) is int]
    if len(whole) == len(numbers):
        return whole, 1
    ratios = [number.as_integer_ratio() for number in numbers]
    unit = lcm(*[d for _, d in ratios])
    return [n * (unit // d) for n, d in ratios], unit
