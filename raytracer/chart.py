"""Speed against accuracy, drawn: `chart` measures every method (see `measure`), and writes pictures and a table.

A point lies at what a decision costs, and at how many are wrong. "None of N is wrong" is no 0: with 95 % confidence
less than 3 / N are (the rule of three), so such points lie on a shelf below all others, beside a line at that bound.
"""

from __future__ import annotations

import csv
import os
import platform
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import floor, hypot, log10
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from raytracer.families import FAMILIES
from raytracer.measure import (
    COMPILED,
    NUMPY,
    ORDINARY_SCENE,
    STRESS,
    Effort,
    Frame,
    Racer,
    Score,
    Summary,
    score_families,
    score_scenes,
)
from raytracer.methods import CERTIFIED, METHODS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

# The colours of M. Okabe and K. Ito, which no common colour blindness confuses, and two greys.
_COLOURS = {
    CERTIFIED: "#000000",
    "textbook": "#e69f00",
    "half_b": "#56b4e9",
    "geometric": "#009e73",
    "stable": "#b59f00",
    "kahan": "#0072b2",
    "haines": "#d55e00",
    "compensated": "#cc79a7",
    "double_double": "#7f5a3c",
}
OTHER = "#777777"
_MARKERS = {COMPILED: "o", NUMPY: "s"}
STYLE: dict[Any, Any] = {
    "svg.hashsalt": "raytracer",
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.labelcolor": "#333333",
    "axes.edgecolor": "#888888",
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "xtick.color": "#555555",
    "ytick.color": "#555555",
}
_DOTS = 100  # an inch of a PNG
_DEEP = 50  # the shelf reaches down to this part of where the marks are: room for names
_FRONT = "pareto"
_BACKED: Any = {
    "facecolor": "white",
    "alpha": 0.7,
    "edgecolor": "none",
    "pad": 0.6,
}  # so that a line does not cross letters
_WRONG = "wrong decisions per million"


def chart(
    folder: Path,
    long: bool = False,
    progress: Callable[[str], object] = lambda text: None,
    effort: Effort | None = None,
    cluster: str | None = None,
) -> list[Path]:
    """Measure every method on every backend; write the pictures and the table into the folder; return their paths."""
    effort = effort or Effort()
    effort = effort.tenfold() if long else effort
    folder.mkdir(parents=True, exist_ok=True)
    scores, frames = score_families(effort, progress, cluster), score_scenes(effort, progress)
    progress("drawing")
    return [write_table(folder / "chart.csv", scores, frames), *draw_charts(folder, scores, frames)]


def draw_charts(folder: Path, scores: list[Score], frames: list[Frame]) -> list[Path]:
    """The pictures of what was measured, as PNG and SVG."""
    from matplotlib import rc_context

    with rc_context(STYLE):
        figures = {
            "chart": _draw_speed(scores),
            "chart-families": _draw_families(scores),
            "chart-t": _draw_errors(scores),
            "chart-pictures": _draw_pictures(frames),
        }
        return [path for name, figure in figures.items() for path in save(figure, folder / name)]


def save(figure: Figure, stem: Path) -> list[Path]:
    paths = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
    figure.savefig(paths[0], dpi=_DOTS)
    figure.savefig(paths[1], metadata={"Date": None})
    return paths


# What is drawn


class Point(NamedTuple):
    """A method on a backend: what it costs, and what it gets wrong."""

    racer: Racer
    cost: tuple[float, float, float]  # a mark, and the two ends of the line through it
    wrong: int
    of: int

    @property
    def rate(self) -> float:
        return 1e6 * self.wrong / self.of


def pareto(points: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Those that no other point beats in one coordinate without losing in the other, from left to right."""
    front: list[tuple[float, float]] = []
    for x, y in sorted(set(points)):
        if not front or y < front[-1][1]:
            front.append((x, y))
    return front


def shelf_height(rates: Iterable[float], bound: float) -> float:
    """Where "none" lies on a logarithmic axis: half a decade or more below the bound and all rates above 0."""
    lowest = min([bound, *(rate for rate in rates if rate > 0)])
    return 10.0 ** (floor(log10(lowest) - 0.5))


def rule_of_three(cases: int) -> float:
    """The wrong ones of a million that there may be, with 95 % confidence, if of so many cases none is wrong."""
    return 3e6 / cases


def _points_of_family(scores: list[Score], family: str) -> list[Point]:
    """Costs: the median of the rounds, and their quartiles."""
    return [Point(s.racer, _quartiles(s.times, 1e9), s.wrong, s.rays) for s in scores if s.family == family]


def _points_of_stress(scores: list[Score]) -> list[Point]:
    """Costs: the mean over the families, and the fastest and the slowest of these."""
    points = []
    for total in scores:
        if total.family == STRESS:
            costs = [
                _quartiles(s.times, 1e9)[0]
                for s in scores
                if s.racer == total.racer and s.family in FAMILIES and not FAMILIES[s.family].ordinary
            ]
            points.append(Point(total.racer, (float(np.mean(costs)), min(costs), max(costs)), total.wrong, total.rays))
    return points


def _points_of_frames(frames: Iterable[Frame], of_bytes: bool) -> list[Point]:
    """One point for a racer's pictures together; costs: the mean picture's, its quartiles the means of quartiles."""
    by_racer: dict[Racer, list[Frame]] = {}
    for frame in frames:
        by_racer.setdefault(frame.racer, []).append(frame)
    points = []
    for racer, own in by_racer.items():
        middle, low, high = np.mean([_quartiles(frame.times, 1e3) for frame in own], axis=0)
        wrong = sum(frame.wrong_bytes if of_bytes else frame.wrong for frame in own)
        cases = sum(frame.pixels * (3 if of_bytes else 1) for frame in own)
        points.append(Point(racer, (float(middle), float(low), float(high)), wrong, cases))
    return points


def _quartiles(times: Sequence[float], unit: float) -> tuple[float, float, float]:
    low, middle, high = np.quantile(times, [0.25, 0.5, 0.75]) * unit
    return float(middle), float(low), float(high)


# Speed against wrong decisions


def _draw_speed(scores: list[Score]) -> Figure:
    figure = new_figure(13, 8.6)
    ordinary = [name for name, family in FAMILIES.items() if family.ordinary and any(s.family == name for s in scores)]
    panels = [(f"{name.capitalize()} rays", _points_of_family(scores, name)) for name in ordinary]
    stress = _points_of_stress(scores)
    if stress:
        panels.append((f"Rays made to break formulas, {_count_families(scores)} families", stress))
    drawn = []
    all_axes = figure.subplots(1, len(panels), squeeze=False)[0]
    for axes, (title, points) in zip(all_axes, panels, strict=True):
        heights = _draw_against(axes, points, "nanoseconds for one ray and one sphere", _WRONG, True)
        axes.set_title(f"{title}:\n{_verdict(points)}")
        drawn.append((axes, points, heights))
    head(figure, "What a certain decision costs, and what the usual ones get wrong")
    _legend(figure)
    foot(
        figure,
        f"{machine()}. One thread; one call with thousands of rays, all it does included; time to compile left out. "
        "Ordinary: median of the rounds, line from quartile to quartile.\nMade to break: mean over the families, line "
        "from the fastest to the slowest. Wrong: hit or miss, which sphere, or which root, against exact integers.",
    )
    for axes, points, heights in drawn:
        _label(axes, points, heights)
    return figure


def _verdict(points: list[Point]) -> str:
    """What is seen, in a sentence."""
    compiled = [point for point in points if point.racer.backend == COMPILED] or points
    right = [point for point in compiled if point.wrong == 0]
    cases = compiled[0].of
    if len(right) == 1:
        return f"only {right[0].racer.method} is right {cases:,} times of {cases:,}"
    return f"{len(right)} of {len(compiled)} methods are right {cases:,} times of {cases:,}"


def _count_families(scores: list[Score]) -> int:
    return len({s.family for s in scores if s.family in FAMILIES and not FAMILIES[s.family].ordinary})


def _draw_against(axes: Axes, points: list[Point], cost: str, wrong: str, sampled: bool) -> list[float]:
    """Cost to the right, wrong upwards, a shelf for none; returns how high the points lie.

    sampled: what is not seen may still be.
    """
    bound = rule_of_three(points[0].of) if sampled else 1e6 / points[0].of
    shelf = shelf_height((point.rate for point in points), bound)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major")
    axes.set_ylim(shelf / _DEEP, 4e6)
    _draw_shelf(axes, shelf, bound, points[0].of, sampled)
    _draw_front(axes, points, shelf)
    heights = [point.rate if point.wrong else shelf for point in points]
    for point, height in zip(points, heights, strict=True):
        _draw_point(axes, point, height)
    left = min(point.cost[1] for point in points)
    right = max(point.cost[2] for point in points)
    axes.set_xlim(left / 2.2, right * 1.7)
    axes.set_xlabel(cost)
    axes.set_ylabel(wrong)
    _plain_ticks(axes)
    axes.set_yticks([shelf, *axes_ticks(bound)], ["none", *(short(tick) for tick in axes_ticks(bound))])
    axes.minorticks_off()
    return heights


def axes_ticks(bound: float) -> list[float]:
    """Powers of ten from the bound up to all of a million."""
    return [10.0**power for power in range(floor(log10(bound)) + 1, 7)]


def _draw_shelf(axes: Axes, shelf: float, bound: float, cases: int, sampled: bool) -> None:
    axes.axhspan(shelf / _DEEP, shelf * 1.9, color="#eef3ee", zorder=0)
    text = f"none wrong in {cases:,}"
    if sampled:
        axes.axhline(bound, color="#7a9a7a", linewidth=1, linestyle=(0, (4, 3)), zorder=1)
        note = f"if none is wrong: fewer than {bound:.2g}, with 95 % confidence"
        place = axes.get_yaxis_transform()
        axes.text(0.99, bound * 1.2, note, transform=place, ha="right", color="#5c7a5c", size=8, bbox=_BACKED)
    axes.text(
        0.99, 1.3 * shelf / _DEEP, text, transform=axes.get_yaxis_transform(), ha="right", color="#5c7a5c", size=9
    )


def _draw_front(axes: Axes, points: list[Point], shelf: float) -> None:
    """The Pareto line: to its left and below it, there is no method."""
    front = pareto((point.cost[0], point.rate) for point in points)
    corners = [(front[0][0], 1e9)]
    for x, y in front:
        corners += [(x, corners[-1][1]), (x, y or shelf)]
    corners.append((1e12, corners[-1][1]))
    axes.plot(*zip(*corners, strict=True), color="#9a9a9a", linewidth=1.2, zorder=1, gid=_FRONT)


def _draw_point(axes: Axes, point: Point, height: float) -> None:
    colour, compiled = _colour(point.racer.method), point.racer.backend == COMPILED
    axes.plot(point.cost[1:], [height] * 2, color=colour, linewidth=1.4, alpha=0.45, solid_capstyle="round", zorder=2)
    axes.plot(
        point.cost[0],
        height,
        _MARKERS[point.racer.backend],
        markersize=(8 if compiled else 6.5) + 2.5 * (point.racer.method == CERTIFIED),
        markeredgecolor=colour,
        markerfacecolor="white" if _is_single(point.racer.method) else colour,
        markeredgewidth=1.6,
        alpha=1.0 if compiled else 0.65,
        zorder=4 if compiled else 3,
    )


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    def mark(marker: str, face: str) -> Line2D:
        return Line2D([], [], marker=marker, linestyle="", color="#555555", markerfacecolor=face, markersize=7)

    handles = [mark("o", "#555555"), mark("s", "#555555"), mark("o", "white"), Line2D([], [], color="#9a9a9a")]
    names = ["compiled, float64", "numpy", "hollow: float32", "Pareto line: nothing is left of it and below"]
    _place_legend(figure, handles, names)


def _place_legend(figure: Figure, handles: list[Line2D], names: list[str]) -> None:
    corner = (0.006, 1 - 0.42 / figure.get_figheight())
    figure.legend(handles, names, loc="upper left", bbox_to_anchor=corner, ncols=4, fontsize=9, frameon=False)


# Labels


def _boxes_of_lines(axes: Axes) -> list[Box]:
    """The steps of the Pareto line."""
    boxes: list[Box] = []
    for line in axes.lines:
        if line.get_gid() == _FRONT:
            corners = axes.transData.transform(line.get_xydata())
            for (x, y), (to_x, to_y) in pairwise(corners):
                boxes.append((min(x, to_x) - 1, min(y, to_y) - 1, max(x, to_x) + 1, max(y, to_y) + 1))
    return boxes


class Mark(NamedTuple):
    """A point's place in the drawing, in dots, and that of the line through it."""

    racer: Racer
    x: float
    y: float
    left: float
    right: float


def _label(axes: Axes, points: list[Point], heights: list[float]) -> None:
    """Name the marks: neighbours in one column, each column at the first place nearby where it covers nothing."""
    figure = axes.figure.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    dot = figure.dpi / 72
    marks = []
    for point, height in zip(points, heights, strict=True):
        (x, y), (left, _), (right, _) = axes.transData.transform([(cost, height) for cost in point.cost])
        marks.append(Mark(point.racer, float(x), float(y), float(left), float(right)))
    taken: list[Box] = [(m.x - 7, m.y - 7, m.x + 7, m.y + 7) for m in marks]
    taken += [(m.left, m.y - 1, m.right, m.y + 1) for m in marks]
    taken += [text.get_window_extent().extents for text in axes.texts]
    taken += _boxes_of_lines(axes)
    frame: Box = axes.get_window_extent().extents
    named = [m for m in marks if m.racer.backend == marks[0].racer.backend]
    for group in sorted(neighbours(named, 14 * dot), key=len):
        size = max(len(m.racer.method) for m in group) * 5.7 * dot, len(group) * 11.5 * dot
        middle = sum(m.x for m in group) / len(group), sum(m.y for m in group) / len(group)
        box = free_box(middle, size, taken, frame, dot)
        taken.append((box[0] - 5 * dot, box[1] - 7 * dot, box[2] + 5 * dot, box[3] + 7 * dot))
        _write_column(axes, group, box)


def neighbours(marks: list[Mark], reach: float) -> list[list[Mark]]:
    """Marks in groups, from left to right, each within reach of the one before it, and a third less above or below."""
    groups: list[list[Mark]] = []
    for mark in sorted(marks, key=lambda m: m.x):
        near = (g for g in groups if hypot(g[-1].x - mark.x, 1.5 * (g[-1].y - mark.y)) < reach)
        group = next(near, None)
        if group is None:
            groups.append([mark])
        else:
            group.append(mark)
    return groups


def _write_column(axes: Axes, group: list[Mark], box: Box) -> None:
    """The names of a group, the leftmost mark's first, and a line from them to the middle of the group."""
    to_data = axes.transData.inverted().transform
    x, y = sum(m.x for m in group) / len(group), sum(m.y for m in group) / len(group)
    end = nearest_of(box, (x, y))
    if hypot(end[0] - x, end[1] - y) > 12:
        axes.plot(*to_data([end, (x, y)]).T, color="#888888", linewidth=0.7, zorder=2)
    height = (box[3] - box[1]) / len(group)
    align = "right" if box[2] < x else "left" if box[0] > x else "center"
    side = {"right": box[2], "left": box[0], "center": (box[0] + box[2]) / 2}[align]
    for k, mark in enumerate(group):
        method = mark.racer.method
        left, up = to_data((side, box[3] - (k + 0.5) * height))
        axes.text(
            left,
            up,
            method,
            ha=align,
            va="center",
            size=9,
            color=_colour(method),
            weight="bold" if method == CERTIFIED else "normal",
            bbox=_BACKED,
            zorder=6,
        )


Box = tuple[float, float, float, float]  # left, bottom, right, top


def free_box(
    mark: tuple[float, float], size: tuple[float, float], taken: Sequence[Box], inside: Box, unit: float = 1.0
) -> Box:
    """A box of that size near the mark that covers none of those taken and leaves not the frame, if there is one."""
    width, height = size
    offsets = [(right * unit, up * unit) for up in range(-170, 171, 7) for right in range(-170, 171, 10)]
    best: tuple[float, Box] | None = None
    for right, up in offsets:
        x, y = mark[0] + right, mark[1] + up
        box = (x - width / 2, y - height / 2, x + width / 2, y + height / 2)
        gap = hypot(max(abs(right) - width / 2, 0), 1.3 * max(abs(up) - height / 2, 0))
        covers = sum(_overlap(box, other) for other in taken) + 10 * _outside(box, inside)
        cost = 1e3 * covers + gap
        if best is None or cost < best[0]:
            cost += 15 * _crossed(mark, nearest_of(box, mark), taken)
            best = (cost, box) if best is None or cost < best[0] else best
    assert best is not None
    return best[1]


def nearest_of(box: Box, point: tuple[float, float]) -> tuple[float, float]:
    """The point of a box that is nearest to a point."""
    return min(max(point[0], box[0]), box[2]), min(max(point[1], box[1]), box[3])


def _crossed(start: tuple[float, float], end: tuple[float, float], taken: Sequence[Box]) -> int:
    """How many of the boxes taken, but those at the start, a line passes."""
    steps = [(start[0] + k / 12 * (end[0] - start[0]), start[1] + k / 12 * (end[1] - start[1])) for k in range(13)]
    return sum(not _holds(box, start) and any(_holds(box, step) for step in steps) for box in taken)


def _holds(box: Box, point: tuple[float, float]) -> bool:
    return box[0] <= point[0] <= box[2] and box[1] <= point[1] <= box[3]


def _overlap(box: Box, other: Box) -> float:
    """How far two boxes reach into each other."""
    return max(min(min(box[2], other[2]) - max(box[0], other[0]), min(box[3], other[3]) - max(box[1], other[1])), 0.0)


def _outside(box: Box, frame: Box) -> float:
    return max(frame[0] - box[0], frame[1] - box[1], box[2] - frame[2], box[3] - frame[3], 0.0)


# Which method fails where


def _draw_families(scores: list[Score]) -> Figure:
    methods = list(dict.fromkeys(s.racer.method for s in scores))
    families = [name for name in FAMILIES if any(s.family == name for s in scores)]
    backend = scores[0].racer.backend
    found = {(s.racer.method, s.family): s for s in scores if s.racer.backend == backend}
    figure = new_figure(15, 11.2, legend=False)
    above, below = figure.subplots(2, 1)
    wrong = [[1e6 * found[m, f].wrong / found[m, f].rays for f in families] for m in methods]
    costs = [[_quartiles(found[m, f].times, 1e9)[0] for f in families] for m in methods]
    certain = [m for m, row in zip(methods, wrong, strict=True) if not any(row)]
    _draw_cells(above, np.array(wrong), methods, families, "YlOrRd", 1.0, 1e6)
    _draw_cells(below, np.array(costs), methods, families, "Blues", 10.0, 1e5)
    what = f"in no family wrong: {', '.join(certain) or 'no method'}"
    above.set_title(f"Wrong decisions per million rays; an empty field is none. {what.capitalize()}")
    below.set_title(f"Nanoseconds for one ray and one sphere, {backend}")
    head(figure, "Where each method fails, and where being right costs")
    foot(figure, f"{machine()}. {_count_rays(scores)} {_same_on_backends(scores)}")
    return figure


def _count_rays(scores: list[Score]) -> str:
    counts = sorted({s.rays for s in scores if s.family in FAMILIES})
    return f"Rays in a family: {' to '.join(f'{count:,}' for count in (counts[0], counts[-1]))}."


def _draw_cells(
    axes: Axes, values: np.ndarray, rows: list[str], columns: list[str], colours: str, low: float, high: float
) -> None:
    from matplotlib.colors import LogNorm

    shade = np.ma.masked_less_equal(values, 0)
    axes.imshow(shade, cmap=colours, norm=LogNorm(low, high), aspect="auto")
    for (y, x), value in np.ndenumerate(values):
        dark = value > 0 and (log10(value) - log10(low)) / (log10(high) - log10(low)) > 0.62
        axes.text(x, y, short(value) if value else "", ha="center", va="center", size=8.5,
                  color="white" if dark else "#333333")  # fmt: skip
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(range(len(columns)), [name.replace(" ", "\n", 1) for name in columns], size=8.5)
    axes.set_xticks(np.arange(len(columns) + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(len(rows) + 1) - 0.5, minor=True)
    axes.grid(True, which="minor", color="#dddddd", linewidth=0.8)
    axes.tick_params(which="both", length=0)
    for label in axes.get_yticklabels():
        label.set_color(_colour(label.get_text()))
    for spine in axes.spines.values():
        spine.set_visible(False)


# The error of t


def _draw_errors(scores: list[Score]) -> Figure:
    ordinary = next(
        (name for name, family in FAMILIES.items() if family.ordinary and any(s.family == name for s in scores)), None
    )
    places = [place for place in (ordinary, STRESS) if place and any(s.family == place for s in scores)]
    backend = scores[0].racer.backend
    figure = new_figure(13, 4.9 * len(places))
    grid = figure.subplots(len(places), 2, squeeze=False, sharey=True)
    for row, place in zip(grid, places, strict=True):
        own = [s for s in scores if s.family == place and s.racer.backend == backend][::-1]
        name = f"{place} rays".capitalize() if place != STRESS else "All stress families"
        _draw_summaries(row[0], [(s.racer.method, s.ulps) for s in own], -1)
        _draw_summaries(row[1], [(s.racer.method, s.radii) for s in own], -19)
        row[0].set_title(f"{name}: error of t in units of its last digit")
        row[1].set_title(f"{name}: how far off the point is, in radii")
        row[0].set_xlabel("ulps of float64")
        row[1].set_xlabel("|Δt| · |D| / r; 10⁻³ is a thousandth of the sphere's radius")
    _legend_of_summaries(figure)
    head(figure, "A right decision can still have a wrong t: what a sum that cancels costs in digits")
    foot(
        figure,
        f"{machine()}. Over the rays whose decisions are right, so that a method that is wrong often is judged by its "
        f"better rays only. {_same_on_backends(scores)}",
    )
    return figure


def _same_on_backends(scores: list[Score]) -> str:
    """Whether the backends agree in every error."""
    by_place: dict[tuple[str, str], set[str]] = {}
    for s in scores:
        by_place.setdefault((s.racer.method, s.family), set()).add(repr((s.wrong, s.ulps, s.radii)))
    same = sum(len(found) == 1 for found in by_place.values())
    if len({s.racer.backend for s in scores}) == 1:
        return ""
    if same == len(by_place):
        return "Compiled; numpy's errors are the same."
    return f"Compiled; numpy's errors are the same in {same} of {len(by_place)} cases."


def _draw_summaries(axes: Axes, rows: list[tuple[str, Summary]], lowest: int) -> None:
    """A line from the median to the worst of each method; what is exactly 0 lies on a shelf."""
    shelf, ends = 10.0**lowest, [v for _, s in rows for v in s if np.isfinite(v) and v > 0]
    axes.set_xscale("log")
    axes.grid(True, axis="x")
    axes.axvspan(shelf / 30, shelf * 3, color="#eef3ee", zorder=0)
    for y, (method, errors) in enumerate(rows):
        at = [max(value, shelf) for value in errors]
        colour, face = _colour(method), "white" if _is_single(method) else _colour(method)
        axes.plot([at[0], at[2]], [y, y], color=colour, linewidth=2, alpha=0.4, zorder=2)
        axes.plot(at[0], y, "o", color=colour, markerfacecolor=face, markersize=8, zorder=4)
        axes.plot(at[1], y, "D", color=colour, markerfacecolor=face, markersize=5.5, zorder=3)
        axes.plot(at[2], y, "|", color=colour, markersize=13, markeredgewidth=2, zorder=3)
    axes.set_xlim(shelf / 4, max([*ends, 10 * shelf]) * 20)
    axes.set_yticks(range(len(rows)), [method for method, _ in rows])
    for label in axes.get_yticklabels():
        label.set_color(_colour(label.get_text()))
    axes.set_ylim(-0.7, len(rows) - 0.3)
    powers = range(lowest, floor(log10(axes.get_xlim()[1])) + 1)
    step = max(len(powers) // 6, 1)
    chosen = [lowest, *range(lowest + max(step, 2), powers.stop, step)]
    axes.set_xticks([10.0**p for p in chosen], ["0", *(f"$10^{{{p}}}$" for p in chosen[1:])])
    axes.minorticks_off()
    axes.tick_params(axis="y", length=0)


def _legend_of_summaries(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], marker=marker, linestyle="", color="#555555") for marker in "oD|"]
    names = ["median", "99.9 % are not larger", "worst", "hollow: float32"]
    handles.append(Line2D([], [], marker="o", linestyle="", color="#555555", markerfacecolor="white"))
    _place_legend(figure, handles, names)


# Whole pictures


def _draw_pictures(frames: list[Frame]) -> Figure:
    ordinary = [frame for frame in frames if frame.scene == ORDINARY_SCENE.stem]
    hard = [frame for frame in frames if frame.scene != ORDINARY_SCENE.stem]
    count = len({frame.scene for frame in hard})
    panels = [(ORDINARY_SCENE.stem, ordinary)] * bool(ordinary)
    panels += [(f"{count} hard scene{'s' * (count != 1)}, together", hard)] * bool(hard)
    figure = new_figure(13, 6.6 * len(panels))
    grid, drawn = figure.subplots(len(panels), 2, squeeze=False), []
    for row, (title, own) in zip(grid, panels, strict=True):
        for axes, of_bytes in zip(row, (False, True), strict=True):
            word = "bytes" if of_bytes else "pixels"
            points = _points_of_frames(own, of_bytes)
            heights = _draw_against(axes, points, "milliseconds for a picture", f"wrong {word} per million", False)
            drawn.append((axes, points, heights))
            right = [p.racer.method for p in points if p.wrong == 0 and p.racer.backend == points[0].racer.backend]
            axes.set_title(f"{title},\nno wrong {word}: {_some(right)}")
    side = round(frames[0].pixels ** 0.5)
    _legend(figure)
    head(figure, "Whole pictures: what shading and boxes leave of the cost, and what rounding leaves of the picture")
    foot(
        figure,
        f"{machine()}. Stage diffuse, {side}×{side} pixels, all cores, from plan to bytes; time to compile left out. "
        "A pixel is wrong if it shows another shape than certified's.\nMedian of the rounds, line from quartile to "
        "quartile; for several scenes the mean.",
    )
    for axes, points, heights in drawn:
        _label(axes, points, heights)
    return figure


def _some(names: list[str], most: int = 4) -> str:
    if len(names) > most:
        return f"{len(names)} methods"
    return ", ".join(names) or "no method"


# All figures in a table


def write_table(path: Path, scores: list[Score], frames: list[Frame]) -> Path:
    """A row for each method, backend and family or scene; the unit of times is a ray and a sphere, or a picture."""
    head = (
        "kind place method precision backend cases wrong wrong_bytes "
        "ulps_median ulps_999 ulps_worst radii_median radii_999 radii_worst "
        "time_unit time_median time_low time_quarter time_three_quarters time_high rounds"
    )
    rows: list[list[object]] = []
    for s in scores:
        errors = [f"{value:.4g}" for value in (*s.ulps, *s.radii)]
        rows.append(["family", s.family, *_names(s.racer), s.rays, s.wrong, "", *errors, *_times(s.times, "ns")])
    for f in frames:
        wrong = [f.pixels, f.wrong, f.wrong_bytes]
        rows.append(["picture", f.scene, *_names(f.racer), *wrong, *[""] * 6, *_times(f.times, "ms")])
    return write_rows(path, head.split(), rows)


def write_rows(path: Path, head: Sequence[str], rows: Iterable[Iterable[object]]) -> Path:
    """A table as CSV."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(head)
        table.writerows(rows)
    return path


def _names(racer: Racer) -> list[str]:
    return [racer.method, np.dtype(METHODS[racer.method].precision).name, racer.backend]


def _times(times: Sequence[float], unit: str) -> list[str]:
    if not times:
        return [""] * 7
    found = np.quantile(times, [0.5, 0, 0.25, 0.75, 1]) * {"ns": 1e9, "ms": 1e3}[unit]
    return [unit, *(f"{value:.4g}" for value in found), str(len(times))]


# Small things


def new_figure(width: float, height: float, legend: bool = True) -> Figure:
    """With margins, in inches, for the head and a legend above, and two lines of notes below."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    above, below = (0.8 if legend else 0.5) / height, 0.5 / height
    layout = ConstrainedLayoutEngine(rect=(0.004, below, 0.992, 1 - above - below), w_pad=0.12, h_pad=0.1)
    return Figure(figsize=(width, height), dpi=_DOTS, layout=layout)


def head(figure: Figure, text: str) -> None:
    figure.text(0.012, 1 - 0.12 / figure.get_figheight(), text, size=15, weight="bold", va="top", color="#111111")


def foot(figure: Figure, text: str) -> None:
    figure.text(0.012, 0.09 / figure.get_figheight(), text, size=8.5, va="bottom", color="#666666")


def _plain_ticks(axes: Axes) -> None:
    """1, 10, 100, 1 000 in place of powers of ten."""
    low, high = axes.get_xlim()
    ticks = [factor * 10.0**power for power in range(-3, 9) for factor in (1, 2, 3, 5, 7)]
    ticks = [tick for tick in ticks if low <= tick <= high]
    if len(ticks) > 9:
        ticks = [tick for tick in ticks if f"{tick:e}"[0] in ("125" if len(ticks) < 15 else "1")]
    axes.set_xticks(ticks, [short(tick) for tick in ticks])


def short(value: float) -> str:
    """Three letters or so: 0.5, 17, 3.2k, 41k, 1M."""
    for unit, letter in ((1e6, "M"), (1e3, "k"), (1.0, "")):
        if value >= 0.9995 * unit:
            scaled = value / unit
            return f"{scaled:.2g}{letter}" if scaled < 10 else f"{scaled:.0f}{letter}"
    return f"{value:.1g}"


def _colour(method: str) -> str:
    return _COLOURS.get(method.removesuffix("32"), OTHER)


def _is_single(method: str) -> bool:
    return method in METHODS and METHODS[method].precision is np.float32


def machine() -> str:
    """The processor's name, and how many cores."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    name = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), name)
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"
