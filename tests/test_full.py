"""The stage `full`: against an independent rendering, both paths against each other, and what its plan leaves out."""

import math
from dataclasses import replace

import naive
import numpy as np
import pytest
from test_trace import PATHS, exact_numbers

from raytracer import backend, exact, eye_hits, interpreter, machine_code, render_scene
from raytracer.camera import make_raster
from raytracer.full import terms_of
from raytracer.interpreter import interpret
from raytracer.lookup import light_cells
from raytracer.plan import make_plan
from raytracer.render import draw
from raytracer.scene import Camera

both_paths = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")


def test_naive_tracer_agrees(course_scene_path):
    """Every byte within 1 of an independent rendering, but for eye rays through an edge or tangent."""
    scene = interpreter(course_scene_path)
    found = render_scene(scene, "full").astype(int)
    wrong = np.argwhere(np.abs(found - naive.full_picture(course_scene_path, 320, 320)).max(axis=2) > 1)
    assert len(wrong) <= 40
    hits, raster, (numbers, sizes) = eye_hits(scene), make_raster(scene.camera, 320, 320), exact_numbers(scene)
    for y, x in wrong.tolist():
        index = exact.nearest_of(numbers, *raster.whole_direction(x, y), sizes)[1]
        assert hits.index[y, x] == index
        assert index < 0 or is_on_an_outline(hits.index, x, y)


def is_on_an_outline(index, x, y):
    return len(np.unique(index[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2])) > 1


def random_scene(seed):
    """A ground, balls, triangles, mirrors, lights and a camera that looks at them."""
    rng = np.random.default_rng(seed)

    def words(*numbers):
        return " ".join(f"{x:.6g}" for x in np.hstack(numbers))

    eye = rng.uniform([-3, -1, 4], [3, 3, 8])
    back = eye / np.linalg.norm(eye)
    right = np.cross([0, 1, 0], back) / np.linalg.norm(np.cross([0, 1, 0], back))
    lines = [f"fov {words(rng.uniform(40, 80))}", f"eye {words(eye)}", f"background {words(rng.uniform(0, 1, 3))}"]
    lines += [f"uvw {words(right, np.cross(back, right), back)}"]
    for _ in range(rng.integers(1, 4)):
        lines += [f"light {words(rng.uniform([-9, 4, -9], [9, 9, 9]), rng.uniform(0.2, 0.7, 3))}"]

    def surface():
        mirror = rng.choice([0, 0.4, 0.8])
        power = rng.choice([1, 7, 20, 2.5])
        return f"surface {words(rng.uniform(0, 0.7, 9), power, mirror)}"

    lines += [surface(), "begin", "vertex -50 -1 -50", "vertex 50 -1 -50", "vertex 0 -1 70", "end"]
    for _ in range(rng.integers(2, 9)):
        lines += [surface(), f"sphere {words(rng.uniform(0.2, 0.8), rng.uniform(-2, 2, 3))}"]
    for _ in range(rng.integers(1, 9)):
        corners = rng.uniform(-2, 2, 3) + rng.uniform(-1, 1, (3, 3))
        lines += ["begin", *(f"vertex {words(corner)}" for corner in corners), "end"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_agree_with_the_independent_rendering(seed, tmp_path):
    path = tmp_path / "random.cli"
    path.write_text(random_scene(seed))
    found = draw(make_plan(interpreter(path), "full", 120, 90)).astype(int)
    wrong = np.abs(found - naive.full_picture(path, 120, 90)).max(axis=2) > 1
    assert wrong.sum() <= 3  # where mirrors in mirrors make a large difference of the last digit
    assert len(np.unique(found.reshape(-1, 3), axis=0)) > 500


@both_paths
@pytest.mark.parametrize("seed", range(20, 26))
def test_both_paths_and_any_number_of_threads_draw_the_same_bytes(seed):
    scene = interpret(random_scene(seed))
    pictures = [
        draw(make_plan(scene, "full", 97, 71, path=PATHS[path]), threads=threads)
        for path, threads in (("numpy", 1), ("compiled", 1), ("compiled", 2))
    ]
    np.testing.assert_array_equal(pictures[1], pictures[0])
    np.testing.assert_array_equal(pictures[2], pictures[0])


@both_paths
def test_many_shapes_are_looked_up_as_if_all_were_tested(monkeypatch):
    """The cells of the lights and the tree leave out nothing: the numpy path tests every shape."""
    rng = np.random.default_rng(5)
    lines = ["eye 0 1 6", "light 3 5 4 .7 .7 .7", "light 0 0 -1 .3 .3 .3"]  # the second among the shapes
    for place in rng.uniform([-3, -1, -5], [3, 2, 1], (120, 3)):
        lines += [f"surface .5 .4 .3 .1 .1 .1 .2 .2 .2 9 {rng.choice([0, 0.5])}"]
        lines += [f"sphere {rng.uniform(0.05, 0.3)} {place[0]} {place[1]} {place[2]}"]
    for place in rng.uniform([-3, -1, -5], [3, 2, 1], (60, 3)):
        corners = place + rng.uniform(-0.4, 0.4, (3, 3))
        lines += ["begin", *(f"vertex {x} {y} {z}" for x, y, z in corners), "end"]
    scene = interpret("\n".join(lines))
    pictures = [draw(make_plan(scene, "full", 90, 70, path=PATHS[path])) for path in ("numpy", "compiled")]
    np.testing.assert_array_equal(*pictures)


@both_paths
def test_what_is_kept_of_shapes_is_not_taken_for_another_unit_of_length():
    """An eye so far away that all lengths are scaled: the tree of the same shapes, unscaled, is of no use to it."""
    shapes = "".join(f"sphere 4e47 {x}e48 {y}e48 -4e48\n" for x in (-1, 0, 1) for y in (-1, 0, 1))
    scene = interpret("light 3e48 5e48 4e48 .7 .7 .7\nsurface .5 .4 .3 .1 .1 .1 .2 .2 .2 9 .5\n" + shapes)
    for eye, fov in (((0.0, 0.0, 4e48), 60.0), ((0.0, 0.0, 1.5e50), 2.0), ((0.0, 0.0, 4e48), 60.0)):
        seen = replace(scene, camera=Camera(eye=eye, fov=fov))
        np.testing.assert_array_equal(
            *(draw(make_plan(seen, "full", 120, 120, path=PATHS[path])) for path in ("numpy", "compiled"))
        )


def on_a_ground(rng, below, slant):
    """Balls and triangles above a ground that may slant, some of them standing on it, one of them below."""
    up = np.array([slant, 1.0, slant / 2]) / np.linalg.norm([slant, 1.0, slant / 2])
    right = np.cross(up, [0, 0, 1.0]) / np.linalg.norm(np.cross(up, [0, 0, 1.0]))
    frame = np.stack([right, up, np.cross(right, up)])

    def words(place):
        return " ".join(repr(x) for x in (np.array(place) @ frame + [0, -1, 0]).tolist())

    lines = [f"light {words([2, 5, 3])} .6 .6 .6", f"light {words([-4, 0.5, 1])} .4 .4 .4"]
    lines += ["surface .6 .5 .4 .1 .1 .1 0 0 0 1 .3"]
    corners = [-3, 0, -3], [3, 0, -3], [3, 0, 3], [-3, 0, 3]
    for three in (corners[:3], corners[2:] + corners[:1]):
        lines += ["begin", *(f"vertex {words(corner)}" for corner in three), "end"]
    for radius, x, z in zip(rng.uniform(0.1, 0.4, 12), *rng.uniform(-2, 2, (2, 12)), strict=True):
        lines += [f"sphere {float(radius)!r} {words([x, rng.choice([1, 3]) * radius, z])}"]
    for place in rng.uniform([-2, 0.5, -2], [2, 2, 2], (9, 3)):
        lines += ["begin", *(f"vertex {words(place + rng.uniform(-0.4, 0.4, 3))}" for _ in range(3)), "end"]
    for place in ([0.0, -0.5, 3.3], [0.0, -0.2, 0.5])[:below]:  # before the ground, lower than it, and through it
        lines += [f"sphere 0.3 {words(place)}"]
    return interpret("eye 0 0 8\n" + "\n".join(lines))


@both_paths
@pytest.mark.parametrize("slant", [0.0, 0.3])
@pytest.mark.parametrize("below", [0, 1, 2])
def test_a_ground_that_shades_nearly_nothing_is_asked_for_by_what_is_below_it(below, slant):
    scene, kernels = on_a_ground(np.random.default_rng(below), below, slant), backend.load()
    for light in scene.lights:
        cells, beyond = light_cells(scene.spheres, scene.triangles, 0, 8.0, (light.position,), kernels)
        first, last = cells.starts[-2:]
        ground = len(scene.spheres.balls) + np.arange(2)
        assert set(ground) <= set(cells.entries[2 * first : 2 * last : 2].tolist())
        assert not set(ground) & set(cells.entries[: 2 * first : 2].tolist())
        asked = np.flatnonzero(beyond[: len(scene.spheres)]).tolist()
        assert asked == [*range(len(scene.spheres) - below, len(scene.spheres))]
    pictures = [draw(make_plan(scene, "full", 120, 80, path=PATHS[path])) for path in ("numpy", "compiled")]
    np.testing.assert_array_equal(*pictures)


@both_paths
@pytest.mark.parametrize("height", [1e-8, 1e-12])
@pytest.mark.parametrize("away", [1e4, 1e8])
def test_a_light_close_to_the_ground_seen_from_far_away(away, height):
    """Rays are rounded as seen from the eye: from there the light may be below the ground."""
    frame, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    frame *= np.sign(np.linalg.det(frame))
    c, s = math.cos(0.3), math.sin(0.3)

    def words(*vectors):
        return " ".join(repr(x) for vector in vectors for x in (np.array(vector) @ frame).tolist())

    lines = [f"fov {math.degrees(3 / away)!r}", f"eye {words([0, s * away, c * away])}"]
    lines += [f"uvw {words([1, 0, 0], [0, c, -s], [0, s, c])}", f"light {words([0.1, height, 0.2])} .8 .8 .8"]
    lines += ["surface .6 .5 .4 .1 .1 .1 0 0 0 1 0"]
    for three in ([-3, 0, -3], [3, 0, -3], [3, 0, 3]), ([-3, 0, -3], [3, 0, 3], [-3, 0, 3]):
        lines += ["begin", *(f"vertex {words(corner)}" for corner in three), "end"]
    for x in range(-4, 5):
        lines += [
            f"sphere .11 {words([x / 4, 0.7, 0.03 * x - 0.4])}",
            f"sphere .11 {words([x / 4, 0.4, 0.03 * x - 0.8])}",
        ]
    scene = interpret("\n".join(lines))
    pictures = [draw(make_plan(scene, "full", 80, 60, path=PATHS[path])) for path in ("numpy", "compiled")]
    np.testing.assert_array_equal(*pictures)


SURFACE = "surface .5 .5 .5 .1 .1 .1 {shiny} {power} {mirror}\n"


def scene_of(lights="light 0 5 5 1 1 1\n", shiny="0 0 0", power=1, mirror=0, shapes="sphere 1 0 0 -4\n"):
    return interpret(lights + SURFACE.format(shiny=shiny, power=power, mirror=mirror) + shapes)


def test_terms_that_a_scene_does_not_use_are_left_out():
    def terms(**given):
        scene = scene_of(**given)
        return terms_of(scene, bool(scene.lights))

    plain = terms()
    assert (plain.specular, plain.mirrors, plain.shadows) == (False, False, False)
    assert terms(shapes="sphere 1 0 0 -4\nsphere 1 3 0 -4\n").shadows
    assert not terms(lights="", shapes="sphere 1 0 0 -4\nsphere 1 3 0 -4\n").shadows
    assert terms(shiny=".5 0 0").specular
    assert terms(mirror=0.5).mirrors
    assert terms(shiny="1 1 1", power=20).bits == 5
    assert terms(shiny="1 1 1", power=2.5).bits == -1


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({}, "no k_refl above 0: no reflected rays"),
        ({"mirror": 0.5}, "k_refl given: reflected rays, at most 10 after each other"),
        ({}, "one convex shape cannot shadow itself: no shadow rays"),
        ({"lights": ""}, "no light: no shadow rays"),
        ({"shapes": "sphere 1 0 0 -4\nsphere 1 3 0 -4\n"}, "a shadow ray to each light"),
        ({}, "no specular colour: no highlights"),
        ({"shiny": "1 1 1"}, "specular given: a highlight of each light"),
    ],
)
def test_the_plan_says_which_terms_and_why(given, reason):
    assert reason in " | ".join(make_plan(scene_of(**given), "full").why)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("power", [0, 1, 2, 20, 4095, 4096, 0.5, 2.5, -1])
def test_any_power(path, power):
    scene = scene_of(shiny=".9 .9 .9", power=power)
    picture = draw(make_plan(scene, "full", 40, 40, path=PATHS[path])).astype(float)
    # the pixel in the middle of the sphere: N = −D, H·N = cos of half the angle to the light
    n, point = np.array([0, 0, 1.0]), np.array([0, 0, -3.0])
    light = (np.array([0, 5.0, 5.0]) - point) / np.linalg.norm(np.array([0, 5.0, 5.0]) - point)
    half = (light + n) / np.linalg.norm(light + n)
    with np.errstate(divide="ignore"):
        expected = 0.1 + 0.5 * light @ n + 0.9 * (half @ n) ** power
    assert abs(picture[20, 20, 0] - math.floor(255 * min(1, expected) + 0.5)) <= 1


@pytest.mark.parametrize("path", PATHS)
def test_inside_a_mirror_ball_light_goes_round_for_ten_reflections(path):
    """No light and k_refl ½ and ambient ½ everywhere: ½ (1 + ½ + … + 2⁻¹⁰)."""
    scene = replace(
        scene_of(lights="", mirror=0.5, shapes="sphere 3 0 0 0\n"), camera=Camera(eye=(0.2, -0.5, 1.0), fov=90.0)
    )
    picture = draw(make_plan(scene, "full", 31, 17, path=PATHS[path]))
    expected = 0.1 * sum(0.5**k for k in range(11))
    assert (picture == math.floor(255 * expected + 0.5)).all()


@pytest.mark.parametrize("path", PATHS)
def test_a_light_inside_a_sphere_lights_it_from_within_only(path):
    shapes = "sphere 1 0 0 -4\nsphere 1 3 0 -4\n"
    outside = scene_of(lights="light 0 0 -4 1 1 1\n", shapes=shapes)
    dark = draw(make_plan(outside, "full", 40, 40, path=PATHS[path]))
    hits = eye_hits(outside, 40, 40).index
    assert (dark[hits >= 0] == math.floor(255 * 0.1 + 0.5)).all()  # ambient only: N·L < 0, and the wall is between


def test_without_machine_code_numpy_is_used_for_longer(monkeypatch):
    monkeypatch.setattr(backend, "_loaded", None)
    monkeypatch.setattr(backend, "load", lambda: PATHS["compiled"])
    plan = make_plan(interpreter("scenes/11_star.cli"), "full", 320, 320)
    chosen = []
    for kept in (True, False):
        monkeypatch.setattr(backend, "_spent", 0.0)
        monkeypatch.setattr(machine_code, "is_kept", lambda kernel, kept=kept: kept and kernel == "paint_full")
        chosen.append(replace(plan).path)
    assert chosen == [PATHS["compiled"], PATHS["numpy"]]
