"""Single precision where it is certain: the bytes are float64's, and the bounds that say so hold."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from raytracer import backend, make_plan, plain
from raytracer.arrays import Desks, Tile
from raytracer.bench import spread
from raytracer.plan import Plan
from raytracer.pool import alone
from raytracer.quick import U, coarseness_of, error_of, flatness_of, flattest_of, make_quick, near_of
from raytracer.render import draw
from raytracer.scene import Camera, Light, Materials, Scene, Spheres
from raytracer.screen import make_canvas, make_paints, open_screen

pytestmark = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
KERNELS = backend.load()
if backend.why_no_compiler() == "":
    from raytracer.kernels import lanes, sixteen
    from raytracer.kernels.compiler import borrowing
    from raytracer.kernels.desks import desk_of
    from raytracer.kernels.limits import limits_of, nearness_of
    from raytracer.kernels.quick import _light
SIZE = 203, 150


def some_scene(seed: int) -> Scene:
    """Spheres ahead of a camera that is turned anyhow: from a hundredth of a pixel to a quarter of their distance."""
    rng = np.random.default_rng(seed)
    count, scale, fov = int(rng.choice([3, 40, 400])), 10.0 ** rng.uniform(-6, 6), float(rng.choice([2, 20, 60, 100]))
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    eye = rng.normal(size=3) * scale * rng.choice([0, 1, 1e4])
    depth, wide = rng.uniform(1, 20, count), np.tan(np.radians(fov / 2))
    across, up = rng.uniform(-1.5, 1.5, (2, count)) * wide * depth
    radii = depth * wide * 10.0 ** rng.uniform(-4, -0.5, count)
    centres = eye + scale * (np.column_stack([across, up, -depth]) @ frame)
    table = np.zeros((5, 11))
    table[:, :3], table[:, 9] = rng.uniform(0, rng.choice([0.3, 1.0, 4.0]), (5, 3)), 1.0
    table[0, :3] = 0.0
    spheres = Spheres(
        scale * radii, centres, np.sort(rng.integers(0, 5, count)).astype(np.int32), np.arange(count, dtype=np.int32),
        Materials(table),
    )  # fmt: skip
    camera = Camera(tuple(eye.tolist()), *(tuple(axis) for axis in frame.tolist()), fov)
    return Scene(camera, (0.2, 0.1, 0.3), tuple(lights_near(spheres, scale, rng)), Materials(table), spheres)


def lights_near(spheres: Spheres, scale: float, rng: np.random.Generator):
    """Some far away, some just above a sphere."""
    for _ in range(int(rng.choice([1, 2, 5]))):
        i, away = rng.integers(len(spheres)), rng.normal(size=3)
        up = spheres.radii[i] * (1 + 10.0 ** rng.uniform(-5, 0)) / np.linalg.norm(away)
        place = rng.choice([spheres.centres[i] + up * away, 30 * scale * away])
        yield Light(tuple(place.tolist()), tuple(rng.uniform(0, 1.5, 3).tolist()))


def drawn(scene: Scene, stage: str, path, size=SIZE, **options):
    return draw(replace(make_plan(scene, stage, *size, path=path), **options))


@pytest.mark.parametrize("stage", ["hit", "diffuse"])
@pytest.mark.parametrize("seed", range(30))
def test_the_bytes_are_those_of_float64(seed, stage):
    scene = some_scene(seed)
    np.testing.assert_array_equal(drawn(scene, stage, KERNELS), drawn(scene, stage, plain))


def test_colours_may_be_far_brighter_than_white():
    scene = spread(30, seed=4)
    bright = replace(scene, lights=tuple(replace(light, colour=(9e3, 3.0, 0.5)) for light in scene.lights[:1]))
    assert quick_of(bright).usable
    found, expected = (drawn(bright, "diffuse", path) for path in (KERNELS, plain))
    assert (found[..., 0] == 255).any()
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("sampling", ["corner", "centre"])
@pytest.mark.parametrize("size", [(1, 1), (16, 4), (127, 31), (128, 32), (129, 33), (300, 65)], ids=str)
def test_pictures_end_within_tiles_and_blocks(size, sampling):
    scene = spread(300, seed=5)
    found, expected = (draw(make_plan(scene, "diffuse", *size, sampling, path=path)) for path in (KERNELS, plain))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("spheres", [3000, 20_000])
def test_a_tile_may_have_more_spheres_than_there_is_room_for(spheres):
    scene = spread(spheres, seed=6)
    found, expected = (drawn(scene, "diffuse", path, (60, 30)) for path in (KERNELS, plain))
    np.testing.assert_array_equal(found, expected)


def test_without_its_bounds_single_precision_is_wrong():
    """So there is something to find for the tests above."""
    scene = spread(5000, seed=7)
    wrong = drawn(scene, "diffuse", KERNELS, (640, 360), unchecked=True) != drawn(scene, "diffuse", KERNELS, (640, 360))
    assert 0 < wrong.any(axis=2).sum() < 640 * 360 // 100


def quick_of(scene: Scene, size=SIZE):
    plan, diffuse = make_plan(scene, "diffuse", *size), scene.materials.diffuse_range
    return make_quick(plan.raster, plan.lights, 0, diffuse, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0))


def test_what_single_precision_is_not_for():
    scene = spread(3)
    light, camera = scene.lights[0], scene.camera
    assert quick_of(scene).usable
    assert quick_of(scene).flat == 1 + 2 * 256 + 3 * 65536
    for other in (
        replace(scene, camera=replace(camera, u=(1.0, 1e-9, 0.0))),
        replace(scene, camera=replace(camera, v=(0.0, 2.0, 0.0))),
        replace(scene, camera=replace(camera, fov=1e-4)),
        replace(scene, camera=replace(camera, fov=179.0)),
        replace(scene, lights=(replace(light, position=(1e11, 0.0, 0.0)),)),
        replace(scene, lights=(replace(light, colour=(1e5, 0.0, 0.0)),)),
        replace(scene, lights=(replace(light, colour=(2e3, 0.0, 0.0)),), materials=Materials(np.full((64, 11), 10.0))),
        replace(scene, materials=Materials(np.full((64, 11), -0.5))),
        replace(scene, materials=Materials(np.full((64, 11), 1e5))),
    ):
        assert not quick_of(other).usable


def spheres_and_pixels(count: int, rng: np.random.Generator):
    """U, V, ρ and 1 / w of some spheres; and where some pixels are, in pixels from their middles, most of them near."""
    u, v = rng.uniform(-1.1, 1.1, count), rng.uniform(-0.6, 0.6, count)
    rho, size = 10.0 ** rng.uniform(-5, np.log10(0.25), count), 10.0 ** rng.uniform(-1.5, 2.5, count)
    x, y = rng.uniform(-1.2, 1.2, (2, count)) * size * np.sqrt(1 + u * u + v * v)
    return u, v, rho, 1 / size, x, y


def test_the_discriminant_is_no_further_off_than_its_bound():
    """In numpy's single precision, which rounds products, too; x and y are rounded as a tile's are."""
    rng = np.random.default_rng(8)
    u, v, rho, blur, x, y = spheres_and_pixels(400_000, rng)
    m, one = 1 + u * u + v * v, np.float32
    pixel = rho * blur  # 1 / f
    exact = [m, 2 * u * pixel, -2 * v * pixel, (1 + v * v - rho**2) * blur**2, 2 * u * v * blur**2]
    exact.append((1 + u * u - rho**2) * blur**2)
    near = np.round(x), np.round(y)  # whole columns and rows, and the rest of the sphere's middle
    rest = near[0] - x, near[1] - y
    rough_x, rough_y = (
        one(whole % 4) - one(part) + one(whole - whole % 4) for whole, part in zip(near, rest, strict=True)
    )
    found, true = ((c[0] + b * (c[2] - b * c[5])) + a * ((c[1] - b * c[4]) - a * c[3]) for a, b, c in (
        (rough_x, rough_y, [one(number) for number in exact]), (x, y, exact)))  # fmt: skip
    hit = np.abs(true) < m
    steep = 2 * (1 + v * v) * (1 + u * u) / (1 - rho**2) / (m - rho**2)
    part = (np.abs(found - true) / (error_of(steep, rho, blur) * m))[hit]
    assert 0.02 < part.max() < 1.0


def test_what_the_bounds_grow_with():
    few, many = np.float64(0.01), np.float64(10.0)
    assert U < error_of(2.0, few, few) < error_of(2.0, few, many) < error_of(4.0, few, many)
    finely, roughly = 2.0**22, 2.0**16
    numbers = (finely, few, 1.2), (finely, many, 1.2), (roughly, many, 1.2), (roughly, many, 1.6)
    coarse = [coarseness_of(*some, 900.0, 3.0) for some in numbers]
    assert 7 * U < coarse[0] < coarse[1] < coarse[2] < coarse[3]
    assert 7 * U < flatness_of(*numbers[0]) < flatness_of(*numbers[1]) < flatness_of(*numbers[2])
    assert near_of(few, U) < near_of(10 * few, U) < near_of(10 * few, 100 * U)
    for error in 2.0 ** np.arange(-24.0, -10.0):  # twice the sum that the text derives
        assert near_of(0.1, error) >= 2 * (2.5 * 0.1 * (np.sqrt(error) / 4 + 8 * U) + 24 * U)


def test_the_largest_share_that_all_pixels_have_holds_for_spheres_of_any_size():
    for s in (1.0, 1.1, 1.5, 3.6):
        for weight, error in ((1.0, 20 * U), (3.0, 0.0), (100.0, 20 * U)):
            for blur in (1e-4, 1.0, 100.0, 1e6):
                rest = weight * flatness_of(2.0**22, blur, s) + error
                found = flattest_of(weight, error, s) * coarseness_of(2.0**22, blur, s, 900.0, 3.0)
                assert rest * (1 - 1e-12) <= found
    assert flattest_of(1.0, 20 * U, 1.0) < 6


def test_places_are_whole_numbers_that_int32_holds():
    scene = spread(3, seed=1)
    for width, height, fov in ((64, 48, 60.0), (1920, 1080, 60.0), (1920, 1080, 2.0), (7680, 4320, 25.0)):
        quick = quick_of(replace(scene, camera=replace(scene.camera, fov=fov)), (width, height))
        assert quick.usable
        bits = np.log2(quick.parts)
        assert bits == round(bits)
        farthest = 128 + 1.05 * np.sqrt(quick.widest) * quick.focus / 4
        assert 2.0**28 < farthest * quick.parts < 2.0**31


def test_no_light_is_closer_to_what_a_tile_shows_than_its_bound():
    """Points of random rays of random tiles, between the nearest sphere and the farthest."""
    rng = np.random.default_rng(11)
    known = 0
    for _ in range(300):
        focus, (middle_x, middle_y) = 10.0 ** rng.uniform(1, 4), rng.uniform(100, 1000, 2)
        left, top = (128 * rng.integers(0, 15)).item(), (32 * rng.integers(0, 30)).item()
        tile = Tile(0, left, top, left + 128, top + 32)
        quick = SimpleNamespace(focus=focus, middle_x=middle_x, middle_y=middle_y)
        u = np.append(rng.uniform(left, left + 127, 200), [left, left + 127, left]) - middle_x
        v = middle_y - np.append(rng.uniform(top, top + 31, 200), [top, top + 31, top + 31])
        rays = np.column_stack([u, v, np.full(len(u), -focus)]) / focus
        near, radius = 10.0 ** rng.uniform(-1, 2), 10.0 ** rng.uniform(-2, 0)
        far, depths = near + 10.0 ** rng.uniform(-1, 2), rng.uniform(0, 1, len(u))
        points = rays * np.maximum(near - radius + (far - near + 2 * radius) * depths, 0.0)[:, None]
        light = rng.choice([rng.normal(size=3) * 30, points[0] + rng.normal(size=3) * 10.0 ** rng.uniform(-2, 1)])
        longest = np.linalg.norm(rays, axis=1).max()
        bound = 1.0 / nearness_of.py_func(quick, tile, longest, *light, radius, (near, far))
        assert np.linalg.norm(points - light, axis=1).min() >= bound
        known += bound > 0.0
    assert known > 150


def some_light(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """By how much colours of 32 spheres of a tile, most of them near a rim, are off, and how much they may be.

    Colours and limits are the kernels', the truth is long double's.
    """
    width, height, fov = int(10.0 ** rng.uniform(2, 3.8)), int(10.0 ** rng.uniform(2, 3.8)), rng.choice([2, 25, 60, 95])
    scene = Scene(Camera(fov=float(fov)), lights=tuple(Light(tuple(away), (0.9, 0.7, 0.2)) for away in away_from(rng)))
    raster = make_plan(scene, "diffuse", width, height).raster
    quick = make_quick(raster, scene.lights, 0, (0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if not quick.usable:
        return np.zeros(0), np.zeros(0)
    left, top = 128 * int(rng.integers(0, width // 128 + 1)), 32 * int(rng.integers(0, height // 32 + 1))
    tile = Tile(0, left, top, min(left + 128, width), min(top + 32, height))
    columns, rows = rng.integers(left, left + 128, 32), rng.integers(top, top + 32, 32)
    rho, depth = 10.0 ** rng.uniform(-4, np.log10(0.25), 32), 10.0 ** rng.uniform(0, 1, 32)
    size, turn, rim = rho * quick.focus, rng.uniform(0, 6.3, 32), 1 - 10.0 ** rng.uniform(-5, 0, 32)
    at_x, at_y = (columns - left - 64) - rim * size * np.cos(turn), (rows - top - 16) - rim * size * np.sin(turn)
    fine = np.stack([columns - left - 64, rows - top - 16]).astype(np.int32) * np.int32(quick.parts)
    u, v = (columns - quick.middle_x) * quick.parts, (quick.middle_y - rows) * quick.parts
    longest = np.sqrt(max(
        (x - quick.middle_x) ** 2 + (y - quick.middle_y) ** 2 + quick.focus**2 for x in (left, left + 128)
        for y in (top, top + 32)
    ))  # fmt: skip
    off = 255 * coarseness_of(quick.parts, 1 / size, longest / quick.focus, quick.focus, quick.widest)
    places = np.rint(np.stack([at_x, at_y]) * quick.parts).astype(np.int32).view(np.float32)
    scaled = [size * quick.parts, depth / (quick.focus * quick.parts), *[255 / (size * quick.parts)] * 3, off]
    table = np.concatenate([*places, *np.float32(scaled)])
    extremes = (1 / size).max(), (rho * depth).max(), depth.min(), depth.max()
    found = np.empty(3 * 32, np.float32)
    of_slope, of_all, steepest = lighting()(
        quick,
        np.zeros((1, KERNELS.DESK), np.uint8),
        table,
        tile,
        longest,
        extremes,
        *fine,
        np.float32([*u, *v] * 4),
        found,
    )
    red, steep, off = found.reshape(3, 32)
    sure = steep < steepest
    true, hit = true_light(scene, quick, columns, rows, (at_x + left + 64, at_y + top + 16), size, depth)
    return np.abs(red - true)[sure & hit], ((of_slope * steep + of_all) * off)[sure & hit]


def away_from(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(int(rng.integers(1, 4)), 3)) * rng.choice([2.0, 20.0])


def true_light(scene: Scene, quick, columns, rows, at, size, depth) -> tuple[np.ndarray, np.ndarray]:
    """Of white spheres with their middles in column at[0] and row at[1], the red channel; and where they are hit."""
    u, v, focus = (np.longdouble(x) for x in (columns - quick.middle_x, quick.middle_y - rows, quick.focus))
    du, dv, size = np.longdouble(columns) - at[0], at[1] - np.longdouble(rows), np.longdouble(size)
    along, a = du * u + dv * v, u * u + v * v + focus * focus
    disc = along * along + a * (size * size - du * du - dv * dv)
    tau, total = -(along + np.sqrt(np.maximum(disc, 0))) / a, 0.0
    normal = np.stack([du + tau * u, dv + tau * v, -tau * focus]) / size
    point = depth / focus * (1 + tau) * np.stack([u, v, -focus + 0 * u])
    for light in scene.lights:
        away = np.longdouble(light.position)[:, None] - point
        total += np.maximum((normal * away).sum(axis=0) / np.sqrt((away * away).sum(axis=0)), 0) * light.colour[0]
    return np.float64(255 * total), disc > 0


@cache
def lighting():
    """A kernel: what `_light` finds for 32 pixels, red, ρ and c₁ in three rows; it returns the tile's limits."""

    @borrowing
    def lit(quick, memory, table, tile, longest, extremes, x, y, rays, found):
        sheet = desk_of(memory, 0).quick
        for k in range(len(table)):
            sheet.columns[k] = table[k]
        u, v, _, _, _, _, _, _ = sixteen.load_columns(rays)
        first, second = np.uint64(0), np.uint64(16)
        rows = sixteen.load_two(x, first, second), sixteen.load_two(y, first, second)
        (red, _, _), steep, off = _light(quick, sheet, rows[0], rows[1], u, v)
        lanes.store_pair(found, np.uint64(0), np.uint64(16), red)
        lanes.store_pair(found, np.uint64(32), np.uint64(48), steep)
        lanes.store_pair(found, np.uint64(64), np.uint64(80), off)
        blur, radius, near, far = extremes
        all_eight = lanes.spread(blur), lanes.spread(radius), lanes.spread(near), lanes.spread(far)
        return limits_of(quick, tile, longest, all_eight)

    return lit


def test_colours_are_no_further_off_than_their_bounds():
    rng = np.random.default_rng(3)
    parts = np.concatenate([error / bound for error, bound in (some_light(rng) for _ in range(400))])
    assert len(parts) > 5000
    assert 0.1 < parts.max() < 1.0


def full_tiles() -> Scene:
    """Seven tiles, a sphere a pixel: just missed, or just hit, so that float64 doubts all of them. 128 x 224 pixels."""
    rows, columns = np.mgrid[0:224, 0:128].reshape(2, -1)
    tile, nth = rows // 32, (rows % 32) * 128 + columns
    size = np.where(tile == 5, 0.0195, 0.69)
    hit = np.where((tile == 6) | ((tile == 4) & (nth < 256)), -8e-6, 8e-6)
    away = np.where(tile == 5, 0.0, size * (1 + hit) / np.sqrt(2))
    lines = np.column_stack([columns - 64 + away, 112 - rows + np.where(rows % 32 >= 16, away, -away)])
    kept = np.arange(len(tile)) > 0  # no list is longer than there is room for
    fov, focus = np.degrees(2 * np.arctan(112 / 65000)), 65000.0
    centres, materials = np.column_stack([lines / focus, -np.ones(len(lines))])[kept], Materials(np.full((1, 11), 0.7))
    count = len(centres)
    spheres = Spheres(
        size[kept] / focus, centres, np.zeros(count, np.int32), np.arange(count, dtype=np.int32), materials
    )
    camera = Camera((0.0, 0.0, 0.0), fov=float(fov))
    return Scene(camera, (0.0, 0.0, 0.0), (Light((1.0, 2.0, 3.0), (1.0, 1.0, 1.0)),), materials, spheres)


def painted(plan: Plan, room: int = 40_000):
    """What `paint_diffuse` makes of a plan: whether it is done, which doubts are left, and how many there were."""
    with open_screen(plan.scene, plan.raster, KERNELS, 1) as screen:
        paints, picture = make_paints(plan, screen), np.zeros((plan.raster.height, plan.raster.width, 3), np.uint8)
        doubts, end = np.full(room, -7, np.int64), screen.desks.doubts.shape[1]
        doubts[0] = 0
        desks, tiles = Desks(screen.desks.memory, doubts[None, :end]), screen.tiles_of(slice(0, plan.raster.height))
        picture_of = screen.view, screen.slow, screen.bins, tiles, desks, 0, paints, make_canvas(picture)
        done = alone(KERNELS.paint_diffuse, *picture_of)
    assert paints.quick.usable
    assert (doubts[end:] == -7).all()
    return done, doubts[1 : 1 + doubts[0]].tolist(), int((doubts[1:end] != -7).sum()), picture


def test_there_is_room_for_the_doubts_of_a_tile_and_of_all_that_was_put_off():
    done, left, listed, _ = painted(make_plan(full_tiles(), "diffuse", 128, 224, path=KERNELS))
    assert done
    assert not left
    assert 5 * 4000 < listed < 32_768


def one_tangent_ray(*others: tuple[float, float, float, float]) -> Scene:
    """The ray straight ahead touches the first sphere: 3² + 4² = 5²."""
    balls = np.array([(3 / 16, 4 / 16, -3.0, 5 / 16), *others])
    count, materials = len(balls), Materials(np.linspace(0.1, 1.0, 11 * len(balls)).reshape(-1, 11))
    numbers = np.arange(count, dtype=np.int32)
    light = Light((1.0, 2.0, 3.0), (1.0, 1.0, 1.0))
    spheres = Spheres(balls[:, 3].copy(), balls[:, :3].copy(), numbers, numbers, materials)
    return Scene(Camera((0.0, 0.0, 0.0)), (0.1, 0.2, 0.3), (light,), materials, spheres)


@pytest.mark.parametrize("stage", ["hit", "diffuse"])
def test_what_two_fold_float64_cannot_tell_is_left_to_integers(stage):
    scene, (width, height) = one_tangent_ray((0.0, 0.1, -4.0, 0.3)), (64, 48)
    done, left, listed, _ = painted(make_plan(scene, "diffuse", width, height, path=KERNELS))
    assert done
    assert set(left) == {height // 2 * width + width // 2}
    assert listed <= 3  # not once a lane
    np.testing.assert_array_equal(*(drawn(scene, stage, path, (width, height)) for path in (KERNELS, plain)))


def test_doubts_of_float64_are_decided_by_whoever_finds_them():
    scene = spread(30_000, seed=3)
    done, left, listed, picture = painted(make_plan(scene, "diffuse", 640, 360, path=KERNELS))
    assert done
    assert not left
    assert listed > 0
    np.testing.assert_array_equal(picture, drawn(scene, "diffuse", plain, (640, 360)))


def test_of_equal_spheres_the_first_is_seen():
    scene = spread(300, seed=10)
    spheres, rng = scene.spheres, np.random.default_rng(11)
    where = np.concatenate([np.arange(300), rng.permutation(300)])
    material, order = np.sort(rng.integers(0, 64, 600)).astype(np.int32), np.arange(600, dtype=np.int32)
    twins = Spheres(spheres.radii[where], spheres.centres[where], material, order, spheres.materials)
    twice = replace(scene, spheres=twins)
    _, left, listed, _ = painted(make_plan(twice, "diffuse", *SIZE, path=KERNELS))
    assert not left
    assert listed > 1000
    np.testing.assert_array_equal(*(drawn(twice, "diffuse", path) for path in (KERNELS, plain)))
