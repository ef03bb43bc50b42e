"""Colours of blocks that show one sphere, from the sphere's own numbers: the bounds of their errors hold."""

from dataclasses import replace

import numpy as np
import pytest

from raytracer import backend, make_plan, plain
from raytracer.alike import NEAREST_LIGHT, bounds_of, cubic_error, cubic_of, least_error, rim_error
from raytracer.bench import spread
from raytracer.quick import U
from raytracer.render import draw
from raytracer.scene import Light

KERNELS = backend.load() if backend.why_no_compiler() == "" else None
needs_kernels = pytest.mark.skipif(KERNELS is None, reason="numba is not installed")


def cosine(v, epsilon):
    return (v - epsilon) / np.sqrt(1 + epsilon**2 - 2 * epsilon * v)


def test_the_cosine_is_nearly_a_cubic_polynomial():
    """And below 0 where a surface is turned away."""
    for epsilon in (1e-6, 1e-3, 0.01, 0.02, 1 / NEAREST_LIGHT):
        v = np.linspace(-1, 1, 20_001)
        c0, c1, c2, c3 = cubic_of(epsilon)
        found, true = ((c3 * v + c2) * v + c1) * v + c0, cosine(v, epsilon)
        error = abs(found - true)[v >= 0].max()
        assert error < cubic_error(epsilon) + 1e-15
        if epsilon > 0.005:
            assert error > cubic_error(epsilon) / 2
        assert (found[v < 0] < 0).all()


def spheres_and_pixels(count: int, rng: np.random.Generator):
    """X, Y, f, ρ of some spheres, and a pixel each that shows them, from their middles."""
    focus = 10.0 ** rng.uniform(1, 4, count)
    across, down = rng.uniform(-1.1, 1.1, count) * focus, rng.uniform(-0.7, 0.7, count) * focus
    size = 10.0 ** rng.uniform(-0.7, np.log10(0.25 * focus))
    x, y = rng.uniform(-1.2, 1.2, (2, count)) * size * np.sqrt(1 + (across**2 + down**2) / focus**2)
    return across, down, focus, size, x, y


def normal_by(number, across, down, focus, size, x, y, toward):
    """V of a light in the direction `toward`, and R by w, in arithmetic that rounds by `number`."""
    c2 = across**2 + down**2 + focus**2
    bulk = c2 - size**2
    root_b = np.sqrt(bulk)
    along = (across * toward[0] + down * toward[1] - focus * toward[2]) / size
    start, slopes, lights = size**2 / root_b, (across / root_b, down / root_b), (toward[0] / size, toward[1] / size)
    start, size2, bulk, twice, root_b, along = map(number, (start, size**2, bulk, 2 * root_b, root_b, along))
    slopes, lights = tuple(map(number, slopes)), tuple(map(number, lights))
    e = (start + y * slopes[1]) + x * slopes[0]
    h = (size2 - y * y) - x * x
    root = np.sqrt(e * e + h)
    tau = ((e + root) * root_b - h) / ((bulk - h) + e * twice)
    slope = y * lights[1] + x * lights[0]
    return slope * (number(1.0) - tau) - tau * along, root / number(size)


def test_how_far_off_the_angle_to_a_light_may_be():
    """In numpy's single precision, which rounds products, too; middles are split into whole numbers and rests."""
    rng, one = np.random.default_rng(3), np.float32
    across, down, focus, size, x, y = spheres_and_pixels(400_000, rng)
    toward = rng.normal(size=(3, len(x)))
    toward /= np.linalg.norm(toward, axis=0)
    column, row = np.round(across + x), np.round(down + y)  # a pixel's; where it is not, the sphere is moved instead
    x, y = column - across, row - down
    with np.errstate(all="ignore"):
        true, cos = normal_by(np.float64, across, down, focus, size, x, y, toward)
        whole = np.floor(across), np.floor(down)
        near = [
            one(place - low) - one(middle - low)
            for place, middle, low in zip((column, row), (across, down), whole, strict=True)
        ]
        found, _ = normal_by(one, across, down, focus, size, *near, toward)
        sigma, tilt = bounds_of(np.sqrt(1 + (column**2 + row**2) / focus**2))
        p = (abs(across) + abs(down)) / np.sqrt(across**2 + down**2 + focus**2 - size**2)
        rho, blur = size / focus, 1 / size
        rim = rim_error(sigma, p, rho, blur)
        bound = least_error(sigma, tilt, p, rho, blur) + 1.034 * (1 + rho) * rim / cos
        part = (abs(found - true) / bound)[(cos**2 > 16 * rim) & (rho <= 0.25)]
    assert len(part) > 100_000
    assert 0.05 < part.max() < 1.0


def test_what_the_bounds_grow_with():
    few, many = np.float64(0.01), np.float64(0.2)
    rims = [rim_error(*numbers) for numbers in ((1.1, few, few, few), (1.1, few, few, 10.0), (1.1, many, few, 10.0))]
    assert U < rims[0] < rims[1] < rims[2] < rim_error(1.5, many, many, 10.0)
    least = [least_error(*numbers) for numbers in ((1.1, 1.0, few, few, few), (1.1, 1.5, few, few, few))]
    assert 10 * U < least[0] < least[1] < least_error(1.1, 1.5, many, many, few) < 200 * U


@needs_kernels
@pytest.mark.parametrize("size", [(1, 1), (129, 33), (640, 360)], ids=str)
@pytest.mark.parametrize("lights", [0, 1, 3, 20, 60])
def test_however_many_lights_the_bytes_are_those_of_float64(lights, size):
    rng, scene = np.random.default_rng(lights), spread(200, seed=12)
    places = rng.normal(size=(lights, 3)) * 10.0 ** rng.uniform(0, 3, (lights, 1))
    scene = replace(
        scene, lights=tuple(Light(tuple(place), tuple(rng.uniform(0, 0.3, 3))) for place in places.tolist())
    )
    found, expected = (draw(make_plan(scene, "diffuse", *size, path=path)) for path in (KERNELS, plain))
    np.testing.assert_array_equal(found, expected)


@needs_kernels
@pytest.mark.parametrize("seed", range(20))
def test_near_lights_turned_cameras_and_large_spheres(seed):
    rng, scene = np.random.default_rng(seed), spread(int(10.0 ** (1 + seed % 4)), seed=seed)
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    camera = replace(
        scene.camera, u=tuple(frame[0]), v=tuple(frame[1]), w=tuple(frame[2]), fov=float(rng.uniform(5, 90))
    )
    middle = np.array(scene.camera.eye) - 13 * frame[2]
    lights = tuple(
        Light(tuple((middle + rng.normal(size=3) * 10.0 ** rng.uniform(-0.5, 1.5)).tolist()), (0.5, 0.4, 0.3))
        for _ in range(2)
    )
    turned = replace(scene.spheres, centres=scene.spheres.centres @ frame)
    scene = replace(scene, camera=camera, lights=lights, spheres=turned)
    found, expected = (draw(make_plan(scene, "diffuse", 480, 270, path=path)) for path in (KERNELS, plain))
    np.testing.assert_array_equal(found, expected)
