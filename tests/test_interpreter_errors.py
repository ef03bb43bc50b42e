"""Every fault of a file is told with its place, with what was found and with what was expected."""

import pickle
from importlib import import_module
from io import BytesIO, UnsupportedOperation
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import scenes

from raytracer.interpreter import (
    BLOCK,
    COMMANDS,
    LONGEST_LINE,
    SMALLEST_FOV,
    SceneError,
    interpret,
    interpreter,
    to_cli,
)
from raytracer.scene import Scene

reader = import_module("raytracer.interpreter")  # the package's own `interpreter` is the function
SURFACE = "surface 1 1 1 1 1 1 1 1 1 1 1\n"
BEGIN = SURFACE + "begin\n"
THREE = BEGIN + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
TAKES_NUMBERS = [name for name, command in COMMANDS.items() if command.arguments]


def attempt(text: str | bytes, path: str = "a.cli") -> Scene | SceneError:
    try:
        return interpret(text, path)
    except SceneError as error:
        return error


def error_of(text: str | bytes) -> SceneError:
    error = attempt(text)
    assert isinstance(error, SceneError), "read without an error"
    return error


def before(name: str) -> str:
    """What must stand above a command for its place to be right."""
    return BEGIN if COMMANDS[name].inside else SURFACE


FAULTS = {
    # text: line, column, what was found, what was expected
    "sphre 1 2 3 4": (1, 1, "'sphre'", "did you mean 'sphere'?"),
    "\n\n  Render": (3, 3, "'Render'", "did you mean 'render'?"),
    "fov 9\n\tlihgt": (2, 2, "'lihgt'", "did you mean 'light'?"),
    "xyzzy 1": (1, 1, "'xyzzy'", "a command: one of background, fov, eye"),
    "eye 1 2 x#3": (1, 9, "'x' as z of 'eye'", "a number"),
    "eye 1  two 3": (1, 8, "'two' as y of 'eye'", "a number"),
    "eye 1\u00a02 3 4": (1, 5, r"'1\xa02' as x", "a number"),
    "é 1": (1, 1, "'é'", "a command"),
    "# é\neye 0x1 2 3": (2, 5, "'0x1'", "a number"),
    "eye nan 2 3": (1, 5, "'nan'", "a finite number"),
    "eye 1 -inf 3": (1, 7, "'-inf'", "a finite number"),
    "eye 1 2 1e999": (1, 9, "'1e999'", "a finite number"),
    "eye 1 2 # 3": (1, 8, "2 words after 'eye'", "3: x y z"),
    "fov": (1, 4, "0 words after 'fov'", "1: angle"),
    "fov#1": (1, 4, "0 words after 'fov'", "1: angle"),
    "fov 1 2 3": (1, 7, "3 words after 'fov'", "1: angle"),
    "render it": (1, 8, "1 word after 'render'", "none"),
    "fov 0": (1, 5, "'0' as angle of 'fov'", "above 0 and below 180"),
    "fov -1": (1, 5, "'-1'", "above 0 and below 180"),
    "fov 180": (1, 5, "'180'", "above 0 and below 180"),
    "fov 6.37e-307": (1, 5, "'6.37e-307'", f"at least {SMALLEST_FOV}"),
    "uvw 1 0 0 2 0 0 0 0 1": (1, 1, "dependent vectors", "three vectors"),
    "uvw 1 2 3 4 5 6 7 8 9": (1, 1, "dependent vectors", "three vectors"),
    "uvw 0 0 0 0 1 0 0 0 1": (1, 1, "dependent vectors", "three vectors"),
    "uvw .1 .2 .3 .2 .4 .6 0 0 1": (1, 1, "dependent vectors", "three vectors"),
    "uvw 1e300 0 1e300 0 1e300 0 1e-300 0 1e-300": (1, 1, "dependent vectors", "three vectors"),
    "sphere 1 2 3 4": (1, 1, "'sphere' before any 'surface'", "a 'surface' line"),
    "begin": (1, 1, "'begin' before any 'surface'", "a 'surface' line"),
    SURFACE + "sphere 0 1 2 3": (2, 8, "'0' as radius of 'sphere'", "a number above 0"),
    SURFACE + "  sphere -1e-9 1 2 3\n": (2, 10, "'-1e-9' as radius", "a number above 0"),
    SURFACE + "sphere 1e-400 1 2 3\n": (2, 8, "'1e-400' as radius", "a number above 0"),
    SURFACE + "sphere 1 2 3 4\nrender\nsphere 1 2 3": (4, 13, "3 words after 'sphere'", "4: radius x y z"),
    SURFACE + "\n\t begin\nvertex 1 2 3\n\n": (3, 3, "the end of the file", "'end' for this 'begin'"),
    BEGIN + "begin": (3, 1, "'begin' inside the triangle that begins in line 2", "'vertex' or 'end'"),
    BEGIN + "render": (3, 1, "'render' inside the triangle that begins in line 2", "'vertex' or 'end'"),
    BEGIN + "sphere 1 2 3 4\n": (3, 1, "'sphere' inside the triangle that begins in line 2", "'vertex' or 'end'"),
    BEGIN + "end": (3, 1, "'end' after 0 vertices", "three"),
    BEGIN + "vertex 1 2 3\n end": (4, 2, "'end' after 1 vertex,", "three"),
    THREE + "vertex 0 0 1": (6, 1, "a fourth 'vertex'", "'end'"),
    THREE + "end\nend": (7, 1, "'end' outside a triangle", "'begin'"),
    "vertex 1 2 3": (1, 1, "'vertex' outside a triangle", "'begin'"),
    BEGIN + "vertex 1 1 1\n" * 3 + "end": (6, 1, "three vertices on one line", "an area"),
    BEGIN + "vertex 0 0 0\nvertex 1 1 1\nvertex 3 3 3\nend": (6, 1, "three vertices on one line", "an area"),
    BEGIN + "vertex .1 0 0\nvertex .2 0 0\nvertex .7 0 0\nend": (6, 1, "three vertices on one line", "an area"),
    BEGIN + "vertex 1e308 0 0\nvertex -1e308 0 0\nvertex 1 0 0\nend": (6, 1, "three vertices on one line", "an area"),
    "": (1, 1, "no command at all", "background, fov"),
    "\ufeff": (1, 1, "no command at all", "render"),
    "# fov 9\n\n  \t\r\n": (1, 1, "no command at all", "render"),
    "fov 9\rfov 8": (1, 11, "2 words after 'fov'", "1: angle"),
    "fov 9\neye 1 2\0 3": (2, 8, "the byte 0x00", "text in UTF-8"),
    b"fov 9\n# \xc3\xa9\xff": (2, 4, "the byte 0xff", "text in UTF-8"),
    b"# \0 \xff": (1, 3, "the byte 0x00", "text in UTF-8"),
    b"# \xff \0": (1, 3, "the byte 0xff", "text in UTF-8"),
    "fov 9\n".encode("utf-16"): (1, 1, "the byte 0xff", "text in UTF-8"),
    "fov 9\n".encode("utf-16-le"): (1, 2, "the byte 0x00", "text in UTF-8"),
    "fov 9\n# \ud800": (2, 3, "the byte 0xed", "text in UTF-8"),
    "fov 9\nfov 8" + " " * LONGEST_LINE + "\nfov 7": (2, 1, f"a line of more than {LONGEST_LINE} bytes", "one command"),
    SURFACE + "sphere 1 1 1 " + " " * LONGEST_LINE + "1\n": (2, 1, f"more than {LONGEST_LINE} bytes", "one command"),
}


@pytest.mark.parametrize(("text", "told"), FAULTS.items(), ids=range(len(FAULTS)))
def test_a_fault_is_told(text: str | bytes, told: tuple[int, int, str, str]) -> None:
    error = error_of(text)
    line, column, found, expected = told
    assert (error.line, error.column) == (line, column)
    assert f"found {found}" in error.message or found in error.message
    assert expected in error.message.partition(", expected ")[2]
    assert str(error) == f"a.cli:{line}:{column}: {error.message}"
    assert error.path == Path("a.cli")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_counts_its_words(name: str) -> None:
    words = ["1"] * len(COMMANDS[name].arguments.split())
    many = error_of(f"{before(name)}{' '.join([name, *words, 'x'])}")
    assert many.column == len(" ".join([name, *words])) + 2
    assert f"after '{name}', expected {len(words) or 'none'}" in many.message
    if words:
        few = error_of(f"{before(name)}{' '.join([name, *words[1:]])}\n")
        assert few.column == len(" ".join([name, *words[1:]])) + 1
        assert f"after '{name}', expected {len(words)}: {COMMANDS[name].arguments}" in few.message


@pytest.mark.parametrize("name", TAKES_NUMBERS)
@pytest.mark.parametrize(("word", "expected"), [("x", "a number"), ("nan", "a finite number"), ("-1e400", "a finite")])
def test_every_command_checks_each_number(name: str, word: str, expected: str) -> None:
    arguments = COMMANDS[name].arguments.split()
    for k, argument in enumerate(arguments):
        words = [name] + ["1"] * len(arguments)
        words[k + 1] = word
        error = error_of(before(name) + " ".join(words))
        assert error.column == len(" ".join(words[: k + 1])) + 2
        assert f"found '{word}' as {argument} of '{name}', expected {expected}" in error.message


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_knows_whether_it_belongs_into_a_triangle(name: str) -> None:
    inside = COMMANDS[name].inside
    text = " ".join([name] + ["1"] * len(COMMANDS[name].arguments.split()))
    error = error_of((SURFACE if inside else BEGIN) + text)
    assert error.line == (2 if inside else 3)
    assert ("outside a triangle" if inside else "inside the triangle that begins in line 2") in error.message


@pytest.mark.parametrize("name", COMMANDS)
def test_a_mistyped_command_finds_its_name(name: str) -> None:
    for word in (name.upper(), name[:-1] + "q" + name[-1]):
        assert f"'{word}', expected a command: did you mean '{name}'?" in error_of(word).message


def test_the_first_fault_of_the_file_is_told() -> None:
    assert error_of("fov 9\nfov x\nfov y").line == 2
    assert (
        error_of(SURFACE + "sphere 1 2 3 4\n" * 20_000 + "sphere 1 2 3 x\n" + "sphere 0 2 3 4\n" * 9_000).line == 20_002
    )
    assert error_of(b"fov x\n\0").column == 5


def test_a_fault_behind_the_first_block_is_told() -> None:
    block = "#" * (BLOCK - 1) + "\n#\n"
    assert "'\\ufefffov'" in error_of(block + "\ufefffov 9").message
    assert error_of(BEGIN + "#" * BLOCK + "\nsphere 1 2 3 4\n").line == 4
    assert error_of(block[:-2] + "fov 9" + " " * LONGEST_LINE + "\nfov 9").line == 2


def test_what_follows_render_is_checked() -> None:
    assert error_of("render\nfov 0").line == 2


@given(st.text(min_size=1).map(lambda s: "".join(s.split())) | st.sampled_from(["x" * 60_000, "\x07", "\u2028"]))
def test_an_error_is_one_short_line(word: str) -> None:
    for text in (word, f"fov {word}"):
        error = attempt(text, "new\nline\u2028.cli")
        if isinstance(error, SceneError):
            assert str(error).isprintable()
            assert len(str(error)) < 500
            assert str(error).startswith(r"new\nline\u2028.cli:1:")


def test_an_error_survives_pickling() -> None:
    error = error_of("fov x")
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.path, again.column) == (SceneError, str(error), error.path, 5)


# -------------------------------------------------------------------------------------------- files that cannot be read


def unreadable(path: str | Path) -> SceneError:
    with pytest.raises(SceneError) as caught:
        interpreter(path)
    error = caught.value
    assert (error.line, error.column) == (None, None)
    assert str(error).isprintable()
    assert error.message.startswith("found no readable file, expected a scene (")
    assert str(error).endswith(f": {error.message}")
    return error


def test_a_missing_file(tmp_path: Path) -> None:
    assert "No such file" in unreadable(tmp_path / "none.cli").message
    assert str(unreadable("none\n.cli")).startswith(r"none\n.cli: ")


def test_a_directory(tmp_path: Path) -> None:
    unreadable(tmp_path)


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "x" * 5000])
def test_a_name_that_no_file_has(name: str) -> None:
    unreadable(name)


def test_a_file_that_fails_while_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Failing(BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            raise UnsupportedOperation("broken\ndisk")

        def fileno(self) -> int:
            return 0

    monkeypatch.setattr(reader, "_open", lambda _: Failing())
    monkeypatch.setattr(reader, "_check_fits_memory", lambda *_: None)
    assert r"broken\ndisk" in unreadable(tmp_path).message


def test_an_endless_line_is_not_read_into_memory() -> None:
    class Endless(BytesIO):
        given = 0

        def read(self, size: int | None = -1, /) -> bytes:
            assert size is not None
            assert size >= 0, "all of it was asked for"
            self.given += size
            assert self.given <= 4 * (BLOCK + LONGEST_LINE), "read on and on"
            return b" " * size

        def readline(self, size: int | None = -1, /) -> bytes:
            return self.read(size)

    with pytest.raises(SceneError, match=f"a.cli:1:1: found a line of more than {LONGEST_LINE} bytes"):
        reader._interpret(Endless(), Path("a.cli"))


# ------------------------------------------------------------------------------------------------- whatever comes along

WORDS = [*COMMANDS, "1", "0", "-1", ".5", "1e308", "nan", "1e-400", "x", "#", "\0", "\ufeff", "\r", "\x0b", "é"]
LINE = st.lists(st.sampled_from(WORDS), max_size=6).map(" ".join)
RIGHT = st.sampled_from(
    [
        "sphere 1 2 3 4",
        SURFACE.strip(),
        "begin",
        "vertex 0 0 0",
        "vertex 1 0 0",
        "vertex 0 1 0",
        "end",
        "render",
        "fov 9",
    ]
)


def loads_or_tells(text: str | bytes) -> None:
    scene = attempt(text)
    if isinstance(scene, SceneError):
        error = scene
        assert str(error).isprintable()
        assert error.line is not None
        assert error.column is not None
        lines = text.encode(errors="surrogatepass") if isinstance(text, str) else text
        assert 1 <= error.line <= lines.count(b"\n") + 1
        assert 1 <= error.column <= len(lines.split(b"\n")[error.line - 1]) + 1
    else:
        assert interpret(to_cli(scene)) == scene


@given(st.binary(max_size=200))
def test_any_bytes(data: bytes) -> None:
    loads_or_tells(data)


@given(st.lists(LINE | RIGHT, max_size=12), st.sampled_from(["\n", "\r\n", "\r"]))
def test_any_words_of_the_language(lines: list[str], end: str) -> None:
    loads_or_tells(end.join(lines))


@given(scenes(max_shapes=3), st.data())
def test_any_mutilated_scene(scene: Scene, data: st.DataObject) -> None:
    text = to_cli(scene).encode()
    start = data.draw(st.integers(0, len(text)))
    stop = data.draw(st.integers(start, min(len(text), start + 20)))
    loads_or_tells(text[:start] + data.draw(st.binary(max_size=5)) + text[stop:])
