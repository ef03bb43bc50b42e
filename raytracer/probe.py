"""The story of one pixel: its ray, the shapes near it, what is hit, and the colour that comes of it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from types import FrameType
from typing import Any

import numpy as np

from raytracer import certified, exact, methods, plain
from raytracer.arrays import First
from raytracer.camera import directions, eye_grid, squares, twofold_eye_rays
from raytracer.exact import Root, quotient
from raytracer.eye import Eye, usable_spread
from raytracer.facets import see_facets
from raytracer.image import to_bytes
from raytracer.methods import CERTIFIED, Method, row_of
from raytracer.path import Hit, LightRay, Ray, rays_of
from raytracer.plan import Plan, make_plan
from raytracer.render import block_of, open_tracer, whole_of
from raytracer.scene import Colour, Scene, Shape, Sphere, Triangle, Vector, vector
from raytracer.stages import Block

_DIGITS = 17  # of a float64
_MOST_SHAPES = 8
_MOST_REFLECTIONS, _MOST_LIGHTS = 2, 3  # that are told one by one where the story is short


@dataclass(frozen=True)
class Figure:
    """One value, as the method computed it and in truth."""

    name: str
    found: float
    true: Decimal

    def __str__(self) -> str:
        return f"  {self.name:7}{marked(self.found, self.true):26}{self.true:.{_DIGITS - 1}e}"


@dataclass(frozen=True)
class Meeting:
    """A ray and one of the shapes near it, for a triangle without figures.

    t and true_t are +inf where the method, or the truth, sees no hit.

    For `certified`, t is what float64 makes of it, and NaN where that is not certain.
    """

    index: int  # the shape's place among all shapes of the file
    shape: Shape
    figures: tuple[Figure, ...]
    t: float
    true_t: float

    def lines(self) -> Iterator[str]:
        yield f"shape {self.index}, {describe(self.shape)}"
        yield f"  {'':7}{'as computed |' if self.figures else 'as computed':26}in truth"
        yield from map(str, self.figures)
        yield f"  {'t':7}{_hit_or_miss(self.t):26}{_hit_or_miss(self.true_t)}"


@dataclass(frozen=True)
class Lighting:
    """What a light adds to the diffuse colour."""

    position: Vector
    cosine: float  # N·L
    colour: Colour


@dataclass(frozen=True)
class Pixel:
    """What `probe_pixel` found. Of a ray that hits nothing, index is −1 and what belongs to a hit is None.

    `story()` tells it in lines, `lines()` in fewer, `as_pytest()` as a test case. `t` counts multiples of `direction`,
    `colour` is what the stage computed, `rgb` the bytes that are drawn.
    """

    x: int  # column, from the left
    y: int  # row, from the top
    width: int
    height: int
    stage: str
    method: str
    eye: Vector
    direction: Vector  # rounded
    exact_direction: tuple[Fraction, Fraction, Fraction]
    index: int  # the shape's place among all shapes of the file
    shape: Shape | None
    t: float
    level: str  # what it took to be certain, or nothing for another method
    lead: float | None  # by how much the winner's t is smaller than that of the next, if any
    meetings: tuple[Meeting, ...]  # the shapes whose box of pixels this one lies in, nearest first
    point: Vector | None
    normal: Vector | None
    lights: tuple[Lighting, ...]  # at a stage that looks no farther than the hit
    rays: tuple[Ray, ...]  # at a stage that follows the light on: the eye's ray, and those off mirrors, in their order
    colour: Colour  # as the stage computed it, neither clipped nor rounded
    rgb: tuple[int, int, int]  # as it is drawn

    def lines(self) -> list[str]:
        """The story in short, a line each; indented lines belong to a mirrored ray."""
        return self._lines(in_short=True)

    def _lines(self, in_short: bool) -> list[str]:
        story = [f"pixel {self.x} {self.y}", f"ray from {_numbers(self.eye)} along {_numbers(self.direction)}"]
        if self.shape is None:
            story += ["hits nothing"]
        else:
            lead = "" if self.lead is None else f", the next by {self.lead:.6g} more"
            story += [f"hits shape {self.index}, {describe(self.shape)}", f"at t = {self.t!r}{lead}"]
        if self.level:
            story += [f"decided in {self.level}"]
        if self.point is not None and self.normal is not None:
            story += [f"point {_numbers(self.point)}", f"normal {_numbers(self.normal)}"]
        for light in self.lights:
            story += [f"light {_numbers(light.position)}: N·L = {light.cosine:.6g} adds {_numbers(light.colour)}"]
        story += _tree(self.rays, in_short)
        return [*story, f"{self.stage}: colour {_numbers(self.colour)}", f"drawn as {_numbers(self.rgb)}"]

    def story(self) -> list[str]:
        """The whole story: the exact ray, all after it, and every near shape's quadratic, as computed and in truth."""
        ray = ", ".join(str(component) for component in self.exact_direction)
        first, *rest = self._lines(in_short=False)
        meetings = [line for meeting in self.meetings for line in meeting.lines()]
        return [
            f"{first} of {self.width} x {self.height}, method {self.method}",
            f"ray exactly along ({ray})",
            *rest,
            *meetings,
        ]

    def as_pytest(self) -> str:
        """A test of `ray_intersect_scene`'s kind, with the truth of this pixel's ray, to paste into one's own tests."""
        shapes = [meeting.shape for meeting in self.meetings]
        spheres = [(shape.centre, shape.radius) for shape in shapes if isinstance(shape, Sphere)]
        triangles = [shape.vertices for shape in shapes if isinstance(shape, Triangle)]
        loops = [
            f"    spheres = {spheres!r}  # centre, radius",
            "    ts = [intersect(origin, direction, c, r) for c, r in spheres]",
        ]
        if triangles:
            loops += [
                f"    triangles = {triangles!r}",
                "    ts += [intersect_triangle(origin, direction, *corners) for corners in triangles]",
            ]
        true = min((meeting.true_t for meeting in self.meetings), default=np.inf)
        truth = f"pytest.approx({true!r}, rel=1e-12)" if np.isfinite(true) else "float('inf')  # a miss"
        name = f"test_pixel_{self.x}_{self.y}_of_{self.width}_by_{self.height}"
        return "\n".join(
            [
                "import pytest",
                "",
                "",
                f"def {name}():",
                f"    origin, direction = {self.eye!r}, {self.direction!r}",
                *loops,
                f"    assert min(ts, default=float('inf')) == {truth}",
            ]
        )


@np.errstate(all="ignore")
def probe_pixel(
    scene: Scene,
    x: int,
    y: int,
    width: int = 320,
    height: int = 320,
    stage: str = "diffuse",
    sampling: str = "corner",
    method: str = CERTIFIED,
) -> Pixel:
    """The story of the pixel in column x and row y, counted from 0 at the top left, of a picture of width × height.

    ValueError if there is none such, or no such stage, sampling or method.
    """
    if not (0 <= x < width and 0 <= y < height):
        raise ValueError(f"found pixel {x} {y}, expected one within 0 0 and {width - 1} {height - 1}")
    plan = make_plan(scene, stage, width, height, sampling, method)
    row = slice(y, y + 1)
    rays, hits = directions(eye_grid(plan.raster), row), plan.eye.hits(row, polished=True)
    block = Block(scene, plan.raster, row, hits, scene.lights)
    shown = _shown(plan, row)
    colour = plan.stage.colours(shown)[0, x]
    index, point, normal = int(hits.index[0, x]), None, None
    if index >= 0:
        k = int(np.count_nonzero(block.hit[0, :x]))
        point, normal = vector(block.points[k]), vector(block.normals[k])
    meetings = _meetings(plan, x, y)
    others = [m.true_t if method == CERTIFIED else m.t for m in meetings if m.index != index]
    lead = min(others, default=np.inf) - float(hits.t[0, x]) if index >= 0 else np.inf
    certainty = plan.eye.level(x, y) if method == CERTIFIED else ""
    direction, follows = vector(np.array(rays)[:, 0, x]), plan.stage.throws_on
    return Pixel(
        x, y, width, height, stage, method, scene.camera.eye, direction,
        plan.raster.exact_direction(x, y), index, scene.shape(index) if index >= 0 else None, float(hits.t[0, x]),
        certainty, lead if np.isfinite(lead) else None, meetings, point, normal,
        tuple(_lightings(block, k)) if index >= 0 and plan.stage.needs_lights and not follows else (),
        rays_of(shown, x, direction) if follows else (),
        vector(colour), _bytes(to_bytes(colour)),
    )  # fmt: skip


def _shown(plan: Plan, row: slice) -> Block:
    """One row as the stage is given it when it draws."""
    with open_tracer(plan) as tracer:
        whole = whole_of(plan, tracer)
    return block_of(plan, plan.eye, row, whole=whole)


def _lightings(block: Block, k: int) -> Iterator[Lighting]:
    """What each light adds at hit k of the block."""
    for light in block.lights:
        cosine = float(block.normals[k] @ block.to_light(light)[k])
        yield Lighting(light.position, cosine, vector(block.diffuse[k] * light.colour * max(0.0, cosine)))


# --------------------------------------------------------------------------------------- the shapes near the ray


def _meetings(plan: Plan, x: int, y: int) -> tuple[Meeting, ...]:
    """The shapes in whose boxes the pixel lies, the nearest first, no more than a person reads."""
    left, right, top, bottom = plan.eye.boxes.T
    near = np.flatnonzero((left <= x) & (x < right) & (top <= y) & (y < bottom))
    direction = plan.raster.exact_direction(x, y)
    found = [_meeting(plan, x, y, direction, int(plan.eye.order[i])) for i in near.tolist()[:1000]]
    return tuple(sorted(found, key=lambda meeting: (meeting.true_t, meeting.index))[:_MOST_SHAPES])


def _meeting(plan: Plan, x: int, y: int, direction: tuple[Fraction, ...], index: int) -> Meeting:
    sphere, eye = plan.scene.shape(index), plan.scene.camera.eye
    if isinstance(sphere, Triangle):
        return _meeting_with_triangle(plan, x, y, index, sphere)
    truth = exact.line(eye, direction, sphere.centre, sphere.radius)
    true_t, _ = exact.nearest_hit(eye, direction, [(sphere.centre, sphere.radius)])
    found, t = _watched(plan.eye, x, y, sphere)
    return Meeting(index, sphere, tuple(_figures(found, truth)), t, true_t)


def _meeting_with_triangle(plan: Plan, x: int, y: int, index: int, triangle: Triangle) -> Meeting:
    camera, corners = plan.scene.camera, np.array([triangle.vertices])
    numbers = [*camera.eye, *corners.ravel().tolist()]
    true_t, _ = exact.nearest_of(numbers, *plan.raster.whole_direction(x, y), [9])
    grid = eye_grid(plan.raster)
    facets = see_facets(grid, usable_spread(plan.raster), np.array(camera.eye), corners)
    first, row = First.nothing_yet((1, plan.raster.width)), slice(y, y + 1)
    plain.first_facets_of_grid(grid, facets, np.array([[x, x + 1, y, y + 1]]), row, first, 0)
    t = first.k[0, x] / squares(grid, row)[0, x]
    return Meeting(index, triangle, (), float(np.nan if first.unsure[0, x] else t), true_t)


def _watched(eye: Eye, x: int, y: int, sphere: Sphere) -> tuple[dict[str, Any], float]:
    """What the method's functions hold in their variables when they return, and t."""
    ray = twofold_eye_rays(eye.raster, np.array([x]), np.array([y]))
    seen: dict[str, Any] = {}
    function = row_of(eye.method).function or certified.meet
    watched = [each.__code__ for each in (function, methods.from_discriminant, methods.nearest_ahead)]

    def watch(frame: FrameType, event: str, result: object) -> None:
        if event == "return" and frame.f_code in watched:
            seen.update({name: value for name, value in frame.f_locals.items() if name not in seen})

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        with np.errstate(all="ignore"):
            t = _one(eye.method, eye.raster.camera.eye, ray, sphere)
    finally:
        sys.setprofile(before)
    return seen, float(np.ravel(t)[0])


def _one(method: str | Method, origin: Vector, ray: Any, sphere: Sphere) -> Any:
    """One ray against one sphere, in numpy."""
    row = row_of(method)
    if row.function is None:
        t, _, low = plain.rough_meeting(np.array([origin]), ray, np.array([*sphere.centre, sphere.radius]))
        return np.where(low < np.inf, np.nan, t)
    to = row.precision
    vectors = [(to(ray.x[0]), to(ray.y[0]), to(ray.z[0])), (ray.x_low[0], ray.y_low[0], ray.z_low[0])]
    start, centre = tuple(map(to, origin)), tuple(map(to, sphere.centre))
    return row.function(start, *vectors[: 1 + row.twofold], centre, to(sphere.radius))


def _figures(found: dict[str, Any], truth: exact.Line) -> Iterator[Figure]:
    """The variables of the quadratic by name, those in units of powers of two brought back."""
    unit, step = (int(np.ravel(found.get(name, 0))[0]) for name in ("unit", "step"))
    scales = {"a": 2 * step, "h": step + unit, "b": step + unit, "c": 2 * unit, "near": unit - step, "far": unit - step}
    true: dict[str, Fraction | Root | None] = {
        "a": truth.a, "b": 2 * truth.h, "c": truth.c, "h": truth.h, "near": truth.near, "far": truth.far,
    }  # fmt: skip
    disc = 4 * truth.disc if "b" in found else truth.disc / truth.a if "chord2" in found else truth.disc
    name_of_disc = "chord2" if "chord2" in found else "disc"
    true[name_of_disc], scales[name_of_disc] = disc, 2 * (step + unit)
    for name in ("a", "b" if "b" in found else "h", "c", name_of_disc, "near", "far"):
        value, what = found.get(name), true[name]
        if value is not None and what is not None:
            yield Figure(name, float(np.ldexp(np.float64(np.ravel(value)[0]), scales[name])), _decimal(what))


def _decimal(value: Fraction | Root) -> Decimal:
    if isinstance(value, Root):
        return value.decimal(_DIGITS + 3)
    return quotient(value.numerator, value.denominator, _DIGITS + 3)


def marked(found: float, true: Decimal) -> str:
    """A float in all of its digits, with a bar behind the last one that is right."""
    if not np.isfinite(found):
        return f"|{found}"
    text, right = f"{Decimal(found):.{_DIGITS - 1}e}", f"{true:.{_DIGITS - 1}e}"
    digits, exponent = text.split("e")
    true_digits, true_exponent = right.split("e")
    same = 0
    if int(exponent) == int(true_exponent):
        same = next((k for k, (a, b) in enumerate(zip(digits, true_digits, strict=False)) if a != b), len(digits))
    return f"{digits[:same]}|{digits[same:]}e{exponent}"


# ------------------------------------------------------------------------------------------------------ in words


def describe(shape: Shape) -> str:
    if isinstance(shape, Sphere):
        return f"a sphere of radius {shape.radius!r} about {_numbers(shape.centre)}"
    return "a triangle " + ", ".join(_numbers(vertex) for vertex in shape.vertices)


def _tree(rays: tuple[Ray, ...], in_short: bool) -> Iterator[str]:
    """What adds up to the colour: at the eye's hit, then, indented, at what its mirrored ray meets, and so on."""
    for depth, ray in enumerate(rays):
        indent = "  " * depth
        if in_short and depth > _MOST_REFLECTIONS:
            count, more = len(rays) - depth, np.sum([ray.adds for ray in rays[depth:]], axis=0)
            yield f"{indent[2:]}… {_count(count, 'reflection')} more: {_adds(vector(more), in_short)}"
            return
        if depth:
            yield from (indent[2:] + line for line in _arrival(ray, in_short))
        if ray.hit is None:
            yield f"{indent}the background {_adds(ray.adds, in_short)}"
        else:
            yield from (indent + line for line in _answers(ray.hit, in_short))


def _arrival(ray: Ray, in_short: bool) -> Iterator[str]:
    """Where a mirrored ray goes, and how much of what it brings counts."""
    share = f"k_refl = {ray.k_refl:.6g}, share {ray.share:.6g}"
    meets = "hits nothing" if ray.hit is None else f"hits shape {ray.hit.index}"
    if in_short:
        yield f"mirrored, {share}: {meets}"
        return
    yield f"mirrored along {_numbers(ray.direction)}, {share}"
    if ray.hit is None:
        yield f"  {meets}"
    else:
        yield f"  {meets}, {describe(ray.hit.shape)}"
        yield f"  point {_numbers(ray.hit.point)}, normal {_numbers(ray.hit.normal)}"


def _answers(hit: Hit, in_short: bool) -> Iterator[str]:
    """What the ambient colour and each light add at a hit."""
    yield f"ambient {_adds(hit.ambient, in_short)}"
    told = hit.lights[:_MOST_LIGHTS] if in_short and len(hit.lights) > _MOST_LIGHTS + 1 else hit.lights
    for light in told:
        yield f"light {_numbers(light.position)}{_answer(light, hit, in_short)}"
    if left := hit.lights[len(told) :]:
        more = np.sum([light.adds for light in left], axis=0)
        yield f"… {_count(len(left), 'light')} more: {_adds(vector(more), in_short)}"


def _answer(light: LightRay, hit: Hit, in_short: bool) -> str:
    """Whether a light reaches a hit, and what it adds."""
    shiny = f", H·N = {light.halfway:.6g}" if any(hit.shape.material.specular) else ""
    cosines = f": N·L = {light.cosine:.6g}{shiny}"
    if light.blocker is not None:
        return f" is blocked by shape {light.blocker}" + ("" if in_short else f" at {_numbers(light.stop)}{cosines}")
    if light.is_behind:
        return " shines on the other side" + ("" if in_short else cosines)
    return f"{cosines} {_adds(light.adds, in_short)}"


def _adds(colour: Colour, in_short: bool) -> str:
    return f"adds {_numbers(colour, 3 if in_short else 6)}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("s" if number > 1 else "")


def _hit_or_miss(t: float) -> str:
    return "not certain" if np.isnan(t) else repr(t) if np.isfinite(t) else "a miss"


def _numbers(values: tuple[float, ...], digits: int = 6) -> str:
    return "(" + ", ".join(f"{value + 0.0:.{digits}g}" for value in values) + ")"  # + 0: no minus before a 0


def _bytes(row: np.ndarray) -> tuple[int, int, int]:
    red, green, blue = row.tolist()
    return red, green, blue
