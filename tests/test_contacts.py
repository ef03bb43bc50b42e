"""Contacts and narrow gaps: nothing is missed, in numbers and in whole pictures, and the chart that shows it."""

import numpy as np
import pytest

from raytracer import backend, exact, interpreter, plain
from raytracer.contacts import CONTACTS, SCALES, SHELLS_APART, Contact, false_self_hits, missed, missed_contacts, truth
from raytracer.interpreter import interpret
from raytracer.offsets import OFFSETS, Leaving, seen_from
from raytracer.plan import make_plan
from raytracer.render import draw, hits_of, open_tracer

PATHS = {"numpy": plain, "compiled": backend.load()}


@pytest.fixture(params=sorted(PATHS))
def path(request):
    if request.param == "compiled" and backend.why_no_compiler():
        pytest.skip("numba is not installed")
    return PATHS[request.param]


def some(kind, scale, rays=4000):
    return CONTACTS[kind](np.random.default_rng(8), scale, rays)


@pytest.mark.parametrize("kind", CONTACTS)
@pytest.mark.parametrize("scale", SCALES)
def test_the_default_misses_no_contact(kind, scale):
    assert not missed("bounce", some(kind, scale)).any()


@pytest.mark.parametrize("kind", [kind for kind in CONTACTS if kind != "sheets"])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_the_truth_is_that_of_integers(kind, scale):
    """From the rounded P, as seen from the eye; and both roots are there, if P is outside."""
    contact = some(kind, scale, 200)
    t, other_root = truth(contact)
    points = np.stack(contact.rays.landed[0], axis=-1).tolist()
    spheres = seen_from(contact.other, contact.rays.eyes).tolist()
    for k, (point, direction) in enumerate(zip(points, contact.rays.directions.tolist(), strict=True)):
        *centre, radius = spheres[k]
        root = exact.hits(point, direction, [(centre, radius)])[0]
        assert root.nearest_float() == pytest.approx(t[k], rel=1e-15)
        assert root._replace(sign=-root.sign).nearest_float() == pytest.approx(other_root[k], rel=1e-6)


def ball_on_ground(power, shift, rng, count=2000):
    """Points of a ground of radius 10**power, and of the ball of radius 1 that rests on it."""
    up = np.array([0.0, 1.0, 0.0])
    contact = shift * up
    ground, ball = np.append(contact - 10.0**power * up, 10.0**power), np.append(contact + up, 1.0)
    eyes = contact + rng.uniform([-3.0, 0.5, 2.0], [3.0, 2.0, 4.0], (count, 3))
    places = contact + rng.uniform([-2.0, 0.0, -2.0], [2.0, 0.0, 1.0], (count, 3))
    aims = contact + up + rng.uniform(-0.4, 0.4, (count, 3))
    rays = Leaving(eyes, places - eyes, np.tile(ground, (count, 1)), aims - places)
    return rays, np.tile(ball, (count, 1))


@pytest.mark.parametrize("power", range(3, 13))
@pytest.mark.parametrize("shift", [0.0, 1e6, 1e9])
def test_a_ball_on_a_ground_is_met_from_the_ground(power, shift):
    """The eye may see the ground through the ball: what matters is where its ray meets the ground."""
    rays, ball = ball_on_ground(power, shift, np.random.default_rng(power))
    assert np.isfinite(rays.t).all()
    assert not OFFSETS["bounce"].self_hits(rays).any()
    assert not missed("bounce", Contact(rays, ball)).any()


@pytest.mark.parametrize("shift", [0.0, 1e6, 1e9])
def test_shells_are_met_across_their_gap(shift):
    contact = some("shells", 1.0)
    rays, other = contact.rays, contact.other
    moved = np.array([shift, -shift, shift])
    own = seen_from(rays.own, -moved)
    other = np.column_stack([own[:, :3], other[:, 3]])  # about the same rounded centre
    away = Leaving(rays.eyes + moved, rays.looks, own, rays.directions)
    assert not missed("bounce", Contact(away, other)).any()
    assert not OFFSETS["bounce"].self_hits(away).any()


def test_other_ways_miss_what_is_close():
    assert missed("fixed 1e-4", some("shells", 1.0)).all()
    assert missed("fixed 1e-4", some("sheets", 1.0)).all()
    assert not missed("fixed 1e-4", some("shells", 1e3)).any()
    assert missed("fixed 1e-4", some("touching spheres", 1.0)).mean() > 0.5
    assert missed("fixed 1e-4", some("ball on ground", 1.0)).mean() > 0.1
    assert missed("wächter_binder", some("touching spheres", 1.0)).mean() > 0.5
    assert missed("wächter_binder, float64", some("far from the origin", 1.0)).mean() > 0.1


def test_counts_are_the_same_each_time():
    for count in (false_self_hits, missed_contacts):
        counts = count(200, (1.0, 1e9))
        assert counts == count(200, (1.0, 1e9))
        assert {(c.offset, c.scale) for c in counts} == {(name, scale) for name in OFFSETS for scale in (1.0, 1e9)}
        assert not any(c.wrong for c in counts if c.offset == "bounce")
        assert any(c.wrong for c in counts if c.offset == "fixed 1e-4")


# Whole pictures

LOOK = "fov 60\neye 0 2 6\nuvw 1 0 0  0 .97 -.24  0 .24 .97\nbackground 0 0 0\n"
SUN = np.array([12.0, 9.0, 8.0])
GREEN, RED = "surface .3 .5 .2  .1 .15 .05  0 0 0  1  0\n", "surface .8 .2 .1  .2 .05 .05  0 0 0  1  0\n"


def drawn(scene, path, stage="full"):
    return draw(make_plan(scene, stage, 160, 120, path=path))


def ground_scenes(power, light=True):
    """A ground with a ball on it, and the ground alone."""
    radius = 10.0**power
    text = LOOK + ("light {} {} {}  .9 .9 .9\n".format(*SUN) if light else "")
    text += f"{GREEN}sphere {radius!r} 0 {-radius!r} 0\n"
    return interpret(text + RED + "sphere 1 0 1 0\n"), interpret(text)


def shadow_of_the_ball(plan):
    """Which pixels show the ground, and how far rays from there to the light pass beside the ball's centre."""
    with open_tracer(plan) as tracer:
        hits = hits_of(plan, tracer)
    seen, look = hits.index == 0, plan.raster.exact_direction
    directions = np.array([[[float(x) for x in look(x, y)] for x in range(160)] for y in range(120)])
    points = np.array([0.0, 2.0, 6.0]) + np.where(seen, hits.t, 0.0)[..., None] * directions
    ways = SUN - points
    beside = np.cross(ways, [0.0, 1.0, 0.0] - points)
    return seen, np.linalg.norm(beside, axis=-1) / np.linalg.norm(ways, axis=-1)


@pytest.mark.parametrize("power", range(3, 13))
def test_a_ground_has_one_shadow_and_no_speckles(path, power):
    """Where the ball's shadow is not, the picture is that of the ground alone; where it is, ambient light is left."""
    scene, alone = ground_scenes(power)
    plan = make_plan(scene, "full", 160, 120, path=path)
    seen, beside = shadow_of_the_ball(plan)
    picture, without = draw(plan), drawn(alone, path)
    dark = drawn(ground_scenes(power, light=False)[0], path)
    lit, shaded = seen & (beside > 1.001), seen & (beside < 0.999)
    assert lit.sum() > 5000
    assert shaded.sum() > 300
    np.testing.assert_array_equal(picture[lit], without[lit])
    np.testing.assert_array_equal(picture[shaded], dark[shaded])


@pytest.mark.parametrize("shift", [0.0, 1e6, 1e9])
def test_no_light_leaks_through_a_shell_that_is_close(path, shift):
    """Inside a ball, with a shell about it and the light beyond: both are in the way at every pixel."""
    where = f"{shift!r} 0 0"
    text = f"fov 100\neye {where}\nbackground 0 0 0\n"
    shapes = f"{GREEN}sphere 1 {where}\nsphere {1 + SHELLS_APART!r} {where}\n"
    light = f"light {shift + 5!r} 1 2  1 1 1\n"
    picture, dark = drawn(interpret(text + light + shapes), path), drawn(interpret(text + shapes), path)
    assert dark.any()
    np.testing.assert_array_equal(picture, dark)


@pytest.mark.parametrize("height", [1.0, 1e-4, 1e-8, 1e-12, 1e-14, 1e-15, 3e-16])
def test_a_mirror_room_has_no_hole(path, height):
    """The eye is inside a mirror ball, this far from the wall: rays graze it, are thrown back, and none gets out."""
    x, y, z = ((height - 1.0) * np.array([0.36, 0.48, 0.8])).tolist()
    text = f"fov 120\neye {x!r} {y!r} {z!r}\nuvw .8 -.6 0  .36 .48 .8  .48 .64 -.6\nbackground 1 1 1\n"
    text += "surface 0 0 0  0 0 0  0 0 0  1  1\nsphere 1 0 0 0\n"
    assert not drawn(interpret(text), path).any()


@pytest.mark.parametrize("name", ["02_ground_like_the_earth", "05_shells_one_ulp_apart", "06_far_from_the_origin"])
def test_both_paths_draw_the_same_light(name):
    scene = interpreter(f"scenes/hard/{name}.cli")
    np.testing.assert_array_equal(*(drawn(scene, path) for path in PATHS.values()))


# The chart


def test_the_chart_is_written_and_the_same_each_time(tmp_path):
    pytest.importorskip("matplotlib")
    from raytracer.chart_contacts import chart_contacts

    said, contents = [], []
    for name in ("one", "two"):
        paths = chart_contacts(tmp_path / name, progress=said.append, rays=200)
        assert sorted(paths) == sorted((tmp_path / name).iterdir())
        assert [path.name for path in paths] == ["chart-contacts.csv", "chart-contacts.png", "chart-contacts.svg"]
        contents.append([path.read_bytes() for path in paths if path.suffix != ".png"])
    assert contents[0] == contents[1]
    assert said
