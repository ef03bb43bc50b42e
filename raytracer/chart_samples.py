"""What samples cost and what they are worth, drawn: error against time, for each number of samples a pixel.

The truth is the picture with 256 samples a pixel. Rounds go through all numbers of samples, so that what disturbs the
machine disturbs them all, and a time is the median of its rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from raytracer import backend
from raytracer.chart import STYLE, foot, head, new_figure, save, write_rows
from raytracer.interpreter import interpreter
from raytracer.measure import SCENES
from raytracer.plan import make_plan
from raytracer.samples import ADAPTIVE, SAMPLES, Samples, draw_samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = ("04_many_spheres", "09_mirror_spheres", "11_star")
TRUTH = 256
SIZE, ROUNDS = 640, 3


class Point(NamedTuple):
    """What some samples a pixel come to."""

    samples: Samples
    seconds: float
    error: float  # root mean square, in bytes


def chart_samples(
    folder: Path, progress: Callable[[str], object] = lambda text: None, size: int = SIZE, rounds: int = ROUNDS
) -> list[Path]:
    """Measure and draw; write `chart-samples` as CSV, PNG and SVG into the folder; return their paths."""
    from matplotlib import rc_context

    folder.mkdir(parents=True, exist_ok=True)
    points = {}
    for name in SHOWN:
        progress(f"samples a pixel, {name}")
        points[name] = measure_samples(SCENES / f"{name}.cli", size, rounds)
    with rc_context(STYLE):
        return [write_table(folder / "chart-samples.csv", points), *save(_draw(points, size), folder / "chart-samples")]


def write_table(path: Path, points: dict[str, list[Point]]) -> Path:
    """A row for each scene and number of samples: milliseconds of the picture, its error in bytes (RMS)."""
    rows = (
        [scene, p.samples, f"{1e3 * p.seconds:.4g}", f"{p.error:.4g}"] for scene, found in points.items() for p in found
    )
    return write_rows(path, ["scene", "samples", "milliseconds", "error"], rows)


def measure_samples(path: Path, size: int, rounds: int) -> list[Point]:
    """Error and time of all numbers of samples but the truth's, for a scene in all light."""
    backend.load()
    plan, tried = make_plan(interpreter(path), "full", size, size), [each for each in SAMPLES if each != TRUTH]
    true = draw_samples(plan, TRUTH).astype(float)
    times: dict[Samples, list[float]] = {samples: [] for samples in tried}
    errors = {}
    for samples in tried:
        errors[samples] = float(np.sqrt(((draw_samples(plan, samples) - true) ** 2).mean()))
    for _ in range(rounds):
        for samples in tried:
            start = perf_counter()
            draw_samples(plan, samples)
            times[samples].append(perf_counter() - start)
    return [Point(samples, median(times[samples]), errors[samples]) for samples in tried]


def _draw(points: dict[str, list[Point]], size: int) -> Figure:
    figure = new_figure(13, 5.4)
    panels = figure.subplots(1, len(points), squeeze=False)[0]
    for axes, (name, found) in zip(panels, points.items(), strict=True):
        _draw_panel(axes, found)
        axes.set_title(name)
    panels[0].set_ylabel(f"error against {TRUTH} samples, bytes (RMS)")
    head(figure, "Samples where neighbours differ: less error for the same time")
    foot(
        figure,
        f"Stage full, {size} × {size} pixels, whole calls. Where a picture is fine structure all over, such as mirrors "
        "in mirrors (scene 0), even samples are the better choice.",
    )
    return figure


def _draw_panel(axes: Axes, points: list[Point]) -> None:
    from matplotlib.ticker import LogLocator

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major")
    uniform = [point for point in points if point.samples != ADAPTIVE]
    times, errors = [1e3 * point.seconds for point in uniform], [point.error for point in uniform]
    axes.plot(times, errors, "s-", color="#0072b2", markersize=6, linewidth=1.4)
    for point, time in zip(uniform, times, strict=True):
        label = f"{point.samples}"
        axes.annotate(label, (time, point.error), xytext=(7, 5), textcoords="offset points", color="#0072b2")
    for point in points:
        if point.samples == ADAPTIVE:
            place = 1e3 * point.seconds, point.error
            axes.plot(*place, "o", color="#000000", markersize=9)
            axes.annotate(ADAPTIVE, place, xytext=(-9, -5), textcoords="offset points", ha="right")
    axes.set_xlabel("time, milliseconds")
    axes.margins(0.16)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
    axes.minorticks_off()
