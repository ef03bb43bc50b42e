"""What is too large is refused before it is tried; what is only strange takes no longer than its length; no way out."""

import subprocess
import sys
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest

from raytracer import SceneError
from raytracer.interpreter import LONGEST_LINE, MOST_LIGHTS, interpret, interpreter

reader = import_module("raytracer.interpreter")
ROOT = Path(__file__).parent.parent
SURFACE = "surface 1 1 1 0 0 0 0 0 0 1 0\n"


def test_a_file_too_large_for_memory_is_refused_with_the_figures(tmp_path):
    path = tmp_path / "huge.cli"
    with path.open("wb") as file:
        file.truncate(1 << 43)  # a hole: it takes no room
    start = time.perf_counter()
    with pytest.raises(SceneError, match=r"found a file of 8.8e\+03 GB, which takes .* GB of memory are free"):
        interpreter(path)
    assert time.perf_counter() - start < 5


def test_lights_have_a_limit():
    line = "light 1 1 1 1 1 1\n"
    assert len(interpret(line * MOST_LIGHTS).lights) == MOST_LIGHTS
    with pytest.raises(
        SceneError, match=f":{MOST_LIGHTS + 1}:1: found one more 'light', expected {MOST_LIGHTS} at most"
    ):
        interpret(line * (MOST_LIGHTS + 1))


WIDE = {
    "one word": lambda n: "x" * n,
    "one number": lambda n: "fov " + "9" * n,
    "one fraction": lambda n: "fov ." + "9" * n,
    "zeros": lambda n: "fov 9." + "0" * n,
    "an exponent": lambda n: "fov 1e" + "9" * n,
    "underscores": lambda n: "fov 1" + "_1" * (n // 2),
    "blanks": lambda n: "fov" + " " * n + "9",
    "words": lambda n: "fov" + " 9" * (n // 2),
    "a comment": lambda n: "fov 9 #" + "#" * n,
    "empty lines": lambda n: "\n" * n + "fov 9",
    "returns": lambda n: "\r" * n + "fov 9",
    "begins": lambda n: SURFACE + "begin\n" * (n // 6),
    "vertices": lambda n: SURFACE + "begin\n" + "vertex 1 2 3\n" * (n // 13),
    "renders": lambda n: "render\n" * (n // 7),
    "comments": lambda n: "#\n" * (n // 2) + "fov 9",
}


@pytest.mark.parametrize("text", WIDE.values(), ids=WIDE)
def test_strange_files_take_time_by_their_length(text):
    """Whether the time for four times the length is far from sixteen times as long; a million digits are refused."""

    def seconds(length):
        source, times = text(length), []
        for _ in range(3):
            start = time.process_time()
            with suppress(SceneError):
                interpret(source)
            times.append(time.process_time() - start)
        return min(times)

    assert seconds(LONGEST_LINE - 50) < 0.5
    assert seconds(1_200_000) < 8 * seconds(300_000) + 0.02


def test_a_line_of_a_hundred_megabytes_is_refused_at_once(tmp_path):
    path = tmp_path / "line.cli"
    with path.open("wb") as file:
        for _ in range(100):
            file.write(b"1" * 1_000_000)
    start = time.process_time()
    with pytest.raises(SceneError, match=f":1:1: found a line of more than {LONGEST_LINE} bytes"):
        interpreter(path)
    assert time.process_time() - start < 0.5


WATCHED = """
import sys
sys.path[:0] = [{tests!r}, {root!r}]
from random import Random
import fuzz_interpreter, fuzz_renders
from raytracer import SceneError, backend, interpreter, machine_code, render_scene
backend.load()
render_scene(interpreter({first!r}), "full", 8, 8)
seen = []

def watch(event, arguments):
    if event.startswith(("open", "os.", "subprocess", "socket", "shutil", "exec", "ctypes.dlopen", "import")):
        own = event == "open" and isinstance(arguments[0], int)  # a file that is open already, as "os.open" has told
        if not own:
            seen.append((event, str(arguments[0]) if arguments else ""))

random, scenes = Random(5), 0
texts = [fuzz_interpreter.text_of(random) for _ in range(1000)]
texts += [fuzz_renders.scene_of(random).encode() for _ in range(9)]
sys.addaudithook(watch)
for text in texts:
    with open({scene!r}, "wb") as file:
        file.write(text)
    try:
        render_scene(interpreter({scene!r}), "full", 5, 4)
        scenes += 1
    except SceneError:
        pass
    except ValueError:
        pass
kept = str(machine_code.folder())
others = {{s for s in seen if s[1] != {scene!r} and kept not in s[1]}}
others = {{s for s in others if s[0] not in ("import", "exec") and not s[1].endswith((".py", ".pyc"))}}
print(scenes > 150, sorted(others))
"""


def test_a_scene_file_opens_nothing_and_starts_nothing(tmp_path):
    """Of what Python tells of: files opened, written, removed, processes, sockets. No command is for any of it."""
    scene = tmp_path / "scene.cli"
    program = WATCHED.format(
        tests=str(ROOT / "tests"), root=str(ROOT), scene=str(scene), first=str(ROOT / "scenes/11_star.cli")
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    assert (done.stdout, done.stderr) == ("True []\n", "")
