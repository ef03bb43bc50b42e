"""A hundred thousand inputs that nobody would write, and scenes with numbers that nobody would choose."""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random

import fuzz_interpreter
import fuzz_renders
import numpy as np
import pytest
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st

from raytracer import SceneError, backend, make_plan, plain
from raytracer.interpreter import interpret
from raytracer.render import draw

FUZZ = Path(__file__).parent / "fuzz.py"
both_paths = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
SURFACE = b"surface 1 1 1 0 0 0 0 0 0 1 0\n"


@both_paths
def test_only_scene_errors_come_out_of_a_hundred_thousand_inputs():
    random, outcomes = Random(1), {True: 0, False: 0}
    with fuzz_interpreter.small_blocks():
        for number in range(100_000):
            text = fuzz_interpreter.text_of(random)
            try:
                found = fuzz_interpreter.check(text)
            except Exception as error:
                raise AssertionError(f"input {number}: {text!r}") from error
            outcomes[isinstance(found, SceneError)] += 1
    assert min(outcomes.values()) > 20_000


@both_paths
@settings(max_examples=100, suppress_health_check=list(HealthCheck))
@given(st.randoms(use_true_random=False))
def test_only_scene_errors_come_out_of_what_hypothesis_chooses(random):
    text = fuzz_interpreter.text_of(random)
    note(repr(text))
    fuzz_interpreter.check(text)


@both_paths
@pytest.mark.parametrize("word", [b"18446744073709551616", b"36893488147419103232", b"184467440737095516160"])
def test_a_number_that_becomes_0_in_64_bits_is_read(word):
    fuzz_interpreter.check(SURFACE + b"sphere 1 2 3 " + word + b"\n")


@pytest.mark.parametrize("text", [b"\r#\n", b"\r# sphere 1 2 3 4\n", b"sphere 1 2 3 4\r#\n", b"sphere 1 2 3 4 #\r\n"])
@both_paths
def test_a_return_before_a_comment_is_no_end_of_a_line(text):
    fuzz_interpreter.check(SURFACE + text)


@both_paths
def test_of_equally_near_shapes_in_a_mirror_both_paths_show_the_same():
    """Three triangles in one place, in a mirror: which is seen must not depend on the tree."""
    corners = "begin\nvertex -1 -2 -1\nvertex 2 2 -2\nvertex 1 -1 1\nend\n"
    balls = "".join(f"sphere {r} {x} {y} -3\n" for r, x, y in ((1, 1, -1), (1.5, -1, 1), (0.5, -2, -2)))
    colours = ("1 0 0", "0 1 0", "0 0 1")
    text = "fov 60\nlight 3 1 5 1 1 1\nsurface .3 .3 .3 0 0 0 0 0 0 1 1\n" + balls
    text += "".join(f"surface {c} {c} 0 0 0 1 0\n{corners}" for c in colours)
    scene = interpret(text + f"surface .2 .2 .2 .9 .9 0 0 0 0 1 0\n{corners}" + balls.replace("-3", "3"))
    pictures = [draw(make_plan(scene, "full", 40, 30, path=path)) for path in (backend.load(), plain)]
    np.testing.assert_array_equal(*pictures)


@both_paths
def test_every_way_of_drawing_draws_the_same_bytes():
    random, drawn = Random(3), 0
    while drawn < 16:
        drawn += fuzz_renders.drawn_alike(random)


BEYOND = {
    "a hit too near for a float64": """fov 1e-300\neye 1e-125 1e-119 1e-119\nsphere 1e-118 0 0 0""",
    "a direction too long for its square": """fov 1e-300\neye 1e+77 78948632718.75578 1.0
uvw 1 -2 -3 1 -3 1 -3 -1 -1\nsphere 3.5572477461415454e-16 -2.0 1e+100 3.0""",
    "a normal beyond float64": """fov 1e-06\nuvw 1.2e118 1e150 .2 1e50 1 2 9007199254740992 1.8e307 1e50
sphere 1e300 1 9007199254740992 -1e154""",
    "shapes too small for their squares": """fov 90\neye 1e-214 0 -3e-214\nlight 3e-214 0 -2e-214 .25 .25 0
sphere 1 3e-214 2e-214 -1e-214\nsphere 1e-214 2e-214 2e-214 1e-214\nsphere 2e-214 3e-214 0 -2e-214""",
    "shapes too large for their squares": """fov 90\neye 5e-324 -1.7 -1\nlight -2 -1.7 5.5 .8 .3 .8
sphere 4 1.6e238 4.8 3.2\nsphere 1.4e154 3.6 1.4e154 3\nsphere 1.2e140 1.6e238 4.8 3.2""",
}


@both_paths
@pytest.mark.parametrize("text", BEYOND.values(), ids=BEYOND)
def test_what_is_beyond_float64_is_drawn_alike(text):
    fuzz_renders.check(interpret("surface .5 1 .8 .25 0 .25 .5 .2 1 2 .7\n" + text), Random(1))


def test_the_command_says_how_many_failed():
    done = subprocess.run([sys.executable, FUZZ, "interpreter", "--inputs", "300"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "300 inputs, seed 1: 0 failures\n")


def test_atheris_runs():
    if os.environ.get("REQUIRE_OPTIONAL") != "1" and not importlib.util.find_spec("atheris"):
        pytest.skip("atheris is not installed")
    command = [sys.executable, FUZZ, "interpreter", "--inputs", "300", "--engine", "atheris"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, "Done 300 runs" in done.stderr) == (0, True)


HASHES = """
import hashlib, sys
from pathlib import Path
from random import Random
sys.path.append(sys.argv[1])
import fuzz_renders
from raytracer import STAGES, backend, interpreter, kernels, make_plan
from raytracer.render import draw

backend.load()
scenes = [interpreter(path) for path in sorted(Path(sys.argv[2]).rglob("*.cli"))]
scenes += [scene for k in range(30) if (scene := fuzz_renders.read(fuzz_renders.scene_of(Random(k)))) is not None]
print(kernels.TILE_WIDTH, kernels.TILE_HEIGHT)
for scene in scenes:
    for stage in STAGES:
        print(hashlib.sha256(draw(make_plan(scene, stage, 150, 131, path=kernels)).tobytes()).hexdigest())
"""


@pytest.mark.slow
@both_paths
@pytest.mark.parametrize("wide", [4, 5])
def test_other_tiles_draw_the_same_bytes(wide, tmp_path):
    """Tiles of 16 x 32 and of 32 x 16 pixels in place of 128 x 32: the kernels are compiled anew for them."""
    root = FUZZ.parent.parent
    shutil.copytree(root / "raytracer", tmp_path / "raytracer", ignore=shutil.ignore_patterns("__pycache__"))
    bounds = tmp_path / "raytracer" / "kernels" / "bounds.py"
    text = bounds.read_text()
    assert "_WIDE, _HIGH = 7, 5" in text
    bounds.write_text(text.replace("_WIDE, _HIGH = 7, 5", f"_WIDE, _HIGH = {wide}, {9 - wide}"))
    here, there = (
        subprocess.run(
            [sys.executable, "-c", HASHES, FUZZ.parent, root / "scenes"],
            cwd=folder, env={**os.environ, "PYTHONPATH": str(folder)}, capture_output=True, text=True, check=True,
        ).stdout.splitlines()
        for folder in (root, tmp_path)
    )  # fmt: skip
    assert (here[0], there[0]) == ("128 32", f"{1 << wide} {1 << 9 - wide}")
    assert here[1:] == there[1:]
