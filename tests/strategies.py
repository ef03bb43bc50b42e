"""Hypothesis strategies that several tests share."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from hypothesis import strategies as st

from raytracer.interpreter import SMALLEST_FOV
from raytracer.scene import Camera, Light, Material, Materials, Scene, Spheres, Triangles, Vector

FINITE = st.floats(allow_nan=False, allow_infinity=False)
VECTOR = st.tuples(FINITE, FINITE, FINITE)
UNIT = st.floats(0, 1)
COLOUR = st.tuples(UNIT, UNIT, UNIT)
RADIUS = st.floats(0, exclude_min=True, allow_infinity=False)


def determinant(frame: Sequence[Sequence[float | Fraction]]) -> Fraction:
    (a, b, c), (d, e, f), (g, h, i) = ([Fraction(x) for x in row] for row in frame)
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def has_area(corners: tuple[Vector, Vector, Vector]) -> bool:
    """Whether the three points lie on no common line: whether one of the triangle's three shadows has an area."""
    points = [[Fraction(x) for x in corner] for corner in corners]
    shadows = ([[p[i], p[j], Fraction(1)] for p in points] for i, j in ((0, 1), (1, 2), (2, 0)))
    return any(determinant(shadow) for shadow in shadows)


FRAME = st.tuples(VECTOR, VECTOR, VECTOR).filter(determinant) | st.permutations(
    [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
).map(tuple)
CAMERA = st.builds(
    lambda eye, frame, fov: Camera(eye, frame[0], frame[1], frame[2], fov),
    VECTOR,
    FRAME,
    st.floats(SMALLEST_FOV, 180, exclude_max=True),
)
LIGHT = st.builds(Light, VECTOR, COLOUR)
MATERIAL = st.builds(Material, COLOUR, COLOUR, COLOUR, st.floats(0, 1000), UNIT)
BALL = st.tuples(RADIUS, VECTOR)
CORNERS = st.tuples(VECTOR, VECTOR, VECTOR).filter(has_area)


def table(materials: list[Material]) -> Materials:
    rows = [(*m.diffuse, *m.ambient, *m.specular, m.power, m.k_refl) for m in materials]
    return Materials(np.array(rows, np.float64).reshape(-1, 11))


@st.composite
def scenes(draw: st.DrawFn, max_shapes: int = 8) -> Scene:
    """Any scene that a file can say: materials in the order of their use, some of them unused."""
    materials = draw(st.lists(MATERIAL, max_size=4))
    shapes = draw(st.lists(BALL | CORNERS, max_size=max_shapes if materials else 0))
    rows = st.lists(st.integers(0, max(len(materials) - 1, 0)), min_size=len(shapes), max_size=len(shapes))
    material = np.array(sorted(draw(rows)), np.int32)
    is_ball = np.array([len(shape) == 2 for shape in shapes], bool)
    balls, corners = [s for s in shapes if len(s) == 2], [s for s in shapes if len(s) == 3]
    order = np.arange(len(shapes), dtype=np.int32)
    found = table(materials)
    return Scene(
        draw(CAMERA),
        draw(COLOUR),
        tuple(draw(st.lists(LIGHT, max_size=3))),
        found,
        Spheres(
            np.array([radius for radius, _ in balls], np.float64),
            np.array([centre for _, centre in balls], np.float64).reshape(-1, 3),
            material[is_ball],
            order[is_ball],
            found,
        ),
        Triangles(np.array(corners, np.float64).reshape(-1, 3, 3), material[~is_ball], order[~is_ball], found),
    )
