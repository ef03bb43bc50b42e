"""The scene files of a folder, in the order in which the number keys count them."""

from __future__ import annotations

from pathlib import Path

from raytracer.interpreter import in_order_of_names


class NoScenesError(Exception):
    """There is nothing to show; the text says why, in one line."""


def find_scenes(where: Path) -> tuple[tuple[Path, ...], int]:
    """The scenes of a folder and the place of the one to begin with; a file opens its folder at that file."""
    folder = where if where.is_dir() else where.parent
    if not where.exists():
        raise NoScenesError(f"{where}: there is no such file or folder")
    try:
        scenes = tuple(sorted(folder.glob("*.cli"), key=in_order_of_names))
    except OSError as error:
        raise NoScenesError(f"{folder}: {error.strerror}") from None
    if where == folder:
        if not scenes:
            raise NoScenesError(f"{folder}: there is no scene (.cli) in this folder")
        return scenes, 0
    if where not in scenes:
        raise NoScenesError(f"{where}: expected a folder or a scene (.cli)")
    return scenes, scenes.index(where)
