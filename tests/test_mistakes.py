"""Usual mistakes: each is recognised as itself, made here or elsewhere, and no other picture as any."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import COURSE, HARD, SCENES

from raytracer import STAGES, Light, Method, Stage, interpreter, make_plan, mistakes, render_scene
from raytracer.compare import differences
from raytracer.guide import LOOKS, Guide
from raytracer.interpreter import interpret
from raytracer.methods import Limits, inner, minus
from raytracer.mistakes import A_QUADRATIC, MISTAKES, OF_THE_QUADRATIC, advice, recognise
from raytracer.plug import Order, draw_plugged, load_plug
from raytracer.render import draw
from raytracer.scene import Materials

TEMPLATE = Path(mistakes.__file__).parent / "templates" / "tracer.py"
WIDTH, HEIGHT = 54, 45
ENOUGH = 12  # wrong pixels, so that some tell
FIRST_OF_FULL = list(MISTAKES).index("no ambient colour")
AT_DIFFUSE = [name for name in list(MISTAKES)[:FIRST_OF_FULL] if name not in OF_THE_QUADRATIC]
AT_FULL = list(MISTAKES)[FIRST_OF_FULL:]
CUT_OFF = "colours cut off, not rounded: off by 1, which is allowed"


def drawn(scene, stage, name, width=WIDTH, height=HEIGHT):
    """The whole picture, by the guide's tracer with a mistake, or without."""
    guide = Guide(scene, stage, width, height)
    steps = MISTAKES[name].done(guide.steps) if name else guide.steps
    y, x = np.mgrid[0:height, 0:width].reshape(2, -1)
    return guide.paint(steps, x, y).reshape(height, width, 3)


@pytest.mark.parametrize("stage", LOOKS)
def test_the_guides_tracer_draws_what_render_scene_does(course_scene_path, stage):
    """But for rays that are exactly tangent."""
    scene = interpreter(course_scene_path)
    off = differences(drawn(scene, stage, None), render_scene(scene, stage, WIDTH, HEIGHT))
    assert np.count_nonzero(off > 1) <= 8


def check_recognised(scene, stage, names):
    right = render_scene(scene, stage, WIDTH, HEIGHT)
    for name in names:
        picture = drawn(scene, stage, name)
        if np.count_nonzero(differences(picture, right) > (not MISTAKES[name].allowed)) > ENOUGH:
            found = recognise(picture, scene, stage, expected=right)
            single = [each for each in found if each != A_QUADRATIC]
            assert (
                name in found
                or (name in OF_THE_QUADRATIC and A_QUADRATIC in found)
                or any(np.array_equal(drawn(scene, stage, each), picture) for each in single)
            ), name
        else:
            assert recognise(picture, scene, stage, expected=right) in ((), (CUT_OFF,), (name,)), name


def test_each_mistake_is_recognised_at_diffuse(course_scene_path):
    check_recognised(interpreter(course_scene_path), "diffuse", AT_DIFFUSE)


@pytest.mark.parametrize("scene", ["03_shiny_sphere", "07_colorful_lights", "08_reflective_sphere"])
def test_each_mistake_is_recognised_at_full(scene):
    check_recognised(interpreter(SCENES / f"{scene}.cli"), "full", [*AT_FULL, "normals inwards", "upside down"])


def test_each_mistake_in_the_quadratic_is_recognised():
    check_recognised(interpreter(SCENES / "07_colorful_lights.cli"), "diffuse", OF_THE_QUADRATIC)


SHADE = """
fov 50
background .1 .2 .3
light 3 4 0  .8 .2 .2
light -3 4 2  .2 .7 .3
surface .5 .4 .3  .1 .1 .2  .4 .4 .4  8  .3
sphere 1.5  0 0 -4
sphere .5  -.8 .9 -2.9
sphere 6   0 -7.2 -6
sphere 1   0 .5 4
sphere 30   0 0 0
"""


def far_root(origin, direction, centre, r):
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    disc = h * h - a * c
    t = (-h + np.sqrt(abs(disc))) / a
    return np.where((disc >= 0) & (t > 0), t, np.inf)


def near_root(origin, direction, centre, r):
    away = minus(origin, centre)
    a, h, c = inner(direction, direction), inner(direction, away), inner(away, away) - r * r
    disc = h * h - a * c
    t = (-h - np.sqrt(abs(disc))) / a
    return np.where((disc >= 0) & (t > 0), t, np.inf)


def shaded(term, clip=lambda x: np.maximum(x, 0), share=1):
    """A stage like `diffuse` with another term."""

    def colours(block):
        total = np.zeros_like(block.diffuse)
        for light in block.lights:
            cosine = clip((block.normals * block.to_light(light)).sum(axis=1))[:, None]
            total += term(block.diffuse, np.array(light.colour), cosine) / share
        return block.paint(total, elsewhere=block.scene.background)

    return Stage("?", colours, "a mistake", needs_normals=True, needs_lights=True)


def picture_of(scene, stage="diffuse", method="certified", **options):
    return draw(make_plan(scene, stage, 90, 80, method=method, **options))


def usual(function):
    return Method(function, "a mistake", "none", Limits())


def of_surface(scene, column, value):
    table = scene.materials.table.copy()
    table[:, column] = value
    return replace(scene, materials=Materials(table))


ELSEWHERE = {
    "upside down": lambda s: picture_of(s)[::-1],
    "left and right exchanged": lambda s: picture_of(s)[:, ::-1],
    "one row too low": lambda s: np.roll(picture_of(s), 1, axis=0),
    "one row too high": lambda s: np.roll(picture_of(s), -1, axis=0),
    "one column too far left": lambda s: np.roll(picture_of(s), -1, axis=1),
    "rays through the pixels' centres": lambda s: picture_of(s, sampling="centre"),
    "red and blue exchanged": lambda s: picture_of(s)[..., ::-1],
    "uvw ignored": lambda s: picture_of(replace(s, camera=replace(s.camera, u=(1, 0, 0), v=(0, 1, 0), w=(0, 0, 1)))),
    "looks backwards, + d·w": lambda s: picture_of(
        replace(s, camera=replace(s.camera, w=tuple(-x for x in s.camera.w)))
    ),
    "eye taken as 0 0 0": lambda s: picture_of(replace(s, camera=replace(s.camera, eye=(0, 0, 0)))),
    "tan(fov) in place of tan(fov / 2)": lambda s: picture_of(replace(s, camera=replace(s.camera, fov=100))),
    "tan(fov / 2) in place of 1 / tan(fov / 2)": lambda s: picture_of(replace(s, camera=replace(s.camera, fov=130))),
    "d = 1, whatever fov is": lambda s: picture_of(replace(s, camera=replace(s.camera, fov=90))),
    "V negated": lambda s: picture_of(replace(s, camera=replace(s.camera, v=tuple(-x for x in s.camera.v)))),
    "far root taken": lambda s: picture_of(s, method=usual(far_root)),
    "hits from inside missed": lambda s: picture_of(s, method=usual(near_root)),
    "only the first light": lambda s: picture_of(replace(s, lights=s.lights[:1])),
    "only the last light": lambda s: picture_of(replace(s, lights=s.lights[-1:])),
    "background black": lambda s: picture_of(replace(s, background=(0, 0, 0))),
    "divided by the number of lights": lambda s: picture_of(s, shaded(lambda d, i, c: d * i * c, share=2)),
    "negative N·L not clipped": lambda s: picture_of(s, shaded(lambda d, i, c: d * i * c, clip=lambda x: x)),
    "|N·L| in place of max(0, N·L)": lambda s: picture_of(s, shaded(lambda d, i, c: d * i * c, clip=abs)),
    "diffuse + light · max(0, N·L)": lambda s: picture_of(s, shaded(lambda d, i, c: d + i * c)),
    "diffuse · light + max(0, N·L)": lambda s: picture_of(s, shaded(lambda d, i, c: d * i + c)),
    "(diffuse + light) · max(0, N·L)": lambda s: picture_of(s, shaded(lambda d, i, c: (d + i) * c)),
    CUT_OFF: lambda s: picture_of(
        s, replace(STAGES["diffuse"], painter="", colours=lambda b: STAGES["diffuse"].colours(b) - 0.5 / 255)
    ),
}
ELSEWHERE_FULL = {
    "no ambient colour": lambda s: picture_of(of_surface(s, slice(3, 6), 0), "full"),
    "no highlights": lambda s: picture_of(of_surface(s, slice(6, 9), 0), "full"),
    "no power": lambda s: picture_of(of_surface(s, 9, 1), "full"),
    "no reflections": lambda s: picture_of(of_surface(s, 10, 0), "full"),
}


@pytest.mark.parametrize("name", ELSEWHERE)
@pytest.mark.parametrize("outside", [True, False], ids=["outside", "inside"])
def test_mistakes_that_are_made_elsewhere_are_recognised(name, outside):
    """By the scene, by a method, by a stage, in the finished picture: nothing of the guide's tracer draws them."""
    scene = interpret(
        SHADE if not outside else "eye .3 .2 1\nuvw 0 1 0 -1 0 0 0 0 1\n" + SHADE.replace("sphere 30", "#")
    )
    right, picture = picture_of(scene), np.ascontiguousarray(ELSEWHERE[name](scene))
    if np.count_nonzero(differences(picture, right) > (name != CUT_OFF)) > ENOUGH:
        assert recognise(picture, scene)[0] == name
    else:
        assert outside or name in ("uvw ignored", "eye taken as 0 0 0", "background black")
        assert recognise(picture, scene) == ()


@pytest.mark.parametrize("name", ELSEWHERE_FULL)
def test_mistakes_of_all_light_that_are_made_elsewhere_are_recognised(name):
    scene = interpret(SHADE)
    assert recognise(ELSEWHERE_FULL[name](scene), scene, "full") == (name,)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("upside down", "diffuse + light · max(0, N·L)"),
        ("rays through the pixels' centres", "divided by the number of lights"),
        ("red and blue exchanged", "far root taken"),
    ],
)
def test_two_mistakes_together_are_recognised(first, second):
    scene = interpret(SHADE)
    guide = Guide(scene, "diffuse", 90, 80)
    y, x = np.mgrid[0:80, 0:90].reshape(2, -1)
    picture = guide.paint(MISTAKES[second].done(MISTAKES[first].done(guide.steps)), x, y).reshape(80, 90, 3)
    assert recognise(picture, scene) == (f"{first}, and {second}",)


def test_with_rays_through_centres_the_corners_are_the_mistake():
    scene = interpret(SHADE)
    assert recognise(picture_of(scene), scene, sampling="centre") == ("rays through the pixels' corners",)
    assert recognise(picture_of(scene, sampling="centre"), scene, sampling="centre") == ()


def test_a_few_stray_pixels_do_not_hide_a_mistake_and_many_do():
    """Two of the hundred wrong ones on the outline: more than one in a hundred, but tangent rays may be."""
    scene = interpreter(SCENES / "01_one_sphere.cli")
    picture = render_scene(scene, "hit", 96, 96, sampling="centre")
    assert 60 < np.count_nonzero(differences(picture, render_scene(scene, "hit", 96, 96))) < 180
    for strays, found in ((2, ("rays through the pixels' centres",)), (60, ())):
        picture[90, 10 : 10 + strays] = 255
        assert recognise(picture, scene, "hit") == found


def test_what_explains_nearly_as_much_is_not_named():
    scene = interpreter(SCENES / "05_one_triangle.cli")
    assert recognise(np.flipud(render_scene(scene)).copy(), scene) == ("upside down",)


@pytest.mark.parametrize("stage", ["hit", "diffuse"])
def test_what_rounding_decides_is_no_mistake(stage):
    """The textbook's formula misses tangent rays of this scene; c with r in place of r² draws just that, as r is 1."""
    scene = interpreter(SCENES / "04_many_spheres.cli")
    picture = render_scene(scene, stage, 160, 160, method="textbook")
    assert np.count_nonzero(differences(picture, render_scene(scene, stage, 160, 160))) > 6
    assert recognise(picture, scene, stage) == ()


@pytest.mark.parametrize("stage", ["diffuse", "full"])
def test_other_pictures_show_no_mistake(stage, monkeypatch):
    """Noise, another scene, another stage, half of the picture missing."""
    monkeypatch.setattr(mistakes, "_SECONDS", 0.7)
    random = np.random.default_rng(5)
    scene, other = (interpreter(SCENES / f"{name}.cli") for name in ("09_mirror_spheres", "04_many_spheres"))
    right = render_scene(scene, stage, WIDTH, HEIGHT)
    noisy = np.clip(right + random.normal(0, 5, right.shape), 0, 255).astype(np.uint8)
    half = right.copy()
    half[:, :20] = 0
    assert recognise(right, scene, stage) == ()
    for picture in (
        noisy,
        half,
        random.integers(0, 256, right.shape, np.uint8),
        render_scene(other, stage, WIDTH, HEIGHT),
        render_scene(scene, "normal", WIDTH, HEIGHT),
    ):
        assert recognise(picture, scene, stage) == ()


@pytest.mark.parametrize("path", HARD, ids=lambda path: path.stem)
def test_what_rounding_makes_wrong_is_no_mistake(path, monkeypatch):
    monkeypatch.setattr(mistakes, "_SECONDS", 0.2)
    scene = interpreter(path)
    right = render_scene(scene, "diffuse", WIDTH, HEIGHT)
    for method in ("textbook", "textbook32", "haines32"):
        found = recognise(render_scene(scene, "diffuse", WIDTH, HEIGHT, method=method), scene, expected=right)
        assert not found or found[0] in ("nothing is hit", "the lights add nothing"), method


def test_stages_and_scenes_that_the_guides_tracer_does_not_draw_show_no_mistake():
    scene = interpret(SHADE)
    for stage in (*STAGES.keys() - LOOKS.keys(), shaded(lambda d, i, c: d * i * c)):
        assert recognise(picture_of(scene)[::-1], scene, stage, expected=picture_of(scene)) == ()
    many = interpreter(SCENES / "hard" / "ten_thousand_spheres.cli")
    assert recognise(picture_of(many)[::-1], many) == ()


def test_it_can_be_given_up():
    scene = interpret(SHADE)
    assert recognise(picture_of(scene)[::-1], scene, cancelled=lambda: True) == ()


def test_every_row_says_what_to_do_instead():
    assert all(mistake.instead and mistake.steps for mistake in MISTAKES.values())
    assert not any(", and " in name for name in MISTAKES)


def test_a_scene_of_nothing_has_no_mistake():
    empty = interpret("background .5 .5 .5")
    assert recognise(np.zeros((40, 40, 3), np.uint8), empty) == ("background black",)
    assert recognise(np.full((40, 40, 3), 128, np.uint8), replace(empty, lights=(Light((0, 0, 0), (1, 1, 1)),))) == ()
    assert len(COURSE) == 11


NEAR, FAR = "(-b - root) / (2 * a)", "(-b + root) / (2 * a)"
BLACK = (A_QUADRATIC, "the lights add nothing", "normals from the origin")  # the light is behind the far spheres
MISSED = (
    "nothing is hit",
    A_QUADRATIC,
    "looks backwards, + d·w",
    "eye not taken off the ray's direction",
    "fov in degrees given to tan",
)
NO_HITS = ("b without the 2", "b from C − O", "c without − r²", "c with + r²")
IN_THE_TEMPLATE = [  # what is put in the place of what, and the causes that are named for scenes 04 and 07
    ({NEAR: "-b - root", FAR: "-b + root"}, BLACK, ("t not divided by 2a",)),
    ({NEAR: "(-b - root) / a", FAR: "(-b + root) / a"}, BLACK, ("t divided by a in place of 2a",)),
    ({"/ (2 * a)": "/ 2 * a"}, BLACK, ("(−b − √disc) / 2 * a: times a",)),
    (
        {NEAR: "-b - root / (2 * a)", FAR: "-b + root / (2 * a)"},
        BLACK,
        ("−b − √disc / 2a: only the root is divided",),
    ),
    (
        {NEAR: "-b - root / 2 * a", FAR: "-b + root / 2 * a"},
        BLACK,
        ("−b − √disc / 2 * a: only the root is divided, then times a",),
    ),
    ({"b = 2 * dot": "b = dot"}, MISSED, NO_HITS),
    ({"4 * a * c": "a * c"}, ("a·c in place of 4·a·c",), ("a·c in place of 4·a·c",)),
    ({"[o - c for": "[c - o for"}, MISSED, NO_HITS),
    ({" - sphere.radius**2": ""}, ("c without − r²",), NO_HITS),
    ({"- sphere.radius**2": "+ sphere.radius**2"}, MISSED, NO_HITS),
    ({"sphere.radius**2": "sphere.radius * 2"}, ("2r in place of r²",), ("2r in place of r²",)),
    ({"[o - c for": "[-c for"}, ("O not taken off: −C in place of O − C",), ()),  # 07 has its eye at 0 0 0
    ({"c = dot(away, away)": "c = dot(sphere.centre, sphere.centre)"}, ("|C|² in place of |O − C|²",), ()),
    (
        {"[o - c for": "[o for"},
        ("C not taken off: O in place of O − C",),
        ("C not taken off: O in place of O − C",),
    ),
    (
        {"a = dot(ray.direction, ray.direction)": "a = 1"},
        ("a taken as 1, with D not normalised",),
        ("a taken as 1, with D not normalised",),
    ),
    (
        {"root = sqrt(disc)": "root = disc"},
        ("no square root of the discriminant",),
        ("no square root of the discriminant",),
    ),
    (
        {"length = sqrt(dot(a, a))": "length = dot(a, a)"},
        ("L divided by |L|², not by |L|",),
        ("L divided by |L|², not by |L|",),
    ),
]


@pytest.mark.parametrize(
    ("changes", "at_04", "at_07"),
    IN_THE_TEMPLATE,
    ids=[" ".join(row[0].values()) or "no r²" for row in IN_THE_TEMPLATE],
)
def test_mistakes_in_the_printed_template_are_recognised(changes, at_04, at_07, tmp_path):
    source = TEMPLATE.read_text(encoding="utf-8")
    for right, wrong in changes.items():
        assert source.count(right) >= 1
        source = source.replace(right, wrong)
    file = tmp_path / "tracer.py"
    file.write_text(source, encoding="utf-8")
    for name, causes in (("04_many_spheres", at_04), ("07_colorful_lights", at_07)):
        scene = interpreter(SCENES / f"{name}.cli")
        found = recognise(draw_plugged(load_plug(file), Order(scene, "diffuse", 50, 50)), scene)
        assert found == causes
        assert all(advice(cause) for cause in found)


def test_mistakes_in_the_quadratic_are_recognised_in_all_ways_to_make_them():
    """With D normalised or not, N = unit(P − C) or (P − C) / r."""
    scene = interpreter(SCENES / "07_colorful_lights.cli")
    guide, (y, x) = Guide(scene, "diffuse", 60, 60), np.mgrid[0:60, 0:60].reshape(2, -1)
    for name in ("−b − √disc / 2a: only the root is divided", "no square root of the discriminant"):
        for steps in MISTAKES[name].ways(guide.steps):
            assert recognise(guide.paint(steps, x, y).reshape(60, 60, 3), scene)[0] == name


def test_radii_not_squared_are_recognised():
    scene = interpret(SHADE)
    guide, (y, x) = Guide(scene, "diffuse", 90, 80), np.mgrid[0:80, 0:90].reshape(2, -1)
    picture = guide.paint(MISTAKES["r in place of r²"].done(guide.steps), x, y).reshape(80, 90, 3)
    assert recognise(picture, scene) == ("r in place of r²",)
