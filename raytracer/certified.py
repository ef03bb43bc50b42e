"""Does this ray meet this sphere, where, and is it nearer than another? Answers that know when they do not know.

With D the direction, L = O − C, a = D·D, h = D·L, c = L·L − r² and disc = h² − a·c, the two roots are

    near = c / q,  far = q / a      with q = |h| + √disc, for a ray that comes nearer (h < 0),

neither of which subtracts what is almost equal (Press et al., Numerical Recipes, 5.6). Beside each rounded value goes
a bound of its error, a forward error analysis in the manner of N. Higham, Accuracy and Stability of Numerical
Algorithms, ch. 3. A hit or a miss is certain when the value is farther from zero than its bound. What is not certain is
said to be so, and goes on to the next level: float64, then two-fold float64 (`meet_twofold`), then the integers.

Everything here is plain arithmetic on numbers or arrays alike (see `twofold`). u = 2⁻⁵³ is the unit roundoff.

**The bounds in float64.** m ≥ |D| is the ray's reach, the length of the vector of Σ over a component's three terms of
their sizes; for rays given in float64, m = |D|. l² = L·L + r², and L is rounded once, by u|Lₖ|.

* h of an eye ray is U·(u·L) + (V·(v·L) + (−d·w)·L): 3.01u for a dot product and 1.01u for L; 1u each for U or V, its
  product, d·w; 2u for the two sums. No term has more than eight of these: |error| < 9u·m·l. h of a given ray has 1.01u
  from L and 3.01u from D·L.
* a of an eye ray is a quadratic in U (`Grid`): 3.01u for a dot product, 2u for U or V twice, 2u for d·w twice, 1u for
  every other product and sum, and no term has more than eleven: |error| < 12u·m².
* c: `c_error`, which whoever computed c states; at most 8u·l², in float64 5.1u·l² (L twice, a dot product, r², a sum).
* disc: h² brings 2 · 9u·(m·l)², a·c brings 12u·m²·|c| + m²·c_error, two products and a difference 4u·(m·l)². As
  |c| ≤ l² that is below 40u·(m·l)² + m²·c_error.
* √disc: below (error of disc) / √disc. q: that, and twice the error of h (its sign may be wrong by that much).

**Many spheres at once** (`approach`) are put in order by k = a·t = −h − √disc alone, without a division. That is for
spheres with c ≥ l²/64 that lie in front of the eye as a whole. As k = a·c/q and q ≤ 2|D|·l, k ≥ |D|·c/2l ≥
m·l / (2κ·l²/c), with κ ≥ m/|D| for all rays of the picture. A disc above (rim·m·l)², rim = 96·2⁻²⁶·κ·l²/c, leaves k
with an error of 12u·m·l from h and the roundings, and of 48u·(m·l)² / (rim·m·l) from the root (c_error ≤ 8u·l²):
together (24u + 96u/rim)·κ·l²/c·k at most, below 2⁻²⁶·k while κ ≤ 64. A disc below −(rim·m·l)² is a miss, with much to
spare. Between the two, and where two k differ by less than 2⁻²⁴ of themselves, the next level decides.

**Triangles** (`approach_facet`, see `facets`). aᵢ and the edges are rounded once, so a component of a cross product is
off by 4u of its two terms' sizes, the whole of it by less than 6u·|a||edge|, and eᵢ, a sum like h above, by less than
32u·m·|a||edge|; likewise n·D by 32u·m·|edge||edge|, and n·a by 16u. Where both are above 2⁻²¹ of their largest values,
t's error is below 2⁻²⁷ + 2⁻²⁸, and k's below 2⁻²⁶.

**In two-fold arithmetic** the same sums hold with u² = 2⁻¹⁰⁶ for u and constants from `twofold`: D within 16u²·m, a dot
product 13u², so h and a within 64u² = 2⁻¹⁰⁰ of m·l and m²; c within 16u²·l²; disc within 256u² = 2⁻⁹⁸ of (m·l)².
"""

from __future__ import annotations

import numpy as np

from raytracer.twofold import (
    Number,
    Twofold,
    add,
    divide,
    dot,
    multiply,
    select,
    square_root,
    two_product,
    two_sum,
)

Three = tuple[Number, Number, Number]
Four = tuple[Number, Number, Number, Number]
Five = tuple[Number, Number, Number, Number, Number]
Six = tuple[Number, Number, Number, Number, Number, Number]
Ten = tuple[*Six, *Four]

U = 2.0**-53
H_ERROR = 9 * U
A_ERROR = 12 * U
C_ERROR = 8 * U
DISC_ERROR = 40 * U
H_ERROR_2 = A_ERROR_2 = 2.0**-100
C_ERROR_2 = 2.0**-102
DISC_ERROR_2 = 2.0**-98

# Closer to a sphere than this part of l², its c is worked out in integers.
CLOSE = 2.0**-40

# Between these sizes of D and L, squares of squares neither overflow nor come near the subnormal numbers.
SMALLEST, LARGEST = 1e-70, 1e70

# For `approach`: k's relative error, the largest κ, the largest l²/c, and rim / κ / (l²/c).
K_ERROR = 2.0**-26
LARGEST_SPREAD = 64.0
NEAREST = 64.0
RIM = 96.0 * 2.0**-26
TIE = 4.0 * K_ERROR

# For `approach_facet`, of the largest value each: the error of eᵢ and n·D; and how small n·D and n·a may be.
FACET_ERROR = 2.0**-48
STEEP = 2.0**-21

# A hit's t is good enough to be shaded when its bound is less than this part of the radius, and of itself. Beyond that
# lies a rim of a sphere's picture, which must stay narrow: what is in it goes on to the next level.
T_TOLERANCE = 2.0**-14
T_TOLERANCE_2 = 2.0**-60


def in_range(size: Number) -> Number:
    """The size, or NaN where the error bounds would not hold; NaN makes every decision uncertain."""
    return select((size > SMALLEST) & (size < LARGEST), size, np.nan)


def edge_of(c: Number, square: Number, m: Number, kappa: Number) -> Number:
    """(rim·m·l)² of a sphere with l² = square, or 0 if it is not far enough outside for `approach`."""
    rim = (RIM * kappa) * (square / c)
    usable = (c * NEAREST >= square) & (square > SMALLEST * SMALLEST) & (square < LARGEST * LARGEST)
    return select(usable, (rim * rim) * ((m * m) * square), 0.0)


def inner(ax: Number, ay: Number, az: Number, bx: Number, by: Number, bz: Number) -> Number:
    """a · b."""
    return ax * bx + ay * by + az * bz


def side_of(lx: Number, ly: Number, lz: Number, radius: Number) -> tuple[Number, Number]:
    """c and l² of a sphere whose centre is L away."""
    square, r2 = inner(lx, ly, lz, lx, ly, lz), radius * radius
    return square - r2, square + r2


def look(ox: Number, oy: Number, oz: Number, cx: Number, cy: Number, cz: Number, radius: Number) -> Six:
    """A sphere as seen from a ray's origin, in float64: L, c and its error, l."""
    lx, ly, lz = ox - cx, oy - cy, oz - cz
    c, square = side_of(lx, ly, lz, radius)
    return lx, ly, lz, c, C_ERROR * square, in_range(np.sqrt(square))


def look_twofold(
    ox: Number, oy: Number, oz: Number, cx: Number, cy: Number, cz: Number, radius: Number,
    known: Number, known_low: Number, known_error: Number,
) -> Ten:  # fmt: skip
    """A sphere as seen from a ray's origin: L without error, c in two-fold float64, its error, l.

    c is what is known of it, unless that is NaN.
    """
    lx, lx_low = two_sum(ox, -cx)
    ly, ly_low = two_sum(oy, -cy)
    lz, lz_low = two_sum(oz, -cz)
    square, square_low = dot(lx, ly, lz, lx_low, ly_low, lz_low, lx, ly, lz, lx_low, ly_low, lz_low)
    r2, r2_low = two_product(radius, radius)
    c, c_low = add(square, square_low, -r2, -r2_low)
    size, is_known = square + r2, known == known
    c, c_low = select(is_known, known, c), select(is_known, known_low, c_low)
    c_error = select(is_known, known_error, C_ERROR_2 * size)
    return lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, in_range(np.sqrt(size))


def meet(
    h: Number, a: Number, c: Number, c_error: Number, l: Number, radius: Number, m: Number,  # noqa: E741
    tolerance: Number = T_TOLERANCE,
) -> Three:  # fmt: skip
    """Where a ray meets a sphere, in float64: t, a bound of its error, and `low`, as `verdict` returns them."""
    disc = h * h - a * c
    root = np.sqrt(abs(disc))
    q = abs(h) + root
    far_root = (h < 0.0) & (c <= 0.0)
    t = distance(h, a, c, root)
    part = select(far_root, A_ERROR * (m * m) / a, c_error / abs(c)) + 8 * U
    limit = tolerance * select(t * m < radius, t, radius / m)
    disc_error = DISC_ERROR * (m * l) * (m * l) + m * m * c_error
    return verdict(t, h, c, disc, root, q, part, H_ERROR * (m * l), c_error, disc_error, limit)


def passes(h: Number, a: Number, c: Number, c_error: Number, ml: Number, m: Number) -> Number:
    """Whether the ray's line certainly misses the sphere: what is asked first, where many do."""
    return h * h - a * c < -(DISC_ERROR * ml * ml + m * m * c_error)


def distance(h: Number, a: Number, c: Number, root: Number) -> Number:
    """t of a hit, from √disc: the near root from outside, the far one from inside or from the sphere itself."""
    q = abs(h) + root
    return select((h < 0.0) & (c <= 0.0), q / a, abs(c) / q)


def meet_twofold(
    lx: Number, ly: Number, lz: Number, lx_low: Number, ly_low: Number, lz_low: Number,
    c: Number, c_low: Number, c_error: Number, l: Number,  # noqa: E741
    dx: Number, dy: Number, dz: Number, dx_low: Number, dy_low: Number, dz_low: Number, m: Number,
) -> Four:  # fmt: skip
    """`meet` in two-fold float64: t, the rest of t, a bound of the error of their sum, and `low`."""
    h, h_low = dot(dx, dy, dz, dx_low, dy_low, dz_low, lx, ly, lz, lx_low, ly_low, lz_low)
    a, a_low = dot(dx, dy, dz, dx_low, dy_low, dz_low, dx, dy, dz, dx_low, dy_low, dz_low)
    disc, disc_low = discriminant(h, h_low, a, a_low, c, c_low)
    root, root_low = square_root(*magnitude(disc, disc_low))
    q, q_low = add(*magnitude(h, h_low), root, root_low)
    size, size_low = magnitude(c, c_low)
    far_root = (h < 0.0) & (c <= 0.0)
    over, over_low = select(far_root, q, size), select(far_root, q_low, size_low)
    under, under_low = select(far_root, a, q), select(far_root, a_low, q_low)
    t, t_low = divide(over, over_low, under, under_low)
    part = select(far_root, A_ERROR_2 * (m * m) / a, c_error / size) + 64 * U * U
    disc_error = DISC_ERROR_2 * (m * l) * (m * l) + m * m * c_error
    h_error, limit = H_ERROR_2 * (m * l), T_TOLERANCE_2 * t
    t, error, low = verdict(t, h, c, disc, root, q, part, h_error, c_error, disc_error, limit)
    return t, select(t < np.inf, t_low, 0.0), error, low


def refine(
    t: Number, dx: Twofold, dy: Twofold, dz: Twofold, ox: Number, oy: Number, oz: Number,
    cx: Number, cy: Number, cz: Number, radius: Number,
) -> tuple[Number, Number]:  # fmt: skip
    """A hit's t, off by less than an ulp, from one that has most of its digits; and whether that is certain.

    One Newton step, t − (P·P − r²) / (2 D·P) with P = L + t·D, of which P·P − r² is computed in about twice the digits:
    L without error, D in two-fold float64, error-free products and sums, and the errors of those in float64. That is
    off by less than 64u²·l² (six sums of terms below 2u·l², each rounded a few times), so t by half an ulp, by that
    over 2|D·P|, and by what the step leaves, a·δ² / 2|D·P|.
    """
    lx, lx_low = two_sum(ox, -cx)
    ly, ly_low = two_sum(oy, -cy)
    lz, lz_low = two_sum(oz, -cz)
    x, x_low = ahead(t, dx[0], dx[1], lx, lx_low)
    y, y_low = ahead(t, dy[0], dy[1], ly, ly_low)
    z, z_low = ahead(t, dz[0], dz[1], lz, lz_low)
    x2, x2_low = two_product(x, x)
    y2, y2_low = two_product(y, y)
    z2, z2_low = two_product(z, z)
    r2, r2_low = two_product(radius, radius)
    total, first = two_sum(x2, y2)
    total, second = two_sum(total, z2)
    total, third = two_sum(total, -r2)
    low = (x2_low + y2_low) + (z2_low - r2_low) + ((first + second) + third)
    low = low + 2.0 * (x * x_low + y * y_low + z * z_low)
    slope = inner(dx[0], dy[0], dz[0], x, y, z)
    step = (total + low) / (slope + slope)
    a, square = inner(dx[0], dy[0], dz[0], dx[0], dy[0], dz[0]), inner(lx, ly, lz, lx, ly, lz) + r2
    room = t * abs(slope)
    usual = (square > SMALLEST * SMALLEST) & (square < LARGEST * LARGEST)
    sure = usual & (a * (step * step) <= 2.0**-57 * room) & (square <= 2.0**45 * room)
    return t - step, sure


def ahead(t: Number, d: Number, d_low: Number, l: Number, l_low: Number) -> Twofold:  # noqa: E741
    """One component of L + t·D."""
    step, error = two_product(t, d)
    high, low = two_sum(step, l)
    return high, (error + low) + (t * d_low + l_low)


def fine_direction(across: Number, across_low: Number, u: Number, rest: Number, rest_low: Number) -> Twofold:
    """One component of an eye ray's D = U·u + (V·v − d·w), from twofold U and the twofold rest."""
    step, error = two_product(across, u)
    high, low = two_sum(step, rest)
    return high, (error + low) + (across_low * u + rest_low)


def verdict(
    t: Number, h: Number, c: Number, disc: Number, root: Number, q: Number,
    part: Number, h_error: Number, c_error: Number, disc_error: Number, limit: Number,
) -> Three:  # fmt: skip
    """What the values and the bounds of their errors say together: t, a bound of its error, and `low`.

    A certain hit has a finite t, a certain miss t = +inf, and both have low = +inf. What is uncertain, or a hit whose
    error is above the limit, has t = +inf and a finite low: if there is a hit, it is at t ≥ low. c = c_error = 0 says
    that the origin lies exactly on the sphere; then the root 0 does not count. `part` is the relative error of t that
    does not come from q. A NaN anywhere makes the case uncertain, with low = 0.
    """
    outside, on, inside = c > c_error, (c == 0.0) & (c_error == 0.0), c < -c_error
    error = t * (part + (2.0 * h_error + disc_error / root) / q)
    hit = (disc > disc_error) & (inside | ((outside | on) & (h < 0.0))) & (error <= limit)
    miss = (disc < -disc_error) | ((outside | on) & (h > h_error))
    largest_q = abs(h) + h_error + np.sqrt(select(disc > 0.0, disc, 0.0) + disc_error)
    low = (c - c_error) / largest_q * (1.0 - 16.0 * U)
    low = select(outside & (low > 0.0), low, 0.0)
    return select(hit, t, np.inf), select(hit, error, 0.0), select(hit | miss, np.inf, low)


def magnitude(high: Number, low: Number) -> Twofold:
    """|high + low|."""
    return abs(high), select(high < 0.0, -low, low)


def discriminant(h: Number, h_low: Number, a: Number, a_low: Number, c: Number, c_low: Number) -> Twofold:
    """h² − a·c in two-fold float64."""
    square, square_low = multiply(h, h_low, h, h_low)
    product, product_low = multiply(a, a_low, c, c_low)
    return add(square, square_low, -product, -product_low)


def approach(h: Number, a: Number, c: Number, edge: Number, best: Number) -> Three:
    """For a sphere far enough outside: k = a·t, whether it comes before `best`, and whether nobody knows that.

    What nobody knows has to go on to the next level, whatever else is found there.
    """
    disc = h * h - a * c
    k = -h - np.sqrt(disc)  # not a number for a miss
    return k, k < best, (abs(disc) <= edge) | (abs(k - best) <= TIE * k)


def beside_edges(first: Number, second: Number, third: Number) -> tuple[Number, Number]:
    """The smallest of eᵢ, and whether a ray certainly passes beside the triangle."""
    low = select(first < second, first, second)
    low = select(third < low, third, low)
    return low, low < -FACET_ERROR


def approach_facet(low: Number, slope: Number, distance: Number, a: Number, best: Number) -> Three:
    """`approach` for a triangle: the smallest of eᵢ, n·D and n·a, each of its largest value and with V's sign."""
    k = a * (distance / slope)
    inside = low >= -FACET_ERROR
    unsure = (low <= FACET_ERROR) | (slope <= STEEP) | (abs(k - best) <= TIE * k)
    return k, inside & (k < best), inside & unsure


def arrive(t: Number, low: Number, a: Number, best: Number) -> Three:
    """`approach` for what `meet` found, to a tolerance of K_ERROR / 2."""
    k = t * a
    return k, k < best, (low < np.inf) | ((t < np.inf) & (abs(k - best) <= TIE * k))


def contends(t: Number, error: Number, low: Number, best: Number, best_error: Number) -> Number:
    """Whether a hit as `meet` returns it may be nearer than the best so far."""
    farthest = best + best_error
    return ((t < np.inf) & (t - error <= farthest)) | (low < farthest)


def nearer(
    best: Number, best_low: Number, best_error: Number, best_index: Number, unsure: Number,
    t: Number, t_low: Number, error: Number, low: Number, index: Number,
) -> Five:  # fmt: skip
    """The nearest hit so far, after one more sphere: t, its rest and error, the index, and whether all that is unsure.

    The new sphere wins only if it is nearer by more than both errors; closer than that to a tie, nobody knows yet.
    """
    gap = (t - best) + (t_low - best_low)
    close = error + best_error
    wins = gap < -close
    tie = (gap >= -close) & (gap <= close)
    return (
        select(wins, t, best),
        select(wins, t_low, best_low),
        select(wins, error, best_error),
        select(wins, index, best_index),
        unsure | tie | (low < best + best_error),
    )
