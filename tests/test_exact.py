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


def quadratic_roots(origin, direction, centre, radius):
    """The positive roots, from textbook's quadratic formula at 300 bits; a disc this near to 0 is 0."""
    with mpmath.workprec(300):
        away = [mpmath.mpf(o) - c for o, c in zip(origin, centre, strict=True)]
        a = mpmath.fsum(x * x for x in direction)
        b = 2 * mpmath.fsum(x * y for x, y in zip(direction, away, strict=True))
        c = mpmath.fsum(x * x for x in away) - radius**2
        disc = b * b - 4 * a * c
        if disc < 0:
            return []
        roots = [(-b - mpmath.sqrt(disc)) / (2 * a), (-b + mpmath.sqrt(disc)) / (2 * a)]
        return [root for root in roots if root > mpmath.mpf(2) ** -200]


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
