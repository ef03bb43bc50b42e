"""Charts for a page: what lies where, in the units of an SVG; the template only writes it down.

Every mark carries a sentence, "name: figure; figure", which the page shows at a pointer, a touch or a key, and a screen
reader reads out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, isfinite, log10
from typing import NamedTuple

import numpy as np

from raytracer.bench import OURS
from raytracer.bench_chart import TIMES, duration, figure
from raytracer.chart import pareto, rule_of_three, short
from raytracer.chart_contacts import MISSED, SELF_HIT
from raytracer.measure import COMPILED, ORDINARY_SCENE, STRESS
from raytracer.report.figures import Contact, Sample, Score, Timing
from raytracer.samples import ADAPTIVE

WIDTH, HEIGHT = 520, 380
LEFT, RIGHT, TOP, BOTTOM = 66, 18, 40, 56
_SHELF = 26  # the height of the strip for "none"
_LINE = 18  # the height of a line of words
_MOST_TICKS = 7
_ABOVE = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

# Names of the page's colours, which differ in light and dark; those of M. Okabe and K. Ito, more or less.
_COLOURS = {
    "certified": "ink", "textbook": "orange", "half_b": "sky", "geometric": "green", "stable": "mustard",
    "kahan": "blue", "haines": "vermilion", "compensated": "purple", "double_double": "brown",
    OURS: "ink", "Python loop": "vermilion", "Mitsuba 3": "blue",
    "bounce": "ink", "fixed 1e-4": "orange", "wächter_binder": "blue", "none": "grey",
    "even": "blue", ADAPTIVE: "ink",
}  # fmt: skip


@dataclass(frozen=True)
class Axis:
    """Numbers along a line of the drawing, logarithmic; what is 0 lies on a shelf before all others."""

    title: str
    low: float
    high: float
    start: float  # where low lies, in the drawing
    end: float
    shelf: str = ""  # what its tick is called
    label: Callable[[float], str] = short
    fixed: tuple[tuple[float, str], ...] = ()  # ticks to choose from, in place of powers of ten
    names: bool = False

    def at(self, value: float) -> float:
        towards = 1 if self.end > self.start else -1
        if not value > 0:
            return self.start + towards * _SHELF / 2
        first = self.start + towards * _SHELF * bool(self.shelf)
        part = (log10(value) - log10(self.low)) / (log10(self.high) - log10(self.low))
        return round(first + min(max(part, 0.0), 1.0) * (self.end - first), 1)

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """Where a tick is, and what it says: 1, 2, 5, 10, or as many of them as there is room for."""
        if self.fixed:
            return [(self.at(value), text) for value, text in self.fixed if self.low <= value <= self.high]
        powers = range(floor(log10(self.low)), ceil(log10(self.high)) + 1)
        chosen = [f * 10.0**p for p in powers for f in (1, 2, 5) if self.low <= f * 10.0**p <= self.high * 1.0001]
        for step in range(1, len(powers) + 1):
            if len(chosen) <= _MOST_TICKS:
                break
            chosen = [10.0**p for p in powers if p % step == 0 and self.low <= 10.0**p <= self.high * 1.0001]
        none = [(self.at(0), self.shelf)] if self.shelf else []
        return [*none, *((self.at(value), self.label(value)) for value in chosen)]


class Rows(NamedTuple):
    """An axis of names in place of numbers."""

    title: str
    ticks: list[tuple[float, str]]
    names: bool = True


class Label(NamedTuple):
    """Words beside a mark."""

    text: str
    x: float
    y: float
    anchor: str  # which end of the words is at x


class Mark(NamedTuple):
    """A point, and the line through it."""

    x: float
    y: float
    left: float
    right: float
    colour: str
    shape: str  # dot, square, diamond
    hollow: bool
    key: str  # those of one name light up together
    sentence: str
    label: Label | None = None


class Line(NamedTuple):
    points: str  # of a polyline
    colour: str
    dashed: bool
    key: str


class Panel(NamedTuple):
    """One drawing."""

    name: str  # in a chooser
    title: str
    x: Axis
    y: Axis | Rows
    marks: list[Mark]
    lines: list[Line]


def colour_of(name: str) -> str:
    """The page's colour for a method, a peer, or a way to start a ray."""
    base = name.partition(",")[0].removesuffix("32")
    return _COLOURS.get(base, "grey")


def _across(title: str, values: Iterable[float], label: Callable[[float], str] = short) -> Axis:
    low, high = _around(values, 1.25)
    return Axis(title, low, high, LEFT, WIDTH - RIGHT, label=label)


def _upwards(title: str, values: Iterable[float], shelf: str = "", room: float = 1.3) -> Axis:
    low, high = _around(values, room)
    return Axis(title, low, high, HEIGHT - BOTTOM, TOP, shelf)


def _around(values: Iterable[float], room: float) -> tuple[float, float]:
    """A range with room on both sides, of the numbers above 0."""
    some = [value for value in values if value > 0 and isfinite(value)] or [1.0]
    return min(some) / room, max(some) * room


def power(value: float) -> str:
    """A power of ten, with its exponent above the line."""
    return "10" + f"{log10(value):.0f}".translate(_ABOVE)


def _polyline(points: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)


# ------------------------------------------------------------------------------------------------ speed and mistakes


class Cost(NamedTuple):
    """What a method on a backend costs and gets wrong at one place."""

    method: str
    backend: str
    single: bool  # float32
    time: float
    low: float
    high: float
    wrong: int
    cases: int

    @property
    def rate(self) -> float:
        """Per million."""
        return 1e6 * self.wrong / self.cases


def ray_panels(scores: Sequence[Score]) -> list[Panel]:
    """Speed against wrong decisions: all families that are made to break methods, then each family."""
    families = [score for score in scores if score.kind == "family"]
    panels = []
    for place in sorted({score.place for score in families}, key=lambda p: (p != STRESS, p != "ordinary")):
        own = [score for score in families if score.place == place]
        costs = [_stress_cost(score, families) for score in own] if place == STRESS else [_cost(score) for score in own]
        panels.append(_speed_panel(place, f"{place.capitalize()}", costs, "ns", "decisions"))
    return panels


def picture_panels(scores: Sequence[Score]) -> list[Panel]:
    """The same of pictures: the hard scenes together, then each scene."""
    pictures = [score for score in scores if score.kind == "picture"]
    hard = [score for score in pictures if score.place != ORDINARY_SCENE.stem]
    panels = []
    if hard:
        racers = dict.fromkeys((score.method, score.backend) for score in hard)
        count = len({score.place for score in hard})
        total = [_total([s for s in hard if (s.method, s.backend) == racer]) for racer in racers]
        panels.append(_speed_panel("hard scenes together", f"{count} hard scenes, the mean", total, "ms", "pixels"))
    for place in dict.fromkeys(score.place for score in pictures):
        costs = [_cost(score) for score in pictures if score.place == place]
        panels.append(_speed_panel(place, place, costs, "ms", "pixels"))
    return panels


def _cost(score: Score) -> Cost:
    times = score.time_median, score.time_quarter, score.time_three_quarters
    return Cost(score.method, score.backend, score.precision == "float32", *times, score.wrong, score.cases)


def _stress_cost(total: Score, families: Sequence[Score]) -> Cost:
    """Its time is the mean over the families, from the fastest to the slowest."""
    racer = total.method, total.backend
    times = [
        s.time_median for s in families
        if (s.method, s.backend) == racer and s.place not in (STRESS, "ordinary") and s.time_median > 0
    ]  # fmt: skip
    middle = float(np.mean(times)) if times else float("nan")
    return _cost(total)._replace(time=middle, low=min(times, default=middle), high=max(times, default=middle))


def _total(own: Sequence[Score]) -> Cost:
    """Of a racer's pictures: times are means."""
    costs = [_cost(score) for score in own]
    time, low, high = (float(np.mean([getattr(c, name) for c in costs])) for name in ("time", "low", "high"))
    return costs[0]._replace(
        time=time, low=low, high=high, wrong=sum(c.wrong for c in costs), cases=sum(c.cases for c in costs)
    )


def _speed_panel(name: str, title: str, costs: list[Cost], unit: str, what: str) -> Panel:
    costs = [cost for cost in costs if cost.time > 0 and cost.cases]
    each = "nanoseconds for one ray and one sphere" if unit == "ns" else "milliseconds for a picture"
    x = _across(each, [t for cost in costs for t in (cost.low, cost.high)])
    y = _upwards(f"wrong {what} per million", [1e6 / max((c.cases for c in costs), default=1), 1e6], "none", room=1.6)
    compiled = [cost for cost in costs if cost.backend == COMPILED] or costs
    front = pareto((cost.time, cost.rate) for cost in costs)
    named = _apart([cost for cost in compiled if (cost.time, cost.rate) in front], y)
    marks = [_cost_mark(cost, x, y, unit, what, cost in named) for cost in costs]
    right = sum(cost.wrong == 0 for cost in compiled)
    cases = max((cost.cases for cost in compiled), default=0)
    verdict = f"{title}: {right} of {len(compiled)} methods are right {cases:,} times of {cases:,}"
    return Panel(name, verdict, x, y, marks, [Line(_steps(front, x, y), "grey", False, "")])


def _apart(costs: list[Cost], y: Axis) -> list[Cost]:
    """Those that are so much better than the one before that there is room to name them."""
    named: list[Cost] = []
    for cost in sorted(costs, key=lambda cost: cost.rate):
        if not named or y.at(named[-1].rate) - y.at(cost.rate) > _LINE:
            named.append(cost)
    return named


def _steps(front: list[tuple[float, float]], x: Axis, y: Axis) -> str:
    """The Pareto line: to its left and below it, there is no method."""
    corners, height = [], y.end
    for time, rate in front:
        corners += [(x.at(time), height), (x.at(time), y.at(rate))]
        height = y.at(rate)
    return _polyline([*corners, (x.end, height)])


def _cost_mark(cost: Cost, x: Axis, y: Axis, unit: str, what: str, named: bool) -> Mark:
    how = "compiled" if cost.backend == COMPILED else cost.backend
    spread = f"{figure(cost.low)} … {figure(cost.high)}"
    wrong = f"{cost.wrong:,} of {cost.cases:,} {what} wrong, {figure(cost.rate)} per million"
    if not cost.wrong:
        wrong = f"none of {cost.cases:,} {what} wrong"
        if unit == "ns":
            wrong += f", so fewer than {rule_of_three(cost.cases):.2g} per million with 95 % confidence"
    sentence = f"{cost.method}, {how}: {figure(cost.time)} {unit} ({spread}); {wrong}"
    shape = "dot" if cost.backend == COMPILED else "square"
    place = x.at(cost.time), y.at(cost.rate), x.at(cost.low), x.at(cost.high)
    label = _below(cost.method, *place[:2]) if named else None
    return Mark(*place, colour_of(cost.method), shape, cost.single, cost.method, sentence, label)


def _below(text: str, x: float, y: float) -> Label:
    """To the left of a mark on the Pareto line and below it, where there is no other; on the shelf, above it."""
    height = y - 12 if y > HEIGHT - BOTTOM - _SHELF else y + 20
    return Label(text, x - 8, height, "end") if x > LEFT + 13 * len(text) else Label(text, x - 4, height, "start")


def _above(text: str, x: float, y: float) -> Label:
    return Label(text, x, y - 12, "end" if x > WIDTH - RIGHT - 12 * len(text) else "start")


# ------------------------------------------------------------------------------------------------ the error of t


def error_panels(scores: Sequence[Score]) -> list[Panel]:
    """How far off t is where the decision is right: median, 99.9 % and worst, against each other's methods."""
    panels = []
    for place in (STRESS, "ordinary"):
        own = [s for s in scores if s.kind == "family" and s.place == place and s.backend == scores[0].backend]
        if own:
            panels.append(_error_panel(place, own))
    return panels


def _error_panel(place: str, own: list[Score]) -> Panel:
    top = max((s.ulps_worst for s in own if isfinite(s.ulps_worst)), default=1.0)
    x = Axis("error of t, in units of float64's last digit", 0.5, max(top, 2.0) * 2, 2 * LEFT, WIDTH - RIGHT, "0",
             lambda value: power(value) if value >= 1e4 else short(value))  # fmt: skip
    step = (HEIGHT - BOTTOM - TOP) / len(own)
    marks, rows = [], []
    for k, s in enumerate(own):
        y = round(TOP + (k + 0.5) * step, 1)
        rows.append((y, s.method))
        low, most, worst = (x.at(value) for value in (s.ulps_median, s.ulps_999, s.ulps_worst))
        sentence = (
            f"{s.method}: median {_ulps(s.ulps_median)}; 99.9 % are not above {_ulps(s.ulps_999)}; "
            f"worst {_ulps(s.ulps_worst)}"
        )
        hollow, colour = s.precision == "float32", colour_of(s.method)
        marks.append(Mark(low, y, low, worst, colour, "dot", hollow, s.method, sentence))
        marks.append(Mark(most, y, most, most, colour, "diamond", hollow, s.method, sentence))
    return Panel(place, place.capitalize(), x, Rows("● median    ◆ 99.9 %    line: to the worst", rows), marks, [])


def _ulps(value: float) -> str:
    if not isfinite(value):
        return "unknown"
    return f"{value:.3g} ulp{'' if value == 1 else 's'}"


# ------------------------------------------------------------------------------------------------ rays from shapes


def contact_panels(contacts: Sequence[Contact]) -> list[Panel]:
    """False self-hits and missed contacts against a scene's scale, a line for each way to start a ray."""
    titles = {
        SELF_HIT: ("Too near: rays that hit what they leave", "distance from the eye to the shape", "false self-hits"),
        MISSED: ("Too far: rays that miss what is close by", "size of the shapes", "missed contacts"),
    }
    panels = []
    for fault, (title, across, what) in titles.items():
        own = [contact for contact in contacts if contact.fault == fault]
        if own:
            panels.append(_contact_panel(fault, title, across, what, own))
    return panels


def _contact_panel(fault: str, title: str, across: str, what: str, own: list[Contact]) -> Panel:
    x = _across(across, [c.scale for c in own], power)
    y = _upwards(f"{what} per million rays", [1e6 / min(c.rays for c in own), 1e6], "none", room=1.6)
    marks, lines = [], []
    for name in dict.fromkeys(c.offset for c in own):
        some = [c for c in own if c.offset == name]
        single = "float32" in name or name == "wächter_binder"
        colour = colour_of(name)
        places = [(x.at(c.scale), y.at(1e6 * c.wrong / c.rays)) for c in some]
        lines.append(Line(_polyline(places), colour, single, name))
        for c, (left, height) in zip(some, places, strict=True):
            wrong = f"{c.wrong:,} of {c.rays:,} rays wrong, {figure(1e6 * c.wrong / c.rays)} per million"
            sentence = f"{name}: scale {c.scale:g}; {wrong if c.wrong else f'none of {c.rays:,} rays wrong'}"
            marks.append(Mark(left, height, left, left, colour, "dot", single, name, sentence))
    return Panel(fault, title, x, y, marks, lines)


# ------------------------------------------------------------------------------------------------ samples


def sample_panels(samples: Sequence[Sample]) -> list[Panel]:
    """The error of a picture against its time, for each number of samples a pixel."""
    return [
        _sample_panel(scene, [s for s in samples if s.scene == scene])
        for scene in dict.fromkeys(s.scene for s in samples)
    ]


def _sample_panel(scene: str, own: list[Sample]) -> Panel:
    x = _across("milliseconds for a picture", [s.milliseconds for s in own])
    y = _upwards("error in bytes (RMS)", [s.error for s in own])
    places = {s.samples: (x.at(s.milliseconds), y.at(s.error)) for s in own}
    marks = []
    for s in own:
        key = ADAPTIVE if s.samples == ADAPTIVE else "even"
        left, height = places[s.samples]
        name = s.samples if key == ADAPTIVE else f"{s.samples} sample{'' if s.samples == '1' else 's'} a pixel"
        sentence = f"{name}: {figure(s.milliseconds)} ms; error {figure(s.error)} bytes (RMS)"
        marks.append(
            Mark(left, height, left, left, colour_of(key), "dot", False, key, sentence, _above(s.samples, left, height))
        )
    even = [places[s.samples] for s in own if s.samples != ADAPTIVE]
    return Panel(scene, scene, x, y, marks, [Line(_polyline(even), colour_of("even"), False, "even")])


# ------------------------------------------------------------------------------------------------ bench


def bench_panels(timings: Sequence[Timing]) -> list[Panel]:
    """The time of a picture against spheres and against pixels, a line for each who draws it."""
    panels = []
    for section, title, across in (("spheres", "By spheres", "spheres"), ("pixels", "By pixels", "megapixels")):
        own = [timing for timing in timings if timing.section == section]
        if own:
            panels.append(_bench_panel(section, title, across, own))
    return panels


def _bench_panel(section: str, title: str, across: str, own: list[Timing]) -> Panel:
    def place(timing: Timing) -> float:
        return timing.spheres if section == "spheres" else timing.width * timing.height / 1e6

    x = _across(across, [place(t) for t in own])
    y = replace(_upwards("time of a picture", [t.median_ms / 1e3 for t in own]), fixed=tuple(TIMES.items()))
    marks, lines = [], []
    for name in sorted({t.name for t in own}, key=lambda name: (name != OURS, name)):
        some = [t for t in own if t.name == name]
        dashed, colour = any(t.extrapolated == "1" for t in some), colour_of(name)
        places = [(x.at(place(t)), y.at(t.median_ms / 1e3)) for t in some]
        lines.append(Line(_polyline(places), colour, dashed, name))
        for t, (left, height) in zip(some, places, strict=True):
            how = f"{t.spheres:,} spheres, {t.width:.0f}×{t.height:.0f} pixels"
            note = ", extrapolated from a smaller picture" if t.extrapolated == "1" else ""
            speed = f"{figure(t.millions_a_second)} million rays a second"
            sentence = f"{name}: {duration(t.median_ms / 1e3)}{note}; {how}; {speed}"
            last = _above(name, left, height) if t is some[-1] else None
            marks.append(Mark(left, height, left, left, colour, "dot", dashed, name, sentence, last))
    return Panel(section, title, x, y, marks, lines)
