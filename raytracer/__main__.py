"""The command line: `python -m raytracer --help`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from tqdm import tqdm

from raytracer import Plan, Scene, SceneError, interpreter, interrupts, make_plan, probe_pixel, save_png
from raytracer.camera import SAMPLINGS
from raytracer.image import Depth, check_can_save
from raytracer.methods import CERTIFIED, METHODS
from raytracer.plug import Order, PlugError
from raytracer.plug_process import PATIENCE, PlugRunner, echo, plugged_file, seconds
from raytracer.render import Progress
from raytracer.samples import SAMPLES, Samples
from raytracer.stages import STAGES

if TYPE_CHECKING:
    from raytracer.tiled import Picture


def render(arguments: argparse.Namespace) -> int:
    """Draw a scene into a PNG or an OpenEXR file."""
    from raytracer.output import check_plugged, depth_of, write_picture

    check_can_save(arguments.output)
    picture = _picture(arguments, depth_of(arguments.output, arguments.bits))
    if arguments.plug:
        check_plugged(picture, arguments.output, arguments.cluster)
        drawn = _by_plug(arguments, picture.cargo.scene)
        if drawn is not None:
            save_png(arguments.output, drawn)
            return 0
    with _progress("bands") as show:
        tally = write_picture(
            picture,
            arguments.output,
            cluster=arguments.cluster,
            threads=arguments.threads,
            progress=show,
            cancelled=interrupts.came,
            begun=_say_where,
        )
    if tally is not None:
        print(tally, file=sys.stderr)
    return 0


def turntable(arguments: argparse.Namespace) -> int:
    """Film a scene, the camera going once round it: a GIF, an MP4, or a folder of PNG files."""
    from raytracer.crew import open_crew
    from raytracer.turntable import film

    picture = _picture(arguments)
    with open_crew(arguments.cluster, arguments.threads) as crew, _progress("frames") as show:
        film(picture, arguments.output, arguments.frames, crew, show)
    print(crew.tally, file=sys.stderr)
    return 0


def _by_plug(arguments: argparse.Namespace, scene: Scene) -> np.ndarray | None:
    """The picture by a plugged file; None if none of its functions has a part in it."""
    width, height = arguments.size
    order = Order(scene, arguments.stage, width, height, arguments.sampling, arguments.method)
    with closing(PlugRunner(arguments.plug, arguments.patience, echo)) as runner:
        picture, names, _ = runner.draw(order, cancelled=interrupts.came)
    if not names:
        print(f"{arguments.plug}: has no part in stage {arguments.stage}", file=sys.stderr)
    return picture


def test(arguments: argparse.Namespace) -> int:
    """Put a plugged file to the test, check by check; the exit status is 1 if a scene of the course is wrong."""
    from raytracer.exam import HARD, Result, summary
    from raytracer.measure import SCENES

    results, folder = list[Result](), arguments.scenes or SCENES
    course = sorted(folder.glob("*.cli"))
    if not course:
        raise ValueError(f"{folder}: found no scene (.cli), expected a folder of some")
    hard = sorted((folder / HARD).glob("*.cli"))
    with (
        closing(PlugRunner(arguments.plug, arguments.patience, echo)) as runner,
        tqdm(bar_format="{desc}", leave=False, disable=None) as line,
    ):

        def tell(result: Result) -> None:
            results.append(result)
            line.set_description_str(f"{result.check}: {result.subject}")

        names = runner.examine([*course, *hard], arguments.size, tell)
    print(f"{arguments.plug}: {', '.join(names)}", *summary(results), sep="\n")
    return int(any(not (result.right or result.is_hard) for result in results))


def template(arguments: argparse.Namespace) -> int:
    """Print a file to begin with: a stage, a method, a tracer of one's own, to be plugged in."""
    print(resources.files("raytracer").joinpath("templates", f"{arguments.kind}.py").read_text("utf-8"), end="")
    return 0


def check(arguments: argparse.Namespace) -> int:
    """Read scenes and say what is wrong with them, one line an error."""
    status = 0
    for path in arguments.scenes:
        try:
            interpreter(path)
        except SceneError as error:
            print(error)
            status = 1
    return status


def explain(arguments: argparse.Namespace) -> int:
    """Say what drawing a scene takes, what it does not, and why."""
    print(*_plan(arguments).why, sep="\n")
    return 0


def inspect(arguments: argparse.Namespace) -> int:
    """Tell the story of one pixel: its ray, the shapes near it, what is computed and what is true."""
    scene, (width, height) = interpreter(arguments.scene), arguments.size
    place = arguments.x, arguments.y, width, height, arguments.stage, arguments.sampling, arguments.method
    pixel = probe_pixel(scene, *place)
    print(pixel.as_pytest() if arguments.pytest else "\n".join(pixel.story()))
    return 0


def compare(arguments: argparse.Namespace) -> int:
    """Compare a picture with another, or with a scene: exit status 0 if they agree, 1 if not, 2 if unreadable."""
    from raytracer.grade import View, grade

    view = View(arguments.stage, arguments.sampling, arguments.method, arguments.size)
    try:
        verdict = grade(
            arguments.found,
            arguments.expected,
            view,
            tolerance=arguments.tolerance,
            allowed=arguments.allow,
            output=arguments.output,
            cancelled=interrupts.came,
        )
    except (ValueError, OSError, MemoryError) as error:
        print(_one_line(error), file=sys.stderr)
        return 2
    print(verdict.as_json() if arguments.json else "\n".join(verdict.lines()))
    return 0 if verdict.passed else 1


def verify(arguments: argparse.Namespace) -> int:
    """Compare a method with exact arithmetic on rays of every family."""
    from raytracer.families import FAMILIES
    from raytracer.verify import verify as verify_family

    status = 0
    for family in FAMILIES:
        verdict = verify_family(family, arguments.method, arguments.rays, arguments.seed)
        print(f"{family:20}{verdict}", flush=True)
        status |= verdict.wrong > 0
    return status


def chart(arguments: argparse.Namespace) -> int:
    """Measure every method, speed against accuracy, and draw the charts: about two minutes."""
    from raytracer.chart import chart as draw_charts  # loads matplotlib
    from raytracer.chart_contacts import chart_contacts
    from raytracer.chart_samples import chart_samples

    with tqdm(bar_format="{desc}", leave=False, disable=None) as line:
        paths = chart_contacts(arguments.output, progress=line.set_description_str)
        paths += chart_samples(arguments.output, progress=line.set_description_str)
        effort = arguments.output, arguments.long
        paths += draw_charts(*effort, progress=line.set_description_str, cluster=arguments.cluster)
    print(*paths, sep="\n")
    return 0


def bench(arguments: argparse.Namespace) -> int:
    """Measure pictures, rays and files on this machine, beside the peers that are installed: about two minutes."""
    from raytracer import bench as figures
    from raytracer.interpreter import write_scene

    if arguments.write_scene:
        spheres, path = arguments.write_scene
        write_scene(figures.spread(_whole(spheres), arguments.seed), path)
        return 0
    from raytracer import bench_chart  # loads matplotlib

    arguments.output.mkdir(parents=True, exist_ok=True)
    effort = figures.Effort().longer() if arguments.long else figures.Effort()
    with tqdm(bar_format="{desc}", leave=False, disable=None) as line:
        report = figures.measure(effort, arguments.seed, progress=line.set_description_str)
    paths = bench_chart.write(arguments.output, report)
    print(bench_chart.as_markdown(report))
    print(*paths, sep="\n")
    return int(report.faulty)


def report(arguments: argparse.Namespace) -> int:
    """Write one page about a folder of scenes: pictures, charts, figures, wrong pixels: about two minutes."""
    from raytracer.report.page import write_report

    check_can_save(arguments.output)
    with tqdm(bar_format="{desc}", leave=False, disable=None) as line:
        write_report(arguments.folder, arguments.output, arguments.figures, arguments.tile, line.set_description_str)
    return 0


def _whole(text: str) -> int:
    """ValueError if it is no number of spheres."""
    if not text.isdecimal():
        raise ValueError(f"--write-scene: found {text!r}, expected a number of spheres")
    return int(text)


def _picture(arguments: argparse.Namespace, depth: Depth = Depth.BYTE) -> Picture:
    """The picture that is asked for; says what the user should know of it."""
    from raytracer.tiled import Cargo, Picture

    size = *arguments.size, arguments.sampling, arguments.method, arguments.samples, depth
    picture = Picture(Cargo(interpreter(arguments.scene)), arguments.stage, *size)
    for warning in picture.first_row().warnings:
        print(f"{arguments.scene}: {warning}", file=sys.stderr)
    return picture


def _say_where(bands: int, folder: Path) -> None:
    print(f"drawn in {bands} bands, which are kept in {folder} until all are there", file=sys.stderr)


@contextmanager
def _progress(unit: str) -> Iterator[Progress]:
    """A bar on a terminal, after a second."""
    with tqdm(unit=f" {unit}", delay=1, leave=False, disable=None) as bar:

        def show(done: int, total: int, rows: slice) -> None:
            bar.total = total
            bar.update(1)

        yield show


def _plan(arguments: argparse.Namespace) -> Plan:
    width, height = arguments.size
    return make_plan(interpreter(arguments.scene), arguments.stage, width, height, arguments.sampling, arguments.method)


def size(text: str) -> tuple[int, int]:
    """WxH, or one number for a square."""
    width, times, height = text.lower().partition("x")
    try:
        found = int(width), int(height if times else width)
    except ValueError:
        found = 0, 0
    if min(found) < 1:
        message = f"found {text!r}, expected WIDTHxHEIGHT, such as 640x480, of whole numbers from 1"
        raise argparse.ArgumentTypeError(message)
    return found


def picture_file(text: str) -> Path:
    """What `render` can write."""
    from raytracer.output import SUFFIXES

    return _file(text, SUFFIXES)


def film_file(text: str) -> Path:
    """What `turntable` can write."""
    from raytracer.turntable import WRITERS

    return _file(text, tuple(WRITERS))


def _file(text: str, suffixes: tuple[str, ...]) -> Path:
    from raytracer.output import check_suffix

    path = Path(text)
    try:
        check_suffix(path, suffixes)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return path


def count(text: str, least: int = 1) -> int:
    if not (text.isdecimal() and int(text) >= least):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number, {least} or more")
    return int(text)


def whole(text: str) -> int:
    return count(text, least=0)


def samples(text: str) -> Samples:
    """A number of samples, or a word."""
    return int(text) if text.isdigit() else text


class Argument(NamedTuple):
    """One argument of a command: its names, and what argparse is told about it."""

    names: tuple[str, ...]
    options: dict[str, object]


TEMPLATES = ("tracer", "picture", "stage", "method")
_SCENE = Argument(("scene",), {"metavar": "SCENE", "type": Path, "help": "a .cli file"})
_METHOD = Argument(
    ("--method",),
    {"metavar": "METHOD", "choices": METHODS, "default": CERTIFIED, "help": "how rays meet spheres, default certified"},
)
_STAGE = Argument(
    ("--stage",),
    {"metavar": "STAGE", "choices": STAGES, "default": "diffuse", "help": "what is drawn; the default is diffuse"},
)
_SAMPLING = Argument(
    ("--sampling",),
    {"choices": SAMPLINGS, "default": "corner", "help": "where in a pixel its ray goes through, default corner"},
)
_PICTURE = (
    _STAGE,
    Argument(("--size",), {"metavar": "WxH", "type": size, "default": (320, 320), "help": "pixels, default 320x320"}),
    _SAMPLING,
    _METHOD,
)
_PATIENCE = Argument(
    ("--patience",),
    {
        "metavar": "SECONDS",
        "type": seconds,
        "default": PATIENCE,
        "help": f"how long a plugged file may show no sign of life, default {PATIENCE:g}",
    },
)
_FOLDER = Argument(
    ("-o", "--output"),
    {"metavar": "FOLDER", "type": Path, "default": Path("docs"), "help": "where to, default docs"},
)
_SEED = Argument(("--seed",), {"metavar": "S", "type": int, "default": 1, "help": "of what is random, default 1"})
_SAMPLES = Argument(
    ("--samples",),
    {
        "metavar": "N",
        "type": samples,
        "choices": SAMPLES,
        "default": 1,
        "help": "rays a pixel: 1, 4, 16, 64, 256, or adaptive, where neighbours differ; default 1",
    },
)
_CLUSTER = Argument(
    ("--cluster",), {"metavar": "ADDRESS", "help": "have it done by a dask scheduler's workers; local:N starts N here"}
)
_CREW = (
    Argument(("--threads",), {"metavar": "N", "type": count, "help": "default: as many as there are cores"}),
    _CLUSTER,
)
COMMANDS: dict[str, tuple[Callable[[argparse.Namespace], int], tuple[Argument, ...]]] = {
    "render": (
        render,
        (
            _SCENE,
            Argument(
                ("-o", "--output"),
                {
                    "metavar": "OUT.png",
                    "type": picture_file,
                    "required": True,
                    "help": "the file to write, or an OUT.exr",
                },
            ),
            *_PICTURE,
            _SAMPLES,
            Argument(
                ("--bits",),
                {"type": int, "choices": (8, 16), "default": 8, "help": "of a colour's number in a PNG, default 8"},
            ),
            *_CREW,
            Argument(
                ("--plug",),
                {
                    "metavar": "FILE.py",
                    "type": plugged_file,
                    "help": "a file whose functions stand in for the tracer's",
                },
            ),
            _PATIENCE,
        ),
    ),
    "turntable": (
        turntable,
        (
            _SCENE,
            Argument(
                ("-o", "--output"),
                {
                    "metavar": "OUT.gif",
                    "type": film_file,
                    "required": True,
                    "help": "or an OUT.mp4, or a folder for PNGs",
                },
            ),
            Argument(
                ("--frames",), {"metavar": "N", "type": count, "default": 100, "help": "25 a second, default 100"}
            ),
            *_PICTURE,
            _SAMPLES,
            *_CREW,
        ),
    ),
    "test": (
        test,
        (
            Argument(("plug",), {"metavar": "FILE.py", "type": plugged_file, "help": "the file to test"}),
            Argument(("--size",), {"metavar": "N", "type": count, "default": 48, "help": "pixels a side, default 48"}),
            Argument(
                ("--scenes",),
                {"metavar": "FOLDER", "type": Path, "help": "default: the project's own"},
            ),
            _PATIENCE,
        ),
    ),
    "template": (
        template,
        (Argument(("kind",), {"choices": TEMPLATES, "help": "what the file is to define"}),),
    ),
    "check": (check, (Argument(("scenes",), {"metavar": "SCENE", "type": Path, "nargs": "+", "help": ".cli files"}),)),
    "explain": (explain, (_SCENE, *_PICTURE)),
    "inspect": (
        inspect,
        (
            _SCENE,
            Argument(("x",), {"metavar": "X", "type": int, "help": "the pixel's column, from the left, from 0"}),
            Argument(("y",), {"metavar": "Y", "type": int, "help": "its row, from the top, from 0"}),
            *_PICTURE,
            Argument(("--pytest",), {"action": "store_true", "help": "print the pixel as a test case instead"}),
        ),
    ),
    "compare": (
        compare,
        (
            Argument(
                ("found",), {"metavar": "A", "help": "a picture, or a scene: scene.cli, scene.cli:stage[:method]"}
            ),
            Argument(("expected",), {"metavar": "B", "help": "what it should be: a picture, or a scene"}),
            Argument(
                ("-o", "--output"),
                {"metavar": "OUT.png", "type": Path, "help": "a file for the picture of the differences"},
            ),
            Argument(
                ("--tolerance",),
                {"metavar": "N", "type": whole, "default": 1, "help": "by which a byte may be off, default 1"},
            ),
            Argument(
                ("--allow",), {"metavar": "N", "type": whole, "default": 0, "help": "wrong pixels to pass, default 0"}
            ),
            Argument(("--json",), {"action": "store_true", "help": "print the figures for a program"}),
            _STAGE,
            Argument(
                ("--size",),
                {"metavar": "WxH", "type": size, "help": "of scenes, default that of the picture, or 320x320"},
            ),
            _SAMPLING,
            _METHOD,
        ),
    ),
    "chart": (
        chart,
        (
            _FOLDER,
            Argument(("--long",), {"action": "store_true", "help": "ten times the rays, and about ten times as long"}),
            _CLUSTER,
        ),
    ),
    "bench": (
        bench,
        (
            _FOLDER,
            Argument(
                ("--long",), {"action": "store_true", "help": "more rounds, and more spheres for peers and checks"}
            ),
            _SEED,
            Argument(
                ("--write-scene",),
                {"metavar": ("N", "OUT.cli"), "nargs": 2, "help": "only write the scene of N spheres, for other tools"},
            ),
        ),
    ),
    "report": (
        report,
        (
            Argument(
                ("folder",),
                {
                    "metavar": "FOLDER",
                    "type": Path,
                    "nargs": "?",
                    "default": Path("scenes"),
                    "help": "of scenes, with those in folders within; default scenes",
                },
            ),
            Argument(
                ("-o", "--output"),
                {
                    "metavar": "OUT.html",
                    "type": Path,
                    "default": Path("report.html"),
                    "help": "the file to write, default report.html",
                },
            ),
            Argument(
                ("--figures",),
                {
                    "metavar": "FOLDER",
                    "type": Path,
                    "help": "read the tables of chart and bench there, measure nothing",
                },
            ),
            Argument(
                ("--tile",),
                {"metavar": "N", "type": count, "default": 160, "help": "pixels along a picture's side, default 160"},
            ),
        ),
    ),
    "verify": (
        verify,
        (
            _METHOD,
            Argument(
                ("--rays",), {"metavar": "N", "type": count, "default": 10_000, "help": "a family, default 10000"}
            ),
            _SEED,
        ),
    ),
}


def _parser() -> argparse.ArgumentParser:
    stages = "\n".join(f"  {name:10}{stage.about}" for name, stage in STAGES.items())
    methods = "\n".join(f"  {name:15}{method.about}" for name, method in METHODS.items())
    parser = argparse.ArgumentParser(
        prog="python -m raytracer",
        description="Draw ray-tracing scenes (.cli files) without a window.",
        epilog=f"stages:\n{stages}\n\nmethods:\n{methods}\n\nexample:\n"
        "  python -m raytracer render scenes/04_many_spheres.cli -o spheres.png --stage normal --size 640x480",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (function, arguments) in COMMANDS.items():
        command = commands.add_parser(name, help=function.__doc__, description=function.__doc__)
        command.set_defaults(function=function)
        for names, options in arguments:
            command.add_argument(*names, **options)  # type: ignore[arg-type]
    return parser


def main(words: list[str] | None = None) -> int:
    """Run one command.

    The exit status is 0, 1 for bad input, 2 for wrong arguments, 130 when interrupted, 141 where nobody reads.
    `compare` has its own: 1 if pictures differ, 2 for bad input.
    """
    status = 0
    try:
        with interrupts.noted():
            status = _run(words)
    except BaseException:
        if not interrupts.came():
            raise
    return interrupts.status() or status


def _run(words: list[str] | None) -> int:
    try:
        arguments = _parser().parse_args(words)
        status = int(arguments.function(arguments))
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:  # `… | head -1` has read enough
        return 141
    except (ValueError, OSError, MemoryError, ModuleNotFoundError) as error:
        if not interrupts.came():
            print(error.report() if isinstance(error, PlugError) else _one_line(error), file=sys.stderr)
        return 1
    finally:
        _give_up_what_cannot_be_printed()


def _give_up_what_cannot_be_printed() -> None:
    """Else Python would try once more at its very end, and say so in its own words."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__


if __name__ == "__main__":
    _status = main()
    if interrupts.came():
        interrupts.leave(_status)
    sys.exit(_status)
