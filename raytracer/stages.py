"""How a hit becomes a colour: the stages of the course's guide, and those one wants to see when a picture is wrong.

A stage is a function from a `Block`, the hits of some rows of the picture, to colours, an array (rows, width, 3) of
float64 in which 0 is black and 1 is full. To add one, write such a function and give it a row in `STAGES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from raytracer import shading
from raytracer.arrays import Hits
from raytracer.camera import Raster, Vectors, directions, directions_of, eye_grid
from raytracer.facets import planes_of
from raytracer.full import World
from raytracer.image import to_bytes
from raytracer.scene import Camera, Colour, Light, Scene, Vector

DUMMY = (0.8, 0.2, 0.3)
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_TOO_DARK = 0.1  # a background with no channel above this does not show black

Scale = tuple[tuple[float, Colour], ...]  # numbers, ascending, and the colours that stand for them


@dataclass(frozen=True)
class Block:
    """The hits of some pixels, and what can be asked about them. Computed when asked for, and once.

    The pixels are some rows of the picture or a list of them; `hits`, `truth` and `tests` are of their shape. What is
    said of hits (`points`, `normals`, `diffuse`) has a row for each pixel that is hit, in order: float64 (hits, 3).
    `paint` puts colours back where they belong. Lengths are in the scene's unit, normals and directions of length 1.
    """

    scene: Scene
    raster: Raster
    rows: slice | np.ndarray  # rows of the picture; or int (n,), the row of each pixel
    hits: Hits  # t and index, shape (rows, width) or (n,)
    lights: tuple[Light, ...] = ()  # those that can be seen at all
    columns: np.ndarray | None = None  # int (n,), the column of each pixel; None for whole rows
    whole: Whole | None = None  # the hits of the whole picture, for a stage that looks beyond its rows
    truth: Hits | None = None  # the true hits of these pixels, for a stage that judges the method
    tests: np.ndarray | None = None  # int32, how many spheres each pixel is tested against, for a stage that counts
    rays: Vectors | None = None  # the pixels' directions, where they are not the raster's own

    @cached_property
    def hit(self) -> np.ndarray:
        """Where anything is hit: bool, one a pixel. The arrays below have one row for each hit pixel, in order."""
        return self.hits.index >= 0

    @cached_property
    def _flat(self) -> np.ndarray:
        """Where a triangle is hit, not a sphere: bool (hits,)."""
        spheres, shape = self.scene.spheres.order, self.hits.index[self.hit]
        if not len(self.scene.triangles):
            return np.zeros(len(shape), bool)
        place = np.searchsorted(spheres, shape)
        flat: np.ndarray = np.append(spheres, -1)[place] != shape
        return flat

    @cached_property
    def _number(self) -> np.ndarray:
        """Which sphere is hit, or which triangle: int (hits,)."""
        scene = self.scene
        shape: np.ndarray = self.hits.index[self.hit]
        if not len(scene.triangles):
            return shape
        spheres, facets = (np.searchsorted(table.order, shape) for table in (scene.spheres, scene.triangles))
        numbers: np.ndarray = np.where(self._flat, facets, spheres)
        return numbers

    @cached_property
    def _directions(self) -> Vectors:
        if self.rays is not None:
            return self.rays
        grid = eye_grid(self.raster)
        if self.columns is None:
            assert isinstance(self.rows, slice)
            return directions(grid, self.rows)
        return directions_of(grid.axes, grid.across[self.columns], grid.up[self.rows])

    @cached_property
    def _unit(self) -> int:
        """Lengths are counted in 2**unit where their squares would be beyond float64."""
        return self.scene.in_units[0]

    @cached_property
    def _rows(self) -> np.ndarray:
        """What is hit, in units: a sphere's centre and radius, or a triangle's plane: (hits, 4)."""
        _, eye, balls, corners = self.scene.in_units
        if not self._flat.any():
            hit_balls: np.ndarray = balls[self._number]
            return hit_balls
        rows = np.empty((len(self._number), 4))
        rows[~self._flat] = balls[self._number[~self._flat]]
        rows[self._flat] = planes_of(eye, corners[self._number[self._flat]])
        return rows

    @cached_property
    def _t(self) -> np.ndarray:
        """t of the hits, in units: (hits,)."""
        t: np.ndarray = np.ldexp(self.hits.t[self.hit], -self._unit)
        return t

    @cached_property
    def _where(self) -> np.ndarray:
        """Which shape is hit, as `World` numbers them: (hits,)."""
        first = len(self.scene.spheres.balls)
        return np.where(self._flat, first + self._number, self._number).astype(np.int32)

    @cached_property
    def world(self) -> World:
        """All shapes and lights, for light that goes on from the hits."""
        places = [light_from_eye(light, self.scene.camera, self._unit) for light in self.lights]
        lights = tuple((place, light.colour) for place, light in zip(places, self.lights, strict=True))
        return World(self.scene, lights)

    @cached_property
    def arrivals(self) -> tuple[np.ndarray, shading.Three, np.ndarray]:
        """What `world` wants to know of the hits: t in its units, D, and the numbers of the shapes: arrays (hits,)."""
        x, y, z = (component[self.hit] for component in self._directions)
        return self._t, (x, y, z), self._where

    @cached_property
    def _landed(self) -> tuple[shading.Three, shading.Three, np.ndarray]:
        """P, from the eye to the hit points, and r·N, and r, in units: arrays (hits,)."""
        x, y, z = (component[self.hit] for component in self._directions)
        a, b, c, d = self._rows.T
        ex, ey, ez = self.scene.in_units[1]
        return shading.land_on_any(self._t, (x, y, z), (ex, ey, ez), (a, b, c, d), self._flat)

    @property
    def _from_eye(self) -> shading.Three:
        return self._landed[0]

    @cached_property
    def from_eye(self) -> np.ndarray:
        """From the eye to the hit point: (hits, 3). Keeps digits that the point itself may not have."""
        vectors: np.ndarray = np.ldexp(np.stack(self._from_eye, axis=-1), self._unit)
        return vectors

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals at the hit points, a sphere's outwards, a triangle's towards the eye: (hits, 3)."""
        _, normal, radius = self._landed
        normals: np.ndarray = np.stack(normal, axis=-1) / radius[:, None]
        return normals

    @cached_property
    def points(self) -> np.ndarray:
        """The hit points: (hits, 3)."""
        return self.scene.camera.eye + self.from_eye

    def to_light(self, light: Light) -> np.ndarray:
        """Unit vectors from the hit points to a light: (hits, 3); zero where the light is at the point itself."""
        return unit_vectors(np.subtract(light.position, self.scene.camera.eye) - self.from_eye)

    def cosine(self, light: Light) -> np.ndarray:
        """max(0, N·L) of a light: (hits,)."""
        place = light_from_eye(light, self.scene.camera, self._unit)
        nearer = max(0, int(np.frexp(np.abs(place).max())[1]) - LIGHT_RANGE)
        p = tuple(np.ldexp(x, -nearer) for x in self._from_eye) if nearer else self._from_eye
        x, y, z = np.ldexp(place, -nearer).tolist()
        _, normal, radius = self._landed
        facing, square = shading.towards(p, normal, (x, y, z))
        cosine: np.ndarray = shading.cosine(facing, square, radius)
        return cosine

    @cached_property
    def diffuse(self) -> np.ndarray:
        """Diffuse colours of what is hit: (hits, 3)."""
        return self.scene.materials.table[self.scene.numbered[1][self._where], 0:3]

    def paint(
        self, colours: np.ndarray | tuple[float, float, float], elsewhere: tuple[float, float, float]
    ) -> np.ndarray:
        """Colours (hits, 3), or one for all, where something is hit, and one colour elsewhere: (pixels, 3).

        What is not a number, since it lies beyond float64, is black.
        """
        picture = np.empty((*self.hit.shape, 3))
        picture[...] = elsewhere
        picture[self.hit] = np.where(np.isnan(colours), 0.0, colours)
        return picture


LIGHT_RANGE = 333  # a power of two: a light farther away than this, in units, is brought nearer, on the same line


def light_from_eye(light: Light, camera: Camera, unit: int) -> Vector:
    """Where a light is as seen from the eye, in units of 2**unit."""
    place, eye = light.position, camera.eye
    if unit:
        place, eye = np.ldexp(place, -unit).tolist(), np.ldexp(eye, -unit).tolist()
    return place[0] - eye[0], place[1] - eye[1], place[2] - eye[2]


@dataclass(frozen=True)
class Whole:
    """What is known of the whole picture."""

    hits: Hits | None
    tests: np.ndarray | None = None  # int32 (height, width), how many spheres each pixel is tested against
    reach: tuple[float, float] | None = None  # `range`, where it is known already, of a larger picture

    @cached_property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest t of all hits."""
        if self.reach is not None:
            return self.reach
        assert self.hits is not None
        t = self.hits.t[self.hits.index >= 0]
        return (float(t.min()), float(t.max())) if t.size else (1.0, 1.0)


def hit(block: Block) -> np.ndarray:
    """One dummy colour wherever anything is hit."""
    return block.paint(*dummy_and_background(block.scene))


def dummy_and_background(scene: Scene) -> tuple[Colour, Colour]:
    return DUMMY, scene.background


def outline(block: Block) -> np.ndarray:
    """Black wherever anything is hit; a background that is too dark for that to be seen gives way to white."""
    return block.paint(*black_and_background(block.scene))


def black_and_background(scene: Scene) -> tuple[Colour, Colour]:
    return BLACK, WHITE if max(scene.background) <= _TOO_DARK else scene.background


def diffuse(block: Block) -> np.ndarray:
    """C = Σ over lights of diffuse · light · max(0, N·L)"""
    total = np.zeros_like(block.diffuse)
    for light in block.lights:
        total += np.multiply.outer(block.cosine(light), light.colour)
    return block.paint(total * block.diffuse, elsewhere=block.scene.background)


def full(block: Block) -> np.ndarray:
    """C = ambient + k_refl · C of the mirrored ray + Σ over unshadowed lights of light · (diffuse · max(0, N·L) +
    specular · max(0, H·N)^power)"""
    return block.paint(block.world.radiance(*block.arrivals), elsewhere=block.scene.background)


def normal(block: Block) -> np.ndarray:
    """Each component of N from −1…1 to 0…1."""
    return block.paint((block.normals + 1.0) / 2.0, elsewhere=BLACK)


def depth(block: Block) -> np.ndarray:
    """Linear in 1 / t, so that a near object and a far horizon both show; t counts along the view's axis."""
    assert block.whole is not None
    near, far = block.whole.range
    grey = shading.grey_of(block.hits.t[block.hit], near, far)
    return block.paint(grey[:, None], elsewhere=BLACK)


def edges(block: Block) -> np.ndarray:
    """A pixel is on an edge when the pixel right of it or the one below shows another shape."""
    assert block.whole is not None
    assert block.whole.hits is not None
    assert isinstance(block.rows, slice)
    index = block.whole.hits.index[block.rows.start : block.rows.stop + 1]
    edge = np.zeros(index.shape, bool)
    edge[:, :-1] |= index[:, 1:] != index[:, :-1]
    edge[:-1] |= index[1:] != index[:-1]
    return np.where(edge[: len(block.hits.index), :, None], BLACK, WHITE)


def error(block: Block) -> np.ndarray:
    """Where the method is wrong against exact arithmetic, and by how much where it is not."""
    assert block.truth is not None
    found, true = block.hits, block.truth
    hit, truly_hit = found.index >= 0, true.index >= 0
    with np.errstate(all="ignore"):
        ulps = np.abs(found.t - true.t) / np.spacing(true.t)
    picture = on_scale(np.where(hit & truly_hit & np.isfinite(ulps), ulps, 0.0), ULPS)
    picture[~hit & ~truly_hit] = NOTHING
    picture[hit & truly_hit & (found.index != true.index)] = WRONG_SHAPE
    picture[hit & ~truly_hit] = FALSE_HIT
    picture[~hit & truly_hit] = FALSE_MISS
    return picture


def wrong_pixels(picture: np.ndarray) -> int:
    """How many pixels of a picture (height, width, 3) at stage `error` have a colour that says wrong."""
    colours = to_bytes(np.array([WRONG_SHAPE, FALSE_HIT, FALSE_MISS]))
    same = ([picture[..., k] == byte for k, byte in enumerate(colour)] for colour in colours)
    return sum(int(np.logical_and.reduce(bands).sum()) for bands in same)


def cost(block: Block) -> np.ndarray:
    """How many shapes each pixel is tested against: those in whose boxes it lies."""
    assert block.tests is not None
    return on_scale(block.tests, TESTS)


def on_scale(values: np.ndarray, scale: Scale) -> np.ndarray:
    """Colours for numbers, logarithmic between those of the scale."""
    logarithms, stops = (np.log2(np.maximum(x, 0.5)) for x in (values, [stop for stop, _ in scale]))
    return np.stack([np.interp(logarithms, stops, [colour[k] for _, colour in scale]) for k in range(3)], axis=-1)


NOTHING = (0.13, 0.13, 0.15)
WRONG_SHAPE, FALSE_HIT, FALSE_MISS = (1.0, 0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 0.55, 0.0)
ULPS: Scale = (
    (0.0, (0.0, 0.12, 0.25)),
    (1.0, (0.0, 0.25, 0.5)),
    (2.0**10, (0.1, 0.6, 0.55)),
    (2.0**26, (0.55, 0.85, 0.3)),
    (2.0**52, (1.0, 1.0, 0.85)),
)
ERROR_LEGEND = (
    (WRONG_SHAPE, "wrong shape"),
    (FALSE_HIT, "hit, should miss"),
    (FALSE_MISS, "miss, should hit"),
    (ULPS[0][1], "t exact to the last digit"),
    *(
        (colour, f"t off by {ulps:.0f} ulp" if ulps < 2**10 else f"t off by 2^{int(np.log2(ulps))} ulp")
        for ulps, colour in ULPS[1:]
    ),
    (NOTHING, "nothing there, rightly"),
)
TESTS: Scale = (
    (0, (0.0, 0.0, 0.0)),
    (1, (0.15, 0.1, 0.4)),
    (4, (0.5, 0.1, 0.5)),
    (16, (0.85, 0.25, 0.3)),
    (64, (1.0, 0.6, 0.15)),
    (256, (1.0, 1.0, 0.7)),
)
TESTS_LEGEND = (
    (TESTS[0][1], "no test"),
    *((colour, f"{tests} test{'' if tests == 1 else 's'}") for tests, colour in TESTS[1:-1]),
    (TESTS[-1][1], f"{TESTS[-1][0]} tests or more"),
)


def background(scene: Scene) -> tuple[Colour, Colour]:
    """The one colour of hits, where a kernel paints them alike, and that of the rest."""
    return BLACK, scene.background


def black(scene: Scene) -> tuple[Colour, Colour]:
    return BLACK, BLACK


@dataclass(frozen=True)
class Stage:
    """One row of `STAGES`: its key in the window, its function from a `Block` to colours, and what it needs.

    The function returns float64 (rows, width, 3), 0 for black and 1 for full. What it does not ask for
    (`needs_normals`, `needs_lights`, …) is not computed.
    """

    key: str  # in the window
    colours: Callable[[Block], np.ndarray]
    about: str
    needs_hits: bool = True
    needs_normals: bool = False
    needs_lights: bool = False
    throws_on: bool = False  # follows light beyond the eye ray's hit: towards the lights, and off mirrors
    needs_whole: bool = False  # looks at the hits of other rows than its own
    needs_range: bool = False  # but of those only at the range of t
    needs_next_row: bool = False  # or only at the row below
    needs_truth: bool = False  # compares the method's hits with the true ones
    needs_tests: bool = False  # counts how many spheres a pixel is tested against
    legend: tuple[tuple[tuple[float, float, float], str], ...] = ()  # what its colours mean
    painter: str = ""  # a kernel that paints the same bytes, of tiles or, if it needs them, of the whole picture's hits
    colours_of: str = ""  # a kernel that works out the colours of single hits
    flat: Callable[[Scene], tuple[Colour, Colour]] = background  # what it paints: the one colour of hits, the rest


STAGES = {
    "hit": Stage(
        "h", hit, "a dummy colour wherever anything is hit", painter="paint_flat", flat=dummy_and_background
    ),
    "outline": Stage(
        "o", outline, "black wherever anything is hit, to check the outlines", painter="paint_flat",
        flat=black_and_background,
    ),
    "diffuse": Stage(
        "d", diffuse, "the light that a matt surface throws back", needs_normals=True, needs_lights=True,
        painter="paint_diffuse", colours_of="diffuse_of",
    ),
    "full": Stage(
        "f", full, "all light: ambient, diffuse, specular, with shadows and mirrors", needs_normals=True,
        needs_lights=True, throws_on=True, painter="paint_full", colours_of="radiance_of",
    ),
    "normal": Stage(
        "n", normal, "the normal (x, y, z) as red, green, blue: −1 is 0, 1 is full", needs_normals=True,
        painter="paint_normal", flat=black,
    ),
    "depth": Stage(
        "z", depth, "near is white, far is grey, nothing is black", needs_whole=True, needs_range=True,
        painter="paint_depth", flat=black,
    ),
    "edges": Stage(
        "e", edges, "the borders between different shapes", needs_whole=True, needs_next_row=True,
        painter="paint_edges", flat=black,
    ),
    "cost": Stage(
        "k", cost, "how many shapes each pixel is tested against", needs_hits=False, needs_tests=True,
        legend=TESTS_LEGEND,
    ),
    "error": Stage(
        "x", error, "where the method is wrong, against exact arithmetic", needs_truth=True, legend=ERROR_LEGEND
    ),
}  # fmt: skip


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product = a * b
    dot: np.ndarray = product[:, 0] + product[:, 1] + product[:, 2]
    return dot


def unit_vectors(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) brought to length 1, however long they are; the zero vector stays."""
    largest = np.abs(vectors).max(axis=1, initial=0.0)
    scaled = vectors / np.where(largest > 0, largest, 1.0)[:, None]
    length = np.sqrt(_dot(scaled, scaled))
    return scaled / np.where(length > 0, length, 1.0)[:, None]
