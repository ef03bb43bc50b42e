"""The guide's tracer, as one writes it in the course: ray by ray, in float64, nothing certain, each step a function.

The steps are the fields of `Steps`. Another function in one's place is another tracer, and `raytracer.mistakes` makes
all the usual mistakes of it. It traces single pixels of a picture, many at once, and every shape with each of them.

x, y, P, D, N, L are arrays with a row for each ray; vectors are (n, 3). D is of length 1, and t counts its lengths.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from raytracer.bounce import MOST_REFLECTIONS
from raytracer.camera import SAMPLINGS, focal_length
from raytracer.facets import normals_of
from raytracer.image import to_bytes
from raytracer.scene import Camera, Colour, Light, Scene
from raytracer.stages import STAGES

Array = np.ndarray
Place = tuple[Array, Array]

_ROUNDING = 1e-11  # of the lengths in a scene: a hit that is nearer than this to where a ray leaves a shape is no hit
_AT_A_TIME = 1 << 15  # tests of a ray against a shape, in the core's cache
_SLIVER = 1e-14


def same_pixel(x: Array, y: Array, width: int, height: int) -> Place:
    return x, y


def to_screen(x: Array, y: Array, width: int, height: int) -> Place:
    """U and V."""
    return (2 * x - width) / height, (height - 2 * y) / height


def eye_ray(camera: Camera, U: Array, V: Array, d: float) -> Array:
    """U·u + V·v − d·w"""
    u, v, w = np.array([camera.u, camera.v, camera.w])
    D: Array = U[:, None] * u + V[:, None] * v - d * w
    return D


def meet_balls(O: Array, D: Array, length: Array, centres: Array, radii: Array) -> Place:  # noqa: E741
    """Where rays meet spheres, by projecting the centre onto the ray: both roots, NaN for a miss, (n, m) each.

    `length` (n, 1) is that of the direction before it was made 1, for those who solve a t² + b t + c = 0 with it.
    """
    x, y, z = (centres[None, :, k] - O[:, k, None] for k in range(3))
    dx, dy, dz = (D[:, k, None] for k in range(3))
    along = x * dx + y * dy + z * dz
    x, y, z = x - along * dx, y - along * dy, z - along * dz
    half_chord = np.sqrt(radii**2 - (x * x + y * y + z * z))
    return along - half_chord, along + half_chord


def nearest_ahead(near: Array, far: Array, least: Array) -> Array:
    """The smaller root if it lies ahead, else the larger one; +inf if neither does."""
    return np.where(near > least, near, np.where(far > least, far, np.inf))


def nearest(t: Array) -> Array:
    """Which of the shapes (n, m), in the order of the file, is seen: (n,). Those that are missed have t = +inf."""
    first: Array = t.argmin(axis=1)
    return first


def ball_normal(P: Array, centre: Array, radius: Array) -> Array:
    N: Array = (P - centre) / radius[:, None]
    return N


def facet_normal(normal: Array, D: Array) -> Array:
    """Of length 1, and towards the viewer."""
    normal = unit(normal)
    return np.where(dot(normal, D)[:, None] > 0, -normal, normal)


def to_light(P: Array, light: Array) -> Array:
    return unit(light - P)


def lit_side(cosine: Array) -> Array:
    lit: Array = np.maximum(0.0, cosine)
    return lit


def matt(diffuse: Array, light: Array, cosine: Array) -> Array:
    back: Array = diffuse * light * cosine
    return back


def half_way(N: Array, L: Array, D: Array) -> Array:
    """H·N"""
    return dot(unit(L - D), N)


def power_of(spark: Array, power: Array) -> Array:
    shine: Array = np.maximum(0.0, spark) ** power
    return shine


def shiny(specular: Array, light: Array, spark: Array) -> Array:
    shine: Array = specular * light * spark
    return shine


def all_lights(lights: Sequence[Light]) -> Sequence[Light]:
    return lights


def as_it_is(total: Array, lights: int) -> Array:
    return total


def between(near: Array, far: Array, least: Array, distance: Array) -> Array:
    """Whether a root lies between the point and the light."""
    return ((near > least) & (near < distance)) | ((far > least) & (far < distance))


def mirrored(D: Array, N: Array) -> Array:
    mirrored: Array = D - 2 * dot(N, D)[:, None] * N
    return mirrored


def added(local: Array, reflected: Array, k: Array) -> Array:
    added: Array = local + k * reflected
    return added


def unchanged(colour: Colour) -> Colour:
    return colour


def no_ambient(ambient: Array) -> Array:
    return np.zeros_like(ambient)


def once(ambient: Array, lights: int) -> Array:
    return ambient


@dataclass(frozen=True)
class Steps:
    """What the guide says to do, in its order."""

    shift: float = 0.0  # where in a pixel its ray goes through: 0 the corner, ½ the centre
    pixel: Callable[[Array, Array, int, int], Place] = same_pixel
    screen: Callable[[Array, Array, int, int], Place] = to_screen
    focal: Callable[[float], float] = focal_length
    frame: Callable[[Camera], Camera] = lambda camera: camera
    ray: Callable[[Camera, Array, Array, float], Array] = eye_ray
    quadratic: Callable[[Array, Array, Array, Array, Array], Place] = meet_balls
    root: Callable[[Array, Array, Array], Array] = nearest_ahead
    seen: Callable[[Array], Array] = nearest
    ball: Callable[[Array, Array, Array], Array] = ball_normal
    facet: Callable[[Array, Array], Array] = facet_normal
    lights: Callable[[Sequence[Light]], Sequence[Light]] = all_lights
    to_light: Callable[[Array, Array], Array] = to_light
    cosine: Callable[[Array], Array] = lit_side
    matt: Callable[[Array, Array, Array], Array] = matt
    share: Callable[[Array, int], Array] = as_it_is
    extra: Callable[[Array], Array] = no_ambient  # what `diffuse` adds to the light of the lights
    ambient: Callable[[Array, int], Array] = once  # what `full` does
    spark: Callable[[Array, Array, Array], Array] = half_way
    power: Callable[[Array, Array], Array] = power_of
    shiny: Callable[[Array, Array, Array], Array] = shiny
    blocks: Callable[[Array, Array, Array, Array], Array] = between
    leaves: bool = True  # a ray knows which shape it leaves
    mirror: Callable[[Array, Array], Array] = mirrored
    add: Callable[[Array, Array, Array], Array] = added
    reflections: int = MOST_REFLECTIONS
    background: Callable[[Colour], Colour] = unchanged
    beyond: Callable[[Colour], Colour] = unchanged  # what a mirrored ray brings that hits nothing
    to_bytes: Callable[[Array], Array] = to_bytes


@dataclass(frozen=True, eq=False)
class Guide:
    """A scene at a stage in a picture's size; `paint` draws some of its pixels."""

    scene: Scene
    stage: str  # a name in `LOOKS`
    width: int
    height: int
    sampling: str = "corner"

    @property
    def steps(self) -> Steps:
        """All of them right."""
        return Steps(shift=SAMPLINGS[self.sampling] / 2)

    def inside(self, steps: Steps, x: Array, y: Array) -> Array:
        """Which pixels are drawn from within the picture: bool (n,). Nobody knows what is drawn where others are."""
        x, y = steps.pixel(x, y, self.width, self.height)
        return (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)

    @np.errstate(all="ignore")
    def paint(self, steps: Steps, x: Array, y: Array) -> Array:
        """The bytes of the pixels in columns x and rows y: uint8 (n, 3)."""
        many = max(1, _AT_A_TIME // max(1, len(self.scene)))
        pieces = [slice(start, start + many) for start in range(0, len(x), many)]
        colours = [self._colours(steps, x[piece], y[piece]) for piece in pieces]
        return steps.to_bytes(np.concatenate(colours) if colours else np.empty((0, 3)))

    def _colours(self, steps: Steps, x: Array, y: Array) -> Array:
        x, y = steps.pixel(x, y, self.width, self.height)
        U, V = steps.screen(x + steps.shift, y + steps.shift, self.width, self.height)
        camera = steps.frame(self.scene.camera)
        D = steps.ray(camera, U, V, steps.focal(camera.fov))
        _, elsewhere = STAGES[self.stage].flat(self.scene)
        O, own = np.array([camera.eye]), np.full(len(x), -1)  # noqa: E741 (the ray's origin)
        return self._along(steps, O, D, own, steps.background(elsewhere), steps.reflections)

    def _along(self, steps: Steps, O: Array, D: Array, own: Array, elsewhere: Colour, left: int) -> Array:  # noqa: E741
        """The colours that come along rays from O, on shapes `own` or on none, −1; `left` reflections may follow.

        D may be of any length here.
        """
        length, D = np.sqrt(dot(D, D))[:, None], unit(D)
        t, shape = self._hits(steps, O, D, length, own)
        colours, hit = np.empty((len(D), 3)), np.isfinite(t)
        colours[...] = elsewhere
        if hit.any():
            D, shape = D[hit], shape[hit]
            P = np.broadcast_to(O, (len(hit), 3))[hit] + t[hit, None] * D
            colours[hit] = LOOKS[self.stage](
                self, steps, _Arrival(P, D, self._normals(steps, P, D, shape), shape, left)
            )
        return colours

    def _hits(self, steps: Steps, O: Array, D: Array, length: Array, own: Array) -> Place:  # noqa: E741
        if not len(self.scene):
            return np.full(len(D), np.inf), np.full(len(D), -1)
        t = steps.root(*self._roots(steps, O, D, length, own))
        which = steps.seen(t)
        return t[np.arange(len(D)), which], which

    def _roots(
        self,
        steps: Steps,
        O: Array,  # noqa: E741
        D: Array,
        length: Array,
        own: Array,
    ) -> tuple[Array, Array, Array]:
        """Both roots of rays with all shapes, NaN where these are missed, and above what a root counts: (n, m)."""
        O = np.broadcast_to(O, D.shape) if own[:1].max(initial=-1) >= 0 else O  # noqa: E741
        near, far = (np.empty((len(D), len(self.scene))) for _ in range(2))
        balls = self.centres[~self.flat], self.radii[~self.flat]
        near[:, ~self.flat], far[:, ~self.flat] = steps.quadratic(O, D, length, *balls)
        if len(self.corners):
            near[:, self.flat] = far[:, self.flat] = _meet_facets(O, D, self.triangles)
        if own[:1].max(initial=-1) < 0 or not steps.leaves:
            return near, far, np.zeros((1, 1))
        rays, chord = np.arange(len(D)), -2 * dot(O - self.centres[own], D)
        near[rays, own] = far[rays, own] = np.where((chord > 0) & ~self.flat[own], chord, np.nan)
        return near, far, _ROUNDING * np.abs(O).max(axis=1, initial=1e-300)[:, None]

    def _normals(self, steps: Steps, P: Array, D: Array, shape: Array) -> Array:
        flat = self.flat[shape][:, None]
        ball = steps.ball(P, self.centres[shape], self.radii[shape])
        return np.where(flat, steps.facet(self.facets[shape], D), ball)

    def blocked(self, steps: Steps, P: Array, light: Array, shape: Array) -> Array:
        """Whether something hides a light from points on shapes: bool (n,)."""
        away = light - P
        distance = np.sqrt(dot(away, away))[:, None]
        roots = self._roots(steps, P, away / distance, np.ones((len(P), 1)), shape)
        blocked: Array = np.any(steps.blocks(*roots, distance), axis=1)
        return blocked

    def reflected(self, steps: Steps, at: _Arrival, which: Array) -> Array:
        D, beyond = steps.mirror(at.D[which], at.N[which]), steps.beyond(self.scene.background)
        return self._along(steps, at.P[which], D, at.shape[which], beyond, at.left - 1)

    @cached_property
    def flat(self) -> Array:
        """Which shapes are triangles, in the order of the file: bool (m,). So are all arrays below."""
        flat = np.zeros(len(self.scene), bool)
        flat[self.scene.triangles.order] = True
        return flat

    @cached_property
    def corners(self) -> Array:
        """Of the triangles alone: (k, 3, 3)."""
        return np.asarray(self.scene.triangles.vertices)

    @cached_property
    def triangles(self) -> _Facets:
        return _facets_of(self.corners)

    @cached_property
    def centres(self) -> Array:
        return self._of_shapes(self.scene.spheres.centres, np.zeros((len(self.corners), 3)))

    @cached_property
    def radii(self) -> Array:
        return self._of_shapes(self.scene.spheres.radii, np.ones(len(self.corners)))

    @cached_property
    def facets(self) -> Array:
        """Normals of the triangles, of no special length."""
        return self._of_shapes(np.zeros((len(self.scene.spheres), 3)), normals_of(self.corners))

    @cached_property
    def materials(self) -> Array:
        """As in `Materials.table`: (m, 11)."""
        rows = self._of_shapes(self.scene.spheres.material, self.scene.triangles.material)
        materials: Array = self.scene.materials.table[rows]
        return materials

    def _of_shapes(self, balls: Array, facets: Array) -> Array:
        """What is known of spheres and of triangles, in the order of the file."""
        rows = np.empty((len(self.flat), *balls.shape[1:]), balls.dtype)
        rows[~self.flat], rows[self.flat] = balls, facets
        return rows


@dataclass(frozen=True)
class _Arrival:
    """Where rays D arrive: points P on shapes, normals N; so many reflections may follow."""

    P: Array
    D: Array
    N: Array
    shape: Array
    left: int


def one_colour(guide: Guide, steps: Steps, at: _Arrival) -> Array:
    return np.broadcast_to(STAGES[guide.stage].flat(guide.scene)[0], at.P.shape)


def normal(guide: Guide, steps: Steps, at: _Arrival) -> Array:
    return (at.N + 1.0) / 2.0


def diffuse(guide: Guide, steps: Steps, at: _Arrival) -> Array:
    """Σ over lights of diffuse · light · max(0, N·L)"""
    material, lights = guide.materials[at.shape], steps.lights(guide.scene.lights)
    total = np.zeros_like(at.P)
    for light in lights:
        cosine = steps.cosine(dot(at.N, steps.to_light(at.P, np.array(light.position))))
        total += steps.matt(material[:, 0:3], np.array(light.colour), cosine[:, None])
    colours: Array = steps.extra(material[:, 3:6]) + steps.share(total, len(lights))
    return colours


def full(guide: Guide, steps: Steps, at: _Arrival) -> Array:
    """ambient + k_refl · C(mirrored) + Σ over unshadowed lights of light · (diffuse · max(0, N·L) + specular · …)"""
    material, lights = guide.materials[at.shape], steps.lights(guide.scene.lights)
    total: Array = np.zeros_like(at.P)
    for light in lights:
        place, colour = np.array(light.position), np.array(light.colour)
        L = steps.to_light(at.P, place)
        matt_part = steps.matt(material[:, 0:3], colour, steps.cosine(dot(at.N, L))[:, None])
        spark = steps.power(steps.spark(at.N, L, at.D), material[:, 9])[:, None]
        answer = matt_part + steps.shiny(material[:, 6:9], colour, spark)
        total += np.where(guide.blocked(steps, at.P, place, at.shape)[:, None], 0.0, answer)
    total = steps.ambient(material[:, 3:6], len(lights)) + steps.share(total, len(lights))
    mirror = material[:, 10] > 0
    if at.left > 0 and mirror.any():
        brought = guide.reflected(steps, at, mirror)
        total[mirror] = steps.add(total[mirror], brought, material[mirror, 10:11])
    return total


LOOKS = {"hit": one_colour, "outline": one_colour, "normal": normal, "diffuse": diffuse, "full": full}


def dot(a: Array, b: Array) -> Array:
    products: Array = np.einsum("...k,...k->...", a, b)
    return products


def unit(vectors: Array) -> Array:
    length = np.sqrt(dot(vectors, vectors))
    return vectors / np.where(length > 0, length, 1.0)[..., None]


class _Facets(NamedTuple):
    """Triangles (k, 3, 3) for rays from anywhere: what does not depend on the ray, arrays (k, 3)."""

    first: Array
    edge: Array
    other: Array
    normal: Array
    edge_moment: Array
    other_moment: Array


def _facets_of(corners: Array) -> _Facets:
    first, edge, other = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return _Facets(first, edge, other, np.cross(edge, other), np.cross(edge, first), np.cross(other, first))


def _meet_facets(O: Array, D: Array, facets: _Facets) -> Array:  # noqa: E741
    """Where rays meet triangles, edges included, by barycentric coordinates: (n, k). T. Möller, B. Trumbore, 1997."""
    first, edge, other, normal, edge_moment, other_moment = facets
    moment, over = np.cross(O, D), -1.0 / (D @ normal.T)
    u = (moment @ other.T - D @ other_moment.T) * over
    v = (D @ edge_moment.T - moment @ edge.T) * over
    t = (O @ normal.T - dot(first, normal)) * over
    return np.where((u >= -_SLIVER) & (v >= -_SLIVER) & (u + v <= 1 + _SLIVER), t, np.nan)
