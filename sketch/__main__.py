"""python -m sketch [FOLDER or FILE]: the window, or, where none can open, a contact sheet of all scenes."""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from raytracer import METHODS, STAGES, save_png
from raytracer.methods import CERTIFIED
from raytracer.plug import stage_said_by
from raytracer.plug_process import PATIENCE, plugged_file, seconds
from sketch import display, java
from sketch.controls import View, keys_as_markdown
from sketch.files import save_beside
from sketch.scenes import NoScenesError, find_scenes
from sketch.session import Session
from sketch.sheet import TILE, contact_sheet, gallery

SCENES = Path(__file__).resolve().parent.parent / "scenes"
SIZE, LARGEST, STAGE = 640, 4096, "diffuse"


def main(arguments: Sequence[str] | None = None) -> int:
    options = _options(arguments)
    if options.versions:
        print(versions())
        return 0
    if options.keys:
        print(keys_as_markdown())
        return 0
    try:
        scenes, place = find_scenes(options.where)
        if options.sheet:
            return draw_sheet(scenes, options.size, options.sheet)
        if options.gallery:
            return draw_sheet(scenes, options.size, options.gallery, options.stage or STAGE)
        if why := why_no_window():
            print(f"no window: {why}", file=sys.stderr)
            if options.plug:
                print(f"{options.plug}: python -m raytracer render draws with it too", file=sys.stderr)
                return 1
            return draw_sheet(scenes, options.size)
    except NoScenesError as error:
        print(error, file=sys.stderr)
        return 1
    said = stage_said_by(options.plug) if options.plug else None
    view = View(scenes, place, options.stage or said or STAGE, options.method, plug=options.plug)
    return open_window(view, options.size or SIZE, options.patience)


def why_no_window() -> str:
    """What is missing for a window, in one line; nothing if all is there. Chooses the Java on the way."""
    if why := display.why_no_display():
        return why
    if not _version("py5"):
        return "py5 is not installed"
    chosen = java.find_java()
    java.use(chosen)
    return "" if chosen.found else chosen.why


def open_window(view: View, size: int, patience: float) -> int:
    """Open the window; its first picture is drawn while Java starts. Returns only if there is none."""
    session = Session(view, size, patience)
    try:
        from sketch.window import run_window
    except (ImportError, RuntimeError) as error:  # py5 says RuntimeError when Java does not start
        session.close()
        print(f"no window: {error}", file=sys.stderr)
        return draw_sheet(view.scenes, None)
    run_window(session)


def draw_sheet(scenes: tuple[Path, ...], tile: int | None, out: Path | None = None, stage: str = "") -> int:
    """Draw all scenes at every stage, or at one, and say where the picture is."""
    sheet, errors = gallery(scenes, stage, tile or TILE) if stage else contact_sheet(scenes, tile or TILE)
    for error in errors:
        print(error, file=sys.stderr)
    try:
        if out is None:
            out = save_beside("contact-sheet", sheet)
        else:
            save_png(out, sheet)
    except OSError as error:
        print(f"{out or 'contact-sheet.png'}: {error.strerror}", file=sys.stderr)
        return 1
    print(f"every scene at {f'stage {stage}' if stage else 'every stage'}: {out}")
    return 0


def versions() -> str:
    """What the sketch runs on."""
    chosen = java.find_java()
    version = chosen.home and java.version_of(chosen.home)
    lines = [f"Python {platform.python_version()}", f"Java {version or ''} {chosen.home or ''} ({chosen.why})"]
    lines += [f"{package} {_version(package) or 'is not installed'}" for package in ("py5", "numpy", "numba")]
    return "\n".join(lines)


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m sketch",
        description="Show the scenes of a folder, at every stage of the tracer; ? in the window shows the keys.",
    )
    parser.add_argument(
        "where", metavar="FOLDER or FILE", nargs="?", type=Path, default=SCENES,
        help="a folder of scenes (.cli), or one of its files to begin with (default: the project's scenes)",
    )  # fmt: skip
    parser.add_argument("--size", metavar="N", type=_size, help=f"draw N × N pixels (default: {SIZE})")
    parser.add_argument(
        "--stage", metavar="STAGE", choices=STAGES,
        help=f"the stage to begin with, or of the gallery (default: {STAGE}, or what a plugged file says)",
    )  # fmt: skip
    parser.add_argument(
        "--method", metavar="METHOD", choices=METHODS, default=CERTIFIED, help="the method to begin with"
    )
    parser.add_argument(
        "--plug", metavar="FILE.py", type=plugged_file,
        help="a file of your own whose functions stand in for the tracer's; python -m raytracer template shows some",
    )  # fmt: skip
    parser.add_argument(
        "--patience", metavar="SECONDS", type=seconds, default=PATIENCE,
        help=f"how long it may show no sign of life before a picture is given up (default: {PATIENCE:g})",
    )  # fmt: skip
    parser.add_argument("--sheet", metavar="OUT.png", type=Path, help="draw every scene at every stage into one PNG")
    parser.add_argument("--gallery", metavar="OUT.png", type=Path, help="draw every scene at that stage into one PNG")
    parser.add_argument("--versions", action="store_true", help="print which Java is used, and why, and all versions")
    parser.add_argument("--keys", action="store_true", help="print what the keys do, as a markdown table")
    return parser.parse_args(arguments)


def _size(text: str) -> int:
    try:
        size = int(text)
    except ValueError:
        size = 0
    if not 1 <= size <= LARGEST:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number of pixels from 1 to {LARGEST}")
    return size


if __name__ == "__main__":
    sys.exit(main())
