"""Error-free sums and products, and the stated bounds of the rest, against fractions."""

from fractions import Fraction
from math import isqrt

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from raytracer import twofold

U2 = Fraction(1, 2**106)
NUMBER = st.floats(1e-20, 1e20) | st.floats(-1e20, -1e-20)


@st.composite
def twofolds(draw):
    high = draw(NUMBER)
    return twofold.quick_two_sum(high, high * draw(st.floats(-(2.0**-54), 2.0**-54)))


def value(pair):
    return sum(map(Fraction, map(float, pair)))


def relative_error(found, truth):
    return abs(value(found) - truth) / abs(truth) if truth else abs(value(found))


@given(NUMBER, NUMBER)
def test_two_sum_and_two_product_make_no_error(a, b):
    assert value(twofold.two_sum(a, b)) == Fraction(a) + Fraction(b)
    assert value(twofold.two_product(a, b)) == Fraction(a) * Fraction(b)


@given(twofolds(), twofolds())
def test_bounds_of_the_operations(a, b):
    assert relative_error(twofold.add(*a, *b), value(a) + value(b)) <= 3 * U2
    assert relative_error(twofold.multiply(*a, *b), value(a) * value(b)) <= 7 * U2
    assert relative_error(twofold.divide(*a, *b), value(a) / value(b)) <= 15 * U2


@given(twofolds())
def test_bound_of_the_square_root(a):
    high, low = a if a[0] > 0 else (-a[0], -a[1])
    scale = 2**600
    truth = Fraction(isqrt(int((Fraction(high) + Fraction(low)) * scale**2)), scale)
    assert relative_error(twofold.square_root(high, low), truth) <= 4 * U2


@given(st.lists(twofolds(), min_size=6, max_size=6))
def test_bound_of_the_dot_product(numbers):
    a, b = numbers[:3], numbers[3:]
    highs_and_lows = [*[n[0] for n in a], *[n[1] for n in a], *[n[0] for n in b], *[n[1] for n in b]]
    products = [value(x) * value(y) for x, y in zip(a, b, strict=True)]
    found = value(twofold.dot(*highs_and_lows))
    assert abs(found - sum(products)) <= 13 * U2 * sum(map(abs, products))


def test_select_takes_arrays():
    assert twofold.select(np.array([True, False]), 1.0, np.array([2.0, 3.0])).tolist() == [1.0, 3.0]
