"""t of a hit to the last digit, for many pixels of a picture: what they share is worked out once.

An eye ray is D = U·u + V·v − d·w, so that for a sphere L away from the eye h = D·L is linear in U and in V, as
a = D·D is a quadratic form: `seen` has the factors of a sphere, `square_of_row` and `linear` those of a row. They are
sums of two float64, as in `twofold`, but left as they come: `low` need not be below half an ulp of `high`. t is then
one Newton step from its rounded value,

    t = t₀ + f / 2√disc,  f = a·t₀² + 2h·t₀ + c

where f is computed as (a·t₀ + 2h)·t₀ + c, all of it in such sums.

**Errors**, with u = 2⁻⁵³. The parts that `high` loses are known without error. They are added in float64, and none is
above 4u times the sum S of its terms' sizes, so that of three products and their sums less is lost than 24u²·S. With U
and V (2u² each, see `camera`), their products and sums, that is below 64u² times the sizes of terms, which are at most
m·l for h and m² for a (see `certified`), and below 40u²·l² for c. In f, products and sums add less than
24u² (a·t² + 2|h|t + c). Altogether f is off by less than 100u² (m·t + l)². The frame is a right one, so m² ≤ 3 D·D, and
t|D| ≤ l for a near hit: f is off by less than 2⁻⁹⁶·l², and t by that over 2t√disc of itself. A radius is a quarter of
the depth at most (see `kernels.quick`), so l² ≤ 1.2c, and that is below 2⁻⁵⁸ where c ≤ 2³⁷·t√disc. What the step leaves
is a·δ² / 2√disc, δ its length, and less than that as √disc is rounded.
"""

from __future__ import annotations

import numpy as np

from raytracer.twofold import Number, Twofold, quick_two_sum, times_plus, two_product, two_sum

Three = tuple[Number, Number, Number]
Frame = tuple[Twofold, Twofold, Twofold, Twofold, Twofold, Twofold]

_NONE = 0.0, 0.0, 0.0


def linear(x: Twofold, slope: Twofold, start: Twofold) -> Twofold:
    """x · slope + start."""
    product, error = two_product(x[0], slope[0])
    high, rest = two_sum(product, start[0])
    return high, times_plus(x[0], slope[1], times_plus(x[1], slope[0], error)) + (rest + start[1])


def inner(a: Three, b: Three, b_low: Three) -> Twofold:
    """a · b, of an a that has no rests."""
    x, x_low = two_product(a[0], b[0])
    y, y_low = two_product(a[1], b[1])
    z, z_low = two_product(a[2], b[2])
    total, first = two_sum(x, y)
    total, second = two_sum(total, z)
    rest = times_plus(a[0], b_low[0], times_plus(a[1], b_low[1], a[2] * b_low[2]))
    return total, ((x_low + y_low) + z_low) + ((first + second) + rest)


def times(a: Number, b: Twofold) -> Twofold:
    """a · b, of an a that has no rest."""
    high, error = two_product(a, b[0])
    return high, times_plus(a, b[1], error)


def seen(
    eye: Three, centre: Three, radius: Number, u: Three, v: Three, w: Three, back: Number
) -> tuple[Twofold, Twofold, Twofold, Twofold]:
    """A sphere as eye rays see it: h is U·hu + (V·hv + hw); hu, hv, hw and c. `back` is d."""
    lx, lx_low = two_sum(eye[0], -centre[0])
    ly, ly_low = two_sum(eye[1], -centre[1])
    lz, lz_low = two_sum(eye[2], -centre[2])
    away, rests = (lx, ly, lz), (lx_low, ly_low, lz_low)
    square, low = inner(away, away, (lx_low + lx_low, ly_low + ly_low, lz_low + lz_low))
    r2, r2_low = two_product(radius, radius)
    c, error = two_sum(square, -r2)
    hw = times(-back, inner(w, away, rests))
    return inner(u, away, rests), inner(v, away, rests), hw, (c, error + (low - r2_low))


def frame_of(u: Three, v: Three, w: Three, back: Number) -> Frame:
    """What D·D is made of: u·u, u·v, −d(u·w), v·v, −d(v·w), d²(w·w)."""
    uw, vw, ww = inner(u, w, _NONE), inner(v, w, _NONE), inner(w, w, _NONE)
    ahead = times(-back, times(-back, ww))
    return inner(u, u, _NONE), inner(u, v, _NONE), times(-back, uw), inner(v, v, _NONE), times(-back, vw), ahead


def square_of_row(up: Twofold, frame: Frame) -> tuple[Twofold, Twofold]:
    """D·D of a row's rays is (U·(u·u) + a1)·U + a0: a1 and a0."""
    _, uv, uw, vv, vw, ww = frame
    return times(2.0, linear(up, uv, uw)), linear(up, linear(up, vv, times(2.0, vw)), ww)


def meet(h: Twofold, a: Twofold, c: Twofold) -> tuple[Number, Number]:
    """t of a ray's near hit, of a sphere whose radius is at most a quarter of its depth; and whether that is certain.

    Then it is off by less than an ulp.
    """
    root = np.sqrt(h[0] * h[0] - a[0] * c[0])
    t = (-h[0] - root) / a[0]
    product, error = two_product(a[0], t)
    high, rest = quick_two_sum(h[0] + h[0], product)  # a·t₀ = |h| − √disc is the smaller one
    low = times_plus(a[1], t, error) + (rest + (h[1] + h[1]))
    product, error = two_product(high, t)
    step = ((product + c[0]) + (times_plus(low, t, error) + c[1])) / (root + root)
    room = t * root
    return t + step, (a[0] * (step * step) <= 2.0**-57 * room) & (c[0] <= 2.0**37 * room)
