"""Pictures larger than memory: bands of rows, drawn by whoever is there, and kept on disk until all of them are.

    Picture ──bands──> Part ──draw_part, by a `Crew`──> deflated rows, a file each ──write_png──> one PNG

A band's bytes are those of the picture drawn at once, at every stage: a stage that looks at the next row draws one row
more, and one that asks for the range of t in the whole picture has that found first, band by band.

The finished bands lie in a folder beside the picture, which is named after all that determines it, until it stands; so
whoever is interrupted goes on from there, and nobody takes up what belongs to another picture.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import secrets
import shutil
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property, lru_cache
from math import isqrt
from pathlib import Path
from tempfile import gettempdir
from typing import TypeVar

from raytracer import backend
from raytracer.camera import BAND_PIXELS
from raytracer.crew import Crew, CrewError, given_up
from raytracer.image import Depth, PictureTooLargeError, check_can_save, check_fits_memory, is_file_to_be, save
from raytracer.methods import CERTIFIED, Method
from raytracer.plan import Plan, make_plan
from raytracer.png import SMALLEST, Band, deflate_rows, write_png
from raytracer.render import Progress, Watch, hits_of, open_tracer
from raytracer.samples import ADAPTIVE, Samples, check_samples, draw_samples
from raytracer.scene import Camera, Scene
from raytracer.stages import Stage

_BAND_PIXELS = 1 << 22  # a second's work or less at most stages
_TILE = 64  # rows: bands begin where the tiles of the screen do
_BANDS = 16  # or more, if they have so many rows: enough for a few workers
_ADAPTIVE_RAYS = 8  # a pixel, about
_MOST_RAYS = 1 << 38  # of a picture: about 130,000 bands at most, and most of a day's work
_RATE = 1e7  # rays a second, or less at most stages, by two cores of 2020 or so
_REACH = struct.Struct("<2d")

Reach = tuple[float, float]
Job = TypeVar("Job")
Begun = Callable[[int, Path], object]  # is told how many bands there are, and of the folder where they are kept


class Cargo:
    """A scene on its way to other processes: packed once, and unpacked once by each, not with every piece."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    @cached_property
    def packed(self) -> bytes:
        return pickle.dumps(replace(self.scene, path=None))

    def __reduce__(self) -> tuple[object, ...]:
        return _unpack, (self.packed,)


@lru_cache(maxsize=2)
def _unpack(packed: bytes) -> Cargo:
    return Cargo(pickle.loads(packed))


@dataclass(frozen=True)
class Picture:
    """All that determines a picture."""

    cargo: Cargo  # the scene
    stage: str | Stage = "diffuse"
    width: int = 320
    height: int = 320
    sampling: str = "corner"
    method: str | Method = CERTIFIED
    samples: Samples = 1
    depth: Depth = Depth.BYTE
    camera: Camera | None = None  # where it is not the scene's own

    def plan(self, rows: slice | None = None, reach: Reach | None = None) -> Plan:
        """How to draw it, or some of its rows; errors as `make_plan`'s and `check_samples`'."""
        scene = self.cargo.scene if self.camera is None else replace(self.cargo.scene, camera=self.camera)
        size = self.stage, self.width, self.height, self.sampling, self.method
        plan = replace(make_plan(scene, *size, depth=self.depth, rows=rows), reach=reach)
        check_samples(self.samples, plan)
        return plan

    def first_row(self) -> Plan:
        """A plan of little, to see whether there is one."""
        return self.plan(slice(0, min(self.height, 1)))

    @property
    def digest(self) -> str:
        """Another one for another picture."""
        rest = [getattr(self, each.name) for each in fields(self) if each.name != "cargo"]
        return hashlib.sha256(repr((rest, version())).encode() + self.cargo.packed).hexdigest()[:16]

    @property
    def pixels(self) -> int:
        return self.width * self.height

    @property
    def rays_a_pixel(self) -> int:
        return _ADAPTIVE_RAYS if self.samples == ADAPTIVE else int(self.samples)

    @property
    def rows_a_band(self) -> int:
        """Of pieces of about equal work, which begin where tiles of the screen do, if they can."""
        rows = min(max(1, _BAND_PIXELS // (self.width * self.rays_a_pixel)), max(_TILE, self.height // _BANDS))
        return min(rows // _TILE * _TILE or rows, self.height)

    @property
    def starts(self) -> range:
        """The first row of each such piece."""
        return range(0, self.height, self.rows_a_band)

    def bands(self) -> Iterator[slice]:
        """Its rows in such pieces."""
        starts = self.starts
        return (slice(start, min(start + starts.step, self.height)) for start in starts)


@cache
def version() -> str:
    """A digest of the tracer's own text: workers of another version may draw other pictures."""
    here = Path(__file__).parent
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(here.rglob("*.py")))).hexdigest()


@dataclass(frozen=True)
class Part:
    """Some rows of a picture, for a worker."""

    picture: Picture
    rows: slice
    reach: Reach | None = None
    version: str = ""

    def check(self) -> None:
        """ValueError if the worker is not of the version that asks."""
        if self.version != version():
            raise ValueError("a worker has another version of raytracer: expected the same files everywhere")


def draw_part(part: Part) -> bytes:
    """The rows, deflated: a `png.Band`, packed."""
    part.check()
    rows, height = part.rows, part.picture.height
    above, below = _apron(part.picture)
    drawn = slice(max(rows.start - above, 0), min(rows.stop + below, height))
    if drawn != slice(0, height):
        backend.load()  # more will follow
    plan = part.picture.plan(drawn, part.reach)
    pixels = draw_samples(plan, part.picture.samples, threads=1, cancelled=given_up)
    return deflate_rows(pixels[rows.start - drawn.start : rows.stop - drawn.start]).pack()


def _apron(picture: Picture) -> tuple[int, int]:
    """How many rows above and below a pixel its colour depends on, beside its own."""
    if picture.samples == ADAPTIVE:
        return 1, 1
    return 0, int(picture.first_row().stage.needs_next_row)


def find_reach(part: Part) -> bytes:
    """The smallest and the largest t of these rows' hits, or +inf and 0: packed."""
    part.check()
    plan = part.picture.plan(part.rows)
    with open_tracer(plan, 1) as tracer:
        hits = hits_of(plan, tracer, Watch(1, cancelled=given_up))
    t = hits.t[hits.index >= 0]
    return _REACH.pack(t.min(initial=float("inf")), t.max(initial=0.0))


def draw_large(
    picture: Picture,
    path: str | os.PathLike[str],
    crew: Crew,
    progress: Progress | None = None,
    begun: Begun | None = None,
) -> None:
    """Draw a picture of any size into a PNG file, whole or not at all.

    Raises what `Picture.plan` does, `OSError`, `PictureTooLargeError`.
    """
    check_can_save(path)
    path = Path(path).resolve()
    stage = picture.first_row().stage
    check_work(picture)
    if stage.needs_whole and not (stage.needs_range or stage.needs_next_row):
        raise ValueError(f"stage {picture.stage!r} looks at the whole picture, which cannot be drawn in bands then")
    check_fits(picture, path, crew.workers())
    bands = len(picture.starts)
    with kept_beside(path, picture.digest) as folder:
        if begun is not None:
            begun(bands, folder)
        count = bands * (2 if stage.needs_range else 1)
        shelf, reach = Shelf(folder, crew, count, progress), None
        if stage.needs_range:
            reaches = shelf.filled(find_reach, lambda: _parts(picture, "reach", None))
            nears, fars = zip(*map(_REACH.unpack, reaches), strict=True)
            reach = min(nears), max(fars)
        done = map(Band.unpack, shelf.filled(draw_part, lambda: _parts(picture, "band", reach)))
        save(path, lambda file: write_png(file, picture.width, picture.height, int(picture.depth.value), done))


def _parts(picture: Picture, kind: str, reach: Reach | None) -> Iterator[tuple[str, Part]]:
    """The picture's bands, each with the name of its file."""
    return ((f"{kind}-{rows.start:010}", Part(picture, rows, reach, version())) for rows in picture.bands())


def check_work(picture: Picture) -> None:
    """Raise `PictureTooLargeError`, with the figures, for what takes longer than anybody waits."""
    rays = picture.pixels * picture.rays_a_pixel
    if rays > _MOST_RAYS:
        raise PictureTooLargeError(
            f"a picture of {picture.width} x {picture.height} pixels takes {rays:.3g} rays, "
            f"{rays / _RATE / 3600:,.0f} hours or more at {_RATE / 1e6:g} million a second; "
            f"expected {_MOST_RAYS:.3g} at most, as of {isqrt(_MOST_RAYS)} x {isqrt(_MOST_RAYS)} pixels"
        )


def check_fits(picture: Picture, path: Path, workers: int) -> None:
    """Raise `PictureTooLargeError`, with the figures, if memory does not hold the bands, or the disk the picture."""
    check_fits_memory(picture.width, picture.rows_a_band * workers, max(picture.width, BAND_PIXELS))
    least, free = int(6 * picture.pixels * SMALLEST / (2 if picture.depth is Depth.BYTE else 1)), disk_left(path)
    if least > free:
        raise PictureTooLargeError(
            f"a picture of {picture.width} x {picture.height} pixels takes {least / 1e9:.3g} GB on disk or more; "
            f"{free / 1e9:.3g} GB are free"
        )


def disk_left(path: Path) -> int:
    return shutil.disk_usage(path.parent if is_file_to_be(path) else gettempdir()).free


@contextmanager
def kept_beside(path: Path, digest: str) -> Iterator[Path]:
    """A folder for what is to become this file; it stays if that fails, unless it is empty."""
    place = path.parent if is_file_to_be(path) else Path(gettempdir())
    folder = place / f"{path.name}-{digest}.parts"
    folder.mkdir(exist_ok=True)
    try:
        yield folder
    except BaseException:
        for draft in folder.glob(".*.part"):
            draft.unlink(missing_ok=True)
        if not any(folder.iterdir()):
            folder.rmdir()
        raise
    shutil.rmtree(folder)


@dataclass
class Shelf:
    """A folder of finished pieces, a file each."""

    folder: Path
    crew: Crew
    count: int  # of all pieces that there will be
    progress: Progress | None = None
    done: int = 0

    def filled(self, work: Callable[[Job], bytes], jobs: Callable[[], Iterable[tuple[str, Job]]]) -> Iterator[bytes]:
        """Have the jobs done that are not there yet, then what became of each, in their order.

        The jobs, with the names of their files, are asked for twice, one by one: there may be very many.
        """
        names: dict[int, str] = {}  # of the jobs under way
        for job, piece in self.crew.work(work, self._missing(jobs(), names)):
            self._put(names.pop(id(job)), piece)
            self._tell()
        return ((self.folder / name).read_bytes() for name, _ in jobs())

    def _missing(self, jobs: Iterable[tuple[str, Job]], names: dict[int, str]) -> Iterator[Job]:
        for name, job in jobs:
            if (self.folder / name).exists():
                self._tell()
            else:
                names[id(job)] = name
                yield job

    def _put(self, name: str, piece: bytes) -> None:
        draft = self.folder / f".{secrets.token_hex(8)}.part"
        try:
            draft.write_bytes(piece)
            draft.replace(self.folder / name)
        except FileNotFoundError as error:
            raise CrewError(f"{self.folder}: gone while it was being filled") from error

    def _tell(self) -> None:
        self.done += 1
        if self.progress is not None:
            self.progress(self.done, self.count, slice(0))
