"""The contact sheet: every scene of a folder at every stage, in one picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from raytracer import STAGES, SceneError, interpreter, make_plan, render_scene
from sketch.overlay import AMBER, BACKDROP, BRIGHT, DIM, font, shortened, wrapped

TILE = 160
GAP, LABEL, TYPE = 8, 22, 14


def contact_sheet(scenes: tuple[Path, ...], tile: int = TILE) -> tuple[np.ndarray, list[str]]:
    """The sheet, a row a scene and a column a stage, and what is wrong with the scenes that could not be drawn."""
    columns, step = len(STAGES), tile + GAP
    image = Image.new("RGB", (GAP + columns * step, LABEL + len(scenes) * (step + LABEL)), BACKDROP)
    draw, errors = ImageDraw.Draw(image), []
    for column, stage in enumerate(STAGES):
        draw.text((GAP + column * step, 3), shortened(stage, TYPE, tile), DIM, font(TYPE))
    for row, path in enumerate(scenes):
        y = LABEL + row * (step + LABEL)
        draw.text((GAP, y), shortened(path.stem, TYPE, image.width // 2 - 2 * GAP), BRIGHT, font(TYPE))
        try:
            scene = interpreter(path)
            for column, stage in enumerate(STAGES):
                picture = Image.fromarray(render_scene(scene, stage, tile, tile))
                image.paste(picture, (GAP + column * step, y + LABEL))
            warning = shortened("; ".join(make_plan(scene).warnings), TYPE, image.width // 2)
            draw.text((image.width - GAP, y), warning, AMBER, font(TYPE), anchor="ra")
        except (SceneError, OSError, MemoryError) as error:
            errors.append(str(error))
            message = wrapped(str(error).replace(str(path), path.name), TYPE, image.width - 4 * GAP)
            draw.multiline_text((2 * GAP, y + LABEL + GAP), "\n".join(message), AMBER, font(TYPE))
    return np.asarray(image), errors
