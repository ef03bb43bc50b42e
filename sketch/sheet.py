"""Every scene of a folder in one picture: at every stage, the contact sheet, or at one, the gallery."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from raytracer import STAGES, SceneError, interpreter, make_plan, render_scene
from sketch.overlay import AMBER, BACKDROP, BRIGHT, DIM, font, shortened, wrapped

TILE = 160
GAP, LABEL, TYPE = 8, 22, 14
_ACROSS = 4  # pictures of a gallery, side by side


def contact_sheet(scenes: tuple[Path, ...], tile: int = TILE) -> tuple[np.ndarray, list[str]]:
    """The sheet, a row a scene and a column a stage, and what is wrong with the scenes that could not be drawn."""
    columns, step = len(STAGES), tile + GAP
    image = Image.new("RGB", (GAP + columns * step, LABEL + len(scenes) * (step + LABEL)), BACKDROP)
    draw, errors = ImageDraw.Draw(image), list[str]()
    for column, stage in enumerate(STAGES):
        draw.text((GAP + column * step, 3), shortened(stage, TYPE, tile), DIM, font(TYPE))
    for row, path in enumerate(scenes):
        y = LABEL + row * (step + LABEL)
        draw.text((GAP, y), shortened(path.stem, TYPE, image.width // 2 - 2 * GAP), BRIGHT, font(TYPE))
        with _noting(errors, path, draw, (2 * GAP, y + LABEL + GAP), image.width - 4 * GAP):
            scene = interpreter(path)
            for column, stage in enumerate(STAGES):
                picture = Image.fromarray(render_scene(scene, stage, tile, tile))
                image.paste(picture, (GAP + column * step, y + LABEL))
            warning = shortened("; ".join(make_plan(scene).warnings), TYPE, image.width // 2)
            draw.text((image.width - GAP, y), warning, AMBER, font(TYPE), anchor="ra")
    return np.asarray(image), errors


def gallery(scenes: tuple[Path, ...], stage: str, tile: int = TILE) -> tuple[np.ndarray, list[str]]:
    """All scenes at one stage, some side by side, and what is wrong with those that could not be drawn."""
    across, step = min(_ACROSS, len(scenes)), tile + GAP
    rows = -(-len(scenes) // across)
    image = Image.new("RGB", (GAP + across * step, GAP + rows * (step + LABEL)), BACKDROP)
    draw, errors = ImageDraw.Draw(image), list[str]()
    for place, path in enumerate(scenes):
        x, y = GAP + place % across * step, GAP + place // across * (step + LABEL)
        draw.text((x, y), shortened(path.stem, TYPE, tile), BRIGHT, font(TYPE))
        with _noting(errors, path, draw, (x, y + LABEL), tile):
            image.paste(Image.fromarray(render_scene(interpreter(path), stage, tile, tile)), (x, y + LABEL))
    return np.asarray(image), errors


@contextmanager
def _noting(
    errors: list[str], path: Path, draw: ImageDraw.ImageDraw, place: tuple[int, int], width: int
) -> Iterator[None]:
    """Write what is wrong with a scene where its picture would be."""
    try:
        yield
    except (SceneError, OSError, MemoryError) as error:
        errors.append(str(error))
        message = wrapped(str(error).replace(str(path), path.name), TYPE, width)
        draw.multiline_text(place, "\n".join(message), AMBER, font(TYPE))
