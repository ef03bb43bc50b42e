"""The rays behind a pixel, laid over the picture: where points are seen, what of a line is seen, what is drawn."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from raytracer import Camera, interpreter, probe_pixel
from raytracer.camera import make_raster, seen_at
from raytracer.interpreter import interpret
from sketch.orbit import HOME, seen_from
from sketch.overlay import Layout, Status, compose, font, story_panel, wrapped
from sketch.rays import MIRRORED, Ink, Line, clipped, ink_of, lines_of

SIZE = 120
MIRRORS = "scenes/09_mirror_spheres.cli"
DEEP = "scenes/10_reflections_in_reflections.cli"
MATT = "surface 1 1 1  0 0 0  0 0 0  1 0\n"


def lines_at(scene, x, y, size=SIZE):
    return lines_of(probe_pixel(scene, x, y, size, size, "full").rays, make_raster(scene.camera, size, size))


@pytest.mark.parametrize("sampling", ["corner", "centre"])
def test_a_hit_is_seen_in_its_own_pixel(course_scene_path, sampling):
    for orbit in (HOME, HOME.pulled(50, -30).moved(2)):
        scene = seen_from(interpreter(course_scene_path), orbit)
        raster = make_raster(scene.camera, 50, 40, sampling)
        for x, y in [(x, y) for x in range(0, 50, 7) for y in range(0, 40, 6)]:
            pixel = probe_pixel(scene, x, y, 50, 40, sampling=sampling)
            if pixel.point is not None:
                ((across, down, ahead),) = seen_at(raster, np.subtract([pixel.point], pixel.eye))
                assert ahead > 0
                np.testing.assert_allclose((across / ahead, down / ahead), (x, y), atol=1e-9)


def test_what_is_behind_the_eye_is_told_apart():
    raster = make_raster(Camera(), SIZE, SIZE)
    ahead = seen_at(raster, np.array([[0.1, 0.2, -1.0], [-0.1, -0.2, 1.0]]))[:, 2]
    assert ahead[0] > 0 > ahead[1]
    flat = Camera(u=(1.0, 0.0, 0.0), v=(1.0, 1e-9, 0.0))
    assert seen_at(make_raster(flat, SIZE, SIZE), np.ones((1, 3))) is None


COORDINATE = st.floats(-300, 300)
PLACE = st.tuples(COORDINATE, COORDINATE, st.floats(-2, 2)).map(np.array)


@given(PLACE, PLACE)
def test_what_is_seen_of_a_line_is_ahead_and_within_the_picture(start, end):
    """Every point of the line is seen where it is ahead of the eye and within the borders, and no other."""
    width, height = 120, 90
    seen = clipped(start, end, width, height)
    points = [(1 - part) * start + part * end for part in np.linspace(0, 1, 101)]
    within = [
        (x / s, y / s) for x, y, s in points
        if s > 1e-3 and -0.5 < x / s < width - 0.5 and -0.5 < y / s < height - 0.5
    ]  # fmt: skip
    if seen is None:
        assert not within
        return
    (x, y), (to_x, to_y), _ = seen
    for at_x, at_y in ((x, y), (to_x, to_y)):
        assert -0.5 - 1e-6 <= at_x <= width - 0.5 + 1e-6
        assert -0.5 - 1e-6 <= at_y <= height - 0.5 + 1e-6
    for across, down in within:
        assert min(x, to_x) - 1e-6 <= across <= max(x, to_x) + 1e-6
        assert min(y, to_y) - 1e-6 <= down <= max(y, to_y) + 1e-6


def test_a_light_behind_the_eye_is_beyond_the_border():
    """Straight above and behind: the line leaves by the upper border, and not through the eye downwards."""
    scene = interpret(f"light 0 100 100  1 1 1\n{MATT}sphere 1 0 0 -4\n")
    (line,) = lines_at(scene, 60, 60)
    np.testing.assert_allclose(line.start, (60, 60))
    np.testing.assert_allclose(line.end, (60, -0.5), atol=1e-3)
    assert not line.arrives
    assert not line.dashed


@pytest.mark.parametrize("place", ["0 0 0", "0 0 5", "0 0 1e90", "1e-300 0 0"])
def test_a_light_at_the_eye_or_right_behind_it_stays_in_its_pixel(place):
    scene = interpret(f"light {place}  1 1 1\n{MATT}sphere 1 0 0 -4\n")
    (line,) = lines_at(scene, 60, 60)
    np.testing.assert_allclose((line.start, line.end), ((60, 60), (60, 60)), atol=1e-6)


def test_a_blocked_light_is_dashed_and_ends_at_what_blocks_it():
    scene = interpret(f"light 0 5 -4  1 .5 0\n{MATT}sphere 100 0 -101 -4\nsphere .2 0 1 -4\n")
    (line,) = lines_at(scene, 60, 86)
    assert line.dashed
    assert line.arrives
    assert line.colour == (255, 128, 0)
    raster = make_raster(scene.camera, SIZE, SIZE)
    ((x, y, s),) = seen_at(raster, np.array([[0, 0.8, -4]]))
    np.testing.assert_allclose(line.end, (x / s, y / s), atol=2)


def test_light_that_falls_on_the_other_side_has_no_line_and_neither_has_a_miss():
    scene = interpret(f"light 0 0 -9  1 1 1\n{MATT}sphere 1 0 0 -4\n")
    assert lines_at(scene, 60, 60) == ()
    assert lines_at(scene, 0, 0) == ()
    assert lines_of((), make_raster(scene.camera, SIZE, SIZE)) == ()


def test_mirrored_rays_go_from_hit_to_hit():
    scene = interpreter(DEEP)
    rays = probe_pixel(scene, 50, 40, SIZE, SIZE, "full").rays
    mirrored = [line for line in lines_at(scene, 50, 40) if line.colour == MIRRORED][::-1]
    np.testing.assert_allclose(mirrored[0].start, (50, 40), atol=1e-9)
    assert len(mirrored) > 2
    for line, after in pairwise(mirrored):
        if line.arrives:
            np.testing.assert_allclose(line.end, after.start, atol=1e-9)
        assert line.opacity >= after.opacity
    assert rays[-1].hit is None
    assert not mirrored[-1].arrives


def test_ink_is_where_the_lines_are():
    lines = (Line((10, 20), (50, 20), True, (255, 0, 0), 1.0), Line((70, 0), (70, 80), False, (0, 255, 0), 0.5))
    picture = np.full((90, 100, 3), 100, np.uint8)
    ink_of(lines, 100, 90).lay_over(picture)
    assert picture[20, 30].tolist() == [255, 0, 0]
    assert picture[20, 53].tolist() == [255, 0, 0]  # the dot at its end
    assert picture[17, 30].tolist() == picture[40, 50].tolist() == [100, 100, 100]
    assert picture[40, 70, 1] > 150 > 60 > picture[40, 70, 0] - 40
    dashed = np.zeros((90, 100, 3), np.uint8)
    ink_of((Line((10, 20), (90, 20), False, (255, 0, 0), 1.0, dashed=True),), 100, 90).lay_over(dashed)
    assert 0.3 < (dashed[20, 10:90, 0] > 128).mean() < 0.8
    assert len(ink_of((), 100, 90).rows) == 0


@given(st.lists(st.tuples(*[st.floats(-0.5, 29.5)] * 4, st.booleans(), st.booleans()), max_size=4))
def test_ink_stays_in_the_picture(ends):
    lines = tuple(Line((a, b), (c, d), arrives, (9, 9, 9), 0.4, dashed) for a, b, c, d, arrives, dashed in ends)
    ink_of(lines, 30, 30).lay_over(np.zeros((30, 30, 3), np.uint8))


@pytest.mark.parametrize("size", [1, 100, 330, 500])
@pytest.mark.parametrize("mark", [(0.5, 0.5), (0, 0), (0.99, 0.2), (0.3, 0.99)])
def test_the_marked_pixel_is_seen_through_ink_and_beside_the_panel(size, mark):
    mark = int(mark[0] * size), int(mark[1] * size)
    layout, picture = Layout(size), np.full((size, size, 3), 77, np.uint8)
    rows, columns = np.indices((size, size)).reshape(2, -1)
    everywhere = Ink(rows, columns, np.zeros((size * size, 3), np.float32), np.ones((size * size, 1), np.float32))
    panel = story_panel(("title", *["line"] * 30), over_rays=True)
    content = compose(layout, picture, Status("", "", ""), panel, mark, ink=everywhere)
    assert content[layout.corner + mark[1], layout.corner + mark[0]].tolist() == [77, 77, 77]
    assert (picture == 77).all()


def test_the_panel_gives_way_to_ink():
    size = 400
    layout, picture = Layout(size), np.full((size, size, 3), 77, np.uint8)
    ink = ink_of((Line((200, 300), (200, 0), False, (255, 0, 0), 1.0),), size, size)
    panel = story_panel(("title", "some words", "and more"), over_rays=True)
    content = compose(layout, picture, Status("", "", ""), panel, (200, 300), ink=ink)
    assert (content[:290, 200] == (255, 0, 0)).all()
    assert (content[:290, :190] != 77).any()


def test_a_panel_that_is_too_long_is_cut_before_its_end():
    size = 320
    lines = tuple(f"{k}" for k in range(99))

    def seen(lines):
        return compose(Layout(size), np.zeros((size, size, 3), np.uint8), Status("", "", ""), story_panel(lines))

    changed = ("0", *lines[1:50], "?", *lines[51:])
    assert np.array_equal(seen(lines), seen(changed))
    assert not np.array_equal(seen(lines), seen((*lines[:-1], "?")))
    assert not np.array_equal(seen(lines), seen(lines[:-1]))


def test_indented_text_stays_indented():
    lines = wrapped("  some words that do not fit into one line", 12, 100)
    assert len(lines) > 2
    assert all(line.startswith("    ") and font(12).getlength(line) <= 100 for line in lines)
    assert wrapped(" " * 99 + "x", 12, 100)[-1].strip() == "x"
