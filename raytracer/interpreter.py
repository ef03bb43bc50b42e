"""Reads a `.cli` file into a `Scene`, and writes a `Scene` back as one.

    path → blocks of whole lines → lines → words → one function of COMMANDS each → Scene

A new command is one row of `COMMANDS` and the function that the row names. Whatever is wrong with a file is a
`SceneError` that says where, what was found and what was expected.

Big files consist of `sphere` and `surface` lines. A block of nothing else is read as a whole by `_read_plain`, of a
large file by a kernel; every other block, and every block that has a fault, goes line by line through `_read_lines`,
which knows all the messages.
"""

from __future__ import annotations

import errno
import os
import re
import stat
from array import array
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from heapq import merge
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from raytracer import backend, exact, plain
from raytracer.faults import FileError, escaped
from raytracer.scene import Camera, Colour, Light, Materials, Scene, Spheres, Triangles, Vector

LONGEST_LINE = 1 << 16  # bytes; so a file that is one endless line is refused before it fills the memory
BLOCK = 3 << 14  # bytes read at once: with its last line completed mostly still less than the longest line
_MANY_BLOCKS = 160  # after which a file is so large that loading the compiler pays, to read it and to draw it
MOST_LIGHTS = 1 << 16  # each is some objects, and is looked at from every point of the picture
_BYTES_A_BYTE = 6  # of memory, that reading a byte of a file takes at most: measured, of spheres of one digit a number
SMALLEST_FOV = 6.374367059867598e-307  # degrees; below it 1/tan(fov/2) is more than a float64 can hold


class SceneError(FileError):
    """What is wrong with a scene file. `str(error)` is the one line `path:line:column: message`.

    Lines and columns count from 1, columns in characters. Where the file could not even be read, `line` and `column`
    are None and the text is `path: message`.
    """


def interpreter(path: str | os.PathLike[str]) -> Scene:
    """Reads the scene file at `path`: what it says up to its last `render`, or all of it where there is none.

    Raises `SceneError`, and nothing else, when the file cannot be read or is not a scene.
    """
    path = Path(path)
    try:
        file = _open(path)
    except (OSError, ValueError) as error:  # ValueError: no file can have this name, as with a NUL in it
        raise _unreadable(path, error) from error
    with file:
        _check_fits_memory(os.fstat(file.fileno()).st_size, path)
        return _interpret(file, path)


def interpret(source: str | bytes, path: str | os.PathLike[str] = "<text>") -> Scene:
    """Reads a scene from the text of a `.cli` file; `path` only names it in errors. Raises `SceneError`."""
    if isinstance(source, str):
        source = source.encode(errors="surrogatepass")
    return _interpret(BytesIO(source), Path(path))


def in_order_of_names(path: Path) -> tuple[list[str | int], str]:
    """What to sort scene files by. Numbers within names count by their value: scene 2 comes before scene 10."""
    parts = re.split(r"([0-9]+)", path.name.lower())
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], path.name


# ------------------------------------------------------------------------------------------------ the scene so far


class _Line:
    """A line's number, text and words. A `#` ends the line wherever it stands; only blanks and tabs part words."""

    __slots__ = ("number", "text", "words")

    def __init__(self, number: int, text: str) -> None:
        self.number = number
        self.text = text.partition("#")[0]
        self.words: list[str] = _WORD.findall(self.text)

    def column(self, k: int) -> int:
        """Where word k stands, or, where the line has no such word, the place behind its last word."""
        spans = [match.span() for match in _WORD.finditer(self.text)]
        return 1 + (spans[k][0] if k < len(spans) else spans[-1][1])


_WORD = re.compile(r"[^ \t]+")


class _Shapes:
    """Shapes of one kind: their numbers one after the other, and of each its material and its place in the file."""

    def __init__(self, width: int) -> None:
        self.width = width  # numbers of a shape
        self.numbers, self.material, self.order = array("d"), array("i"), array("i")

    def __len__(self) -> int:
        return len(self.order)

    def tables(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The first `count` shapes, as arrays that share this memory."""
        numbers = np.asarray(self.numbers).reshape(-1, self.width)
        return numbers[:count], np.asarray(self.material)[:count], np.asarray(self.order)[:count]


class _Extent(NamedTuple):
    """How much of a draft `render` draws."""

    camera: Camera
    background: Colour
    lights: int
    materials: int
    spheres: int
    triangles: int


class _Draft:
    """What the lines read so far say. Every load starts a new one, so that no scene leaves a trace in the next."""

    def __init__(self) -> None:
        self.camera = Camera()
        self.background: Colour = (0.0, 0.0, 0.0)
        self.lights: list[Light] = []
        self.surfaces = array("d")  # eleven numbers a material; the current one is the last
        self.spheres = _Shapes(4)
        self.triangles = _Shapes(9)
        self.vertices: list[float] | None = None  # of the triangle that is open
        self.begun = _Line(0, "")  # where it began
        self.line = _Line(0, "")  # the line being read
        self.commands = 0
        self.rendered: _Extent | None = None

    def materials(self) -> int:
        return len(self.surfaces) // 11

    def shapes(self) -> int:
        return len(self.spheres) + len(self.triangles)

    def add(self, kind: _Shapes, numbers: Iterable[float]) -> None:
        """Adds a shape with the current surface."""
        kind.material.append(self.materials() - 1)
        kind.order.append(self.shapes())
        kind.numbers.extend(numbers)

    def extent(self) -> _Extent:
        counts = len(self.lights), self.materials(), len(self.spheres), len(self.triangles)
        return _Extent(self.camera, self.background, *counts)

    def scene(self, path: Path) -> Scene:
        drawn = self.rendered or self.extent()
        materials = Materials(np.asarray(self.surfaces).reshape(-1, 11)[: drawn.materials])
        balls, ball_material, ball_order = self.spheres.tables(drawn.spheres)
        radii, centres = np.ascontiguousarray(balls[:, 0]), np.ascontiguousarray(balls[:, 1:])
        corners, corner_material, corner_order = self.triangles.tables(drawn.triangles)
        return Scene(
            drawn.camera,
            drawn.background,
            tuple(self.lights[: drawn.lights]),
            materials,
            Spheres(radii, centres, ball_material, ball_order, materials),
            Triangles(corners.reshape(-1, 3, 3), corner_material, corner_order, materials),
            path,
        )


class _Fault(Exception):  # noqa: N818 — it never leaves this file
    """What a command has against its line: what it expected, at which word, and what it found if not that word."""

    def __init__(self, expected: str, word: int = 0, found: str = "") -> None:
        self.expected, self.word, self.found = expected, word, found


# --------------------------------------------------------------------------------------------------- the commands


def _background(draft: _Draft, r: float, g: float, b: float) -> None:
    draft.background = (r, g, b)


def _fov(draft: _Draft, angle: float) -> None:
    if not 0 < angle < 180:
        raise _Fault("an angle in degrees, above 0 and below 180", word=1)
    if angle < SMALLEST_FOV:
        raise _Fault(f"at least {SMALLEST_FOV} degrees: below, 1/tan(fov/2) is beyond float64", word=1)
    draft.camera = replace(draft.camera, fov=angle)


def _eye(draft: _Draft, x: float, y: float, z: float) -> None:
    draft.camera = replace(draft.camera, eye=(x, y, z))


def _uvw(draft: _Draft, *numbers: float) -> None:
    u, v, w = _rows(_integers(numbers))
    if sum(a * b for a, b in zip(u, _cross(v, w), strict=True)) == 0:
        raise _Fault("three vectors that point out of one plane", found="dependent vectors u, v, w")
    ux, uy, uz, vx, vy, vz, wx, wy, wz = numbers
    draft.camera = replace(draft.camera, u=(ux, uy, uz), v=(vx, vy, vz), w=(wx, wy, wz))


def _light(draft: _Draft, x: float, y: float, z: float, r: float, g: float, b: float) -> None:
    if len(draft.lights) == MOST_LIGHTS:
        raise _Fault(f"{MOST_LIGHTS} at most", found="one more 'light'")
    draft.lights.append(Light((x, y, z), (r, g, b)))


def _surface(draft: _Draft, *numbers: float) -> None:
    draft.surfaces.extend(numbers)


def _sphere(draft: _Draft, radius: float, x: float, y: float, z: float) -> None:
    _need_surface(draft, "sphere")
    if radius <= 0:
        raise _Fault("a number above 0", word=1)
    draft.add(draft.spheres, (radius, x, y, z))


def _begin(draft: _Draft) -> None:
    _need_surface(draft, "begin")
    draft.vertices, draft.begun = [], draft.line


def _vertex(draft: _Draft, x: float, y: float, z: float) -> None:
    assert draft.vertices is not None  # the table says that a vertex stands inside a triangle
    if len(draft.vertices) == 9:
        raise _Fault("'end' after three", found="a fourth 'vertex'")
    draft.vertices += (x, y, z)


def _end(draft: _Draft) -> None:
    assert draft.vertices is not None
    if len(draft.vertices) < 9:
        raise _Fault("three", found=f"'end' after {_count(len(draft.vertices) // 3, 'vertex', 'vertices')}")
    if not exact.has_area(draft.vertices):
        raise _Fault("a triangle with an area", found="three vertices on one line")
    draft.add(draft.triangles, draft.vertices)
    draft.vertices = None


def _render(draft: _Draft) -> None:
    draft.rendered = draft.extent()


def _need_surface(draft: _Draft, name: str) -> None:
    if not draft.materials():
        raise _Fault("a 'surface' line above it", found=f"'{name}' before any 'surface'")


class Command(NamedTuple):
    """How to read a command: the names of its numbers, what to do with them, whether it belongs inside a triangle."""

    arguments: str
    obey: Callable[..., None]  # called with the draft and the numbers; finite ones, as many as there are names
    inside: bool = False


COMMANDS = {
    "background": Command("r g b", _background),
    "fov": Command("angle", _fov),
    "eye": Command("x y z", _eye),
    "uvw": Command("ux uy uz vx vy vz wx wy wz", _uvw),
    "light": Command("x y z r g b", _light),
    "surface": Command("dr dg db ar ag ab sr sg sb power k_refl", _surface),
    "sphere": Command("radius x y z", _sphere),
    "begin": Command("", _begin),
    "vertex": Command("x y z", _vertex, inside=True),
    "end": Command("", _end, inside=True),
    "render": Command("", _render),
}


# ------------------------------------------------------------------------------------------------ reading a file


def _interpret(file: BinaryIO, path: Path) -> Scene:
    draft, read = _Draft(), _plain_by_python
    number = 1
    for count, block in enumerate(_blocks(file, path)):
        lines = block.count(b"\n")
        if count == _MANY_BLOCKS:
            read = _plain_by_either if backend.load() is not plain else read
        if not _read_plain(draft, block, read):
            _read_lines(draft, block, number, path)
        number += lines
    if draft.vertices is not None:
        begun = draft.begun
        raise SceneError(
            path, begun.number, begun.column(0), "found the end of the file, expected 'end' for this 'begin'"
        )
    if not draft.commands:
        raise SceneError(path, 1, 1, f"found no command at all, expected some of {', '.join(COMMANDS)}")
    return draft.scene(path)


def _blocks(file: BinaryIO, path: Path) -> Iterator[bytes]:
    """The file, byte order mark aside, in blocks of whole lines. Only a line that is too long is cut."""
    mark = b"\xef\xbb\xbf"
    try:
        while block := file.read(BLOCK):
            yield (block + file.readline(LONGEST_LINE + 2)).removeprefix(mark)
            mark = b""
    except OSError as error:
        raise _unreadable(path, error) from error


def _open(path: Path) -> BinaryIO:
    """Open a file, and nothing else that may have its name: a pipe would keep us waiting, a device has no end."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "not a file but a folder, a pipe or a device")
    return os.fdopen(descriptor, "rb")


def _check_fits_memory(size: int, path: Path) -> None:
    """Raises `SceneError` now, with the figures, rather than run out of memory later."""
    needed = size * _BYTES_A_BYTE
    if needed < 1 << 28:
        return
    import psutil  # slow to load, and rarely needed

    available = psutil.virtual_memory().available
    if needed > available:
        found = f"found a file of {size / 1e9:.3g} GB, which takes {needed / 1e9:.3g} GB to read"
        raise SceneError(
            path, None, None, f"{found}, expected a smaller one: {available / 1e9:.3g} GB of memory are free"
        )


def _unreadable(path: Path, error: Exception) -> SceneError:
    reason = getattr(error, "strerror", None) or str(error)
    return SceneError(path, None, None, f"found no readable file, expected a scene ({escaped(reason)})")


def _read_lines(draft: _Draft, block: bytes, number: int, path: Path) -> None:
    """Obeys the lines of a block, whatever they are; the first of them is line `number` of the file."""
    for place, raw in enumerate(block.replace(b"\r\n", b"\n").split(b"\n"), number):
        line = draft.line = _Line(place, _text(raw, place, path))
        try:
            if line.words:
                _obey(draft, line.words)
        except _Fault as fault:
            found = fault.found or _found(line.words, fault.word)
            message = f"found {found}, expected {fault.expected}"
            raise SceneError(path, place, line.column(fault.word), message) from None


def _text(raw: bytes, number: int, path: Path) -> str:
    """The bytes of a line as text. Raises `SceneError` where they are none, or far too long for a line."""
    if len(raw) > LONGEST_LINE:
        message = f"found a line of more than {LONGEST_LINE} bytes, expected one command a line"
        raise SceneError(path, number, 1, message)
    bad = raw.find(b"\0")
    try:
        text = raw.decode()
    except UnicodeDecodeError as error:
        bad = error.start if bad < 0 else min(bad, error.start)
    if bad >= 0:
        column = 1 + len(raw[:bad].decode())
        raise SceneError(path, number, column, f"found the byte {raw[bad]:#04x}, expected text in UTF-8")
    return text


def _obey(draft: _Draft, words: list[str]) -> None:
    name, *given = words
    command = COMMANDS.get(name)
    if command is None:
        raise _Fault(_nearest(name))
    names = command.arguments.split()
    if len(given) != len(names):
        expected = f"{len(names)}: {command.arguments}" if names else "none"
        place = min(len(given), len(names)) + 1  # the first word too many, or the place of the first that is missing
        raise _Fault(expected, place, f"{_count(len(given), 'word', 'words')} after '{name}'")
    if command.inside and draft.vertices is None:
        raise _Fault("'begin' above it", found=f"'{name}' outside a triangle")
    if draft.vertices is not None and not command.inside:
        raise _Fault(
            "'vertex' or 'end'", found=f"'{name}' inside the triangle that begins in line {draft.begun.number}"
        )
    command.obey(draft, *[_number(word, k) for k, word in enumerate(given, 1)])
    draft.commands += 1


def _number(word: str, k: int) -> float:
    try:
        number = float(word)
    except ValueError:
        raise _Fault("a number", k) from None
    if not isfinite(number):
        raise _Fault("a finite number", k)
    return number


# ------------------------------------------------------------------------------- reading a great many lines at once

_PLAIN = b"0123456789+-.eE \n" + b"sphere" + b"surface"


class _Plain(NamedTuple):
    """What a block of nothing but faultless `sphere` and `surface` lines says."""

    spheres: np.ndarray  # (n, 4): radius, centre
    surfaces: np.ndarray  # (m, 11)
    material: np.ndarray  # int (n,), the surface of each sphere; −1 is the last one before the block


def _read_plain(draft: _Draft, block: bytes, read: Callable[[bytes], _Plain | None]) -> bool:
    """Reads a block of nothing but faultless `sphere` and `surface` lines at one go, and says whether it was one.

    What it reads is exactly what `_read_lines` would. Where it is in any doubt, it leaves block and draft alone.
    """
    if draft.vertices is not None or len(block) > LONGEST_LINE or not block.endswith(b"\n"):
        return False
    found = read(block)
    if found is None:
        return False
    material, order = draft.materials() + found.material, draft.shapes() + np.arange(len(found.spheres))
    if np.any(found.spheres[:, 0] <= 0) or np.any(material < 0):
        return False
    draft.surfaces.frombytes(found.surfaces.tobytes())
    draft.spheres.numbers.frombytes(found.spheres.tobytes())
    draft.spheres.material.frombytes(material.astype(np.int32).tobytes())
    draft.spheres.order.frombytes(order.astype(np.int32).tobytes())
    draft.commands += len(found.spheres) + len(found.surfaces)
    return True


def _plain_by_either(block: bytes) -> _Plain | None:
    return _plain_by_kernel(block) or _plain_by_python(block)


def _plain_by_kernel(block: bytes) -> _Plain | None:
    """`_plain_by_python`, ten times as fast, for numbers that are not extreme."""
    text, lines = np.frombuffer(block, np.uint8), block.count(b"\n")
    spheres, surfaces, material = np.empty((lines, 4)), np.empty((lines, 11)), np.empty(lines, np.int32)
    balls, rows = backend.load().read_plain(text, spheres, surfaces, material)
    return _Plain(spheres[:balls], surfaces[:rows], material[:balls]) if balls >= 0 else None


def _plain_by_python(block: bytes) -> _Plain | None:
    lines = _bare_lines(block)
    values = None if lines is None else _plain_values(lines)
    if lines is None or values is None:
        return None
    starts = np.flatnonzero(~np.isfinite(values))
    is_sphere = np.isnan(values[starts])
    lengths = np.diff(starts, append=len(values))
    if len(starts) != lines.count(b"\n") or np.any(lengths != np.where(is_sphere, 5, 12)):
        return None
    spheres = values[starts[is_sphere, None] + np.arange(1, 5)]
    surfaces = values[starts[~is_sphere, None] + np.arange(1, 12)]
    return _Plain(spheres, surfaces, np.cumsum(~is_sphere)[is_sphere] - 1)


def _bare_lines(block: bytes) -> bytes | None:
    """The block without comments, indents and blank lines, each line with its end; None if it is doubtful what it says.

    What a comment says is looked at by whoever knows the messages, unless it is plain text.
    """
    if b"#" in block:
        if not block.isascii() or b"\0" in block or b"\r#" in block:  # which is no end of a line, and would become one
            return None
        block = _COMMENT.sub(b"", block)
    if b"\r" in block or b"\t" in block:
        block = block.replace(b"\r\n", b"\n").replace(b"\t", b" ")
    if block.startswith((b" ", b"\n")) or b"\n " in block or b"\n\n" in block:
        block = _INDENT.sub(b"\n", b"\n" + block)[1:]
    return block


_COMMENT = re.compile(rb"#[^\n]*")
_INDENT = re.compile(rb"\n[ \n]+")


def _plain_values(lines: bytes) -> np.ndarray | None:
    """The words of a block as numbers, with nan for `sphere` and inf for `surface`, which no number of a file may be.

    None if a line starts with anything else, or if there is a letter that these two words, and numbers, do not need.
    So each line gives one nan or inf at its start; any further one comes from a fault in it.
    """
    if lines.translate(None, _PLAIN):
        return None
    ahead = b"\n" + lines
    marked = ahead.replace(b"\nsphere ", b"\nnan ")
    marked_all = marked.replace(b"\nsurface ", b"\ninf ")
    if (len(ahead) - len(marked)) // 3 + (len(marked) - len(marked_all)) // 4 != lines.count(b"\n"):
        return None
    words = marked_all.split()
    try:
        return np.fromiter(map(float, words), np.float64, len(words))
    except ValueError:
        return None


# ---------------------------------------------------------------------------------------------- exact decisions


def _integers(numbers: Iterable[float]) -> list[int]:
    """The numbers times one power of two that makes all of them whole: signs and zeros of products are then exact."""
    ratios = [number.as_integer_ratio() for number in numbers]
    scale = max(below for _, below in ratios)
    return [above * (scale // below) for above, below in ratios]


def _rows(numbers: list[int]) -> tuple[list[int], list[int], list[int]]:
    return numbers[0:3], numbers[3:6], numbers[6:9]


def _cross(a: list[int], b: list[int]) -> list[int]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


# ----------------------------------------------------------------------------------------------- words of errors


def _found(words: list[str], k: int) -> str:
    """Word k of a line, as an error quotes it."""
    if k == 0:
        return _quote(words[0])
    return f"{_quote(words[k])} as {COMMANDS[words[0]].arguments.split()[k - 1]} of '{words[0]}'"


def _nearest(word: str) -> str:
    from difflib import get_close_matches  # only a file with a fault pays for it

    near = get_close_matches(word[:40].lower(), COMMANDS, n=1)
    return f"a command: did you mean '{near[0]}'?" if near else f"a command: one of {', '.join(COMMANDS)}"


def _count(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"


def _quote(word: str) -> str:
    return f"'{escaped(word if len(word) <= 40 else word[:39] + '…')}'"


# -------------------------------------------------------------------------------------------- writing a scene back


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Writes a scene as a `.cli` file that `interpreter` reads as an equal scene. Raises `OSError` if it cannot."""
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(_lines(scene))


def to_cli(scene: Scene) -> str:
    """The scene as the text of a `.cli` file. Reading it gives an equal scene if its materials are used in their order.

    Where a shape goes back to an earlier material, that is written again: every shape still has its own, though the
    table of materials has grown.
    """
    return "".join(_lines(scene))


def _lines(scene: Scene) -> Iterator[str]:
    camera = scene.camera
    yield _line("background", scene.background)
    yield _line("fov", [camera.fov])
    yield _line("eye", camera.eye)
    yield _line("uvw", camera.u + camera.v + camera.w)
    for light in scene.lights:
        yield _line("light", light.position + light.colour)
    surfaces = [_line("surface", row) for row in scene.materials.table.tolist()]
    current, written = -1, 0
    for _, material, text in merge(_sphere_lines(scene.spheres), _triangle_lines(scene.triangles)):
        if material < written and material != current:
            yield surfaces[material]
        yield from surfaces[written : material + 1]
        yield text
        current, written = material, max(written, material + 1)
    yield from surfaces[written:]
    yield "render\n"


def _sphere_lines(spheres: Spheres) -> Iterator[tuple[int, int, str]]:
    """Each sphere's place in the file, material and text."""
    rows = np.column_stack([spheres.radii, spheres.centres])
    for order, material, row in zip(spheres.order, spheres.material, rows, strict=True):
        yield int(order), int(material), _line("sphere", row.tolist())


def _triangle_lines(triangles: Triangles) -> Iterator[tuple[int, int, str]]:
    for order, material, corners in zip(triangles.order, triangles.material, triangles.vertices, strict=True):
        vertices = "".join(_line("vertex", corner) for corner in corners.tolist())
        yield int(order), int(material), f"begin\n{vertices}end\n"


def _line(name: str, numbers: Vector | Iterable[float]) -> str:
    """A command's line. `repr` gives the shortest text that reads as the same float."""
    return " ".join([name, *(repr(float(number)) for number in numbers)]) + "\n"
