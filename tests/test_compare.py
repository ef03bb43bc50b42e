"""Two pictures compared, and the command that does it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from optional import optional

from raytracer import interpreter, load_png, render_scene, save_png
from raytracer.__main__ import main
from raytracer.compare import DIFFERENCES_LEGEND, compare, difference_picture, differences, mean_flip
from raytracer.image import to_bytes

ROOT = Path(__file__).parent.parent
SCENE = ROOT / "scenes" / "04_many_spheres.cli"
PICTURE = arrays(np.uint8, (3, 4, 3), elements=st.integers(0, 255))
EMPTY = np.zeros((3, 4, 3), np.uint8)


def changed(picture, x, y, by):
    other = picture.copy()
    other[y, x, 1] += by
    return other


@given(PICTURE, PICTURE, st.integers(0, 255))
def test_the_figures_are_what_they_say(found, expected, tolerance):
    off = np.abs(found.astype(int) - expected)
    figures = compare(found, expected, tolerance)
    assert (figures.pixels, figures.tolerance, figures.flip) == (12, tolerance, None)
    assert figures.wrong == sum(pixel.max() > tolerance for row in off for pixel in row)
    assert figures.largest == off.max()
    assert figures.mean == pytest.approx(off.mean())
    assert figures.rmse == pytest.approx(np.sqrt((off**2).mean()))
    if figures.at is not None:
        x, y = figures.at
        assert off[y, x].max() == off.max()
    assert (figures.at is None) == np.array_equal(found, expected)
    assert compare(expected, found, tolerance) == figures
    np.testing.assert_array_equal(differences(found, expected), off.max(axis=2))


def test_a_difference_of_the_tolerance_is_none():
    assert compare(changed(EMPTY, 2, 1, 1), EMPTY).wrong == 0
    assert compare(changed(EMPTY, 2, 1, 2), EMPTY).wrong == 1
    assert compare(changed(EMPTY, 2, 1, 2), EMPTY, tolerance=2).wrong == 0
    assert list(compare(changed(EMPTY, 2, 1, 2), EMPTY).lines())[:2] == [
        "wrong pixels: 1 of 12, off by more than 1",
        "largest difference: 2, at column 2, row 1",
    ]


@given(PICTURE, PICTURE)
def test_the_difference_picture_is_black_where_pictures_are_equal_and_only_there(found, expected):
    found[0] = expected[0]
    picture = difference_picture(found, expected)
    np.testing.assert_array_equal((picture == 0).all(axis=2), (found == expected).all(axis=2))


def test_a_difference_of_2_is_seen_and_the_legend_is_right():
    assert difference_picture(changed(EMPTY, 2, 1, 2), EMPTY)[1, 2].max() > 150
    for colour, text in DIFFERENCES_LEGEND:
        by = 0 if text == "equal" else int(text.removeprefix("off by "))
        np.testing.assert_array_equal(
            difference_picture(changed(EMPTY, 0, 0, by), EMPTY)[0, 0], to_bytes(np.array(colour))
        )


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (np.zeros((3, 5, 3), np.uint8), "found a picture of 5 x 3 pixels, expected 4 x 3"),
        (np.zeros((3, 4), np.uint8), "expected a picture"),
        (np.zeros((3, 4, 3)), "found float64"),
        (np.zeros((0, 4, 3), np.uint8), "expected a picture"),
    ],
)
def test_what_cannot_be_compared_is_refused(found, message):
    for function in (compare, differences, difference_picture):
        with pytest.raises(ValueError, match=message):
            function(found, EMPTY)


def test_flip_is_0_for_equal_pictures_and_grows():
    optional("flip_evaluator")
    picture = np.full((32, 32, 3), 100, np.uint8)
    little, much = (mean_flip(np.full_like(picture, byte), picture) for byte in (110, 200))
    assert mean_flip(picture, picture) == 0
    assert 0 < little < much <= 1
    assert compare(picture, picture, flip=True).flip == 0


def test_without_flip_the_other_figures_are_there(monkeypatch):
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    figures = compare(EMPTY, EMPTY, flip=True)
    assert (figures.wrong, figures.flip) == (0, None)
    assert not any("FLIP" in line for line in figures.lines())


@pytest.fixture
def mine(tmp_path):
    """A student's picture: upside down."""
    path = tmp_path / "mine.png"
    save_png(path, render_scene(interpreter(SCENE), "normal", 64, 48)[::-1])
    return path


def run(capsys, *words):
    status = main(["compare", *map(str, words)])
    out, errors = capsys.readouterr()
    return status, out.splitlines(), errors.splitlines()


def test_a_picture_is_compared_with_a_scene_of_its_size_and_told_its_cause(capsys, mine, tmp_path):
    out = tmp_path / "difference.png"
    status, lines, errors = run(capsys, mine, f"{SCENE}:normal", "-o", out)
    assert (status, errors) == (1, [])
    assert lines[0].startswith("wrong pixels: ")
    assert lines[-1] == "cause: upside down"
    right = render_scene(interpreter(SCENE), "normal", 64, 48)
    np.testing.assert_array_equal(load_png(out), difference_picture(right[::-1], right))


def test_what_is_right_passes_and_names_no_cause(capsys, mine):
    assert run(capsys, mine, mine)[0] == 0
    status, lines, _ = run(capsys, SCENE, SCENE, "--size", "40x30")
    assert status == 0
    assert lines[:2] == ["wrong pixels: 0 of 1200, off by more than 1", "largest difference: 0"]
    assert not any(line.startswith("cause") for line in lines)


def test_options_are_for_scenes_that_do_not_say_it_themselves(capsys):
    words = "--stage", "hit", "--method", "textbook", "--sampling", "centre", "--size", "64x64"
    assert run(capsys, SCENE, f"{SCENE}:hit:textbook", *words)[0] == 0
    assert run(capsys, SCENE, f"{SCENE}:normal", *words)[0] == 1


def test_tolerance_and_allow_let_pass(capsys, mine):
    wrong = json.loads(run(capsys, mine, f"{SCENE}:normal", "--json")[1][0])["wrong"]
    assert run(capsys, mine, f"{SCENE}:normal", "--allow", wrong)[0] == 0
    assert run(capsys, mine, f"{SCENE}:normal", "--allow", wrong - 1)[0] == 1
    assert run(capsys, mine, f"{SCENE}:normal", "--tolerance", 255)[0] == 0


def test_json_is_for_programs(capsys, mine):
    status, (line,), _ = run(capsys, mine, f"{SCENE}:normal", "--json")
    figures = json.loads(line)
    assert (status, figures["passed"], figures["causes"]) == (1, False, ["upside down"])
    assert (figures["width"], figures["height"]) == (64, 48)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.png", SCENE], "missing.png: No such file"),
        ([ROOT / "README.md", SCENE], "found no picture that can be read"),
        ([ROOT / "scenes", SCENE], "Is a directory"),
        ([SCENE, "missing.cli"], "missing.cli: "),
        ([SCENE, f"{SCENE}:shiny"], "found stage 'shiny', expected one of hit"),
        ([SCENE, f"{SCENE}:hit:mine"], "found method 'mine', expected one of certified"),
        ([SCENE, f"{SCENE}:a:b:c"], "expected scene.cli, scene.cli:stage or scene.cli:stage:method"),
        (["MINE", SCENE, "--size", "32x32"], "found a picture of 64 x 48 pixels, expected 32 x 32"),
        (["MINE", SCENE, "-o", "no/folder/x.png"], "no such folder"),
        (["CUT", SCENE], "found no picture that can be read"),
    ],
)
def test_what_cannot_be_read_is_one_line_and_status_2(capsys, mine, tmp_path, words, message):
    cut = tmp_path / "cut.png"
    cut.write_bytes(mine.read_bytes()[:200])
    status, out, errors = run(capsys, *[{"MINE": mine, "CUT": cut}.get(word, word) for word in words])
    assert (status, out, len(errors)) == (2, [], 1)
    assert message in errors[0]


def test_the_exit_status_is_the_process_own(mine):
    command = [sys.executable, "-m", "raytracer", "compare", str(mine)]
    for other, status in ((mine, 0), (f"{SCENE}:normal", 1), ("missing.png", 2)):
        done = subprocess.run([*command, str(other)], cwd=ROOT, capture_output=True, timeout=60, check=False)
        assert done.returncode == status
