"""Plane mirrors: what their images' boxes leave out no ray hits, and both paths draw the same bytes."""

import numpy as np
import pytest
from test_trace import PATHS

from raytracer import backend, make_plan
from raytracer.boxes import make_lens
from raytracer.camera import make_raster
from raytracer.interpreter import interpret
from raytracer.mirrors import NO_MIRRORS, mirror_planes, see_mirrors
from raytracer.render import draw
from raytracer.scene import Camera

pytestmark = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")

MIRROR = "surface .3 .2 .1 .1 .1 .1 .2 .2 .2 9 .6\n"
DULL = "surface .5 .4 .3 .1 .1 .1 .2 .2 .2 9 0\n"


def triangle(*corners):
    return "begin\n" + "".join("vertex " + " ".join(f"{x:.17g}" for x in corner) + "\n" for corner in corners) + "end\n"


def square(middle, a, b):
    """Two triangles, whose corners are middle ± a ± b."""
    middle, a, b = (np.array(vector, float) for vector in (middle, a, b))
    return triangle(middle - a - b, middle + a - b, middle + a + b) + triangle(
        middle - a - b, middle + a + b, middle - a + b
    )


def things(rng, count, size=1.0):
    """Balls and triangles about the origin, some of them mirrors."""
    text = ""
    for place in rng.uniform(-size, size, (count, 3)):
        text += (
            rng.choice([MIRROR, DULL]) + f"sphere {rng.uniform(0.05, 0.3) * size} {place[0]} {place[1]} {place[2]}\n"
        )
        text += DULL + triangle(*(place + rng.uniform(-0.4, 0.4, (3, 3)) * size))
    return text


def turned(rng):
    """Three directions at right angles, as random as a scene's mirror may lie."""
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return frame.T


def room(rng, size, far):
    """Six walls that are mirrors, turned anyhow, about some things; far is where all of it is."""
    text = f"light {far[0] + 0.3 * size} {far[1] + 0.8 * size} {far[2] + 0.2 * size} .7 .7 .7\n" + MIRROR
    axes = turned(rng)
    for i in range(3):
        for sign in (-1.5, 1.5):
            text += square(far + sign * size * axes[i], 1.5 * size * axes[i - 1], 1.5 * size * axes[i - 2])
    return text + shifted(things(rng, 8, size), far)


def shifted(text, far):
    moved = []
    for line in text.splitlines():
        words = line.split()
        if words[0] in ("sphere", "vertex"):
            moved.append(" ".join(words[:-3] + [f"{float(x) + y:.17g}" for x, y in zip(words[-3:], far, strict=True)]))
        else:
            moved.append(line)
    return "\n".join(moved) + "\n"


def assert_both_paths_agree(scene, width, height, sampling="corner"):
    pictures = [
        draw(make_plan(scene, "full", width, height, sampling, path=PATHS[path])) for path in ("numpy", "compiled")
    ]
    np.testing.assert_array_equal(*pictures)
    return pictures[0]


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("away", [0.0, 30.0, 1e4])
def test_a_room_of_mirrors(size, away):
    """Wherever it is, however large, seen from within."""
    rng = np.random.default_rng(int(np.log10(size) * 100 + away) & 1023)
    far = size * away * np.array([1.0, -0.7, 0.4])
    eye = far + size * np.array([0.9, 0.2, 1.2])
    scene = interpret(f"fov 70\neye {eye[0]:.17g} {eye[1]:.17g} {eye[2]:.17g}\n" + room(rng, size, far))
    _, numbers = mirror_planes(scene.triangles, len(scene.spheres.balls), 0)
    assert numbers.max() == 5
    picture = assert_both_paths_agree(scene, 131, 67)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 500


@pytest.mark.parametrize("seed", range(6))
def test_slanting_mirrors_seen_from_anywhere(seed):
    rng = np.random.default_rng(seed)
    text = f"fov {rng.uniform(20, 110)}\neye {' '.join(map(str, rng.uniform(-3, 3, 3)))}\n"
    text += f"uvw {' '.join(map(str, turned(rng).reshape(-1)))}\nlight 3 4 5 .7 .7 .7\nlight 0 0 0 .3 .3 .3\n"
    for _ in range(rng.integers(1, 9)):  # some of them more than there are images of
        axes = turned(rng)
        text += MIRROR + square(rng.uniform(-2, 2, 3), 4 * axes[0], 4 * axes[1])
    scene = interpret(text + things(rng, 12))
    for width, height, sampling in ((90, 50, "corner"), (17, 40, "centre")):
        assert_both_paths_agree(scene, width, height, sampling)


@pytest.mark.parametrize("far", [1e2, 1e6, 1e9])
@pytest.mark.parametrize("fov", [1e-2, 1e-5])
def test_a_mirror_that_reaches_far_seen_through_a_telescope(far, fov):
    """The corners' rounding moves the mirrored rays by more than a pixel."""
    rng, diagonal = np.random.default_rng(5), 2**-0.5
    frame = turned(rng)
    frame *= np.sign(np.linalg.det(frame))

    def words(*vectors):
        return " ".join(repr(x) for vector in vectors for x in (np.array(vector) @ frame).tolist())

    text = f"fov {fov!r}\neye {words([0, 5, 5])}\nlight {words([1, 9, 3])} .8 .8 .8\n"
    text += f"uvw {words([1, 0, 0], [0, diagonal, -diagonal], [0, diagonal, diagonal])}\n" + MIRROR
    corners = np.array([[-far, 0, -far], [1.3 * far, 0, -0.9 * far], [0.2 * far, 0, far]])
    text += triangle(*(corners @ frame)) + triangle(*(np.add(corners, [0, 5e-7, 0]) @ frame)) + DULL
    width = 10 * 2**0.5 * np.radians(fov)  # of what is seen where the balls are
    for x, y in rng.uniform(-0.6, 0.6, (30, 2)) * width:
        place = np.array([x, 5, -5]) + y * np.array([0, diagonal, diagonal])
        text += f"sphere {float(rng.uniform(0.02, 0.1) * width)!r} {words(place)}\n"
    picture = assert_both_paths_agree(interpret(text), 120, 90)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


def test_slivers_and_flat_frames_are_looked_for_in_the_tree():
    sliver = triangle([-500, -1, 0], [500, -1, -0.001], [500, -1, 0.001])
    scene = interpret("light 3 4 5 .7 .7 .7\n" + MIRROR + sliver + things(np.random.default_rng(2), 12))
    planes, numbers = mirror_planes(scene.triangles, len(scene.spheres.balls), 0)
    assert not planes
    assert (numbers == -1).all()
    rng = np.random.default_rng(3)
    flat = interpret(
        "uvw 1 0 0 1 1e-3 0 0 0 1\neye 0 0 4\n" + MIRROR + square([0, -1, 0], [3, 0, 0], [0, 0, 3]) + things(rng, 9)
    )
    assert_both_paths_agree(flat, 60, 40)
    lens, box = make_lens(make_raster(flat.camera, 60, 40)), np.array([0, 60, 0, 40], np.int32)
    balls, corners = flat.spheres.balls, flat.triangles.vertices
    shown = np.tile(box, (len(corners), 1))
    assert see_mirrors(lens, (0.0, 0.0, 4.0), balls, corners, flat.triangles, 0, shown, backend.load()) is NO_MIRRORS


def test_lists_that_are_too_long_are_not_made():
    boxes = np.tile(np.array([0, 64, 0, 64], np.int32), (1, 10, 1))
    starts, entries = backend.load().sort_into_cells(boxes, 8, 8, 3, 0, 640)
    assert (len(starts), len(entries)) == (65, 1280)
    starts, entries = backend.load().sort_into_cells(boxes, 8, 8, 3, 0, 639)
    assert (len(starts), len(entries)) == (0, 0)


def test_a_mirror_shows_what_a_window_would_of_the_mirror_image():
    """The boxes, for each shape, are those of where it is behind the mirror; empty where the eye sees nothing of it."""
    balls = "".join(f"sphere .2 {x} 1 -6\n" for x in range(-4, 5))
    scene = interpret(MIRROR + square([0, -1, -5], [9, 0, 0], [0, 0, 9]) + DULL + balls + "sphere .2 0 1 90\n")
    image = interpret(DULL + balls.replace(" 1 -6", " -3 -6") + "sphere .2 0 -3 90\n")
    raster, kernels = make_raster(Camera(), 200, 160), backend.load()
    lens, corners = make_lens(raster), scene.triangles.vertices
    shown = np.tile(np.array([0, 200, 0, 160], np.int32), (2, 1))
    glass = see_mirrors(lens, (0.0, 0.0, 0.0), scene.spheres.balls, corners, scene.triangles, 0, shown, kernels)
    expected = np.zeros((len(image.spheres.balls), 4), np.int32)
    kernels.bound_images(
        lens, (0.0, 0.0, 0.0), (0.0,) * 5, image.spheres.balls.reshape(-1), np.empty((0, 3, 3)), expected.reshape(-1)
    )
    first = len(scene.spheres.balls)
    assert glass.of.tolist() == [-1] * first + [0, 0]
    seen = pixels_of(glass)
    for i in range(len(scene.spheres)):
        left, right, top, bottom = expected[i]
        box = {(x, y) for x in range(left, right) for y in range(top, bottom)}
        assert seen.get(i, set()) == box
        assert (len(box) > 20) == (i < 9)
    assert not seen.keys() - {*range(len(scene.spheres)), first, first + 1}


def pixels_of(glass):
    """Which pixels the cells say may show each shape."""
    cells, found = glass.cells, {}
    for cell in range(cells.per_screen):
        x, y = cell % cells.columns << glass.shift, cell // cells.columns << glass.shift
        for place in range(cells.starts[cell], cells.starts[cell + 1]):
            shape, box = cells.entries[2 * place : 2 * place + 2].tolist()
            left, right, top, bottom = box & 255, 127 - (box >> 8 & 255), box >> 16 & 255, 127 - (box >> 24 & 255)
            right, bottom = (min(end, (1 << glass.shift) - 1) for end in (right, bottom))
            found.setdefault(shape, set()).update(
                (x + i, y + j) for i in range(left, right + 1) for j in range(top, bottom + 1)
            )
    return found


def test_planes_are_told_apart_and_put_together():
    """Two triangles of one wall are one plane, whichever way they turn; another wall, and a dull one, are not."""
    up = triangle([0, 0, 0], [1, 0, 0.5], [0, 0.3, 1])
    down = triangle([1, 0.3, 1.5], [0, 0.3, 1], [1, 0, 0.5])
    beside = triangle([0, 1e-9, 0], [1, 1e-9, 0.5], [0, 0.3 + 1e-9, 1])
    scene = interpret(MIRROR + up + down + beside + DULL + up)
    planes, numbers = mirror_planes(scene.triangles, 8, 0)
    assert numbers.tolist() == [-1] * 8 + [0, 0, 1, -1]
    assert len(planes) == 2
