"""What a notebook shows, and that a picture stays an array for everybody."""

import pickle
from io import BytesIO
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from optional import optional
from PIL import Image

from raytracer import Camera, Light, Scene, interpreter, render_scene
from raytracer.bench import spread
from raytracer.interpreter import interpret
from raytracer.notebook import Picture

SCENES = Path(__file__).parent.parent / "scenes"


@pytest.fixture(scope="module")
def picture():
    return render_scene(interpreter(SCENES / "04_many_spheres.cli"), width=40, height=30)


def shown(array):
    return np.asarray(Image.open(BytesIO(array._repr_png_())))


def test_a_picture_is_shown_byte_for_byte(picture):
    assert isinstance(picture, np.ndarray)
    np.testing.assert_array_equal(shown(picture), picture)


def test_a_picture_is_drawn_into_the_callers_array_as_it_is(picture):
    out = np.empty((30, 40, 3), np.uint8)
    assert render_scene(interpreter(SCENES / "04_many_spheres.cli"), width=40, height=30, out=out) is out
    assert type(out) is np.ndarray
    np.testing.assert_array_equal(out, picture)


def test_slices_that_are_pictures_are_shown_and_others_not(picture):
    for part in (picture[5:9], picture[:, ::-1], picture[..., ::-1], picture.copy(), picture[::2, ::2]):
        np.testing.assert_array_equal(shown(part), part)
    for part in (
        picture[0],
        picture[..., 0],
        picture[..., :2],
        picture[:0],
        picture.astype(float),
        picture.reshape(-1, 3),
    ):
        assert part._repr_png_() is None


def test_what_is_computed_from_a_picture_is_a_plain_array(picture):
    plain = np.asarray(picture)
    assert type(plain) is np.ndarray
    for found, expected in (
        (picture / 255.0, plain / 255.0),
        (picture.mean(axis=2), plain.mean(axis=2)),
        (picture[..., 0] > 9, plain[..., 0] > 9),
        (picture == plain, plain == plain),
        (np.abs(picture.astype(int) - 9), np.abs(plain.astype(int) - 9)),
    ):
        assert type(found) is np.ndarray
        np.testing.assert_array_equal(found, expected)
    assert type(picture.max()) is np.uint8
    assert type(picture[0, 0, 0]) is np.uint8
    assert type(picture.mean()) is np.float64
    np.testing.assert_array_equal(shown(255 - picture), 255 - plain)
    assert repr(picture) == repr(plain)


def test_a_picture_can_be_changed_in_place(picture):
    changed = picture.copy()
    same = changed
    same += 1
    assert same is changed
    assert type(same) is Picture
    np.testing.assert_array_equal(changed, np.asarray(picture) + np.uint8(1))


def test_a_picture_is_pickled_and_saved(picture, tmp_path):
    again = pickle.loads(pickle.dumps(picture))
    assert again._repr_png_() == picture._repr_png_()
    np.save(tmp_path / "picture.npy", picture)
    np.testing.assert_array_equal(np.load(tmp_path / "picture.npy"), picture)
    assert Image.fromarray(picture).size == (40, 30)


def test_a_scene_says_in_a_line_what_it_holds():
    assert repr(interpreter(SCENES / "04_many_spheres.cli")) == "<Scene '04_many_spheres.cli': 7 spheres, 1 light>"
    assert repr(interpret("background 1 1 1")) == "<Scene '<text>': empty>"
    assert repr(Scene(lights=(Light((0, 0, 0), (1, 1, 1)),) * 2)) == "<Scene: 2 lights>"
    assert "\n" not in repr(Scene(path=Path("a\nb")))


def test_a_scene_is_shown_as_a_table():
    html = interpreter(SCENES / "11_star.cli")._repr_html_()
    for text in (
        "eye (1.2 0 5.5)",
        "rgb(102 102 230)",
        "62 triangles",
        "and 58 more",
        "1 sphere",
        "reflects 0.2",
        "power 20",
    ):
        assert text in html
    assert html.count("<tr>") == html.count("</tr>") < 20


def test_a_scenes_name_cannot_become_markup():
    html = Scene(path=Path("<script>&.cli"))._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;&amp;.cli" in html


def test_a_million_spheres_are_shown_at_once():
    scene = spread(1_000_000)
    start = perf_counter()
    text, html = repr(scene), scene._repr_html_()
    assert perf_counter() - start < 0.1
    assert text == "<Scene: 1,000,000 spheres, 2 lights>"
    assert "and 999,996 more" in html
    assert len(html) < 10_000


def test_numbers_of_any_size_and_colours_beyond_white_are_shown():
    html = Scene(Camera(eye=(1e300, -1e-300, 0.0)), background=(7.0, -1.0, 0.5))._repr_html_()
    assert "(1e+300 -1e-300 0)" in html
    assert "rgb(255 0 128)" in html
    assert "7 -1 0.5" in html


def test_ipython_asks_for_what_there_is(picture):
    optional("IPython")
    from IPython.core.formatters import DisplayFormatter

    formatter = DisplayFormatter()
    assert formatter.format(picture)[0]["image/png"] == picture._repr_png_()
    assert "image/png" not in formatter.format(picture[0])[0]
    assert formatter.format(Scene())[0]["text/html"] == Scene()._repr_html_()
