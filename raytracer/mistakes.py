"""`MISTAKES`: what usually goes wrong in a tracer, and which of it a picture shows.

A mistake is a step of the guide's tracer (see `raytracer.guide`) done in another way. A picture shows it if the tracer
with this mistake draws the same wrong pixels, within 1: nearly all of those that are wrong, and of those that would be
wrong by it. Looked at are some thousand pixels, half of them wrong ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, combinations, product
from time import perf_counter

import numpy as np

from raytracer.camera import focal_length
from raytracer.compare import TOLERANCE, differences
from raytracer.guide import LOOKS, Array, Guide, Place, Steps, ball_normal, dot, facet_normal, to_screen, unit
from raytracer.image import to_bytes
from raytracer.render import render_scene, undecided
from raytracer.scene import Camera, Colour, Light, Scene
from raytracer.stages import BLACK, Stage

_ALIKE = 0.99  # of the pixels that tell must be as the mistake draws them, but for
_STRAYS = 2  # pixels that lie on an edge, and may be on either side of it
_FEWEST = 6  # pixels that a mistake must explain
_LOOKED_AT = 1024  # wrong pixels, and as many others
_AT_FIRST = 32  # wrong pixels, and as many others, that a mistake is tried on before
_KNOWN = 0.5  # of the wrong pixels must be such that the guide's tracer draws them rightly, if it makes no mistake
_MOST_LIGHTS = 4
_MOST_NAMED = 4
_SECONDS = 1.5  # after which no more pairs of mistakes are tried
MOST_SHAPES = 1000  # every shape is tested with every ray


@dataclass(frozen=True)
class Mistake:
    """One row of `MISTAKES`: which steps it does in another way, and what to do instead."""

    steps: dict[str, object]  # fields of `Steps`
    instead: str
    allowed: bool = False  # it changes no byte by more than 1
    judge: Callable[[_Evidence], float] | None = None  # in place of `_Evidence.explained`
    or_steps: tuple[
        dict[str, object], ...
    ] = ()  # the same mistake in tracers that do something else otherwise, rightly
    alone: bool = False  # it is not tried together with others, nor where one of these is surely the cause

    def done(self, steps: Steps) -> Steps:
        return replace(steps, **self.steps)  # type: ignore[arg-type]

    def ways(self, steps: Steps) -> Iterator[Steps]:
        """All ways to make it."""
        for each in (self.steps, *self.or_steps):
            yield replace(steps, **each)  # type: ignore[arg-type]


def _moved(columns: int, rows: int) -> Callable[[Array, Array, int, int], Place]:
    """What should be in a pixel is as many columns to the right of it, and rows below."""
    return lambda x, y, width, height: (x - columns, y - rows)


def _upside_down(x: Array, y: Array, width: int, height: int) -> Place:
    return x, height - 1 - y


def _v_negated(x: Array, y: Array, width: int, height: int) -> Place:
    U, V = to_screen(x, y, width, height)
    return U, -V


def _left_right(x: Array, y: Array, width: int, height: int) -> Place:
    return width - 1 - x, y


def _u_negated(x: Array, y: Array, width: int, height: int) -> Place:
    U, V = to_screen(x, y, width, height)
    return -U, V


def _to_the_last_pixel(x: Array, y: Array, width: int, height: int) -> Place:
    """U and V reach 1 in the last pixel, not beside it."""
    aspect, right, bottom = width / height, max(width - 1, 1), max(height - 1, 1)
    return aspect * (2 * x / right - 1), 1 - 2 * y / bottom


def _horizontal(x: Array, y: Array, width: int, height: int) -> Place:
    return (2 * x - width) / width, (height - 2 * y) / width


def _stretched(x: Array, y: Array, width: int, height: int) -> Place:
    return (2 * x - width) / width, (height - 2 * y) / height


def _whole_angle(fov: float) -> float:
    return float(1 / np.tan(np.radians(fov)))


def _not_inverted(fov: float) -> float:
    return 1 / focal_length(fov)


def _degrees(fov: float) -> float:
    return float(1 / np.tan(fov / 2))


def _one(fov: float) -> float:
    return 1.0


def _eye_at_zero(camera: Camera) -> Camera:
    return replace(camera, eye=(0.0, 0.0, 0.0))


def _no_frame(camera: Camera) -> Camera:
    return Camera(camera.eye, fov=camera.fov)


def _backwards(camera: Camera, U: Array, V: Array, d: float) -> Array:
    u, v, w = np.array([camera.u, camera.v, camera.w])
    D: Array = U[:, None] * u + V[:, None] * v + d * w
    return D


def _plus_eye(camera: Camera, U: Array, V: Array, d: float) -> Array:
    """The point on the screen, with the eye not taken off."""
    return camera.eye + _backwards(camera, U, V, -d)


@dataclass(frozen=True)
class _Textbook:
    """a t² + b t + c = 0, with something else in the place of one of its parts: a step `quadratic`.

    a = D·D, b = 2 D·(O − C), c = |O − C|² − r²; t = (−b ± √(b² − 4ac)) / 2a.
    """

    b: Callable[[Array, Array, Array], Array] = lambda D, O, C: 2 * dot(D, O - C)  # noqa: E741
    c: Callable[[Array, Array, Array], Array] = lambda O, C, r: dot(O - C, O - C) - r**2  # noqa: E741
    under: Callable[[Array, Array, Array], Array] = lambda a, b, c: b * b - 4 * a * c  # the root
    t: Callable[[Array, Array, Array], Array] = lambda a, b, root: (b + root) / (2 * a)  # of −b and ±root
    a: Callable[[Array], Array] = lambda D: dot(D, D)
    root: Callable[[Array], Array] = np.sqrt
    normalised: bool = False  # D is made of length 1 before

    def __call__(self, O: Array, D: Array, length: Array, centres: Array, radii: Array) -> Place:  # noqa: E741
        length = np.ones_like(length) if self.normalised else length
        D, O = (D * length)[:, None], O[:, None]  # noqa: E741
        a, b, c = self.a(D), self.b(D, O, centres), self.c(O, centres, radii)
        under = self.under(a, b, c)
        root = np.where(under >= 0, self.root(under), np.nan)
        return length * self.t(a, -b, -root), length * self.t(a, -b, root)


def _unit_from_centre(P: Array, centre: Array, radius: Array) -> Array:
    return unit(P - centre)


def _quadratic(instead: str, lengths: Sequence[bool] = (False,), **parts: Callable[..., Array]) -> Mistake:
    """A row for a part of the quadratic: with (P − C) / r and with unit(P − C).

    `lengths` is (False, True) where it tells whether D is of length 1, and both are this mistake.
    """
    first, *others = (
        {"quadratic": _Textbook(normalised=normalised, **parts), "ball": ball}
        for normalised, ball in product(lengths, (ball_normal, _unit_from_centre))
    )
    return Mistake(first, instead, or_steps=tuple(others), alone=True)


def _far(near: Array, far: Array, least: Array) -> Array:
    return np.where(far > least, far, np.inf)


def _only_near(near: Array, far: Array, least: Array) -> Array:
    return np.where(near > least, near, np.inf)


def _behind_too(near: Array, far: Array, least: Array) -> Array:
    return np.where(np.isnan(near), np.inf, near)


def _last(t: Array) -> Array:
    last: Array = t.shape[1] - 1 - np.isfinite(t)[:, ::-1].argmax(axis=1)
    return last


def _first(t: Array) -> Array:
    first: Array = np.isfinite(t).argmax(axis=1)
    return first


def _farthest(t: Array) -> Array:
    farthest: Array = np.where(np.isfinite(t), t, -np.inf).argmax(axis=1)
    return farthest


def _times_r(P: Array, centre: Array, radius: Array) -> Array:
    N: Array = P - centre
    return N


def _inwards(P: Array, centre: Array, radius: Array) -> Array:
    N: Array = (centre - P) / radius[:, None]
    return N


def _from_origin(P: Array, centre: Array, radius: Array) -> Array:
    return unit(P)


def _as_wound(normal: Array, D: Array) -> Array:
    return unit(normal)


def _against_winding(normal: Array, D: Array) -> Array:
    return -unit(normal)


def _away_from_viewer(normal: Array, D: Array) -> Array:
    return -facet_normal(normal, D)


def _long_normal(normal: Array, D: Array) -> Array:
    return np.where(dot(normal, D)[:, None] > 0, -normal, normal)


def _long(P: Array, light: Array) -> Array:
    L: Array = light - P
    return L


def _from_light(P: Array, light: Array) -> Array:
    return unit(P - light)


def _position(P: Array, light: Array) -> Array:
    return unit(np.broadcast_to(light, P.shape))


def _by_square(P: Array, light: Array) -> Array:
    L = light - P
    shortened: Array = L / dot(L, L)[:, None]
    return shortened


def _faded(diffuse: Array, light: Array, cosine: Array) -> Array:
    faded: Array = diffuse * cosine
    return faded


def _srgb(C: Array) -> Array:
    """IEC 61966-2-1."""
    C = np.clip(np.nan_to_num(C), 0.0, 1.0)
    return to_bytes(np.where(C <= 0.0031308, 12.92 * C, 1.055 * C ** (1 / 2.4) - 0.055))


def _gamma(C: Array) -> Array:
    return to_bytes(np.clip(np.nan_to_num(C), 0.0, 1.0) ** (1 / 2.2))


def _cut_off(C: Array) -> Array:
    numbers: Array = (np.clip(np.nan_to_num(C), 0.0, 1.0) * 255.0).astype(np.uint8)
    return numbers


def _wrapped(C: Array) -> Array:
    numbers: Array = (np.nan_to_num(C) * 255.0 + 0.5).astype(np.int64).astype(np.uint8)
    return numbers


def _nothing(t: Array) -> Array:
    t[...] = np.inf
    return np.zeros(len(t), int)


def _black(colour: Colour) -> Colour:
    return BLACK


def _mirrored_light(N: Array, L: Array, D: Array) -> Array:
    """R·V, for the light's own mirrored ray R."""
    return dot(2 * dot(N, L)[:, None] * N - L, -D)


def _half_way_beyond(N: Array, L: Array, D: Array) -> Array:
    return dot(unit(L + D), N)


def _no_distance(near: Array, far: Array, least: Array, distance: Array) -> Array:
    return (near > least) | (far > least)


def _never(near: Array, far: Array, least: Array, distance: Array) -> Array:
    return np.zeros(near.shape, bool)


def _into_the_mirror(D: Array, N: Array) -> Array:
    R: Array = 2 * dot(N, D)[:, None] * N - D
    return R


def _mean(total: Array, lights: int) -> Array:
    return total / max(lights, 1)


def _only(some: Sequence[Light], lights: Sequence[Light]) -> Sequence[Light]:
    return some


def _acne(evidence: _Evidence) -> float:
    """Speckles, in which some of the lights are missing; a mirror shows those of other shapes, and does not tell."""
    guide, x, y, lights = evidence.guide, evidence.x, evidence.y, evidence.guide.scene.lights
    if not evidence.speckled or guide.stage != "full" or len(lights) > _MOST_LIGHTS:
        return 0.0
    no_mirror = replace(guide.steps, reflections=0)
    dull = (guide.paint(no_mirror, x, y) == evidence.right).all(axis=1)
    explained = np.zeros(len(x), bool)
    for some in chain.from_iterable(combinations(lights, n) for n in range(len(lights))):
        drawn = guide.paint(replace(no_mirror, lights=partial(_only, some)), x, y)
        explained |= _off(drawn, evidence.found) <= evidence.tolerance
    return share_of(evidence.wrong & dull, explained)


QUADRATIC = "a = D·D, b = 2 D·(O − C), c = (O − C)·(O − C) − r², t = (−b ± √(b² − 4ac)) / 2a"
ROOTS = "t = (−b ± √(b² − 4ac)) / 2a, all of it divided"
DISCRIMINANT = "b² − 4ac with b = 2 D·(O − C), or h² − ac with h = D·(O − C)"
CONSTANT = "c = (O − C)·(O − C) − r²"
SHADING = "diffuse · light · max(0, N·L)"

MISTAKES = {
    "nothing is hit": Mistake({"seen": _nothing}, "a ray hits where the discriminant is not negative and t > 0"),
    # the quadratic: before what is as black, or misses as much
    "t not divided by 2a": _quadratic(ROOTS, t=lambda a, b, root: b + root),
    "t divided by a in place of 2a": _quadratic(ROOTS, t=lambda a, b, root: (b + root) / a),
    "(−b − √disc) / 2 * a: times a": _quadratic(
        "/ (2 * a): / and * go from left to right", t=lambda a, b, root: (b + root) / 2 * a
    ),
    "−b − √disc / 2a: only the root is divided": _quadratic(
        "(−b − √disc) / 2a, in brackets", (False, True), t=lambda a, b, root: b + root / (2 * a)
    ),
    "−b − √disc / 2 * a: only the root is divided, then times a": _quadratic(
        "(−b − √disc) / (2 * a), in brackets", t=lambda a, b, root: b + root / 2 * a
    ),
    "−h − √disc / a: only the root is divided, h = D·(O − C)": _quadratic(
        "(−h − √(h² − ac)) / a, in brackets", t=lambda a, b, root: b / 2 + root / (2 * a)
    ),
    "divided by 2a where h = D·(O − C) has no 2": _quadratic(
        "(−h − √(h² − ac)) / a, or b = 2h", t=lambda a, b, root: (b + root) / (4 * a)
    ),
    "b without the 2": _quadratic(
        "b = 2 D·(O − C) where the discriminant is b² − 4ac",
        b=lambda D, O, C: dot(D, O - C),  # noqa: E741
    ),
    "a·c in place of 4·a·c": _quadratic(DISCRIMINANT, under=lambda a, b, c: b * b - a * c),
    "b from C − O": _quadratic("b = 2 D·(O − C), or t = (b − √disc) / 2a", b=lambda D, O, C: 2 * dot(D, C - O)),  # noqa: E741
    "c without − r²": _quadratic(CONSTANT, c=lambda O, C, r: dot(O - C, O - C) + 0 * r),  # noqa: E741
    "c with + r²": _quadratic(CONSTANT, c=lambda O, C, r: dot(O - C, O - C) + r**2),  # noqa: E741
    "r in place of r²": _quadratic(CONSTANT, c=lambda O, C, r: dot(O - C, O - C) - r),  # noqa: E741
    "2r in place of r²": _quadratic(CONSTANT, c=lambda O, C, r: dot(O - C, O - C) - 2 * r),  # noqa: E741
    "O not taken off: −C in place of O − C": _quadratic(
        f"b = 2 D·(O − C), {CONSTANT}",
        b=lambda D, O, C: 2 * dot(D, 0 * O - C),  # noqa: E741
        c=lambda O, C, r: dot(C, C) - r**2,  # noqa: E741
    ),
    "|C|² in place of |O − C|²": _quadratic(CONSTANT, c=lambda O, C, r: dot(C, C) - r**2),  # noqa: E741
    "C not taken off: O in place of O − C": _quadratic(
        f"b = 2 D·(O − C), {CONSTANT}",
        b=lambda D, O, C: 2 * dot(D, O - 0 * C),  # noqa: E741
        c=lambda O, C, r: dot(O, O) - r**2,  # noqa: E741
    ),
    "a taken as 1, with D not normalised": _quadratic("a = D·D, or D / |D| before", a=lambda D: dot(D, D) * 0 + 1),
    "no square root of the discriminant": _quadratic(ROOTS, (False, True), root=lambda under: under),
    "no square root of h² − ac": _quadratic("t = (−h ± √(h² − ac)) / a", (False, True), root=lambda under: under / 2),
    "the lights add nothing": Mistake({"matt": lambda d, i, c: 0 * d * i, "shiny": lambda s, i, x: 0 * s}, SHADING),
    # the picture
    "upside down": Mistake({"pixel": _upside_down}, "row 0 is the top one, V = (H − 2y) / H"),
    "V negated": Mistake({"screen": _v_negated}, "row 0 is the top one, V = (H − 2y) / H"),
    "left and right exchanged": Mistake({"pixel": _left_right}, "U = (2x − W) / H, u points to the right"),
    "U negated": Mistake({"screen": _u_negated}, "U = (2x − W) / H, u points to the right"),
    "one row too high": Mistake({"pixel": _moved(0, -1)}, "V = (H − 2y) / H: row 0 has V = 1"),
    "one row too low": Mistake({"pixel": _moved(0, 1)}, "V = (H − 2y) / H: row 0 has V = 1"),
    "one column too far left": Mistake({"pixel": _moved(-1, 0)}, "U = (2x − W) / H, from x = 0"),
    "one column too far right": Mistake({"pixel": _moved(1, 0)}, "U = (2x − W) / H, from x = 0"),
    "rays through the pixels' centres": Mistake({"shift": 0.5}, "rays go through a pixel's upper left corner"),
    "rays through the pixels' corners": Mistake({"shift": 0.0}, "rays go through a pixel's centre"),
    "U and V divided by W − 1 and H − 1": Mistake({"screen": _to_the_last_pixel}, "U = (2x − W) / H, V = (H − 2y) / H"),
    "field of view taken as horizontal": Mistake({"screen": _horizontal}, "fov is vertical: divide U and V by H"),
    "stretched to the picture's width": Mistake({"screen": _stretched}, "pixels are square: divide U by H too"),
    "red and blue exchanged": Mistake({"to_bytes": lambda C: to_bytes(C)[:, ::-1]}, "red, green, blue"),
    "gamma (sRGB) applied": Mistake({"to_bytes": _srgb}, "a byte is 255 · C, rounded, with no curve"),
    "gamma 1 / 2.2 applied": Mistake({"to_bytes": _gamma}, "a byte is 255 · C, rounded, with no curve"),
    "colours above 1 wrapped round": Mistake({"to_bytes": _wrapped}, "clip to 0…1 before a colour becomes a byte"),
    "colours cut off, not rounded: off by 1, which is allowed": Mistake(
        {"to_bytes": _cut_off}, "floor(255 · C + ½)", allowed=True
    ),
    # the ray
    "looks backwards, + d·w": Mistake({"ray": _backwards}, "U·u + V·v − d·w: w points backwards"),
    "eye not taken off the ray's direction": Mistake({"ray": _plus_eye}, "the direction is U·u + V·v − d·w alone"),
    "tan(fov) in place of tan(fov / 2)": Mistake({"focal": _whole_angle}, "d = 1 / tan(fov / 2)"),
    "tan(fov / 2) in place of 1 / tan(fov / 2)": Mistake({"focal": _not_inverted}, "d = 1 / tan(fov / 2)"),
    "fov in degrees given to tan": Mistake({"focal": _degrees}, "tan takes radians: π / 180 · fov"),
    "d = 1, whatever fov is": Mistake({"focal": _one}, "d = 1 / tan(fov / 2)"),
    "eye taken as 0 0 0": Mistake({"frame": _eye_at_zero}, "a ray starts at the eye of the file"),
    "uvw ignored": Mistake({"frame": _no_frame}, "the ray is U·u + V·v − d·w, with the file's vectors"),
    # the hit
    "far root taken": Mistake({"root": _far}, "the smaller root counts if it is above 0"),
    "hits from inside missed": Mistake(
        {"root": _only_near}, "if the smaller root is not above 0, the larger one may be"
    ),
    "roots behind the eye taken": Mistake({"root": _behind_too}, "a root counts only if t > 0"),
    "last shape of the file wins": Mistake({"seen": _last}, "of all hits the one with the smallest t is seen"),
    "first shape of the file wins": Mistake({"seen": _first}, "of all hits the one with the smallest t is seen"),
    "farthest shape wins": Mistake({"seen": _farthest}, "of all hits the one with the smallest t is seen"),
    # the normal
    "normals not normalised": Mistake({"ball": _times_r}, "N = (P − C) / r"),
    "triangles' normals not normalised": Mistake({"facet": _long_normal}, "N = n / |n|, n = (b − a) × (c − a)"),
    "normals inwards": Mistake({"ball": _inwards}, "N = (P − C) / r"),
    "normals from the origin": Mistake({"ball": _from_origin}, "N = (P − C) / r: take the centre off"),
    "triangles' normals not turned to the viewer": Mistake({"facet": _as_wound}, "−N where N·D > 0"),
    "triangles' normals against their corners' order": Mistake({"facet": _against_winding}, "−N where N·D > 0"),
    "triangles' normals turned away": Mistake({"facet": _away_from_viewer}, "−N where N·D > 0"),
    # the light
    "divided by the number of lights": Mistake({"share": _mean}, "what the lights add is added up"),
    "only the first light": Mistake({"lights": lambda lights: lights[:1]}, "what the lights add is added up"),
    "only the last light": Mistake({"lights": lambda lights: lights[-1:]}, "what the lights add is added up"),
    "negative N·L not clipped": Mistake({"cosine": lambda x: x}, "max(0, N·L), before it is added"),
    "|N·L| in place of max(0, N·L)": Mistake({"cosine": abs}, "a light behind a surface adds nothing"),
    "L not normalised": Mistake({"to_light": _long}, "L = (light − P) / |light − P|"),
    "L divided by |L|², not by |L|": Mistake({"to_light": _by_square}, "|v| = √(v·v): unit(v) = v / √(v·v)"),
    "L from the light": Mistake({"to_light": _from_light}, "L = (light − P) / |light − P|"),
    "P not taken off L": Mistake({"to_light": _position}, "L = (light − P) / |light − P|"),
    "diffuse + light · max(0, N·L)": Mistake({"matt": lambda d, i, c: d + i * c}, SHADING),
    "diffuse · light + max(0, N·L)": Mistake({"matt": lambda d, i, c: d * i + c}, SHADING),
    "diffuse + light + max(0, N·L)": Mistake({"matt": lambda d, i, c: d + i + c}, SHADING),
    "(diffuse + light) · max(0, N·L)": Mistake({"matt": lambda d, i, c: (d + i) * c}, SHADING),
    "N·L left out": Mistake({"matt": lambda d, i, c: d * i + 0 * c}, SHADING),
    "light's colour left out": Mistake({"matt": _faded, "shiny": lambda s, i, x: s * x}, SHADING),
    "diffuse colour left out": Mistake({"matt": lambda d, i, c: i * c + 0 * d}, SHADING),
    "ambient colour added": Mistake({"extra": lambda ambient: ambient}, "stage diffuse has no ambient term"),
    "background black": Mistake(
        {"background": _black, "beyond": _black}, "a ray that hits nothing brings the background"
    ),
    # all light
    "no ambient colour": Mistake({"ambient": lambda a, n: 0 * a}, "ambient + …"),
    "ambient colour once a light": Mistake({"ambient": lambda a, n: a * n}, "ambient, once"),
    "no shadows": Mistake({"blocks": _never}, "a light adds nothing where a shape stands between P and it"),
    "shadows of shapes beyond the light": Mistake({"blocks": _no_distance}, "only 0 < t < |light − P| blocks"),
    "shapes shadow themselves": Mistake(
        {"leaves": False}, "a ray does not meet the shape that it starts on: a small epsilon above 0", judge=_acne
    ),
    "no highlights": Mistake({"shiny": lambda s, i, x: 0 * s}, "specular · light · max(0, H·N)^power"),
    "R·V in place of H·N": Mistake({"spark": _mirrored_light}, "H = unit(L − D)"),
    "H from L + D": Mistake({"spark": _half_way_beyond}, "H = unit(L − D): to the viewer is −D"),
    "highlight not times the light": Mistake({"shiny": lambda s, i, x: s * x}, "specular · light · max(0, H·N)^power"),
    "no power": Mistake({"power": lambda x, p: np.maximum(0.0, x)}, "specular · light · max(0, H·N)^power"),
    "no reflections": Mistake({"reflections": 0}, "+ k_refl · C of the mirrored ray"),
    "only one reflection": Mistake({"reflections": 1}, "reflections follow each other, up to ten"),
    "k_refl left out": Mistake({"add": lambda c, r, k: c + r}, "+ k_refl · C of the mirrored ray"),
    "(1 − k_refl) of a shape's own light": Mistake(
        {"add": lambda c, r, k: (1 - k) * c + k * r}, "its own light in full, + k_refl · C of the mirrored ray"
    ),
    "mirrored ray reversed": Mistake({"mirror": _into_the_mirror}, "D − 2 (N·D) N"),
    "black where a mirrored ray hits nothing": Mistake({"beyond": _black}, "it brings the background"),
}


OF_THE_QUADRATIC = frozenset(name for name, mistake in MISTAKES.items() if "quadratic" in mistake.steps)
A_QUADRATIC = "something in the quadratic"  # what these are called where too many of them draw the same


def advice(cause: str) -> tuple[str, ...]:
    """What to do instead: a line for each mistake that a name `recognise` gives is of."""
    if cause == A_QUADRATIC:
        return (QUADRATIC,)
    return tuple(MISTAKES[name].instead for name in cause.split(", and ") if name in MISTAKES)


def recognise(
    picture: np.ndarray,
    scene: Scene,
    stage: str | Stage = "diffuse",
    sampling: str = "corner",
    *,
    expected: np.ndarray | None = None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[str, ...]:
    """The mistakes that explain what is wrong with a picture of a scene, names in `MISTAKES`, the best one first.

    Several are named where each would draw this picture, many of the quadratic as `A_QUADRATIC`; two that were made
    together are one name, with "and" between them. Nothing if the picture is right, or wrong only where float64 cannot
    tell what is hit; nor if no mistake is known, or the stage is not one that the guide's tracer draws (`LOOKS` in
    `raytracer.guide`). `expected` is the right picture, if it is there already; `cancelled()` is asked now and then.
    Raises ValueError for what is no picture, uint8 (height, width, 3).
    """
    end = perf_counter() + _SECONDS
    if stage not in LOOKS or len(scene) > MOST_SHAPES:
        return ()
    assert isinstance(stage, str)
    height, width = picture.shape[:2]
    right = render_scene(scene, stage, width, height, sampling=sampling) if expected is None else expected
    off = differences(picture, right)
    if not off.any() or not off[~undecided(scene, width, height, sampling)].any():  # or rounding alone is to blame
        return ()
    allowed = bool(np.count_nonzero(off > TOLERANCE) < _FEWEST)
    tolerance = 0 if allowed else TOLERANCE
    evidence = _gather(Guide(scene, stage, width, height, sampling), picture, right, off > tolerance, tolerance)
    names = [name for name, mistake in MISTAKES.items() if mistake.allowed == allowed]
    if evidence is None:
        return ()
    found, active = _singles(evidence, [name for name in names if not MISTAKES[name].alone], cancelled)
    if max(found.values(), default=0.0) < 1 or evidence.of_one_colour:
        alone, _ = _singles(evidence, [name for name in names if MISTAKES[name].alone], cancelled)
        found = {name: share for name in names if (share := found.get(name) or alone.get(name))}
    if not found and not allowed and np.ptp(picture.reshape(-1, 3), axis=0).any():
        found = _pairs(evidence, active, lambda: cancelled() or perf_counter() > end)
    return () if cancelled() else _best(found)


def _best(found: dict[str, float]) -> tuple[str, ...]:
    """Those that explain most; those of the quadratic under one name if there are many."""
    best = [name for name, share in found.items() if share == max(found.values())]
    if len(best) > _MOST_NAMED and len(OF_THE_QUADRATIC.intersection(best)) > 1:
        best = [A_QUADRATIC if name in OF_THE_QUADRATIC else name for name in best]
    return tuple(dict.fromkeys(best))


def _singles(
    evidence: _Evidence, names: list[str], cancelled: Callable[[], bool]
) -> tuple[dict[str, float], list[str]]:
    """How much each mistake explains, if nearly all; and those that change anything here."""
    found, active = {}, []
    for name in names:
        if cancelled():
            break
        mistake = MISTAKES[name]
        if mistake.judge is not None:
            share = mistake.judge(evidence)
        else:
            tried = [evidence.tried(steps) for steps in mistake.ways(evidence.guide.steps)]
            share = max(share for share, _ in tried)
            active += [name] if tried[0][1] else []
        if share:
            found[name] = share
    return found, active


def _pairs(evidence: _Evidence, names: list[str], cancelled: Callable[[], bool]) -> dict[str, float]:
    """The same for mistakes that were made together, about different steps."""
    found = {}
    for first, second in combinations(names, 2):
        a, b = MISTAKES[first], MISTAKES[second]
        if cancelled():
            break
        steps = b.done(a.done(evidence.guide.steps))
        apart = not a.steps.keys() & b.steps.keys()
        if apart and evidence.first.explained(steps) and (share := evidence.explained(steps)):
            found[f"{first}, and {second}"] = share
    return found


@dataclass(frozen=True, eq=False)
class _Evidence:
    """Some pixels of a picture, in columns x and rows y, and what they should be: arrays (n,) and, of bytes, (n, 3)."""

    guide: Guide
    x: Array
    y: Array
    found: Array
    right: Array  # as the guide's tracer draws it
    wrong: Array
    tolerance: int
    speckled: bool  # in the whole picture most wrong pixels have a right one beside them

    def __getitem__(self, which: Array) -> _Evidence:
        x, y, found, right, wrong = (array[which] for array in (self.x, self.y, self.found, self.right, self.wrong))
        return replace(self, x=x, y=y, found=found, right=right, wrong=wrong)

    @cached_property
    def first(self) -> _Evidence:
        """Enough to see that nearly all mistakes are others."""
        some = (np.flatnonzero(which)[:_AT_FIRST] for which in (self.wrong, ~self.wrong))
        return self[np.concatenate(list(some))]

    @property
    def of_one_colour(self) -> bool:
        """All that is wrong: it is black or missed, for which there are many causes."""
        return not np.ptp(self.found[self.wrong], axis=0).any()

    def drawn(self, steps: Steps) -> Array:
        """As the tracer of these steps draws them."""
        return self.guide.paint(steps, self.x, self.y)

    def explained(self, steps: Steps) -> float:
        """How much of what is wrong, or would be, is as the tracer of these steps draws it; 0 if not nearly all."""
        return self.share(steps, self.drawn(steps))

    def tried(self, steps: Steps) -> tuple[float, bool]:
        """`explained`, and whether these steps change anything; few pixels are enough if they tell that it is 0."""
        drawn = self.first.drawn(steps)
        return self.first.share(steps, drawn) and self.explained(steps), bool((drawn != self.first.right).any())

    def share(self, steps: Steps, drawn: Array) -> float:
        """`explained`, for pixels that are drawn already."""
        changed = _off(drawn, self.right)
        tells = self.guide.inside(steps, self.x, self.y) & (self.wrong | (changed > self.tolerance))
        return share_of(tells, (changed > 0) & (_off(drawn, self.found) <= self.tolerance))


def share_of(tells: Array, explained: Array) -> float:
    """How many of the pixels that tell are explained: 0…1; 0 if not nearly all, or too few to tell."""
    total, good = int(tells.sum()), int((tells & explained).sum())
    strays = total - good
    if good < _FEWEST or strays > (1 - _ALIKE) * total + _STRAYS or _STRAYS * _FEWEST * strays > total:
        return 0.0
    return good / total


def _off(a: Array, b: Array) -> Array:
    """By how much colours (n, 3) differ in their worst byte: (n,)."""
    off_by: Array = np.abs(a.astype(np.int16) - b).max(axis=1)
    return off_by


def _gather(
    guide: Guide, picture: np.ndarray, right: np.ndarray, wrong: np.ndarray, tolerance: int
) -> _Evidence | None:
    """Pixels of which some are wrong; None if the guide's tracer itself cannot draw most of these."""
    random = np.random.default_rng(1)
    some = [random.permutation(np.flatnonzero(which))[:_LOOKED_AT] for which in (wrong, ~wrong)]
    y, x = np.unravel_index(np.concatenate(some), wrong.shape)
    drawn = guide.paint(guide.steps, x, y)
    evidence = _Evidence(guide, x, y, picture[y, x], drawn, wrong[y, x], tolerance, _speckled(wrong))
    known = _off(drawn, right[y, x]) <= tolerance
    return evidence[known] if known[: len(some[0])].mean() >= _KNOWN else None


def _speckled(wrong: np.ndarray) -> bool:
    around = np.pad(wrong, 1, "edge")
    beside = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    return bool(2 * np.count_nonzero(wrong & beside) < np.count_nonzero(wrong))
