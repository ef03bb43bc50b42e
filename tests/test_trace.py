"""What rays hit, on both paths, against exact arithmetic."""

import math
from itertools import chain

import naive
import numpy as np
import pytest
from cases import CASES
from hypothesis import given
from hypothesis import strategies as st

import raytracer
from raytracer import backend, exact, eye_hits, interpreter, plain, ray_intersect_scene
from raytracer.camera import make_raster
from raytracer.interpreter import interpret
from raytracer.scene import Camera, Sphere

PATHS = {"numpy": plain, "compiled": backend.load()}


@pytest.fixture(params=sorted(PATHS))
def path(request, monkeypatch):
    """Each test that asks for it runs on the numpy path and on the compiled path."""
    if request.param == "compiled" and backend.why_no_compiler():
        pytest.skip("numba is not installed")
    trace_on(PATHS[request.param], monkeypatch)
    return PATHS[request.param]


def trace_on(path, monkeypatch):
    monkeypatch.setattr(backend, "choose", lambda *_: path)
    monkeypatch.setattr(backend, "loaded", lambda: path)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_known_cases(path, case):
    hits = ray_intersect_scene(
        [case.origin], [case.direction], [s[0] for s in case.spheres], [s[1] for s in case.spheres]
    )
    assert (hits.t[0], hits.index[0]) == (case.t, case.index)
    assert hits.t.dtype == np.float64
    assert hits.index.dtype == np.int32


def assert_exact(hits, origins, directions, spheres):
    """Every index is exact arithmetic's, every t the nearest float or its neighbour."""
    for k, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        t, index = exact.nearest_hit(origin, direction, spheres)
        assert hits.index[k] == index, (k, origin, direction, spheres)
        assert hits.t[k] == t or abs(hits.t[k] - t) <= np.spacing(t)


SMALL = st.integers(-12, 12).map(float)
LATTICE_POINT = st.tuples(SMALL, SMALL, SMALL)
RAYS = st.lists(st.tuples(LATTICE_POINT, LATTICE_POINT.filter(any)), min_size=1, max_size=6)
BALLS = st.lists(st.tuples(LATTICE_POINT, st.integers(1, 15).map(float)), min_size=1, max_size=6)
TINY_TURN = st.integers(-3, 3)


@given(RAYS, BALLS)
def test_rays_of_small_integers_with_all_their_ties_and_tangents(rays, balls):
    origins, directions = zip(*rays, strict=True)
    centres, radii = zip(*balls, strict=True)
    assert_exact(ray_intersect_scene(origins, directions, centres, radii), origins, directions, balls)


@given(RAYS, BALLS, TINY_TURN, TINY_TURN, st.floats(-1e12, 1e12))
def test_the_same_by_an_ulp_or_far_from_the_origin(rays, balls, turn, swell, shift):
    origins = [tuple(x + shift for x in origin) for origin, _ in rays]
    directions = [(x + turn * math.ulp(x), y, z) for _, (x, y, z) in rays]
    balls = [(tuple(x + shift for x in centre), radius + swell * math.ulp(radius)) for centre, radius in balls]
    centres, radii = zip(*balls, strict=True)
    assert_exact(ray_intersect_scene(origins, directions, centres, radii), origins, directions, balls)


ANY = st.floats(allow_nan=False, allow_infinity=False)
ANYWHERE = st.tuples(ANY, ANY, ANY)


@given(
    ANYWHERE,
    ANYWHERE.filter(any),
    st.lists(st.tuples(ANYWHERE, st.floats(0, exclude_min=True, allow_infinity=False)), max_size=3),
)
def test_any_finite_numbers(origin, direction, balls):
    centres, radii = [b[0] for b in balls], [b[1] for b in balls]
    hits = ray_intersect_scene([origin], [direction], np.reshape(centres, (-1, 3)), radii)
    assert hits.index[0] == exact.nearest_hit(origin, direction, balls)[1]


def random_rays(count, spheres, seed):
    rng = np.random.default_rng(seed)
    centres, radii = rng.uniform(-5, 5, (spheres, 3)), rng.uniform(0.05, 0.8, spheres)
    origins = rng.uniform(-6, 6, (count, 3))
    return origins, rng.uniform(-1, 1, (count, 3)) * 10.0 ** rng.integers(-150, 150, (count, 1)), centres, radii


def test_ordinary_rays(path):
    origins, directions, centres, radii = random_rays(300, 40, seed=1)
    hits = ray_intersect_scene(origins, directions, centres, radii)
    assert (hits.index >= 0).sum() > 20
    spheres = list(zip(centres.tolist(), radii.tolist(), strict=True))
    assert_exact(hits, origins.tolist(), directions.tolist(), spheres)


@pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
def test_both_paths_find_the_same_bits(scene_path, monkeypatch):
    scene = interpreter(scene_path)
    found = []
    for module in PATHS.values():
        trace_on(module, monkeypatch)
        found.append(eye_hits(scene, 40, 30))
    for array, other in zip(*found, strict=True):
        np.testing.assert_array_equal(array, other)


def exact_numbers(scene):
    """The eye and all shapes as `exact.nearest_of` wants them."""
    shapes = [scene.shape(i) for i in range(len(scene))]
    numbers = [
        [*shape.centre, shape.radius] if isinstance(shape, Sphere) else list(chain.from_iterable(shape.vertices))
        for shape in shapes
    ]
    return [*scene.camera.eye, *chain.from_iterable(numbers)], list(map(len, numbers))


def test_pictures_are_exact(path, scene_path):
    scene = interpreter(scene_path)
    raster = make_raster(scene.camera, 64, 64)
    hits = eye_hits(scene, 64, 64)
    numbers, sizes = exact_numbers(scene)
    pixels = np.random.default_rng(7).integers(0, 64, (max(3, min(100, 3000 // max(1, len(sizes)))), 2)).tolist()
    for x, y in pixels:
        t, k = exact.nearest_of(numbers, *raster.whole_direction(x, y), sizes)
        assert hits.index[y, x] == k
        assert hits.t[y, x] == t or abs(hits.t[y, x] - t) <= np.spacing(t)


@pytest.mark.parametrize("name", ["06_icosahedron_and_sphere", "11_star"])
def test_of_triangles_that_share_an_edge_the_first_is_hit(path, name):
    """Rays of the middle row and column go exactly through edges, and meet both at the same t."""
    scene, size = interpreter(f"scenes/{name}.cli"), 128
    raster, hits, (numbers, sizes) = (
        make_raster(scene.camera, size, size),
        eye_hits(scene, size, size),
        exact_numbers(scene),
    )
    middle = [(x, size // 2) for x in range(size)] + [(size // 2, y) for y in range(size)]
    assert len({hits.index[y, x] for x, y in middle}) > 5
    for x, y in middle:
        assert hits.index[y, x] == exact.nearest_of(numbers, *raster.whole_direction(x, y), sizes)[1]


def test_rays_that_are_tangent_in_the_course_scenes():
    """√3 rounds down, and that much decides: 1/tan 30° in float64 arithmetic, which is larger, would hit."""
    scene = interpret("surface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4")
    assert eye_hits(scene).index[96, 128] == -1
    wider = interpret("fov 59.99999999999999\nsurface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 0 0 -4")
    assert eye_hits(wider).index[96, 128] == 0


def test_index_counts_all_shapes_of_the_file():
    triangle = "begin\nvertex 9 9 9\nvertex 9 8 9\nvertex 8 8 9\nend\n"
    sphere = "sphere 1 0 0 -4\n"
    scene = interpret("surface 1 1 1 0 0 0 0 0 0 1 0\n" + triangle + "sphere 1 0 0 9\n" + triangle + sphere)
    hits = eye_hits(scene, 9, 9)
    assert set(hits.index.ravel().tolist()) == {-1, 3}  # the triangles are behind the eye
    assert scene.shape(3) == scene.spheres[1]


def test_nothing_to_hit(path):
    hits = ray_intersect_scene([[0, 0, 0]], [[0, 0, 1]], np.empty((0, 3)), [])
    assert (hits.t[0], hits.index[0]) == (math.inf, -1)
    assert ray_intersect_scene(np.empty((0, 3)), np.empty((0, 3)), [[0, 0, 1]], [1]).t.shape == (0,)
    assert (eye_hits(raytracer.Scene(), 5, 4).index == np.full((4, 5), -1)).all()


@pytest.mark.parametrize(
    ("rays", "message"),
    [
        (([[0, 0, 0]], [[0, 0, 0]], [[0, 0, 1]], [1]), "directions: row 0 is zero"),
        (([[0, 0, 0]] * 2, [[0, 0, 1], [math.nan, 0, 1]], [[0, 0, 1]], [1]), "directions: row 1 is not finite"),
        (([[0, 0, math.inf]], [[0, 0, 1]], [[0, 0, 1]], [1]), "origins: row 0 is not finite"),
        (([[0, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], [0]), "radii: number 0 is 0.0"),
        (([[0, 0, 0]], [[0, 0, 1]], [[0, 0, 1]], [1, 2]), "radii: found shape"),
        (([[0, 0, 0]], [[0, 0, 1]] * 2, [[0, 0, 1]], [1]), "1 origins and 2 directions"),
        (([0, 0, 0], [[0, 0, 1]], [[0, 0, 1]], [1]), "origins: found an array of shape"),
    ],
)
def test_bad_rays_are_refused(rays, message):
    with pytest.raises(ValueError, match=message):
        ray_intersect_scene(*rays)


def test_boxes_lose_no_pixel(path):
    """Skewed frames, spheres beside and behind the eye, on a small picture: each pixel against every sphere."""
    rng = np.random.default_rng(3)
    for _ in range(25):
        u, v, w = (tuple(row) for row in rng.normal(size=(3, 3)))
        camera = Camera(tuple(rng.normal(size=3)), u, v, w, float(rng.uniform(5, 170)))
        centres, radii = rng.normal(size=(12, 3)) * 4, rng.uniform(0.1, 2.5, 12)
        raster = make_raster(camera, 13, 11, "centre")
        lines = [
            f"sphere {r!r} {x!r} {y!r} {z!r}" for r, (x, y, z) in zip(radii.tolist(), centres.tolist(), strict=True)
        ]
        scene = interpret("\n".join(["surface 1 1 1 0 0 0 0 0 0 1 0", *lines]))
        seen = raytracer.Scene(camera, spheres=scene.spheres, materials=scene.materials)
        hits = eye_hits(seen, 13, 11, sampling="centre")
        directions = [[float(x) for x in raster.exact_direction(x, y)] for y in range(11) for x in range(13)]
        every = ray_intersect_scene([camera.eye] * 143, directions, centres, radii)
        np.testing.assert_array_equal(hits.index.ravel(), every.index)


def test_naive_tracer_agrees(course_scene_path):
    """Every byte within 1 of an independent rendering, but for rays tangent or through an edge, for it to decide."""
    expected = naive.diffuse_picture(course_scene_path, 320, 320).astype(int)
    scene = interpreter(course_scene_path)
    found = raytracer.render_scene(scene).astype(int)
    wrong = np.argwhere(np.abs(found - expected).max(axis=2) > 1)
    assert len(wrong) <= 40
    hits, raster, (numbers, sizes) = eye_hits(scene), make_raster(scene.camera, 320, 320), exact_numbers(scene)
    for y, x in wrong.tolist():
        assert hits.index[y, x] == exact.nearest_of(numbers, *raster.whole_direction(x, y), sizes)[1]


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e-100, 1e-20, 1e20, 1e60, 1e82, 1e100, 1e150, 1e300])
def test_frames_of_any_size_draw_the_same_picture(path, size):
    """All rays are longer by that factor, and meet the same spheres."""
    scene = interpreter("scenes/04_many_spheres.cli")
    exponent = math.frexp(size)[1]
    axes = (tuple(math.ldexp(x, exponent) for x in axis) for axis in (scene.camera.u, scene.camera.v, scene.camera.w))
    camera = Camera(scene.camera.eye, *axes, scene.camera.fov)
    wide = raytracer.Scene(camera, spheres=scene.spheres, materials=scene.materials)
    np.testing.assert_array_equal(eye_hits(wide, 20, 20).index, eye_hits(scene, 20, 20).index)


@pytest.mark.parametrize("fov", [1e-300, 1e-153, 1e-120, 1e-20, 1e-6])
def test_narrow_views_lose_nothing(path, fov):
    scene = interpret(f"fov {fov!r}\nsurface 1 1 1 0 0 0 0 0 0 1 0\nsphere 1 .25 0 -4\nsphere 1e-3 0 0 -2")
    assert (eye_hits(scene, 7, 7).index == 1).all()


def test_t_is_right_to_the_last_digit_very_close_to_a_sphere(path):
    near = interpret(
        "uvw 0 0 1 -0.9994363150364214 0.03357159791280531 0 -0.03357159791280531 -0.9994363150364214 0\n"
        "surface 1 1 1 0 0 0 0 0 0 1 0\nsphere 165030125 5540325 164937100 0.0013135069282355306\n"
    )
    assert eye_hits(near, 3, 3).t[0, 0] == 3.017941965283198e-15
    rng = np.random.default_rng(5)
    for _ in range(40):
        centre, radius = rng.normal(size=3) * 10.0 ** rng.uniform(0, 8), 10.0 ** rng.uniform(0, 8)
        centre *= radius * (1 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-17, -8)) / np.linalg.norm(centre)
        x, y, z = centre.tolist()
        scene = interpret(f"fov 120\nsurface 1 1 1 0 0 0 0 0 0 1 0\nsphere {radius!r} {x!r} {y!r} {z!r}")
        raster, hits = make_raster(scene.camera, 6, 6), eye_hits(scene, 6, 6)
        for row, column in np.ndindex(6, 6):
            direction, unit = raster.whole_direction(column, row)
            t, index = exact.nearest_hit(scene.camera.eye, direction, [((x, y, z), radius)], unit)
            assert hits.index[row, column] == index
            assert hits.t[row, column] == t or abs(hits.t[row, column] - t) <= np.spacing(t)


def random_triangles(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, (count, 1, 3)) + rng.uniform(-1, 1, (count, 3, 3))


def assert_hits_are_exact(hits, origins, directions, balls, corners):
    shapes = [[*ball] for ball in balls.tolist()] + corners.reshape(-1, 9).tolist()
    sizes, numbers = list(map(len, shapes)), list(chain.from_iterable(shapes))
    for k in range(len(origins)):
        t, index = exact.nearest_of(origins[k].tolist() + numbers, directions[k].tolist(), 1, sizes)
        assert hits.index[k] == index
        assert hits.t[k] == t or abs(hits.t[k] - t) <= np.spacing(t)


@pytest.mark.parametrize("spheres", [0, 5, 40])
def test_rays_meet_spheres_and_triangles(path, spheres):
    origins, _, centres, radii = random_rays(300, 40, seed=3)
    corners, rng = random_triangles(12, 4), np.random.default_rng(9)
    directions = corners.mean(axis=1)[rng.integers(0, 12, 300)] + rng.uniform(-0.5, 0.5, (300, 3)) - origins
    hits = ray_intersect_scene(origins, directions, centres[:spheres], radii[:spheres], triangles=corners)
    assert (hits.index >= spheres).sum() > 10
    balls = np.column_stack([centres, radii])[:spheres]
    assert_hits_are_exact(hits, origins, directions, balls, corners)


def test_rays_through_edges_and_corners_and_within_planes(path):
    """Points on edges that floats hold exactly, seen from origins that floats hold exactly."""
    rng = np.random.default_rng(8)
    corners = rng.integers(-8, 8, (6, 3, 3)).astype(float)
    corners = np.concatenate([corners, corners[:, [1, 0, 2]] + [[[0, 0, 0], [0, 0, 0], [1, 2, 3]]]])  # that share edges
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    corners = corners[flat.any(axis=1)]
    weights = rng.integers(0, 3, (400, 3))
    weights[~weights.any(axis=1)] = 1
    which = rng.integers(0, len(corners), 400)
    targets = (weights[:, :, None] * corners[which]).sum(axis=1) * 4 / weights.sum(axis=1)[:, None]
    origins = rng.integers(-12, 12, (400, 3)).astype(float)
    origins[::5] = corners[which[::5], 0] * 2 - corners[which[::5], 1]  # in the plane
    directions = targets - 4 * origins
    kept = directions.any(axis=1)
    origins, directions = origins[kept], directions[kept]
    hits = ray_intersect_scene(origins, directions, np.empty((0, 3)), [], triangles=corners)
    assert (hits.index >= 0).mean() > 0.3
    assert_hits_are_exact(hits, origins, directions, np.empty((0, 4)), corners)


@pytest.mark.parametrize("method", ["textbook", "haines32"])
def test_usual_methods_meet_triangles_too(path, method):
    hits = ray_intersect_scene(
        [[0, 0, 0], [0, 0, 0]], [[0, 0, -2], [0.1, 0.1, -2]], [[0, 0, -9]], [1], method,
        triangles=[[[-1, -1, -4], [1, -1, -4], [0, 1, -4]]],
    )  # fmt: skip
    assert hits.index.tolist() == [1, 1]
    np.testing.assert_allclose(hits.t, 2, rtol=1e-6)


@pytest.mark.parametrize(
    ("triangles", "message"),
    [
        (np.zeros((2, 3)), "expected \\(m, 3, 3\\)"),
        ([[[0, 0, 0], [1, 1, 1], [2, 2, 2]]], "number 0 lie on one line"),
        ([[[0, 0, 0], [1, 1, np.nan], [2, 2, 2]]], "number 0 has a corner that is not finite"),
    ],
)
def test_bad_triangles_are_refused(triangles, message):
    with pytest.raises(ValueError, match=message):
        ray_intersect_scene([[0, 0, 0]], [[0, 0, 1]], [[0, 0, 9]], [1], triangles=triangles)
