"""The camera about the scene: one rigid body, whose every way back ends where it began."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from raytracer import Camera, Scene, eye_hits, interpreter, make_plan
from raytracer.camera import make_raster
from raytracer.interpreter import interpret
from raytracer.orbit import pivot_of
from sketch.orbit import FARTHEST, HALF_TURN, HOME, POLE, Orbit, seen_from, turned

SCENES = Path(__file__).resolve().parent.parent / "scenes"
SURFACE = "surface 1 0 0  0 0 0  0 0 0  1 0\n"

coordinate = st.floats(-10, 10)
vectors = st.tuples(coordinate, coordinate, coordinate)
pixels, notches = st.integers(-2000, 2000), st.integers(-300, 300)
orbits = st.builds(lambda right, down, nearer: HOME.pulled(right, down).moved(nearer), pixels, pixels, notches)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    """Of any frame: skewed, scaled, a mirror image."""
    camera = Camera(*(draw(vectors) for _ in range(4)))
    assume(abs(np.linalg.det(frame_of(camera))) > 1e-3)
    return camera


def frame_of(camera: Camera) -> np.ndarray:
    return np.array([camera.u, camera.v, camera.w])


def scene_of(text: str) -> Scene:
    return interpret(SURFACE + text)


@given(cameras(), vectors, orbits)
def test_the_camera_turns_as_a_rigid_body(camera, pivot, orbit):
    there = turned(camera, orbit, pivot)
    before, after = frame_of(camera), frame_of(there)
    assert np.allclose(after @ after.T, before @ before.T, rtol=0, atol=1e-12 * np.abs(before).max() ** 2)
    assert np.linalg.det(after) * np.linalg.det(before) > 0
    arm, arm_before = np.subtract(there.eye, pivot), np.subtract(camera.eye, pivot)
    nearer = 2.0 ** (-orbit.nearer / 8)
    assert np.linalg.norm(arm) == pytest.approx(nearer * np.linalg.norm(arm_before), rel=1e-12, abs=1e-13)
    assert np.allclose(after @ arm, nearer * (before @ arm_before), rtol=1e-12, atol=1e-11 * max(1, nearer))
    assert there.fov == camera.fov


@given(cameras(), vectors, orbits, orbits)
def test_the_way_there_does_not_matter(camera, pivot, first, orbit):
    """Nothing adds up: thousands of drags end where one would have."""
    there = first
    for step in range(3000):
        there = there.pulled(step % 7 - 3, step % 5 - 2)
    back = there.pulled(orbit.right - there.right, orbit.down - there.down).moved(orbit.nearer - there.nearer)
    assert back == orbit
    assert turned(camera, back, pivot) == turned(camera, orbit, pivot)


@given(st.integers(-(10**6), 10**6), st.integers(-POLE, POLE), st.integers(-FARTHEST, FARTHEST))
def test_there_and_back_is_home(right, down, nearer):
    assert HOME.pulled(right, down).moved(nearer).moved(-nearer).pulled(-right, -down) == HOME


def test_a_full_turn_is_home_and_the_poles_are_the_end():
    assert HOME.pulled(2 * HALF_TURN, 0) == HOME
    assert HOME.pulled(0, 10 * POLE) == Orbit(down=POLE)
    assert HOME.pulled(0, -10 * POLE) == Orbit(down=-POLE)


def test_at_home_it_is_the_files_own_scene():
    scene = interpreter(SCENES / "04_many_spheres.cli")
    assert seen_from(scene, HOME) is scene
    there = seen_from(scene, HOME.pulled(1, 0))
    assert there.spheres is scene.spheres
    assert there == replace(scene, camera=there.camera)


@given(cameras(), vectors, st.lists(notches, max_size=20))
def test_the_wheel_never_reaches_the_pivot(camera, pivot, turns):
    arm = np.subtract(camera.eye, pivot)
    assume(np.linalg.norm(arm) > 1e-6)
    orbit = HOME
    for turn in turns:
        orbit = orbit.moved(turn)
        there = turned(camera, orbit, pivot)
        assert np.dot(np.subtract(there.eye, pivot), arm) > 0
        assert (there.u, there.v, there.w) == (camera.u, camera.v, camera.w)


def test_each_notch_takes_the_same_part_of_the_distance():
    gaps = [4 + turned(Camera(), HOME.moved(n), (0.0, 0.0, -4.0)).eye[2] for n in (-8, 0, 8, 16)]
    assert gaps == [8.0, 4.0, 2.0, 1.0]


MIRRORED = Camera(u=(-1.0, 0.0, 0.0))


@pytest.mark.parametrize("camera", [Camera(), MIRRORED, Camera((3.0, 2.0, 1.0), (0.0, 0.0, -2.0), w=(5.0, 0.0, 0.0))])
def test_the_near_side_follows_the_mouse(camera):
    """A point between eye and pivot goes right and down in the picture when the mouse does."""
    pivot = np.subtract(camera.eye, 4 * np.array(camera.w))
    near = np.subtract(camera.eye, 3 * np.array(camera.w))
    for orbit, axis in ((HOME.pulled(9, 0), 0), (HOME.pulled(0, 9), 1)):
        there = turned(camera, orbit, tuple(pivot.tolist()))
        place = np.linalg.solve(frame_of(there).T, near - there.eye)
        assert np.sign(place[axis]) == (1, -1)[axis]
        assert abs(place[1 - axis]) < 1e-12


def test_a_frame_may_be_of_any_size():
    camera, orbit = Camera(u=(1.2e308, 1.2e308, 0.0), w=(0.0, 0.0, 1e-300)), HOME.pulled(0, 60)
    there = turned(camera, orbit, (0.0, 0.0, -4.0))
    assert np.divide(there.u, 1e308) == pytest.approx((1.2, 1.2, 0))
    usual = turned(Camera(u=(1.0, 1.0, 0.0)), orbit, (0.0, 0.0, -4.0))
    assert there.eye == pytest.approx(usual.eye)
    assert np.multiply(there.w, 1e300) == pytest.approx(usual.w)


def test_the_file_says_what_is_up():
    """Sideways goes round v, however far down the mouse has been."""
    camera = Camera((1.0, 2.0, 3.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    heights = [turned(camera, HOME.pulled(right, 50), (0.0, 0.0, 0.0)).eye[2] for right in range(-300, 300, 50)]
    assert np.ptp(heights) < 1e-12
    assert abs(heights[0] - camera.eye[2]) > 0.1


def test_a_camera_that_would_be_of_no_use_stays():
    flat, stays = Camera(w=(0.0, 1.0, 1e-300)), 0
    for down in range(1, 100):
        there = turned(flat, HOME.pulled(0, down), (0.0, 0.0, -4.0))
        make_raster(there, 8, 8)
        stays += there is flat
    assert stays
    far = Camera(eye=(1e306, 0.0, 0.0))
    assert turned(far, HOME.moved(-FARTHEST), (0.0, 0.0, 0.0)) == far


@pytest.mark.parametrize("path", sorted(SCENES.rglob("*.cli")), ids=lambda path: path.stem)
def test_every_scene_can_be_turned_about_what_it_shows(path):
    scene = interpreter(path)
    eye, pivot, w = scene.camera.eye, pivot_of(scene), np.array(scene.camera.w)
    assert np.dot(np.subtract(pivot, eye) / np.abs(np.subtract(pivot, eye)).max(), -w) > 0
    for orbit in (HOME.pulled(33, -21), Orbit(-HALF_TURN, POLE), Orbit(nearer=FARTHEST), Orbit(nearer=-FARTHEST)):
        there = seen_from(scene, orbit)
        assert there.camera != scene.camera
        make_plan(there, "diffuse", 8, 8)


def test_shapes_stay_in_sight_while_the_camera_goes_round():
    scene = interpreter(SCENES / "hard" / "ten_thousand_spheres.cli")
    for right in range(-HALF_TURN, HALF_TURN, 90):
        hits = eye_hits(seen_from(scene, HOME.pulled(right, 40)), 16, 16)
        assert (hits.index[4:12, 4:12] >= 0).mean() > 0.2


@pytest.mark.parametrize(
    ("text", "pivot"),
    [
        ("", (0, 0, -1)),
        ("sphere 1 0 0 -4", (0, 0, -4)),
        ("sphere 1 -1 0 -4\nsphere 1 1 0 -4", (0, 0, -4)),
        ("sphere 1 0 0 -4\nsphere 1e10 0 -1e10 0", (0, 0, -4)),  # a ground
        ("sphere 1 0 0 -4\nsphere 1e10 0 0 0", (0, 0, -4)),  # a sky about it all
        ("sphere 1 0 0 -4\nsphere 50 0 0 -20", (0, 0, -4)),  # and one whose centre is ahead
        ("sphere 1 0 0 -4\nsphere 1 0 0 40\nsphere 1 40 0 -4", (0, 0, -4)),  # behind the eye, beside the picture
        ("sphere 1 0 0 5", (0, 0, -4)),  # nothing ahead: as far away as things are
        ("sphere 1 0 0 0", (0, 0, -1)),
        ("sphere 1e-170 0 0 -4e-170", (0, 0, -4e-170)),
        ("sphere 1e160 0 0 -4e160", (0, 0, -4e160)),
        ("begin\nvertex -1 0 -4\nvertex 1 0 -4\nvertex 0 1.5 -4\nend", (0, 0.5, -4)),
    ],
)
def test_the_pivot_is_the_middle_of_what_is_seen(text, pivot):
    assert pivot_of(scene_of(text)) == pytest.approx(pivot, rel=1e-12, abs=1e-12 * abs(pivot[2]))


def test_far_stars_do_not_pull_the_pivot_away():
    stars = "\n".join(f"sphere 1000 {x}e4 {y}e4 -1e6" for x in range(-20, 20) for y in range(1, 20))
    assert pivot_of(scene_of(f"sphere 1 0 0 -4\n{stars}")) == pytest.approx((0, 0, -4), abs=1)
