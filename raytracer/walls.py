"""Walls: triangles that shade nearly nothing, as the light and nearly all shapes are on one side of them.

Such are a ground, and the walls of a room. A shadow ray from a shape on the light's side of a wall cannot meet it, so
only rays from what reaches beyond are tested against it. A shape may reach beyond by so little that
`bounce.plane_ahead` does not see it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from raytracer.bounce import LEAVING
from raytracer.facets import unit_normal
from raytracer.scene import vector

_MOST, _FEW_OF = 12, 8  # of the largest triangles; beyond a wall there is no more than one shape of so many
_ROUNDING = 2.0**-50  # of all lengths that come together in a height above a plane: more than it is off
_UNSEEN = LEAVING / 4.0  # of a triangle's longest edge: its farthest corner is at least half as far away
_HIGH = 2.0**-30  # of all lengths: how high above it a light is that no rounding brings below


class Wall(NamedTuple):
    """A plane, and what is on one side of it."""

    row: int  # of the triangle, counted after the rows of balls
    normal: np.ndarray  # (3,), towards that side
    middle: float  # of all points X of the plane, n·X
    beyond: np.ndarray  # bool (shapes,): what is not all on that side


def find_walls(balls: np.ndarray, corners: np.ndarray, reach: float) -> list[Wall]:
    """The walls among triangles' corners (n, 3, 3), seen from either side; reach is of all lengths, the eye's included.

    A row of `balls` to spare, which is not a number, is beyond nothing.
    """
    edges = np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1, initial=0.0))
    walls = []
    for i in np.argsort(-edges, kind="stable")[:_MOST].tolist():
        first, second, third = map(vector, corners[i])
        normal = np.array(unit_normal((first, second, third)))
        middle = float(normal @ corners[i, 0])
        least = _ROUNDING * (reach + abs(middle)) - _UNSEEN * edges[i]
        heights, tall = balls[:, :3] @ normal - middle, corners @ normal - middle
        for side in (1.0, -1.0):
            low = np.concatenate([side * heights - balls[:, 3], (side * tall).min(axis=1)])
            if np.count_nonzero(low < least) <= len(low) // _FEW_OF:
                walls.append(Wall(len(balls) + i, side * normal, side * middle, low < least))
    return walls


def walls_of(walls: list[Wall], light: np.ndarray, reach: float, shapes: int) -> tuple[np.ndarray, np.ndarray]:
    """The rows of those that have a light on their side, int64; and which shapes are beyond any of them: int32."""
    ours = [wall for wall in walls if wall.normal @ light - wall.middle > _HIGH * (reach + float(np.abs(light).sum()))]
    beyond = np.zeros(shapes, bool)
    for wall in ours:
        beyond |= wall.beyond
    return np.array([wall.row for wall in ours], np.int64), beyond.astype(np.int32)
