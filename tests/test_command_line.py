"""`python -m raytracer`, as a user runs it."""

import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
import time
from pathlib import Path

import numpy as np
import pytest

from raytracer import STAGES, interpreter, load_png, render_scene

ROOT = Path(__file__).parent.parent
SCENE = ROOT / "scenes" / "04_many_spheres.cli"


def run(*words, **options):
    command = [sys.executable, "-m", "raytracer", *map(str, words)]
    options = {"timeout": 120, **options}
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, **options)


def start_render(out, size, method="certified", **options):
    """A large picture, being drawn."""
    command = [sys.executable, "-m", "raytracer", "render", str(SCENE), "-o", str(out), "--size", size]
    command += ["--method", method]
    return subprocess.Popen(command, cwd=ROOT, **options)


def test_render_writes_what_render_scene_draws(tmp_path):
    out = tmp_path / "out.png"
    done = run(
        "render", SCENE, "-o", out, "--stage", "normal", "--size", "64x48", "--sampling", "centre", "--threads", "2"
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    np.testing.assert_array_equal(load_png(out), render_scene(interpreter(SCENE), "normal", 64, 48, sampling="centre"))


def test_check_prints_a_line_for_each_error(tmp_path):
    bad = tmp_path / "bad.cli"
    bad.write_text("eye 0 0 0\nspere 1 0 0 0\n")
    done = run("check", SCENE, bad, tmp_path, tmp_path / "missing.cli")
    lines = done.stdout.splitlines()
    assert done.returncode == 1
    assert len(lines) == 3
    assert lines[0].startswith(f"{bad}:2:1: ")
    assert "did you mean 'sphere'?" in lines[0]
    assert run("check", SCENE).returncode == 0


def test_explain_prints_the_plan():
    done = run("explain", SCENE, "--stage", "hit")
    assert done.returncode == 0
    assert "7 spheres" in done.stdout
    assert "no point, no normal" in done.stdout


def test_help_names_every_command_and_stage():
    text = run("--help").stdout
    for word in ("render", "check", "explain", *STAGES):
        assert word in text
    assert "default" in run("render", "--help").stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "COMMAND"),
        (["render", SCENE], "-o"),
        (["render", SCENE, "-o", "x.png", "--size", "big"], "expected WIDTHxHEIGHT"),
        (["render", SCENE, "-o", "x.png", "--size", "0x5"], "found '0x5', expected WIDTHxHEIGHT"),
        (["inspect", SCENE, "1", "1", "--size", "5x-3"], "found '5x-3', expected WIDTHxHEIGHT"),
        (["render", SCENE, "-o", "x.jpg"], "x.jpg: found suffix '.jpg', expected .png or .exr"),
        (["render", SCENE, "-o", "x"], "x: found no suffix, expected .png or .exr"),
        (["turntable", SCENE, "-o", "x.avi"], "x.avi: found suffix '.avi', expected .gif or .mp4 or a folder"),
        (["test", SCENE], "expected a file in Python, whose name ends in .py"),
        (["render", SCENE, "-o", "x.png", "--plug", SCENE], "expected a file in Python, whose name ends in .py"),
        (["render", SCENE, "-o", "x.png", "--stage", "none"], "invalid choice"),
        (["render", SCENE, "-o", "x.png", "--threads", "0"], "1 or more"),
    ],
)
def test_wrong_arguments_give_status_2(words, message):
    done = run(*words)
    assert done.returncode == 2
    assert message in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["missing.cli", "-o", "OUT"], "missing.cli: "),
        ([".", "-o", "OUT"], "found no readable file"),
        ([SCENE, "-o", "no/folder/x.png"], "no/folder: no such folder"),
        ([SCENE, "-o", "."], "a folder, expected a file"),
        ([SCENE, "-o", "OUT", "--size", "3000000x3000000"], "250 hours or more"),
        ([SCENE, "-o", "OUT", "--size", "524288x524288", "--samples", "4"], "takes 1.1e+12 rays"),
        ([SCENE, "-o", "OUT", "--size", "2147483647x9"], "GB of memory are free"),
        ([SCENE, "-o", "OUT.exr", "--cluster", "local:2"], "drawn at once, expected a .png"),
        ([SCENE, "-o", "OUT", "--size", "9" * 400 + "x1"], "a side of more than"),
    ],
)
def test_bad_input_gives_one_line_and_status_1(words, message, tmp_path):
    out = tmp_path / "out.png"
    words = [word.replace("OUT.", f"{tmp_path}/out.") if isinstance(word, str) else word for word in words]
    done = run("render", *[out if word == "OUT" else word for word in words], timeout=10)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_killed_run_leaves_the_old_file(tmp_path):
    out = tmp_path / "out.png"
    out.write_bytes(b"old")
    process = start_render(out, "3000x3000")
    time.sleep(0.6)
    process.send_signal(signal.SIGKILL)
    process.wait(10)
    assert out.read_bytes() == b"old"


def test_ctrl_c_ends_quietly(tmp_path):
    for size, left in (("8000x8000", []), ("60000x60000", [".parts"])):  # of a large one, what is finished
        process = start_render(tmp_path / "x.png", size, stderr=subprocess.PIPE, text=True)
        time.sleep(2 if not left else 5)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 130
        assert [path.suffix for path in tmp_path.iterdir()] == left
        kept = "".join(
            f"drawn in 938 bands, which are kept in {path} until all are there\n" for path in tmp_path.iterdir()
        )
        assert errors == kept


def test_a_long_picture_shows_its_progress_on_a_terminal(tmp_path):
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    process = start_render(tmp_path / "x.png", "4000x4000", "double_double", stderr=theirs)
    os.close(theirs)
    shown = b""
    try:
        while chunk := os.read(ours, 1024):
            shown += chunk
    except OSError:  # how a terminal says that nobody writes any more
        pass
    assert process.wait(60) == 0
    assert b"bands" in shown
