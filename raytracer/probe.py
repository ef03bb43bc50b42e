"""The story of one pixel: its ray, what the ray hits, and the colour that comes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from raytracer.camera import directions, eye_grid
from raytracer.image import to_bytes
from raytracer.methods import CERTIFIED
from raytracer.plan import make_plan
from raytracer.render import draw_rows, trace_whole
from raytracer.scene import Colour, Scene, Shape, Sphere, Vector, vector
from raytracer.stages import Block
from raytracer.trace import polished_rows


@dataclass(frozen=True)
class Pixel:
    """What `probe_pixel` found. Of a ray that hits nothing, index is −1 and what belongs to a hit is None."""

    x: int  # column, from the left
    y: int  # row, from the top
    stage: str
    eye: Vector
    direction: Vector
    index: int  # the shape's place among all shapes of the file
    shape: Shape | None
    t: float
    point: Vector | None
    normal: Vector | None
    colour: Colour  # as the stage computed it, neither clipped nor rounded
    rgb: tuple[int, int, int]  # as it is drawn

    def lines(self) -> list[str]:
        """The story in words, a line each."""
        story = [f"pixel {self.x} {self.y}", f"ray from {_numbers(self.eye)} along {_numbers(self.direction)}"]
        if self.shape is None:
            story += ["hits nothing"]
        else:
            story += [f"hits shape {self.index}, {_describe(self.shape)}", f"at t = {self.t!r}"]
        if self.point is not None and self.normal is not None:
            story += [f"point {_numbers(self.point)}", f"normal {_numbers(self.normal)}"]
        return [*story, f"{self.stage}: colour {_numbers(self.colour)}", f"drawn as {_numbers(self.rgb)}"]


def probe_pixel(
    scene: Scene,
    x: int,
    y: int,
    width: int = 320,
    height: int = 320,
    stage: str = "diffuse",
    sampling: str = "corner",
    method: str = CERTIFIED,
) -> Pixel:
    """The story of the pixel in column x and row y, counted from the top left; ValueError if there is none such."""
    if not (0 <= x < width and 0 <= y < height):
        raise ValueError(f"found pixel {x} {y}, expected one within 0 0 and {width - 1} {height - 1}")
    plan = make_plan(scene, stage, width, height, sampling, method)
    row = slice(y, y + 1)
    rays, hits = directions(eye_grid(plan.raster, row)), polished_rows(plan.eye, row)
    block = Block(scene, plan.raster, row, hits, plan.lights)
    colour = draw_rows(plan, row, trace_whole(plan) if plan.stage.needs_whole else None)[0, x]
    index, point, normal = int(hits.index[0, x]), None, None
    if index >= 0:
        k = np.count_nonzero(block.hit[0, :x])
        point, normal = vector(block.points[k]), vector(block.normals[k])
    return Pixel(
        x, y, stage, scene.camera.eye, vector(np.array(rays)[:, 0, x]),
        index, scene.shape(index) if index >= 0 else None, float(hits.t[0, x]), point, normal,
        vector(colour), _bytes(to_bytes(colour)),
    )  # fmt: skip


def _describe(shape: Shape) -> str:
    if isinstance(shape, Sphere):
        return f"a sphere of radius {shape.radius!r} about {_numbers(shape.centre)}"
    return "a triangle " + ", ".join(_numbers(vertex) for vertex in shape.vertices)


def _numbers(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"


def _bytes(row: np.ndarray) -> tuple[int, int, int]:
    red, green, blue = row.tolist()
    return red, green, blue
