"""Films of the camera going once round."""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from multiprocessing import get_context

import numpy as np
import pytest
from optional import optional
from PIL import Image
from test_tiled import Quitter

from raytracer import interpreter, load_png, render_scene
from raytracer.crew import Crew, open_crew
from raytracer.orbit import pivot_of
from raytracer.tiled import Cargo, Picture
from raytracer.turntable import film

SPHERES = interpreter("scenes/04_many_spheres.cli")
STAR = interpreter("scenes/11_star.cli")
SMALL = Picture(Cargo(SPHERES), "diffuse", 48, 32)


def make(picture, path, frames=6):
    seen = []
    with open_crew() as crew:
        film(picture, path, frames, crew, lambda done, total, rows: seen.append((done, total)))
    assert seen == [(k, frames) for k in range(1, frames + 1)]


def test_a_folder_of_frames(tmp_path):
    make(SMALL, tmp_path / "frames")
    assert [path.name for path in tmp_path.iterdir()] == ["frames"]
    names = sorted(path.name for path in (tmp_path / "frames").iterdir())
    assert names == [f"frame-{k:04}.png" for k in range(1, 7)]
    pictures = [load_png(tmp_path / "frames" / name) for name in names]
    np.testing.assert_array_equal(pictures[0], render_scene(SPHERES, "diffuse", 48, 32))
    assert all((a != b).any() for a, b in pairwise(pictures))


def test_the_camera_goes_once_round_at_one_distance_and_height():
    from raytracer.turntable import _views

    eyes = np.array([view.camera.eye for view in _views(SMALL, 8)])
    arms = eyes - pivot_of(SPHERES)
    up = np.array(SPHERES.camera.v) / np.linalg.norm(SPHERES.camera.v)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), np.linalg.norm(arms[0]))
    np.testing.assert_allclose(arms @ up, arms[0] @ up, atol=1e-12)
    steps = np.linalg.norm(np.roll(eyes, -1, axis=0) - eyes, axis=1)
    np.testing.assert_allclose(steps, steps[0])
    right = np.array(SPHERES.camera.u)
    assert (eyes[1] - eyes[0]) @ right > 0 > (eyes[-1] - eyes[0]) @ right
    np.testing.assert_allclose(eyes[4] - pivot_of(SPHERES) + arms[0], 2 * (arms[0] @ up) * up, atol=1e-12)


def test_a_gif(tmp_path):
    make(SMALL, tmp_path / "x.gif")
    with Image.open(tmp_path / "x.gif") as image:
        assert (image.n_frames, image.size, image.info["duration"], image.info["loop"]) == (6, (48, 32), 40, 0)
        first = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(first - render_scene(SPHERES, "diffuse", 48, 32)).mean() < 8
    assert [path.name for path in tmp_path.iterdir()] == ["x.gif"]


def test_an_mp4(tmp_path):
    ffmpeg = optional("imageio_ffmpeg")
    make(SMALL, tmp_path / "x.mp4")
    frames = ffmpeg.read_frames(str(tmp_path / "x.mp4"))
    about, pictures = next(frames), [np.frombuffer(frame, np.uint8).reshape(32, 48, 3) for frame in frames]
    assert (about["size"], about["fps"], len(pictures)) == ((48, 32), 25, 6)
    assert np.abs(pictures[0].astype(int) - render_scene(SPHERES, "diffuse", 48, 32)).mean() < 12
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]


def test_other_processes_draw_the_same_frames(tmp_path):
    picture = Picture(Cargo(STAR), "full", 40, 30, samples="adaptive")
    make(picture, tmp_path / "here", 4)
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        film(picture, tmp_path / "there", 4, Crew(executor, lambda: 2))
    for path in (tmp_path / "here").iterdir():
        assert path.read_bytes() == (tmp_path / "there" / path.name).read_bytes()


def test_whoever_is_interrupted_goes_on_with_the_film(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        film(SMALL, tmp_path / "x.gif", 6, Crew(Quitter(4), lambda: 1))
    assert [path.suffix for path in tmp_path.iterdir()] == [".parts"]
    crew = Crew(Quitter(-1), lambda: 1)
    film(SMALL, tmp_path / "x.gif", 6, crew)
    assert crew.tally.jobs == 2
    assert [path.name for path in tmp_path.iterdir()] == ["x.gif"]


@pytest.mark.parametrize(
    ("name", "size", "message"),
    [("x.avi", (8, 8), "found suffix '.avi', expected .gif or .mp4 or a folder"), ("x.gif", (0, 8), "0 x 8 pixels"),
     ("full", (8, 8), "is there already, expected an empty folder or none"),
     ("x.mp4", (9, 8), "expected even numbers")],
)  # fmt: skip
def test_what_cannot_be_is_said_before_anything_is_drawn(name, size, message, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    with open_crew() as crew, pytest.raises(ValueError, match=message):
        film(Picture(Cargo(SPHERES), "hit", *size), tmp_path / name, 3, crew)
    assert os.listdir(tmp_path) == ["full"]  # noqa: PTH208
    assert crew.tally.jobs == 0


def test_without_imageio_ffmpeg_the_message_says_what_brings_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with open_crew() as crew, pytest.raises(ValueError, match="pip install imageio-ffmpeg"):
        film(SMALL, tmp_path / "x.mp4", 3, crew)
