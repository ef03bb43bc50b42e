"""A ray tracer for the course's scenes: from a `.cli` file to a picture, every decision certain.

    text ──interpreter──> Scene ──make_plan──> Plan ──trace──> hits ──STAGES──> colours ──to_bytes──> picture

    >>> from raytracer import interpreter, render_scene, save_png
    >>> save_png("sphere.png", render_scene(interpreter("scenes/01_one_sphere.cli")))

* scenes: `interpreter` reads a `.cli` file into a `Scene`, or raises `SceneError`
* pictures: `render_scene`, at any of `STAGES`, by any of `METHODS`; `save_png`, `load_png`
* hits: `eye_hits` of a picture's rays, `ray_intersect_scene` of any rays
* reasons: `make_plan` says what drawing takes and why, `probe_pixel` tells a pixel's story

The compiler (numba) is loaded when the first picture is drawn, not by this import.
"""

import sys

if sys.argv[:1] == ["-m"]:  # `python -m raytracer`, on its way to `__main__`, which takes over
    from raytracer.interrupts import end_at_once

    end_at_once()

from raytracer.arrays import Hits
from raytracer.image import PictureTooLargeError, load_png, save_png
from raytracer.interpreter import SceneError, interpreter
from raytracer.methods import METHODS, Method
from raytracer.plan import Plan, make_plan
from raytracer.probe import Pixel, probe_pixel
from raytracer.render import Cancelled, eye_hits, render_scene
from raytracer.scene import Camera, Light, Material, Scene, Sphere, Triangle
from raytracer.stages import STAGES, Block, Stage
from raytracer.trace import ray_intersect_scene

__all__ = [
    "METHODS",
    "STAGES",
    "Block",
    "Camera",
    "Cancelled",
    "Hits",
    "Light",
    "Material",
    "Method",
    "PictureTooLargeError",
    "Pixel",
    "Plan",
    "Scene",
    "SceneError",
    "Sphere",
    "Stage",
    "Triangle",
    "eye_hits",
    "interpreter",
    "load_png",
    "make_plan",
    "probe_pixel",
    "ray_intersect_scene",
    "render_scene",
    "save_png",
]
