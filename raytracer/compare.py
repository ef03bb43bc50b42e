"""Two pictures, and how they differ: what is found against what is expected.

A pixel is wrong when one of its three bytes is off by more than a tolerance. That is 1 by default, since two right
programs may round a colour that lies halfway to different sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from math import sqrt

import numpy as np

from raytracer.image import to_bytes
from raytracer.stages import Scale, on_scale

TOLERANCE = 1
_CHUNK = 1 << 16  # bytes that are counted at a time, in the core's cache

DIFFERENCES: Scale = (
    (0, (0.0, 0.0, 0.0)),
    (1, (0.0, 0.18, 0.4)),
    (2, (0.0, 0.45, 0.8)),
    (8, (0.2, 0.75, 0.45)),
    (32, (0.9, 0.75, 0.1)),
    (128, (1.0, 0.3, 0.15)),
    (255, (1.0, 0.8, 0.95)),
)
DIFFERENCES_LEGEND = (
    (DIFFERENCES[0][1], "equal"),
    *((colour, f"off by {difference:.0f}") for difference, colour in DIFFERENCES[1:]),
)


@dataclass(frozen=True)
class Comparison:
    """How far a picture is from the one that is expected; differences are of bytes, 0 to 255."""

    width: int
    height: int
    tolerance: int
    wrong: int  # pixels with a byte that differs by more than the tolerance
    largest: int  # difference of any byte
    at: tuple[int, int] | None  # column and row of the first pixel that differs so much; None if all are equal
    mean: float  # difference, over all bytes
    rmse: float  # √ of the mean square
    flip: float | None = None  # mean FLIP, 0 to 1; None where it was not asked for or is not installed

    @property
    def pixels(self) -> int:
        return self.width * self.height

    def lines(self) -> Iterator[str]:
        """The figures for a person, one a line."""
        yield f"wrong pixels: {self.wrong} of {self.pixels}, off by more than {self.tolerance}"
        yield f"largest difference: {self.largest}" + (f", at column {self.at[0]}, row {self.at[1]}" if self.at else "")
        yield f"mean difference: {self.mean:.4g}"
        yield f"RMSE: {self.rmse:.4g}"
        if self.flip is not None:
            yield f"FLIP: {self.flip:.4g}"

    def as_dict(self) -> dict[str, object]:
        """The figures for a program."""
        return asdict(self)


def compare(found: np.ndarray, expected: np.ndarray, tolerance: int = TOLERANCE, *, flip: bool = False) -> Comparison:
    """Compare two pictures, uint8 (height, width, 3); ValueError if these are not two such pictures of one size.

    FLIP takes a hundred times as long as the rest, and is measured where it is asked for and `flip-evaluator` is
    installed.
    """
    off = _off(found, expected)
    worst, (height, width) = _worst(off), off.shape[:2]
    counts, values = _counts(off), np.arange(256)
    largest = int(np.flatnonzero(counts).max())
    row, column = divmod(int(worst.argmax()), width)
    return Comparison(
        width,
        height,
        tolerance,
        int(np.count_nonzero(worst > tolerance)),
        largest,
        (column, row) if largest else None,
        float(counts @ values) / off.size,
        sqrt(float(counts @ values**2) / off.size),
        mean_flip(found, expected) if flip else None,
    )


def differences(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """By how much each pixel is off, in its worst byte: uint8 (height, width). ValueError as for `compare`."""
    return _worst(_off(found, expected))


def difference_picture(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Where two pictures differ, in the colours of `DIFFERENCES_LEGEND`, on a scale that shows a difference of 2.

    uint8 (height, width, 3). ValueError as for `compare`.
    """
    colours = np.take(_colours(), differences(found, expected))
    return np.ascontiguousarray(colours.view(np.uint8).reshape(*colours.shape, 4)[..., :3])


def mean_flip(found: np.ndarray, expected: np.ndarray) -> float | None:
    """The mean of FLIP, 0 to 1: what one sees who flips between the two pictures. None where it is not installed.

    P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. Fairchild, FLIP: A Difference Evaluator for
    Alternating Images, 2020. At 67 pixels a degree, as it stands in `flip-evaluator`.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None
    reference, test = (picture.astype(np.float32) / np.float32(255) for picture in (expected, found))
    return float(flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False)[1])


def _off(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """The difference of each byte: uint8 (height, width, 3)."""
    for picture in (found, expected):
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
            raise ValueError(f"found {picture.dtype} {picture.shape}, expected a picture, uint8 (height, width, 3)")
    if found.shape != expected.shape:
        sizes = (f"{picture.shape[1]} x {picture.shape[0]}" for picture in (found, expected))
        raise ValueError("found a picture of {} pixels, expected {}".format(*sizes))
    off_by: np.ndarray = np.maximum(found, expected) - np.minimum(found, expected)
    return off_by


def _worst(off: np.ndarray) -> np.ndarray:
    worst: np.ndarray = np.maximum(np.maximum(off[..., 0], off[..., 1]), off[..., 2])
    return worst


def _counts(off: np.ndarray) -> np.ndarray:
    """How many bytes are off by 0, 1, … 255: int64 (256,)."""
    flat = off.reshape(-1)
    chunks = (flat[start : start + _CHUNK] for start in range(0, len(flat), _CHUNK))
    return np.asarray(np.sum([np.bincount(chunk, minlength=256) for chunk in chunks], axis=0))


@lru_cache(maxsize=1)
def _colours() -> np.ndarray:
    """The colour of each difference, as one number that holds its three bytes: uint32 (256,)."""
    bytes_ = np.zeros((256, 4), np.uint8)
    bytes_[:, :3] = to_bytes(on_scale(np.arange(256), DIFFERENCES))
    return bytes_.view(np.uint32)[:, 0]
