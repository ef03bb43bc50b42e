"""Triangles as seen from the eye: numpy and the kernel get the same bits, and what is called 0 is 0 in truth."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from raytracer import backend
from raytracer.arrays import FACET
from raytracer.boxes import facet_boxes, make_lens
from raytracer.camera import eye_grid, make_raster
from raytracer.eye import usable_spread
from raytracer.facets import measure, see_facets, vectors_of, zero_side
from raytracer.interpreter import interpret
from raytracer.lookup import light_cells, tree_of
from raytracer.scene import Camera, Scene, Triangles, vector
from raytracer.screen import open_screen

both_paths = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")

SURFACE = "surface 1 1 1 0 0 0 0 0 0 1 0\n"
SKEWED = Camera((0.1, 0.2, -0.3), (1.0, 0.1, 0.0), (0.0, 1.2, 0.1), (0.1, 0.0, 0.9), 70.0)


def triangles(kind: str, seed: int) -> np.ndarray:
    """Corners (40, 3, 3); those of whole numbers have planes through the eye, and some edges in planes of an axis."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(40, 3, 3))
    if kind == "whole":
        corners = np.round(2 * corners)
    elif kind == "all sizes":
        corners *= 10.0 ** rng.uniform(-45, 45, (40, 1, 1))
    else:
        corners = corners * 1e-3 + rng.normal(size=(40, 1, 3)) * 1e3
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners[(area != 0.0).any(axis=1)]


def scene_of(corners: np.ndarray, camera: Camera) -> Scene:
    scene, rows = interpret(SURFACE), np.arange(len(corners), dtype=np.int32)
    return replace(scene, camera=camera, triangles=Triangles(corners, 0 * rows, rows, scene.materials))


@both_paths
@pytest.mark.parametrize("camera", [Camera(), SKEWED], ids=["straight", "skewed"])
@pytest.mark.parametrize("kind", ["whole", "all sizes", "small and far"])
@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32))
def test_the_kernel_finds_the_bits_that_numpy_finds(kind, camera, seed):
    corners, origin = triangles(kind, seed), np.array(camera.eye)
    raster = make_raster(camera, 90, 70)
    with np.errstate(all="ignore"):
        seen = see_facets(eye_grid(raster), usable_spread(raster), origin, corners)
        boxes = np.where(seen.faces[:, None], facet_boxes(make_lens(raster), corners - origin), 0)
        zeros = [zero_side(measure(vector(origin), vectors_of(corners)), i, *camera_axes(camera)) for i in range(3)]
    with open_screen(scene_of(corners, camera), raster, backend.load()) as screen:
        table = screen.view.facets.reshape(-1, FACET)
        np.testing.assert_array_equal(table[:, :12], seen.rows)
        np.testing.assert_array_equal(table[:, 12], seen.distance)
        np.testing.assert_array_equal(table[:, 13:16].T, zeros)
        np.testing.assert_array_equal(screen.view.balls.reshape(-1, 4), seen.planes)
        np.testing.assert_array_equal(screen.facet_boxes, boxes)


def camera_axes(camera: Camera) -> tuple[tuple[float, float, float], ...]:
    return camera.u, camera.v, camera.w


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32))
def test_what_vanishes_does_so_in_truth(seed):
    corners = triangles("whole", seed)
    of = measure((1.0, 0.0, -1.0), vectors_of(corners))
    axes, flagged = camera_axes(Camera()), 0
    for i in range(3):
        zeros = np.asarray(zero_side(of, i, *axes)).astype(int)
        for row, zero in zip(corners, zeros.tolist(), strict=True):
            a, b = ([Fraction(x) - y for x, y in zip(row[j], (1, 0, -1), strict=True)] for j in (i, (i + 1) % 3))
            side = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
            for bit, axis in enumerate(axes):
                if zero >> bit & 1:
                    flagged += 1
                    assert sum(x * Fraction(y) for x, y in zip(side, axis, strict=True)) == 0
    assert flagged


@both_paths
@pytest.mark.parametrize("balls", [0, 1, 8, 9])
@np.errstate(all="ignore")
def test_rows_to_spare_are_in_no_list(balls):
    """Rays from shapes look for shapes that there are, and for each of them."""
    text = SURFACE + "".join(f"sphere 1 {3 * i} 0 -9\n" for i in range(balls))
    text += "begin\nvertex -9 -2 -9\nvertex 9 -2 -9\nvertex 0 -2 0\nend\n" * 2
    scene = interpret(text)
    first = len(scene.spheres.balls)
    expected = {*range(balls), first, first + 1}
    cells, _ = light_cells(scene.spheres, scene.triangles, 0, 16.0, ((0.0, 5.0, -5.0),), backend.load())
    assert set(cells.entries[::2].tolist()) == expected
    tree = tree_of(scene.spheres, scene.triangles, 0, backend.load())
    assert sorted(tree.ids[tree.ids >= 0].tolist()) == sorted(expected)
