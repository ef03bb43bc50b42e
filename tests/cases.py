"""Rays whose truth is known, where usual methods go wrong."""

from __future__ import annotations

from math import inf
from typing import NamedTuple


class Case(NamedTuple):
    name: str
    origin: tuple[float, float, float]
    direction: tuple[float, float, float]
    spheres: tuple[tuple[tuple[float, float, float], float], ...]  # centre, radius
    t: float
    index: int

    def __str__(self) -> str:
        return self.name


ZERO = (0.0, 0.0, 0.0)
AHEAD = (0.0, 0.0, -1.0)


def one(name, origin, direction, centre, radius, t):
    return Case(name, origin, direction, ((centre, radius),), t, -1 if t == inf else 0)


CASES = [
    one("far small, missed", ZERO, AHEAD, (1.5, 0.0, -1e9), 1.0, inf),
    one("far small, hit", ZERO, AHEAD, (0.5, 0.0, -1e9), 1.0, 999999999.1339746),
    one("just outside a tangent", (1.0, 0.0, 0.0), AHEAD, (0.0, 0.0, -10.0), 1 - 2.0**-53, inf),
    one("tangent", (1.0, 0.0, 0.0), AHEAD, (0.0, 0.0, -10.0), 1.0, 10.0),
    one("just inside a tangent", (1.0, 0.0, 0.0), AHEAD, (0.0, 0.0, -10.0), 1 + 2.0**-52, 9.999999978926576),
    one("ground, grazed", (0.0, 1.3, 0.0), (0.6, -0.001, -0.8), (0.0, -1e10, 0.0), 1e10, 1300.0845109867855),
    one("ground, c cancels", (0.0, 2.0, 0.0), (0.0, -1.0, -4.0), (0.0, -1e12, 0.0), 1e12, 2.000000000032),
    one("from the centre", (1.0, 2.0, 3.0), (0.0, 0.0, 2.0), (1.0, 2.0, 3.0), 3.0, 1.5),
    one("from inside", (0.5, 0.0, 0.0), AHEAD, (0.5, 0.0, 0.5), 2.0, 1.5),
    one("behind the eye", ZERO, AHEAD, (0.0, 0.0, 5.0), 1.0, inf),
    one("on the surface, looking away", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), ZERO, 1.0, inf),
    one("on the surface, looking in", (0.0, 0.0, 1.0), AHEAD, ZERO, 1.0, 2.0),
    one("on the surface, along it", (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), ZERO, 1.0, inf),
    one("short direction", ZERO, (0.0, 0.0, -1e-170), (0.0, 0.0, -5.0), 1.0, 4e170),
    one("long direction", ZERO, (0.0, 0.0, -1e155), (0.0, 0.0, -5.0), 1.0, 4e-155),
    one("tiny", ZERO, AHEAD, (0.0, 0.0, -3e-170), 1e-170, 2.0000000000000003e-170),
    one("huge", ZERO, AHEAD, (0.0, 0.0, -4e170), 2e170, 2e170),
    one(
        "nearly tangent, large numbers", (417726187.5, -216151256.5, 202550253.5), (1.0, -2.0, -4.0),
        (294841522.5, -237443149.0, 257503558.5), 136285917.5, inf,
    ),
    Case(
        "shells one ulp apart", ZERO, (0.25, 0.125, -1.0),
        (((0.0, 0.0, -5.0), 2.0), ((0.0, 0.0, -5.0), 2.0000000000000004)), 3.212961654789042, 1,
    ),
    Case("the same twice", ZERO, AHEAD, (((0.0, 0.0, -5.0), 1.0), ((0.0, 0.0, -5.0), 1.0)), 4.0, 0),
    Case("a tie of two", ZERO, AHEAD, (((3.0, 0.0, -8.0), 5.0), ((0.0, 0.0, -5.0), 1.0)), 4.0, 0),
    Case("a tie of two, turned", ZERO, AHEAD, (((0.0, 0.0, -5.0), 1.0), ((3.0, 0.0, -8.0), 5.0)), 4.0, 0),
    Case("the nearer is the later", ZERO, AHEAD, (((0.0, 0.0, -9.0), 1.0), ((0.0, 0.0, -5.0), 1.0)), 4.0, 1),
]  # fmt: skip
