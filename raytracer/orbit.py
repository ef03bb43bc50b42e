"""The camera about the scene: about which point, and what it sees from there.

The camera is a turntable's: it goes round an axis that points up in its own view, and over it from pole to pole. Every
view is computed anew from the file's camera, so that no rounding adds up.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from raytracer.camera import focal_length, make_raster
from raytracer.scene import Camera, Scene, Vector, vector


def turned(camera: Camera, pivot: Vector, around: float = 0.0, over: float = 0.0, distance: float = 1.0) -> Camera:
    """The camera taken round the pivot as one rigid body: so far about its up v, then about its right u, in radians.

    And to so many times its distance. Angles are a right hand's; in a frame that is a mirror image, a left one's. A
    camera that would be of no use stays where it is: one beyond float64, or of a frame so flat that rounding has made a
    plane of it.
    """
    with np.errstate(all="ignore"):
        rotation = _rotation(camera, around, over)
        arm = distance * (rotation @ (np.array(camera.eye) - pivot))
        u, v, w = (vector(rotation @ axis) for axis in (camera.u, camera.v, camera.w))
        there = Camera(vector(arm + pivot), u, v, w, camera.fov)
    return there if _is_usable(there) else camera


def _rotation(camera: Camera, around: float, over: float) -> np.ndarray:
    frame, _ = _unit_frame(camera)
    hand = -1.0 if np.linalg.det(frame) < 0 else 1.0
    u, v, _ = hand * frame
    rotation: np.ndarray = _about(v, around) @ _about(u, over)
    return rotation


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """The rotation about a unit vector (O. Rodrigues, 1840)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: np.ndarray = np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * (cross @ cross)
    return rotation


def _unit_frame(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """u, v and w as rows of length 1, and how long they were."""
    frame = np.array([camera.u, camera.v, camera.w])
    size = np.abs(frame).max(axis=1, keepdims=True)
    unit = frame / size
    lengths = _length(unit)[:, None]
    return unit / lengths, (lengths * size)[:, 0]


def _length(vectors: np.ndarray) -> np.ndarray:
    """Also of vectors whose squares are beyond float64."""
    x, y, z = vectors.T
    length: np.ndarray = np.hypot(np.hypot(x, y), z)
    return length


def _is_usable(camera: Camera) -> bool:
    try:
        make_raster(camera, 1, 1)
    except ValueError:
        return False
    return True


def pivot_of(scene: Scene) -> Vector:
    """The middle of what the file's own view shows: of the shapes that lie wholly ahead, centre within the picture.

    Each counts by the room that it takes in the picture, and depths by their logarithms, so that neither a ground of
    any size nor a sky of far stars pulls the pivot away. Where there is no such shape, the pivot lies straight ahead.
    """
    camera, centres, radii = scene.camera, *_balls(scene)
    with np.errstate(all="ignore"):
        offsets = centres - camera.eye
        depth, inside = _in_picture(camera, offsets)
        counts = inside & (depth > radii) & np.isfinite(depth)
        if not counts.any():
            return vector(np.array(camera.eye) - _unit_frame(camera)[0][2] * _reach(offsets, radii))
        offsets, depth, room = offsets[counts], depth[counts, None], (radii / depth)[counts, None]
        room = (room / room.max()) ** 2
        middle = (room * (offsets / depth)).sum(axis=0) / room.sum()
        return vector(camera.eye + middle * np.exp((room * np.log(depth)).sum() / room.sum()))


def _balls(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Centres and radii of the spheres, and of balls about the triangles."""
    corners = scene.triangles.vertices
    middles = (corners / 3).sum(axis=1)
    reach = _length((corners - middles[:, None]).reshape(-1, 3)).reshape(-1, 3).max(axis=1)
    return np.concatenate([scene.spheres.centres, middles]), np.concatenate([scene.spheres.radii, reach])


def _in_picture(camera: Camera, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ahead of the eye points are, square to u and v, and which of them a square picture shows."""
    (u, v, w), (long, high, back) = _unit_frame(camera)
    ahead = np.cross(v, u) * np.sign(w @ np.cross(u, v))
    depth = offsets @ (ahead / _length(ahead[None]))
    zoom = focal_length(camera.fov) * back / (offsets @ np.cross(v, u))
    across, up = offsets @ np.cross(v, w) * zoom / long, offsets @ np.cross(w, u) * zoom / high
    return depth, (np.abs(across) <= 1) & (np.abs(up) <= 1)


def _reach(offsets: np.ndarray, radii: np.ndarray) -> float:
    """How far away things are about the eye: the median distance of their surfaces."""
    gaps = np.abs(_length(offsets) - radii)
    gaps = gaps[(gaps > 0) & np.isfinite(gaps)]
    return float(np.median(gaps)) if len(gaps) else 1.0
