"""The oracle, against a formula and a library that it does not use: the quadratic, in mpmath at 300 bits."""

import math
from fractions import Fraction

import mpmath
import pytest
from cases import CASES
from hypothesis import given
from hypothesis import strategies as st

from raytracer import exact

SMALL = st.integers(-40, 40)
POINT = st.tuples(SMALL, SMALL, SMALL)
DIRECTION = POINT.filter(any)

ODD = [
    0.0,
    -0.0,
    5e-324,
    -3e-320,
    2.0**-1022,
    1e-300,
    -1e-17,
    0.1,
    -1.0,
    3.0,
    2.0**53,
    1e22,
    -1e300,
    1.7976931348623157e308,
]
COMPONENT = st.one_of(
    st.floats(-9, 9), SMALL.map(float), st.sampled_from(ODD), st.floats(allow_nan=False, allow_infinity=False)
)
VECTOR = st.tuples(COMPONENT, COMPONENT, COMPONENT)
WIDE_SPHERE = st.tuples(VECTOR, COMPONENT.map(abs).filter(bool))
WIDE_BITS = 12000  # with as many, sums and products of any six float64 are not rounded


def quadratic_roots(origin, direction, centre, radius, bits=300, zero=2.0**-200):
    """The positive roots, from textbook's quadratic formula at 300 bits; a disc this near to 0 is 0."""
    with mpmath.workprec(bits):
        away = [mpmath.mpf(o) - c for o, c in zip(origin, centre, strict=True)]
        a = mpmath.fsum(mpmath.mpf(x) ** 2 for x in direction)
        b = 2 * mpmath.fsum(x * y for x, y in zip(direction, away, strict=True))
        c = mpmath.fsum(x * x for x in away) - mpmath.mpf(radius) ** 2
        disc = b * b - 4 * a * c
        if disc < 0:
            return []
        roots = [(-b - mpmath.sqrt(disc)) / (2 * a), (-b + mpmath.sqrt(disc)) / (2 * a)]
        return [root for root in roots if root > zero]


def is_nearest(t, number):
    """Whether t is the float64 nearest to a positive number, of WIDE_BITS."""
    with mpmath.workprec(WIDE_BITS):
        if t == math.inf:
            return number >= mpmath.mpf(2) ** 1024 - mpmath.mpf(2) ** 970
        above, below = math.nextafter(t, math.inf), math.nextafter(t, -math.inf)
        upper = mpmath.mpf(2) ** 1024 if above == math.inf else mpmath.mpf(above)
        return (mpmath.mpf(t) + below) / 2 <= number <= (mpmath.mpf(t) + upper) / 2


def flat(origin, spheres):
    return [*origin, *(number for centre, radius in spheres for number in (*centre, radius))]


@given(POINT, DIRECTION, POINT, st.integers(1, 60))
def test_hits_are_the_roots_of_the_quadratic(origin, direction, centre, radius):
    t, index = exact.nearest_hit(origin, direction, [(centre, radius)])
    roots = quadratic_roots(origin, direction, centre, mpmath.mpf(radius))
    assert (index == 0) == bool(roots)
    assert t == (float(roots[0]) if roots else math.inf)


@given(POINT, DIRECTION, st.lists(st.tuples(POINT, st.integers(1, 60)), min_size=2, max_size=6))
def test_the_nearest_of_many_is_the_smallest_root_and_the_first_of_equals(origin, direction, spheres):
    t, index = exact.nearest_hit(origin, direction, spheres)
    roots = [
        (quadratic_roots(origin, direction, centre, mpmath.mpf(radius)) or [mpmath.inf])[0]
        for centre, radius in spheres
    ]
    nearest = min(roots)
    assert t == float(nearest)
    close = [i for i, root in enumerate(roots) if root == nearest or abs(root - nearest) < mpmath.mpf(2) ** -200]
    assert index == (-1 if nearest == mpmath.inf else close[0])


@given(POINT, DIRECTION, POINT, st.integers(1, 60), st.integers(-300, 300), st.integers(-300, 300))
def test_scaling_by_powers_of_two_changes_nothing_else(origin, direction, centre, radius, e, f):
    unit, step = Fraction(2) ** e, Fraction(2) ** f
    scaled = exact.hits(
        [x * unit for x in origin], [x * step for x in direction], [([x * unit for x in centre], radius * unit)]
    )[0]
    plain = exact.hits(origin, direction, [(centre, radius)])[0]
    assert (plain is None) == (scaled is None)
    if plain is not None:
        assert scaled.nearest_float() == math.ldexp(plain.nearest_float(), e - f)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_known_cases(case):
    t, index = exact.nearest_hit(case.origin, case.direction, case.spheres)
    assert (t, index) == (case.t, case.index)


def test_a_root_beyond_float64_is_infinite():
    t, index = exact.nearest_hit((0.0, 0.0, 0.0), (0.0, 0.0, -1e-200), [((0.0, 0.0, -1e200), 1.0)])
    assert (t, index) == (math.inf, 0)


def test_side_is_exact():
    assert exact.side((3.0, 4.0, 0.0), (0.0, 0.0, 0.0), 5.0) == 0
    assert exact.side((1e200, 0.0, 0.0), (0.0, 0.0, 0.0), math.nextafter(1e200, 0)) > 0


@given(POINT, DIRECTION, POINT, st.integers(1, 60))
def test_a_line_has_the_quadratics_figures_and_roots_to_any_number_of_digits(origin, direction, centre, radius):
    line = exact.line(origin, direction, centre, radius)
    away = [o - c for o, c in zip(origin, centre, strict=True)]
    assert line.a == sum(x * x for x in direction)
    assert line.h == sum(x * y for x, y in zip(direction, away, strict=True))
    assert line.c == sum(x * x for x in away) - radius**2
    assert line.disc == line.h**2 - line.a * line.c
    assert (line.near is None) == (line.disc < 0)
    if line.near is not None:
        with mpmath.workdps(80):
            root = mpmath.sqrt(mpmath.mpf(line.disc.numerator))
            for sign, found in ((-1, line.near), (1, line.far)):
                truth = (sign * root - line.h.numerator) / line.a.numerator
                assert abs(mpmath.mpf(str(found.decimal(60))) - truth) <= abs(truth) * mpmath.mpf(10) ** -58


@given(VECTOR, VECTOR.filter(any), st.lists(WIDE_SPHERE, min_size=1, max_size=3), st.integers(1, 10**40))
def test_floats_of_any_size_have_the_roots_of_the_quadratic(origin, direction, spheres, unit):
    t, index = exact.nearest_of(flat(origin, spheres), direction, unit)
    with mpmath.workprec(WIDE_BITS):
        roots = [
            (quadratic_roots(origin, direction, *sphere, WIDE_BITS, 0) or [mpmath.inf])[0] * unit for sphere in spheres
        ]
        nearest = min(roots)
        ties = [i for i, root in enumerate(roots) if root == nearest or root - nearest < nearest * mpmath.eps * 2**99]
    assert index == (-1 if nearest == mpmath.inf else ties[0])
    assert t == math.inf if index < 0 else is_nearest(t, nearest)


@given(VECTOR, VECTOR.filter(any), st.lists(WIDE_SPHERE, min_size=1, max_size=3), st.integers(1, 10**40))
def test_floats_fractions_and_whole_directions_are_the_same_to_it(origin, direction, spheres, unit):
    lengths = flat(origin, spheres)
    found = exact.nearest_of(lengths, direction, unit)
    fractions = [Fraction(x) for x in direction]
    steps = math.lcm(*(x.denominator for x in fractions))
    whole = [int(x * steps) for x in fractions]
    assert exact.nearest_of([Fraction(x) for x in lengths], fractions, unit) == found
    assert exact.nearest_of([Fraction(lengths[0]), *lengths[1:]], direction, unit) == found
    assert exact.nearest_of(lengths, whole, unit * steps) == found


@pytest.mark.parametrize("change", [Fraction(1, 3**100), Fraction(1, 1 << 2000)])
def test_a_fraction_among_floats_is_not_rounded(change):
    lengths = [1.0, 0.0, 0.0, 0.0, 0.0, -10.0, 1 - change]
    assert exact.nearest_of(lengths, (0.0, 0.0, -1.0)) == (math.inf, -1)
    assert exact.nearest_of(lengths, (-change, 0.0, -1.0)) == (10.0, 0)
    assert exact.nearest_of([1.0, 0.0, 0.0, 0.0, 0.0, -10.0, 1.0], (change, 0.0, -1.0)) == (math.inf, -1)


TURNS = [((1, 0, 0), (0, 1, 0), 1), ((2, -2, 1), (1, 2, 2), 3), ((2, 3, 6), (3, -6, 2), 7), ((-4, 7, 4), (8, 4, 1), 9)]
SCALES = st.integers(-1000, 900).map(lambda e: Fraction(2) ** e)


@given(st.sampled_from(TURNS), POINT, SMALL, st.integers(1, 1 << 70), SCALES, st.integers(1, 10**20))
def test_a_tangent_ray_hits_and_all_who_touch_it_there_tie(turn, centre, steps, reach, size, unit):
    along, across, length = turn
    origin = [(c + reach * x + steps * y) * size for c, x, y in zip(centre, across, along, strict=True)]
    middle = [c * size for c in centre]
    other = [(c + 2 * reach * x) * size for c, x in zip(centre, across, strict=True)]  # on the other side of the ray
    larger = reach * length * size
    both = [*origin, *middle, larger, *other, larger]
    t, index = exact.nearest_of(both, along, unit)
    assert (t, index) == ((float(-steps * size * unit), 0) if steps < 0 else (math.inf, -1))
    smaller = larger * (1 - Fraction(1, 1 << 200))
    missed = exact.nearest_of([*origin, *middle, smaller], along, unit)
    assert missed == (math.inf, -1)


@given(st.sampled_from(TURNS), POINT, DIRECTION, st.integers(1, 1 << 70), SCALES, st.integers(1, 10**20))
def test_from_the_sphere_itself_only_the_other_root_counts(turn, centre, direction, reach, size, unit):
    _, across, length = turn
    origin = [(c + reach * x) * size for c, x in zip(centre, across, strict=True)]
    inward = -sum(x * y for x, y in zip(direction, across, strict=True))
    t, index = exact.nearest_of([*origin, *(c * size for c in centre), reach * length * size], direction, unit)
    truth = Fraction(2 * inward * reach * unit, sum(x * x for x in direction)) * size
    assert (t, index) == ((float(truth), 0) if inward > 0 else (math.inf, -1))


@pytest.mark.parametrize("radius", [1, 3, 3**40, 3**100, 5**300])
@pytest.mark.parametrize("scale", [Fraction(1), Fraction(2) ** 400, Fraction(1, 3)])
@pytest.mark.parametrize(("middle", "even"), [(2**53 + 1, 2**53), (2**53 + 3, 2**53 + 4)])
@pytest.mark.parametrize("inside", [False, True])
def test_halfway_between_two_floats_the_even_one_is_nearest(radius, scale, middle, even, inside):
    radius += 2**54 if inside else 0
    towards = middle - radius if inside else middle + radius
    for change, nearest in ((0, even), (1, middle + 1), (-1, middle - 1)):
        centre = (towards + Fraction(change, 10**150)) * scale
        assert exact.nearest_of([0, 0, 0, centre, 0, 0, radius * scale], (scale, 0, 0)) == (nearest, 0)


@given(POINT, DIRECTION, POINT, st.integers(1, 60))
def test_roots_of_a_line_are_rounded_on_either_side(origin, direction, centre, radius):
    line = exact.line(origin, direction, centre, radius)
    if line.near is not None:
        with mpmath.workprec(WIDE_BITS):
            root = mpmath.sqrt(mpmath.mpf(line.disc.numerator))
            for sign, found in ((-1, line.near), (1, line.far)):
                assert found.nearest_float() == float((sign * root - line.h.numerator) / line.a.numerator)
