"""The window and files that somebody is at work on: scenes that are saved, files that are plugged in."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from window_driver import Sketch, is_written

from raytracer import interpreter, load_png, render_scene
from raytracer.compare import DIFFERENCES_LEGEND, difference_picture
from raytracer.mistakes import recognise
from raytracer.plug import Order, draw_plugged, load_plug
from sketch.overlay import Layout, Status, causes_panel, compose

SIZE = 330
SCENE = "background 0 0 .5\nsurface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"
GREEN = "def shade(hit):\n    return 0, 1, 0\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.cli"
    path.write_text(SCENE)
    return path


def reference(scene: Path, stage: str = "diffuse") -> np.ndarray:
    return render_scene(interpreter(scene), stage, SIZE, SIZE)


def in_green(scene: Path) -> np.ndarray:
    hit = (render_scene(interpreter(scene), "hit", SIZE, SIZE) == [204, 51, 77]).all(axis=2)
    return np.where(hit[..., None], [0, 255, 0], [0, 0, 128]).astype(np.uint8)


def lies_under_a_banner(sketch: Sketch, picture: np.ndarray) -> Callable[[], bool]:
    """Whether the picture is seen in its lower half, and something else lies over its upper one."""

    def lies() -> bool:
        seen, half = sketch.picture(SIZE), SIZE // 2
        return np.array_equal(seen[half:], picture[half:]) and not np.array_equal(seen[:half], picture[:half])

    return lies


def test_a_scene_is_drawn_anew_when_it_is_saved(start, scene):
    sketch = start(scene, "--size", SIZE)
    good = reference(scene)
    sketch.wait_for_picture(good, "the scene")
    scene.write_text(SCENE.replace("sphere", "spere"))
    sketch.wait_until(lies_under_a_banner(sketch, good), "the banner")
    scene.write_text(SCENE.replace("-4", "-6"))
    sketch.wait_for_picture(reference(scene), "the scene as it was saved")
    good = reference(scene)
    scene.unlink()
    sketch.wait_until(lies_under_a_banner(sketch, good), "the banner about no file")
    scene.mkdir()
    time.sleep(0.3)
    assert lies_under_a_banner(sketch, good)()
    scene.rmdir()
    scene.write_text(SCENE)
    sketch.wait_for_picture(reference(scene), "the scene that has come back")
    sketch.press("Escape")
    assert sketch.end() == 0


def test_a_plugged_file_draws_is_mended_and_compared(start, scene, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(GREEN)
    sketch = start(scene, "--size", SIZE, "--plug", mine)
    own, true = in_green(scene), reference(scene)
    sketch.wait_for_picture(own, "one's own picture")
    sketch.press("n")
    sketch.wait_for_picture(reference(scene, "normal"), "a stage that the file has no part in")
    sketch.press("d")
    sketch.wait_for_picture(own, "one's own picture again")
    sketch.press("v")
    sketch.wait_for_picture(true, "the reference")
    sketch.press("v")
    difference = difference_picture(own, true)
    legend = compose(Layout(SIZE), difference, Status("", "", ""), legend=DIFFERENCES_LEGEND)[:SIZE]
    sketch.wait_for_picture(legend, "the difference")
    sketch.press("s")
    saved = tmp_path / "scene-diffuse-mine-difference.png"
    sketch.wait_until(lambda: is_written(saved), "the difference to be saved")
    sketch.press("v")
    for border in (100, 200):
        sketch.xdotool("mousemove", str(sketch.left + border), str(sketch.top + 50))
        both = np.where(np.arange(SIZE)[:, None] < border, own, true)
        both[:, border] = 255 - both[:, border]
        sketch.wait_for_picture(both, "both, with a border under the mouse")
    sketch.press("v")
    sketch.wait_for_picture(own, "one's own picture at the end of the round")
    assert np.array_equal(load_png(saved), difference)

    mine.write_text(GREEN.replace("0, 1, 0", "0, 1, nothing"))
    sketch.wait_until(lies_under_a_banner(sketch, own), "the banner")
    mine.write_text(GREEN.replace("0, 1, 0", "1, 1, 0"))
    yellow = own.copy()
    yellow[(own == [0, 255, 0]).all(axis=2)] = [255, 255, 0]
    sketch.wait_for_picture(yellow, "the picture of the mended file")
    assert not sketch.stderr.read_text()


def test_a_file_that_hangs_hinders_nobody(start, scene, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("print('begun', flush=True)\nwhile True: print('on and on')\n")
    sketch = start(scene, "--size", SIZE, "--plug", mine, "--patience", 3)
    sketch.wait_until(lambda: "begun" in sketch.stdout.read_text(), "the file to be run")
    sketch.press("question")
    sketch.wait_until(lambda: (sketch.picture(SIZE) > 200).sum() > 500, "help, while the file hangs")
    sketch.press("question")
    nothing = np.full((SIZE, SIZE, 3), 40, np.uint8)
    sketch.wait_until(lies_under_a_banner(sketch, nothing), "the banner")
    mine.write_text("while True: pass\n")
    time.sleep(0.5)
    sketch.press("Escape")
    assert sketch.end() == 0


def test_the_window_closes_while_a_plugged_file_draws(start, scene, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("import os, time\nprint(os.getpid(), flush=True)\ntime.sleep(1000)\n")
    sketch = start(scene, "--size", SIZE, "--plug", mine)
    sketch.wait_until(lambda: bool(sketch.stdout.read_text().strip()), "the file to be run")
    sketch.close_window()
    assert sketch.end() == 0
    child = Path(f"/proc/{int(sketch.stdout.read_text())}")
    end = time.monotonic() + 10
    while child.exists() and (child / "stat").read_text().split()[2] != "Z":
        assert time.monotonic() < end
        time.sleep(0.05)


def test_mending_the_module_that_a_file_imports_clears_the_banner(start, scene, tmp_path):
    mine, beside = tmp_path / "mine.py", tmp_path / "colours_of_mine.py"
    mine.write_text("from colours_of_mine import green\ndef shade(hit): return green()\n")
    beside.write_text("def green(): return 0, 1, 0\n")
    sketch = start(scene, "--size", SIZE, "--plug", mine)
    sketch.wait_for_picture(in_green(scene), "one's own picture")
    beside.write_text("def green(): return 0, 1, none\n")
    sketch.wait_until(lies_under_a_banner(sketch, in_green(scene)), "the banner")
    beside.write_text("def green(): return 0, 1, 0\n")
    sketch.wait_for_picture(in_green(scene), "one's own picture again")


def test_ctrl_c_at_any_moment_of_the_start_is_quiet(display, tmp_path):
    for delay in (0.1, 0.4, 0.8, 1.2, 1.8):
        sketch = Sketch(display, tmp_path, "--size", 64)
        time.sleep(delay)
        sketch.interrupt()
        assert sketch.end() in (130, -2)  # −2 while Python itself starts
        assert "raytracer" not in sketch.stderr.read_text()
        assert not list(tmp_path.glob("*.png"))


def test_the_usual_mistake_is_named_and_gone_when_it_is_mended(start, scene, tmp_path):
    """What a newcomer does: the printed template, a slip, key v, the cause, the slip mended, nothing differs."""
    right = resources.files("raytracer").joinpath("templates", "stage.py").read_text("utf-8")
    slip = right.replace("total * block.diffuse", "total + block.diffuse")
    mine = tmp_path / "mine.py"
    mine.write_text(slip)
    size = 100  # numpy is quick
    sketch = start(scene, "--size", size, "--plug", mine)
    picture = draw_plugged(load_plug(mine), Order(interpreter(scene), "diffuse", size, size))
    layout, nothing = Layout(size), np.zeros((size, size, 3), np.uint8)
    causes = recognise(picture, interpreter(scene), "diffuse")
    assert any("+" in cause for cause in causes)
    seen = difference_picture(picture, render_scene(interpreter(scene), "diffuse", size, size))
    panel = compose(layout, seen, Status("", "", ""), causes_panel(causes), legend=DIFFERENCES_LEGEND)
    sketch.press("v", "v")
    sketch.wait_for_picture(panel[: layout.side], "the cause")
    mine.write_text(right)
    same = compose(layout, nothing, Status("", "", ""), legend=DIFFERENCES_LEGEND)
    sketch.wait_for_picture(same[: layout.side], "no difference and no cause")
