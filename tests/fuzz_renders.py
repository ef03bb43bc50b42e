"""Valid scenes with numbers that nobody would choose, drawn in every way: all ways must give the same bytes, no NaN.

`scene_of(random)` makes the text of a scene of what a `random.Random` says, and `check` draws it at every stage with
the kernels and with numpy, on one thread and on two, in bands of other heights, and by every method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from random import Random

import numpy as np
import pytest

from raytracer import STAGES, Scene, SceneError, backend, camera, plain, screen
from raytracer.interpreter import interpret
from raytracer.methods import CERTIFIED, METHODS
from raytracer.plan import Plan, make_plan
from raytracer.render import block_of, draw, open_tracer, whole_of

SIZES = (
    (9, 7),
    (66, 3),
    (3, 67),
    (17, 11),
    (1, 1),
)  # some reach over a tile's border; few pixels, as the exact are slow
Number = Callable[[Random], float]


# ------------------------------------------------------------------------------------------------------- to make scenes

_EXTREME = (
    0.0, -0.0, 1.0, -1.0, 5e-324, -5e-324, 2.2250738585072014e-308, 1e-200, 1e-160, -1e-154, 1e-100, 1e-30, 1e-16, 0.1,
    1 - 2**-53, 1 + 2**-52, 3.0, 1e8, 2.0**53, 1e16, -1e30, 1e50, 1e77, 1e100, 1e150, -1e154, 1.4e154, 1e200, 1e300,
    -1e308, 1.7976931348623157e308,
)  # fmt: skip


def _usual(random: Random) -> float:
    return random.gauss(0, 3)


def _whole(random: Random) -> float:
    return float(random.randrange(-3, 4))


def _extreme(random: Random) -> float:
    return random.choice(_EXTREME)


def _any_size(random: Random) -> float:
    return random.choice((-1, 1)) * random.uniform(1, 10) * 10.0 ** random.randrange(-323, 308)


def _mixed(random: Random) -> float:
    return random.choice((_usual, _whole, _extreme, _any_size))(random)


def _far(random: Random) -> float:
    return random.choice((1e6, 1e9, 1e12, 1e15)) + random.gauss(0, 3)


def scene_of(random: Random) -> str:
    """The text of a scene; mostly a valid one."""
    length = random.choice((_usual, _usual, _whole, _whole, _extreme, _any_size, _mixed, _far))
    scale = 10.0 ** random.choice((0, 0, 0, random.randrange(-300, 300)))
    light = random.choice((_unit, _unit, _unit, _mixed))
    lines = [
        _line("background", light, light, light, random=random),
        f"fov {random.choice((60, 90, 30, 1e-6, 1e-300, 179.9999, random.uniform(0.1, 179)))!r}",
        *_camera(random, length, scale),
    ]
    points = [[length(random) * scale for _ in range(3)] for _ in range(random.randrange(3, 9))]
    for _ in range(random.randrange(1, 4)):
        where = random.choice((_point(points, random), [length(random) * scale for _ in range(3)]))
        lines.append(" ".join(["light", *map(repr, where), *(repr(light(random)) for _ in range(3))]))
    for _ in range(random.randrange(1, 9)):
        lines += [_surface(random, light), *_shape(random, points, length, scale)]
    return "\n".join(lines) + "\n"


def _unit(random: Random) -> float:
    return random.choice((0.0, 0.25, 0.5, 1.0, random.random()))


def _line(name: str, *numbers: Number, random: Random) -> str:
    return " ".join([name, *(repr(number(random)) for number in numbers)])


def _camera(random: Random, length: Number, scale: float) -> Iterator[str]:
    if random.random() < 0.7:
        yield " ".join(["eye", *(repr(length(random) * scale) for _ in range(3))])
    if random.random() < 0.4:
        number = random.choice((_usual, _whole, _mixed))
        yield _line("uvw", *[number] * 9, random=random)


def _surface(random: Random, light: Number) -> str:
    power = random.choice((0.0, 1.0, 7.0, 20.0, 2.5, 1e9, 1e300, -1.0)) if random.random() < 0.9 else _mixed(random)
    mirror = random.choice((0.0, 0.0, 0.5, 1.0, light(random)))
    return " ".join(["surface", *(repr(light(random)) for _ in range(9)), repr(power), repr(mirror)])


def _point(points: list[list[float]], random: Random) -> list[float]:
    return random.choice(points)


def _shape(random: Random, points: list[list[float]], length: Number, scale: float) -> list[str]:
    if random.random() < 0.5:
        radius = abs(length(random) * scale) or 1.0
        return [" ".join(["sphere", repr(radius), *map(repr, _point(points, random))])]
    corners = random.sample(points, 3) if random.random() < 0.8 else [_point(points, random) for _ in range(3)]
    return ["begin", *(" ".join(["vertex", *map(repr, corner)]) for corner in corners), "end"]


# ------------------------------------------------------------------------------------------------------ to check them


def read(text: str) -> Scene | None:
    """None for what is no scene after all: a flat frame, an infinite number, a triangle without an area."""
    try:
        return interpret(text)
    except SceneError:
        return None


def drawn_alike(random: Random) -> bool:
    """Make a scene and draw it in every way; False if it is none. What goes wrong is told with the scene's text."""
    text = scene_of(random)
    scene = read(text)
    if scene is None:
        return False
    try:
        check(scene, random)
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}\n{text}") from error
    return True


def check(scene: Scene, random: Random) -> None:
    """AssertionError if any way of drawing differs from the others, or a number that is none comes into a colour."""
    kernels = backend.load()
    width, height = random.choice(SIZES)
    sampling = random.choice(("corner", "centre"))
    for name in STAGES:
        plan, by_numpy = (make_plan(scene, name, width, height, sampling, path=path) for path in (kernels, plain))
        picture = draw(plan, threads=1)
        same(picture, draw(plan, threads=2), f"{name}: one thread and two")
        same(picture, draw(by_numpy, threads=1), f"{name}: kernels and numpy")
        with other_bands():
            same(picture, draw(plan, threads=2), f"{name}: other bands")
            same(picture, draw(by_numpy, threads=2), f"{name}: other bands, numpy")
        check_numbers(by_numpy)
    usual = random.choice([method for method in METHODS if method != CERTIFIED])
    for name in ("diffuse", "error"):
        plans = [make_plan(scene, name, width, height, sampling, usual, path) for path in (kernels, plain)]
        pictures = [draw(plan, threads=threads) for plan, threads in zip(plans, (2, 1), strict=True)]
        same(*pictures, f"{name} by {usual}: kernels and numpy")


def same(one: np.ndarray, other: np.ndarray, what: str) -> None:
    differing = (one != other).any(axis=2)
    if differing.any():
        y, x = np.argwhere(differing)[0]
        raise AssertionError(f"{what} differ in {differing.sum()} pixels, at {x} {y} {one[y, x]} and {other[y, x]}")


@contextmanager
def other_bands() -> Iterator[None]:
    """Let pictures be cut into more pieces: bands as low as they can be."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(screen, "_BAND_PIXELS", 1)
        patch.setattr(camera, "BAND_PIXELS", 7)
        patch.setattr(screen, "_PIXELS_A_MOMENT", 1)
        yield


def check_numbers(plan: Plan) -> None:
    """No t and no colour is a NaN."""
    rows = slice(0, plan.raster.height)
    with open_tracer(plan) as tracer, np.errstate(all="ignore"):
        block = block_of(plan, tracer, rows, whole=whole_of(plan, tracer))
        assert not plan.stage.needs_hits or not np.isnan(block.hits.t).any(), f"{plan.name}: NaN in t"
        assert not np.isnan(plan.stage.colours(block)).any(), f"{plan.name}: NaN in colours"
