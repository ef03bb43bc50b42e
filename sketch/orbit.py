"""The camera about the scene: how far the mouse has turned and moved it, in whole pixels and notches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

from raytracer import Camera, Scene
from raytracer import orbit as core
from raytracer.orbit import pivot_of
from raytracer.scene import Vector

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
    """`raytracer.orbit.turned`, such that the near side of the scene follows the mouse."""
    angle = -pi / HALF_TURN  # the camera goes the other way
    return core.turned(camera, pivot, angle * orbit.right, angle * orbit.down, 2.0 ** (-orbit.nearer / DOUBLE))
