"""What goes wrong where rays start on a shape, drawn: false self-hits and missed contacts against a scene's scale.

The shelf is that of `chart`: "none of N" is no 0, but less than 3 / N with 95 % confidence.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from raytracer.chart import (
    OTHER,
    STYLE,
    axes_ticks,
    foot,
    head,
    new_figure,
    rule_of_three,
    save,
    shelf_height,
    short,
    write_rows,
)
from raytracer.contacts import Count, false_self_hits, missed_contacts
from raytracer.offsets import OFFSETS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RAYS = 100_000  # a scale
SELF_HIT, MISSED = "self-hit", "missed"

_COLOURS = {"none": "#999999", "fixed": "#e69f00", "wächter_binder": "#0072b2", "bounce": "#000000"}
_MARKERS = {"none": "v", "fixed": "s", "wächter_binder": "D", "bounce": "o"}
_TOP = 4e6


def chart_contacts(folder: Path, progress: Callable[[str], object] = lambda text: None, rays: int = RAYS) -> list[Path]:
    """Count and draw; write `chart-contacts` as CSV, PNG and SVG into the folder; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    progress("rays that start on a shape")
    counts = false_self_hits(rays), missed_contacts(rays)
    return [write_table(folder / "chart-contacts.csv", *counts), *draw_contacts(folder, *counts)]


def write_table(path: Path, self_hits: list[Count], missed: list[Count]) -> Path:
    """A row for each way to start a ray and each scale, of either fault."""
    faults = (SELF_HIT, self_hits), (MISSED, missed)
    rows = ([fault, c.offset, f"{c.scale:g}", c.wrong, c.rays] for fault, counts in faults for c in counts)
    return write_rows(path, ["fault", *Count._fields], rows)


def draw_contacts(folder: Path, self_hits: list[Count], missed: list[Count]) -> list[Path]:
    """The picture of what was counted."""
    from matplotlib import rc_context

    with rc_context(STYLE):
        return save(_draw(self_hits, missed), folder / "chart-contacts")


def _draw(self_hits: list[Count], missed: list[Count]) -> Figure:
    figure = new_figure(13, 6.2)
    left, right = figure.subplots(1, 2)
    _draw_panel(left, self_hits)
    _draw_panel(right, missed)
    left.set_title(f"Too near: rays that hit what they leave;\n{_verdict(self_hits, 'no false hit')}")
    right.set_title(f"Too far: rays that miss what is close by;\n{_verdict(missed, 'nothing missed')}")
    left.set_xlabel("distance from the eye to the shape")
    right.set_xlabel("size of the shapes")
    left.set_ylabel("false self-hits per million rays")
    right.set_ylabel("missed contacts per million rays")
    head(figure, "How far to move a ray's start off its surface: no length is right at every scale")
    foot(
        figure,
        "Left: spheres of 10⁻³ to 10⁹ times the distance from the eye, and triangles; rays outward to any side. Right: "
        "shells and sheets 4·10⁻⁵ sizes apart, spheres that touch, some of them on a ground\nor far from "
        "the origin; gaps wider than the start of the ray is off. Every t is right to the last digit, so that only "
        "the starts differ. The truth is worked out in twice the digits.",
    )
    handles, names = left.get_legend_handles_labels()
    corner = (0.006, 1 - 0.42 / figure.get_figheight())
    names = [f"{name}, float32" if name == "wächter_binder" else name for name in names]
    figure.legend(handles, names, loc="upper left", bbox_to_anchor=corner, ncols=len(names), fontsize=9, frameon=False)
    return figure


def _verdict(counts: list[Count], right: str) -> str:
    """What is seen, in a sentence."""
    names = [name for name in OFFSETS if not any(c.wrong for c in counts if c.offset == name)]
    total = sum(c.rays for c in counts if c.offset == counts[0].offset)
    return f"{right} in {total:,}: {', '.join(names) or 'no method'}"


def _draw_panel(axes: Axes, counts: list[Count]) -> None:
    cases = min(c.rays for c in counts)
    bound = rule_of_three(cases)
    shelf = shelf_height((1e6 * c.wrong / c.rays for c in counts), bound)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major")
    axes.axhspan(shelf / 4, shelf * 1.9, color="#eef3ee", zorder=0)
    axes.axhline(bound, color="#7a9a7a", linewidth=1, linestyle=(0, (4, 3)), zorder=1)
    for text, height in (
        (f"none in {cases:,}", shelf / 3.3),
        (f"fewer than {bound:.2g}, if none is wrong", 1.2 * bound),
    ):
        axes.text(0.02, height, text, transform=axes.get_yaxis_transform(), color="#5c7a5c", size=8)
    for name in OFFSETS:
        own = [c for c in counts if c.offset == name]
        _draw_line(axes, name, [(c.scale, 1e6 * c.wrong / c.rays or shelf) for c in own])
    axes.set_ylim(shelf / 4, _TOP)
    axes.set_yticks([shelf, *axes_ticks(bound)], ["none", *(short(tick) for tick in axes_ticks(bound))])
    axes.minorticks_off()


def _draw_line(axes: Axes, name: str, points: list[tuple[float, float]]) -> None:
    kind = next((kind for kind in _COLOURS if name.startswith(kind)), "")
    colour, single, moved = _COLOURS.get(kind, OTHER), OFFSETS[name].precision is np.float32, OFFSETS[name].move
    axes.plot(
        *zip(*points, strict=True),
        marker=_MARKERS.get(kind, "^"),
        color=colour,
        markerfacecolor="white" if single else colour,
        markersize=5.5 if moved else 11,
        linewidth=1.4 if moved else 3,
        linestyle="--" if single else "-",
        label=name,
        zorder=3 if moved else 2,  # what others have in common with it lies on it
    )
