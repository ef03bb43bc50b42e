"""What may know what: checked in a fresh process, where nothing else has been imported."""

import re
import subprocess
import sys
from pathlib import Path

from raytracer.machine_code import SOURCES

ROOT = Path(__file__).parent.parent

# Runs one kernel, which says where a ray meets a sphere.
A_KERNEL = (
    "from raytracer.kernels import polish; from raytracer.camera import twofold_given_rays; import numpy as np;"
    "ray, ball = twofold_given_rays(np.array([[0.0, 0.0, -1.0]])), np.array([[0.0, 0.0, -5.0, 3.0]]);"
    "print(polish(np.zeros((1, 3)), ray, ball, (np.full(1, np.nan), np.zeros(1), np.zeros(1)))[0])"
)


def in_a_fresh_process(code):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_the_tracer_loads_neither_the_compiler_nor_java():
    code = "import sys, raytracer; print(sorted({'numba', 'py5', 'jpype', 'PIL', 'matplotlib'} & set(sys.modules)))"
    assert in_a_fresh_process(code) == "[]\n"


def test_the_oracle_imports_nothing_that_it_judges():
    code = (
        "import sys; before = set(sys.modules); import raytracer.exact as exact; import inspect, re;"
        "print(re.findall(r'^(?:from|import) (\\S+)', inspect.getsource(exact), re.M))"
    )
    found = in_a_fresh_process(code)
    assert "raytracer" not in found
    assert "numpy" not in found


def test_without_numba_the_numpy_path_draws_the_same_picture():
    code = (
        "import sys; sys.modules['numba'] = None\n"
        "from raytracer import interpreter, render_scene, make_plan, backend, plain\n"
        "scene = interpreter('scenes/04_many_spheres.cli')\n"
        "backend._spent = 1e9\n"
        "plan = make_plan(scene)\n"
        "assert plan.path is plain\n"
        "print(plan.warnings)\n"
        "print(render_scene(scene, width=64, height=64).tobytes().hex())\n"
    )
    warnings, found = in_a_fresh_process(code).splitlines()
    assert "numba is not installed" in warnings
    compiled = "from raytracer import *; from raytracer import backend; backend.load()\n"
    compiled += "print(render_scene(interpreter('scenes/04_many_spheres.cli'), width=64, height=64).tobytes().hex())"
    assert in_a_fresh_process(compiled).strip() == found


def test_a_changed_source_does_not_run_stale_machine_code(tmp_path):
    """numba looks at the kernel's own file only; the formulas that it compiles stand in others."""
    code = (
        "import shutil, sys, pathlib, subprocess\n"
        f"copy = pathlib.Path({str(tmp_path)!r})\n"
        "shutil.copytree('raytracer', copy / 'raytracer', ignore=shutil.ignore_patterns('__pycache__'))\n"
        f"run = [sys.executable, '-c', {A_KERNEL!r}]\n"
        "first = subprocess.run(run, cwd=copy, capture_output=True, text=True).stdout\n"
        "source = copy / 'raytracer' / 'certified.py'\n"
        "text = source.read_text()\n"
        "wrong = text.replace('add(square, square_low, -r2, -r2_low)', 'square, square_low')\n"
        "source.write_text(wrong)\n"
        "print(first.strip(), subprocess.run(run, cwd=copy, capture_output=True, text=True).stdout.strip())\n"
    )
    assert in_a_fresh_process(code) == "2.0 inf\n"


def test_kernels_take_nothing_from_files_that_their_machine_code_is_not_named_after():
    texts = [path.read_text() for path in (ROOT / "raytracer" / "kernels").glob("*.py")]
    taken = {name for text in texts for name in re.findall(r"^from raytracer\.(\w+) import", text, re.MULTILINE)}
    assert "quick" in taken
    assert taken - {"kernels"} <= set(SOURCES)


def test_a_compiler_that_cannot_be_loaded_is_told_of_and_done_without(tmp_path):
    (tmp_path / "numba").mkdir()
    (tmp_path / "numba" / "__init__.py").write_text("raise ImportError('Numba needs another NumPy')")
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "from raytracer import backend, interpreter, make_plan, plain\n"
        "assert backend.load() is plain\n"
        "print(make_plan(interpreter('scenes/01_one_sphere.cli')).warnings)\n"
    )
    assert "numba cannot be loaded (Numba needs another NumPy)" in in_a_fresh_process(code)


def test_machine_code_is_kept_elsewhere_where_the_package_cannot_be_written_to(tmp_path):
    code = (
        "import pathlib\n"
        "mkdir = pathlib.Path.mkdir\n"
        "def refuse(self, *rest, **more):\n"
        "    if 'kernels' in self.parts: raise PermissionError\n"
        "    mkdir(self, *rest, **more)\n"
        "pathlib.Path.mkdir = refuse\n"
        f"pathlib.Path.expanduser = lambda self: pathlib.Path({str(tmp_path)!r})\n" + A_KERNEL + "\n"
        f"print(len(list(pathlib.Path({str(tmp_path)!r}).rglob('*.nbi'))) > 0)\n"
    )
    assert in_a_fresh_process(code) == "2.0\nTrue\n"


def test_machine_code_is_found_again_by_the_next_process():
    code = (
        "import raytracer.kernels as kernels\n"
        "from raytracer import interpreter, make_plan\n"
        "from raytracer.render import draw\n"
        "draw(make_plan(interpreter('scenes/01_one_sphere.cli'), 'hit', 9, 9, path=kernels))\n"
        "print(sum(kernels.paint_flat.stats.cache_misses.values()))\n"
    )
    in_a_fresh_process(code)
    assert in_a_fresh_process(code) == "0\n"
