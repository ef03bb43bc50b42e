"""What a scene file says is what the scene holds; how errors are told is tested in test_interpreter_errors.py."""

import random
import time
import tracemalloc
from dataclasses import fields, replace
from decimal import Decimal
from fractions import Fraction
from importlib import import_module
from math import inf, nextafter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import MATERIAL, scenes, table

from raytracer.interpreter import BLOCK, COMMANDS, SMALLEST_FOV, SceneError, interpret, interpreter, to_cli, write_scene
from raytracer.scene import Camera, Light, Material, Scene, Sphere, Triangle

reader = import_module("raytracer.interpreter")  # the package's own `interpreter` is the function
SCENES = Path(__file__).parent.parent / "scenes"
SHAPES = {  # spheres and triangles of the course's scenes
    "01_one_sphere": (1, 0),
    "02_three_spheres": (3, 0),
    "03_shiny_sphere": (2, 0),
    "04_many_spheres": (7, 0),
    "05_one_triangle": (0, 1),
    "06_icosahedron_and_sphere": (1, 20),
    "07_colorful_lights": (1, 2),
    "08_reflective_sphere": (2, 0),
    "09_mirror_spheres": (5, 2),
    "10_reflections_in_reflections": (4, 0),
    "11_star": (1, 62),
}
SURFACE = "surface 1 2 3 4 5 6 7 8 9 10 11\n"
MATERIAL_1_TO_11 = Material((1, 2, 3), (4, 5, 6), (7, 8, 9), 10, 11)


def same_bits(one: Scene, other: Scene) -> bool:
    """Whether two scenes are equal to the sign of every zero, and in the types of their arrays."""

    def bits(scene: Scene) -> list[object]:
        arrays = [
            *scene.materials.arrays(),
            *scene.spheres.arrays(),
            *scene.spheres.materials.arrays(),
            *scene.triangles.arrays(),
            *scene.triangles.materials.arrays(),
        ]
        return [repr((scene.camera, scene.background, scene.lights))] + [
            (a.dtype, a.shape, a.flags.c_contiguous, a.tobytes()) for a in arrays
        ]

    return one == other and bits(one) == bits(other)


def line_by_line(monkeypatch: pytest.MonkeyPatch, text: bytes) -> Scene | str:
    with monkeypatch.context() as patch:
        patch.setattr(reader, "_read_plain", lambda *_: False)
        return outcome(text)


def outcome(text: str | bytes) -> Scene | str:
    try:
        return interpret(text)
    except SceneError as error:
        return str(error)


def assert_equal(one: Scene | str, other: Scene | str) -> None:
    if isinstance(one, Scene) and isinstance(other, Scene):
        assert same_bits(one, other)
    else:
        assert one == other


# ----------------------------------------------------------------------------------------------------- every command


def test_each_command_says_its_part() -> None:
    scene = interpret(
        "background .1 .2 .3\nfov 45\neye 1 2 3\nuvw 0 0 -1 0 2 0 1 0 0\nlight 1 2 3 .4 .5 .6\nlight 0 0 0 1 1 1\n"
        "surface 1 2 3 4 5 6 7 8 9 10 11\nsphere 2 3 4 5\nbegin\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend\n"
        "surface 0 0 0 0 0 0 0 0 0 1 0\nsphere .5 0 -0 1e3\n",
        "some.cli",
    )
    assert scene.background == (0.1, 0.2, 0.3)
    assert scene.camera == Camera((1, 2, 3), (0, 0, -1), (0, 2, 0), (1, 0, 0), 45)
    assert scene.lights == (Light((1, 2, 3), (0.4, 0.5, 0.6)), Light((0, 0, 0), (1, 1, 1)))
    assert list(scene.materials) == [MATERIAL_1_TO_11, Material()]
    assert [scene.shape(i) for i in range(len(scene))] == [
        Sphere(2, (3, 4, 5), MATERIAL_1_TO_11),
        Triangle(((0, 0, 0), (1, 0, 0), (0, 1, 0)), MATERIAL_1_TO_11),
        Sphere(0.5, (0, 0, 1000), Material()),
    ]
    assert scene.spheres.order.tolist() == [0, 2]
    assert scene.path == Path("some.cli")


def test_a_file_that_says_nothing_means_the_defaults() -> None:
    assert same_bits(interpret("render"), Scene())


@pytest.mark.parametrize("name", COMMANDS)
def test_the_written_scene_has_every_command(name: str) -> None:
    scene = interpret(
        f"light 1 2 3 4 5 6\n{SURFACE}begin\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend\nsphere 1 2 3 4"
    )
    assert f"\n{name}" in "\n" + to_cli(scene)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_language_page_knows_every_command(name: str) -> None:
    assert COMMANDS[name].obey.__code__.co_varnames[0] == "draft"
    count = COMMANDS[name].obey.__code__.co_argcount - 1
    variable = bool(COMMANDS[name].obey.__code__.co_flags & 0x04)
    assert variable or count == len(COMMANDS[name].arguments.split())


def test_fov_may_be_anything_between_its_bounds() -> None:
    for fov in (SMALLEST_FOV, 1e-300, 60.0, nextafter(180, 0)):
        assert interpret(f"fov {fov!r}").camera.fov == fov


def test_smallest_fov_is_the_least_whose_distance_is_a_float64() -> None:
    pi = Fraction(Decimal("3.14159265358979323846264338327950288419716939937510582097494"))
    largest = Fraction(2) ** 1024 - Fraction(2) ** 970  # from here on a number rounds to inf
    assert 360 / (pi * Fraction(SMALLEST_FOV)) < largest <= 360 / (pi * Fraction(nextafter(SMALLEST_FOV, 0)))


@pytest.mark.parametrize(
    "frame",
    [
        "1 0 0 0 1 0 0 0 5e-324",
        "1e300 0 0 0 1e300 0 0 0 1e300",
        "1e-300 0 0 0 1e-300 0 0 0 1e-300",
        "1 1 1 1 1.0000000000000002 1 1 1 1.0000000000000002",
    ],
)
def test_barely_independent_frames_are_frames(frame: str) -> None:
    numbers = tuple(map(float, frame.split()))
    camera = interpret(f"uvw {frame}").camera
    assert camera.u + camera.v + camera.w == numbers


@pytest.mark.parametrize(
    "vertices",
    [
        ("0 0 0", "5e-324 0 0", "0 5e-324 0"),
        ("1e308 0 0", "-1e308 0 0", "0 1e308 0"),
        ("0 0 0", "1 1 1", "3 3 3.0000000000000004"),
    ],
)
def test_barely_open_triangles_are_triangles(vertices: tuple[str, str, str]) -> None:
    text = SURFACE + "begin\n" + "".join(f"vertex {v}\n" for v in vertices) + "end"
    assert interpret(text).triangles.vertices.tolist() == [[[float(x) for x in v.split()] for v in vertices]]


# -------------------------------------------------------------------------------------------------- words and lines


@pytest.mark.parametrize("word", [".5", "-1", "1.2E-7", "+3.", "1_000", "5e-324", "-0", "0.1", "٣", "9007199254740993"])
def test_numbers_are_what_float_makes_of_them(word: str) -> None:
    assert repr(interpret(f"eye {word} 0 0").camera.eye[0]) == repr(float(word))


@pytest.mark.parametrize(
    "text",
    [
        "fov 9\neye 1 2 3",
        "fov 9\neye 1 2 3\n",
        "fov 9\r\neye 1 2 3\r\n",
        "\ufefffov 9\neye 1 2 3",
        "\n \n\t\n\tfov \t 9\t\n  eye  1\t2 3  \n\n",
        "# comment\nfov 9#x\neye 1 2 3 # fov 10\n#",
        "fov 9#\r\neye 1 2 3#é\r\n#\r",
    ],
)
def test_layout_does_not_matter(text: str) -> None:
    assert interpret(text) == Scene(Camera(eye=(1, 2, 3), fov=9))


def test_the_longest_line_is_still_read(tmp_path: Path) -> None:
    line = b"fov 9 ".ljust(reader.LONGEST_LINE)
    for text in (line, line + b"\n", line + b"\r\n", b"#" * (BLOCK - 1) + b"\n" + line + b"\r\n"):
        assert interpret(text).camera.fov == 9


@pytest.mark.parametrize("shift", range(8))
def test_blocks_are_cut_at_line_ends(shift: int) -> None:
    text = "#".ljust(BLOCK - shift, "x") + f"\r\n{SURFACE}"
    text += "".join(f"sphere {i} 0 0 0\r\n" for i in range(1, 9000))
    assert interpret(text).spheres.radii.tolist() == list(range(1, 9000))


# ----------------------------------------------------------------------------------------------------------- render


def test_the_last_render_counts() -> None:
    before = f"fov 9\neye 1 1 1\nbackground 1 1 1\nlight 1 2 3 4 5 6\n{SURFACE}sphere 1 2 3 4\n"
    before += "begin\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend\n"
    after = f"fov 8\neye 0 0 0\nbackground 0 0 0\nlight 0 0 0 1 1 1\n{SURFACE}sphere 2 2 3 4\n"
    after += "begin\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 1 0\nend\n"
    drawn = interpret(before)
    assert same_bits(interpret(before + "render\n" + after), drawn)
    assert same_bits(interpret("render\n" + before + "render\n" + after), drawn)
    assert not interpret("render\n" + before).lights
    assert len(interpret(before + after)) == len(interpret(before + "render\n" + after + "render")) == 4


def test_the_surface_holds_on_after_render() -> None:
    scene = interpret(f"{SURFACE}render\nsphere 1 2 3 4\nrender\n{SURFACE}")
    assert list(scene.spheres) == [Sphere(1, (2, 3, 4), MATERIAL_1_TO_11)]
    assert len(scene.materials) == 1


# ------------------------------------------------------------------------------------------------------ there and back


@given(scenes())
def test_a_scene_written_and_read_is_equal(scene: Scene) -> None:
    assert same_bits(interpret(to_cli(scene)), scene)


def test_writing_to_a_file(tmp_path: Path) -> None:
    path = tmp_path / "sub.cli"
    scene = interpret(f"{SURFACE}sphere 1 2 3 4")
    write_scene(scene, path)
    assert path.read_bytes() == to_cli(scene).encode()
    assert interpreter(str(path)) == interpreter(path) == scene
    assert interpreter(path).path == path


@given(st.lists(st.integers(0, 2), max_size=6), st.tuples(MATERIAL, MATERIAL, MATERIAL))
def test_materials_in_any_order_still_reach_their_shapes(rows: list[int], materials: tuple[Material, ...]) -> None:
    scene = interpret(SURFACE + "".join(f"sphere 1 {x} 0 0\n" for x in range(len(rows))))
    found = table(list(materials))
    spheres = replace(scene.spheres, material=np.array(rows, np.int32), materials=found)
    back = interpret(to_cli(replace(scene, materials=found, spheres=spheres)))
    assert list(back.spheres) == list(spheres)
    assert {repr(m) for m in materials} == {repr(m) for m in back.materials}


def test_nothing_leaks_into_the_next_scene() -> None:
    first = interpret((SCENES / "11_star.cli").read_bytes())
    with pytest.raises(SceneError):
        interpret("fov 9\nlight 1 1 1 1 1 1\n" + SURFACE + "sphere 1 1 1 1\nbegin\nvertex 1 1 1")
    with pytest.raises(SceneError, match="before any 'surface'"):
        interpret("sphere 1 1 1 1")
    assert same_bits(interpret("render"), Scene())
    assert same_bits(interpret((SCENES / "11_star.cli").read_bytes()), first)


# ------------------------------------------------------------------------------------------------ a great many lines

ELEVEN = " 1 2 3 4 5 6 7 8 9 10 11"
PLAIN = [
    "sphere 1 2 3 4",
    "sphere  .5\t-1 1e3 0",
    "sphere 1e-320 -0 5e-324 1.7976931348623157e308",
    "surface" + ELEVEN,
]
CLOSE = """
sphere\t1 2 3 4; sphere 1 2 3 4 # five; sphere 1_0 2 3 4; ; fov 9; render
begin; vertex 1 2 3; vertex 2 1 3; vertex 0 0 1; end
sphere 0 1 2 3; sphere -1 1 2 3; sphere -0 1 2 3; sphere 1 nan 2 3; sphere 1 inf 2 3
sphere 1 1e999 2 3; sphere 1 2 3 -1e999; 4; sphere 1 2 3\x1f4; sphere 1 2 3 \xa0
sphere; surface; sphere 1 2 3; sphere 1 2 3 4 5; surface 1 2 3 4; spheresurface 1 2 3 4; 1sphere 1 2 3 4
sphere 1 2 3 4 sphere 1 2 3 4; sphere 1 2 3 surface; sphere 1 2 3 -sphere; surface 1 2 3 4 5 6 sphere 1 2 3 4
surface 1 2 3 4 5 6 7 8 9 10; surface 1 2 3 4 5 6 7 8 9 10 +surface; nan 1 2 3 4; inf 1 2 3 4; 1 2 3 4
sphere 1 2-3 4; sphere 1 2 3 e; sphere 1 2\r3 4; sphere 1 2 3\r4; sphere 1 2\x0b3 4; sphere 1\x0c 2 3; sphere 1 2 3 4\r
sphere 1 2 3 é; sphere 1 2 3 ٣; sphere 1 2 3 4\0;  sphere 1 2 3 4; \t sphere 1 2 3 4 ;   ; # sphere; sphere 1 2 3 4 # é
sphere 1 2 3 4# surface; sphere 1 2 3 #4;   # \0; # \r sphere 1 2 3 4; sphere 1 2 3 4\r# x; #; sphere# 1 2 3 4"""
# what looks plain and is not, or looks odd and is right
LINES = PLAIN * 3 + [line for row in CLOSE.split("\n") for line in row.split("; ")]


OVER_LINES = [
    "sphere 1 2 3\n4",
    "sphere 1 2 3 4\n ",
    "sphere 1 2 3 4\nsphere 5 6 7",
    "sphere 1 2 3 4 1e999" + ELEVEN,
    "sphere 1 2 3 4 1e999\n" + ELEVEN,
    "sphere 1 2 3 4\n1e999" + ELEVEN,
]


@pytest.mark.parametrize("line", [*LINES, *OVER_LINES])
def test_both_ways_of_reading_agree_on(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = "\n".join(PLAIN) + "\n"
    for text in (line + "\n" + plain, SURFACE + line + "\n" + plain, SURFACE + plain + line):
        assert_equal(outcome(text), line_by_line(monkeypatch, text.encode()))


@given(st.lists(st.sampled_from(LINES), max_size=6), st.sampled_from(["\n", "\r\n", "\n\n"]), st.booleans())
def test_both_ways_of_reading_agree(lines: list[str], end: str, has_surface: bool) -> None:
    text = (SURFACE * has_surface + "".join(line + end for line in lines)).encode()
    with pytest.MonkeyPatch.context() as patch:
        slow = line_by_line(patch, text)
        assert_equal(outcome(text), slow)
        patch.setattr(reader, "_MANY_BLOCKS", 0)  # by the kernel, if there is a compiler
        assert_equal(outcome(text), slow)


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=4, max_size=4), st.integers(1, 17))
def test_the_fast_way_reads_what_float_reads(numbers: list[float], digits: int) -> None:
    words = [f"{abs(numbers[0]) or 1.0:.{digits}g}", *(f"{x:.{digits}g}" for x in numbers[1:])]
    radius, *centre = map(float, words)
    if inf in (radius, *map(abs, centre)) or radius == 0:
        return
    text = (SURFACE + f"sphere {' '.join(words)}\n").encode()
    for read in (reader._plain_by_python, reader._plain_by_kernel):
        draft = reader._Draft()
        if reader._read_plain(draft, text, read):
            assert repr(draft.spheres.numbers.tolist()) == repr([radius, *centre])
        else:
            assert read is reader._plain_by_kernel
            assert any(not 1e-20 < abs(x) < 1e20 for x in (radius, *centre))


NUMBER = st.from_regex(r"[+-]?(\d{0,12}\.?\d{0,12})([eE][+-]?\d{1,3})?", fullmatch=True)
HALF_WAY = st.integers(2**53, 2**60).map(lambda n: str(2 * n + 1 if n % 2 else n))


@given(st.lists(NUMBER | HALF_WAY, min_size=4, max_size=4))
def test_the_kernel_reads_what_float_reads_or_nothing(words: list[str]) -> None:
    found = reader._plain_by_kernel((SURFACE + f"sphere {' '.join(words)}\n").encode())
    if found is not None:
        assert repr(found.spheres[0].tolist()) == repr([float(word) for word in words])


@pytest.mark.parametrize(
    "word", ["1.2345678901234567", "-0", "+.5", "5.", "1e-20", "123456789012345678", "9007199254740993"]
)
def test_the_kernel_reads_usual_numbers(word: str) -> None:
    found = reader._plain_by_kernel(f"sphere 1 {word} {word} 0\n".encode())
    sure = word != "9007199254740993"  # half way between two float64
    assert (found is not None) == sure
    assert not sure or repr(found.spheres[0, 1]) == repr(np.float64(word))


def test_plain_lines_take_the_fast_way(monkeypatch: pytest.MonkeyPatch) -> None:
    ends = ("\n", "\r\n", "\n\n  \n", " # as it was\n  ", "#\n\t")
    text = ("".join(line + end for line in PLAIN[::-1] for end in ends) + "\n").encode()
    slow = line_by_line(monkeypatch, text)
    monkeypatch.setattr(reader, "_read_lines", lambda *_: pytest.fail("read line by line"))
    assert isinstance(slow, Scene)
    assert same_bits(interpret(text), slow)
    monkeypatch.setattr(reader, "_MANY_BLOCKS", 0)
    assert same_bits(interpret(text), slow)


@pytest.mark.parametrize("head", ["", SURFACE])
def test_a_sphere_takes_little_memory(head: str, monkeypatch: pytest.MonkeyPatch) -> None:
    count, draw = 20_000, random.Random(1).random
    lines = (f"{head}sphere {draw():.11g} {draw():.11g} {draw():.11g} {draw():.11g}\n" for _ in range(count))
    text = (SURFACE + "".join(lines)).encode()
    interpret(text)
    tracemalloc.start()
    try:
        scene = interpret(text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(scene) == count
    assert peak < 200 * count + 20 * BLOCK  # a block's words are small objects, some ten times its size


def test_the_fast_way_is_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (SURFACE + "sphere .12345678901 1.2345678901 -1.2345678901 12.345678901\n" * 30_000).encode()

    def best() -> float:
        times = []
        for _ in range(3):
            start = time.perf_counter()
            interpret(text)
            times.append(time.perf_counter() - start)
        return min(times)

    fast = best()
    monkeypatch.setattr(reader, "_read_plain", lambda *_: False)
    assert best() > 1.5 * fast  # it is some five times


# ------------------------------------------------------------------------------------------------- the scenes that come


def test_the_course_has_its_eleven_scenes() -> None:
    assert [path.stem for path in sorted(SCENES.glob("*.cli"))] == list(SHAPES)


@pytest.mark.parametrize(("name", "counts"), SHAPES.items())
def test_a_scene_of_the_course_has_its_shapes(name: str, counts: tuple[int, int]) -> None:
    scene = interpreter(SCENES / f"{name}.cli")
    assert (len(scene.spheres), len(scene.triangles)) == counts


@pytest.mark.parametrize("path", sorted(SCENES.rglob("*.cli")), ids=lambda path: path.stem)
def test_a_scene_file_is_in_order(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert text.endswith("\n\nrender\n")
    scene = interpreter(path)
    assert len(scene)
    assert scene.lights
    assert any(scene.background)
    assert same_bits(interpret(to_cli(scene)), scene)
    assert [f.name for f in fields(scene)][-1] == "path"


@pytest.mark.parametrize(
    ("name", "of", "faces"), [("06_icosahedron_and_sphere", slice(None), 20), ("11_star", slice(2, None), 60)]
)
def test_a_solid_is_closed(name: str, of: slice, faces: int) -> None:
    """Each of its edges is an edge of two triangles, which run along it in opposite directions."""
    solid = [triangle.vertices for triangle in interpreter(SCENES / f"{name}.cli").triangles[of]]
    edges = [(t[i], t[i - 2]) for t in solid for i in range(3)]
    assert len(solid) == faces
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)


def test_there_are_ten_hard_scenes_and_ten_thousand_spheres() -> None:
    names = [path.stem for path in sorted((SCENES / "hard").glob("*.cli"))]
    assert [name[:3] for name in names] == [f"{i:02}_" for i in range(1, 11)] + ["ten"]
    assert len(interpreter(SCENES / "hard/ten_thousand_spheres.cli").spheres) == 10_000


def test_the_eye_on_a_sphere_is_exactly_on_it() -> None:
    for sphere in interpreter(SCENES / "hard/04_eye_on_a_sphere.cli").spheres[:2]:
        assert sum(Fraction(x) ** 2 for x in sphere.centre) == Fraction(sphere.radius) ** 2


def test_tangent_rows_are_exactly_tangent() -> None:
    """At 64 × 64 pixels some ray touches each sphere: its disc is 0 in exact arithmetic."""
    scene = interpreter(SCENES / "hard/07_tangent_rows.cli")
    rays = [(Fraction(2 * x - 64, 64), Fraction(64 - 2 * y, 64)) for x in range(64) for y in range(64)]
    for sphere in scene.spheres:
        x, y, z = map(Fraction, sphere.centre)
        c = x * x + y * y + z * z - Fraction(sphere.radius) ** 2
        assert any((u * x + v * y - z) ** 2 == (u * u + v * v + 1) * c for u, v in rays)
