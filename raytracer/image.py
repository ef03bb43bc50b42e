"""Colours to bytes, and bytes to PNG files."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np

_BYTES_A_PIXEL = 24  # the picture, the hits of all pixels, and room for a PNG encoder


class PictureTooLargeError(MemoryError):
    """A picture that this machine's memory does not hold."""


def check_fits_memory(width: int, height: int) -> None:
    """Raise `PictureTooLargeError` now, with the figures, rather than run out of memory later."""
    needed = width * height * _BYTES_A_PIXEL
    if needed < 1 << 28:
        return
    import psutil  # slow to load, and rarely needed

    available = psutil.virtual_memory().available
    if needed > available:
        raise PictureTooLargeError(
            f"a picture of {width} x {height} pixels takes {needed / 1e9:.3g} GB to draw; "
            f"{available / 1e9:.3g} GB of memory are free"
        )


def to_bytes(colours: np.ndarray) -> np.ndarray:
    """floor(255 · clip(C, 0, 1) + ½) as uint8; a NaN, what lies beyond float64, is black."""
    return (np.clip(np.nan_to_num(colours), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def save_png(path: str | os.PathLike[str], picture: np.ndarray) -> None:
    """Write uint8 (height, width, 3) as a PNG, whole or not at all: an existing file stays until the new one stands."""
    from PIL import Image  # slow to load, and not needed to draw

    path = Path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder", str(path.parent))
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, "a folder, expected a file to write", str(path))
    draft = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with draft.open("xb") as file:
            Image.fromarray(picture).save(file, "PNG")
            file.flush()
            os.fsync(file.fileno())
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def load_png(path: str | os.PathLike[str]) -> np.ndarray:
    """A picture file as uint8 (height, width, 3)."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))
