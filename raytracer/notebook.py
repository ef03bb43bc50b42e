"""What a notebook shows: a picture as a picture, a scene as a small table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from io import BytesIO
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from raytracer.scene import Colour, Material, Scene

_FIRST = 4  # of lights, materials, spheres and triangles that are shown


class Picture(np.ndarray):
    """A numpy array that a notebook shows as a picture, as long as it is uint8 (height, width, 3).

    Slices are pictures too; what is computed from one is a plain array, unless it is again of that kind.
    """

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        if array is self:  # as in picture += 1
            return self
        array = np.asarray(array)
        if return_scalar:
            return array[()]
        return array.view(Picture) if _is_picture(array) else array

    def __repr__(self) -> str:
        return repr(np.asarray(self))

    def _repr_png_(self) -> bytes | None:
        if not _is_picture(self):
            return None
        from raytracer.image import encode_png

        file = BytesIO()
        encode_png(file, np.asarray(self))
        return file.getvalue()


def _is_picture(array: np.ndarray) -> bool:
    return array.ndim == 3 and array.shape[2] == 3 and array.dtype == np.uint8 and array.size > 0


def scene_as_html(scene: Scene) -> str:
    """A table: camera, background, lights, materials and shapes, the first few of each; at once, however many."""
    camera = scene.camera
    rows = [
        ("camera", f"eye {_vector(camera.eye)}, field of view {camera.fov:g}°"),
        ("", f"right {_vector(camera.u)}, up {_vector(camera.v)}, backwards {_vector(camera.w)}"),
        ("background", _swatch(scene.background)),
        *_rows("light", scene.lights, (f"{_swatch(x.colour)} at {_vector(x.position)}" for x in scene.lights)),
        *_rows("material", scene.materials, map(_material, scene.materials)),
        *_rows(
            "sphere",
            scene.spheres,
            (f"{_swatch(x.material.diffuse)} radius {x.radius:g} at {_vector(x.centre)}" for x in scene.spheres),
        ),
        *_rows(
            "triangle",
            scene.triangles,
            (f"{_swatch(x.material.diffuse)} {', '.join(map(_vector, x.vertices))}" for x in scene.triangles),
        ),
    ]
    left = 'style="text-align: left; vertical-align: top"'
    lines = "".join(f"<tr><th scope='row' {left}>{head}</th><td {left}>{text}</td></tr>" for head, text in rows)
    return f"<table><caption {left}>{escape(repr(scene))}</caption><tbody>{lines}</tbody></table>"


def counted(count: int, word: str) -> str:
    """Such as 1 sphere, 1,000 spheres."""
    return f"{count:,} {word}{'' if count == 1 else 's'}"


def _rows(word: str, things: Sequence[object], texts: Iterable[str]) -> list[tuple[str, str]]:
    """A row for each of the first few things, and one that says how many more there are."""
    rows = [(counted(len(things), word) if k == 0 else "", text) for k, text in enumerate(islice(texts, _FIRST))]
    more = len(things) - len(rows)
    return [*rows, ("", f"and {more:,} more")] if more else rows


def _material(material: Material) -> str:
    colours = ("diffuse", "ambient", "specular")
    words = [f"{name} {_swatch(getattr(material, name))}" for name in colours if any(getattr(material, name))]
    if any(material.specular):
        words.append(f"power {material.power:g}")
    if material.k_refl:
        words.append(f"reflects {material.k_refl:g}")
    return ", ".join(words) or "black"


def _swatch(colour: Colour) -> str:
    """A small square of a colour, and its numbers."""
    bands = " ".join(f"{255 * min(max(band, 0.0), 1.0):.0f}" for band in colour)
    style = "display: inline-block; width: 0.9em; height: 0.9em; border: 1px solid #888; vertical-align: -0.1em"
    return f'<span style="{style}; background: rgb({bands})"></span> {_numbers(colour)}'


def _vector(vector: Iterable[float]) -> str:
    return f"({_numbers(vector)})"


def _numbers(numbers: Iterable[float]) -> str:
    return " ".join(f"{number:g}" for number in numbers)
