"""Arithmetic with twice the digits: a number is the unevaluated sum of two float64, `high + low`.

Every function here takes numbers or numpy arrays alike and uses nothing but + − × ÷ and the square root, each correctly
rounded. So numpy runs it on arrays, the compiler on single numbers, and both get the same bits (not of `times_plus`).

Sources: the error-free sums and products are Knuth's and Dekker's; names and error bounds (u = 2⁻⁵³) are those of
M. Joldes, J.-M. Muller, V. Popescu, "Tight and rigorous error bounds for basic building blocks of double-word
arithmetic", ACM TOMS 44 (2017). The bounds hold while nothing overflows and no product comes near the subnormal range.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Number = Any  # a float64, or an array of them
Twofold = tuple[Number, Number]

_SPLITTER = 134217729.0  # 2²⁷ + 1: cuts 53 bits into 26 + 26 (Veltkamp)


def select(condition: Number, yes: Number, no: Number) -> Number:
    """`yes` where the condition holds, `no` elsewhere. Both are computed."""
    return np.where(condition, yes, no)


def exponent(x: Number) -> Number:
    """n with 2ⁿ⁻¹ ≤ |x| < 2ⁿ."""
    return np.frexp(x)[1]


def scale(x: Number, n: Number) -> Number:
    """x · 2ⁿ, exactly while it is in range."""
    return np.ldexp(x, n)


def two_sum(a: Number, b: Number) -> Twofold:
    """a + b without error, for any a and b (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def quick_two_sum(a: Number, b: Number) -> Twofold:
    """a + b without error, where |a| ≥ |b| or a = 0 (Dekker)."""
    total = a + b
    return total, b - (total - a)


def two_product(a: Number, b: Number) -> Twofold:
    """a · b without error, in range: the kernels use a fused multiply-add for it, where the processor has one."""
    return dekker_product(a, b)


def dekker_product(a: Number, b: Number) -> Twofold:
    """a · b without error (Dekker, Veltkamp); |a|, |b| below 2⁹⁹⁵. Beyond that, the same nonsense everywhere."""
    product = a * b
    far = _SPLITTER * a
    a_high = far - (far - a)
    a_low = a - a_high
    far = _SPLITTER * b
    b_high = far - (far - b)
    b_low = b - b_high
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def times_plus(a: Number, b: Number, c: Number) -> Number:
    """a · b + c, rounded once or twice: for rests, of which the last digit does not matter."""
    return a * b + c


def add(a: Number, a_low: Number, b: Number, b_low: Number) -> Twofold:
    """a + b, relative error at most 3u² (AccurateDWPlusDW)."""
    high, error = two_sum(a, b)
    low, rest = two_sum(a_low, b_low)
    high, error = quick_two_sum(high, error + low)
    return quick_two_sum(high, rest + error)


def multiply(a: Number, a_low: Number, b: Number, b_low: Number) -> Twofold:
    """a · b, relative error at most 7u² (DWTimesDW1)."""
    high, low = two_product(a, b)
    return quick_two_sum(high, low + (a * b_low + a_low * b))


def divide(a: Number, a_low: Number, b: Number, b_low: Number) -> Twofold:
    """a ÷ b, relative error at most 15u² (DWDivDW2)."""
    quotient = a / b
    product, product_low = multiply(b, b_low, quotient, 0.0)
    return quick_two_sum(quotient, ((a - product) + (a_low - product_low)) / b)


def square_root(a: Number, a_low: Number) -> Twofold:
    """√a for a > 0, relative error at most 4u²: one Newton step from the rounded root."""
    root = np.sqrt(a)
    square, square_low = two_product(root, root)
    return quick_two_sum(root, ((a - square) - square_low + a_low) / (root + root))


def dot(
    ax: Number, ay: Number, az: Number, ax_low: Number, ay_low: Number, az_low: Number,
    bx: Number, by: Number, bz: Number, bx_low: Number, by_low: Number, bz_low: Number,
) -> Twofold:  # fmt: skip
    """a · b of two vectors, error at most 13u² Σ|aₖ bₖ|: a product (7u²) and two sums (3u² each)."""
    x, x_low = multiply(ax, ax_low, bx, bx_low)
    y, y_low = multiply(ay, ay_low, by, by_low)
    z, z_low = multiply(az, az_low, bz, bz_low)
    x, x_low = add(x, x_low, y, y_low)
    return add(x, x_low, z, z_low)
