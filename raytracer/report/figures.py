"""The figures of a report: measured anew with little effort, or read from the tables that `chart` and `bench` write.

Measured figures are written as the same tables and read back, so that a page cannot tell where they are from.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, TypeVar, get_type_hints

from raytracer import bench, bench_chart, chart, chart_contacts, chart_samples, contacts, measure

_EFFORT = measure.Effort(rays=1_280, ordinary_rays=6_400, rounds=3, timed_rays=2_048, size=96)
_BENCH = bench.Effort(
    spheres=(10, 1_000, 10_000, 100_000),
    sizes=((640, 360), (1280, 720), (1920, 1080), (3840, 2160)),
    rounds=3,
    seconds=0.3,
    checked=0,
)
_BENCH_PARTS = (bench.by_spheres, bench.by_pixels, bench.by_threads, bench.by_stage, bench.by_method, bench.certainty)
_CONTACTS = 5_000  # rays a scale
_SAMPLES_SIZE, _SAMPLES_ROUNDS = 240, 1

Progress = Callable[[str], object]
Row = TypeVar("Row")


class Score(NamedTuple):
    """A row of chart.csv: a method on a family of rays, or on a picture. Times: of a ray and a sphere, of a picture."""

    kind: str  # family or picture
    place: str
    method: str
    precision: str
    backend: str
    cases: int
    wrong: int
    ulps_median: float
    ulps_999: float
    ulps_worst: float
    time_unit: str
    time_median: float
    time_quarter: float
    time_three_quarters: float


class Timing(NamedTuple):
    """A row of bench.csv: who took how long for what."""

    section: str
    name: str
    spheres: int
    width: float
    height: float
    things: float
    median_ms: float
    quarter_ms: float
    three_quarters_ms: float
    first_ms: float
    millions_a_second: float
    ratio: float
    extrapolated: str
    different: float


class Sample(NamedTuple):
    """A row of chart-samples.csv."""

    scene: str
    samples: str
    milliseconds: float
    error: float


class Contact(NamedTuple):
    """A row of chart-contacts.csv."""

    fault: str
    offset: str
    scale: float
    wrong: int
    rays: int


@dataclass(frozen=True)
class Figures:
    """All of them; a table that is not there is empty, and named in `missing`."""

    scores: list[Score]
    timings: list[Timing]
    samples: list[Sample]
    contacts: list[Contact]
    missing: tuple[str, ...] = ()
    measured: bool = True  # here and now, not read from files


FILES = ("chart.csv", "bench.csv", "chart-samples.csv", "chart-contacts.csv")


def read_figures(folder: Path, measured: bool = False) -> Figures:
    """The tables of a folder. ValueError if none is there, or if one is not what `chart` and `bench` write."""
    missing = tuple(name for name in FILES if not (folder / name).is_file())
    if len(missing) == len(FILES):
        raise ValueError(f"{folder}: found no figures, expected {', '.join(FILES)}, which chart and bench write")
    scores, timings, samples, contacts = (folder / name for name in FILES)
    return Figures(
        read_rows(scores, Score),
        read_rows(timings, Timing),
        read_rows(samples, Sample),
        read_rows(contacts, Contact),
        missing,
        measured,
    )


def read_rows(path: Path, row: Callable[..., Row]) -> list[Row]:
    """The rows of a table, by the names of its columns; none if there is no such file. ValueError for another table."""
    if not path.is_file():
        return []
    types = get_type_hints(row)
    with path.open(encoding="utf-8", newline="") as file:
        table = csv.DictReader(file)
        if lacking := [name for name in types if name not in (table.fieldnames or ())]:
            raise ValueError(f"{path}:1: found no column {lacking[0]!r}, expected {', '.join(types)}")
        return [row(*_values(line, types, f"{path}:{table.line_num}")) for line in table]


def _values(line: dict[str, str], types: dict[str, type], place: str) -> Iterator[object]:
    for name, kind in types.items():
        text = line[name] or ""
        try:
            yield kind(text or "nan") if kind is float else kind(text)
        except ValueError:
            raise ValueError(f"{place}: found {text!r} as {name}, expected a number") from None


def measure_figures(
    progress: Progress = lambda text: None,
    effort: measure.Effort = _EFFORT,
    bench_effort: bench.Effort = _BENCH,
    contact_rays: int = _CONTACTS,
) -> Figures:
    """Measure what `chart` and `bench` measure, in less than a minute: fewer rays, rounds and spheres.

    Pictures are measured of the project's own scenes, so far as they are there.
    """
    effort = replace(effort, scenes=tuple(path for path in effort.scenes if path.is_file()))
    with TemporaryDirectory() as name:
        folder = Path(name)
        scores, frames = measure.score_families(effort, progress), measure.score_scenes(effort, progress)
        chart.write_table(folder / "chart.csv", scores, frames)
        progress("rays that start on a shape")
        counts = contacts.false_self_hits(contact_rays), contacts.missed_contacts(contact_rays)
        chart_contacts.write_table(folder / "chart-contacts.csv", *counts)
        samples = {}
        for path in (measure.SCENES / f"{name}.cli" for name in chart_samples.SHOWN):
            if path.is_file():
                progress(f"samples a pixel, {path.stem}")
                samples[path.stem] = chart_samples.measure_samples(path, _SAMPLES_SIZE, _SAMPLES_ROUNDS)
        chart_samples.write_table(folder / "chart-samples.csv", samples)
        report = bench.measure(bench_effort, progress=progress, parts=_BENCH_PARTS)
        bench_chart.write_csv(folder / "bench.csv", report)
        return read_figures(folder, measured=True)
