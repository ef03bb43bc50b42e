"""Pictures in bands: the bytes of the whole, whoever draws them, whatever happens meanwhile."""

import os
import resource
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import replace
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from optional import optional
from pngs import read_png
from test_trace import PATHS

from raytracer import STAGES, Camera, PictureTooLargeError, Scene, Stage, interpreter, load_png, tiled
from raytracer.crew import Crew, CrewError, open_crew
from raytracer.image import Depth
from raytracer.measure import _pose, pose
from raytracer.plan import make_plan
from raytracer.render import draw
from raytracer.samples import draw_samples
from raytracer.tiled import Cargo, Picture, draw_large

ROOT = Path(__file__).parent.parent
SPHERES = interpreter(ROOT / "scenes" / "04_many_spheres.cli")
MIRRORS = interpreter(ROOT / "scenes" / "09_mirror_spheres.cli")
STAR = interpreter(ROOT / "scenes" / "11_star.cli")
TANGENT = interpreter(next((ROOT / "scenes" / "hard").glob("*tangent*.cli")))
HUGE = interpreter(next((ROOT / "scenes" / "hard").glob("*huge*.cli")))  # counted in a unit of its own


@pytest.fixture
def small_bands(monkeypatch):
    """Bands of 64 rows of a picture 100 pixels wide."""
    monkeypatch.setattr(tiled, "_BAND_PIXELS", 6400)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("stage", STAGES)
@given(first=st.integers(1, 60), second=st.integers(1, 60), sampling=st.sampled_from(["corner", "centre"]))
@settings(max_examples=4)
def test_rows_drawn_on_their_own_are_those_of_the_picture(path, stage, first, second, sampling):
    """But for stages that look beyond their rows, of which more below."""
    if STAGES[stage].needs_whole:
        return
    for scene, method in ((SPHERES, "certified"), (TANGENT, "certified"), (STAR, "certified"), (TANGENT, "haines32")):
        if stage == "full" and (method != "certified" or path == "numpy"):
            continue
        size = stage, 41, 61, sampling, method, PATHS[path]
        cuts = sorted({0, first, second, 61})
        parts = [draw(make_plan(scene, *size, rows=slice(a, b))) for a, b in pairwise(cuts)]
        np.testing.assert_array_equal(np.concatenate(parts), draw(make_plan(scene, *size)))


@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("depth", [Depth.BYTE, Depth.WORD])
def test_a_picture_in_bands_is_the_picture(stage, depth, tmp_path, small_bands):
    for scene in (SPHERES, STAR, HUGE):
        picture = Picture(Cargo(scene), stage, 100, 150, depth=depth)
        assert len(picture.starts) == 3
        with open_crew(threads=2) as crew:
            draw_large(picture, tmp_path / "x.png", crew)
        np.testing.assert_array_equal(read_png(tmp_path / "x.png"), draw(picture.plan()))
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


@pytest.mark.parametrize("samples", [4, 64, "adaptive"])
def test_samples_too(samples, tmp_path, small_bands):
    picture = Picture(Cargo(MIRRORS), "full", 100, 150, samples=samples)
    with open_crew() as crew:
        draw_large(picture, tmp_path / "x.png", crew)
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw_samples(picture.plan(), samples))


def test_other_processes_draw_the_same(tmp_path, small_bands):
    picture = Picture(Cargo(SPHERES), "depth", 100, 300)
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        crew = Crew(executor, lambda: 2)
        draw_large(picture, tmp_path / "x.png", crew)
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(picture.plan()))
    assert crew.tally.jobs == 2 * len(picture.starts)
    assert 0 < crew.tally.efficiency <= 1
    assert str(os.getpid()) not in {name.split(":")[1] for name in crew.tally.names}


def test_a_worker_that_takes_its_executor_with_it_leaves_the_finished_bands(tmp_path, small_bands):
    picture, seen = Picture(Cargo(SPHERES), "diffuse", 100, 640), []
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        crew = Crew(executor, lambda: 1)

        def shoot(done, total, rows):
            seen.append(done)
            if done == 2:
                os.kill(next(iter(executor._processes)), signal.SIGKILL)

        with pytest.raises(CrewError, match="a worker has died"):
            draw_large(picture, tmp_path / "x.png", crew, shoot)
    assert not (tmp_path / "x.png").exists()
    with open_crew() as crew:
        draw_large(picture, tmp_path / "x.png", crew)
    assert crew.tally.jobs <= len(picture.starts) - 2
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(picture.plan()))


class Quitter(Executor):
    """Does so many jobs, then is interrupted."""

    def __init__(self, jobs):
        self.left = jobs

    def submit(self, work, *words):
        future = Future()
        if self.left == 0:
            future.set_exception(KeyboardInterrupt())
        else:
            self.left -= 1
            future.set_result(work(*words))
        return future


@pytest.mark.parametrize("stage", ["hit", "depth"])
def test_whoever_is_interrupted_goes_on(stage, tmp_path, small_bands):
    picture, out = Picture(Cargo(SPHERES), stage, 100, 640), tmp_path / "x.png"
    out.write_bytes(b"old")
    for jobs in (0, 3, 4):
        with pytest.raises(KeyboardInterrupt):
            draw_large(picture, out, Crew(Quitter(jobs), lambda: 1))
        assert out.read_bytes() == b"old"
        assert len(list(tmp_path.iterdir())) == (1 if jobs == 0 else 2)
    seen, crew = [], Crew(Quitter(-1), lambda: 1)
    draw_large(picture, out, crew, lambda done, total, rows: seen.append((done, total)))
    total = len(picture.starts) * (2 if stage == "depth" else 1)
    assert crew.tally.jobs == total - 7
    assert seen == [(k, total) for k in range(1, total + 1)]
    np.testing.assert_array_equal(load_png(out), draw(picture.plan()))
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


def test_what_is_kept_belongs_to_one_picture():
    picture = Picture(Cargo(SPHERES))
    others = [
        Picture(Cargo(MIRRORS)), Picture(Cargo(replace(SPHERES, background=(0.5, 0.0, 0.0)))),
        *(replace(picture, **change) for change in (
            {"stage": "full"}, {"width": 321}, {"height": 321}, {"sampling": "centre"}, {"method": "haines"},
            {"samples": 4}, {"depth": Depth.WORD}, {"camera": Camera(fov=61.0)},
        )),
    ]  # fmt: skip
    assert len({each.digest for each in [picture, *others]}) == 1 + len(others)
    program = (
        "from raytracer import interpreter, render_scene; from raytracer.tiled import Cargo, Picture\n"
        "scene = interpreter('scenes/04_many_spheres.cli'); render_scene(scene, 'full', 9, 9)\n"
        "print(Picture(Cargo(scene)).digest)"
    )
    there = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert there.stdout.strip() == picture.digest


def test_another_version_is_refused(tmp_path, monkeypatch):
    part = tiled.Part(Picture(Cargo(SPHERES)), slice(0, 4), None, "another")
    with pytest.raises(ValueError, match="another version of raytracer"):
        tiled.draw_part(part)


def test_a_stage_that_looks_anywhere_is_refused(tmp_path):
    stage = Stage("", lambda block: None, "looks anywhere", needs_whole=True)
    with open_crew() as crew, pytest.raises(ValueError, match="looks at the whole picture"):
        draw_large(Picture(Cargo(SPHERES), stage), tmp_path / "x.png", crew)


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ((2**19, 2**19), "GB on disk or more; .* GB are free"),
        ((2**31 - 1, 4), "GB to draw; .* GB of memory are free"),
        ((2**19, 2**19 + 1), "takes 2.75e.11 rays, 8 hours or more at 10 million a second; expected 2.75e.11 at most"),
        ((3 * 10**6, 3 * 10**6), "takes 9e.12 rays, 250 hours or more"),
    ],
)
def test_what_does_not_fit_is_refused_with_the_figures(size, message, tmp_path, monkeypatch):
    monkeypatch.setattr(tiled, "disk_left", lambda path: 10**8)
    with open_crew() as crew, pytest.raises(PictureTooLargeError, match=message):
        draw_large(Picture(Cargo(SPHERES), "hit", *size), tmp_path / "x.png", crew)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("samples", [1, 256, "adaptive"])
@pytest.mark.parametrize("width", [1 << 19, 5000, 3])
def test_the_largest_picture_begins_at_once(width, samples, tmp_path, monkeypatch):
    """Whatever its shape: its bands are few enough, and are named one by one."""
    monkeypatch.setattr(tiled, "disk_left", lambda path: 10**15)
    rays = Picture(Cargo(SPHERES), samples=samples).rays_a_pixel
    picture = Picture(Cargo(SPHERES), "hit", width, min((1 << 38) // rays // width, 2**31 - 1), samples=samples)
    told, start = [], time.process_time()
    monkeypatch.setattr(tiled, "draw_part", lambda part: b"")
    with pytest.raises(KeyboardInterrupt):
        draw_large(picture, tmp_path / "x.png", Crew(Quitter(1), lambda: 1), begun=lambda *words: told.append(words))
    assert time.process_time() - start < 1
    assert told == [(len(picture.starts), tmp_path / f"x.png-{picture.digest}.parts")]
    assert len(picture.starts) <= 1 << 17
    assert [path.name for path in told[0][1].iterdir()] == ["band-0000000000"]


def test_a_scene_that_is_unpickled_is_as_good_as_new():
    for scene in (SPHERES, STAR, Scene()):
        again = Cargo(scene).__reduce__()[0](*Cargo(scene).__reduce__()[1]).scene
        assert again == scene
        assert not len(again.spheres) or again.spheres.balls.ctypes.data % 64 == 0
        assert not again.spheres.balls.flags.writeable
        np.testing.assert_array_equal(draw(make_plan(again, "full", 30, 30)), draw(make_plan(scene, "full", 30, 30)))


# ---------------------------------------------------------------------------------------------------- many processes


@pytest.fixture(scope="module")
def cluster():
    optional("distributed")
    with open_crew("local:2") as crew:
        yield crew


def fresh(crew):
    """The same workers, nothing counted yet."""
    return Crew(crew.executor, crew.workers)


@pytest.mark.parametrize("stage", ["full", "depth", "edges"])
def test_two_workers_of_a_cluster_draw_the_same(cluster, stage, tmp_path, small_bands):
    picture, crew = Picture(Cargo(STAR), stage, 100, 640), fresh(cluster)
    draw_large(picture, tmp_path / "x.png", crew)
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(picture.plan()))
    assert crew.tally.workers == 2
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


def test_a_worker_that_is_killed_loses_nothing(cluster, tmp_path, small_bands):
    picture, crew = Picture(Cargo(SPHERES), "diffuse", 100, 2560), fresh(cluster)

    def shoot(done, total, rows):
        if done == 5:
            os.kill(int(next(iter(crew.tally.names)).split(":")[1]), signal.SIGKILL)

    draw_large(picture, tmp_path / "x.png", crew, shoot)
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(picture.plan()))
    assert crew.tally.jobs == len(picture.starts) == 40


def test_a_client_that_comes_back_has_nothing_drawn_twice(cluster, tmp_path, small_bands):
    picture, kept = Picture(Cargo(SPHERES), "normal", 100, 1280), []

    def leave(done, total, rows):
        if done == 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        draw_large(picture, tmp_path / "x.png", fresh(cluster), leave)
    (folder,) = tmp_path.iterdir()
    kept = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    assert len(kept) >= 6
    crew = fresh(cluster)
    draw_large(picture, tmp_path / "x.png", crew)
    assert crew.tally.jobs == len(picture.starts) - len(kept)
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(picture.plan()))


def test_the_truth_of_the_charts_rays_is_worked_out_by_others(cluster):
    found = dict(fresh(cluster).work(_pose, [("tangent", 128), ("tied", 64)]))
    for (family, rays), problem in found.items():
        np.testing.assert_array_equal(problem.t, pose(family, rays).t)
        np.testing.assert_array_equal(problem.index, pose(family, rays).index)


def render(*words, **options):
    command = [sys.executable, "-m", "raytracer", "render", "scenes/04_many_spheres.cli", *map(str, words)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False, **options)


def test_the_command_draws_by_a_cluster_and_says_how_busy_it_was(tmp_path):
    optional("distributed")
    done = render("-o", tmp_path / "x.png", "--size", "200x100", "--cluster", "local:2")
    assert done.returncode == 0, done.stderr
    assert "by 2 workers: busy for" in done.stderr
    assert done.stderr.count("\n") == 1
    np.testing.assert_array_equal(load_png(tmp_path / "x.png"), draw(make_plan(SPHERES, "diffuse", 200, 100)))


@pytest.mark.parametrize(("address", "message"), [("local:0", "expected local:N"), ("local:x", "expected local:N")])
def test_a_wrong_cluster_is_one_line(address, message, tmp_path):
    optional("distributed")
    done = render("-o", tmp_path / "x.png", "--cluster", address)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_distributed_the_command_says_what_brings_it(tmp_path):
    (tmp_path / "distributed.py").write_text("raise ImportError")
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    done = render("-o", tmp_path / "x.png", "--cluster", "local:2", env={**os.environ, "PYTHONPATH": path})
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "pip install distributed" in done.stderr


@pytest.mark.slow
def test_a_gigapixel_fits_2_gb(tmp_path):
    done = render("-o", tmp_path / "x.png", "--size", "32768x32768", "--stage", "depth")
    assert done.returncode == 0, done.stderr
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 2_000_000  # kilobytes
