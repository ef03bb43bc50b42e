"""The story of a pixel: what is drawn, what is computed, what is true."""

from decimal import Decimal

import numpy as np
import pytest

from raytracer import METHODS, STAGES, interpreter, probe_pixel, ray_intersect_scene, render_scene
from raytracer.probe import marked

FAR = "scenes/hard/01_far_small_sphere.cli"


def test_a_pixels_story_is_what_is_drawn():
    scene = interpreter("scenes/04_many_spheres.cli")
    for stage in STAGES:
        picture = render_scene(scene, stage, 60, 50)
        for x, y in ((30, 25), (0, 0), (59, 49), (30, 8)):
            pixel = probe_pixel(scene, x, y, 60, 50, stage)
            assert pixel.rgb == tuple(picture[y, x])
            assert (pixel.shape is None) == (pixel.index < 0) == (pixel.normal is None)
            assert f"pixel {x} {y}" in pixel.lines()[0]
    pixel = probe_pixel(scene, 30, 25, 60, 50)
    assert pixel.shape == scene.spheres[0]
    np.testing.assert_allclose(pixel.point, np.add(pixel.eye, np.multiply(pixel.t, pixel.direction)))
    np.testing.assert_allclose(np.linalg.norm(pixel.normal), 1)
    with pytest.raises(ValueError, match="expected one within"):
        probe_pixel(scene, 60, 0, 60, 50)


@pytest.mark.parametrize("method", METHODS)
def test_figures_are_the_methods_own(method):
    scene = interpreter("scenes/04_many_spheres.cli")
    pixel = probe_pixel(scene, 30, 25, 60, 50, method=method)
    meeting = pixel.meetings[0]
    figures = {figure.name: figure for figure in meeting.figures}
    assert {"a", "h", "c", "disc"} <= set(figures) or {"b"} <= set(figures) or {"chord2"} <= set(figures)
    for figure in figures.values():
        np.testing.assert_allclose(figure.found, float(figure.true), rtol=1e-3)
    np.testing.assert_allclose(meeting.t, meeting.true_t, rtol=1e-5)
    assert meeting.index == pixel.index


def test_the_textbooks_discriminant_is_wrong_from_its_first_digit():
    pixel = probe_pixel(interpreter(FAR), 160, 150, method="textbook")
    disc = next(figure for figure in pixel.meetings[0].figures if figure.name == "disc")
    assert marked(disc.found, disc.true).startswith("|")
    assert "textbook" in pixel.story()[0]


def test_digits_are_marked_behind_the_last_correct_one():
    assert marked(1.25, Decimal("1.25")) == "1.2500000000000000|e+0"
    assert marked(1.25, Decimal("1.26")) == "1.2|500000000000000e+0"
    assert marked(1.25, Decimal("12.5")) == "|1.2500000000000000e+0"
    assert marked(-1.25, Decimal("1.25")).startswith("|")
    assert marked(float("nan"), Decimal(1)) == "|nan"


def test_levels_are_told():
    scene = interpreter("scenes/hard/07_tangent_rows.cli")
    levels = {probe_pixel(scene, x, 32, 64, 64).level for x in range(0, 64)}
    assert levels >= {"float64", "integers"}
    assert probe_pixel(interpreter(FAR), 160, 150).level == "two-fold float64"
    assert probe_pixel(interpreter(FAR), 160, 150, method="haines").level == ""


def test_lights_add_up_to_the_colour():
    scene = interpreter("scenes/07_colorful_lights.cli")
    pixel = probe_pixel(scene, 150, 120)
    assert len(pixel.lights) == 3
    np.testing.assert_allclose(np.sum([light.colour for light in pixel.lights], axis=0), pixel.colour, atol=1e-15)


@pytest.mark.parametrize(("x", "y"), [(30, 25), (0, 0), (30, 8)])
def test_the_printed_test_runs_and_passes_for_the_truth(x, y):
    def intersect(origin, direction, centre, radius):
        return ray_intersect_scene([origin], [direction], [centre], [radius]).t[0]

    pixel = probe_pixel(interpreter("scenes/04_many_spheres.cli"), x, y, 60, 50)
    names = {"intersect": intersect}
    exec(pixel.as_pytest(), names)
    names[f"test_pixel_{x}_{y}_of_60_by_50"]()
