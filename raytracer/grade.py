"""What `python -m raytracer compare` does: a picture against another, or against a scene that is drawn for it.

A scene is written as `scene.cli`, `scene.cli:stage` or `scene.cli:stage:method`; anything else is a picture file.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from raytracer.compare import TOLERANCE, Comparison, compare, difference_picture
from raytracer.image import check_can_save, load_png, save_png
from raytracer.interpreter import interpreter
from raytracer.methods import CERTIFIED, METHODS
from raytracer.render import render_scene
from raytracer.scene import Scene
from raytracer.stages import STAGES

_DRAWN = re.compile(r"(?P<path>.+\.cli)(:(?P<stage>[^:]*))?(:(?P<method>[^:]*))?", re.IGNORECASE)
_SIZE = 320, 320


@dataclass(frozen=True)
class View:
    """How scenes are drawn that do not say it themselves."""

    stage: str = "diffuse"
    sampling: str = "corner"
    method: str = CERTIFIED
    size: tuple[int, int] | None = None  # None: that of the picture beside it


@dataclass(frozen=True)
class Drawn:
    """A scene in place of a picture."""

    scene: Scene
    stage: str
    method: str
    sampling: str

    def picture(self, width: int, height: int, cancelled: Callable[[], bool]) -> np.ndarray:
        options = {"sampling": self.sampling, "method": self.method}
        return render_scene(self.scene, self.stage, width, height, **options, cancelled=cancelled)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Verdict:
    """How two pictures compare, and why, as far as that is known."""

    comparison: Comparison
    allowed: int  # wrong pixels that are let pass
    causes: tuple[str, ...]  # see `mistakes.recognise`

    @property
    def passed(self) -> bool:
        return self.comparison.wrong <= self.allowed

    def lines(self) -> Iterator[str]:
        """For a person, one a line."""
        yield from self.comparison.lines()
        for number, cause in enumerate(self.causes):
            yield f"{'or' if number else 'cause'}: {cause}"

    def as_json(self) -> str:
        """For a program."""
        figures = {"passed": self.passed, "allowed": self.allowed, **self.comparison.as_dict()}
        return json.dumps({**figures, "causes": self.causes}, ensure_ascii=False)


def grade(
    found: str,
    expected: str,
    view: View = View(),
    *,
    tolerance: int = TOLERANCE,
    allowed: int = 0,
    output: Path | None = None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Verdict:
    """Compare what is found with what is expected, and write a picture of the differences to `output`.

    Raises ValueError or OSError, with one line, where there is nothing to compare.
    """
    if output is not None:
        check_can_save(output)
    sources = [source_of(text, view) for text in (found, expected)]
    pictures = [source for source in sources if not isinstance(source, Drawn)]
    width, height = view.size or ((pictures[0].shape[1], pictures[0].shape[0]) if pictures else _SIZE)
    ours, theirs = (
        source.picture(width, height, cancelled) if isinstance(source, Drawn) else source for source in sources
    )
    comparison = compare(ours, theirs, tolerance, flip=True)
    if output is not None:
        save_png(output, difference_picture(ours, theirs))
    return Verdict(comparison, allowed, _causes(ours, sources[1], cancelled))


def _causes(picture: np.ndarray, expected: Drawn | np.ndarray, cancelled: Callable[[], bool]) -> tuple[str, ...]:
    if not isinstance(expected, Drawn):
        return ()
    from raytracer.mistakes import recognise

    return recognise(picture, expected.scene, expected.stage, expected.sampling, cancelled=cancelled)


def source_of(text: str, view: View) -> Drawn | np.ndarray:
    """A picture, uint8 (height, width, 3), or a scene to be drawn; ValueError or OSError if it is neither."""
    drawn = _DRAWN.fullmatch(text)
    if drawn is None:
        if ".cli:" in text.lower():
            raise ValueError(f"found {text!r}, expected scene.cli, scene.cli:stage or scene.cli:stage:method")
        return _load(text)
    stage, method = drawn["stage"] or view.stage, drawn["method"] or view.method
    for word, name, table in (("stage", stage, STAGES), ("method", method, METHODS)):
        if name not in table:
            raise ValueError(f"{text}: found {word} {name!r}, expected one of {', '.join(table)}")
    return Drawn(interpreter(drawn["path"]), stage, method, view.sampling)


def _load(path: str) -> np.ndarray:
    from PIL import Image

    try:
        return load_png(path)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise
        raise ValueError(f"{path}: found no picture that can be read, expected a PNG or the like: {error}") from error
