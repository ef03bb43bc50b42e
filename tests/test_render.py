"""Pictures: the stages' colours, the plan's reasons, threads, progress, cancelling, files."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from strategies import scenes as any_scene

from raytracer import (
    STAGES,
    Camera,
    Cancelled,
    Scene,
    backend,
    eye_hits,
    interpreter,
    load_png,
    make_plan,
    plain,
    render_scene,
    save_png,
    screen,
)
from raytracer.image import to_bytes
from raytracer.interpreter import interpret
from raytracer.render import open_tracer
from raytracer.stages import Block, Stage

SURFACE = "surface .5 .25 1 0 0 0 0 0 0 1 0\n"
ONE = interpret("background .4 .4 .9\nlight 0 4 5 1 1 1\n" + SURFACE + "sphere 1 0 0 -4")


def colours(picture):
    return {tuple(pixel) for pixel in picture.reshape(-1, 3).tolist()}


def test_hit_is_the_dummy_colour_and_the_background():
    picture = render_scene(ONE, "hit", 40, 40)
    assert colours(picture) == {(204, 51, 77), (102, 102, 230)}
    np.testing.assert_array_equal((picture == (204, 51, 77)).all(axis=2), eye_hits(ONE, 40, 40).index == 0)


def test_outline_is_black_on_the_background_or_on_white_where_that_is_too_dark():
    assert colours(render_scene(ONE, "outline", 40, 40)) == {(0, 0, 0), (102, 102, 230)}
    dark = interpret("background .05 0 .1\n" + SURFACE + "sphere 1 0 0 -4")
    assert colours(render_scene(dark, "outline", 40, 40)) == {(0, 0, 0), (255, 255, 255)}


def test_normal_faces_the_eye_in_the_middle():
    assert render_scene(ONE, "normal", 40, 40)[20, 20].tolist() == [128, 128, 255]


def test_depth_falls_from_white_to_grey_whatever_the_number_of_bands():
    far = interpret(SURFACE + "sphere 1 0 -1 -4\nsphere 1 0 9 -30")
    picture = render_scene(far, "depth", 3, 2000)[..., 0]
    t = eye_hits(far, 3, 2000).t
    assert picture[t == np.inf].max() == 0
    hit = t < np.inf
    order = np.argsort(t[hit], kind="stable")
    assert (np.diff(picture[hit][order].astype(int)) <= 0).all()
    assert picture[hit].max() == 255
    assert picture[hit].min() == round(0.15 * 255)


def bands_of(plan):
    with open_tracer(plan) as tracer:
        return tracer.bands(plan.shading)


def test_edges_lie_where_the_shape_changes_also_between_bands():
    picture = render_scene(ONE, "edges", 1200, 90)
    index = eye_hits(ONE, 1200, 90).index
    edge = np.zeros(index.shape, bool)
    edge[:, :-1] |= index[:, :-1] != index[:, 1:]
    edge[:-1] |= index[:-1] != index[1:]
    np.testing.assert_array_equal(picture[..., 0] == 0, edge)
    assert len(bands_of(make_plan(ONE, "edges", 1200, 90))) > 1


def test_diffuse_adds_lights_and_has_no_shadows_or_ambient():
    lights = ["light 0 0 0 1 1 1\n", "light 0 5 -4 .5 .5 .5\n"]
    surface = "surface .5 .25 1 .9 .9 .9 .9 .9 .9 5 .5\n"
    single = [render_scene(interpret(light + surface + "sphere 1 0 0 -4"), width=32, height=32) for light in lights]
    both = render_scene(interpret("".join(lights) + surface + "sphere 1 0 0 -4\nsphere 1 0 0 6"), width=32, height=32)
    assert np.abs(sum(picture.astype(int) for picture in single) - both).max() <= 1
    assert single[0][16, 16].tolist() == [128, 64, 255]


def test_a_light_on_the_very_point_adds_nothing_and_one_inside_lights_nothing():
    touching = interpret("light 0 0 -3 1 1 1\n" + SURFACE + "sphere 1 0 0 -4")
    assert render_scene(touching, width=2, height=2).max() == 0


def test_bytes_are_rounded_and_clipped():
    assert to_bytes(np.array([-1.0, 0.0, 0.5 / 255, 0.4999 / 255, 1.0, 7.0])).tolist() == [0, 0, 1, 0, 255, 255]


@pytest.mark.parametrize("stage", STAGES)
def test_threads_bands_and_reused_pictures_change_nothing(stage, monkeypatch):
    scene = interpreter("scenes/04_many_spheres.cli")
    expected = render_scene(scene, stage, 50, 40, threads=1)
    monkeypatch.setattr("raytracer.camera.BAND_PIXELS", 150)
    out = np.full((40, 50, 4), 7, np.uint8)
    assert render_scene(scene, stage, 50, 40, threads=3, out=out[..., :3]).base is out
    np.testing.assert_array_equal(out[..., :3], expected)
    assert (out[..., 3] == 7).all()


def test_progress_counts_all_bands_and_cancelling_ends_the_picture(monkeypatch):
    seen = []
    render_scene(ONE, "hit", 2000, 100, progress=lambda done, total, rows: seen.append((done, total, rows)))
    assert [done for done, _, _ in seen] == list(range(1, seen[0][1] + 1))
    assert sorted(y for _, _, rows in seen for y in range(rows.start, rows.stop)) == list(range(100))
    with pytest.raises(Cancelled):
        render_scene(ONE, "hit", 2000, 100, cancelled=lambda: True)
    asked = threading.Event()
    monkeypatch.setattr(screen, "_PIXELS_A_MOMENT", 1 << 12)
    with pytest.raises(Cancelled):
        render_scene(ONE, "hit", 2000, 2000, progress=lambda *_: asked.set(), cancelled=asked.is_set)


def test_a_stage_of_ones_own_takes_a_function_and_a_row(monkeypatch):
    def checker(block: Block) -> np.ndarray:
        return block.paint(np.floor(block.points * 4) % 2, elsewhere=(0.5, 0.5, 0.5))

    monkeypatch.setitem(STAGES, "checker", Stage("c", checker, "a checkered world"))
    assert colours(render_scene(ONE, "checker", 30, 30)) >= {(0, 0, 0), (128, 128, 128)}


def test_an_error_in_a_stage_reaches_the_caller(monkeypatch):
    monkeypatch.setitem(STAGES, "broken", Stage("b", lambda block: 1 / 0, "divides by zero"))
    with pytest.raises(ZeroDivisionError):
        render_scene(ONE, "broken")


def test_the_plan_gives_its_reasons(monkeypatch):
    why = " | ".join(make_plan(interpreter("scenes/08_reflective_sphere.cli"), "hit").why)
    for words in (
        "no point, no normal",
        "1 light given, not used",
        "specular given, not used",
        "k_refl given, not used",
    ):
        assert words in why
    hidden = interpret("light 1 1 1 0 0 0\nlight 1 1 1 1 1 1\n" + SURFACE + "sphere 1 0 0 -4\nsphere 1 0 0 9")
    plan = make_plan(hidden)
    assert "1 sphere of 2 cannot be seen" in " | ".join(plan.why)
    assert len(plan.lights) == 1
    assert not plan.warnings
    assert "21 shapes:" in " | ".join(make_plan(interpreter("scenes/06_icosahedron_and_sphere.cli")).why)
    monkeypatch.setattr(backend, "why_no_compiler", lambda: "numba is not installed")
    assert "numpy draws the same picture, slowly" in make_plan(ONE).warnings[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("nothing",), "expected one of hit, outline"), (("hit", 0, 5), "0 x 5"), (("hit", 10**7, 10**7), "GB of memory")],
)
def test_bad_requests_are_refused(arguments, message):
    with pytest.raises((ValueError, MemoryError), match=message):
        render_scene(ONE, *arguments)
    with pytest.raises(ValueError, match="expected uint8"):
        render_scene(ONE, "hit", 5, 5, out=np.empty((5, 5, 3)))


def test_small_work_is_done_by_numpy_until_it_has_cost_a_compiler(monkeypatch):
    monkeypatch.setattr(backend, "_loaded", None)
    monkeypatch.setattr(backend, "_spent", 0.0)
    monkeypatch.setattr(backend, "import_kernels", lambda: "compiled")
    assert backend.choose(10**5, 10) is plain
    chosen = [backend.choose(10**6, 10) for _ in range(10)]
    assert chosen == [plain] * 4 + ["compiled"] * 6 or chosen.index("compiled") < 8
    assert backend.choose(1, 1) == "compiled"


@settings(max_examples=20)
@given(any_scene(max_shapes=4))
def test_any_scene_draws(scene: Scene):
    for stage in STAGES:
        assert render_scene(scene, stage, 4, 3, threads=1).shape == (3, 4, 3)


def test_png_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    picture = render_scene(ONE, width=20, height=10)
    path = tmp_path / "one.png"
    save_png(path, picture)
    np.testing.assert_array_equal(load_png(path), picture)
    before = path.read_bytes()

    def full_disk(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full_disk)
    with pytest.raises(OSError, match="No space"):
        save_png(path, picture[::-1])
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_is_followed_and_a_pipe_is_written_to(tmp_path):
    picture = render_scene(ONE, width=20, height=10)
    (tmp_path / "link.png").symlink_to(tmp_path / "real.png")
    save_png(tmp_path / "link.png", picture)
    assert (tmp_path / "link.png").is_symlink()
    np.testing.assert_array_equal(load_png(tmp_path / "real.png"), picture)
    os.mkfifo(tmp_path / "pipe")
    writer = threading.Thread(target=save_png, args=(tmp_path / "pipe", picture))
    writer.start()
    assert (tmp_path / "pipe").read_bytes() == (tmp_path / "real.png").read_bytes()
    writer.join()
    assert (tmp_path / "pipe").is_fifo()


def test_threads_that_save_to_one_place_do_not_meet(tmp_path):
    picture = render_scene(ONE, width=20, height=10)
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: save_png(tmp_path / "one.png", picture), range(60)))
    np.testing.assert_array_equal(load_png(tmp_path / "one.png"), picture)
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (Camera(fov=float("nan")), "fov"),
        (Camera(fov=180.0), "fov"),
        (Camera(eye=(0.0, float("inf"), 0.0)), "not finite"),
        (Camera(u=(0.0, 0.0, 2.0)), "dependent"),
    ],
)
def test_a_camera_that_no_file_could_say_is_refused(camera, message):
    with pytest.raises(ValueError, match=message):
        render_scene(Scene(camera))


def test_sizes_may_be_numpys_integers():
    assert render_scene(ONE, "hit", np.uint8(200), np.int32(7)).shape == (7, 200, 3)


def test_a_picture_whose_pixels_take_long_is_cut_into_thin_bands():
    crowd = interpret(SURFACE + "sphere 1 0 0 -4\n" * 3000)
    assert len(bands_of(make_plan(crowd, "hit", path=plain))) > 12 > len(bands_of(make_plan(ONE, "hit", path=plain)))
    bright = interpret("light 0 4 5 1 1 1\n" * 3000 + SURFACE + "sphere 1 0 0 -4\n")
    assert len(bands_of(make_plan(bright, path=plain))) > 100
