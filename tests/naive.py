"""An independent tracer for the tests: its own reading, its own ray, its own formula. Slow, obvious, imports no tracer.

Only what the course's part A needs: spheres, diffuse light, a well-behaved file.
"""

from pathlib import Path

import mpmath
import numpy as np


def diffuse_picture(path: Path, width: int, height: int, shift: float = 0.0) -> np.ndarray:
    """uint8 (height, width, 3) of a scene file; `shift` is where in a pixel the ray goes through, 0 or ½."""
    scene = read(path)
    rays = directions(scene, width, height, shift)
    lengths = np.linalg.norm(rays, axis=-1)
    unit = rays / lengths[..., None]
    nearest = np.full((height, width), np.inf)
    colours = np.broadcast_to(np.array(scene["background"]), (height, width, 3)).copy()
    eye = np.array(scene["eye"], float)
    for kind, *shape, material in scene["shapes"]:
        distance = (sphere_distance if kind == "sphere" else triangle_distance)(eye, unit, *shape)
        closer = distance < nearest
        nearest = np.where(closer, distance, nearest)
        points = eye + distance[closer][:, None] * unit[closer]
        normals = normals_of(kind, shape, points, unit[closer])
        colours[closer] = shade(points, normals, material[0:3], scene["lights"])
    return np.floor(255 * np.clip(colours, 0, 1) + 0.5).astype(np.uint8)


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


def sphere_distance(eye: np.ndarray, unit: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Where unit rays meet a sphere, by projecting its centre onto the ray; inf for a miss."""
    to_centre = centre - eye
    along = unit @ to_centre
    beside = to_centre - along[..., None] * unit
    half_chord2 = radius**2 - (beside**2).sum(axis=-1)
    half_chord = np.sqrt(np.maximum(half_chord2, 0))
    near, far = along - half_chord, along + half_chord
    distance = np.where(near > 0, near, far)
    return np.where((half_chord2 >= 0) & (distance > 0), distance, np.inf)


def triangle_distance(eye: np.ndarray, unit: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Where unit rays meet a triangle, by barycentric coordinates; inf for a miss."""
    edge, other = corners[1] - corners[0], corners[2] - corners[0]
    across = np.cross(unit, other)
    determinant = across @ edge
    from_corner = eye - corners[0]
    beside = np.cross(from_corner, edge)
    with np.errstate(all="ignore"):
        u, v = across @ from_corner / determinant, (unit * beside).sum(axis=-1) / determinant
        distance = (beside * other).sum(axis=-1) / determinant
    tiny = -1e-14
    return np.where((u >= tiny) & (v >= tiny) & (u + v <= 1 - tiny) & (distance > 0), distance, np.inf)


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
