"""Every scene at every stage by every method: small pictures, and each that several methods draw alike but once."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from raytracer import backend
from raytracer.interpreter import SceneError, in_order_of_names, interpreter
from raytracer.methods import CERTIFIED, METHODS
from raytracer.render import render_scene
from raytracer.scene import Scene
from raytracer.stages import STAGES, wrong_pixels

TILE = 160  # pixels
_ERROR = "error"

Progress = Callable[[str], object]


@dataclass(frozen=True)
class Tile:
    """A picture, and the methods that draw it."""

    stage: str
    methods: tuple[str, ...]
    picture: np.ndarray  # uint8 (size, size, 3)

    @property
    def source(self) -> str:
        """The picture as a page holds it, byte for byte: a data URI."""
        from PIL import Image

        file = BytesIO()
        Image.fromarray(self.picture).save(file, "WEBP", lossless=True, method=4)
        return f"data:image/webp;base64,{b64encode(file.getvalue()).decode()}"

    @property
    def shown(self) -> str:
        """Who draws it, in a few words."""
        if len(self.methods) == len(METHODS):
            return "every method"
        first, *others = self.methods
        return f"{first} and {len(others)} more" if len(others) > 2 else ", ".join(self.methods)

    @cached_property
    def wrong(self) -> int:
        """How many pixels are wrong, at stage `error`."""
        return wrong_pixels(self.picture)


class Entry(NamedTuple):
    """A scene file in the gallery: what it says of itself, its pictures, or why it has none."""

    name: str
    about: str
    tiles: tuple[Tile, ...] = ()
    fault: str = ""

    def wrong_by_method(self) -> dict[str, Tile]:
        """The pictures at stage `error` in which there is something wrong, by method."""
        return {m: tile for tile in self.tiles if tile.stage == _ERROR and tile.wrong for m in tile.methods}


def find_scenes(folder: Path) -> list[Path]:
    """The scene files in a folder, then those in the folders within, in the order of their names.

    ValueError if there is none.
    """
    found = sorted(
        folder.rglob("*.cli"), key=lambda path: (path.parent != folder, path.parent, in_order_of_names(path))
    )
    if not found:
        raise ValueError(f"{folder}: found {'no scene (.cli)' if folder.is_dir() else 'no folder'}, expected scenes")
    return found


def draw_gallery(folder: Path, size: int = TILE, progress: Progress = lambda text: None) -> list[Entry]:
    """An entry for each scene of the folder; one that cannot be read has its message in place of pictures."""
    backend.load()  # so that every method is drawn by compiled code, if there is a compiler
    return [
        _entry(path, path.relative_to(folder).with_suffix("").as_posix(), size, progress)
        for path in find_scenes(folder)
    ]


def _entry(path: Path, name: str, size: int, progress: Progress) -> Entry:
    about, tiles = first_comment(path), list[Tile]()
    try:
        scene = interpreter(path)
        for stage in STAGES:
            progress(f"pictures: {name}, {stage}")
            tiles += draw_tiles(scene, stage, size)
    except (SceneError, MemoryError) as error:
        return Entry(name, about, fault=str(error).replace(str(path), path.name) or "not enough memory to draw this")
    return Entry(name, about, tuple(tiles))


def draw_tiles(scene: Scene, stage: str, size: int) -> list[Tile]:
    """The different pictures of a scene at a stage, `certified`'s first, each with the methods that draw it."""
    methods = list(METHODS) if STAGES[stage].needs_hits else [CERTIFIED]  # else no ray is shot
    found: dict[bytes, tuple[list[str], np.ndarray]] = {}
    for method in methods:
        picture = render_scene(scene, stage, size, size, method=method)
        found.setdefault(picture.tobytes(), ([], picture))[0].append(method)
    every = tuple(METHODS)
    return [Tile(stage, tuple(some) if len(methods) > 1 else every, picture) for some, picture in found.values()]


def first_comment(path: Path) -> str:
    """What a scene file's first lines say about it, up to the first sentence's end; its name if they say nothing."""
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            lines = [file.readline(1000).lstrip("\ufeff").strip() for _ in range(3)]
    except OSError:
        lines = []
    words = []
    for line in lines:
        if not line.startswith("#"):
            break
        words.append(line.lstrip("# "))
    text = " ".join(words)
    end = text.find(". ")
    return (text[: end + 1] if end >= 0 else text) or path.stem.replace("_", " ")
