"""Who else draws the pictures that `bench` measures: one function and one row of `PEERS` each.

A peer's function is given a scene and a picture's size, gets ready, and returns what draws the scene from a camera, as
often as it is asked to. What it draws is stage diffuse: the nearest sphere, all lights, no shadows, in bytes.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from math import floor, inf, radians, sqrt, tan
from multiprocessing import get_context
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from raytracer.scene import Camera, Light, Scene, Spheres

Draw = Callable[[Camera], np.ndarray]  # uint8 (height, width, 3)

_LOOP_TESTS = 300_000  # rays against spheres of one call of the Python loop: some tenths of a second


class Peer(NamedTuple):
    """One row of `PEERS`."""

    name: str
    draws: str  # what it draws, and what is different
    called: str  # how it is called
    why_not: Callable[[], str]  # what keeps it from drawing here; nothing if nothing does
    ready: Callable[[Scene, int, int], Draw] | None  # None: it never can
    most: int  # spheres: getting ready for more takes it minutes
    same: bool  # its picture is ours, within 1 a byte


# ------------------------------------------------------------------------------------------------ the guide's own loop


@dataclass
class Ray:
    origin: list[float]
    direction: list[float]

    def at(self, t: float) -> list[float]:
        return [o + t * d for o, d in zip(self.origin, self.direction, strict=True)]


@dataclass
class Sphere:
    centre: list[float]
    radius: float
    colour: list[float]

    def intersect(self, ray: Ray) -> float:
        """t = (−b ± √(b² − 4ac)) / 2a, the smallest above 0; inf for a miss."""
        dx, dy, dz = ray.direction
        x, y, z = ray.origin[0] - self.centre[0], ray.origin[1] - self.centre[1], ray.origin[2] - self.centre[2]
        a, b = dx * dx + dy * dy + dz * dz, 2 * (dx * x + dy * y + dz * z)
        disc = b * b - 4 * a * (x * x + y * y + z * z - self.radius * self.radius)
        if disc < 0:
            return inf
        near, far = (-b - sqrt(disc)) / (2 * a), (-b + sqrt(disc)) / (2 * a)
        return near if near > 0 else far if far > 0 else inf


@dataclass
class Hit:
    t: float
    sphere: Sphere | None


def python_loop(scene: Scene, width: int, height: int) -> Draw:
    """For every pixel, for every sphere; of a picture that is small enough for it to end soon."""
    width, height = small_size(len(scene.spheres), width, height)
    table = scene.spheres
    colours = table.materials.table[table.material, 0:3].tolist()
    rows = zip(table.centres.tolist(), table.radii.tolist(), colours, strict=True)
    spheres = [Sphere(centre, radius, colour) for centre, radius, colour in rows]

    def draw(camera: Camera) -> np.ndarray:
        picture = []
        for y in range(height):
            for x in range(width):
                ray = eye_ray(camera, (2 * x - width) / height, (height - 2 * y) / height)
                picture.append(shade(ray, nearest_hit(ray, spheres), scene))
        return np.array(picture, np.uint8).reshape(height, width, 3)

    return draw


def small_size(spheres: int, width: int, height: int) -> tuple[int, int]:
    """Of about that picture's shape, and never larger, but at least one pixel."""
    pixels = max(1.0, _LOOP_TESTS / max(spheres, 1))
    rows = max(1, min(height, int(sqrt(pixels * height / width))))
    return max(1, min(width, int(pixels / rows))), rows


def eye_ray(camera: Camera, across: float, up: float) -> Ray:
    distance = 1 / tan(radians(camera.fov) / 2)
    axes = zip(camera.u, camera.v, camera.w, strict=True)
    return Ray(list(camera.eye), [across * u + up * v - distance * w for u, v, w in axes])


def nearest_hit(ray: Ray, spheres: list[Sphere]) -> Hit:
    hit = Hit(inf, None)
    for sphere in spheres:
        t = sphere.intersect(ray)
        if t < hit.t:
            hit = Hit(t, sphere)
    return hit


def shade(ray: Ray, hit: Hit, scene: Scene) -> list[int]:
    colour = list(scene.background)
    if hit.sphere is not None:
        point = ray.at(hit.t)
        normal = unit([p - c for p, c in zip(point, hit.sphere.centre, strict=True)])
        colour = [0.0, 0.0, 0.0]
        for light in scene.lights:
            to_light = unit([q - p for q, p in zip(light.position, point, strict=True)])
            cosine = max(0.0, sum(n * d for n, d in zip(normal, to_light, strict=True)))
            for k in range(3):
                colour[k] += hit.sphere.colour[k] * light.colour[k] * cosine
    return [floor(255 * min(max(c, 0.0), 1.0) + 0.5) for c in colour]


def unit(v: list[float]) -> list[float]:
    length = sqrt(sum(x * x for x in v))
    return [x / length for x in v]


# ------------------------------------------------------------------------------------------------ apart

Ready = Callable[[Scene, int, int], Draw]

_there: tuple[Draw, np.ndarray] | None = None  # in a peer's own process: how it draws, and where


def apart(ready: Ready, scene: Scene, width: int, height: int) -> Draw:
    """A peer in a process of its own: its threads, waiting for work, would slow down those of the others.

    What it draws is copied to memory that both processes share, the same for each picture. That is in its time.
    """
    folder = TemporaryDirectory()
    place = str(Path(folder.name) / "picture")
    picture = np.memmap(place, np.uint8, "w+", shape=(height, width, 3))
    process = ProcessPoolExecutor(1, get_context("spawn"), _get_ready, (ready, scene, width, height, place))
    process.submit(int).result()  # so that no picture is waited for until it is ready
    return partial(_draw_apart, process, picture, folder)


def _draw_apart(process: Executor, picture: np.ndarray, folder: TemporaryDirectory[str], camera: Camera) -> np.ndarray:
    process.submit(_draw_there, camera).result()
    return picture


def _get_ready(ready: Ready, scene: Scene, width: int, height: int, place: str) -> None:
    global _there
    _there = ready(scene, width, height), np.memmap(place, np.uint8, "r+", shape=(height, width, 3))


def _draw_there(camera: Camera) -> None:
    assert _there is not None
    draw, picture = _there
    picture[:] = draw(camera)


# ------------------------------------------------------------------------------------------------ Mitsuba


def mitsuba(scene: Scene, width: int, height: int) -> Draw:
    """Its shapes and its ray tracer, and around them our rays and two lights in its own arrays: one compiled loop.

    The shape that is hit is known by its number; to ask Mitsuba's shape itself is several times as slow.
    """
    mi, dr = import_module("mitsuba"), import_module("drjit")
    mi.set_variant("llvm_ad_rgb")
    table = scene.spheres
    world = mi.load_dict({"type": "scene", **{f"{k}": row for k, row in enumerate(_mitsuba_spheres(table))}})
    numbers = np.array(dr.reinterpret_array(mi.UInt32, world.shapes_dr())).astype(np.int64)
    first = int(numbers.min())
    place = np.zeros(int(numbers.max()) - first + 1, np.int64)
    place[numbers - first] = [int(shape.id()) for shape in world.shapes()]
    centres = _mitsuba_floats(mi, table.centres[place])
    sizes = _mitsuba_floats(mi, 1 / table.radii[place])
    colours = _mitsuba_floats(mi, table.materials.table[table.material[place], 0:3])

    def draw(camera: Camera) -> np.ndarray:
        pixel = dr.arange(mi.UInt32, width * height)
        ray = _mitsuba_rays(mi, dr, camera, pixel, width, height)
        found = world.ray_intersect_preliminary(ray, coherent=True)
        hit = found.is_valid()
        sphere = dr.reinterpret_array(mi.UInt32, found.shape) - first
        point = ray(found.t)
        normal = (point - dr.gather(mi.Point3f, centres, sphere, hit)) * dr.gather(mi.Float, sizes, sphere, hit)
        diffuse = dr.gather(mi.Color3f, colours, sphere, hit)
        colour = dr.select(hit, diffuse * _mitsuba_light(mi, dr, scene.lights, point, normal), scene.background)
        picture = dr.zeros(mi.UInt8, 3 * width * height)
        for k in range(3):
            level = dr.select(colour[k] < 1, colour[k], 1) * 255 + 0.5
            dr.scatter(picture, mi.UInt8(level), 3 * pixel + k)
        return np.array(picture).reshape(height, width, 3)

    return draw


def _mitsuba_spheres(table: Spheres) -> list[dict[str, object]]:
    rows = zip(table.centres.tolist(), table.radii.tolist(), strict=True)
    return [{"type": "sphere", "center": centre, "radius": radius} for centre, radius in rows]


def _mitsuba_floats(mi: Any, numbers: np.ndarray) -> Any:
    return mi.Float(np.ascontiguousarray(numbers, np.float32).ravel())


def _mitsuba_rays(mi: Any, dr: Any, camera: Camera, pixel: Any, width: int, height: int) -> Any:
    across = (2 * mi.Float(pixel % width) - width) / height
    up = (height - 2 * mi.Float(pixel // width)) / height
    distance = 1 / tan(radians(camera.fov) / 2)
    axes = zip(camera.u, camera.v, camera.w, strict=True)
    direction = mi.Vector3f(*(across * u + up * v - distance * w for u, v, w in axes))
    # The eye goes in as data, not as a literal: a moved camera must not compile the loop anew.
    return mi.Ray3f(mi.Point3f(*(dr.opaque(mi.Float, x) for x in camera.eye)), dr.normalize(direction))


def _mitsuba_light(mi: Any, dr: Any, lights: tuple[Light, ...], point: Any, normal: Any) -> Any:
    """Σ light · max(0, N·L); written without minimum and maximum, which LLVM before 16 cannot compile."""
    total = mi.Color3f(0)
    for light in lights:
        cosine = dr.dot(normal, dr.normalize(mi.Point3f(light.position) - point))
        total += mi.Color3f(light.colour) * dr.select(cosine > 0, cosine, 0)
    return total


_PROBE = """
from raytracer.bench import spread
from raytracer.peers import mitsuba
scene = spread(3)
mitsuba(scene, 8, 8)(scene.camera)
"""


def why_not_mitsuba() -> str:
    """Tried in a process of its own: where LLVM does not suit it, it ends the process."""
    if find_spec("mitsuba") is None:
        return "mitsuba is not installed"
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parent.parent)}
    tried = subprocess.run([sys.executable, "-c", _PROBE], env=here, capture_output=True, text=True, check=False)
    if tried.returncode == 0:
        return ""
    return f"mitsuba is installed, but cannot draw: {first_fault(tried.stderr)}"


def first_fault(errors: str) -> str:
    """The line of a failed run's errors that names the fault."""
    lines = [line.strip() for line in errors.splitlines() if line.strip()]
    faults = [line for line in lines if re.match(r"[\w. ]*(error|exception)\b", line, re.IGNORECASE)]
    return (faults or lines or ["it ended without a word"])[0]


# ------------------------------------------------------------------------------------------------ Embree


def why_not_embreex() -> str:
    if find_spec("embreex") is None:
        return "embreex is not installed; its bindings have no spheres, so it could not draw this picture"
    return "embreex is installed, but its bindings build meshes only: no spheres, so it cannot draw this picture"


# ------------------------------------------------------------------------------------------------ all of them


def nothing() -> str:
    return ""


PEERS = (
    Peer(
        "Python loop",
        "the same picture, a small one; its time is extrapolated to the size named",
        "the guide's loop over pixels and spheres: plain floats, classes Ray, Sphere and Hit, the textbook's quadratic",
        nothing,
        python_loop,
        1_000_000,
        True,
    ),
    Peer(
        "Mitsuba 3",
        "the same picture in float32, no decision checked; its BVH takes rays of any origin, and was built beforehand",
        "as a library, llvm_ad_rgb: sphere shapes, ray_intersect_preliminary with our eye rays, our lights in drjit",
        why_not_mitsuba,
        partial(apart, mitsuba),
        10_000,
        False,
    ),
    Peer("embreex", "nothing here", "not at all", why_not_embreex, None, 0, False),
)


# ------------------------------------------------------------------------------------------------ POV-Ray's parser


def why_not_povray() -> str:
    return "" if which("povray") else "povray is not on the PATH"


def write_pov(scene: Scene, path: Path) -> None:
    """The scene as POV-Ray's parser likes it best: one default texture for each run of spheres of one material."""
    table, current = scene.spheres, -1
    with path.open("w", encoding="ascii") as file:
        file.write("#version 3.7;\n")
        for light in scene.lights:
            file.write(f"light_source {{ {_pov(light.position)}, rgb {_pov(light.colour, 1)} }}\n")
        rows = zip(table.centres.tolist(), table.radii.tolist(), table.material.tolist(), strict=True)
        for centre, radius, material in rows:
            if material != current:
                current = material
                colour = _pov(table.materials[material].diffuse, 1)
                file.write(f"#default {{ pigment {{ rgb {colour} }} finish {{ ambient 0 diffuse 1 }} }}\n")
            file.write(f"sphere {{ {_pov(centre)}, {radius!r} }}\n")


def _pov(vector: list[float] | tuple[float, float, float], forward: int = -1) -> str:
    """Its z points away from the eye."""
    x, y, z = vector
    return f"<{x!r}, {y!r}, {forward * z!r}>"


def povray_parse_seconds(path: Path) -> float:
    """What POV-Ray's own statistics say that it took to parse a file. ValueError if they do not say.

    Without bounding boxes (-MB), whose making would come after the parsing and take longer.
    """
    with TemporaryDirectory() as folder:
        command = ["povray", f"+I{path.resolve()}", "+W1", "+H1", "-MB", "-F", "-D"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return parse_seconds(done.stdout + done.stderr)


def parse_seconds(statistics: str) -> float:
    found = re.search(r"Parse Time:.*\(([\d.]+) seconds\)", statistics)
    if found is None:
        raise ValueError(f"povray: {first_fault(statistics)}")
    return float(found[1])


def empty(scene: Scene) -> Scene:
    """The same scene without its spheres."""
    return replace(scene, spheres=Spheres())
