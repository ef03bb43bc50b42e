"""A session without a window: keys and clicks in, the window's content out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from raytracer import interpreter, load_png, render_scene
from sketch.controls import View
from sketch.overlay import STRIP, Layout, Panel, Status, compose, help_panel
from sketch.session import Session

SPHERE = "surface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"
SIZE = 330


@pytest.fixture
def scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, ...]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "1.cli").write_text(SPHERE)
    (tmp_path / "2.cli").write_text(SPHERE.replace("-4", "-6"))
    (tmp_path / "3.cli").write_text("sphrere 1 0 0 -4")
    return tuple(sorted(tmp_path.glob("*.cli")))


@pytest.fixture
def session(scenes: tuple[Path, ...]) -> Iterator[Session]:
    session = Session(View(scenes), SIZE)
    yield session
    assert session.failure is None
    session.close()


def wait_until(happened: Callable[[], object]) -> None:
    end = time.monotonic() + 10
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.005)


def expected(path: Path, stage: str = "diffuse") -> np.ndarray:
    return render_scene(interpreter(path), stage, SIZE, SIZE)


def shows(session: Session, picture: np.ndarray) -> bool:
    return np.array_equal(session.content()[:SIZE, :SIZE], picture)


def test_keys_change_what_is_seen(session, scenes):
    wait_until(lambda: shows(session, expected(scenes[0])))
    session.press("2")
    session.press("n")
    wait_until(lambda: shows(session, expected(scenes[1], "normal")))
    assert not session.wants_to_quit
    session.press("\x1b")
    assert session.wants_to_quit


def test_saving_waits_neither_for_the_picture_nor_loses_it(session, scenes, tmp_path):
    for key in "1hs2s1hs":
        session.press(key)
    session.close()
    assert np.array_equal(load_png(tmp_path / "1-hit.png"), expected(scenes[0], "hit"))
    assert np.array_equal(load_png(tmp_path / "1-hit-2.png"), expected(scenes[0], "hit"))
    assert np.array_equal(load_png(tmp_path / "2-hit.png"), expected(scenes[1], "hit"))


def test_under_a_message_the_picture_before_is_saved(session, scenes, tmp_path):
    wait_until(lambda: shows(session, expected(scenes[0])))
    session.press("3")
    wait_until(lambda: not shows(session, expected(scenes[0])))
    session.press("s")
    session.close()
    assert [path.name for path in tmp_path.glob("*.png")] == ["1-diffuse.png"]


def test_with_nothing_but_a_broken_scene_there_is_nothing_to_save(scenes, tmp_path):
    session = Session(View(scenes, 2), SIZE)
    wait_until(lambda: session._renderer.drawing and session._renderer.drawing.error)
    session.press("s")
    session.close()
    assert list(tmp_path.glob("*.png")) == []
    assert session._view.note == "not saved: there is no picture"


def test_a_folder_that_cannot_be_written_is_a_note(session, scenes, monkeypatch):
    def refuse(name, picture):
        raise PermissionError(13, "Permission denied", name)

    monkeypatch.setattr("sketch.session.save_beside", refuse)
    session.press("s")
    wait_until(lambda: "Permission denied" in session._view.note)


def test_a_click_prints_the_story(session, scenes, capsys):
    wait_until(lambda: shows(session, expected(scenes[0])))
    session.click(SIZE // 2, SIZE // 2)
    session.close()
    assert f"pixel {SIZE // 2} {SIZE // 2}" in capsys.readouterr().out
    assert not shows(session, expected(scenes[0]))
    session.click(SIZE // 2, SIZE + 5)  # on the status: nothing
    assert session._view.pixel == (SIZE // 2, SIZE // 2)


@pytest.mark.parametrize("size", [1, 100, 320, 400])
def test_the_layout_finds_pixels(size):
    layout = Layout(size)
    picture = np.arange(size * size * 3, dtype=np.uint8).reshape(size, size, 3)
    content = compose(layout, picture, Status("a", "b", "c"))
    assert content.shape == (layout.height, layout.width, 3)
    assert layout.height == layout.width + STRIP
    assert np.array_equal(content[layout.corner :, layout.corner :][:size, :size], picture)
    assert layout.pixel(layout.corner, layout.corner) == (0, 0)
    assert layout.pixel(layout.corner + size - 1, layout.corner) == (size - 1, 0)
    assert layout.pixel(layout.corner + size, layout.corner) is None
    assert layout.pixel(layout.corner, layout.corner - 1) is None


@pytest.mark.parametrize("size", [1, 320, 700])
@pytest.mark.parametrize("mark", [None, (0, 0), (160, 160), (319, 319)])
def test_any_text_fits(size, mark):
    picture = np.zeros((size, size, 3), np.uint8)
    mark = mark and (min(mark[0], size - 1), min(mark[1], size - 1))
    status = Status("name" * 99, "figures" * 99, "remark\n\udcff\0 × − …" * 99)
    for panel in (help_panel(), Panel("x" * 999, (("y" * 20, "word " * 999 + "z" * 9999),)), Panel("", (("", ""),))):
        compose(Layout(size), picture, status, panel, mark)
