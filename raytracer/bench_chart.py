"""What `bench` has measured, written down: tables in Markdown, all figures as CSV, and a chart."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from raytracer import chart
from raytracer.bench import OURS, Check, Report, Row, Section, named, pixels
from raytracer.chart import OTHER, STYLE, foot, head, new_figure, save, short, write_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Of M. Okabe and K. Ito, as in the other charts; ours is black.
_COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
_FLUENT = 1 / 60  # seconds of one of sixty pictures a second
TIMES = {
    **{10.0**power: f"{10 ** (power + 6)} µs" for power in (-5, -4)},
    **{10.0**power: f"{10 ** (power + 3)} ms" for power in (-3, -2, -1)},
    **{10.0**power: f"{10**power} s" for power in (0, 1)},
    60.0: "1 min", 600.0: "10 min", 3.6e3: "1 h", 3.6e4: "10 h", 8.64e5: "10 days", 8.64e6: "100 days",
}  # fmt: skip
_APART = 13  # points between two names


def write(folder: Path, report: Report) -> list[Path]:
    """bench.md, bench.csv, bench.png and bench.svg in the folder; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    text, table = folder / "bench.md", folder / "bench.csv"
    text.write_text(as_markdown(report), encoding="utf-8")
    write_csv(table, report)
    return [text, table, *draw_chart(folder / "bench", report)]


def machine() -> str:
    """The processor, its cores, the system, the versions of what computes, and the day."""
    versions = ", ".join(f"{name} {installed(name) or 'not installed'}" for name in ("numpy", "numba"))
    return f"{chart.machine()}, {versions}, {date.today().isoformat()}"


def installed(name: str) -> str:
    """The version of a package; nothing if it is not installed as one."""
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


# ------------------------------------------------------------------------------------------------ tables


def as_markdown(report: Report) -> str:
    """The machine, who the peers are, a table for each section, and what was checked."""
    lines = [
        f"Measured on {machine()} by `python -m raytracer bench`. Times are medians of rounds in which all competitors "
        "of a table take turns; the first call is not among them, and includes what is loaded, compiled or built then.",
        "",
        *(f"* {sentence}" for sentence in report.peers),
    ]
    for section in report.sections:
        lines += ["", f"## {section.title}", "", *_section_table(section)]
        lines += ["", section.remark] if section.remark else []
    lines += ["", "## Checked", "", *_check_table(report.checks), "", verdict(report)]
    return "\n".join(lines) + "\n"


def verdict(report: Report) -> str:
    """Whether what was drawn is right, in a sentence."""
    if report.faulty:
        return "A picture that must be right is not: see the column of different pixels."
    return "Every picture that must be the same is the same."


def _section_table(section: Section) -> list[str]:
    speed = [f"ns a {section.thing}", f"M{section.thing}/s"]
    head = ["who", "spheres", "picture", "time", "quartiles", *speed, "first call", "rounds"]
    compared = bool(section.against)
    rows = [_cells(row)[: None if compared else -1] for row in section.rows]
    return markdown_table([*head, section.against] if compared else head, rows)


def _cells(row: Row) -> list[str]:
    low, median, high = row.timing.quartiles
    return [
        row.name + (" (extrapolated)" if row.extrapolated else ""),
        f"{row.spheres:,}",
        named(row.size) if row.size else "",
        *time_and_quartiles(median, low, high),
        figure(1e9 * median / row.things),
        figure(row.things / median / 1e6),
        duration(row.timing.first),
        f"{len(row.timing.rounds)}",
        "" if isnan(row.ratio) else figure(row.ratio),
    ]


def time_and_quartiles(median: float, low: float, high: float) -> tuple[str, str]:
    """Seconds in the unit that the median reads best in, and the quartiles in that."""
    unit, _ = unit_of(median)
    return duration(median), f"{figure(low / unit)} … {figure(high / unit)}"


def duration(seconds: float) -> str:
    """In the unit that it reads best in."""
    unit, word = unit_of(seconds)
    return f"{figure(seconds / unit)} {word}"


def unit_of(seconds: float) -> tuple[float, str]:
    """Seconds of the unit, and its name: milliseconds up to ten seconds, then seconds, hours, days."""
    units = ((10.0, 1e-3, "ms"), (3_600.0, 1.0, "s"), (172_800.0, 3_600.0, "h"))
    return next(((unit, word) for most, unit, word in units if seconds < most), (86_400.0, "days"))


def _check_table(checks: Iterable[Check]) -> list[str]:
    head = ["what", "spheres", "picture", "pixels that differ", "must be 0"]
    rows = [
        [check.what, f"{check.spheres:,}", named(check.size), f"{check.different:,}", "yes" if check.needed else "no"]
        for check in checks
    ]
    return markdown_table(head, rows)


def figure(value: float) -> str:
    """Three digits that count, and no exponent."""
    if value >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}" if value >= 1e-3 else f"{value:.2g}"


def markdown_table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Lines of a table whose columns stand under each other in plain text as well; all but the first to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(head, *rows, strict=True)]
    marks = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return [_line(cells, widths) for cells in (head, marks, *rows)]


def _line(cells: list[str], widths: list[int]) -> str:
    first, *others = zip(cells, widths, strict=True)
    padded = [first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]
    return f"| {' | '.join(padded)} |"


def write_csv(path: Path, report: Report) -> None:
    """A row for each figure, times in milliseconds, and for each check."""
    head = (
        "section name spheres width height things median_ms quarter_ms three_quarters_ms first_ms rounds "
        "millions_a_second ratio extrapolated different"
    )
    rows: list[list[object]] = [
        [section.name, *_csv_cells(row), ""] for section in report.sections for row in section.rows
    ]
    rows += (["check", check.what, check.spheres, *check.size, *[""] * 9, check.different] for check in report.checks)
    write_rows(path, head.split(), rows)


def _csv_cells(row: Row) -> list[object]:
    low, median, high = row.timing.quartiles
    times = [f"{1e3 * seconds:.4g}" for seconds in (median, low, high, row.timing.first)]
    ratio = "" if isnan(row.ratio) else f"{row.ratio:.4g}"
    speed = f"{row.things / median / 1e6:.4g}"
    size = row.size or ("", "")
    return [
        row.name, row.spheres, *size, row.things, *times, len(row.timing.rounds), speed, ratio, int(row.extrapolated)
    ]  # fmt: skip


# ------------------------------------------------------------------------------------------------ the chart


def draw_chart(stem: Path, report: Report) -> list[Path]:
    """The time of a picture against spheres and against pixels, a line for each competitor: PNG and SVG."""
    from matplotlib import rc_context

    sections = {section.name: section for section in report.sections}
    by_spheres, by_pixels, names = sections["spheres"], sections["pixels"], competitors(report)
    with rc_context(STYLE):
        chart = new_figure(12, 6.4, legend=False)
        left, right = chart.subplots(1, 2, sharey=True)
        _draw_panel(left, by_spheres, [row.spheres for row in by_spheres.rows], names)
        _draw_panel(right, by_pixels, [pixels(row.size) / 1e6 for row in by_pixels.rows if row.size], names)
        left.set_ylabel("time of a picture")
        left.set_xlabel("spheres")
        right.set_xlabel("megapixels")
        low, high = left.get_ylim()
        left.set_yticks(*zip(*((t, word) for t, word in TIMES.items() if low <= t <= high), strict=True))
        left.minorticks_off()
        head(chart, f"What a picture takes: {_headline(by_spheres)}")
        foot(
            chart,
            f"{machine()}.\nMedians of rounds in turns, shaded from quartile to quartile. Dashed: extrapolated from a "
            "smaller picture. Peers trace rays of any origin; ours uses that eye rays share one.",
        )
        _name_lines(left, names)
        _name_lines(right, names)
        return save(chart, stem)


def competitors(report: Report) -> list[str]:
    """Those that draw pictures, ours first."""
    found = {row.name for section in report.sections if section.name in ("spheres", "pixels") for row in section.rows}
    return sorted(found, key=lambda name: (name != OURS, name))


def _headline(section: Section) -> str:
    """How far we get, in a sentence."""
    last = [row for row in section.rows if row.name == OURS][-1]
    assert last.size is not None
    return f"{last.spheres:,} spheres on {named(last.size)} pixels in {duration(last.timing.median)}"


def _draw_panel(axes: Axes, section: Section, places: Sequence[float], names: list[str]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major")
    axes.set_title(section.title)
    for name in names:
        own = [(x, row) for x, row in zip(places, section.rows, strict=True) if row.name == name]
        if own:
            _draw_line(axes, name, own, _colour(name, names))
    axes.axhline(_FLUENT, color=OTHER, linewidth=1, linestyle=(0, (1, 2)), zorder=1)
    axes.text(
        0, _FLUENT, " 60 a second", transform=axes.get_yaxis_transform(), ha="left", va="top", size=8, color=OTHER
    )
    low, high = min(places), max(places)
    axes.set_xlim(low / 1.3, 1.3 * high * (high / low) ** 0.22)  # room for names
    ticks = sorted(set(places))
    axes.set_xticks(ticks, [short(tick) for tick in ticks])
    axes.minorticks_off()


def _draw_line(axes: Axes, name: str, own: list[tuple[float, Row]], colour: str) -> None:
    at = [x for x, _ in own]
    low, middle, high = zip(*(row.timing.quartiles for _, row in own), strict=True)
    dashed: Any = (0, (4, 3)) if any(row.extrapolated for _, row in own) else "solid"
    axes.fill_between(at, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.plot(
        at, middle, color=colour, linestyle=dashed, marker="o", linewidth=2.4 if name == OURS else 1.6, label=name
    )


def _name_lines(axes: Axes, names: list[str]) -> None:
    """A name behind the end of each line; those that would touch move apart."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    lines = {str(line.get_label()): line for line in axes.lines if line.get_label() in names}
    ends = {name: (np.asarray(line.get_xdata())[-1], np.asarray(line.get_ydata())[-1]) for name, line in lines.items()}
    dots = figure.dpi / 72
    heights = {name: float(axes.transData.transform(end)[1]) / dots for name, end in ends.items()}
    for name, height in apart(heights, _APART).items():
        axes.annotate(
            name,
            ends[name],
            (8, height - heights[name]),
            textcoords="offset points",
            va="center",
            color=_colour(name, names),
            weight="bold" if name == OURS else "normal",
        )


def apart(heights: dict[str, float], gap: float) -> dict[str, float]:
    """Heights in the same order, no two nearer than the gap; those that were too near move up and down alike."""
    groups: list[tuple[float, list[str]]] = []  # the middle of names that stand close together
    for name in sorted(heights, key=lambda name: heights[name]):
        middle, group = heights[name], [name]
        while groups and middle - groups[-1][0] < gap * (len(group) + len(groups[-1][1])) / 2:
            below, others = groups.pop()
            middle = (middle * len(group) + below * len(others)) / (len(group) + len(others))
            group = others + group
        groups.append((middle, group))
    return {name: middle + gap * (k - (len(group) - 1) / 2) for middle, group in groups for k, name in enumerate(group)}


def _colour(name: str, names: list[str]) -> str:
    others = [other for other in names if other != OURS]
    return "#000000" if name == OURS else _COLOURS[others.index(name) % len(_COLOURS)]
