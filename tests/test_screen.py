"""Eye rays in tiles: the same hits and the same bytes as the numpy path, whatever the size, the threads, the memory."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from raytracer import STAGES, backend, exact, eye_hits, interpreter, make_plan, plain, render_scene, screen
from raytracer.arrays import Hits, Records
from raytracer.bench import spread
from raytracer.boxes import make_lens
from raytracer.camera import make_raster
from raytracer.eye import count_tests
from raytracer.glance import make_glance
from raytracer.interpreter import interpret
from raytracer.orbit import turned
from raytracer.render import draw, hits_of, open_tracer
from raytracer.scene import Camera, Materials, Scene, Spheres
from raytracer.screen import open_screen

pytestmark = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
KERNELS = backend.load()
SHARED = np.zeros(240, np.uint8)
PAINTED = [name for name, stage in STAGES.items() if stage.painter]


def drawn(scene, stage, width, height, path, **options):
    return draw(make_plan(scene, stage, width, height, path=path), **options)


@pytest.mark.parametrize("stage", PAINTED)
@pytest.mark.parametrize("size", [(1, 1), (67, 65), (130, 3)], ids=str)
def test_kernels_paint_the_bytes_that_numpy_draws(scene_path, stage, size):
    scene = interpreter(scene_path)
    if len(scene.spheres) > 1000 and size != (67, 65):
        pytest.skip("one size of the large scene is enough")
    found, expected = (drawn(scene, stage, *size, path) for path in (KERNELS, plain))
    np.testing.assert_array_equal(found, expected)


def around_the_eye(count: int, seed: int) -> Scene:
    """Spheres everywhere: before, beside, behind and about the eye, some of them large, and a skewed camera."""
    rng = np.random.default_rng(seed)
    centres, radii = rng.normal(size=(count, 3)) * 3, 10.0 ** rng.uniform(-3, 0.3, count)
    order = np.arange(count, dtype=np.int32)
    spheres = Spheres(radii, centres, np.zeros(count, np.int32), order, interpret(SURFACE).materials)
    u, v, w = (tuple(row) for row in (np.eye(3) + rng.normal(size=(3, 3)) / 5).tolist())
    return replace(interpret(SURFACE), camera=Camera((0.0, 0.1, 0.2), u, v, w, 70.0), spheres=spheres)


SURFACE = "light 3 4 5 1 1 1\nlight -3 0 1 .5 .5 .2\nsurface .9 .7 .5 0 0 0 0 0 0 1 0\nrender"


@pytest.mark.parametrize("seed", range(6))
def test_both_paths_find_the_same_hits_among_spheres_all_around(seed):
    scene = around_the_eye(300, seed)
    found = []
    for path in (KERNELS, plain):
        plan = make_plan(scene, "hit", 90, 70, "centre", path=path)
        with open_tracer(plan) as tracer:
            found.append(hits_of(plan, tracer, polished=True))
    np.testing.assert_array_equal(found[0].index, found[1].index)
    np.testing.assert_array_equal(found[0].t, found[1].t)
    np.testing.assert_array_equal(drawn(scene, "diffuse", 90, 70, KERNELS), drawn(scene, "diffuse", 90, 70, plain))


def distances(count, seed):
    """Rays of a picture of 120 × 90 pixels, and of each a sphere that it grazes: no two of them overlap.

    The line of the ray is that part of the radius from the rim whose root is beyond what float64 is certain of.
    """
    rng, raster = np.random.default_rng(seed), make_raster(Camera(), 120, 90)
    pixels = rng.permutation(30 * 22)[:count]
    xs, ys = pixels % 30 * 4 + 2, pixels // 30 * 4 + 2
    steps = [raster.whole_direction(int(x), int(y)) for x, y in zip(xs, ys, strict=True)]
    ahead = np.array([[part / unit for part in whole] for whole, unit in steps])
    ahead *= (rng.uniform(5, 20, count) / np.linalg.norm(ahead, axis=1))[:, None]
    aside = np.cross(ahead, rng.normal(size=(count, 3)))
    aside /= np.linalg.norm(aside, axis=1)[:, None]
    radii = np.linalg.norm(ahead, axis=1) * rng.uniform(0.002, 0.004, count)
    cosines = 10.0 ** rng.uniform(-4, -2, count)
    centres = ahead + aside * (radii * np.sqrt(1 - cosines**2))[:, None]
    return xs, ys, centres, radii


def test_the_last_digit_is_exact_also_where_a_ray_grazes_a_small_sphere():
    xs, ys, centres, radii = distances(300, seed=1)
    order = np.arange(len(radii), dtype=np.int32)
    material = np.zeros(len(radii), np.int32)
    scene = replace(interpret(SURFACE), spheres=Spheres(radii, centres, material, order))
    hits, raster = eye_hits(scene, 120, 90), make_raster(scene.camera, 120, 90)
    for k, (x, y) in enumerate(zip(xs.tolist(), ys.tolist(), strict=True)):
        numbers = [*scene.camera.eye, *centres[k].tolist(), float(radii[k])]
        t, _ = exact.nearest_of(numbers, *raster.whole_direction(x, y))
        assert hits.index[y, x] == k
        assert abs(hits.t[y, x] - t) <= np.spacing(t)


def test_both_paths_find_the_same_hits_among_small_spheres():
    scene = spread(2000, seed=5)
    for size in ((203, 131), (64, 32), (9, 33)):
        found = []
        for path in (KERNELS, plain):
            plan = make_plan(scene, "hit", *size, path=path)
            with open_tracer(plan) as tracer:
                found.append(hits_of(plan, tracer, polished=True))
        np.testing.assert_array_equal(found[0].index, found[1].index)
        np.testing.assert_array_equal(found[0].t, found[1].t)


@pytest.mark.parametrize("name", ["04_many_spheres", "06_icosahedron_and_sphere", "hard/03_eye_inside_a_sphere"])
def test_hits_may_be_written_into_given_arrays(name):
    scene = interpreter(f"scenes/{name}.cli")
    expected, out = eye_hits(scene, 70, 50), Hits(np.zeros((50, 70)), np.zeros((50, 70), np.int32))
    assert eye_hits(scene, 70, 50, out=out) is out
    for found, array in zip(out, expected, strict=True):
        np.testing.assert_array_equal(found, array)


@pytest.mark.parametrize(
    ("t", "index", "message"),
    [
        (np.zeros((5, 6)), np.zeros((6, 5), np.int32), r"out.index: found int32 \(6, 5\), expected int32 \(5, 6\)"),
        (np.zeros((5, 6), np.float32), np.zeros((5, 6), np.int32), r"out.t: found float32 .*, expected float64"),
        (np.zeros((5, 7))[:, :6], np.zeros((5, 6), np.int32), "out.t: found rows that lie apart"),
        (np.broadcast_to(0.0, (5, 6)), np.zeros((5, 6), np.int32), "out.t: found an array that is read-only"),
        (SHARED[:240].view(float).reshape(5, 6), SHARED[120:240].view(np.int32).reshape(5, 6), "share memory"),
    ],
)
def test_arrays_that_hits_cannot_be_written_into(t, index, message):
    with pytest.raises(ValueError, match=message):
        eye_hits(Scene(), 6, 5, out=Hits(t, index))


def test_other_things_that_hits_cannot_be_written_into():
    with pytest.raises(ValueError, match="out: found tuple, expected Hits"):
        eye_hits(Scene(), 6, 5, out=(np.zeros((5, 6)), np.zeros((5, 6), np.int32)))
    with pytest.raises(ValueError, match="read-only"):
        render_scene(Scene(), width=6, height=5, out=np.broadcast_to(np.uint8(0), (5, 6, 3)))


@pytest.mark.filterwarnings("ignore:the matrix subclass")
def test_hits_may_be_written_into_a_matrix():
    scene = spread(300, seed=4)
    out = Hits(np.asmatrix(np.zeros((50, 70))), np.asmatrix(np.zeros((50, 70), np.int32)))
    eye_hits(scene, 70, 50, out=out)
    expected = eye_hits(scene, 70, 50)
    np.testing.assert_array_equal(np.asarray(out.t), expected.t)
    np.testing.assert_array_equal(np.asarray(out.index), expected.index)


def test_only_what_has_been_looked_for_is_polished(monkeypatch):
    """Between two pieces of a picture, what is beyond is anything, such as no number, of a shape that there is not."""
    scene = interpreter("scenes/06_icosahedron_and_sphere.cli")
    expected = eye_hits(scene, 64, 300)
    monkeypatch.setattr(screen.Screen, "pieces", lambda self, moments: self._cut(1))
    monkeypatch.setattr(screen.Screen, "is_crowded", True)
    out = eye_hits(scene, 64, 300, out=Hits(np.full((300, 64), np.nan), np.full((300, 64), 10**9, np.int32)))
    for found, array in zip(out, expected, strict=True):
        np.testing.assert_array_equal(found, array)


@pytest.mark.parametrize("stage", ["diffuse", "depth", "edges", "cost"])
@pytest.mark.parametrize("height", [20, 3000])
def test_progress_counts_up_to_the_same_total(stage, height):
    told, shown = [], np.zeros(height, int)

    def progress(done, total, rows):
        told.append((done, total))
        shown[rows] += 1

    drawn(spread(50), stage, 900, height, KERNELS, progress=progress)
    counts, totals = zip(*told, strict=True)
    assert list(counts) == sorted(counts)
    assert set(totals) == {counts[-1]}
    assert (shown == 1).all()


def test_the_picture_does_not_depend_on_threads():
    scene = spread(20_000, seed=2)
    one = render_scene(scene, "diffuse", 300, 200, threads=1)
    for threads in (2, 3, 16):
        np.testing.assert_array_equal(render_scene(scene, "diffuse", 300, 200, threads=threads), one)


def test_doubts_that_do_not_fit_their_list_are_decided_on_the_way(monkeypatch):
    scene = interpreter("scenes/hard/08_tied_spheres.cli")
    expected = eye_hits(scene, 200, 200)
    monkeypatch.setattr(screen, "_DOUBTS", KERNELS.ROOM + 2)
    monkeypatch.setattr(screen, "_idle", [])
    found = eye_hits(scene, 200, 200)
    np.testing.assert_array_equal(found.index, expected.index)
    np.testing.assert_array_equal(found.t, expected.t)
    for stage in PAINTED:
        np.testing.assert_array_equal(drawn(scene, stage, 200, 200, KERNELS), drawn(scene, stage, 200, 200, plain))


@pytest.mark.parametrize("width", [64, 75, 203])
@pytest.mark.parametrize("stage", PAINTED)
def test_out_may_be_the_first_three_bands_of_four(width, stage):
    scene = spread(500, seed=3)
    picture = np.full((50, width, 4), 7, np.uint8)
    assert render_scene(scene, stage, width, 50, out=picture[..., :3]).base is not None
    np.testing.assert_array_equal(picture[..., :3], render_scene(scene, stage, width, 50))
    assert (picture[..., 3] == 7).all()


@pytest.mark.parametrize("view", [np.s_[::-1], np.s_[:, ::-1], np.s_[..., ::-1], np.s_[:, :, 0:6:2]])
def test_out_may_be_any_other_view(view):
    scene = spread(500, seed=3)
    room = np.zeros((40, 30, 6 if view == np.s_[:, :, 0:6:2] else 3), np.uint8)
    render_scene(scene, "diffuse", 30, 40, out=room[view])
    np.testing.assert_array_equal(room[view], render_scene(scene, "diffuse", 30, 40))


def test_rows_of_out_may_lie_apart():
    scene, room = spread(500, seed=3), np.full((40, 50, 3), 9, np.uint8)
    render_scene(scene, "normal", 31, 40, out=room[:, 5:36])
    np.testing.assert_array_equal(room[:, 5:36], render_scene(scene, "normal", 31, 40))
    assert (room[:, :5] == 9).all()
    assert (room[:, 36:] == 9).all()


def boxes_of(scene, raster, usable):
    """The box of each sphere, (n, 4), put together from its records, empty without; and which spheres are slow."""
    with open_screen(scene, raster, KERNELS) as opened:
        view, columns, count = opened.view, opened.bins.columns, len(scene.spheres)
        glance, (slow, spare) = make_glance(raster, view.kappa), np.empty((2, count + 64), np.int32)
        assert glance.usable

        def bound(size):
            room = Records(*(np.full(size, -1, np.int32) for _ in range(3)))
            found = KERNELS.bound(
                glance._replace(usable=usable), make_lens(raster), view.eye, view.reach, view.kappa, view.balls, 0,
                count, columns, room, slow, spare,
            )  # fmt: skip
            return room, found

        _, found = bound(7)  # too few: how many there would be
        room, found_again = bound(found[0] + KERNELS.SIXTEEN)
        assert found_again == found
    tiles, corners, shapes = (array[: found[0]] for array in room)
    x, y = tiles % columns * KERNELS.TILE_WIDTH, tiles // columns * KERNELS.TILE_HEIGHT
    left, right, top, bottom = (corners >> 8 * i & 255 for i in range(4))
    assert (left < right).all()
    assert (top < bottom).all()
    assert right.max() <= KERNELS.TILE_WIDTH
    assert bottom.max() <= KERNELS.TILE_HEIGHT
    boxes, area = np.tile(np.array([1 << 20, 0, 1 << 20, 0]), (count, 1)), np.zeros(count, np.int64)
    for side, (keep, ends) in enumerate(
        ((np.minimum, x + left), (np.maximum, x + right), (np.minimum, y + top), (np.maximum, y + bottom))
    ):
        keep.at(boxes[:, side], shapes, ends)
    np.add.at(area, shapes, (right - left) * (bottom - top))
    boxes[area == 0] = 0
    np.testing.assert_array_equal((boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2]), area)
    return boxes, slow[: found[1]].tolist()


@pytest.mark.parametrize(
    ("camera", "more"),
    [
        (Camera(), 0.01),
        (turned(Camera(eye=(1.0, 2.0, 3.0), fov=100.0), (0.0, 0.0, -5.0), 0.3, -0.2), 0.01),
        (Camera(fov=0.5), 0.3),
    ],
    ids=str,
)
def test_boxes_at_a_glance_hold_those_of_float64_and_little_more(camera, more):
    rng, count = np.random.default_rng(4), 200_000
    ahead = -np.array(camera.w) * rng.uniform(-2, 100, (count, 1))
    beside = rng.normal(size=(count, 2)) @ [camera.u, camera.v] * np.abs(ahead).max(1, keepdims=True)
    centres, radii = (
        np.array(camera.eye) + ahead + beside * rng.uniform(0, 1, (count, 1)),
        10.0 ** rng.uniform(-4, 0, count),
    )
    radii = np.where(rng.random(count) < 0.01, 30 * radii, radii)
    spheres = Spheres(radii, centres, np.zeros(count, np.int32), np.arange(count, dtype=np.int32))
    raster = make_raster(camera, 1500, 900, rows=slice(32, 850))
    scene = Scene(camera, materials=Materials(np.full((1, 11), 0.5)), spheres=spheres)
    (found, slow), (expected, slow_too) = (boxes_of(scene, raster, usable) for usable in (True, False))
    assert slow == slow_too
    shown = expected[:, 1] > 0
    assert shown.sum() > 1000
    assert (found[shown] * [1, -1, 1, -1] <= expected[shown] * [1, -1, 1, -1]).all()
    assert 0.0 < np.abs(found - expected)[shown].mean() < more
    assert np.count_nonzero(found[~shown, 1]) < 10 * more * shown.sum()


@pytest.mark.parametrize("count", [10, 37, 64])
def test_lists_longer_than_expected_are_made_all_the_same(monkeypatch, count):
    scene = spread(count, seed=2)
    expected = drawn(scene, "hit", 700, 400, KERNELS)
    monkeypatch.setattr(screen, "_idle", [])
    monkeypatch.setattr(screen, "_SPARE_RECORDS", 0)
    np.testing.assert_array_equal(drawn(scene, "hit", 700, 400, KERNELS), expected)


def test_memory_is_forty_bytes_a_sphere_at_most(monkeypatch):
    scene, few = spread(400_000, seed=1), spread(10, seed=1)
    sizes = []
    for each in (few, scene):
        monkeypatch.setattr(screen, "_idle", [])
        with open_screen(each, make_raster(each.camera, 64, 64), KERNELS) as opened:
            sizes.append(opened.workspace.nbytes)
    assert (sizes[1] - sizes[0]) / (len(scene.spheres) - len(few.spheres)) <= 40


def test_without_certainty_ordinary_pictures_are_the_same():
    scene = spread(1000, seed=4)
    plan = make_plan(scene, "diffuse", 320, 180)
    unchecked = draw(replace(plan, unchecked=True))
    assert (unchecked != draw(plan)).any(axis=2).mean() < 1e-4


def test_a_light_farther_than_squares_reach_still_shines():
    scene = interpret("light 0 0 1e200 1 1 1\nsurface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4")
    assert make_plan(scene, path=KERNELS).painter == ""
    found = render_scene(scene, "diffuse", 64, 64)
    near = interpret("light 0 0 1e9 1 1 1\nsurface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4")
    assert np.abs(found.astype(int) - render_scene(near, "diffuse", 64, 64)).max() <= 1
    assert found.max() == 255


BOX = st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(0, 7), st.integers(0, 7))


@settings(max_examples=50)
@given(st.lists(BOX, max_size=6))
def test_tests_are_counted_box_by_box(boxes):
    raster = make_raster(Camera(), 9, 7)
    expected = np.zeros((7, 9), int)
    for left, right, top, bottom in boxes:
        if left < right and top < bottom:
            expected[top:bottom, left:right] += 1
    np.testing.assert_array_equal(count_tests(np.array(boxes, np.int32).reshape(-1, 4), raster), expected)


def test_stage_cost_shows_the_tests_of_the_tracer():
    scene = spread(3000, seed=6)
    pictures = [drawn(scene, "cost", 60, 60, path) for path in (KERNELS, plain)]
    np.testing.assert_array_equal(*pictures)
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) >= 3
