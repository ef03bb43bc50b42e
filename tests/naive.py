"""An independent tracer for the tests: its own reading, its own ray, its own formula. Slow, obvious, imports no tracer.

It reads well-behaved files only.
"""

from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np


def diffuse_picture(path: Path, width: int, height: int, shift: float = 0.0) -> np.ndarray:
    """uint8 (height, width, 3) of a scene file; `shift` is where in a pixel the ray goes through, 0 or ½."""
    return picture(read(path), width, height, shift, diffuse)


def full_picture(path: Path, width: int, height: int) -> np.ndarray:
    """The same with ambient and specular light, shadows and mirrors."""
    return picture(read(path), width, height, 0.0, full)


def picture(scene: dict, width: int, height: int, shift: float, look: Callable) -> np.ndarray:
    rays = directions(scene, width, height, shift).reshape(-1, 3)
    unit = rays / np.linalg.norm(rays, axis=1)[:, None]
    origins = np.broadcast_to(np.array(scene["eye"], float), unit.shape)
    colours = colours_of(scene, origins, unit, np.full(len(unit), -1), look, 10)
    return np.floor(255 * np.clip(colours, 0, 1) + 0.5).astype(np.uint8).reshape(height, width, 3)


def colours_of(
    scene: dict, origins: np.ndarray, unit: np.ndarray, left: np.ndarray, look: Callable, reflections: int
) -> np.ndarray:
    """What comes along rays that leave the shapes with these numbers, −1 being none."""
    colours = np.broadcast_to(np.array(scene["background"], float), unit.shape).copy()
    distance, which = first_hits(scene, origins, unit, left)
    for number, (kind, *shape, material) in enumerate(scene["shapes"]):
        seen = which == number
        if seen.any():
            points = origins[seen] + distance[seen][:, None] * unit[seen]
            normals = normals_of(kind, shape, points, unit[seen])
            colours[seen] = look(scene, points, normals, unit[seen], number, np.array(material), reflections)
    return colours


def first_hits(scene: dict, origins: np.ndarray, unit: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances and numbers of shapes. A shape that a ray leaves is met again only from inside a sphere."""
    nearest, which = np.full(len(unit), np.inf), np.full(len(unit), -1)
    for number, (kind, *shape, _) in enumerate(scene["shapes"]):
        distance = (sphere_distance if kind == "sphere" else triangle_distance)(origins, unit, *shape)
        own = left == number
        if kind == "sphere":
            inwards = ((origins - shape[0]) * unit).sum(axis=1)
            distance = np.where(own, np.where(inwards < 0, -2 * inwards, np.inf), distance)
        else:
            distance = np.where(own, np.inf, distance)
        closer = (distance < nearest) & ((left < 0) | (distance > 1e-11))
        nearest, which = np.where(closer, distance, nearest), np.where(closer, number, which)
    return nearest, which


def diffuse(scene, points, normals, unit, number, material, reflections) -> np.ndarray:
    return shade(points, normals, material[0:3], scene["lights"])


def full(scene, points, normals, unit, number, material, reflections) -> np.ndarray:
    """ambient + k_refl · C of the mirrored ray + what the lights add that nothing hides."""
    total, left = np.broadcast_to(material[3:6], points.shape).copy(), np.full(len(points), number)
    for position, colour in scene["lights"]:
        to_light = np.array(position) - points
        far = np.linalg.norm(to_light, axis=1)
        to_light /= far[:, None]
        lit = first_hits(scene, points, to_light, left)[0] >= far
        half = to_light - unit
        half /= np.maximum(np.linalg.norm(half, axis=1), 1e-300)[:, None]
        cosine = np.maximum(0, (normals * to_light).sum(axis=1))[:, None]
        shine = np.maximum(0, (normals * half).sum(axis=1))[:, None]
        added = material[0:3] * cosine + material[6:9] * shine ** material[9]
        total += np.where(lit[:, None], np.array(colour) * added, 0)
    if material[10] > 0 and reflections > 0:
        mirrored = unit - 2 * (normals * unit).sum(axis=1)[:, None] * normals
        total += material[10] * colours_of(scene, points, mirrored, left, full, reflections - 1)
    return total


def read(path: Path) -> dict:
    scene = {
        "background": [0, 0, 0], "eye": [0, 0, 0], "fov": [60], "uvw": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "lights": [], "shapes": [],
    }  # fmt: skip
    material, corners = None, []
    for line in path.read_text().splitlines():
        command, *words = line.partition("#")[0].split() or [""]
        if command in ("background", "eye", "fov", "uvw"):
            scene[command] = [float(word) for word in words]
        elif command == "light":
            scene["lights"].append(([float(word) for word in words[:3]], [float(word) for word in words[3:]]))
        elif command == "surface":
            material = [float(word) for word in words]
        elif command == "sphere":
            radius, *centre = (float(word) for word in words)
            scene["shapes"].append(("sphere", np.array(centre), radius, material))
        elif command == "vertex":
            corners.append([float(word) for word in words])
        elif command == "end":
            scene["shapes"].append(("triangle", np.array(corners), material))
            corners = []
    return scene


def directions(scene: dict, width: int, height: int, shift: float) -> np.ndarray:
    """Not normalised, (height, width, 3)."""
    ys, xs = np.mgrid[0:height, 0:width] + shift
    u, v, w = np.array(scene["uvw"], float).reshape(3, 3)
    distance = focal_length(scene["fov"][0])
    across, up = (2 * xs - width) / height, (height - 2 * ys) / height
    return across[..., None] * u + up[..., None] * v - distance * w


def focal_length(fov: float) -> float:
    """1 / tan(fov / 2), rounded once: in some of the course's scenes rays are tangent but for its last digit."""
    with mpmath.workprec(200):
        return float(mpmath.cot(mpmath.mpf(fov) * mpmath.pi / 360))


def sphere_distance(origins: np.ndarray, unit: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Where unit rays meet a sphere, by projecting its centre onto the ray; inf for a miss."""
    to_centre = centre - origins
    along = (unit * to_centre).sum(axis=1)
    beside = to_centre - along[:, None] * unit
    half_chord2 = radius**2 - (beside**2).sum(axis=1)
    half_chord = np.sqrt(np.maximum(half_chord2, 0))
    near, far = along - half_chord, along + half_chord
    distance = np.where(near > 0, near, far)
    return np.where((half_chord2 >= 0) & (distance > 0), distance, np.inf)


def triangle_distance(origins: np.ndarray, unit: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Where unit rays meet a triangle, by barycentric coordinates; inf for a miss."""
    edge, other = corners[1] - corners[0], corners[2] - corners[0]
    across = np.cross(unit, other)
    determinant = across @ edge
    from_corner = origins - corners[0]
    beside = np.cross(from_corner, edge)
    with np.errstate(all="ignore"):
        u, v = (across * from_corner).sum(axis=1) / determinant, (unit * beside).sum(axis=1) / determinant
        distance = beside @ other / determinant
        within = (u >= -1e-14) & (v >= -1e-14) & (u + v <= 1 + 1e-14)
    return np.where(within & (distance > 0), distance, np.inf)


def normals_of(kind: str, shape: list, points: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """A sphere's outwards, a triangle's towards the viewer."""
    if kind == "sphere":
        return (points - shape[0]) / shape[1]
    corners = shape[0]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    return np.where((unit @ normal)[:, None] > 0, -normal, normal)


def shade(points: np.ndarray, normals: np.ndarray, colour: list, lights: list) -> np.ndarray:
    total = np.zeros_like(points)
    for position, light_colour in lights:
        to_light = np.array(position) - points
        to_light /= np.linalg.norm(to_light, axis=-1, keepdims=True)
        cosine = np.maximum(0, (normals * to_light).sum(axis=-1))
        total += np.multiply(colour, light_colour) * cosine[:, None]
    return total
