"""A film of the camera going once round the scene: a GIF, an MP4, or a folder of PNG files.

The frames are drawn by a `Crew`, like the bands of a large picture, and kept on disk until the film stands.
"""

from __future__ import annotations

import hashlib
import io
import secrets
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path

from PIL import Image

from raytracer.crew import Crew, given_up
from raytracer.image import check_can_save, check_fits_memory, drafted, encode_png
from raytracer.orbit import pivot_of, turned
from raytracer.output import check_suffix
from raytracer.render import Progress
from raytracer.samples import draw_samples
from raytracer.tiled import Part, Picture, Shelf, kept_beside, version

FRAMES = 100
_A_SECOND = 25
_FRAMES_FOLDER = ""  # the suffix of a folder

Frames = Iterator[bytes]  # PNG files


def film(picture: Picture, path: Path, frames: int, crew: Crew, progress: Progress | None = None) -> None:
    """Draw so many pictures, the camera going once round, and make what the path's suffix says of them.

    It begins with the file's own view, and goes about its up, to the right, about `orbit.pivot_of`. The film is written
    whole or not at all. Raises what `Picture.plan` does, ValueError for another suffix or what is not installed, and
    OSError.
    """
    check_suffix(path, tuple(WRITERS))
    writer = WRITERS[path.suffix.lower()]
    writer.check(path, picture)
    picture.first_row()
    check_fits_memory(picture.width, picture.height * crew.workers(), picture.width)
    views = list(_views(picture, frames))
    digest = hashlib.sha256(repr([view.digest for view in views[:2]] + [frames]).encode()).hexdigest()[:16]
    path = path.resolve()
    with kept_beside(path, digest) as folder:
        parts = [
            (f"frame-{k:04}.png", Part(view, slice(0, view.height), None, version())) for k, view in enumerate(views, 1)
        ]
        writer.write(path, picture, frames, Shelf(folder, crew, frames, progress).filled(draw_frame, lambda: parts))


def _views(picture: Picture, frames: int) -> Iterator[Picture]:
    scene = picture.cargo.scene
    pivot = pivot_of(scene)
    for k in range(frames):
        yield replace(picture, camera=turned(scene.camera, pivot, 2 * pi * k / frames) if k else scene.camera)


def draw_frame(part: Part) -> bytes:
    """A PNG file."""
    part.check()
    file = io.BytesIO()
    encode_png(file, draw_samples(part.picture.plan(), part.picture.samples, threads=1, cancelled=given_up))
    return file.getvalue()


def _write_gif(path: Path, picture: Picture, frames: int, pngs: Frames) -> None:
    first, *rest = (Image.open(io.BytesIO(png)) for png in pngs)
    with drafted(path) as draft:
        first.save(draft, "GIF", save_all=True, append_images=rest, duration=1000 // _A_SECOND, loop=0)


def _check_mp4(path: Path, picture: Picture) -> None:
    check_can_save(path)
    if picture.width % 2 or picture.height % 2:
        raise ValueError(f"{path}: found {picture.width} x {picture.height} pixels, expected even numbers for an .mp4")
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        raise ValueError(f"{path}: imageio-ffmpeg is not installed; pip install imageio-ffmpeg brings it") from None


def _write_mp4(path: Path, picture: Picture, frames: int, pngs: Frames) -> None:
    import imageio_ffmpeg

    with drafted(path) as draft:
        size = picture.width, picture.height
        writer = imageio_ffmpeg.write_frames(str(draft), size, fps=_A_SECOND, macro_block_size=2, quality=8)
        writer.send(None)
        for png in pngs:
            writer.send(Image.open(io.BytesIO(png)).convert("RGB").tobytes())
        writer.close()


def _check_folder(path: Path, picture: Picture) -> None:
    check_can_save(path / "frame-0001.png" if path.is_dir() else path)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ValueError(f"{path}: is there already, expected an empty folder or none")


def _write_folder(path: Path, picture: Picture, frames: int, pngs: Frames) -> None:
    draft = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        draft.mkdir()
        for k, png in enumerate(pngs, 1):
            (draft / f"frame-{k:04}.png").write_bytes(png)
        draft.replace(path)  # an empty folder may be there
    finally:
        shutil.rmtree(draft, ignore_errors=True)


@dataclass(frozen=True)
class Writer:
    """A row of `WRITERS`."""

    check: Callable[[Path, Picture], None]  # whether it can be done, before anything is drawn
    write: Callable[[Path, Picture, int, Frames], None]


WRITERS = {
    ".gif": Writer(lambda path, picture: check_can_save(path), _write_gif),
    ".mp4": Writer(_check_mp4, _write_mp4),
    _FRAMES_FOLDER: Writer(_check_folder, _write_folder),
}
