"""The window under keys for a long time: `python tests/window/soak.py`, on an X server of its own.

Thousands of scene and stage changes by real key events, most of them faster than pictures are drawn. Now and then the
picture is waited for, and compared byte for byte. It ends with 1 if the window hangs, shows another picture, does not
end with 0, or grows by more than 5 % after the first fifth.
"""

from __future__ import annotations

import argparse
import random
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

import numpy as np
import psutil

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent.parent)]

from conftest import run_display  # noqa: E402
from window_driver import PROJECT, Sketch  # noqa: E402

from raytracer import STAGES, interpreter, render_scene  # noqa: E402
from sketch.controls import SCENE_KEYS  # noqa: E402
from sketch.overlay import Layout, Status, compose  # noqa: E402

SCENES = sorted((PROJECT / "scenes").glob("*.cli"))
SIZE = 330
MOST_GROWTH = 0.05
SAVES = 15
BURST = 40  # keys that are pressed without a look at the picture
NAMES = {"-": "minus"}  # as xdotool calls keys


@dataclass(frozen=True)
class Outcome:
    changes: int
    longest_wait: float  # seconds from a single key to its picture
    median_wait: float
    growth: float  # of the memory, after the first fifth
    megabytes: float
    status: int

    def __str__(self) -> str:
        return (
            f"{self.changes} changes; from a key to its picture {self.median_wait:.3f} s, at most"
            f" {self.longest_wait:.3f} s; memory {self.megabytes:.0f} MB, {self.growth:+.1%} after the first fifth;"
            f" exit status {self.status}"
        )


@cache
def expected(place: int, stage: str) -> np.ndarray:
    picture = render_scene(interpreter(SCENES[place]), stage, SIZE, SIZE)
    return compose(Layout(SIZE), picture, Status("", "", ""), legend=STAGES[stage].legend)[:SIZE]


def keys(changes: int, seed: int) -> Iterator[tuple[str, int, str]]:
    """Keys that change the scene or the stage, and what is seen after each."""
    rng, place, stage = random.Random(seed), 0, "diffuse"
    for _ in range(changes):
        key = rng.choice([*SCENE_KEYS, *(row.key for row in STAGES.values())])
        if key in SCENE_KEYS:
            place = SCENE_KEYS.index(key)
        else:
            stage = next(name for name, row in STAGES.items() if row.key == key)
        yield key, place, stage


def soak(display: str, folder: Path, changes: int, seed: int = 1) -> Outcome:
    """Press keys in bursts; the last one of each is waited for."""
    sketch = Sketch(display, folder, "--size", SIZE)
    try:
        return _soaked(sketch.find_window(), changes, seed)
    finally:
        sketch.process.kill()


def _soaked(sketch: Sketch, changes: int, seed: int) -> Outcome:
    process, waits, memory = psutil.Process(sketch.process.pid), [], []
    script = list(keys(changes, seed))
    for start in range(0, changes, BURST):
        *burst, (key, place, stage) = script[start : start + BURST]
        if burst:
            sketch.xdotool("key", "--delay", "4", *(NAMES.get(each, each) for each, _, _ in burst))
            sketch.wait_for_picture(expected(*burst[-1][1:]), f"the picture after {start + len(burst)} keys")
        picture, begin = expected(place, stage), time.perf_counter()
        sketch.press(NAMES.get(key, key))
        sketch.wait_for_picture(picture, f"the picture after {start + len(burst) + 1} keys")
        waits.append(time.perf_counter() - begin)
        memory.append(process.memory_info().rss)
    sketch.press("Escape")
    early = max(memory[: max(1, len(memory) // 5)])
    return Outcome(
        changes, max(waits), float(np.median(waits)), max(memory[-3:]) / early - 1, memory[-1] / 1e6, sketch.end()
    )


def saves(display: str, folder: Path, count: int) -> dict[str, list[float]]:
    """Seconds from saving a scene, and from saving a plugged stage, to the picture of it."""
    scene, stage = folder / "scene.cli", folder / "stage.py"
    scene.write_text(SCENES[3].read_text())
    stage.write_text(resources.files("raytracer").joinpath("templates", "stage.py").read_text("utf-8"))
    waits = {}
    for file, plug in ((scene, []), (stage, ["--plug", stage])):
        sketch = Sketch(display, folder, scene, "--size", SIZE, *plug)
        try:
            waits[file.name] = [_saved(sketch.find_window(), scene, file, k) for k in range(count)]
        finally:
            sketch.process.kill()
            sketch.process.wait()
    return waits


def _saved(sketch: Sketch, scene: Path, file: Path, k: int) -> float:
    """Give the background another colour, in the scene or in the stage."""
    red, text = (k + 1) % 16, file.read_text()
    found = r"background \S+ \S+ \S+" if file == scene else r"elsewhere=.*\)"
    colour = f"background {red / 255} 0 0" if file == scene else f"elsewhere=({red / 255}, 0, 0))"
    sketch.wait_until(lambda: np.ptp(sketch.picture(SIZE)) > 0, "a picture")
    time.sleep(1.0)  # as people are slower than that
    begin = time.perf_counter()
    file.write_text(re.sub(found, colour, text))
    sketch.wait_until(lambda: (sketch.picture(SIZE)[:3] == [red, 0, 0]).all(), "the picture of what was saved")
    return time.perf_counter() - begin


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--changes", type=int, default=10_000, help="of scene or stage, default 10000")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with run_display() as display, tempfile.TemporaryDirectory() as folder:
        outcome = soak(display, Path(folder), arguments.changes, arguments.seed)
        print(outcome)  # noqa: T201 (a command)
        for name, waits in saves(display, Path(folder), SAVES).items():
            print(f"from saving {name} to its picture {np.median(waits):.3f} s, at most {max(waits):.3f} s")  # noqa: T201
    return int(outcome.status != 0 or outcome.growth > MOST_GROWTH)


if __name__ == "__main__":
    sys.exit(main())
