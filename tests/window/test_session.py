"""A session without a window: keys and clicks in, the window's content out."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from raytracer import METHODS, STAGES, eye_hits, interpreter, load_png, probe_pixel, render_scene
from raytracer.camera import make_raster
from sketch.controls import View
from sketch.orbit import HOME, Orbit, seen_from
from sketch.overlay import MARGIN, SMALLEST, STRIP, Layout, Panel, Status, _length, compose, help_panel, status
from sketch.rays import lines_of
from sketch.session import Session
from sketch.worker import Drawing, Request

SPHERE = "surface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"
SIZE = 330
FAR = Path(__file__).resolve().parent.parent.parent / "scenes" / "hard" / "01_far_small_sphere.cli"


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


def expected(path: Path, stage: str = "diffuse", method: str = "certified", orbit: Orbit = HOME) -> np.ndarray:
    return render_scene(seen_from(interpreter(path), orbit), stage, SIZE, SIZE, method=method)


def shows(session: Session, picture: np.ndarray) -> bool:
    return np.array_equal(session.content()[:SIZE, :SIZE], picture)


def click(session: Session, x: int, y: int) -> None:
    session.grip(x, y)
    session.release()


def test_keys_change_what_is_seen(session, scenes):
    wait_until(lambda: shows(session, expected(scenes[0])))
    session.press("2")
    session.press("n")
    wait_until(lambda: shows(session, expected(scenes[1], "normal")))
    assert not session.wants_to_quit
    session.press("\x1b")
    assert session.wants_to_quit


def test_m_shows_what_the_method_draws(scenes):
    session = Session(View((FAR,)), SIZE)
    seen = set()
    for method in METHODS:
        picture = expected(FAR, method=method)
        wait_until(lambda picture=picture: shows(session, picture))
        seen.add(picture.tobytes())
        session.press("m")
    wait_until(lambda: shows(session, expected(FAR)))
    session.press("M")
    wait_until(lambda: shows(session, expected(FAR, method=list(METHODS)[-1])))
    assert len(seen) > 2
    session.close()


def test_the_legend_hides_a_corner_and_l_hides_the_legend(scenes):
    picture = expected(FAR, "error", "textbook")
    session = Session(View((FAR,), stage="error", method="textbook"), SIZE)
    wait_until(lambda: session._renderer.whole)
    rows, columns = np.nonzero((session.content()[:SIZE] != picture).any(axis=2))
    assert rows.min() > SIZE / 2
    assert columns.max() < SIZE / 2
    assert 0.05 < np.ptp(rows) * np.ptp(columns) / SIZE**2 < 0.2
    session.press("l")
    assert shows(session, picture)
    session.press("l")
    assert not shows(session, picture)
    session.press("?")
    help_alone = compose(Layout(SIZE), picture, Status("", "", ""), help_panel())
    assert shows(session, help_alone[:SIZE])
    session.close()


def test_the_status_counts_the_wrong_pixels(scenes):
    scene = interpreter(FAR)
    found, true = eye_hits(scene, SIZE, SIZE, method="textbook"), eye_hits(scene, SIZE, SIZE)
    wrong = int((found.index != true.index).sum())
    assert wrong > 1000
    session = Session(View((FAR,), stage="error", method="textbook"), SIZE)
    for key, remark in (("x", f"{wrong:,} of {SIZE * SIZE:,} pixels are wrong"), ("M", "no pixel is wrong")):
        session.press(key)
        wait_until(lambda: is_answered(session))
        assert status(session._view, session._renderer.drawing, SIZE).remark == remark
    session.close()


def is_answered(session: Session) -> bool:
    drawing = session._renderer.drawing
    return drawing is not None and drawing.whole and drawing.request == session._request(session._view)


def test_the_status_says_the_method_unless_it_is_the_certain_one():
    drawing = Drawing(Request(FAR, "error", SMALLEST), np.zeros((SMALLEST, SMALLEST, 3), np.uint8))
    plain = status(View((FAR,), stage="error"), drawing, SMALLEST)
    assert "certified" not in plain.figures
    other = status(View((FAR,), stage="error", method="half_b"), drawing, SMALLEST)
    assert other.figures == "1 of 1 · error · half_b · 320 × 320 · reading"  # the drawing is not of this method
    assert other.remark == f"half_b: {METHODS['half_b'].about}"
    waiting = replace(drawing, scene=interpreter(FAR), compiling=True)
    assert status(View((FAR,), stage="error"), waiting, SMALLEST).figures.endswith("320 × 320 · compiling, once")


@pytest.mark.parametrize("method", METHODS)
def test_the_figures_fit_the_smallest_window(method):
    views = [View((FAR,) * 11, 10, stage, method) for stage in STAGES]
    for view in views:
        picture = np.zeros((SMALLEST, SMALLEST, 3), np.uint8)
        request = Request(FAR, view.stage, SMALLEST, method)
        drawing = Drawing(request, picture, interpreter(FAR), done=1.0, milliseconds=1234.5)
        assert _length(status(view, drawing, SMALLEST).figures, 12) < SMALLEST - 2 * MARGIN


def test_saved_pictures_are_named_after_the_method(session, scenes, tmp_path):
    for key in "1hsms":
        session.press(key)
    session.close()
    method = list(METHODS)[1]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == [f"1-hit-{method}.png", "1-hit.png"]
    assert np.array_equal(load_png(tmp_path / f"1-hit-{method}.png"), expected(scenes[0], "hit", method))


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
    click(session, SIZE // 2, SIZE // 2)
    session.close()
    assert f"pixel {SIZE // 2} {SIZE // 2}" in capsys.readouterr().out
    assert not shows(session, expected(scenes[0]))
    click(session, SIZE // 2, SIZE + 5)  # on the status: nothing
    assert session._view.pixel == (SIZE // 2, SIZE // 2)


def test_at_the_stage_full_a_click_shows_the_rays_and_s_saves_the_picture_without(scenes, capsys, tmp_path):
    (tmp_path / "1.cli").write_text(SPHERE)
    session, picture = Session(View(scenes, stage="full"), SIZE), expected(scenes[0], "full")
    wait_until(lambda: shows(session, picture))
    click(session, 165, 130)
    wait_until(lambda: not shows(session, picture) and session._story is not None)
    raster = make_raster(interpreter(scenes[0]).camera, SIZE, SIZE)
    (line,) = lines_of(probe_pixel(interpreter(scenes[0]), 165, 130, SIZE, SIZE, "full").rays, raster)
    column, row = (round((a + b) / 2) for a, b in zip(line.start, line.end, strict=True))
    assert session.content()[row, column].tolist() == [255, 255, 255]
    assert session.content()[130, 165].tolist() == picture[130, 165].tolist()
    session.press("s")
    session.close()
    assert "light (0, 5, 5): N·L = " in capsys.readouterr().out
    assert np.array_equal(load_png(tmp_path / "1-full.png"), picture)


def test_a_click_tells_what_the_method_found(scenes, capsys):
    found, true = (eye_hits(interpreter(FAR), SIZE, SIZE, method=method).index for method in ("textbook", "certified"))
    y, x = map(int, np.argwhere((found >= 0) & (true < 0))[0])
    session = Session(View((FAR,), method="textbook"), SIZE)
    wait_until(lambda: session._renderer.whole)
    click(session, x, y)
    session.close()
    story = probe_pixel(interpreter(FAR), x, y, SIZE, SIZE, method="textbook").story()
    assert capsys.readouterr().out.splitlines() == story
    assert story != probe_pixel(interpreter(FAR), x, y, SIZE, SIZE).story()


def drag(session: Session, right: int, down: int) -> None:
    session.grip(100, 100)
    for part in (0.3, 0.6, 1):
        session.drag(100 + round(right * part), 100 + round(down * part))
    session.release()


def test_dragging_and_the_wheel_show_the_scene_from_elsewhere_and_c_from_home(session, scenes):
    wait_until(lambda: shows(session, expected(scenes[0])))
    drag(session, 40, -30)
    wait_until(lambda: shows(session, expected(scenes[0], orbit=HOME.pulled(40, -30))))
    session.wheel(3)
    orbit = HOME.pulled(40, -30).moved(3)
    wait_until(lambda: shows(session, expected(scenes[0], orbit=orbit)))
    session.press("n")
    wait_until(lambda: shows(session, expected(scenes[0], "normal", orbit=orbit)))
    session.press("c")
    wait_until(lambda: shows(session, expected(scenes[0], "normal")))


def test_another_scene_is_seen_as_its_file_says(session, scenes):
    drag(session, 40, -30)
    session.press("2")
    wait_until(lambda: shows(session, expected(scenes[1])))
    session.press("1")
    wait_until(lambda: shows(session, expected(scenes[0])))


def test_a_drag_tells_no_story_and_a_drag_beside_the_picture_does_nothing(session, capsys):
    drag(session, 40, -30)
    session.grip(SIZE // 2, SIZE + 5)  # on the status
    session.drag(50, 50)
    session.release()
    wait_until(lambda: is_answered(session))
    assert session._view.orbit == HOME.pulled(40, -30)
    session.close()
    assert capsys.readouterr().out == ""


def test_the_story_is_of_what_is_seen(session, scenes, capsys):
    session.wheel(-12)
    wait_until(lambda: is_answered(session))
    click(session, SIZE // 2, SIZE // 2)
    session.close()
    seen = seen_from(interpreter(scenes[0]), HOME.moved(-12))
    assert capsys.readouterr().out.splitlines() == probe_pixel(seen, SIZE // 2, SIZE // 2, SIZE, SIZE).story()


def test_s_saves_what_is_seen_moving_or_not(session, scenes, tmp_path):
    wait_until(lambda: is_answered(session))
    drag(session, 40, -30)
    session.press("s")
    wait_until(lambda: (tmp_path / "1-diffuse.png").exists())
    wait_until(lambda: is_answered(session))
    session.press("s")
    session.close()
    for name in ("1-diffuse.png", "1-diffuse-2.png"):
        assert np.array_equal(load_png(tmp_path / name), expected(scenes[0], orbit=HOME.pulled(40, -30)))


def test_a_coarse_frame_is_saved_in_full(session, scenes, tmp_path, monkeypatch):
    wait_until(lambda: is_answered(session))
    monkeypatch.setattr("sketch.worker.REST", 1000)
    monkeypatch.setattr(session._renderer._pace, "choose", lambda: 8)
    drag(session, 40, -30)
    orbit = HOME.pulled(40, -30)
    wait_until(lambda: session._renderer.drawing.request.orbit == orbit)
    assert session._renderer.drawing.coarse == 8
    session.press("s")
    session.close()
    assert np.array_equal(load_png(tmp_path / "1-diffuse.png"), expected(scenes[0], orbit=orbit))


def test_the_status_says_frames_a_second_while_moving_and_milliseconds_at_rest(session):
    wait_until(lambda: is_answered(session))
    way = cycle([10, -10])

    def says_frames_a_second() -> bool:
        drag(session, next(way), 0)
        session.content()
        figures = status(session._view, session._renderer.drawing, SIZE, session._frames.a_second).figures
        return re.search(r" · \d+ fps(, 1/[248] size)?$", figures) is not None

    wait_until(says_frames_a_second)
    wait_until(lambda: is_answered(session) and not session._renderer.drawing.moving)
    session.content()
    assert session._frames.a_second is None
    assert status(session._view, session._renderer.drawing, SIZE).figures.endswith(" ms")


@pytest.mark.parametrize(
    ("coarse", "rate", "said"), [(1, 59.7, "60 fps"), (2, 58.0, "58 fps, 1/2 size"), (8, None, "… fps, 1/8 size")]
)
def test_the_status_of_a_frame(coarse, rate, said):
    picture = np.zeros((SMALLEST, SMALLEST, 3), np.uint8)
    request = Request(FAR, "hit", SMALLEST)
    frame = Drawing(request, picture, interpreter(FAR), 1.0, moving=True, coarse=coarse, path="compiled")
    lines = status(View((FAR,), stage="hit"), frame, SMALLEST, rate)
    assert lines.figures == f"1 of 1 · hit · 320 × 320 · {said}"
    assert lines.path == "compiled path"


def test_only_new_frames_count(session):
    wait_until(lambda: is_answered(session))
    session._renderer.drawing = replace(session._renderer.drawing, moving=True)
    for _ in range(5):
        session.content()
    assert session._frames.a_second is None


def test_the_content_can_be_put_into_a_windows_pixels(session, scenes):
    wait_until(lambda: shows(session, expected(scenes[0])))
    session.press("?")
    pixels = np.full((session.layout.height, session.layout.width, 4), 7, np.uint8)
    session.content(out=pixels[..., 1:])
    assert np.array_equal(pixels[..., 1:], session.content())
    assert (pixels[..., 0] == 7).all()


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
    compose(Layout(size), picture, status, legend=(((1.0, 0.5, 0.0), "long " * 99),) * 99)
