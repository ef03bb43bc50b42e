"""The renderer in the background: the latest request wins, rows appear as they are drawn, errors are values."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from raytracer import METHODS, Cancelled, backend, eye_hits, interpreter, machine_code, make_plan, plain, render_scene
from raytracer.render import draw
from sketch import pace, worker
from sketch.orbit import HOME, Orbit, seen_from
from sketch.pace import enlarged
from sketch.worker import Drawing, Renderer, Request

SPHERE = "surface 1 0 0  0 0 0  0 0 0  1 0\nlight 0 5 5  1 1 1\nsphere 1 0 0 -4\n"
SIZE = 50
compiled = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
FAR = Path(__file__).resolve().parent.parent.parent / "scenes" / "hard" / "01_far_small_sphere.cli"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.cli"
    path.write_text(SPHERE)
    return path


@pytest.fixture
def renderer() -> Iterator[Renderer]:
    renderer = Renderer(lambda: None)
    yield renderer
    renderer.close()
    renderer.join(10)


def wait_until(happened: Callable[[], object]) -> None:
    end = time.monotonic() + 10
    while not happened():
        assert time.monotonic() < end
        time.sleep(0.002)


def answer(renderer: Renderer, request: Request) -> Drawing:
    """What comes of a request at first; a frame is drawn once more when nothing follows it."""
    renderer.post(request)
    end = time.monotonic() + 10
    while (drawing := renderer.drawing) is None or drawing.request != request or not is_over(drawing):
        assert time.monotonic() < end
        time.sleep(0.002)
    return drawing


def is_over(drawing: Drawing) -> bool:
    return drawing.whole or bool(drawing.error)


def test_it_draws_what_render_scene_draws(renderer, scene):
    drawing = answer(renderer, Request(scene, "diffuse", SIZE))
    assert np.array_equal(drawing.picture, render_scene(interpreter(scene), "diffuse", SIZE, SIZE))
    assert drawing.milliseconds > 0
    assert renderer.whole is drawing


@pytest.mark.parametrize("method", METHODS)
def test_it_draws_by_the_method_that_is_asked_for(renderer, method):
    scene = interpreter(FAR)
    drawing = answer(renderer, Request(FAR, "error", SIZE, method))
    assert np.array_equal(drawing.picture, render_scene(scene, "error", SIZE, SIZE, method=method))
    found, true = eye_hits(scene, SIZE, SIZE, method=method), eye_hits(scene, SIZE, SIZE)
    assert drawing.wrong == (found.index != true.index).sum()


def test_an_error_is_a_value_and_leaves_the_last_picture(renderer, scene, tmp_path):
    good = answer(renderer, Request(scene, "diffuse", SIZE))
    bad = answer(renderer, Request(tmp_path / "missing.cli", "diffuse", SIZE))
    assert bad.error.startswith(str(tmp_path / "missing.cli"))
    assert "\n" not in bad.error
    assert np.array_equal(bad.picture, good.picture)
    assert renderer.whole is good
    assert renderer.failure is None


def test_a_file_is_read_again_only_when_asked(renderer, scene):
    first = answer(renderer, Request(scene, "diffuse", SIZE))
    scene.write_text("no scene")
    assert answer(renderer, Request(scene, "normal", SIZE)).scene is first.scene
    assert answer(renderer, Request(scene, "normal", SIZE, readings=1)).error
    scene.write_text(SPHERE)
    assert answer(renderer, Request(scene, "normal", SIZE, readings=2)).scene == first.scene


def test_the_latest_request_wins_and_the_running_one_is_given_up(renderer, scene, monkeypatch):
    started, given_up = threading.Event(), threading.Event()

    def draw_for_ever(plan, out, progress, cancelled):
        started.set()
        while not cancelled():
            time.sleep(0.001)
        given_up.set()
        raise Cancelled

    with monkeypatch.context() as patch:
        patch.setattr(worker, "draw", draw_for_ever)
        renderer.post(Request(scene, "diffuse", SIZE))
        assert started.wait(10)
    for stage in ("hit", "outline", "normal"):
        renderer.post(Request(scene, stage, SIZE))
    assert given_up.wait(10)
    wait_until(lambda: renderer.whole)
    assert renderer.whole.request.stage == "normal"


def test_rows_are_seen_as_they_come(scene, monkeypatch):
    seen, drawn = [], threading.Event()

    def draw_slowly(plan, out, progress, cancelled):
        for row in range(SIZE):
            out[row] = 7
            time.sleep(0.004)
            progress(row + 1, SIZE, slice(row, row + 1))

    def look():
        seen.append((renderer.drawing.done, int((renderer.drawing.picture[:, 0, 0] == 7).sum())))
        if renderer.drawing.whole:
            drawn.set()

    monkeypatch.setattr(worker, "draw", draw_slowly)
    renderer = Renderer(look)
    renderer.post(Request(scene, "diffuse", SIZE))
    assert drawn.wait(10)
    assert len(seen) >= 3
    assert all(rows == round(done * SIZE) for done, rows in seen)
    assert seen[-1] == (1.0, SIZE)
    renderer.close()


def test_a_mistake_of_ours_is_kept_and_reported(scene, monkeypatch):
    told = threading.Event()

    def broken(*anything, **more):
        raise ZeroDivisionError

    monkeypatch.setattr(worker, "draw", broken)
    renderer = Renderer(told.set)
    renderer.post(Request(scene, "diffuse", SIZE))
    assert told.wait(10)
    assert isinstance(renderer.failure, ZeroDivisionError)


def test_what_makes_it_faster_is_loaded_once_and_in_the_background(renderer, scene, monkeypatch):
    loads, may_end = [], threading.Event()

    def load_slowly():
        loads.append(threading.current_thread())
        assert may_end.wait(10)

    stand_in = SimpleNamespace(**vars(backend) | {"load": load_slowly, "loaded": lambda: None})
    monkeypatch.setattr(worker, "backend", stand_in)
    monkeypatch.setattr(worker, "bring_in_kernels", lambda seen: True)
    renderer.get_faster()  # too early
    answer(renderer, Request(scene, "diffuse", SIZE))
    assert loads == []
    for _ in range(3):
        renderer.get_faster()
    wait_until(lambda: loads)
    answer(renderer, Request(scene, "normal", SIZE))
    assert len(loads) == 1
    assert loads[0].daemon
    may_end.set()
    loads[0].join(10)
    assert renderer.failure is None


@compiled
def test_the_kernels_that_are_brought_in_are_used_next(renderer, scene):
    answer(renderer, Request(scene, "error", SIZE, "half_b"))
    renderer.get_faster()
    renderer._loader.join(60)
    assert not renderer._loader.is_alive()
    assert renderer.failure is None
    drawing = answer(renderer, Request(scene, "depth", SIZE))
    assert np.array_equal(drawing.picture, render_scene(interpreter(scene), "depth", SIZE, SIZE))
    assert backend.load() is import_module("raytracer.kernels")


@compiled
def test_waiting_for_machine_code_is_told(renderer, scene, monkeypatch):
    backend.load()
    told = []
    monkeypatch.setattr(backend, "is_loaded", lambda kernel: False)
    for kept in (True, False):
        monkeypatch.setattr(backend, "is_ready", lambda kernel, kept=kept: kept)
        monkeypatch.setattr(renderer, "_changed", lambda: told.append(renderer.drawing.compiling))
        answer(renderer, Request(scene, "hit" if kept else "outline", SIZE))
        assert not renderer.drawing.compiling
        assert any(told) != kept


@compiled
def test_who_waits_for_machine_code_may_want_something_else(renderer, scene, monkeypatch):
    """The next picture does not wait, nor does a frame; what has been begun is not begun again."""
    backend.load()
    made, may_end = [], threading.Event()

    def make_slowly(drawing):
        made.append(drawing.request.stage)
        assert may_end.wait(10)

    monkeypatch.setattr(worker, "bring_in_kernels", make_slowly)
    monkeypatch.setattr(backend, "is_ready", lambda kernel: kernel != "paint_normal" or may_end.is_set())
    monkeypatch.setattr(backend, "is_loaded", lambda kernel: kernel == "paint_flat" or may_end.is_set())
    first = Request(scene, "normal", SIZE)
    for _ in range(2):
        renderer.post(first)
        wait_until(lambda: made and renderer.drawing.request == first and renderer.drawing.compiling)
        answer(renderer, Request(scene, "hit", SIZE))
    turned = replace(first, orbit=Orbit(right=10))
    for waiting in (Request(scene, "diffuse", SIZE), first, turned):  # the first is only not to be loaded meanwhile
        renderer.post(waiting)
        wait_until(lambda waiting=waiting: renderer.drawing.request == waiting and renderer.drawing.compiling)
    assert made == ["normal"]
    may_end.set()
    wait_until(lambda: renderer.drawing.request == turned and renderer.drawing.full and not renderer.drawing.moving)
    assert np.array_equal(renderer.drawing.picture, draw(make_plan(renderer.drawing.scene, "normal", SIZE, SIZE)))
    assert renderer.failure is None


@compiled
def test_machine_code_that_cannot_be_made_is_no_mistake_of_ours(renderer, scene, monkeypatch):
    """Whoever draws meets the fault again, if it lasts."""
    backend.load()

    def fail(drawing):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(worker, "bring_in_kernels", fail)
    monkeypatch.setattr(backend, "is_ready", lambda kernel: False)
    monkeypatch.setattr(backend, "is_loaded", lambda kernel: False)
    drawing = answer(renderer, Request(scene, "hit", SIZE))
    assert renderer.failure is None
    assert np.array_equal(drawing.picture, render_scene(interpreter(scene), "hit", SIZE, SIZE))


@compiled
def test_a_plugged_file_waits_for_no_machine_code(scene, monkeypatch):
    backend.load()
    monkeypatch.setattr(backend, "is_ready", lambda kernel: False)
    monkeypatch.setattr(backend, "is_loaded", lambda kernel: False)
    picture = np.full((SIZE, SIZE, 3), 9, np.uint8)
    plug = SimpleNamespace(path=Path("own.py"), draw=lambda *_: (picture, ["a part"], []), close=lambda: None)
    told = []
    renderer = Renderer(lambda: told.append(renderer.drawing.compiling), plug)
    drawing = answer(renderer, Request(scene, "diffuse", SIZE, plug=1))
    renderer.close()
    assert (drawing.picture == picture).all()
    assert not any(told)


@compiled
def test_machine_code_that_cannot_be_kept_is_waited_for_once(renderer, scene, monkeypatch):
    backend.load()
    monkeypatch.setattr(machine_code, "is_kept", lambda kernel: False)
    answer(renderer, Request(scene, "hit", SIZE))
    assert backend.is_ready("paint_flat")
    monkeypatch.setattr(backend.load(), "paint_flat", SimpleNamespace(signatures=[]))
    assert not backend.is_ready("paint_flat")


def test_without_a_compiler_nothing_is_brought_in(renderer, scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "raytracer.kernels", None)  # importing it is an ImportError
    monkeypatch.setattr(backend, "_fault", "")  # which is remembered no longer than this test lasts
    assert not worker.bring_in_kernels(answer(renderer, Request(scene, "diffuse", SIZE)))


def test_a_mistake_while_loading_is_kept_and_reported(renderer, scene, monkeypatch):
    def broken(seen):
        raise ZeroDivisionError

    monkeypatch.setattr(worker, "bring_in_kernels", broken)
    answer(renderer, Request(scene, "diffuse", SIZE))
    renderer.get_faster()
    wait_until(lambda: isinstance(renderer.failure, ZeroDivisionError))


def test_closing_ends_the_thread(renderer):
    renderer.close()
    renderer.join(10)
    assert not renderer._thread.is_alive()


def turned(request: Request, right: int) -> Request:
    return replace(request, orbit=HOME.pulled(right, 10))


def expected(request: Request) -> np.ndarray:
    scene = seen_from(interpreter(request.path), request.orbit)
    return render_scene(scene, request.stage, request.size, request.size, method=request.method)


def slowly(seconds: float) -> Callable[..., np.ndarray]:
    """Drawing that takes so long for a picture in full, and less for fewer pixels."""

    def draw_slowly(plan, **more):
        end = time.monotonic() + seconds * (plan.raster.width / SIZE) ** 2
        while time.monotonic() < end:
            time.sleep(0.001)
            if more["cancelled"]():
                raise Cancelled
        return draw(plan, **more)

    return draw_slowly


@pytest.mark.parametrize("stage", ["diffuse", "error"])
def test_at_rest_the_picture_is_what_render_scene_draws_with_that_camera(renderer, scene, stage):
    request = Request(scene, stage, SIZE)
    answer(renderer, request)
    for right in (3, 6, 9):
        renderer.post(turned(request, right))
    last = turned(request, 9)
    wait_until(lambda: renderer.drawing.request == last and renderer.drawing.full and not renderer.drawing.moving)
    drawing = renderer.drawing
    assert np.array_equal(drawing.picture, expected(last))
    assert stage == "error" or not np.array_equal(drawing.picture, expected(request))
    assert drawing.scene == seen_from(interpreter(scene), last.orbit)
    assert drawing.wrong == (0 if stage == "error" else None)
    assert renderer.whole is drawing


def test_home_again_is_the_files_own_scene(renderer, scene):
    first = answer(renderer, Request(scene, "diffuse", SIZE))
    answer(renderer, turned(first.request, 5))
    assert answer(renderer, first.request).scene is first.scene


def test_while_it_moves_it_is_coarse_and_at_rest_in_full(renderer, scene, monkeypatch):
    monkeypatch.setattr(worker, "draw", slowly(0.2))
    request = Request(scene, "normal", SIZE)
    answer(renderer, request)
    frames = [answer(renderer, turned(request, right)) for right in range(1, 6)]
    for frame in frames:
        assert frame.moving
        assert frame.coarse > 1
        small = -(-SIZE // frame.coarse)
        assert np.array_equal(frame.picture, enlarged(expected(replace(frame.request, size=small)), SIZE))
        assert not frame.full
    wait_until(lambda: renderer.drawing.full)
    assert not renderer.drawing.moving
    assert np.array_equal(renderer.drawing.picture, expected(frames[-1].request))


def test_frames_that_are_fast_enough_are_drawn_once(renderer, scene, monkeypatch):
    monkeypatch.setattr(pace, "BUDGET", np.inf)
    request = Request(scene, "hit", SIZE)
    answer(renderer, request)
    frame = answer(renderer, turned(request, 1))
    wait_until(lambda: not renderer.drawing.moving)
    assert renderer.drawing.picture is frame.picture


def test_frames_that_get_slow_get_coarse(renderer, scene, monkeypatch):
    """Also where the picture in full has never been drawn as slowly."""
    request = Request(scene, "hit", SIZE)
    answer(renderer, request)
    monkeypatch.setattr(worker, "draw", slowly(0.2))
    coarse = [answer(renderer, turned(request, right)).coarse for right in range(1, 12)]
    assert coarse[-1] > 1


def test_another_stage_has_another_pace(renderer, scene, monkeypatch):
    request = Request(scene, "hit", SIZE)
    answer(renderer, request)
    answer(renderer, turned(request, 1))
    monkeypatch.setattr(worker, "draw", slowly(0.2))
    other = answer(renderer, Request(scene, "normal", SIZE))
    assert answer(renderer, turned(other.request, 1)).coarse > 1


def test_frames_are_seen_however_fast_the_mouse_is(renderer, scene, monkeypatch):
    """Giving up each frame for the next one would leave nothing to be seen."""
    monkeypatch.setattr(worker, "draw", slowly(1))
    request, seen = Request(scene, "hit", SIZE), set()
    answer(renderer, replace(request, readings=1))
    end, right = time.monotonic() + 10, 0
    while len(seen) < 5:
        assert time.monotonic() < end
        right += 1
        renderer.post(turned(replace(request, readings=1), right))
        time.sleep(0.002)
        if renderer.drawing.moving:
            seen.add(renderer.drawing.request.orbit)


def test_another_stage_does_not_wait_for_a_frame(renderer, scene, monkeypatch):
    started = threading.Event()

    def draw_for_ever(plan, cancelled, out=None, **more):
        started.set()
        while not cancelled():
            time.sleep(0.001)
        raise Cancelled

    request = Request(scene, "hit", SIZE)
    answer(renderer, request)
    with monkeypatch.context() as patch:
        patch.setattr(worker, "draw", draw_for_ever)
        renderer.post(turned(request, 1))
        assert started.wait(10)
    other = answer(renderer, replace(turned(request, 1), stage="normal"))
    assert not other.moving
    assert np.array_equal(other.picture, expected(other.request))


def test_a_new_scene_is_no_movement(renderer, scene, tmp_path):
    other = tmp_path / "other.cli"
    other.write_text(SPHERE.replace("-4", "-6"))
    answer(renderer, turned(Request(scene, "hit", SIZE), 5))
    drawing = answer(renderer, Request(other, "hit", SIZE))
    assert not drawing.moving
    assert np.array_equal(drawing.picture, expected(drawing.request))


def test_the_file_that_is_read_again_is_turned_about_its_own_middle(renderer, scene):
    request = turned(Request(scene, "normal", SIZE), 90)
    answer(renderer, request)
    scene.write_text(SPHERE.replace("sphere 1 0 0 -4", "sphere 1 2 0 -8"))
    drawing = answer(renderer, replace(request, readings=1))
    assert np.array_equal(drawing.picture, expected(request))


def test_the_path_that_drew_is_told(renderer, scene):
    drawing = answer(renderer, Request(scene, "hit", SIZE))
    assert drawing.path == ("numpy" if backend.loaded() in (None, plain) else "compiled")
