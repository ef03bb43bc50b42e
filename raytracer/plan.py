"""What a picture of this scene at this stage needs, and why: whatever cannot change the picture is left out here."""

from __future__ import annotations

from collections.abc import Iterator, Sized
from dataclasses import dataclass

from raytracer import backend, plain
from raytracer.camera import Raster, make_raster
from raytracer.methods import CERTIFIED, METHODS, check_method
from raytracer.scene import Light, Scene
from raytracer.stages import STAGES, Stage
from raytracer.trace import Eye, open_eye

_TESTS_A_LIGHT = 20  # what shading by a light costs, in tests of a ray against a sphere


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that is decided before the first ray is shot."""

    scene: Scene
    stage: Stage
    raster: Raster
    eye: Eye
    truth: Eye | None  # traces the true hits, for a stage that wants them
    lights: tuple[Light, ...]
    why: tuple[str, ...]  # sentences for a person: what is computed, what is not, and the reason
    warnings: tuple[str, ...]  # those that a person should see unasked

    @property
    def bands(self) -> list[slice]:
        """The picture's rows, cut into pieces that are drawn one at a time; thinner ones where a pixel takes long."""
        pixels = self.raster.width * self.raster.height
        return self.raster.bands(self.eye.tests / pixels + _TESTS_A_LIGHT * len(self.lights))


def make_plan(
    scene: Scene,
    stage: str = "diffuse",
    width: int = 320,
    height: int = 320,
    sampling: str = "corner",
    method: str = CERTIFIED,
) -> Plan:
    """The plan for a picture; ValueError for a stage, a size, a sampling or a method that there is not."""
    if stage not in STAGES:
        raise ValueError(f"found stage {stage!r}, expected one of {', '.join(STAGES)}")
    row, raster = STAGES[stage], make_raster(scene.camera, width, height, sampling)
    check_method(method)
    eye = open_eye(scene, raster, method)
    truth = open_eye(scene, raster) if row.needs_truth else None
    lights = _lights_that_matter(scene) if row.needs_lights else ()
    warnings = tuple(_warnings(scene))
    return Plan(
        scene, row, raster, eye, truth, lights, (*_reasons(scene, stage, row, eye, lights), *warnings), warnings
    )


def _lights_that_matter(scene: Scene) -> tuple[Light, ...]:
    return tuple(light for light in scene.lights if any(light.colour))


def _reasons(scene: Scene, name: str, stage: Stage, eye: Eye, lights: tuple[Light, ...]) -> Iterator[str]:
    yield f"stage {name}: {stage.about}"
    yield from _reasons_for_tracing(scene, eye)
    if not stage.needs_normals:
        yield "no point, no normal: this stage asks only what is hit"
    if not stage.needs_lights:
        if scene.lights:
            yield f"{_count(scene.lights, 'light')} given, not used by this stage"
    elif len(lights) < len(scene.lights):
        yield f"{_count(lights, 'light')} of {len(scene.lights)} shaded: the rest is black"
    else:
        yield f"{_count(lights, 'light')} shaded, one after the other"
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


def _reasons_for_tracing(scene: Scene, eye: Eye) -> Iterator[str]:
    radii, on = eye.targets.radii, eye.targets.sides.c == 0
    total, seen = len(scene.spheres), len(radii)
    if seen < total:
        yield f"{_count(range(total - seen), 'sphere')} of {total} cannot be seen: behind the eye or beside the picture"
    if not seen:
        yield "no sphere in view: no ray is shot"
        return
    pixels = eye.raster.width * eye.raster.height
    yield (
        f"{_count(radii, 'sphere')}: tested one after the other, each within the box of pixels that can see it, "
        f"{eye.tests / pixels:.3g} tests a pixel"
    )
    if eye.targets.path is plain and not backend.why_no_compiler():
        yield "few tests: numpy is done before the compiler would be loaded"
    if on.any():
        yield f"the eye lies exactly on {_count(range(int(on.sum())), 'sphere')}: the hit at t = 0 does not count"
    if eye.method == CERTIFIED:
        yield "every decision certain: float64, where that cannot tell two-fold float64, then integers"
    else:
        yield f"method {eye.method}: {METHODS[eye.method].about}; what rounding makes of it is what is drawn"


def _warnings(scene: Scene) -> Iterator[str]:
    if len(scene.triangles):
        yield f"{_count(scene.triangles, 'triangle')} not drawn: only spheres are, so far"
    if fault := backend.why_no_compiler():
        yield f"{fault}: numpy draws the same picture, slowly"


def _count(things: Sized, word: str) -> str:
    return f"{len(things)} {word}{'' if len(things) == 1 else 's'}"
