"""The window for real: keys go in through the X server, pixels come out of its screen."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from window_driver import PROJECT, Sketch, is_written

from raytracer import METHODS, STAGES, interpreter, load_png, probe_pixel, render_scene, save_png
from raytracer.camera import make_raster
from sketch.orbit import HALF_TURN, HOME, Orbit, seen_from
from sketch.overlay import Layout, Status, compose
from sketch.rays import MIRRORED, lines_of

SIZE = 330
SPHERE = "surface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"
NAMES = ["01_one_sphere", "02_three_spheres", "04_many_spheres"]
BROKEN = "05_broken"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes")
    for name in NAMES:
        shutil.copy(PROJECT / "scenes" / f"{name}.cli", folder)
    (folder / f"{BROKEN}.cli").write_text("fov 60\nsphrere 1 0 0 -4\n")
    return folder


@pytest.fixture(scope="module")
def sketch(lasting_display: str, folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sketch]:
    """One window for the tests that leave it alive."""
    sketch = Sketch(lasting_display, tmp_path_factory.mktemp("cwd"), folder, "--size", SIZE)
    yield sketch.find_window()
    sketch.process.kill()
    sketch.process.wait()


@pytest.fixture(scope="module")
def expected(folder: Path) -> Callable[..., np.ndarray]:
    def draw(name: str, stage: str, orbit: Orbit = HOME) -> np.ndarray:
        return render_scene(seen_from(interpreter(folder / f"{name}.cli"), orbit), stage, SIZE, SIZE)

    return draw


def test_the_first_picture_is_there_before_any_key(sketch, expected):
    sketch.wait_for_picture(expected(NAMES[0], "diffuse"), "the first scene")
    assert (sketch.width, sketch.height) == (SIZE, SIZE + 48)


def test_number_keys_show_scenes_byte_for_byte(sketch, expected):
    sketch.press("d")
    for key, name in [("2", NAMES[1]), ("3", NAMES[2]), ("1", NAMES[0])]:
        sketch.press(key)
        sketch.wait_for_picture(expected(name, "diffuse"), name)


@pytest.mark.parametrize("stage", STAGES)
def test_stage_keys_show_stages_byte_for_byte(sketch, expected, stage):
    sketch.press("2", STAGES[stage].key)
    sketch.wait_for_picture(under_legend(expected(NAMES[1], stage), stage), stage)


def under_legend(picture: np.ndarray, stage: str) -> np.ndarray:
    """The picture as the window shows it."""
    return compose(Layout(SIZE), picture, Status("", "", ""), legend=STAGES[stage].legend)[:SIZE]


def test_m_changes_the_method_and_the_picture_of_errors_answers(start):
    path = PROJECT / "scenes" / "hard" / "01_far_small_sphere.cli"
    sketch = start(path, "--size", SIZE, "--stage", "error", "--method", list(METHODS)[2])
    seen, (certain, first, second, third) = set(), list(METHODS)[:4]
    for keys, method in [("x", second), ("M", first), ("M", certain), ("mmm", third)]:
        sketch.press(*keys)
        picture = render_scene(interpreter(path), "error", SIZE, SIZE, method=method)
        sketch.wait_for_picture(under_legend(picture, "error"), method)
        seen.add(picture.tobytes())
    assert len(seen) > 2
    sketch.press("l")
    sketch.wait_for_picture(picture, "the picture without the legend")
    sketch.press("l")
    sketch.wait_for_picture(under_legend(picture, "error"), "the legend again")
    sketch.press("Escape")
    assert sketch.end() == 0


def test_tab_and_brackets(sketch, expected):
    stages = list(STAGES)
    sketch.press("1", STAGES[stages[0]].key, "Tab")
    sketch.wait_for_picture(expected(NAMES[0], stages[1]), "the next stage")
    sketch.press("bracketright")
    sketch.wait_for_picture(expected(NAMES[1], stages[1]), "the next scene")
    sketch.press("bracketleft")
    sketch.wait_for_picture(expected(NAMES[0], stages[1]), "the scene before")


def test_keys_faster_than_pictures_end_at_the_last(sketch, expected):
    sketch.press(*(["1", "n", "2", "d", "3", "z"] * 5), "2", "n")
    sketch.wait_for_picture(expected(NAMES[1], "normal"), "the last of many keys")


def test_help_lies_over_the_picture_and_goes_away(sketch, expected):
    picture = expected(NAMES[0], "diffuse")
    sketch.press("1", "d")
    sketch.wait_for_picture(picture, "a picture")
    sketch.press("question")
    sketch.wait_until(lambda: (sketch.picture(SIZE) != picture).any(axis=2).mean() > 0.3, "the help")
    sketch.press("question")
    sketch.wait_for_picture(picture, "the picture without the help")


def test_a_click_tells_the_pixels_story_and_a_key_hides_it(sketch, expected):
    picture = expected(NAMES[0], "diffuse")
    sketch.press("1", "d")
    sketch.wait_for_picture(picture, "a picture")
    sketch.click(160, 100)
    sketch.wait_until(lambda: "pixel 160 100" in sketch.stdout.read_text(), "the printed story")
    assert "shape 0" in sketch.stdout.read_text()
    sketch.wait_until(lambda: (sketch.picture(SIZE) != picture).any(axis=2).mean() > 0.1, "the story")
    assert np.array_equal(sketch.screen()[100, 160], picture[100, 160])
    sketch.click(10, 320)
    sketch.wait_until(lambda: "pixel 10 320" in sketch.stdout.read_text(), "another story")
    sketch.press("d")
    sketch.wait_for_picture(picture, "the picture without the story")


def test_a_click_at_the_stage_full_draws_the_rays(start, tmp_path):
    scene = interpreter(PROJECT / "scenes" / "09_mirror_spheres.cli")
    sketch, picture = start(scene.path, "--size", SIZE, "--stage", "full"), render_scene(scene, "full", SIZE, SIZE)
    sketch.wait_for_picture(picture, "a picture")
    sketch.click(165, 184)
    sketch.wait_until(lambda: "mirrored along" in sketch.stdout.read_text(), "the printed story")
    rays = probe_pixel(scene, 165, 184, SIZE, SIZE, "full").rays
    (mirrored,) = (line for line in lines_of(rays, make_raster(scene.camera, SIZE, SIZE)) if line.colour == MIRRORED)
    x, y = map(round, mirrored.end)
    sketch.wait_until(lambda: tuple(sketch.screen()[y, x]) == MIRRORED, "the dot where the mirrored ray arrives")
    assert np.array_equal(sketch.screen()[184, 165], picture[184, 165])
    sketch.press("s")
    sketch.wait_for_picture(picture, "the picture without the rays")
    sketch.press("Escape")
    assert sketch.end() == 0
    assert np.array_equal(load_png(tmp_path / "09_mirror_spheres-full.png"), picture)


def test_dragging_turns_the_camera_and_c_returns(sketch, expected):
    sketch.press("3", "n")
    sketch.wait_for_picture(expected(NAMES[2], "normal"), "a picture")
    told = sketch.stdout.read_text()
    sketch.drag(80, -40)
    sketch.wait_for_picture(expected(NAMES[2], "normal", HOME.pulled(80, -40)), "the scene from elsewhere")
    sketch.drag(-200, 100)
    sketch.wait_for_picture(expected(NAMES[2], "normal", HOME.pulled(-120, 60)), "a second drag, out of the window")
    sketch.press("c")
    sketch.wait_for_picture(expected(NAMES[2], "normal"), "the file's own view")
    assert sketch.stdout.read_text() == told  # a drag is no click


def test_a_drag_that_is_held_is_drawn_in_full_and_goes_on(sketch, expected):
    sketch.press("3", "n")
    sketch.wait_for_picture(expected(NAMES[2], "normal"), "a picture")
    sketch.drag(40, 40, release=False)
    sketch.wait_for_picture(expected(NAMES[2], "normal", HOME.pulled(40, 40)), "the scene while the button is down")
    sketch.xdotool("mousemove_relative", "--", "-40", "-40")
    sketch.wait_for_picture(expected(NAMES[2], "normal"), "the way back")
    sketch.release()
    sketch.press("c")


def test_the_wheel_moves_the_camera(sketch, expected):
    sketch.press("3", "d")
    sketch.wait_for_picture(expected(NAMES[2], "diffuse"), "a picture")
    sketch.wheel(5)
    sketch.wait_for_picture(expected(NAMES[2], "diffuse", HOME.moved(5)), "the scene from nearer")
    sketch.wheel(-9)
    sketch.wait_for_picture(expected(NAMES[2], "diffuse", HOME.moved(-4)), "the scene from farther away")
    sketch.press("1")
    sketch.wait_for_picture(expected(NAMES[0], "diffuse"), "another scene as its file says")
    sketch.press("3")
    sketch.wait_for_picture(expected(NAMES[2], "diffuse"), "the scene as its file says")


def test_a_click_after_a_drag_tells_what_is_seen(sketch, folder, expected):
    sketch.press("1", "d")
    sketch.wait_for_picture(expected(NAMES[0], "diffuse"), "a picture")
    sketch.drag(HALF_TURN // 4, 0)
    orbit = HOME.pulled(HALF_TURN // 4, 0)
    sketch.wait_for_picture(expected(NAMES[0], "diffuse", orbit), "the scene from elsewhere")
    sketch.click(150, 140)
    story = probe_pixel(seen_from(interpreter(folder / f"{NAMES[0]}.cli"), orbit), 150, 140, SIZE, SIZE).story()
    sketch.wait_until(lambda: "\n".join(story) in sketch.stdout.read_text(), "the story of what is seen")
    sketch.press("c")


def test_a_broken_scene_leaves_the_last_picture_under_a_message(sketch, expected):
    picture = expected(NAMES[1], "diffuse")
    sketch.press("2", "d")
    sketch.wait_for_picture(picture, "a picture")
    sketch.press("4")

    def covered() -> float:
        return float((sketch.picture(SIZE) != picture).any(axis=2).mean())

    sketch.wait_until(lambda: 0.02 < covered() < 0.6, "the message")
    assert np.array_equal(sketch.picture(SIZE)[SIZE // 2 :], picture[SIZE // 2 :])
    sketch.press("2")
    sketch.wait_for_picture(picture, "the picture without the message")


def test_a_key_without_a_scene_changes_only_the_status(sketch, expected):
    picture = expected(NAMES[0], "diffuse")
    sketch.press("1", "d")
    sketch.wait_for_picture(picture, "a picture")
    before = sketch.screen()[SIZE:]
    sketch.press("9")
    sketch.wait_until(lambda: not np.array_equal(sketch.screen()[SIZE:], before), "the answer")
    assert np.array_equal(sketch.picture(SIZE), picture)


def test_s_saves_what_is_seen_and_overwrites_nothing(sketch, expected):
    sketch.press("1", "n", "question", "s", "s", "2", "s")
    files = [f"{NAMES[0]}-normal.png", f"{NAMES[0]}-normal-2.png", f"{NAMES[1]}-normal.png"]
    sketch.wait_until(lambda: all(is_written(sketch.cwd / file) for file in files), "three files")
    for file, name in zip(files, [NAMES[0], NAMES[0], NAMES[1]], strict=True):
        assert np.array_equal(load_png(sketch.cwd / file), expected(name, "normal"))


def test_r_reads_the_file_again(sketch, folder, expected):
    path = folder / f"{NAMES[2]}.cli"
    text = path.read_text()
    sketch.press("3", "d")
    sketch.wait_for_picture(expected(NAMES[2], "diffuse"), "the scene")
    path.write_text(SPHERE)
    sketch.press("r")
    sketch.wait_for_picture(expected(NAMES[2], "diffuse"), "the changed scene")
    path.write_text(text)


def test_escape_quits_with_status_0(start, folder):
    sketch = start(folder, "--size", 100)
    sketch.press("Escape")
    assert sketch.end() == 0
    assert sketch.stderr.read_text() == ""


def test_a_file_opens_its_folder_at_that_file(start, folder, expected):
    sketch = start(folder / f"{NAMES[1]}.cli", "--size", SIZE, "--stage", "outline")
    sketch.wait_for_picture(expected(NAMES[1], "outline"), "the file's scene")
    sketch.press("bracketright")
    sketch.wait_for_picture(expected(NAMES[2], "outline"), "the scene after it")
    sketch.close_window()
    assert sketch.end() == 0


def test_a_broken_first_scene_opens_the_window_with_a_message(start, folder, expected):
    sketch = start(folder / f"{BROKEN}.cli", "--size", SIZE)
    sketch.wait_until(lambda: sketch.picture(SIZE).max() > 200, "the message")
    assert len(np.unique(sketch.picture(SIZE)[-40:].reshape(-1, 3), axis=0)) == 1
    sketch.press("s", "1")
    sketch.wait_for_picture(expected(NAMES[0], "diffuse"), "the first scene")
    sketch.interrupt()
    assert sketch.end() == 130
    assert "Traceback" not in sketch.stderr.read_text()


def test_quitting_does_not_wait_for_the_compiler(start, folder):
    endless = (
        "import sys, time, sketch.worker, sketch.__main__\n"
        "def load(seen): print('loading', flush=True); time.sleep(1000)\n"
        "sketch.worker.bring_in_kernels = load\n"
        "sys.exit(sketch.__main__.main())"
    )
    sketch = start(folder, "--size", 100, program=("-c", endless))
    sketch.wait_until(lambda: sketch.stdout.read_text() == "loading\n", "the loading")
    sketch.press("Escape")
    assert sketch.end() == 0
    assert sketch.stderr.read_text() == ""


MISTAKES = ["Session.press", "Session.drag", "Session.wheel", "probe_pixel"]


@pytest.mark.parametrize("method", [f"sketch.session.{name}" for name in MISTAKES])
def test_a_mistake_of_ours_ends_the_sketch_with_status_1(start, folder, method):
    """In a handler, and on the thread of the chores."""
    owner, name = method.rsplit(".", 1)
    sabotage = (
        "import sys, sketch.session, sketch.__main__\n"
        "def broken(*anything, **more): raise ZeroDivisionError('sabotage')\n"
        f"{owner}.{name} = broken\n"
        "sys.exit(sketch.__main__.main())"
    )
    sketch = start(folder, "--size", 100, program=("-c", sabotage))
    use = {
        "press": lambda: sketch.press("d"),
        "drag": lambda: sketch.drag(20, 20),
        "wheel": lambda: sketch.wheel(1),
        "probe_pixel": lambda: sketch.click(sketch.width // 2, sketch.width // 2),
    }
    use[name]()
    assert sketch.end() == 1
    assert "ZeroDivisionError: sabotage" in sketch.stderr.read_text()


def test_a_mistake_of_ours_while_drawing_ends_the_sketch_with_status_1(display, folder, tmp_path):
    sabotage = (
        "import sys, sketch.worker, sketch.__main__\n"
        "def broken(*anything, **more): raise ZeroDivisionError('sabotage')\n"
        "sketch.worker.draw = broken\n"
        "sys.exit(sketch.__main__.main())"
    )
    sketch = Sketch(display, tmp_path, folder, program=("-c", sabotage))
    assert sketch.end() == 1
    assert "ZeroDivisionError: sabotage" in sketch.stderr.read_text()


def test_the_readmes_picture_of_the_window(start, request):
    """With --store, the picture is taken anew."""
    kept = PROJECT / "docs" / "window.png"
    sketch = start(PROJECT / "scenes" / "04_many_spheres.cli", "--size", 480)
    sketch.wait_for_picture(
        render_scene(interpreter(PROJECT / "scenes" / "04_many_spheres.cli"), "diffuse", 480, 480), "scene 4"
    )
    sketch.click(330, 180)
    sketch.wait_until(lambda: "drawn as" in sketch.stdout.read_text(), "the printed story")
    sketch.wait_until(lambda: (sketch.picture(480)[300:] < 40).all(axis=2).mean() > 0.3, "the story")
    if request.config.getoption("--store"):
        save_png(kept, sketch.screen())
    assert load_png(kept).shape == sketch.screen().shape
