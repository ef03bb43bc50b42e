"""A file of one's own, plugged in: its functions stand in for the tracer's own parts.

`PARTS` says which functions a file may define, and what they are given. Running one is running the user's
own code: see `raytracer.plug_process`, which does that where it can be given up.
"""

from __future__ import annotations

import ast
import codecs
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache
from inspect import Parameter, signature
from pathlib import Path
from types import FunctionType, ModuleType, TracebackType
from typing import Any

import numpy as np

from raytracer.course import WrongResultError, draw_one_by_one
from raytracer.faults import FileError, line_of
from raytracer.image import to_bytes
from raytracer.methods import CERTIFIED, Limits, Method
from raytracer.plan import Plan, make_plan
from raytracer.render import draw
from raytracer.scene import Scene
from raytracer.stages import STAGES, Block, Stage

_OF_ONE_STAGE = ("render_scene", "shade", "stage")
_ONE_BY_ONE = ("eye_ray", "intersect", "intersect_triangle", "shade")

Tell = Callable[[np.ndarray, float], object]


class PlugError(FileError):
    """What is wrong with a plugged file, or went wrong in it: `path:line:column: message`."""


PARTS = {  # the functions that a file may define, and what they are given
    "render_scene": ("scene", "width", "height"),
    "eye_ray": ("camera", "x", "y", "width", "height"),
    "intersect": ("ray", "sphere"),
    "intersect_triangle": ("ray", "triangle"),
    "shade": ("hit",),
    "method": ("origin", "direction", "centre", "r"),
    "stage": ("block",),
}


@dataclass(frozen=True)
class Plug:
    """What a file defines."""

    path: Path
    functions: dict[str, Callable[..., Any]]  # by their names in PARTS
    stage: str  # that its `shade`, `stage` or `render_scene` draws; those that find hits serve all stages

    def parts_of(self, stage: str) -> tuple[str, ...]:
        """Which of the functions have a part in the picture of this stage."""
        if stage == self.stage:
            return ("render_scene",) if "render_scene" in self.functions else tuple(self.functions)
        return tuple(name for name in self.functions if name not in _OF_ONE_STAGE) if STAGES[stage].needs_hits else ()


@dataclass(frozen=True)
class Order:
    """A picture that is wanted of a plugged file."""

    scene: Scene
    stage: str = "diffuse"
    width: int = 320
    height: int = 320
    sampling: str = "corner"
    method: str = CERTIFIED  # of the hits that the file does not find itself


def load_plug(path: Path) -> Plug:
    """Run a file, and find the functions in it that can be plugged in. Raises `PlugError`."""
    try:
        source = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise PlugError(path, None, None, f"found no readable file, expected Python ({reason})") from error
    if source.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # as a shell of Windows writes what is printed
        source = source.decode("utf-16", "replace").encode()
    module = ModuleType(f"plugged_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # where dataclasses look for their module
    sys.path.insert(0, str(path.resolve().parent))
    with blaming(path, "while it is loaded"):
        exec(compile(source, str(path), "exec"), vars(module))
    return _plug_of(path, vars(module))


def _plug_of(path: Path, names: dict[str, Any]) -> Plug:
    functions = {name: names[name] for name in PARTS if callable(names.get(name))}
    if "render_scene" in functions:  # what else there is serves that one
        functions = {"render_scene": functions["render_scene"]}
    if not functions:
        own = [
            name for name, value in names.items() if isinstance(value, FunctionType) and value.__module__ != __name__
        ]
        near = [(name, *get_close_matches(name, PARTS, n=1)) for name in own]
        hints = [f"; did you mean {pair[1]} by {pair[0]}?" for pair in near if len(pair) == 2]
        raise PlugError(
            path, None, None,
            f"found {_listed(own) or 'no function'}, expected one or more of {', '.join(PARTS)}{''.join(hints[:1])}",
        )  # fmt: skip
    for name, function in functions.items():
        _check_takes(path, name, function)
    stage = names.get("STAGE", "diffuse")
    if stage not in STAGES:
        raise PlugError(path, None, None, f"found STAGE = {stage!r}, expected one of {', '.join(STAGES)}")
    return Plug(path, functions, stage)


def _listed(names: list[str]) -> str:
    return f"only {', '.join(names[:5])}{', …' if len(names) > 5 else ''}" if names else ""


def _check_takes(path: Path, name: str, function: Callable[..., Any]) -> None:
    """PlugError where a function cannot be called as it will be."""
    wanted = PARTS[name]
    try:
        signature(function).bind(*wanted)
    except TypeError:
        given = ", ".join(key for key, p in signature(function).parameters.items() if p.kind != Parameter.KEYWORD_ONLY)
        message = f"found {name}({given}), expected {name}({', '.join(wanted)})"
        raise PlugError(path, _line_of(function), None, message) from None
    except ValueError:  # something built in, of which nothing is known
        pass


def _line_of(function: Callable[..., Any]) -> int | None:
    """Where a function begins, if it is one of Python's."""
    line: int | None = getattr(getattr(function, "__code__", None), "co_firstlineno", None)
    return line


def stage_said_by(path: Path) -> str | None:
    """The stage that a file says it draws, as far as can be seen without running it."""
    try:
        tree = ast.parse(path.read_bytes())
    except (OSError, ValueError, SyntaxError, RecursionError, MemoryError):
        return None
    said = [
        node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name) and target.id == "STAGE"
    ]
    return next((stage for stage in said[-1:] if isinstance(stage, str) and stage in STAGES), None)


def draw_plugged(plug: Plug, order: Order, tell: Tell = lambda picture, done: None) -> np.ndarray:
    """The picture with the file's functions in place of the tracer's: uint8 (height, width, 3). Raises `PlugError`.

    `tell(picture, done)` is called now and then with the picture as far as it has come, where that can be known.
    """
    functions, ours = plug.functions, order.stage == plug.stage
    with blaming(plug.path, f"drawing {order.stage}"):
        if ours and "render_scene" in functions:
            return _whole(functions["render_scene"], order)
        plan = plan_of(plug, order)
        if any(name in functions for name in _ONE_BY_ONE):
            return draw_one_by_one(functions, plan, ours and "shade" in functions, tell)
        return draw(plan)


def plan_of(plug: Plug, order: Order) -> Plan:
    """The plan of a picture, with the file's stage and method if it has them."""
    functions, stage, method = plug.functions, STAGES[order.stage], method_of(plug) or order.method
    if order.stage == plug.stage and "stage" in functions:
        stage = _stage_of(functions["stage"], stage)
    return make_plan(order.scene, stage, order.width, order.height, order.sampling, method)


def method_of(plug: Plug) -> Method | None:
    """The file's method, if it has one: numpy, in float64."""
    function = plug.functions.get("method")
    if function is None:
        return None

    def checked(*given: Any) -> Any:
        found, expected = function(*given), np.shape(given[1][0])
        try:
            t = np.broadcast_to(np.asarray(found, float), expected)
        except (TypeError, ValueError):
            raise WrongResultError(function, found, f"t, an array {expected}") from None
        return np.where(np.isnan(t), np.inf, t)

    return Method(checked, f"method of {plug.path.name}", str(plug.path), Limits())


def _stage_of(function: Callable[..., Any], ours: Stage) -> Stage:
    """The file's stage, in place of one of ours."""

    def checked(block: Block) -> np.ndarray:
        found, expected = function(block), (*block.hits.index.shape, 3)
        try:
            return np.broadcast_to(np.asarray(found, float), expected)
        except (TypeError, ValueError):
            raise WrongResultError(function, found, f"colours, an array {expected}") from None

    return replace(ours, colours=checked, painter="", needs_hits=True, needs_lights=True)


def _whole(function: Callable[..., Any], order: Order) -> np.ndarray:
    """A picture that the file draws all by itself."""
    found, expected = function(order.scene, order.width, order.height), (order.height, order.width, 3)
    try:
        picture = np.asarray(found)
        numbers = picture if picture.dtype == np.uint8 else picture.astype(float)
    except (TypeError, ValueError):
        raise WrongResultError(function, found, f"a picture {expected}") from None
    if numbers.shape != expected:
        raise WrongResultError(function, numbers, f"{expected}: rows, columns, colours")
    return numbers if numbers.dtype == np.uint8 else to_bytes(numbers)


# ------------------------------------------------------------------------------------------- whose mistake it was


@contextmanager
def blaming(path: Path, when: str) -> Iterator[None]:
    """Turn whatever goes wrong in a user's file into a `PlugError` that says where."""
    try:
        yield
    except PlugError:
        raise
    except WrongResultError as error:
        raise PlugError(path, _line_of(error.function), None, str(error)) from error
    except SyntaxError as error:
        where = Path(error.filename) if error.filename else path
        line, column = (number if number and number > 0 else None for number in (error.lineno, error.offset))
        raise PlugError(where, line, column, f"{type(error).__name__}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        raise _fault_of(error, path, when) from error


def _fault_of(error: BaseException, path: Path, when: str) -> PlugError:
    """Where in the user's files the error was raised, or what of them led to it."""
    text = " ".join(str(error).split())
    message = f"{type(error).__name__}{': ' if text else ''}{text}, {when}"
    file, line, column = _last_place(error.__traceback__, path.resolve().parent) or (path, None, None)
    return PlugError(file, line, column, message)


def _last_place(trace: TracebackType | None, folder: Path) -> tuple[Path, int | None, int | None] | None:
    """The innermost place in a file of this folder, packages that are installed in it left out."""
    places = [frame for frame in traceback.extract_tb(trace) if is_own(frame.filename, folder)]
    if not places:
        return None
    last = places[-1]
    file, line = Path(last.filename), line_of(Path(last.filename), last.lineno or 0)
    if last.colno is None or line is None:
        return file, last.lineno, None
    return file, last.lineno, len(line.encode()[: last.colno].decode(errors="ignore")) + 1  # colno counts bytes


def is_own(filename: str, folder: Path) -> bool:
    """Whether a file is the user's own: in this folder, and not Python's, a package's or the tracer's."""
    around = Path(filename).resolve().parents
    return not filename.startswith("<") and folder in around and not any(other in around for other in _others())


@cache
def _others() -> list[Path]:
    """Folders of files that are not the user's own."""
    places = [Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib")]
    return [place.resolve() for place in (Path(__file__).parent, *places)]
