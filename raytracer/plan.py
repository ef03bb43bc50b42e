"""What a picture of this scene at this stage needs, and why: whatever cannot change the picture is left out here."""

from __future__ import annotations

from collections.abc import Iterator, Sized
from dataclasses import dataclass
from functools import cached_property
from math import inf
from types import ModuleType

import numpy as np

from raytracer import backend, plain
from raytracer.bounce import MOST_REFLECTIONS
from raytracer.camera import Raster, eye_grid, make_raster
from raytracer.eye import Eye, open_eye
from raytracer.full import terms_of
from raytracer.image import Depth
from raytracer.methods import CERTIFIED, Method, row_of
from raytracer.mirrors import mirror_planes
from raytracer.scene import Light, Scene
from raytracer.stages import LIGHT_RANGE, STAGES, Stage

_REFLECTIONS = 4  # that follow each other where there are mirrors, about
_TESTS_FOR_ONE = 8  # tests of rays that start on a shape, many together, in the time of one of an eye ray
_LEAST, _MOST = 1e-70, 1e70  # lengths whose squares, and products of four, are numbers that float64 holds in full
_QUICK = "paint_flat", "paint_diffuse", "paint_diffuse_any", "paint_edges"  # painters that begin with single precision
_TESTS_A_LIGHT = 6  # what shading by a light costs, in tests of a ray against a sphere


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that is decided before the first ray is shot: who traces, what is shaded, and why.

    `why` has the reasons in sentences, `warnings` those that a person should see unasked; `make_plan` makes one.
    """

    scene: Scene
    name: str  # of the stage
    stage: Stage
    raster: Raster
    method: str | Method
    lights: tuple[Light, ...]
    forced: ModuleType | None = None  # who traces, if it is not to be chosen
    unchecked: bool = False  # paint `diffuse` without certainty, to measure what that costs
    depth: Depth = Depth.BYTE
    reach: tuple[float, float] | None = None  # the least and the largest t of a picture of which this is a part

    @cached_property
    def eye(self) -> Eye:
        """The spheres in view, for whoever traces them one after the other."""
        return open_eye(self.scene, self.raster, self.method, self.forced)

    @cached_property
    def truth(self) -> Eye:
        """The same for the true hits."""
        return open_eye(self.scene, self.raster, path=self.forced)

    @cached_property
    def path(self) -> ModuleType:
        """Who traces: `raytracer.plain` or `raytracer.kernels`."""
        chosen = self.forced or backend.loaded() or self.eye.path
        if chosen is plain and self.forced is None and self.stage.throws_on:
            return backend.choose(self._tests_beyond_the_eye, 0, self.stage.painter)
        return chosen

    @property
    def _tests_beyond_the_eye(self) -> int:
        """About how many tests of a ray against a shape it takes to throw light on, where every shape is tested."""
        terms, lights = terms_of(self.scene, bool(self.lights)), len(self.lights)
        shadow_rays = lights * terms.shadows
        rays = shadow_rays + _REFLECTIONS * terms.mirrors * (1 + shadow_rays)
        return self.raster.width * self.raster.height * len(self.scene) * rays // _TESTS_FOR_ONE

    @property
    def path_name(self) -> str:
        """ "numpy" or "compiled"."""
        return "numpy" if self.path is plain else "compiled"

    @property
    def on_screen(self) -> bool:
        """Whether the spheres are sorted into tiles of the screen, and traced there."""
        return self.method == CERTIFIED and self.path is not plain and self.stage.needs_hits

    @cached_property
    def painter(self) -> str:
        """The kernel that paints the whole stage, or nothing if numpy does."""
        beyond = self._has_far_lights or (self.stage.throws_on and not self._has_squares)
        painter = self.stage.painter if self.on_screen and self.depth is Depth.BYTE and not beyond else ""
        if painter == "paint_diffuse" and len(self.scene.triangles):
            return "paint_diffuse_any"
        return f"{painter}_unchecked" if painter and self.unchecked else painter

    @property
    def _has_far_lights(self) -> bool:
        eye = self.scene.camera.eye
        far = (abs(x - o) for light in self.lights for x, o in zip(light.position, eye, strict=True))
        return not max(far, default=0.0) < 2.0**LIGHT_RANGE

    @property
    @np.errstate(all="ignore")
    def _has_squares(self) -> bool:
        """Whether float64 holds the squares of all lengths that light meets, so that boxes of shapes can be trusted."""
        scene, camera = self.scene, self.scene.camera
        points = [camera.eye, *(light.position for light in self.lights)]
        lengths = [abs(x) for point in points for x in point if x]
        smallest = min(scene.spheres.smallest, scene.triangles.smallest, *lengths, inf)
        largest = max(scene.spheres.largest, scene.triangles.largest, *lengths, 0.0)
        if unit := scene.in_units[0]:
            smallest, largest = np.ldexp((smallest, largest), -unit).tolist()
        return bool(smallest > _LEAST and largest < _MOST and _LEAST < eye_grid(self.raster).reach < _MOST)

    @property
    def shading(self) -> float:
        """What a pixel's shading costs, in tests of a ray against a sphere."""
        if not self.stage.throws_on:
            return _TESTS_A_LIGHT * len(self.lights)
        bounces = _REFLECTIONS if terms_of(self.scene, bool(self.lights)).mirrors else 1
        return _TESTS_A_LIGHT * (len(self.lights) + 1) * bounces

    @cached_property
    def why(self) -> tuple[str, ...]:
        """Sentences for a person: what is computed, what is not, and the reason."""
        return (*_reasons(self), *self.warnings)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """Those that a person should see unasked."""
        return tuple(_warnings(self.scene))


def make_plan(
    scene: Scene,
    stage: str | Stage = "diffuse",
    width: int = 320,
    height: int = 320,
    sampling: str = "corner",
    method: str | Method = CERTIFIED,
    path: ModuleType | None = None,
    depth: Depth = Depth.BYTE,
    rows: slice | None = None,
) -> Plan:
    """The plan for a picture; ValueError for a stage, a size, a sampling or a method that there is not.

    Stage and method are those of a table, by name, or rows that are in none. `path` is `raytracer.plain` or
    `raytracer.kernels`, and chosen by default; a method that is in no table is traced by numpy. `depth` is how
    the numbers of a colour are written; `rows` is for a part of the picture only.
    """
    name, row = (stage.about, stage) if isinstance(stage, Stage) else (stage, _stage_named(stage))
    raster = make_raster(scene.camera, width, height, sampling, rows)
    path = plain if isinstance(method, Method) else path
    row_of(method)
    lights = _lights_that_matter(scene) if row.needs_lights else ()
    return Plan(scene, name, row, raster, method, lights, path, depth=depth)


def _stage_named(name: str) -> Stage:
    if name not in STAGES:
        raise ValueError(f"found stage {name!r}, expected one of {', '.join(STAGES)}")
    return STAGES[name]


def _lights_that_matter(scene: Scene) -> tuple[Light, ...]:
    return tuple(light for light in scene.lights if any(light.colour))


def _reasons(plan: Plan) -> Iterator[str]:
    scene, stage = plan.scene, plan.stage
    yield f"stage {plan.name}: {stage.about}"
    if stage.needs_hits:
        yield from _reasons_for_tracing(plan)
    else:
        yield "no ray is shot: the boxes of pixels that can see a shape are all that is counted"
    if not stage.needs_normals:
        yield "no point, no normal: this stage asks only what is hit"
    yield from _reasons_for_lights(plan)
    if stage.throws_on:
        yield from _reasons_for_terms(plan)
    else:
        table = scene.materials.table
        for columns, word in ((table[:, 3:6], "ambient"), (table[:, 6:9], "specular"), (table[:, 10], "k_refl")):
            if columns.any():
                yield f"{word} given, not used by this stage"
        if stage.needs_lights:
            yield "no shadow rays, no reflected rays: this stage has none"
    if stage.needs_truth:
        yield "each ray is traced twice, by the method and for the truth: this stage compares them"
    if stage.needs_whole:
        yield "the whole picture's hits are kept: this stage compares pixels with each other"


def _reasons_for_terms(plan: Plan) -> Iterator[str]:
    scene, lights = plan.scene, plan.lights
    terms = terms_of(scene, bool(lights))
    if terms.shadows:
        yield "a shadow ray to each light that a surface faces: the light's own cells say which shapes may be between"
    elif lights:
        yield "one convex shape cannot shadow itself: no shadow rays"
    else:
        yield "no light: no shadow rays"
    if terms.specular:
        how = "by squaring" if terms.bits >= 0 else "by pow, as not all are whole numbers"
        yield f"specular given: a highlight of each light, its power {how}"
    else:
        yield "no specular colour: no highlights"
    if terms.mirrors:
        yield f"k_refl given: reflected rays, at most {MOST_REFLECTIONS} after each other"
        planes, _ = mirror_planes(scene.triangles, len(scene.spheres.balls), scene.in_units[0])
        if planes and plan.painter:
            yield f"{_count(planes, 'plane mirror')}: what is seen there is looked up where its image is on the screen"
    else:
        yield "no k_refl above 0: no reflected rays"


def _reasons_for_lights(plan: Plan) -> Iterator[str]:
    given, lights = plan.scene.lights, plan.lights
    if not plan.stage.needs_lights:
        if given:
            yield f"{_count(given, 'light')} given, not used by this stage"
    elif len(lights) < len(given):
        yield f"{_count(lights, 'light')} of {len(given)} shaded: the rest is black"
    else:
        yield f"{_count(lights, 'light')} shaded, one after the other"


def _reasons_for_tracing(plan: Plan) -> Iterator[str]:
    eye, scene = plan.eye, plan.scene
    total, seen = len(scene), len(eye.order)
    word = "shape" if len(scene.triangles) and len(scene.spheres) else "triangle" if len(scene.triangles) else "sphere"
    if seen < total:
        yield f"{_count(range(total - seen), word)} of {total} cannot be seen: behind the eye or beside the picture"
    if not seen:
        yield f"no {word} in view: no ray is shot"
        return
    pixels = plan.raster.width * plan.raster.height
    how = "sorted into tiles of the screen, each tested" if plan.on_screen else "tested one after the other, each"
    yield (
        f"{_count(range(seen), word)}: {how} within the box of pixels that can see it, "
        f"{eye.tests / pixels:.3g} tests a pixel"
    )
    if plan.path is plain and not backend.why_no_compiler():
        yield "few tests: numpy is done before the compiler would be loaded"
    if on := int((eye.targets.sides.c == 0).sum()):
        yield f"the eye lies exactly on {_count(range(on), 'sphere')}: the hit at t = 0 does not count"
    if plan.method == CERTIFIED:
        first = "single precision with a bound of its error, then " if plan.painter in _QUICK else ""
        yield f"every decision certain: {first}float64, where that cannot tell two-fold float64, then integers"
    else:
        name = f"{plan.method}: " if isinstance(plan.method, str) else ""
        yield f"method {name}{row_of(plan.method).about}; what rounding makes of it is what is drawn"


def _warnings(scene: Scene) -> Iterator[str]:
    if fault := backend.why_no_compiler():
        yield f"{fault}: numpy draws the same picture, slowly"


def _count(things: Sized, word: str) -> str:
    return f"{len(things)} {word}{'' if len(things) == 1 else 's'}"
