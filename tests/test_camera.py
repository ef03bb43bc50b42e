"""Eye rays: the language's formulas, exactly, and the stated bounds of their rounding."""

from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import FRAME, determinant

from raytracer.camera import SAMPLINGS, directions, eye_grid, focal_length, make_raster, twofold_eye_rays
from raytracer.scene import Camera

SIZE = st.integers(1, 40)
FOV = st.floats(1e-6, 180, exclude_max=True)
TAME = st.floats(-100, 100)
FRAMES = FRAME | st.tuples(*[st.tuples(TAME, TAME, TAME)] * 3).filter(determinant)


@given(st.floats(1e-300, 180, exclude_max=True))
def test_focal_length_is_the_nearest_float(fov):
    with mpmath.workprec(1200):
        assert focal_length(fov) == float(mpmath.cot(mpmath.mpf(fov) * mpmath.pi / 360))


def test_focal_length_that_numpy_gets_wrong():
    assert focal_length(60.0) == 3**0.5 != 1 / np.tan(np.radians(30))


def test_the_corner_of_a_square_picture_is_the_courses_formula():
    raster = make_raster(Camera(fov=90.0), 8, 8)
    assert raster.exact_direction(0, 0) == (-1, 1, -1)
    assert raster.exact_direction(4, 4) == (0, 0, -1)
    assert raster.exact_direction(7, 1) == (Fraction(3, 4), Fraction(3, 4), -1)


def test_centres_are_half_a_pixel_further_and_pixels_are_square():
    raster = make_raster(Camera(fov=90.0), 4, 2, "centre")
    assert raster.exact_direction(0, 0) == (Fraction(-3, 2), Fraction(1, 2), -1)
    assert raster.exact_direction(3, 1) == (Fraction(3, 2), Fraction(-1, 2), -1)


@given(FRAMES, FOV, SIZE, SIZE, st.sampled_from(sorted(SAMPLINGS)))
def test_rounded_directions_are_within_their_bounds(frame, fov, width, height, sampling):
    u, v, w = frame
    camera = replace(Camera(), u=u, v=v, w=w, fov=fov)
    raster = make_raster(camera, width, height, sampling)
    with np.errstate(all="ignore"):
        grid = eye_grid(raster)
        rays = directions(grid)
        ys, xs = np.mgrid[0:height, 0:width]
        fine = twofold_eye_rays(raster, xs.ravel(), ys.ravel())
    for x, y in {(0, 0), (width - 1, 0), (width // 3, height // 2), (width - 1, height - 1)}:
        truth = raster.exact_direction(x, y)
        k = y * width + x
        if not np.isfinite(grid.reach):
            continue  # the tracer will not rely on these
        for axis, exact in enumerate(truth):
            error = abs(Fraction(float(rays[axis][y, x])) - exact)
            assert error <= 5 * Fraction(1, 2**53) * Fraction(float(grid.reach))
            high, low = float(fine[axis][k]), float(fine[axis + 3][k])
            if np.isfinite(high + low):  # a NaN makes the tracer go on to the integers
                assert abs(Fraction(high) + Fraction(low) - exact) <= Fraction(1, 2**102) * Fraction(
                    float(fine.reach[k])
                )
        length2 = sum(x * x for x in truth)
        assert length2 <= Fraction(float(grid.reach)) ** 2 * (1 + Fraction(1, 2**45))


@given(SIZE, SIZE)
def test_bands_cover_each_row_once(width, height):
    rows = [y for band in make_raster(Camera(), width, height * 50).bands() for y in range(band.start, band.stop)]
    assert rows == list(range(height * 50))


@pytest.mark.parametrize(("width", "height", "sampling"), [(0, 5, "corner"), (5, -1, "corner"), (5, 5, "middle")])
def test_bad_pictures_are_refused(width, height, sampling):
    with pytest.raises(ValueError, match="expected"):
        make_raster(Camera(), width, height, sampling)


def test_a_picture_larger_than_memory_is_refused_before_it_is_tried():
    with pytest.raises(MemoryError, match="GB"):
        make_raster(Camera(), 10**7, 10**7)
