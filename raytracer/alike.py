"""Blocks of pixels that show one sphere: how far off their colours may be, in single precision.

`quick` says how small spheres are seen, and shades pixels of any. Where all pixels of a block show the same one, much
of their arithmetic is the same: it is done once a sphere, in float64. `kernels.alike` does the rest.

As in `quick`, with pixels for a unit: the sphere's middle is seen at C = (X, Y, −f), a pixel at D = C + δ with
δ = (x, y, 0), and the sphere is w large. It is hit at n = δ + τD from its middle, n is w long, where

    B = C·C − w²,  h = w² − δ·δ,  E = (δ·C + w²) / √B,  R = √(E² + h),  τ = −((E + R)√B − h) / (B + 2E√B − h)

(D·D is the divisor, R√B the root of the discriminant). Let d be the unit vector from the middle to a light, and ε the
sphere's radius by how far that is. With λ = d/w across and up, and κ = C·d/w,

    V = n·d/w = λ·δ (1 + τ) + κτ,  and the light falls in at a cosine of (V − ε) / √(1 + ε² − 2εV).

The root generates Legendre's polynomials: the cosine is Σ εᵏ (V Pₖ(V) − Pₖ₋₁(V)). Up to ε² that is a cubic polynomial
of V. ε³ has (5V⁴ − 6V² + 1)/2, of which V⁴ is 2V³ − 1.25V² + V/4 − 1/128, but for 1/128 at most, for V from 0 to 1; ε⁴
has less than 0.42, and all others less than 1. So for ε ≤ 1/32 a cubic is within ε³(0.0196 + 0.46ε); it is below 0 for
V below 0, as the cosine is.

**Errors**, with u = 2⁻²⁴, s², t² and |δ| ≤ σw, σ = 1.05s, of `quick`; ρ is the sphere's radius by its depth, b = 1 + ρ,
and p = (|X| + |Y|) / √B. A middle is split into a whole number and the rest, which is taken off last, so δ is off by
ηw, η = u(0.71/w + σ). All other numbers of a sphere are rounded once, each product and each sum. |E| is at most we,
e = pσ + 1.04ρ, and off by w(pη + 4eu); h by w²(2.06ση + (2 + 2σ²)u), so E² + h by w²·2c₁, where

    c₁ = η(ep + 1.03σ) + u(4.5e² + σ² + 2)

and what float64 leaves (see `quick`). √(B / D·D) is at most b, and √(D·D / B) at most 1.04b, as the angle between D and
C is at most that whose sine is ρ; |τD| ≤ Tw, T = 1 + 1.05t. So with cos = R/w and cos² > 16c₁, R is off by
w(1.034c₁/cos + 3bu). The dividend is off by w√B times 1.034c₁/cos + η(p + 2.2ρσ) + u(4e + 3b + 4.3bT + ρ(2.1 + 5.3σ²)),
the divisor by u(2b² + 1 + 12eρb + ρ²(2 + 3σ²)) + ηρ(2bp + 2.1ρσ) of itself, the quotient by 3.2u more. λ·δ is off by
η + 3σu, and |κτ| ≤ 1.04bT. So V is off by c₀ + 1.034bc₁/cos,

    c₀ = (1 + Tρ)(η + 5σu) + b(η(p + 2.2ρσ) + u(4e + 3b + 4.3bT + ρ(2.1 + 5.3σ²)))
         + T(u(2b² + 4.2 + 12eρb + ρ²(2 + 3σ²)) + ηρ(2bp + 2.1ρσ)) + u(2.1bT + 1.1)

and the cosine by (1 + 3ε) times that and 4.3u, and by what the cubic lacks.
"""

from __future__ import annotations

import numpy as np

from raytracer.quick import U
from raytracer.twofold import Number

NEAREST_LIGHT = 32.0  # radii
_SPARE = 1.05  # for squares of errors


def rim_error(sigma: Number, p: Number, rho: Number, blur: Number) -> Number:
    """c₁ but for what float64 leaves, for σ, p, ρ and 1 / w."""
    eta, e = _off(sigma, blur), p * sigma + 1.04 * rho
    return _SPARE * (eta * (e * p + 1.03 * sigma) + U * (e * e * 4.5 + (sigma * sigma + 2.0)))


def least_error(sigma: Number, tilt: Number, p: Number, rho: Number, blur: Number) -> Number:
    """c₀, for σ, T, p, ρ and 1 / w."""
    eta, e, b, sigma2 = _off(sigma, blur), p * sigma + 1.04 * rho, rho + 1.0, sigma * sigma
    first = (rho * tilt + 1.0) * (eta + 5.0 * sigma * U) + U * (2.1 * tilt * b + 1.1)
    dividend = U * (4.0 * e + (3.0 + 4.3 * tilt) * b + rho * (2.1 + 5.3 * sigma2)) + eta * (p + 2.2 * sigma * rho)
    divisor = U * (2.0 * b * b + 4.2 + rho * (12.0 * e * b + rho * (2.0 + 3.0 * sigma2)))
    divisor = divisor + eta * rho * (2.0 * b * p + 2.1 * sigma * rho)
    return _SPARE * (first + b * dividend + tilt * divisor)


def _off(sigma: Number, blur: Number) -> Number:
    """η."""
    return U * (0.71 * blur + sigma)


def bounds_of(s: Number) -> tuple[Number, Number]:
    """σ and T, for s."""
    return 1.05 * s, 1.0 + 1.05 * np.sqrt(abs(s * s - 1.0))


def cubic_of(epsilon: Number) -> tuple[Number, Number, Number, Number]:
    """The cosine's polynomial of V, from the constant on."""
    e2 = epsilon * epsilon
    e3 = e2 * epsilon
    return e3 * 0.48046875 - epsilon, 1.0 - e2 * 1.5 + e3 * 0.625, epsilon - e3 * 6.125, e2 * 1.5 + e3 * 5.0


def cubic_error(epsilon: Number) -> Number:
    """What that lacks."""
    return epsilon * epsilon * epsilon * (epsilon * 0.46 + 0.0196)
