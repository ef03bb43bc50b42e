"""Files of one's own in place of the tracer's parts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from raytracer import STAGES, Cancelled, eye_hits, interpreter, render_scene
from raytracer.__main__ import TEMPLATES, main
from raytracer.interpreter import interpret
from raytracer.plug import PARTS, Order, Plug, PlugError, draw_plugged, load_plug
from raytracer.plug_process import MOST_LINES, PlugRunner, echo

SCENES = Path(__file__).parent.parent / "scenes"
SPHERES, TRIANGLES = (interpreter(SCENES / f"{name}.cli") for name in ("02_three_spheres", "07_colorful_lights"))
SIZE = 32


def template(kind: str) -> str:
    return resources.files("raytracer").joinpath("templates", f"{kind}.py").read_text("utf-8")


def plugged(folder: Path, source: str) -> Plug:
    file = folder / "mine.py"
    file.write_text(source)
    return load_plug(file)


@pytest.mark.parametrize("kind", TEMPLATES)
@pytest.mark.parametrize("scene", [SPHERES, TRIANGLES], ids=["spheres", "triangles"])
def test_a_template_as_it_is_printed_draws_the_reference(kind, scene, tmp_path, capsys):
    assert main(["template", kind]) == 0
    plug = plugged(tmp_path, capsys.readouterr().out)
    found = draw_plugged(plug, Order(scene, plug.stage, SIZE, SIZE - 5))
    expected = render_scene(scene, plug.stage, SIZE, SIZE - 5)
    assert np.abs(found.astype(int) - expected).max() <= 1
    assert len(np.unique(found.reshape(-1, 3), axis=0)) > 1


@pytest.mark.parametrize("stage", STAGES)
def test_hits_of_ones_own_serve_every_stage(stage, tmp_path):
    plug = plugged(tmp_path, template("tracer"))
    found = draw_plugged(plug, Order(SPHERES, stage, SIZE, SIZE)) if plug.parts_of(stage) else None
    assert (found is None) == (stage == "cost")  # which shoots no ray
    if found is not None and stage != "error":  # whose colours tell the last digits of t
        assert np.abs(found.astype(int) - render_scene(SPHERES, stage, SIZE, SIZE)).max() <= 1


def test_each_function_has_its_effect_alone(tmp_path):
    reference = render_scene(SPHERES, "diffuse", SIZE, SIZE)
    sources = {
        "eye_ray": "def eye_ray(camera, x, y, width, height): return [0, 0, 1]",
        "intersect": "def intersect(ray, sphere): return None",
        "intersect_triangle": "def intersect_triangle(ray, triangle): return 1.0",
        "shade": "def shade(hit): return 0, 1, 0",
        "stage": "def stage(block): return block.paint((1.0, 0.0, 0.0), (0, 0, 0))",
        "method": "def method(origin, direction, centre, r): return float('inf')",
        "render_scene": "def render_scene(scene, width, height): return [[(0, 0, 1)] * width] * height",
    }
    assert sources.keys() == PARTS.keys()
    background = np.array([102, 102, 230])
    for name, source in sources.items():
        found = draw_plugged(plugged(tmp_path, source), Order(SPHERES, "diffuse", SIZE, SIZE))
        if name == "intersect_triangle":  # of which there are none
            assert np.array_equal(found, reference)
        elif name in ("eye_ray", "intersect", "method"):
            assert (found == background).all()
        else:
            only = {"shade": [0, 255, 0], "stage": [255, 0, 0], "render_scene": [0, 0, 255]}[name]
            assert (found[SIZE // 2, SIZE // 2] == only).all()
            assert (render_scene(SPHERES, "normal", SIZE, SIZE) == normals_by(tmp_path / "mine.py")).all()


def normals_by(path: Path) -> np.ndarray:
    """A part of one stage has none in another."""
    plug = load_plug(path)
    assert plug.parts_of("normal") == ()
    return draw_plugged(plug, Order(SPHERES, "normal", SIZE, SIZE))


def test_true_and_false_are_hits_and_misses(tmp_path):
    plug = plugged(tmp_path, "import numpy\ndef intersect(ray, sphere): return numpy.bool_(sphere.centre[0] < 0.5)")
    found = draw_plugged(plug, Order(SPHERES, "hit", SIZE, SIZE))
    assert (found == [204, 51, 77]).all()
    plug = plugged(tmp_path, "def intersect(ray, sphere): return False")
    assert (draw_plugged(plug, Order(SPHERES, "hit", SIZE, SIZE)) == [102, 102, 230]).all()


def test_of_equal_t_the_first_shape_wins(tmp_path):
    plug = plugged(tmp_path, "def intersect(ray, sphere): return 2.0\ndef shade(hit): return hit.material.diffuse")
    found = draw_plugged(plug, Order(SPHERES, "diffuse", SIZE, SIZE))
    assert (found == [0, 128, 0]).all()


def test_a_shade_can_trace_on(tmp_path):
    """Shadows: the square is dark where the ball stands between it and the first light."""
    plug = plugged(
        tmp_path,
        "def shade(hit):\n"
        "    start = [p + 1e-6 * n for p, n in zip(hit.point, hit.normal)]\n"
        "    beyond = hit.trace(start, [q - p for q, p in zip(hit.lights[0].position, start)])\n"
        "    return (1, 1, 1) if beyond is None or beyond.t > 1 else (0, 0, 0)\n",
    )
    light = "light 0 10 -6  1 1 1\n"
    surface = "surface 1 1 1  0 0 0  0 0 0  1 0\n"
    square = "begin\nvertex -9 -1 0\nvertex 9 -1 0\nvertex 0 -1 -30\nend\n"
    scene = interpret(f"{light}{surface}{square}sphere 1 0 1 -6\n")
    found = draw_plugged(plug, Order(scene, "diffuse", 60, 60))
    ground = eye_hits(scene, 60, 60).index == 0
    dark = (found == 0).all(axis=2) & ground
    assert 20 < dark.sum() < ground.sum() / 2
    assert abs(np.argwhere(dark)[:, 1].mean() - 30) < 1


FAULTS = {
    "def intersect(ray, sphere):\n    return ray.orgin": (2, 12, "AttributeError"),
    "def shade(hit):\n    return 1 / 0": (2, 12, "ZeroDivisionError: division by zero, drawing diffuse"),
    "def shade(hit):\n    return (1, 2": (2, 12, "SyntaxError"),
    "def shade(hit): return 3": (1, None, "shade returned 3, expected a colour, three numbers from 0 to 1"),
    "\n\ndef intersect(ray, sphere): return 'x'": (3, None, "intersect returned 'x', expected t"),
    "def eye_ray(camera, x, y, width, height): return [1, 2]": (1, None, "eye_ray returned [1, 2], expected a dir"),
    "import numpy\ndef stage(block): return numpy.zeros(5)": (2, None, "stage returned float64 (5,), expected colours"),
    "def render_scene(scene, width, height): return [[0]]": (1, None, "expected (32, 32, 3)"),
    "def render_scene(scene, width, height): return None": (1, None, "render_scene returned"),
    "def method(origin, direction, centre, r): return [1, 2]": (1, None, "method returned [1, 2], expected t"),
    "def intersect(ray): return 1": (1, None, "found intersect(ray), expected intersect(ray, sphere)"),
    "def intersct(ray, sphere): return 1": (None, None, "did you mean intersect by intersct?"),
    "x = 1": (None, None, "found no function, expected one or more of"),
    "STAGE = 'matt'\ndef shade(hit): return 0, 0, 0": (None, None, "found STAGE = 'matt', expected one of hit"),
    "import sys\ndef shade(hit): sys.exit(3)": (2, 17, "SystemExit: 3"),
    "import nothing_of_the_kind": (1, 1, "ModuleNotFoundError"),
    "raise ValueError('a\\nb')": (1, 1, "ValueError: a b"),
    "def shade(hit): return shade(hit)": (1, 24, "RecursionError"),
    "# -*- coding: utf8x -*-": (None, None, "SyntaxError: unknown encoding: utf8x"),
    "def shade(hit): hit.t = 3": (1, 17, "FrozenInstanceError"),
    "def shade(hit): return ('ééé', 1 / 0)": (1, 32, "ZeroDivisionError"),
    "import functools\nshade = functools.partial(print)": (None, None, "the function returned None, expected a colour"),
    "\0": (None, None, "source code string cannot contain null bytes"),
}


@pytest.mark.parametrize("source", FAULTS)
def test_a_fault_is_told_with_its_place(source, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # as people do
    line, column, message = FAULTS[source]
    with pytest.raises(PlugError) as caught:
        draw_plugged(plugged(tmp_path, source), Order(SPHERES, "diffuse", SIZE, SIZE))
    fault = caught.value
    assert message in fault.message
    assert "\n" not in str(fault)
    assert fault.path == tmp_path / "mine.py"
    if line is not None:
        assert (fault.line, fault.column) == (line, column)
        quote = fault.quote()
        assert quote is not None
        assert quote[0] == source.split("\n")[line - 1]
        assert fault.report().splitlines()[2].index("^") == 2 + (0 if column is None else column - 1)


def test_a_fault_in_a_module_beside_the_file_is_told_with_that_place(tmp_path):
    (tmp_path / "vectors_of_mine.py").write_text("def dot(a, b):\n    return a.x\n")
    plug = plugged(tmp_path, "from vectors_of_mine import dot\ndef shade(hit):\n    return dot(hit.point, hit.point)\n")
    with pytest.raises(PlugError) as caught:
        draw_plugged(plug, Order(SPHERES, "diffuse", SIZE, SIZE))
    assert (caught.value.path.name, caught.value.line) == ("vectors_of_mine.py", 2)


# ------------------------------------------------------------------------------------------ in a process of its own


def run(folder: Path, source: str, patience: float = 60.0, **options: object):
    """What a runner draws of a file, and what the file has printed."""
    file, said = folder / "mine.py", []
    file.write_text(source)
    runner = PlugRunner(file, patience, said.append)
    try:
        return (*runner.draw(Order(SPHERES, "diffuse", SIZE, SIZE), **options), said)
    finally:
        runner.close()


def test_a_process_draws_the_same_and_tells_how_far_it_has_come(tmp_path):
    news: list[tuple[np.ndarray, float]] = []
    slow = template("tracer").replace("    colour = [0", "    __import__('time').sleep(0.002)\n    colour = [0", 1)
    found, names, _, _ = run(tmp_path, slow, tell=lambda picture, done: news.append((picture, done)))
    assert names == ("eye_ray", "intersect", "shade")
    assert np.array_equal(found, draw_plugged(load_plug(tmp_path / "mine.py"), Order(SPHERES, "diffuse", SIZE, SIZE)))
    parts = [done for _, done in news]
    assert len(parts) > 2
    assert parts == sorted(parts)
    assert (news[0][0] == found).mean() > 0.3  # coarse


def test_what_hangs_is_given_up(tmp_path):
    with pytest.raises(PlugError, match="no sign of life for 1 seconds: given up"):
        run(tmp_path, "def shade(hit):\n    while True: print('on and on')", patience=1)


def test_what_crashes_is_told(tmp_path):
    with pytest.raises(PlugError, match="ended before it was done: killed by SIGSEGV"):
        run(tmp_path, "import os\ndef shade(hit): os.kill(os.getpid(), 11)")


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is the system's")
def test_what_eats_memory_is_told(tmp_path):
    with pytest.raises(PlugError, match=r":3:\d+: MemoryError"):
        run(tmp_path, "import numpy; kept = []\ndef shade(hit):\n    while True: kept.append(numpy.empty(1 << 27))")


def test_prints_are_passed_on_but_not_a_million(tmp_path):
    _, _, _, said = run(tmp_path, "for k in range(1_000_000): print(k)\ndef shade(hit): return 0, 0, 0")
    assert said[:3] == ["0", "1", "2"]
    assert len(said) == MOST_LINES + 1
    assert "the rest is left out" in said[-1]


def test_a_last_line_without_an_end_is_shown_and_so_are_errors_of_ones_own(tmp_path):
    source = "import sys\nprint('a', file=sys.stderr)\nprint('b', end='')\ndef shade(hit): return 0, 0, 0"
    assert run(tmp_path, source)[3] == ["a", "b"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_file_that_starts_processes_is_ended_with_them(tmp_path):
    started = tmp_path / "started"
    source = (
        "import os, time\n"
        f"if os.fork() == 0: open({str(started)!r}, 'w').write(str(os.getpid())); time.sleep(1000)\n"
        "time.sleep(1000)\n"
    )
    with pytest.raises(Cancelled):
        run(tmp_path, source, cancelled=lambda: started.exists() and bool(started.read_text()))
    end = time.monotonic() + 20
    while _is_alive(int(started.read_text())):
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_limit_of_the_systems_that_is_lower_is_kept(tmp_path):
    (tmp_path / "mine.py").write_text(template("tracer"))
    command = ("-m", "raytracer", "render", SCENES / "01_one_sphere.cli", "-o", tmp_path / "x.png", "--size", "16")
    resource = pytest.importorskip("resource")
    done = subprocess.run(
        [sys.executable, *map(str, command), "--plug", tmp_path / "mine.py"],
        cwd=Path(__file__).parent.parent, capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30)),
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


def test_a_module_beside_the_file_is_one_of_its_files(tmp_path):
    (tmp_path / "beside_mine.py").write_text("GREEN = 0, 1, 0\n")
    (tmp_path / "mine.py").write_text("import json\nfrom beside_mine import GREEN\ndef shade(hit): return GREEN")
    runner = PlugRunner(tmp_path / "mine.py")
    runner.draw(Order(SPHERES, "diffuse", SIZE, SIZE))
    assert set(runner.files) == {tmp_path / "mine.py", tmp_path / "beside_mine.py"}
    assert not (tmp_path / "__pycache__").exists()


def test_anything_that_is_printed_can_be_written(capsys, monkeypatch):
    echo("ümlaut \ud800")
    assert capsys.readouterr().out == "ümlaut \\ud800\n"
    monkeypatch.setattr(sys, "stdout", None)
    echo("nobody reads")


@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_template_survives_the_shells_of_windows(kind, tmp_path):
    assert template(kind).isascii()
    (tmp_path / "mine.py").write_bytes(template(kind).encode("utf-16"))
    assert load_plug(tmp_path / "mine.py").functions


def test_asking_for_input_is_a_fault(tmp_path):
    with pytest.raises(PlugError, match="EOFError"):
        run(tmp_path, "def shade(hit): return input()")


def test_a_picture_that_is_not_wanted_any_more_is_given_up(tmp_path):
    start = time.monotonic()
    with pytest.raises(Cancelled):
        run(tmp_path, "import time\ntime.sleep(60)", cancelled=lambda: time.monotonic() > start + 0.2)


def test_no_process_outlives_the_one_that_started_it(tmp_path):
    (tmp_path / "mine.py").write_text("import os\nprint(os.getpid(), flush=True)\nwhile True: pass\n")
    render = ("render", SCENES / "01_one_sphere.cli", "-o", tmp_path / "x.png", "--plug", tmp_path / "mine.py")
    root = Path(__file__).parent.parent
    with subprocess.Popen(
        [sys.executable, "-m", "raytracer", *map(str, render)], cwd=root, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        child = int(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20
    while _is_alive(child):
        assert time.monotonic() < end
        time.sleep(0.05)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    stat = Path(f"/proc/{pid}/stat")
    return not (stat.exists() and stat.read_text().split()[2] == "Z")  # nobody has asked for its status yet


def test_the_command_renders_by_a_file(tmp_path, capsys):
    (tmp_path / "mine.py").write_text("def shade(hit):\n    return 0, 1, 0\n")
    out = tmp_path / "x.png"
    command = ["render", str(SCENES / "01_one_sphere.cli"), "-o", str(out), "--plug", str(tmp_path / "mine.py")]
    assert main([*command, "--size", "32"]) == 0
    assert out.exists()
    (tmp_path / "mine.py").write_text("def shade(hit):\n    return 0, 1, hit.colour\n")
    assert main(command) == 1
    error = capsys.readouterr().err.splitlines()
    assert error[0].startswith(f"{tmp_path / 'mine.py'}:2:18: AttributeError")
    assert error[1:] == ["      return 0, 1, hit.colour", "                   ^"]


def test_a_file_that_is_not_there_is_an_argument_that_is_wrong(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["render", "x.cli", "-o", "x.png", "--plug", "nowhere.py"])
    assert caught.value.code == 2
    assert "found 'nowhere.py', which is no file" in capsys.readouterr().err
