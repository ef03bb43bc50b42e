"""The figures of the performance table, on the machine at hand: pictures, rays and files, and what peers take for them.

Competitors take turns: after a first call each, which is noted apart, every round calls each of them, so that whatever
else the machine does meets all of them; what is done in a moment is called a few times in a row, as in a film, and the
median noted. A figure is the median of the rounds; quartiles stand beside it. A competitor that has used its share of
time sits out the further rounds, and one whose first call took several shares is judged by that call. A picture is the
whole public call, `render_scene`, into an array that is there already, of a camera that has moved since the call
before.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import cycle
from math import radians, tan
from pathlib import Path
from statistics import median, quantiles
from tempfile import TemporaryDirectory
from time import sleep
from typing import NamedTuple, TypeVar

import numpy as np

from raytracer import backend, peers
from raytracer.arrays import Hits
from raytracer.interpreter import interpreter, write_scene
from raytracer.measure import Lane, Result, clocked
from raytracer.methods import CERTIFIED, METHODS
from raytracer.plan import make_plan
from raytracer.render import draw, eye_hits, render_scene, warm_up
from raytracer.scene import Camera, Light, Materials, Scene, Spheres
from raytracer.stages import STAGES
from raytracer.trace import ray_intersect_scene

View = TypeVar("View")

OURS, REFERENCE = "raytracer", "haines"
NEAR, FAR, WIDE, TALL = 3.0, 23.0, 16, 9
SMALLEST, LARGEST, FILLING = 0.3, 1.3, 1.6

_MATERIALS = 64
_STEP = 0.01  # of the camera between two pictures
_DECIMALS = 6
_REST = 0.01  # seconds before a call, in which threads of the one before may go to sleep
_CALLS, _MOMENT = 7, 0.05  # in a row, at most; seconds after which there is no further one
_SHARES = 4  # of time, of a first call, after which there is no second

Progress = Callable[[str], object]
Size = tuple[int, int]


@dataclass(frozen=True)
class Effort:
    """What is measured, and how long."""

    spheres: tuple[int, ...] = (10, 1_000, 10_000, 100_000, 1_000_000)
    size: Size = (1920, 1080)
    sizes: tuple[Size, ...] = ((640, 360), (960, 540), (1280, 720), (1920, 1080), (3840, 2160), (7680, 4320))
    middle: int = 10_000  # spheres, for pictures of all sizes and stages
    many: int = 100_000  # spheres, for threads
    threads: tuple[int, ...] = field(default_factory=lambda: thread_counts(os.cpu_count() or 1))
    methods: tuple[int, Size] = (1_000, (640, 360))
    rays: tuple[int, tuple[int, ...]] = (200_000, (1_000, 100_000))
    parsed: int = 1_000_000  # spheres
    checked: int = 10_000  # spheres: of scenes with more, the decisions are not compared
    rounds: int = 7
    seconds: float = 1.5  # of each competitor, first call included, for one row of a table
    ray_seconds: float = 2.0  # of a call that traces rays
    parse_seconds: float = 8.0  # of each parser, first call included
    farther: int = 1  # how many times more spheres than usual a peer may be given

    def longer(self) -> Effort:
        return replace(
            self,
            rounds=3 * self.rounds,
            seconds=8 * self.seconds,
            parse_seconds=8 * self.parse_seconds,
            checked=max(self.spheres),
            farther=10 * self.farther,
        )


class Timing(NamedTuple):
    """Seconds: of the first call, and of one call in each round."""

    first: float
    rounds: tuple[float, ...]

    @property
    def quartiles(self) -> tuple[float, float, float]:
        """The first, the median, the third."""
        if len(self.rounds) == 1:
            return self.rounds * 3
        low, middle, high = quantiles(self.rounds, n=4, method="inclusive")
        return low, middle, high

    @property
    def median(self) -> float:
        return self.quartiles[1]


class Row(NamedTuple):
    """A competitor, and what one call of it took."""

    name: str
    spheres: int
    size: Size | None  # of the picture, if it draws one
    things: int  # rays, or spheres read
    timing: Timing
    ratio: float  # see `Section.against`; not a number where there is nothing to compare with
    extrapolated: bool = False


class Section(NamedTuple):
    """A table of figures."""

    name: str
    title: str
    thing: str  # what is counted by the second
    against: str  # what `Row.ratio` says
    remark: str
    rows: tuple[Row, ...]


class Check(NamedTuple):
    """A picture compared with another way to draw it."""

    what: str
    spheres: int
    size: Size
    different: int  # pixels
    needed: bool  # whether any is a fault


class Report(NamedTuple):
    sections: tuple[Section, ...]
    checks: tuple[Check, ...]
    peers: tuple[str, ...]  # a sentence each

    @property
    def faulty(self) -> bool:
        return any(check.needed and check.different for check in self.checks)


# ------------------------------------------------------------------------------------------------ what is drawn


def spread(n: int, seed: int = 1) -> Scene:
    """n spheres throughout the view of a 60° camera, whatever n is about as much of the space filled; two lights.

    Depths are uniform from 3 to 23, x and y across the frustum of a picture of 16:9 at that depth, radii uniform in
    1.6 · n^(−1/3) · (0.3 … 1.3). Each sphere is of one of 64 diffuse colours, and those of one follow each other.
    """
    random, camera = np.random.default_rng(seed), Camera()
    depth = random.uniform(NEAR, FAR, n)
    up = depth * tan(radians(camera.fov) / 2)
    x, y = random.uniform(-1, 1, (2, n)) * [up * WIDE / TALL, up]
    radii = FILLING * max(n, 1) ** (-1 / 3) * random.uniform(SMALLEST, LARGEST, n)
    table = np.zeros((_MATERIALS, 11))
    table[:, 0:3], table[:, 9] = random.uniform(0.1, 1.0, (_MATERIALS, 3)), 1.0
    materials, order = Materials(table), np.arange(n, dtype=np.int32)
    material = np.sort(random.integers(0, _MATERIALS, n)).astype(np.int32)
    spheres = Spheres(radii, np.column_stack([x, y, -depth]), material, order, materials)
    lights = Light((10.0, 10.0, 0.0), (0.7, 0.7, 0.7)), Light((-10.0, 5.0, 5.0), (0.4, 0.4, 0.4))
    return Scene(camera, (0.1, 0.1, 0.1), lights, materials, spheres)


def in_decimals(scene: Scene) -> Scene:
    """The same scene as a person or a modeller would write it, with six decimals."""
    table = scene.spheres
    radii, centres = np.round(table.radii, _DECIMALS), np.round(table.centres, _DECIMALS)
    return replace(scene, spheres=replace(table, radii=radii, centres=centres))


def cameras(scene: Scene) -> tuple[Camera, ...]:
    """The scene's, and some a small step beside it."""
    x, y, z = scene.camera.eye
    steps = ((0, 0), (1, 0), (1, 1), (0, 1))
    return tuple(replace(scene.camera, eye=(x + _STEP * i, y + _STEP * j, z)) for i, j in steps)


def random_rays(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Origins where the spheres are, directions uniform over the sphere: (n, 3) each."""
    random = np.random.default_rng(seed)
    origins, directions = spread(n, seed + 1).spheres.centres, random.normal(size=(n, 3))
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def thread_counts(cores: int) -> tuple[int, ...]:
    """1, 2, 4, … and all of them."""
    return tuple(sorted({cores, *(1 << k for k in range(cores.bit_length()))}))


# ------------------------------------------------------------------------------------------------ taking turns


def interleaved(lanes: Mapping[str, Lane], rounds: int, seconds: float) -> dict[str, Timing]:
    """A first call of each lane, then one call of each in every round, each time another one first.

    A lane has `seconds` for all of its calls: none begins later, but for the second, if the first was not too long.
    """
    spent, first, noted = {}, {}, {name: list[float]() for name in lanes}
    for name, lane in lanes.items():
        spent[name], first[name] = lane(0)
    order = list(lanes)
    for turn in range(rounds):
        for name in order[turn % len(order) :] + order[: turn % len(order)]:
            if spent[name] < (seconds if noted[name] else _SHARES * seconds):
                sleep(_REST)
                used, note = lanes[name](turn + 1)
                spent[name] += used
                noted[name].append(note)
    return {name: Timing(first[name], tuple(noted[name]) or (first[name],)) for name in lanes}


def calling(work: Callable[[], object]) -> Lane:
    """The lane of something that does the same at each call."""

    def lane(turn: int) -> tuple[float, float]:
        seconds, _ = clocked(work)
        return seconds, seconds

    return lane


def _in_a_row(turn: int, call: Callable[[View], Result], views: Iterator[View]) -> tuple[list[float], Result]:
    """The times of some calls, each with the next view, of one if it is the first; and what the last one made."""
    times = list[float]()
    while not times or (turn > 0 and len(times) < _CALLS and sum(times) < _MOMENT):
        seconds, made = clocked(partial(call, next(views)))
        times.append(seconds)
    return times, made


def drawing(draw: peers.Draw, scene: Scene, size: Size) -> Lane:
    """The lane of a picture; if what is drawn is smaller than the size, its time is scaled up."""
    views = cycle(cameras(scene))

    def lane(turn: int) -> tuple[float, float]:
        times, picture = _in_a_row(turn, draw, views)
        return sum(times), median(times) * pixels(size) / (picture.size // 3)

    return lane


def ours(scene: Scene, size: Size, stage: str = "diffuse", **options: object) -> peers.Draw:
    """Our own way to draw a scene."""
    picture = np.empty((size[1], size[0], 3), np.uint8)

    def draw(camera: Camera) -> np.ndarray:
        view = replace(scene, camera=camera)
        return render_scene(view, stage, *size, out=picture, **options)  # type: ignore[arg-type]

    return draw


def pixels(size: Size) -> int:
    return size[0] * size[1]


def drawn(draws: Mapping[str, peers.Draw], scene: Scene, size: Size, effort: Effort) -> dict[str, Timing]:
    """All of them in turns, on one scene."""
    lanes = {name: drawing(draw, scene, size) for name, draw in draws.items()}
    return interleaved(lanes, effort.rounds, effort.seconds)


def rows_of(
    timings: Mapping[str, Timing],
    spheres: int,
    size: Size | None,
    things: int,
    reference: str = "",
    speed: bool = False,
) -> list[Row]:
    """A row each; the ratio is to the reference's time, or, as speed, of it."""
    rows = []
    for name, timing in timings.items():
        ratio = timing.median / timings[reference].median if reference in timings else float("nan")
        rows.append(Row(name, spheres, size, things, timing, 1 / ratio if speed else ratio))
    return rows


# ------------------------------------------------------------------------------------------------ what is measured

Part = Callable[[Effort, int, Progress], Iterator[Section | Check]]

_GENERAL = (
    "A peer that is a general ray tracer traces rays of any origin through a hierarchy that it built beforehand; ours "
    "uses that eye rays share one, and starts from the bare list of spheres at each picture."
)


def by_spheres(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Pictures of more and more spheres."""
    rows = []
    for n in effort.spheres:
        progress(f"pictures of {n:,} spheres")
        some, checks = against_peers(spread(n, seed), effort.size, effort)
        rows += some
        yield from checks
    title = f"By spheres: stage diffuse, {named(effort.size)}"
    yield Section("spheres", title, "ray", f"time ÷ {OURS}'s", _GENERAL, tuple(rows))


def by_pixels(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Pictures of more and more pixels."""
    rows, scene = [], spread(effort.middle, seed)
    for size in effort.sizes:
        progress(f"pictures of {named(size)} pixels")
        rows += against_peers(scene, size, effort)[0]
    title = f"By pixels: stage diffuse, {effort.middle:,} spheres"
    yield Section("pixels", title, "ray", f"time ÷ {OURS}'s", _GENERAL, tuple(rows))


def against_peers(scene: Scene, size: Size, effort: Effort) -> tuple[list[Row], list[Check]]:
    """What every peer that can takes for a scene, and whether it draws what we draw."""
    n, draws = len(scene.spheres), {OURS: ours(scene, size)}
    entrants = [peer for peer in able_peers() if n <= peer.most * effort.farther]
    for peer in entrants:
        assert peer.ready is not None
        draws[peer.name] = peer.ready(scene, *size)
    rows = rows_of(drawn(draws, scene, size, effort), n, size, pixels(size), OURS)
    checks = {peer.name: same_picture(peer, draws[peer.name](scene.camera), scene) for peer in entrants}
    small = {name for name, check in checks.items() if check.size != size}
    return [row._replace(extrapolated=row.name in small) for row in rows], list(checks.values())


def able_peers() -> list[peers.Peer]:
    return [peer for peer in peers.PEERS if peer.ready is not None and not why_not(peer)]


@cache
def why_not(peer: peers.Peer) -> str:
    """Asked once: the answer may take a second."""
    return peer.why_not()


def same_picture(peer: peers.Peer, picture: np.ndarray, scene: Scene) -> Check:
    """How many pixels of a peer's picture have a byte that is off by more than 1."""
    height, width, _ = picture.shape
    expected = render_scene(scene, "diffuse", width, height)
    off = np.abs(picture.astype(int) - expected).max(axis=2) > 1
    return Check(f"{peer.name}'s picture", len(scene.spheres), (width, height), int(off.sum()), peer.same)


def by_threads(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """The same picture on more and more threads."""
    progress("threads")
    scene = spread(effort.many, seed)
    draws = {f"{count} thread{'s' * (count > 1)}": ours(scene, effort.size, threads=count) for count in effort.threads}
    timings = drawn(draws, scene, effort.size, effort)
    rows = rows_of(timings, effort.many, effort.size, pixels(effort.size), next(iter(draws)), speed=True)
    title = f"By threads: stage diffuse, {effort.many:,} spheres, {named(effort.size)}"
    yield Section("threads", title, "ray", "times as fast as the first", "", tuple(rows))


def by_stage(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Every stage."""
    progress("stages")
    scene = spread(effort.middle, seed)
    draws = {stage: ours(scene, effort.size, stage) for stage in STAGES}
    timings = drawn(draws, scene, effort.size, effort)
    rows = rows_of(timings, effort.middle, effort.size, pixels(effort.size), "diffuse")
    title = f"By stage: {effort.middle:,} spheres, {named(effort.size)}"
    yield Section("stages", title, "ray", "time ÷ diffuse's", "", tuple(rows))


def by_method(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Every method."""
    progress("methods")
    n, size = effort.methods
    scene = spread(n, seed)
    draws = {method: ours(scene, size, method=method) for method in METHODS}
    rows = rows_of(drawn(draws, scene, size, effort), n, size, pixels(size), REFERENCE)
    title = f"By method: stage diffuse, {n:,} spheres, {named(size)}"
    yield Section("methods", title, "ray", f"time ÷ {REFERENCE}'s", "", tuple(rows))


def certainty(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """The certified tracer against itself with its decisions unchecked."""
    scene = spread(effort.middle, seed)
    unchecked = _unchecked(scene, effort.size)
    if unchecked is not None:
        progress("certainty")
        draws = {CERTIFIED: ours(scene, effort.size), "unchecked": unchecked}
        timings = drawn(draws, scene, effort.size, effort)
        rows = rows_of(timings, effort.middle, effort.size, pixels(effort.size), "unchecked")
        title = f"What certainty costs: stage diffuse, {effort.middle:,} spheres, {named(effort.size)}"
        yield Section("certainty", title, "ray", "time ÷ unchecked's", "", tuple(rows))


def _unchecked(scene: Scene, size: Size) -> peers.Draw | None:
    """What draws as `certified` does, but takes float64's word for every decision; None where numpy draws."""
    picture = np.empty((size[1], size[0], 3), np.uint8)

    def draw_view(camera: Camera) -> np.ndarray:
        return draw(replace(make_plan(replace(scene, camera=camera), "diffuse", *size), unchecked=True), out=picture)

    return draw_view if make_plan(scene, "diffuse", *size).painter else None


def hits(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """What each pixel hits, without a picture."""
    rows = []
    for n in effort.spheres:
        progress(f"eye_hits, {n:,} spheres")
        scene = spread(n, seed)
        kept = eye_hits(scene, *effort.size)
        lanes = {"eye_hits, out=": _hits_lane(scene, effort.size, kept), "eye_hits": _hits_lane(scene, effort.size)}
        timings = interleaved(lanes, effort.rounds, effort.seconds)
        rows += rows_of(timings, n, effort.size, pixels(effort.size))
    title = f"Hits: t to the last digit and index, {named(effort.size)}"
    yield Section("hits", title, "ray", "", "", tuple(rows))


def _hits_lane(scene: Scene, size: Size, out: Hits | None = None) -> Lane:
    views = cycle([replace(scene, camera=camera) for camera in cameras(scene)])

    def lane(turn: int) -> tuple[float, float]:
        times, _ = _in_a_row(turn, lambda view: eye_hits(view, *size, out=out), views)
        return sum(times), median(times)

    return lane


def any_rays(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Rays that share nothing."""
    most, counts = effort.rays
    origins, directions = random_rays(most, seed)
    rows = []
    for n in counts:
        progress(f"random rays, {n:,} spheres")
        table = spread(n, seed).spheres

        def cast(count: int, table: Spheres = table) -> object:
            return ray_intersect_scene(origins[:count], directions[:count], table.centres, table.radii)

        count = affordable(cast, most, effort.ray_seconds)
        lane = calling(partial(cast, count))
        timings = interleaved({f"{count:,} rays": lane}, effort.rounds, 2 * effort.ray_seconds)
        rows += rows_of(timings, n, None, count)
    title = "Any rays: ray_intersect_scene, origins among the spheres, random directions"
    remark = f"As many rays as take about {effort.ray_seconds:g} s, {most:,} at most."
    yield Section("rays", title, "ray", "", remark, tuple(rows))


def affordable(work: Callable[[int], object], most: int, seconds: float) -> int:
    """How many it can be given, from 256 up in fours, for a call to take no longer, about."""
    count = min(256, most)
    work(count)  # may load or compile something
    while count < most:
        took, _ = clocked(partial(work, count))
        if 4 * took > seconds:
            break
        count = min(4 * count, most)
    return count


def parsing(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """Files read."""
    rows, n = [], effort.parsed
    scene = spread(n, seed)
    for name, written in (("all digits", scene), (f"{_DECIMALS} decimals", in_decimals(scene))):
        progress(f"parsing: {n:,} spheres, {name}")
        timings = parsed(written, effort)
        named_rows = rows_of(timings, n, None, n, OURS)
        rows += [row._replace(name=f"{row.name}, {name}") for row in named_rows]
    remark = peers.why_not_povray() or "POV-Ray: the parse time of its own statistics, less that of an empty scene."
    yield Section("parsing", f"Parsing: {n:,} spheres", "sphere", f"time ÷ {OURS}'s", remark, tuple(rows))


def parsed(scene: Scene, effort: Effort) -> dict[str, Timing]:
    """What our interpreter and POV-Ray's parser take for the same spheres."""
    with TemporaryDirectory() as folder:
        cli, pov, nothing = (Path(folder) / name for name in ("scene.cli", "scene.pov", "empty.pov"))
        write_scene(scene, cli)
        lanes = {OURS: calling(partial(interpreter, cli))}
        if not peers.why_not_povray():
            peers.write_pov(scene, pov)
            peers.write_pov(peers.empty(scene), nothing)
            start = peers.povray_parse_seconds(nothing)

            def lane(turn: int) -> tuple[float, float]:
                wall, seconds = clocked(partial(peers.povray_parse_seconds, pov))
                return wall, seconds - start

            lanes["POV-Ray"] = lane
        return interleaved(lanes, effort.rounds, effort.parse_seconds)


def decisions(effort: Effort, seed: int, progress: Progress) -> Iterator[Section | Check]:
    """What the pixels of every benchmark scene hit, against the same in twice the digits."""
    for n in sorted({*effort.spheres, effort.middle, effort.many, effort.methods[0]}):
        if n <= effort.checked:
            progress(f"decisions, {n:,} spheres")
            yield same_decisions(spread(n, seed), effort.size)


def same_decisions(scene: Scene, size: Size) -> Check:
    found, expected = (eye_hits(scene, *size, method=method).index for method in (CERTIFIED, "double_double"))
    different = int((found != expected).sum())
    return Check(f"{CERTIFIED}'s indices against double_double's", len(scene.spheres), size, different, True)


def named(size: Size) -> str:
    return f"{size[0]}×{size[1]}"


PARTS: tuple[Part, ...] = (
    by_spheres,
    by_pixels,
    by_threads,
    by_stage,
    by_method,
    certainty,
    hits,
    any_rays,
    parsing,
    decisions,
)


def measure(
    effort: Effort, seed: int = 1, progress: Progress = lambda text: None, parts: tuple[Part, ...] = PARTS
) -> Report:
    """Measure these parts, one after the other."""
    progress("machine code")
    compile_all()
    found = [thing for part in parts for thing in part(effort, seed, progress)]
    sections = tuple(thing for thing in found if isinstance(thing, Section))
    return Report(sections, tuple(thing for thing in found if isinstance(thing, Check)), about_peers(effort))


def compile_all() -> None:
    """Have all machine code that will be timed: none of the figures is to contain the making of it."""
    scene = spread(100, seed=1)
    for stage, method in [*((stage, CERTIFIED) for stage in STAGES), *(("diffuse", method) for method in METHODS)]:
        warm_up(scene, stage, method)
    backend.load()
    eye_hits(scene, 64, 64)
    ray_intersect_scene(*random_rays(64, seed=1), scene.spheres.centres, scene.spheres.radii)
    if unchecked := _unchecked(scene, (64, 64)):
        unchecked(scene.camera)


def about_peers(effort: Effort) -> tuple[str, ...]:
    """What each peer draws and how it is called, or why it does not."""
    sentences = []
    for peer in peers.PEERS:
        if fault := why_not(peer):
            sentences.append(f"{peer.name}: {fault}.")
        else:
            most = f"at most {peer.most * effort.farther:,} spheres"
            sentences.append(f"{peer.name}: {peer.draws}. Called as: {peer.called}; {most}.")
    return tuple(sentences)
