"""The files that a picture may become, and how: at once where it is small, else in bands."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from raytracer.crew import Tally, open_crew
from raytracer.image import Depth, PictureTooLargeError, check_can_save, is_file_to_be, save_png
from raytracer.render import Progress
from raytracer.samples import draw_samples
from raytracer.tiled import Begun, Picture, draw_large

_AT_ONCE = 1 << 26  # pixels: of more, the finished parts are worth keeping, and memory may be short
SUFFIXES = (".png", ".exr")


def write_picture(
    picture: Picture,
    path: Path,
    *,
    cluster: str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    begun: Begun | None = None,
) -> Tally | None:
    """Draw a picture into a file, whole or not at all; what the workers did, if it was drawn in bands.

    `begun` is called for one that is too large to be drawn at once, whoever draws it.
    Raises ValueError for a file of another kind, and what `draw_large` and `raytracer.exr.save_exr` do.
    """
    check_suffix(path, SUFFIXES)
    check_can_save(path)
    if path.suffix.lower() == ".exr":
        from raytracer.exr import save_exr

        if cluster is not None:
            raise ValueError("--cluster: an OpenEXR file is drawn at once, expected a .png")
        save_exr(picture, path, threads, progress, cancelled)
        return None
    pixels = None if cluster is not None else _drawn_at_once(picture, threads, progress, cancelled)
    if pixels is not None:
        save_png(path, pixels)
        return None
    with open_crew(cluster, threads) as crew:
        draw_large(picture, path, crew, progress, begun if picture.pixels > _AT_ONCE else None)
        return crew.tally


def _drawn_at_once(
    picture: Picture, threads: int | None, progress: Progress | None, cancelled: Callable[[], bool] | None
) -> np.ndarray | None:
    """None if it is too large for that."""
    picture.first_row()  # a size, a stage or a method that there is not
    if picture.pixels > _AT_ONCE:
        return None
    try:
        plan = picture.plan()
    except PictureTooLargeError:
        return None
    return draw_samples(plan, picture.samples, threads=threads, progress=progress, cancelled=cancelled)


def check_suffix(path: str | os.PathLike[str], suffixes: tuple[str, ...]) -> None:
    """ValueError if a file's name does not end in one of these; pipes and devices may have any."""
    path = Path(path)
    if path.suffix.lower() not in suffixes and is_file_to_be(path) and not path.is_dir():
        found = f"suffix {path.suffix!r}" if path.suffix else "no suffix"
        raise ValueError(f"{path}: found {found}, expected {' or '.join(each or 'a folder' for each in suffixes)}")


def check_plugged(picture: Picture, path: Path, cluster: str | None) -> None:
    """ValueError for what a plugged file does not draw: it makes bytes, on this machine."""
    check_suffix(path, SUFFIXES[:1])
    if picture.depth is not Depth.BYTE or cluster is not None:
        raise ValueError("--plug: found --bits 16 or --cluster, expected neither")


def depth_of(path: Path, bits: int) -> Depth:
    """How the numbers of a file are written."""
    if path.suffix.lower() == ".exr":
        return Depth.FLOAT
    return Depth.BYTE if bits == 8 else Depth.WORD
