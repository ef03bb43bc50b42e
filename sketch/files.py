"""Files that the sketch writes."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import numpy as np

from raytracer import save_png


def save_beside(name: str, picture: np.ndarray, folder: Path = Path()) -> Path:
    """Save a picture as name.png, or name-2.png and so on: what exists is never overwritten."""
    path = _reserve(name, folder)
    try:
        save_png(path, picture)
    except BaseException:
        path.unlink()
        raise
    return path


def _reserve(name: str, folder: Path) -> Path:
    """An empty file that nobody else has: opening it with "x" leaves no moment between looking and taking."""
    for n in count(1):
        path = folder / (f"{name}.png" if n == 1 else f"{name}-{n}.png")
        try:
            path.open("x").close()
        except FileExistsError:
            continue
        return path
    raise AssertionError
