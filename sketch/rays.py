"""The rays behind a pixel as lines over the picture: to the lights, up to what blocks them, and from mirror to mirror.

A place is (s·x, s·y, s) where the picture shows it in column x and row y, s above 0 ahead of the eye: so a line is
straight from end to end, also one that passes the eye or has no end, and what is to be seen of it is cut out before
anything is divided by s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import hypot
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from raytracer.camera import Raster, seen_at
from raytracer.image import to_bytes
from raytracer.path import Ray
from raytracer.scene import Colour

MIRRORED = (70, 225, 255)
DASH, GAP = 7.0, 5.0  # pixels
_FAINTEST = 0.4  # the opacity of rays that hardly add anything
_NEAR = 2.0**-20  # of the farther end's distance: no line comes nearer to the eye's plane
_FINE = 2  # lines are drawn so many times as large, to be smooth when they are brought down
_HALO, _CORE, _DOT = 8, 4, 7  # widths in those finer pixels; a dot's is its radius

Place = tuple[float, float]  # column and row, whole numbers in the middle of pixels
Bytes = tuple[int, int, int]


@dataclass(frozen=True)
class Line:
    """What is seen of a ray."""

    start: Place
    end: Place
    arrives: bool  # whether its end is seen
    colour: Bytes
    opacity: float
    dashed: bool = False  # blocked before it arrives at its light


class Ink(NamedTuple):
    """Pixels to be laid over a picture: n of them."""

    rows: np.ndarray  # int (n,)
    columns: np.ndarray  # int (n,)
    colours: np.ndarray  # float32 (n, 3), 0 to 255
    opacity: np.ndarray  # float32 (n, 1), 0 to 1

    def lay_over(self, picture: np.ndarray) -> None:
        """Draw into a picture, uint8 (height, width, 3)."""
        under = picture[self.rows, self.columns]
        picture[self.rows, self.columns] = under * (1 - self.opacity) + self.colours * self.opacity + np.float32(0.5)


@np.errstate(all="ignore")
def lines_of(rays: tuple[Ray, ...], raster: Raster) -> tuple[Line, ...]:
    """The lines of all rays but the eye's own, which is one pixel; the first rays last, to lie on top."""
    return tuple(line for line in _all_lines(rays, raster) if line is not None)[::-1]


def _all_lines(rays: tuple[Ray, ...], raster: Raster) -> Iterator[Line | None]:
    eye = np.array(raster.camera.eye)
    for ray, after in zip_longest(rays, rays[1:]):
        if ray.hit is None:
            return
        here, opacity = ray.hit.point - eye, max(_FAINTEST, min(ray.share, 1.0))
        for light in ray.hit.lights:
            if not light.is_behind:
                line = _line(raster, here, light.stop - eye, _shown(light.light), opacity)
                yield line and replace(line, dashed=light.blocker is not None)
        if after is not None and after.hit is not None:
            yield _line(raster, here, after.hit.point - eye, MIRRORED, opacity)
        elif after is not None:
            line = _line(raster, here, _as_long(np.array(after.direction), here), MIRRORED, opacity)
            yield line and replace(line, arrives=False)  # it goes on for ever


def _shown(light: Colour) -> Bytes:
    """A light's colour, as bright as it can be."""
    red, green, blue = to_bytes(np.array(light) / max(*light, 1e-300)).tolist()
    return red, green, blue


def _line(raster: Raster, start: np.ndarray, end: np.ndarray, colour: Bytes, opacity: float) -> Line | None:
    """What is seen of a line between two points as seen from the eye, or from one on in a direction."""
    places = seen_at(raster, np.array([start, end]) / max(np.abs(start).max(), np.abs(end).max()))
    seen = None if places is None else clipped(places[0], places[1], raster.width, raster.height)
    return None if seen is None else Line(*seen, colour, opacity)


def _as_long(direction: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The direction about as long as another vector, lest one of the two is lost beside the other."""
    scaled: np.ndarray = direction / np.abs(direction).max() * np.abs(other).max()
    return scaled


def clipped(start: np.ndarray, end: np.ndarray, width: int, height: int) -> tuple[Place, Place, bool] | None:
    """The part of a line that is ahead of the eye and within the picture, and whether that goes on to its end."""
    near = _NEAR * max(start[2], end[2])
    if not (near > 0.0 and np.isfinite([start, end]).all()):
        return None
    borders = np.array([[1, 0, 0.5], [-1, 0, width - 0.5], [0, 1, 0.5], [0, -1, height - 0.5], [0, 0, 1]])
    inside = np.stack([borders @ start, borders @ end], axis=1) - [[0], [0], [0], [0], [near]]
    enter, leave = 0.0, 1.0
    for before, after in inside.tolist():
        if before < 0.0 and after < 0.0:
            return None
        if before < 0.0:
            enter = max(enter, before / (before - after))
        elif after < 0.0:
            leave = min(leave, before / (before - after))
    if enter > leave:
        return None
    return _place(start, end, enter), _place(start, end, leave), leave == 1.0


def _place(start: np.ndarray, end: np.ndarray, part: float) -> Place:
    x, y, s = ((1.0 - part) * start + part * end).tolist()
    return x / s, y / s


def ink_of(lines: tuple[Line, ...], width: int, height: int) -> Ink:
    """The lines, smooth and on a dark border, so that they are seen on any picture."""
    image = Image.new("RGBA", (_FINE * width, _FINE * height))
    draw = ImageDraw.Draw(image)
    for line in lines:
        alpha = round(255 * line.opacity)
        for colour, wider in (((0, 0, 0, alpha * 2 // 3), _HALO - _CORE), ((*line.colour, alpha), 0)):
            for start, end in _dashes(line) if line.dashed else [(line.start, line.end)]:
                draw.line((*_fine(start), *_fine(end)), colour, _CORE + wider)
            if line.arrives:
                x, y = _fine(line.end)
                r = _DOT // (2 if line.dashed else 1) + wider / 2
                draw.ellipse((x - r, y - r, x + r, y + r), colour)
    pixels = np.asarray(image.reduce(_FINE))
    rows, columns = np.nonzero(pixels[..., 3])
    inked = pixels[rows, columns].astype(np.float32)
    return Ink(rows, columns, inked[:, :3], inked[:, 3:] / np.float32(255))


def _fine(place: Place) -> Place:
    return _FINE * (place[0] + 0.5) - 0.5, _FINE * (place[1] + 0.5) - 0.5


def _dashes(line: Line) -> Iterator[tuple[Place, Place]]:
    """The line in pieces, with gaps between."""
    (x, y), (to_x, to_y) = line.start, line.end
    length = max(hypot(to_x - x, to_y - y), DASH)
    for step in range(int(length / (DASH + GAP)) + 1):
        begin = step * (DASH + GAP) / length
        end = min(1.0, begin + DASH / length)
        yield (
            (x + begin * (to_x - x), y + begin * (to_y - y)),
            (x + end * (to_x - x), y + end * (to_y - y)),
        )
