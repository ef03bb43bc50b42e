"""Inputs that nobody would write, for the interpreter: only `SceneError` comes out, and its readers must agree.

`text_of(random)` makes an input of what a `random.Random` says: hypothesis has one whose choices it can shrink, the
command `python tests/fuzz.py interpreter` a seeded one, and atheris changes its own inputs by it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from random import Random

import pytest

from raytracer.interpreter import COMMANDS, SceneError, interpret
from raytracer.scene import Scene

reader = import_module("raytracer.interpreter")  # the package's own `interpreter` is the function

SURFACE = b"surface .1 .2 .3 0 0 0 1 1 1 20 .5"
EXTREME = [
    b"0", b"-0", b"1", b"-1", b".5", b"5.", b"+.5", b"1e308", b"-1.7976931348623157e308", b"1.8e308", b"5e-324",
    b"2.4703282292062327e-324", b"2.2250738585072011e-308", b"1e-400", b"1e400", b"1E+9999999999", b"1e-9999999999",
    b"9007199254740993", b"9007199254740992.5", b"123456789012345678901234567890",
    b"0.1000000000000000055511151231257827",
    b"1e44", b"1e45", b"1e-44", b"1e-45", b"18446744073709551615", b"18446744073709551616", b"0e999999",
    b"1_000", b"_1", b"1__0", b"1_", b"0x10", b"0b1", b"1e", b"1e+", b"e5", b".", b"-", b"+", b"--1", b"1.2.3", b"1-2",
    b"nan", b"-nan", b"inf", b"-inf", b"infinity", b"NaN", b"1j", b"True", b"None", b"\xd9\xa3", b"\xef\xbc\x91",
    b"1\xc2\xa02", b"\xe2\x88\x921", b"1,5", b"6.374367059867598e-307", b"6.374367059867597e-307", b"180",
    b"179.99999999999997",
]  # fmt: skip
ODD = [b"\0", b"\xff", b"\xef\xbb\xbf", b"\xc3", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x0b", b"\x0c", b"\x1c",
       b"\x85", b"\xc2\x85", b"\xe2\x80\xa8", b"\r", b"\n", b"\r\n", b"#", b" ", b"\t", b"\x1a", b"\x7f", b"\x1b[31m",
       b"sphere", b"surface", b"nan", b"end", b"begin"]  # fmt: skip
ENDS = [
    b"\n",
    b"\n",
    b"\n",
    b"\r\n",
    b"\r",
    b"\n\n",
    b"\n \t",
    b" #\n",
    b"# 1 \xc3\xa9\n",
    b"#\r\n",
    b"\x0b",
    b"\xc2\x85",
]
NAMES = [name.encode() for name in COMMANDS]
ARGUMENTS = {name.encode(): len(command.arguments.split()) for name, command in COMMANDS.items()}
TRIANGLE = b"begin\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nend"
_CORPUS = [path.read_bytes() for path in sorted((Path(__file__).parent.parent / "scenes").rglob("[01]*.cli"))]
_PLACE = re.compile(r"<text>:([1-9]\d*):([1-9]\d*): found .+, expected .+")


# ------------------------------------------------------------------------------------------------------- to make inputs


def text_of(random: Random) -> bytes:
    """An input: lines of the language, right or wrong, plain or not, or one of the scenes, then some damage."""
    return damaged(random, random.choice(_KINDS)(random))


def damaged(random: Random, text: bytes) -> bytes:
    """The text with no damage, or some."""
    while random.random() < 0.35:
        text = random.choice(_DAMAGES)(random, text)
    return text


def _number(random: Random) -> bytes:
    kind = random.randrange(8)
    if kind < 3:
        return b"%d" % random.randrange(10)
    if kind < 5:
        return b"%.*g" % (random.randrange(1, 18), random.gauss(0, 10))
    if kind == 5:
        return random.choice(EXTREME)
    if kind == 6:
        return b"%de%d" % (random.getrandbits(random.randrange(1, 70)), random.randrange(-340, 320))
    digits = b"%d" % random.getrandbits(random.choice((8, 60, 200)))
    place = random.randrange(len(digits) + 1)
    return digits[:place] + b"." + digits[place:]


def _good_number(random: Random) -> bytes:
    return b"%.*g" % (random.randrange(1, 20), random.uniform(0.1, 100) * 10.0 ** random.choice((0, 0, 0, -30, 30)))


def _plain_line(random: Random) -> bytes:
    """A line that the fast readers are for, mostly."""
    number = _number if random.random() < 0.05 else _good_number
    name, count = (b"sphere", 4) if random.random() < 0.8 else (b"surface", 11)
    blank = b"\t" if random.random() < 0.05 else b" "
    return blank.join([name, *(number(random) for _ in range(count))])


def _any_line(random: Random) -> bytes:
    kind = random.random()
    if kind < 0.1:
        return TRIANGLE
    if kind < 0.15:
        return random.choice((b"", b"#", b"# sphere 1 2 3 4", b"  ", b"render", SURFACE))
    name = random.choice(NAMES)
    count = ARGUMENTS[name] if random.random() < 0.9 else random.randrange(14)
    if random.random() < 0.03:
        name = random.choice((name.upper(), name[:-1], name + b"s", b"\xef\xbb\xbf" + name, random.choice(EXTREME)))
    number = _number if random.random() < 0.2 else _good_number
    return random.choice((b" ", b" ", b" ", b"\t", b"  \t")).join([name, *(number(random) for _ in range(count))])


def _lines(line: Callable[[Random], bytes]) -> Callable[[Random], bytes]:
    def lines(random: Random) -> bytes:
        end = random.choice(ENDS) if random.random() < 0.5 else b"\n"
        text = [SURFACE] if random.random() < 0.8 else []
        text += [line(random) for _ in range(random.randrange(1, 7))]
        return end.join(text) + end * random.randrange(2)

    return lines


def _part_of_a_scene(random: Random) -> bytes:
    text = random.choice(_CORPUS)
    start = random.randrange(len(text))
    return SURFACE + b"\n" + text[start : start + random.randrange(300)]


def _bytes(random: Random) -> bytes:
    return random.randbytes(random.randrange(40))


_KINDS = [_lines(_plain_line)] * 6 + [_lines(_any_line)] * 6 + [_part_of_a_scene, _bytes]


def _place(random: Random, text: bytes) -> int:
    return random.randrange(len(text) + 1)


def _insert(random: Random, text: bytes) -> bytes:
    place = _place(random, text)
    return text[:place] + random.choice(random.choice((ODD, EXTREME, NAMES))) + text[place:]


def _overwrite(random: Random, text: bytes) -> bytes:
    place = _place(random, text)
    return text[:place] + random.choice((random.choice(ODD), random.randbytes(1))) + text[place + 1 :]


def _cut(random: Random, text: bytes) -> bytes:
    place = _place(random, text)
    return text[:place] + text[place + random.randrange(12) :]


def _truncate(random: Random, text: bytes) -> bytes:
    return text[: _place(random, text)]


def _repeat(random: Random, text: bytes) -> bytes:
    place = _place(random, text)
    stop = place + random.randrange(60)
    return text[:stop] + text[place:stop] * random.choice((1, 1, 2, 9)) + text[stop:]


def _swap_lines(random: Random, text: bytes) -> bytes:
    lines = text.split(b"\n")
    random.shuffle(lines)
    return b"\n".join(lines)


def _lengthen(random: Random, text: bytes) -> bytes:
    """Much of one thing at some place: a line, a word or a number of great length."""
    place, length = _place(random, text), random.choice((20, 50, reader.LONGEST_LINE - len(text), 300))
    what = random.choice((b"0", b"9", b" ", b"#", b"x", b"\n", b"-", b"\xc3\xa9", b".0"))
    return text[:place] + what * (length // len(what)) + text[place:]


def _encode(random: Random, text: bytes) -> bytes:
    if random.random() < 0.7:
        return b"\xef\xbb\xbf" + text
    coding = random.choice(("utf-16", "utf-16-le", "utf-32", "latin-1", "utf-7"))
    return text.decode(errors="replace").encode(coding, "replace")


def _crlf(random: Random, text: bytes) -> bytes:
    return text.replace(b"\n", random.choice((b"\r\n", b"\r", b"\n\r")))


_DAMAGES = [_insert, _overwrite, _cut] * 3 + [_truncate, _repeat, _swap_lines, _lengthen, _encode, _crlf]


# ------------------------------------------------------------------------------------------------------ to check them


@contextmanager
def small_blocks() -> Iterator[None]:
    """Let the interpreter read a few lines at a time, so that small inputs have block ends, and long lines, too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader, "BLOCK", 160)
        patch.setattr(reader, "LONGEST_LINE", 256)
        yield


def check(text: bytes) -> Scene | SceneError:
    """AssertionError, or whatever comes out of the interpreter that should not, where it fails on this input."""
    by_python, by_kernel = reader._plain_by_python, reader._plain_by_kernel
    willing = False  # whether any block was plain

    def by_lines(block: bytes) -> None:
        nonlocal willing
        plain, compiled = by_python(block), by_kernel(block)
        willing |= plain is not None
        if compiled is not None:
            assert plain is not None, "only the kernel reads this"
            assert [a.tobytes() for a in compiled[:2]] == [a.tobytes() for a in plain[:2]], "the kernel reads otherwise"
            assert (compiled.material == plain.material).all(), "the kernel reads other surfaces"

    found = _read(text, by_lines)
    if willing:
        assert _told(_read(text, by_python)) == _told(found), "plain lines are read otherwise than word by word"
    if isinstance(found, SceneError):
        _check_error(found, text)
    return found


def _read(text: bytes, read: Callable[[bytes], object]) -> Scene | SceneError:
    """By one of the readers of plain blocks, and where that is in doubt line by line."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader, "_plain_by_python", read)
        try:
            return interpret(text)
        except SceneError as error:
            return error


def _told(found: Scene | SceneError) -> object:
    """All that there is to compare, to the sign of every zero."""
    if isinstance(found, SceneError):
        return str(found)
    arrays = *found.materials.arrays(), *found.spheres.arrays(), *found.triangles.arrays()
    return repr((found.camera, found.background, found.lights)), [(a.dtype, a.shape, a.tobytes()) for a in arrays]


def _check_error(error: SceneError, text: bytes) -> None:
    """It is one short line, and its place is in the file, or right behind the end of one of its lines."""
    said = str(error)
    place = _PLACE.fullmatch(said)
    assert place, said
    assert said.isprintable(), said
    assert len(said) < 500, said
    line, column = map(int, place.groups())
    lines = text.removeprefix(b"\xef\xbb\xbf").split(b"\n")
    assert line <= len(lines), said
    assert column <= len(lines[line - 1].decode(errors="replace")) + 1, said
