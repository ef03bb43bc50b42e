"""The rays behind a pixel: they add up to its colour, and what they say of shapes and lights is so."""

from itertools import pairwise

import numpy as np

from raytracer import Sphere, interpreter, probe_pixel, render_scene
from raytracer.bounce import MOST_REFLECTIONS
from raytracer.image import to_bytes
from raytracer.interpreter import interpret

WIDTH, HEIGHT = 60, 44
PIXELS = [(x, y) for x in range(0, WIDTH, 7) for y in range(0, HEIGHT, 5)]
DEEP = "scenes/10_reflections_in_reflections.cli"
MIRRORS = "scenes/09_mirror_spheres.cli"


def rays_of(scene, pixels=PIXELS):
    """The rays of some pixels of a scene."""
    return [probe_pixel(scene, x, y, WIDTH, HEIGHT, "full").rays for x, y in pixels]


def light_rays_of(scene):
    """All rays to lights, each with the hit that it starts from."""
    hits = [ray.hit for rays in rays_of(scene) for ray in rays if ray.hit is not None]
    return [(hit, light) for hit in hits for light in hit.lights]


def total(rays):
    return np.sum([ray.adds for ray in rays], axis=0)


def test_what_the_rays_add_is_the_colour(scene_path):
    scene = interpreter(scene_path)
    picture = render_scene(scene, "full", WIDTH, HEIGHT)
    for x, y in PIXELS if len(scene) < 1000 else PIXELS[::20]:
        pixel = probe_pixel(scene, x, y, WIDTH, HEIGHT, "full")
        np.testing.assert_allclose(total(pixel.rays), pixel.colour, rtol=1e-12, atol=1e-12)
        assert tuple(to_bytes(total(pixel.rays))) == tuple(picture[y, x]) == pixel.rgb
        assert pixel.lights == ()


def test_a_ray_adds_its_ambient_colour_and_its_lights(course_scene_path):
    scene = interpreter(course_scene_path)
    for rays in rays_of(scene):
        assert all(ray.hit is not None for ray in rays[:-1])
        for ray in rays:
            if ray.hit is None:
                np.testing.assert_allclose(ray.adds, np.multiply(ray.share, scene.background))
            else:
                assert ray.hit.shape == scene.shape(ray.hit.index)
                np.testing.assert_allclose(ray.hit.ambient, np.multiply(ray.share, ray.hit.shape.material.ambient))
                lights = [light.adds for light in ray.hit.lights]
                np.testing.assert_allclose(ray.adds, np.sum([ray.hit.ambient, *lights], axis=0))


def test_shares_are_products_and_rays_begin_where_the_one_before_ends():
    longest = 0
    for rays in rays_of(interpreter(DEEP)):
        longest = max(longest, len(rays))
        assert len(rays) <= MOST_REFLECTIONS + 1
        assert (rays[0].k_refl, rays[0].share) == (1, 1)
        for before, ray in pairwise(rays):
            assert ray.k_refl == before.hit.shape.material.k_refl
            assert ray.share == before.share * ray.k_refl
            assert ray.origin == before.hit.point
            mirrored = before.direction - 2 * np.dot(before.direction, before.hit.normal) * np.array(before.hit.normal)
            np.testing.assert_allclose(ray.direction, mirrored, atol=1e-14)
    assert longest == MOST_REFLECTIONS + 1


def test_a_blocker_lies_between_and_adds_nothing(course_scene_path):
    for hit, light in light_rays_of(interpreter(course_scene_path)):
        whole, part = np.subtract(light.position, hit.point), np.subtract(light.stop, hit.point)
        if light.blocker is None:
            assert light.stop == light.position
            continue
        assert not any(light.adds)
        along = part @ whole / (whole @ whole)
        assert 0 < along < 1
        np.testing.assert_allclose(part, along * whole, atol=1e-12)
        assert off_surface(interpreter(course_scene_path).shape(light.blocker), light.stop) < 1e-9


def off_surface(shape, point):
    """How far a point is from a sphere, or from a triangle's plane."""
    if isinstance(shape, Sphere):
        return abs(np.linalg.norm(np.subtract(point, shape.centre)) - shape.radius)
    a, b, c = np.array(shape.vertices)
    normal = np.cross(b - a, c - a)
    return abs((point - a) @ normal) / np.linalg.norm(normal)


def test_no_shape_blocks_itself_on_the_side_of_the_light(course_scene_path):
    for hit, light in light_rays_of(interpreter(course_scene_path)):
        np.testing.assert_allclose(np.linalg.norm(hit.normal), 1)
        to_light = np.subtract(light.position, hit.point)
        np.testing.assert_allclose(light.cosine, hit.normal @ to_light / np.linalg.norm(to_light), atol=1e-9)
        assert light.cosine <= 0 or light.blocker != hit.index


def test_of_several_the_nearest_shape_blocks():
    matt = "surface 1 1 1  0 0 0  0 0 0  1 0\n"
    stack = "sphere .05 0 3 -4\nsphere .2 0 1 -4\nsphere .05 0 2 -4\n"
    scene = interpret(f"light 0 5 -4  1 1 1\n{matt}sphere 100 0 -101 -4\n{stack}")
    near = [(x, y) for x in range(26, 35) for y in range(29, 35)]
    hits = [rays[0].hit for rays in rays_of(scene, near) if rays[0].hit is not None]
    assert {hit.index for hit in hits} == {0}
    blockers = {light.blocker for hit in hits for light in hit.lights}
    assert blockers == {None, 2}


def test_a_miss_brings_the_background():
    scene = interpreter(MIRRORS)
    pixel = probe_pixel(scene, 0, 0, WIDTH, HEIGHT, "full")
    (ray,) = pixel.rays
    assert (ray.hit, ray.share, ray.adds) == (None, 1, scene.background)
    assert (ray.origin, ray.direction) == (pixel.eye, pixel.direction)
    assert "hits nothing" in pixel.lines()
    last = [rays[-1] for rays in rays_of(scene) if len(rays) > 1]
    assert any(ray.hit is None for ray in last)


def test_other_stages_follow_no_ray():
    pixel = probe_pixel(interpreter(MIRRORS), 30, 22, WIDTH, HEIGHT)
    assert pixel.rays == ()
    assert len(pixel.lights) == 2


def test_the_story_is_a_tree_in_words():
    pixel = probe_pixel(interpreter(MIRRORS), 160, 180, 320, 320, "full")
    story, lines = pixel.story(), pixel.lines()
    assert "light (-4, 2, 0) is blocked by shape 5" in lines
    assert "mirrored, k_refl = 0.7, share 0.7: hits shape 0" in lines
    assert "  ambient adds (0.14, 0.14, 0.14)" in lines
    assert any(line.startswith("light (8, 8, 3): N·L = 0.267364, H·N = 0.633259 adds") for line in story)
    assert any(line.startswith("  light (-4, 2, 0) is blocked by shape 5 at (-0.641924") for line in story)
    assert "  point (0, -0.6, -4.97599), normal (0, 1, 0)" in story


def test_in_short_what_is_deep_is_told_in_one_line():
    pixel = probe_pixel(interpreter(DEEP), 160, 150, 320, 320, "full")
    assert len(pixel.rays) == 11
    assert "    … 8 reflections more: adds (0, 0, 0)" in pixel.lines()
    assert sum("mirrored along" in line for line in pixel.story()) == 10
    lights = "".join(f"light {x} 5 5  .1 .1 .1\n" for x in range(9))
    many = interpret(f"{lights}surface 1 1 1  0 0 0  0 0 0  1 0\nsphere 1 0 0 -4\n")
    assert any(line.startswith("… 6 lights more: adds (") for line in probe_pixel(many, 160, 160, stage="full").lines())
