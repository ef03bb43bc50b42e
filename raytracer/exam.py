"""A plugged file is put to the test, check by check, in the guide's order, on scenes and on rays where methods fail.

Each check asks for one thing alone: colours are judged on hits that are right, whatever the file makes of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isqrt
from pathlib import Path

import numpy as np

from raytracer.arrays import Hits
from raytracer.compare import TOLERANCE, differences
from raytracer.course import Ray, hits_of_rays, hits_one_by_one, three_numbers
from raytracer.families import FAMILIES, Bundle, bundles
from raytracer.interpreter import SceneError, interpreter
from raytracer.methods import CERTIFIED
from raytracer.mistakes import advice, recognise
from raytracer.plan import make_plan
from raytracer.plug import Order, Plug, PlugError, blaming, draw_plugged, method_of
from raytracer.probe import probe_pixel
from raytracer.render import eye_hits, render_scene, undecided
from raytracer.scene import Camera, Material, Materials, Scene, Sphere, Spheres
from raytracer.stages import unit_vectors
from raytracer.trace import ray_intersect_scene
from raytracer.verify import true_hits

_RAYS, _SEED = 128, 1  # of each family
_MOST_CALLS = 1_000_000  # for a picture
_CLOSE = 1e-6  # how far t may be off, relatively
_GREY = Materials(np.full((1, 11), 0.5))


@dataclass(frozen=True)
class Result:
    """What came of one check on one scene or family."""

    check: str
    subject: str  # the scene's or the family's name
    asked: int = 0  # pixels or rays
    wrong: int = 0
    on_edge: int = 0  # so many of the wrong ones are tangent to the last digit, where only exact arithmetic is right
    story: tuple[str, ...] = ()  # of the first that is wrong
    fault: str = ""  # that ended the check

    @property
    def right(self) -> bool:
        return self.wrong == self.on_edge and not self.fault

    @property
    def is_hard(self) -> bool:
        """Whether it is of what lies beyond the course."""
        return self.check == STABILITY or self.subject.startswith(f"{HARD}/")

    def __str__(self) -> str:
        if self.fault:
            return f"{self.subject}: {self.fault}"
        kind = "rays" if self.check == STABILITY else "pixels"
        edge = f", {self.on_edge} of them where rounding decides" if self.on_edge else ""
        return f"{self.subject}: {self.wrong} of {self.asked} {kind} wrong{edge}"


STABILITY, HARD = "stability", "hard"
ABOUT = {
    "rays": "the eye's rays go through their pixels",
    "hit": "a ray hits something, or nothing: the stages hit and outline",
    "nearest": "of what it hits, the nearest shape",
    "t": f"how far, to {_CLOSE:g} of it",
    STABILITY: "rays where methods fail: far, tangent, tiny, tied",
    "colour": "the colours of the stage, where the hits are right",
}


def examine(plug: Plug, scenes: list[Path], size: int) -> Iterator[Result]:
    """The results of all checks that concern what the file defines."""
    read = [(path, _read(path)) for path in scenes]
    pictures = [(name_of(path), (path, scene, _affordable(size, scene))) for path, scene in read]
    families = [(family, (family,)) for family in FAMILIES]
    for check, (names, ask) in _CHECKS.items():
        if plug.functions.keys() & names:
            for subject, arguments in families if check == STABILITY else pictures:
                try:
                    yield from ask(plug, *arguments)
                except PlugError as error:
                    yield Result(check, subject, fault=str(error))


def _affordable(size: int, scene: Scene) -> int:
    """A smaller size where a function is asked about many shapes for each pixel."""
    return max(1, min(size, isqrt(_MOST_CALLS // max(1, len(scene)))))


def _read(path: Path) -> Scene:
    try:
        return interpreter(path)
    except SceneError as error:
        raise ValueError(f"a scene to test with: {error}") from error


def _rays(plug: Plug, path: Path, scene: Scene, size: int) -> Iterator[Result]:
    """A picture that is not square tells which side is which."""
    width, height, ask = size, max(1, size * 2 // 3), plug.functions["eye_ray"]
    raster, wrong = make_plan(scene, "hit", width, height).raster, 0
    story: tuple[str, ...] = ()
    for y, x in np.ndindex(height, width):
        true = np.array(raster.exact_direction(x, y), float)
        with blaming(plug.path, f"asked for pixel {x} {y}"):
            found = np.array(three_numbers(ask, ask(scene.camera, x, y, width, height), "a direction, three numbers"))
        one, other = unit_vectors(np.stack([found, true]))
        if not np.allclose(one, other, rtol=0, atol=1e-9):
            wrong += 1
            story = story or (
                f"pixel {x} {y} of {width} x {height}: the ray goes along {_listed(true)}",
                f"yours: {_listed(found)}",
            )
    yield Result("rays", name_of(path), width * height, wrong, 0, story)


def _hits(plug: Plug, path: Path, scene: Scene, size: int) -> Iterator[Result]:
    """On the tracer's own rays."""
    method, true = method_of(plug) or CERTIFIED, eye_hits(scene, size, size)
    functions = {name: f for name, f in plug.functions.items() if name in ("intersect", "intersect_triangle")}
    with blaming(plug.path, f"asked for the hits of {path.stem}"):
        if functions:
            found = hits_one_by_one(functions, make_plan(scene, "hit", size, size, method=method))
        else:
            found = eye_hits(scene, size, size, method=method)
    both = (found.index >= 0) & (true.index >= 0)
    same = both & (found.index == true.index)
    with np.errstate(invalid="ignore"):
        far = same & ~(np.abs(found.t - true.t) <= _CLOSE * np.abs(true.t))
    wrong = {"hit": (found.index >= 0) != (true.index >= 0), "nearest": both & ~same, "t": far}
    for check, mask in wrong.items() if not _says_only_whether(plug) else [("hit", wrong["hit"])]:
        yield _result(check, path, scene, mask, lambda x, y: _told(found, (y, x)))


def _says_only_whether(plug: Plug) -> bool:
    """Whether the file's `intersect` answers True or False, as at the first stage: then that is all that is asked."""
    ask = plug.functions.get("intersect")
    with suppress(Exception):
        return ask is not None and isinstance(
            ask(Ray((0, 0, 0), (0, 0, -1)), Sphere(1.0, (0, 0, -4), Material())), bool
        )
    return False


def _colours(plug: Plug, path: Path, scene: Scene, size: int) -> Iterator[Result]:
    """On hits that are right."""
    shades = {name: f for name, f in plug.functions.items() if name in ("shade", "stage", "render_scene")}
    found = draw_plugged(replace(plug, functions=shades), Order(scene, plug.stage, size, size))
    expected = render_scene(scene, plug.stage, size, size)
    mask = differences(found, expected) > TOLERANCE
    own_hits = "render_scene" in plug.functions
    result = _result("colour", path, scene, mask, lambda x, y: f"{_listed(found[y, x])}", plug.stage, own_hits)
    causes = recognise(found, scene, plug.stage, expected=expected) if mask.any() else ()
    named = (f"looks like: {cause}; instead: {'; '.join(advice(cause))}" for cause in causes)
    yield replace(result, story=(*result.story, *named))


def _result(
    check: str,
    path: Path,
    scene: Scene,
    mask: np.ndarray,
    own: Callable[[int, int], str],
    stage: str = "hit",
    hits: bool = True,
) -> Result:
    """What is wrong where the mask (height, width) says so; whether that may lie in the hits."""
    height, width = mask.shape
    clear = mask
    if hits and mask.any():
        clear = mask & ~undecided(scene, width, height)
    story: tuple[str, ...] = ()
    if mask.any():
        y, x = np.argwhere(clear if clear.any() else mask)[0].tolist()
        story = (*probe_pixel(scene, x, y, width, height, stage).lines(), f"yours: {own(x, y)}")
    wrong, certain = int(mask.sum()), int(clear.sum())
    return Result(check, name_of(path), mask.size, wrong, wrong - certain, story)


def _told(hits: Hits, place: int | tuple[int, int]) -> str:
    index, t = int(hits.index[place]), float(hits.t[place])
    return f"hits shape {index} at t = {t!r}" if index >= 0 else "hits nothing"


def _stability(plug: Plug, family: str) -> Iterator[Result]:
    asked, wrong, only_whether = 0, 0, _says_only_whether(plug)
    story: tuple[str, ...] = ()
    for bundle in bundles(family, _RAYS, _SEED):
        true = true_hits(bundle)
        with blaming(plug.path, f"asked for rays of the family {family}"):
            found = _found(plug, bundle)
        asked += len(true.index)
        if only_whether:
            true, found = (Hits(hits.t, np.where(hits.index >= 0, 0, -1)) for hits in (true, found))
        for k in np.flatnonzero(found.index != true.index).tolist():
            wrong += 1
            story = story or (
                f"ray from {_listed(bundle.origins[k])} along {_listed(bundle.directions[k])}",
                *(f"sphere {r!r} at {_listed(c)}" for c, r in zip(bundle.centres, bundle.radii.tolist(), strict=True)),
                _told(true, k),
                f"yours: {_told(found, k)}",
            )
    yield Result(STABILITY, family, asked, wrong, 0, story)


def _found(plug: Plug, bundle: Bundle) -> Hits:
    method = method_of(plug)
    if method is not None:
        return ray_intersect_scene(bundle.origins, bundle.directions, bundle.centres, bundle.radii, method)
    count = len(bundle.radii)
    spheres = Spheres(bundle.radii, bundle.centres, np.zeros(count, np.int32), np.arange(count, dtype=np.int32), _GREY)
    scene = Scene(Camera(), materials=_GREY, spheres=spheres)
    return hits_of_rays(plug.functions, scene, bundle.origins, bundle.directions)


def name_of(path: Path) -> str:
    """A scene's name, with its folder's if that is one within the scenes'."""
    return f"{path.parent.name}/{path.stem}" if path.parent.name == HARD else path.stem


def _listed(numbers: np.ndarray) -> str:
    return f"({', '.join(f'{number:.10g}' for number in numbers.tolist())})"


_CHECKS: dict[str, tuple[set[str], Callable[..., Iterator[Result]]]] = {  # and the functions that each is for
    "rays": ({"eye_ray"}, _rays),
    "hit": ({"intersect", "intersect_triangle", "method"}, _hits),
    STABILITY: ({"intersect", "method"}, _stability),
    "colour": ({"shade", "stage", "render_scene"}, _colours),
}


def summary(results: list[Result]) -> Iterator[str]:
    """The results for a person: the verdict on the course's scenes, then check by check, then what is beyond them."""
    hard = [result for result in results if result.is_hard]
    course = [result for result in results if not result.is_hard]
    scenes = {result.subject for result in course}
    wrong = sorted({result.subject for result in course if not result.right})
    verdict = (
        f"{len(wrong)} of {len(scenes)} are wrong: {', '.join(wrong)}" if wrong else f"all {len(scenes)} are right"
    )
    yield f"scenes of the course: {verdict}"
    yield from _lines(course, "scenes")
    if hard:
        yield "beyond the course, where usual formulas fail:"
        yield from _lines(hard, "hard scenes")


def _lines(results: list[Result], scenes: str) -> Iterator[str]:
    for check, about in ABOUT.items():
        some = [result for result in results if result.check == check]
        if not some:
            continue
        right, kinds = sum(result.right for result in some), "families" if check == STABILITY else scenes
        yield f"  {check:10}{right} of {len(some)} {kinds} right: {about}"
        faulty = [result for result in some if result.wrong or result.fault]
        yield from (f"      {result}" for result in faulty)
        first = next((result for result in faulty if not result.right and result.story), None)
        if first is not None:
            yield f"      the first, in {first.subject}:"
            yield from (f"          {line}" for line in first.story)
