"""How a hit becomes a colour: the stages of the course's guide, and those one wants to see when a picture is wrong.

A stage is a function from a `Block`, the hits of some rows of the picture, to colours, an array (rows, width, 3) of
float64 in which 0 is black and 1 is full. To add one, write such a function and give it a row in `STAGES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from raytracer.arrays import Hits
from raytracer.camera import Raster, directions, eye_grid
from raytracer.scene import Light, Scene

DUMMY = (0.8, 0.2, 0.3)
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_TOO_DARK = 0.1  # a background with no channel above this does not show black
_FARTHEST_GREY = 0.15


@dataclass(frozen=True)
class Block:
    """The hits of some rows of the picture, and what can be asked about them. Computed when asked for, and once."""

    scene: Scene
    raster: Raster
    rows: slice
    hits: Hits  # of these rows: t and index, shape (rows, width)
    lights: tuple[Light, ...] = ()  # those that can be seen at all
    whole: Whole | None = None  # the hits of the whole picture, for a stage that looks beyond its rows
    truth: Hits | None = None  # the true hits of these rows, for a stage that judges the method

    @cached_property
    def hit(self) -> np.ndarray:
        """Where anything is hit: bool (rows, width). The arrays below have one row for each such pixel, in order."""
        return self.hits.index >= 0

    @cached_property
    def _sphere(self) -> np.ndarray:
        """Which sphere is hit: int (hits,)."""
        shape = self.hits.index[self.hit]
        return np.searchsorted(self.scene.spheres.order, shape) if len(self.scene.triangles) else shape

    @cached_property
    def from_eye(self) -> np.ndarray:
        """From the eye to the hit point: (hits, 3). Keeps digits that the point itself may not have."""
        rays = directions(eye_grid(self.raster, self.rows))
        t = self.hits.t[self.hit]
        return np.stack([t * component[self.hit] for component in rays], axis=1)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals at the hit points, outwards: (hits, 3)."""
        spheres = self.scene.spheres
        from_centre = (self.scene.camera.eye - spheres.centres[self._sphere]) + self.from_eye
        return from_centre / spheres.radii[self._sphere][:, None]

    @cached_property
    def points(self) -> np.ndarray:
        """The hit points: (hits, 3)."""
        return self.scene.camera.eye + self.from_eye

    def to_light(self, light: Light) -> np.ndarray:
        """Unit vectors from the hit points to a light: (hits, 3); zero where the light is at the point itself."""
        return _unit(np.subtract(light.position, self.scene.camera.eye) - self.from_eye)

    @cached_property
    def diffuse(self) -> np.ndarray:
        """Diffuse colours of what is hit: (hits, 3)."""
        return self.scene.materials.table[self.scene.spheres.material[self._sphere], 0:3]

    def paint(
        self, colours: np.ndarray | tuple[float, float, float], elsewhere: tuple[float, float, float]
    ) -> np.ndarray:
        """Colours (hits, 3), or one for all, where something is hit, and one colour elsewhere: (rows, width, 3)."""
        picture = np.empty((*self.hit.shape, 3))
        picture[...] = elsewhere
        picture[self.hit] = colours
        return picture


@dataclass(frozen=True)
class Whole:
    """The hits of the whole picture."""

    hits: Hits

    @cached_property
    def range(self) -> tuple[float, float]:
        """The smallest and the largest t of all hits."""
        t = self.hits.t[self.hits.index >= 0]
        return (float(t.min()), float(t.max())) if t.size else (1.0, 1.0)


def hit(block: Block) -> np.ndarray:
    """One dummy colour wherever anything is hit."""
    return block.paint(DUMMY, elsewhere=block.scene.background)


def outline(block: Block) -> np.ndarray:
    """Black wherever anything is hit; a background that is too dark for that to be seen gives way to white."""
    dark = max(block.scene.background) <= _TOO_DARK
    return block.paint(BLACK, elsewhere=WHITE if dark else block.scene.background)


def diffuse(block: Block) -> np.ndarray:
    """C = Σ over lights of diffuse · light · max(0, N·L)"""
    colours = np.zeros_like(block.diffuse)
    for light in block.lights:
        cosine = np.maximum(0.0, _dot(block.normals, block.to_light(light)))
        colours += block.diffuse * light.colour * cosine[:, None]
    return block.paint(colours, elsewhere=block.scene.background)


def normal(block: Block) -> np.ndarray:
    """Each component of N from −1…1 to 0…1."""
    return block.paint((block.normals + 1.0) / 2.0, elsewhere=BLACK)


def depth(block: Block) -> np.ndarray:
    """Linear in 1 / t, so that a near object and a far horizon both show; t counts along the view's axis."""
    assert block.whole is not None
    near, far = block.whole.range
    t = block.hits.t[block.hit]
    nearness = (near / t - near / far) / (1 - near / far) if near < far else np.ones_like(t)
    grey = _FARTHEST_GREY + (1 - _FARTHEST_GREY) * nearness
    return block.paint(grey[:, None], elsewhere=BLACK)


def edges(block: Block) -> np.ndarray:
    """A pixel is on an edge when the pixel right of it or the one below shows another shape."""
    assert block.whole is not None
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
    picture = _on_scale(np.where(hit & truly_hit & np.isfinite(ulps), ulps, 0.0))
    picture[~hit & ~truly_hit] = NOTHING
    picture[hit & truly_hit & (found.index != true.index)] = WRONG_SHAPE
    picture[hit & ~truly_hit] = FALSE_HIT
    picture[~hit & truly_hit] = FALSE_MISS
    return picture


def _on_scale(ulps: np.ndarray) -> np.ndarray:
    """Colours for errors, from ULPS."""
    bits = np.log2(np.maximum(ulps, 0.5))
    stops = np.log2([max(ulp, 0.5) for ulp, _ in ULPS])
    return np.stack([np.interp(bits, stops, [colour[k] for _, colour in ULPS]) for k in range(3)], axis=-1)


NOTHING = (0.13, 0.13, 0.15)
WRONG_SHAPE, FALSE_HIT, FALSE_MISS = (1.0, 0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 0.55, 0.0)
ULPS = (
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


@dataclass(frozen=True)
class Stage:
    """One row of `STAGES`."""

    key: str  # in the window
    colours: Callable[[Block], np.ndarray]
    about: str
    needs_normals: bool = False
    needs_lights: bool = False
    needs_whole: bool = False  # looks at the hits of other rows than its own
    needs_truth: bool = False  # compares the method's hits with the true ones
    legend: tuple[tuple[tuple[float, float, float], str], ...] = ()  # what its colours mean


STAGES = {
    "hit": Stage("h", hit, "a dummy colour wherever anything is hit"),
    "outline": Stage("o", outline, "black wherever anything is hit, to check the outlines"),
    "diffuse": Stage("d", diffuse, "the light that a matt surface throws back", needs_normals=True, needs_lights=True),
    "normal": Stage("n", normal, "the normal (x, y, z) as red, green, blue: −1 is 0, 1 is full", needs_normals=True),
    "depth": Stage("z", depth, "near is white, far is grey, nothing is black", needs_whole=True),
    "edges": Stage("e", edges, "the borders between different shapes", needs_whole=True),
    "error": Stage(
        "x", error, "where the method is wrong, against exact arithmetic", needs_truth=True, legend=ERROR_LEGEND
    ),
}


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    product = a * b
    return product[:, 0] + product[:, 1] + product[:, 2]


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) brought to length 1, however long they are; the zero vector stays."""
    largest = np.abs(vectors).max(axis=1, initial=0.0)
    scaled = vectors / np.where(largest > 0, largest, 1.0)[:, None]
    length = np.sqrt(_dot(scaled, scaled))
    return scaled / np.where(length > 0, length, 1.0)[:, None]
