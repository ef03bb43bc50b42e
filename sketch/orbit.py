"""The camera about the scene: how far it has been turned and moved, about which point, and what it sees from there.

The camera is a turntable's: it goes round an axis that points up in the file's own view, and over it from pole to pole.
Every view is computed anew from the file's camera, so that no rounding adds up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin

import numpy as np

from raytracer import Camera, Scene
from raytracer.camera import focal_length, make_raster
from raytracer.scene import Vector, vector

HALF_TURN = 360  # pixels that the mouse goes for half a turn
POLE = HALF_TURN // 2  # pixels from the file's own view to the scene seen from right above
DOUBLE = 8  # notches of the wheel that double the distance, or halve it
FARTHEST = 10 * DOUBLE  # notches, either way


@dataclass(frozen=True)
class Orbit:
    """The way from the file's own view, in whole pixels and notches: the way back ends where it began."""

    right: int = 0  # pixels that the mouse has pulled the scene's near side
    down: int = 0
    nearer: int = 0  # notches

    def pulled(self, right: int, down: int) -> Orbit:
        """So many pixels farther: round and round, but not over the poles."""
        once_round = (self.right + right + HALF_TURN) % (2 * HALF_TURN) - HALF_TURN
        return replace(self, right=once_round, down=min(max(self.down + down, -POLE), POLE))

    def moved(self, notches: int) -> Orbit:
        """So many notches nearer: each by the same part of the distance, so that the eye never arrives."""
        return replace(self, nearer=min(max(self.nearer + notches, -FARTHEST), FARTHEST))


HOME = Orbit()


def seen_from(scene: Scene, orbit: Orbit, pivot: Vector | None = None) -> Scene:
    """The same shapes seen from elsewhere; at HOME the very same scene. `pivot` is for whoever knows it already."""
    if orbit == HOME:
        return scene
    return replace(scene, camera=turned(scene.camera, orbit, pivot or pivot_of(scene)))


def turned(camera: Camera, orbit: Orbit, pivot: Vector) -> Camera:
    """The camera taken round the pivot as one rigid body, and nearer to it or farther away.

    A camera that would be of no use stays where it is: one beyond float64, or of a frame so flat that rounding has made
    a plane of it.
    """
    with np.errstate(all="ignore"):
        rotation = _rotation(camera, orbit)
        arm = 2.0 ** (-orbit.nearer / DOUBLE) * (rotation @ (np.array(camera.eye) - pivot))
        u, v, w = (vector(rotation @ axis) for axis in (camera.u, camera.v, camera.w))
        there = Camera(vector(arm + pivot), u, v, w, camera.fov)
    return there if _is_usable(there) else camera


def _rotation(camera: Camera, orbit: Orbit) -> np.ndarray:
    """What makes the near side of the scene follow the mouse, in a frame that is a mirror image too."""
    frame, _ = _unit_frame(camera)
    hand = -1.0 if np.linalg.det(frame) < 0 else 1.0
    u, v, _ = hand * frame
    angle = -pi / HALF_TURN  # the camera goes the other way
    return _about(v, angle * orbit.right) @ _about(u, angle * orbit.down)


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """The rotation about a unit vector (O. Rodrigues, 1840)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + sin(angle) * cross + (1 - cos(angle)) * (cross @ cross)


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
    return np.hypot(np.hypot(x, y), z)


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
