"""The scene files of a folder, in the order in which the number keys count them."""

from __future__ import annotations

import re
from pathlib import Path


class NoScenesError(Exception):
    """There is nothing to show; the text says why, in one line."""


def find_scenes(where: Path) -> tuple[tuple[Path, ...], int]:
    """The scenes of a folder and the place of the one to begin with; a file opens its folder at that file."""
    folder = where if where.is_dir() else where.parent
    if not where.exists():
        raise NoScenesError(f"{where}: there is no such file or folder")
    try:
        scenes = tuple(sorted(folder.glob("*.cli"), key=_in_order_of_names))
    except OSError as error:
        raise NoScenesError(f"{folder}: {error.strerror}") from None
    if where == folder:
        if not scenes:
            raise NoScenesError(f"{folder}: there is no scene (.cli) in this folder")
        return scenes, 0
    if where not in scenes:
        raise NoScenesError(f"{where}: expected a folder or a scene (.cli)")
    return scenes, scenes.index(where)


def _in_order_of_names(path: Path) -> tuple[list[str | int], str]:
    """Numbers within names count by their value: scene 2 comes before scene 10."""
    parts = re.split(r"([0-9]+)", path.name.lower())
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], path.name
