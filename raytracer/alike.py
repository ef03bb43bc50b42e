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

**Errors**, with u = 2⁻²⁴, s², t² and |δ| ≤ σw, σ = 1.05s, of `quick`; ρ is the sphere's radius by its depth, and
p = (|X| + |Y|) / √B. Middles are split into whole numbers and rests, so δ is off by ηw, η = u(3.6/w + 1.5σ). All other
numbers of a sphere are rounded once, and each product and sum. |E| is at most we, e = pσ + 1.04ρ, and off by
w(pη + 4eu); h by w²(2.05ση + 3σ²u), so E² + h by w²·2c₁, and R, with cos = R/w and cos² > 16c₁, by
w(1.034c₁/cos + 2.7u(e + 1)), where

    c₁ = η(ep + 1.03σ) + u(4.5e² + 1.5σ² + ½)

and what float64 leaves (see `quick`). √(B / D·D) is at most 1 + ρ, as the angle between D and C is at most that whose
sine is ρ; |τD| ≤ Tw, T = 1 + 1.05t. So the dividend, by w√B, is off by 1.034c₁/cos + η(p + 2.2ρσ) +
u(12.7e + 5.7 + 4.2ρσ²), the divisor by u(2(1+ρ)² + 1 + 10eρ(1+ρ) + 4ρ²σ²) + 2.05ηρ((1+ρ)p + ρσ) of itself, the quotient
by 2.2u more. λ·δ is off by η + 3σu, and |κτ| ≤ 1.04(1+ρ)T. So V is off by c₀ + 1.034(1+ρ)c₁/cos,

    c₀ = (1 + Tρ)(η + 4σu) + (1+ρ)(η(p + 2.2ρσ) + u(12.7e + 5.7 + 4.2ρσ²)) + u(2.1(1+ρ)T + 1)
         + T(u(2(1+ρ)² + 3.2 + 10eρ(1+ρ) + 4ρ²σ²) + 2.05ηρ((1+ρ)p + ρσ))

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
    return _SPARE * (eta * (e * p + 1.03 * sigma) + U * (e * e * 4.5 + (1.5 * sigma * sigma + 0.5)))


def least_error(sigma: Number, tilt: Number, p: Number, rho: Number, blur: Number) -> Number:
    """c₀, for σ, T, p, ρ and 1 / w."""
    eta, e, b, rho_sigma = _off(sigma, blur), p * sigma + 1.04 * rho, rho + 1.0, rho * sigma
    first = (rho * tilt + 1.0) * (eta + 4.0 * sigma * U)
    dividend = b * (eta * (p + 2.2 * rho_sigma) + U * (e * 12.7 + 4.2 * sigma * rho_sigma + 5.7))
    divisor = U * (2.0 * b * b + 10.0 * e * rho * b + 4.0 * rho_sigma * rho_sigma + 3.2)
    divisor = divisor + 2.05 * eta * rho * (b * p + rho_sigma)
    return _SPARE * (first + dividend + tilt * divisor + U * (2.1 * tilt * b + 1.0))


def _off(sigma: Number, blur: Number) -> Number:
    """η."""
    return U * (3.6 * blur + 1.5 * sigma)


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
