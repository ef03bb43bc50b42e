"""The page: all that there is to show, put into the template, and written as one file that needs no other."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime
from math import isnan, log10
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

from raytracer import backend, chart
from raytracer.bench_chart import duration, figure, installed, time_and_quartiles
from raytracer.image import save
from raytracer.measure import COMPILED, STRESS
from raytracer.methods import METHODS
from raytracer.report import plots
from raytracer.report.figures import Figures, Score, Timing, measure_figures, read_figures
from raytracer.report.gallery import TILE, Entry, Tile, draw_gallery
from raytracer.stages import ERROR_LEGEND, STAGES

if TYPE_CHECKING:
    from jinja2 import Environment

_VERSIONS = ("raytracer-sketch", "numpy", "numba", "pillow", "jinja2")
_BYTES_A_GIB = 1 << 30

Progress = Callable[[str], object]


class Table(NamedTuple):
    """A table of text: its title, its columns, its rows; the first cell of a row is its head."""

    title: str
    columns: list[str]
    rows: list[list[str]]
    remark: str = ""


class Cell(NamedTuple):
    """A field of the table of families: what it says, and how dark it is, 0 to 1."""

    text: str
    heat: float
    sentence: str


def write_report(
    folder: Path,
    output: Path,
    figures: Path | None = None,
    tile: int = TILE,
    progress: Progress = lambda text: None,
) -> None:
    """Write the page about the scenes of a folder; `figures` is a folder of tables to read in place of measuring.

    Raises ValueError where there is no scene or no table, ModuleNotFoundError without jinja2, and OSError.
    """
    environment()  # if there is none, better now than after minutes
    start = perf_counter()
    found = read_figures(figures) if figures else None
    entries = draw_gallery(folder, tile, progress)
    drawn = perf_counter()
    if found is None:
        found = measure_figures(progress)
    progress("writing")
    text = page(folder.resolve().name, entries, found, tile, (drawn - start, perf_counter() - drawn))
    save(output, lambda file: file.write(text.encode()))


def page(name: str, entries: list[Entry], figures: Figures, tile: int, seconds: tuple[float, float]) -> str:
    """The text of the page; seconds are those of drawing and of measuring."""
    html: str = environment().get_template("page.html.j2").render(
        name=name,
        entries=entries,
        stages=STAGES,
        methods=METHODS,
        tile=tile,
        pictures=sum(len(entry.tiles) for entry in entries),
        seconds=[duration_in_words(some) for some in (sum(seconds), *seconds)],
        when=datetime.now().astimezone(),
        wrong=wrong_entries(entries),
        legend=[(_css(colour), text) for colour, text in ERROR_LEGEND],
        figures=figures,
        charts=charts(figures),
        families=family_table(figures.scores),
        tables=bench_tables(figures.timings),
        machine=machine(),
        plots=plots,
    )  # fmt: skip
    return html


def wrong_entries(entries: Iterable[Entry]) -> list[tuple[Entry, dict[str, Tile]]]:
    """The scenes in which a method is wrong, with these methods' pictures; those with most wrong pixels first."""
    some = [(entry, entry.wrong_by_method()) for entry in entries]
    return sorted((one for one in some if one[1]), key=lambda one: -sum(tile.wrong for tile in one[1].values()))


def environment() -> Environment:
    """jinja2, with the templates beside this file. ModuleNotFoundError that says how to get it."""
    try:
        from jinja2 import Environment, PackageLoader, StrictUndefined
    except ModuleNotFoundError:
        raise ModuleNotFoundError("a report takes jinja2: python -m pip install jinja2") from None
    return Environment(
        loader=PackageLoader("raytracer.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip


class Chart(NamedTuple):
    """A drawing with a heading, or several of which one is chosen."""

    name: str
    title: str
    about: str
    panels: list[plots.Panel]
    chooser: str = ""  # what is chosen


class Key(NamedTuple):
    """What a colour means."""

    name: str
    colour: str
    hollow: bool


class Group(NamedTuple):
    """Charts beside each other, and what their colours mean."""

    title: str
    about: str
    charts: list[Chart]
    legend: list[Key]


def charts(figures: Figures) -> list[Group]:
    """All that there are figures for."""
    rays, pictures = plots.ray_panels(figures.scores), plots.picture_panels(figures.scores)
    chosen = [
        Chart("rays", "Rays", "What one ray and one sphere take, on one thread.", rays, "Rays"),
        Chart("scenes", "Pictures", "Whole pictures at stage diffuse, on all cores.", pictures, "Scene"),
    ]
    groups = [
        Group(
            "Speed against wrong decisions",
            "Wrong is: a hit for a miss, another shape, or the other root, against exact arithmetic. Circles are "
            "compiled code, squares numpy; hollow marks are float32. Nothing is left of the grey line and below it.",
            chosen,
            _keys(chosen),
        ),
        _group(
            "The error of t",
            "A right decision can still have a wrong t. From the median to the worst error, with 99.9 % at the "
            "diamond, over the rays whose decisions are right.",
            plots.error_panels(figures.scores),
        ),
        _group(
            "Rays that start on a shape",
            "How far to move a ray's start off its surface: no length is right at every scale. Dashed: float32.",
            plots.contact_panels(figures.contacts),
        ),
        _group(
            "Samples a pixel",
            "What more samples cost, and what they are worth, against 256 a pixel, at stage full.",
            plots.sample_panels(figures.samples),
        ),
        _group(
            "What a picture takes",
            "Stage diffuse; medians of rounds in turns. Dashed: extrapolated from a smaller picture.",
            plots.bench_panels(figures.timings),
        ),
    ]
    return [group for group in groups if any(chart.panels for chart in group.charts)]


def _group(title: str, about: str, panels: list[plots.Panel]) -> Group:
    some = [Chart(panel.name, panel.title, "", [panel]) for panel in panels]
    return Group(title, about, some, _keys(some))


def _keys(some: Iterable[Chart]) -> list[Key]:
    marks = [mark for one in some for panel in one.panels for mark in panel.marks]
    return list(dict.fromkeys(Key(mark.key, mark.colour, mark.hollow) for mark in marks))


def family_table(scores: Iterable[Score]) -> tuple[list[str], dict[str, list[Cell]]]:
    """Which method fails where: the families, and for each method a cell a family, of compiled code if there is any."""
    own = [score for score in scores if score.kind == "family" and score.place != STRESS]
    own = [score for score in own if score.backend == COMPILED] or own
    rows: dict[str, list[Cell]] = {}
    for score in own:
        rate = 1e6 * score.wrong / score.cases
        sentence = f"{score.method}, {score.place}: {score.wrong:,} of {score.cases:,} wrong"
        text = chart.short(rate) if rate else "0"
        rows.setdefault(score.method, []).append(Cell(text, min(log10(rate + 1) / 6, 1.0), sentence))
    return list(dict.fromkeys(score.place for score in own)), rows


# ------------------------------------------------------------------------------------------------ tables of figures

_SECTIONS = {  # a section's title, what is counted, what the ratio says
    "spheres": ("By spheres", "ray", "time ÷ raytracer's"),
    "pixels": ("By pixels", "ray", "time ÷ raytracer's"),
    "threads": ("By threads", "ray", "times as fast as the first"),
    "stages": ("By stage", "ray", "time ÷ diffuse's"),
    "methods": ("By method", "ray", "time ÷ haines's"),
    "certainty": ("What certainty costs", "ray", "time ÷ unchecked's"),
    "hits": ("Hits without a picture", "ray", ""),
    "rays": ("Any rays", "ray", ""),
    "parsing": ("Files read", "sphere", "time ÷ raytracer's"),
}


def bench_tables(timings: Iterable[Timing]) -> list[Table]:
    """A table for each section, and one of what was checked."""
    by_section: dict[str, list[Timing]] = {}
    for timing in timings:
        by_section.setdefault(timing.section, []).append(timing)
    checks = by_section.pop("check", [])
    tables = [_section_table(section, rows) for section, rows in by_section.items()]
    if checks:
        rows = [[c.name, f"{c.spheres:,}", _size(c), f"{c.different:,.0f}"] for c in checks]
        tables.append(Table("Checked", ["what", "spheres", "picture", "pixels that differ"], rows))
    return tables


def _section_table(section: str, rows: list[Timing]) -> Table:
    title, thing, against = _SECTIONS.get(section, (section, "thing", "ratio"))
    columns = ["who", "spheres", "picture", "time", "quartiles", f"M{thing}/s", "first call", against]
    cells = [_timing_cells(row) for row in rows]
    kept = [k for k in range(len(columns)) if columns[k] and any(row[k] for row in cells)]
    return Table(title, [columns[k] for k in kept], [[row[k] for k in kept] for row in cells])


def _timing_cells(row: Timing) -> list[str]:
    return [
        row.name + (" (extrapolated)" if row.extrapolated == "1" else ""),
        f"{row.spheres:,}",
        _size(row),
        *time_and_quartiles(row.median_ms / 1e3, row.quarter_ms / 1e3, row.three_quarters_ms / 1e3),
        figure(row.millions_a_second),
        duration(row.first_ms / 1e3),
        "" if isnan(row.ratio) else figure(row.ratio),
    ]


def _size(row: Timing) -> str:
    return "" if isnan(row.width) else f"{row.width:.0f}×{row.height:.0f}"


# ------------------------------------------------------------------------------------------------ the machine


def machine() -> list[tuple[str, str]]:
    """Where this was made, as names and values; no path, no user, no name of the machine."""
    import psutil

    fault = backend.why_no_compiler()
    memory = f"{psutil.virtual_memory().total / _BYTES_A_GIB:.0f} GiB"
    return [
        ("Machine", chart.machine()),
        ("Memory", memory),
        ("Compiler", f"none: {fault}" if fault else "numba"),
        *((name, found) for name in _VERSIONS if (found := installed(name))),
    ]


def duration_in_words(seconds: float) -> str:
    """Such as 1 min 40 s; whole seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _css(colour: tuple[float, float, float]) -> str:
    return f"rgb({', '.join(f'{round(255 * band)}' for band in colour)})"
