"""What every method gets wrong and what it costs: on the families of rays, and on whole pictures.

The truth of a ray is `exact.nearest_hit`, of a picture `certified`'s. Every method and backend is given the same rays,
64 at a time, and its hits are compared with the truth. Then it is timed: in each round all methods trace, one after
the other, the rays of one bundle, repeated until there are enough of them for the cost of a call not to count; no hit
of a timed run may differ from the hits that were compared. Everything has run before it is timed, so that no time to
compile is in it, while all that `certified` does beyond float64 is. A time is that of one ray and one sphere, on one
thread; that of a picture is `render_scene`'s, on all cores.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from types import ModuleType
from typing import NamedTuple, TypeVar

import numpy as np

from raytracer import backend, exact, plain
from raytracer.arrays import Hits
from raytracer.crew import open_crew
from raytracer.families import FAMILIES, Bundle, bundles
from raytracer.interpreter import interpreter
from raytracer.methods import METHODS
from raytracer.plan import Plan, make_plan
from raytracer.render import draw, hits_of, open_tracer
from raytracer.scene import Scene
from raytracer.trace import ray_intersect_scene, trace_given

COMPILED, NUMPY = "compiled", "numpy"
SCENES = Path(__file__).parent.parent / "scenes"
ORDINARY_SCENE = SCENES / "04_many_spheres.cli"

_SEED = 2026
_APART = 0.01  # two roots are two decisions if the chord between them is longer than this part of the radius
_QUOTA = 0.3  # seconds after which a method sits out the further rounds of a family or scene, once it has two

Progress = Callable[[str], object]
Result = TypeVar("Result")


@dataclass(frozen=True)
class Effort:
    """What is measured, and how long."""

    rays: int = 12_800  # of each stress family
    ordinary_rays: int = 128_000
    rounds: int = 11
    timed_rays: int = 8_192  # of one timed call
    size: int = 160  # of a picture
    methods: tuple[str, ...] = field(default_factory=lambda: tuple(METHODS))
    families: tuple[str, ...] = tuple(FAMILIES)
    backends: tuple[str, ...] = (COMPILED, NUMPY)
    scenes: tuple[Path, ...] = field(default_factory=lambda: course_and_hard_scenes())

    def tenfold(self) -> Effort:
        return replace(self, rays=10 * self.rays, ordinary_rays=10 * self.ordinary_rays, rounds=2 * self.rounds)


class Racer(NamedTuple):
    """A method on a backend."""

    method: str
    backend: str


class Summary(NamedTuple):
    """Of many errors."""

    median: float
    most: float  # 99.9 % are not larger
    worst: float


class Score(NamedTuple):
    """How a method on a backend did on one family."""

    racer: Racer
    family: str
    rays: int
    wrong: int
    ulps: Summary  # of t, in units of its last digit
    radii: Summary  # |Δt|·|D| / r, which is what a picture shows
    times: tuple[float, ...]  # seconds for one ray and one sphere, one a round


class Frame(NamedTuple):
    """How a method on a backend drew one scene."""

    racer: Racer
    scene: str
    pixels: int
    wrong: int  # pixels whose shape differs
    wrong_bytes: int  # of 3 · pixels
    times: tuple[float, ...]  # seconds, one a round


class Problem(NamedTuple):
    """Rays of one family, and their truth: arrays (n,) over all of its bundles."""

    family: str
    bundles: list[Bundle]
    t: np.ndarray
    other: np.ndarray  # the other root of the sphere that is hit
    index: np.ndarray  # type: ignore[assignment]
    speed: np.ndarray  # |D|
    radius: np.ndarray  # of the sphere that is hit


class Errors(NamedTuple):
    """Of one method on one problem."""

    wrong: np.ndarray  # bool (n,)
    ulps: np.ndarray  # of those rays that hit, and whose decisions are right
    radii: np.ndarray


STRESS = "all stress families"


def course_and_hard_scenes() -> tuple[Path, ...]:
    """An ordinary scene, and the hard ones; not the one with ten thousand spheres, which takes numpy too long."""
    return (ORDINARY_SCENE, *sorted((SCENES / "hard").glob("[0-9]*.cli")))


def racers(effort: Effort) -> list[Racer]:
    """Every method on every backend there is."""
    there = [name for name in effort.backends if name == NUMPY or backend.load() is not plain]
    return [Racer(method, name) for name in there for method in effort.methods]


def score_families(effort: Effort, progress: Progress, cluster: str | None = None) -> list[Score]:
    """A score for each racer and family, and one for each racer and all stress families together.

    A cluster (see `crew.open_crew`) works out the truth; it is gone again before anything is timed.
    """
    entrants, problems, scores = racers(effort), _problems(effort, progress, cluster), list[Score]()
    checked: dict[tuple[Racer, str], Hits] = {}
    for racer in entrants:
        progress(f"errors: {racer.method}, {racer.backend}")
        parts = []
        for problem in problems:
            hits = trace_bundles(racer, problem.bundles)
            checked[racer, problem.family] = first_bundles(hits, problem.bundles[: effort.rounds])
            parts.append((problem.family, errors_of(problem, hits)))
            scores.append(_score(racer, problem.family, [parts[-1][1]]))
        stress = [errors for family, errors in parts if not FAMILIES[family].ordinary]
        if stress:
            scores.append(_score(racer, STRESS, stress))
    times = {}
    for problem in problems:
        progress(f"times: {problem.family}")
        found = time_family(entrants, problem, checked, effort)
        times.update({(racer, problem.family): seconds for racer, seconds in found.items()})
    return [score._replace(times=times.get((score.racer, score.family), ())) for score in scores]


def _problems(effort: Effort, progress: Progress, cluster: str | None) -> list[Problem]:
    sizes = {name: effort.ordinary_rays if FAMILIES[name].ordinary else effort.rays for name in effort.families}
    if cluster is None:
        found = {}
        for family, rays in sizes.items():
            progress(f"truth: {family}")
            found[family] = pose(family, rays)
    else:
        progress("truth")
        with open_crew(cluster) as crew:
            found = {family: problem for (family, _), problem in crew.work(_pose, sizes.items())}
    return [found[family] for family in sizes]


def _pose(job: tuple[str, int]) -> Problem:
    return pose(*job)


def pose(family: str, rays: int) -> Problem:
    """Rays of a family, with their truth."""
    some = list(bundles(family, rays, _SEED))
    truths = np.array([truth for bundle in some for truth in _truths(bundle)])
    t, other, index, radius = truths.T
    speed = np.concatenate([_lengths(bundle.directions) for bundle in some])
    return Problem(family, some, t, other, index.astype(np.int32), speed, radius)


def _truths(bundle: Bundle) -> Iterator[tuple[float, float, int, float]]:
    spheres = list(zip(bundle.centres.tolist(), bundle.radii.tolist(), strict=True))
    for origin, direction in zip(bundle.origins.tolist(), bundle.directions.tolist(), strict=True):
        t, index = exact.nearest_hit(origin, direction, spheres)
        root = exact.hits(origin, direction, [spheres[index]])[0] if index >= 0 else None
        if root is None:
            yield t, t, index, np.nan
        else:
            yield t, root._replace(sign=-root.sign).nearest_float(), index, spheres[index][1]


def _lengths(vectors: np.ndarray) -> np.ndarray:
    lengths: np.ndarray = np.hypot(np.hypot(vectors[:, 0], vectors[:, 1]), vectors[:, 2])
    return lengths


def trace(racer: Racer, bundle: Bundle) -> Hits:
    """What the racer finds."""
    rays = bundle.origins, bundle.directions, bundle.centres, bundle.radii
    if racer.backend == COMPILED:
        backend.load()
        return ray_intersect_scene(*rays, racer.method)
    return trace_given(*rays, racer.method, plain)


def trace_bundles(racer: Racer, some: Iterable[Bundle]) -> Hits:
    """What the racer finds for the rays of all bundles, each against its own spheres."""
    found = [trace(racer, bundle) for bundle in some]
    return Hits(np.concatenate([hits.t for hits in found]), np.concatenate([hits.index for hits in found]))


def first_bundles(hits: Hits, some: list[Bundle]) -> Hits:
    count = sum(len(bundle.origins) for bundle in some)
    return Hits(hits.t[:count].copy(), hits.index[:count].copy())


@np.errstate(all="ignore")
def errors_of(problem: Problem, hits: Hits) -> Errors:
    """Wrong is: another shape or none, a hit where there is none, or the other root of the right shape."""
    off = np.where(hits.t == problem.t, 0.0, abs(hits.t - problem.t))
    chord = abs(problem.other - problem.t) * problem.speed / problem.radius
    other_root = (abs(hits.t - problem.other) < off) & (chord > _APART)
    wrong = (hits.index != problem.index) | other_root
    right = ~wrong & (problem.index >= 0)
    ulps = np.where(off == 0, 0.0, off / np.spacing(problem.t))
    return Errors(wrong, ulps[right], (off * problem.speed / problem.radius)[right])


def summary(errors: np.ndarray) -> Summary:
    """Not a number if there are no errors to sum up."""
    if not len(errors):
        return Summary(np.nan, np.nan, np.nan)
    median, most, worst = np.quantile(errors, [0.5, 0.999, 1.0], method="higher")
    return Summary(float(median), float(most), float(worst))


def _score(racer: Racer, family: str, parts: list[Errors]) -> Score:
    wrong, ulps, radii = (np.concatenate([part[k] for part in parts]) for k in range(3))
    return Score(racer, family, len(wrong), int(wrong.sum()), summary(ulps), summary(radii), ())


def time_family(
    entrants: list[Racer], problem: Problem, checked: dict[tuple[Racer, str], Hits], effort: Effort
) -> dict[Racer, tuple[float, ...]]:
    """Seconds for one ray and one sphere, of each racer in each round; a round is a bundle."""
    lanes = {}
    for racer in entrants:
        hits = checked[racer, problem.family]
        lanes[racer] = partial(_time_bundle, racer, problem.bundles, hits, effort.timed_rays)
    return in_turns(lanes, min(effort.rounds, len(problem.bundles)))


def _time_bundle(racer: Racer, some: list[Bundle], checked: Hits, rays: int, turn: int) -> tuple[float, float]:
    bundle = some[turn]
    size = len(bundle.origins)
    times = max(rays // size, 1)
    many = replace(
        bundle, origins=np.tile(bundle.origins, (times, 1)), directions=np.tile(bundle.directions, (times, 1))
    )
    seconds, hits = clocked(partial(trace, racer, many))
    expected = slice(turn * size, (turn + 1) * size)
    _refuse_change(racer, hits.t, np.tile(checked.t[expected], times))
    _refuse_change(racer, hits.index, np.tile(checked.index[expected], times))
    return seconds, seconds / (times * size * len(bundle.radii))


Lane = Callable[[int], tuple[float, float]]  # a turn's number to the seconds that it took, and what is noted of it


def in_turns(lanes: Mapping[Racer, Lane], rounds: int) -> dict[Racer, tuple[float, ...]]:
    """One turn of every lane, then the next of every lane, each time another one first."""
    spent, noted = dict.fromkeys(lanes, 0.0), {racer: list[float]() for racer in lanes}
    order = list(lanes)
    for turn in range(rounds):
        for racer in order[turn % len(order) :] + order[: turn % len(order)]:
            if spent[racer] < _QUOTA or turn < 2:
                seconds, note = lanes[racer](turn)
                spent[racer] += seconds
                noted[racer].append(note)
    return {racer: tuple(notes) for racer, notes in noted.items()}


def score_scenes(effort: Effort, progress: Progress) -> list[Frame]:
    """Every racer's picture of every scene, against `certified`'s."""
    frames = []
    for path in effort.scenes:
        progress(f"pictures: {path.stem}")
        frames += _score_scene(interpreter(path), path.stem, effort)
    return frames


def _score_scene(scene: Scene, name: str, effort: Effort) -> list[Frame]:
    truth = make_plan(scene, "diffuse", effort.size, effort.size)
    true_index, true_picture = _index(truth), draw(truth)
    entrants, pictures, frames = racers(effort), dict[Racer, np.ndarray](), []
    for racer in entrants:
        if racer.backend == COMPILED:
            draw(plan_on(scene, racer, 16))
    lanes = {racer: partial(_time_frame, racer, scene, effort.size, pictures) for racer in entrants}
    times = in_turns(lanes, effort.rounds)
    for racer in entrants:
        wrong = int((_index(plan_on(scene, racer, effort.size)) != true_index).sum())
        wrong_bytes = int((pictures[racer] != true_picture).sum())
        frames.append(Frame(racer, name, true_index.size, wrong, wrong_bytes, times[racer]))
    return frames


def _time_frame(
    racer: Racer, scene: Scene, size: int, pictures: dict[Racer, np.ndarray], turn: int
) -> tuple[float, float]:
    seconds, picture = clocked(lambda: draw(plan_on(scene, racer, size)))
    _refuse_change(racer, picture, pictures.setdefault(racer, picture))
    return seconds, seconds


def plan_on(scene: Scene, racer: Racer, size: int) -> Plan:
    """A picture's plan, on that backend."""
    path: ModuleType = backend.load() if racer.backend == COMPILED else plain
    return make_plan(scene, "diffuse", size, size, method=racer.method, path=path)


def _index(plan: Plan) -> np.ndarray:
    """Which shape each pixel shows."""
    with open_tracer(plan) as tracer:
        return hits_of(plan, tracer).index


def clocked(work: Callable[[], Result]) -> tuple[float, Result]:
    """Seconds, and what was done in them; without the collector of garbage that others left."""
    gc.disable()
    start = perf_counter()
    result = work()
    seconds = perf_counter() - start
    gc.enable()
    return seconds, result


def _refuse_change(racer: Racer, found: np.ndarray, checked: np.ndarray) -> None:
    if not np.array_equal(found, checked):
        raise RuntimeError(f"{racer.method}, {racer.backend}: a timed run found something else than before")
