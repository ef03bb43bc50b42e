"""Colours to bytes, and bytes to PNG files."""

from __future__ import annotations

import errno
import os
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from glob import escape
from pathlib import Path
from typing import IO

import numpy as np

from raytracer.pool import cores

_BYTES_A_PIXEL = 24  # the picture, the hits of all pixels, and room for a PNG encoder
_STALE = 3600.0  # seconds that nobody writes to a draft whose writer is alive
_NAMED = 100  # characters of the file's name that its draft bears: all of them could be too many
_BYTES_AT_WORK = 200  # for each pixel that a thread is at work on


class PictureTooLargeError(MemoryError):
    """A picture that this machine's memory does not hold; the text says what it takes and what is free."""


def check_fits_memory(width: int, height: int, at_work: int) -> None:
    """Raise `PictureTooLargeError` now, with the figures, rather than run out of memory later.

    `at_work` is how many pixels each thread works on at a time.
    """
    needed = width * height * _BYTES_A_PIXEL + cores() * at_work * _BYTES_AT_WORK
    if needed < 1 << 28:
        return
    import psutil  # slow to load, and rarely needed

    available = psutil.virtual_memory().available
    if needed > available:
        raise PictureTooLargeError(
            f"a picture of {width} x {height} pixels takes {needed / 1e9:.3g} GB to draw; "
            f"{available / 1e9:.3g} GB of memory are free"
        )


class Depth(Enum):
    """How a colour's numbers are written: in 8 or 16 bits, from 0 to 1, or as they are."""

    BYTE = "8"
    WORD = "16"
    FLOAT = "float"

    @property
    def kind(self) -> type[np.uint8] | type[np.uint16] | type[np.float32]:
        """The numbers of an array of them."""
        if self is Depth.FLOAT:
            return np.float32
        return np.uint8 if self is Depth.BYTE else np.uint16

    @property
    def white(self) -> int:
        """What is written for 1."""
        return {Depth.BYTE: 255, Depth.WORD: 65535, Depth.FLOAT: 1}[self]

    def write(self, colours: np.ndarray) -> np.ndarray:
        """floor(255 · clip(C, 0, 1) + ½), or 65535 in place of 255; as float32 within its range.

        A NaN, what lies beyond float64, is black.
        """
        colours = np.nan_to_num(colours)
        if self is Depth.FLOAT:
            largest = np.finfo(np.float32).max
            numbers: np.ndarray = np.clip(colours, -largest, largest)
        else:
            numbers = np.clip(colours, 0.0, 1.0) * self.white + 0.5
        return numbers.astype(self.kind)


def to_bytes(colours: np.ndarray) -> np.ndarray:
    """floor(255 · clip(C, 0, 1) + ½) as uint8."""
    return Depth.BYTE.write(colours)


def check_can_save(path: str | os.PathLike[str]) -> None:
    """Raise the `OSError` that saving there would end in, as far as can be known before."""
    path = Path(path).resolve()
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "a folder, expected a file to write", str(path))
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise PermissionError(errno.EACCES, "may not be written", str(path))


def save_png(path: str | os.PathLike[str], picture: np.ndarray) -> None:
    """Write uint8 or uint16 (height, width, 3) as a PNG, whole or not at all (see `save`)."""
    save(path, lambda file: encode_png(file, picture))


def encode_png(file: IO[bytes], picture: np.ndarray) -> None:
    """Write uint8 or uint16 (height, width, 3) as a PNG."""
    if picture.dtype == np.uint16:  # which PIL does not write
        from raytracer.png import deflate_rows, write_png

        height, width, _ = picture.shape
        write_png(file, width, height, 16, [deflate_rows(picture)])
        return
    from PIL import Image  # slow to load, and not needed to draw

    Image.fromarray(picture).save(file, "PNG")


def save(path: str | os.PathLike[str], write: Callable[[IO[bytes]], object]) -> None:
    """Write a file, whole or not at all: an existing file stays until the new one stands.

    A link is followed, a pipe or device written to as it is. Raises `OSError`.
    """
    check_can_save(path)
    path = Path(path).resolve()
    try:
        if is_file_to_be(path):
            _replace(path, write)
        else:
            with path.open("wb") as file:
                write(file)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error


def is_file_to_be(path: Path) -> bool:
    """Whether there is a file, or nothing, and no pipe or device."""
    return path.is_file() or not path.exists()


def _replace(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    with drafted(path) as draft, draft.open("xb") as file:
        write(file)


@contextmanager
def drafted(path: Path) -> Iterator[Path]:
    """Where to write a file that takes the path's place at the end, if nothing fails."""
    _sweep(path)
    draft = path.with_name(f".{path.name[:_NAMED]}.{secrets.token_hex(8)}.part{path.suffix}")
    try:
        yield draft
        with draft.open("rb+") as file:
            os.fsync(file.fileno())
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def _sweep(path: Path) -> None:
    """Remove drafts of this file that were left behind: nobody has written to them for an hour."""
    for draft in path.parent.glob(f".{escape(path.name[:_NAMED])}.{'[0-9a-f]' * 16}.part{escape(path.suffix)}"):
        with suppress(OSError):
            if draft.stat().st_mtime < time.time() - _STALE:
                draft.unlink()


def load_png(path: str | os.PathLike[str]) -> np.ndarray:
    """A picture file as uint8 (height, width, 3), red, green, blue, the top row first. Raises `OSError`."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))
