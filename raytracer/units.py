"""Powers of two taken out, exactly, so that squares neither overflow nor underflow."""

from __future__ import annotations

import numpy as np

_TOO_SMALL, _TOO_LARGE = 1e-50, 1e50


def in_units(*lengths: np.ndarray) -> tuple[int, list[np.ndarray]]:
    """An exponent e and the lengths counted in units of 2ᵉ; e is 0 unless they are very large or all very small.

    The lengths stay as they are, e = 0, if some of them would lose digits.
    """
    largest = max((float(np.abs(array).max(initial=0.0)) for array in lengths), default=0.0)
    return unit_of(largest, *lengths)


def unit_of(largest: float, *lengths: np.ndarray) -> tuple[int, list[np.ndarray]]:
    """The same where the largest is known."""
    return (0, list(lengths)) if _is_usual(largest) else _scaled(largest, *lengths)


def _is_usual(largest: float) -> bool:
    return largest == 0.0 or _TOO_SMALL < largest < _TOO_LARGE


def _scaled(largest: float, *lengths: np.ndarray) -> tuple[int, list[np.ndarray]]:
    exponent = int(np.frexp(largest)[1])
    scaled = [np.ldexp(array, -exponent) for array in lengths]
    back = (np.ldexp(array, exponent) for array in scaled)
    if not all(np.array_equal(array, length, equal_nan=True) for array, length in zip(back, lengths, strict=True)):
        return 0, list(lengths)
    return exponent, scaled


def unit_directions(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exponents e (n,) and directions (n, 3) such that direction · 2ᵉ is the one given.

    All e are 0 if all directions are of usual size; else they come near 1 in length, but for those whose components
    differ so much that one would lose digits: they stay as they are, with e = 0.
    """
    x, y, z = np.abs(directions.T)
    largest = np.maximum(np.maximum(x, y), z)
    if ((largest > _TOO_SMALL) & (largest < _TOO_LARGE)).all():
        return np.zeros(len(directions), np.int32), directions
    exponents = np.frexp(largest)[1]
    scaled = np.ldexp(directions, -exponents[:, None])
    exact = (np.ldexp(scaled, exponents[:, None]) == directions).all(axis=1)
    return np.where(exact, exponents, 0), np.where(exact[:, None], scaled, directions)
