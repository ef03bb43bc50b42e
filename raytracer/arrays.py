"""The arrays that travel between the parts of the tracer: all of it that a kernel ever sees.

Structures of arrays, as NamedTuples because the compiler takes those apart by itself. All numbers are float64 and all
arrays of one structure have one shape, unless a comment says otherwise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_CACHE_LINE = 64  # bytes


def aligned(size: int, kind: type) -> np.ndarray:
    """A fresh array (size,), with anything in it, that begins where a line of the processor's cache does."""
    count = size * np.dtype(kind).itemsize
    raw = np.empty(count + _CACHE_LINE, np.uint8)
    start = -raw.ctypes.data % _CACHE_LINE
    return raw[start : start + count].view(kind)


class Hits(NamedTuple):
    """What rays hit first; whoever needs the point, the normal or the material computes it, once, from these two.

    * `t`: float64, +inf for a miss; the hit is at origin + t · direction, in multiples of the direction's length
    * `index`: int32 of the same shape, the shape's place among all shapes of the file, or of those given; −1 for a miss
    """

    t: np.ndarray  # the hit is at origin + t · direction; +inf for a miss
    index: np.ndarray  # type: ignore[assignment]  # int32, the shape's place among all shapes of the file; −1 for a miss


class Rays(NamedTuple):
    """Directions in float64, with what the error bounds want to know of them.

    Each component of the true direction is within 5u·reach of the one given (u = 2⁻⁵³), for eye rays; the directions
    of rays given in float64 are the true ones. For both, reach ≥ |D|.
    """

    x: np.ndarray  # float64, as all
    y: np.ndarray
    z: np.ndarray
    square: np.ndarray  # D·D
    reach: np.ndarray


_Axis = tuple[float, float, float]


class Grid(NamedTuple):
    """The rays of a picture, D = across·u + up·v − back, in factors; D·D = (a2·across + a1)·across + a0."""

    across: np.ndarray  # float64 (width,), U of each column
    up: np.ndarray  # float64 (rows,), V of each row
    a1: np.ndarray  # float64 (rows,)
    a0: np.ndarray  # float64 (rows,)
    a2: float
    u: tuple[float, float, float]
    v: tuple[float, float, float]
    back: tuple[float, float, float]  # d·w
    reach: float  # at least the reach of each ray of the picture

    @property
    def axes(self) -> tuple[_Axis, _Axis, _Axis]:
        """u, v and d·w."""
        return self.u, self.v, self.back


class TwofoldRays(NamedTuple):
    """Directions in two-fold float64: each component of the true one is within 2⁻¹⁰²·reach of high + low."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    x_low: np.ndarray
    y_low: np.ndarray
    z_low: np.ndarray
    reach: np.ndarray


# The directions of rays for a usual method, in its own precision: x, y, z; and, where it takes them, their low parts.
UsualRays = tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]


class Candidates(NamedTuple):
    """Which spheres a ray may meet at all: of ray k, those numbered ids[starts[k] : starts[k + 1]], ascending."""

    starts: np.ndarray  # int64 (n + 1,)
    ids: np.ndarray  # int32

    @classmethod
    def all(cls, rays: int, spheres: int) -> Candidates:
        """Every ray, every sphere."""
        ids = np.tile(np.arange(spheres, dtype=np.int32), rays)
        return cls(np.arange(rays + 1, dtype=np.int64) * spheres, ids)

    def and_all(self, first: int, count: int) -> Candidates:
        """These, and for every ray so many shapes from a number on that comes after all of these."""
        parts = np.split(self.ids, self.starts[1:-1])
        more = np.arange(first, first + count, dtype=np.int32)
        ids = np.concatenate([part for ours in parts for part in (ours, more)])
        return Candidates(self.starts + count * np.arange(len(self.starts)), ids)

    def rows(self, which: np.ndarray) -> np.ndarray:
        """The number of the ray for each id of these rays, in order, counted from 0."""
        return np.repeat(np.arange(len(which)), np.diff(self.starts)[which])

    def only(self, these: np.ndarray) -> Candidates:
        """Some of the candidates, bool (ids,), of all rays."""
        counts = np.concatenate([[0], np.cumsum(these)])
        return Candidates(counts[self.starts], self.ids[these])

    def of(self, which: np.ndarray) -> Candidates:
        """The candidates of some of the rays."""
        counts = np.diff(self.starts)[which]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        shift = np.repeat(self.starts[which] - starts[:-1], counts)
        return Candidates(starts, self.ids[np.arange(starts[-1]) + shift])


class Sides(NamedTuple):
    """What is known of c = L·L − r² from integers, for some spheres, seen from where all rays start."""

    which: np.ndarray  # int32 (n,), numbers of spheres, ascending
    c: np.ndarray
    c_low: np.ndarray
    c_error: np.ndarray  # 0 where c is exactly 0: the origin lies on the sphere

    @staticmethod
    def unknown() -> Sides:
        return _UNKNOWN


_UNKNOWN = Sides(np.empty(0, np.int32), np.empty(0), np.empty(0), np.empty(0))


class Seen(NamedTuple):
    """Spheres as seen from one origin: arrays of shape (spheres,)."""

    x: np.ndarray  # L = origin − centre, rounded once
    y: np.ndarray
    z: np.ndarray
    hu: np.ndarray  # L·u, L·v and −L·back: D·L = across·hu + up·hv + hw
    hv: np.ndarray
    hw: np.ndarray
    c: np.ndarray  # L·L − r²
    c_error: np.ndarray  # a bound of c's error; 0 where c is exactly 0
    size: np.ndarray  # √(L·L + r²)
    radius: np.ndarray
    edge: np.ndarray  # see `certified.edge_of`; 0 if `certified.approach` is not for this sphere


class Facets(NamedTuple):
    """Triangles as seen from one origin: see `facets`. A ray D = across·u + up·v − back."""

    rows: np.ndarray  # (n, 12): e₁, e₂, e₃ and n·D, what each is of across, of up, and besides
    distance: np.ndarray  # (n,), n·a in the unit in which the rows have n·D; 0 where nothing is known
    planes: np.ndarray  # (n, 4): the unit normal that faces the origin, and the corners' product with it
    faces: np.ndarray  # bool (n,): whether the origin is beside the plane


class Balls(NamedTuple):
    """Spheres as a usual method sees them, in its own precision."""

    centres: np.ndarray  # (s, 3)
    radii: np.ndarray  # (s,)


class First(NamedTuple):
    """The first sphere that each eye ray meets so far; filled in place."""

    k: np.ndarray  # a·t, relative error at most `certified.K_ERROR`; +inf for none
    index: np.ndarray  # type: ignore[assignment]  # int32, among the spheres
    unsure: np.ndarray  # bool: the next level has to decide

    @classmethod
    def nothing_yet(cls, shape: tuple[int, ...]) -> First:
        return cls(np.full(shape, np.inf), np.full(shape, -1, np.int32), np.zeros(shape, bool))


class Nearest(NamedTuple):
    """The nearest hit of each ray so far; filled in place."""

    t: np.ndarray
    error: np.ndarray  # a bound of t's error
    index: np.ndarray  # type: ignore[assignment]  # int32, among the spheres
    unsure: np.ndarray  # bool: the next level has to decide

    @classmethod
    def nothing_yet(cls, shape: tuple[int, ...]) -> Nearest:
        return cls(np.full(shape, np.inf), np.zeros(shape), np.full(shape, -1, np.int32), np.zeros(shape, bool))


class Tree(NamedTuple):
    """A tree of boxes about spheres: see `kernels.bvh`."""

    ids: np.ndarray  # int32 (n rounded up to eights,), the spheres in the tree's order; −1 in what is to spare
    spheres: np.ndarray  # float64, flat: their x, then their y, z, radii; NaN in what is to spare
    low: np.ndarray  # float64, flat: the x of all boxes' low corners, then their y, z; some to spare at a level's end
    high: np.ndarray  # float64, likewise
    levels: np.ndarray  # int64, where each level begins
    counts: np.ndarray  # int64, how many boxes it has
    depth: int  # how many levels there are


# ------------------------------------------------------------------------------------ what `raytracer.screen` shares


APART = 16  # int64 from what one thread counts to what another does
BOARD = 4 * APART + 1024  # int64 of what threads tell each other: see `kernels.waiting`
BELL = 0  # where on the board: a number that is another one when those who linger are to come back
ASKED = 1  # whether a kernel has been called that may offer seats, and has not yet
SEATS = APART  # how many seats are open
TAKEN = APART + 1  # whether somebody has written work on the board
FACET = 24  # numbers a triangle, of which some are to spare
CELL_BITS = 7  # a cell of `Cells` is at most 2**7 pixels wide and high
CORNERS = 12  # numbers a triangle at the stage `full`: its corners, how far away they are, and some to spare


class View(NamedTuple):
    """A picture's rays and its shapes, for the kernels; there are eight columns and one row to spare."""

    across: np.ndarray  # the fields of Grid
    up: np.ndarray
    a1: np.ndarray
    a0: np.ndarray
    a2: float
    u: tuple[float, float, float]
    v: tuple[float, float, float]
    back: tuple[float, float, float]
    reach: float
    kappa: float  # see `plain.see`
    eye: tuple[float, float, float]
    balls: np.ndarray  # float64, flat: x, y, z, radius of each sphere, then `Facets.planes`
    material: np.ndarray  # int32: of each of those rows, a row of `Paints.colours`
    facets: np.ndarray  # float64, flat: FACET numbers a triangle, see `screen`
    corners: np.ndarray  # float64, flat: see `full.corners_of`
    first_facet: int  # the number of the first triangle


class Slow(NamedTuple):
    """The spheres that `certified.approach` is not for."""

    ids: np.ndarray  # int32 (n,)
    boxes: np.ndarray  # int32 (n, 4)
    seen: Seen


class Glance(NamedTuple):
    """What has to be known of a picture to find where small spheres are on it: see `glance`. All float32."""

    usable: bool
    u: tuple[np.float32, np.float32, np.float32]  # the camera's axes
    v: tuple[np.float32, np.float32, np.float32]
    w: tuple[np.float32, np.float32, np.float32]
    focus: np.float32  # the focal length in pixels
    middle_x: np.float32  # the column of the ray (0, 0, −1)
    middle_y: np.float32  # and the row
    pad: np.float32  # pixels that a place is off, by m²
    slack: np.float32  # and on top of that
    width: np.float32
    height: np.float32


class Records(NamedTuple):
    """Which shapes reach into which tiles, as a thread has found them."""

    tiles: np.ndarray  # int32 (n,): the tile
    corners: np.ndarray  # int32: bottom | top | right | left of the shape's box within the tile, a byte each
    shapes: np.ndarray  # int32


class Piles(NamedTuple):
    """What is written on while shapes are sorted into tiles, in parts: some of spheres, and the triangles if any."""

    cuts: np.ndarray  # int64 (parts of spheres + 1,), the first sphere of each, multiples of 8; how many there are
    rooms: np.ndarray  # int64 (parts + 1,), where the records of each part begin
    records: Records
    slow: np.ndarray  # int32 (spheres,), which are slow: from `cuts` on, of each part
    boxes: np.ndarray  # int32 (parts, 64)
    found: np.ndarray  # int64 (parts, 2): how many records there are, or would be, and how many slow spheres
    counts: np.ndarray  # int64 (parts, tiles)
    progress: np.ndarray  # int64, of the threads: see `kernels.sorting`


class Bins(NamedTuple):
    """Which of the other spheres reach into which tile.

    An entry of a list:                   bottom | top | right | left   of its box within the tile, a byte each
                                          sphere                        in the lower half
    """

    starts: np.ndarray  # int64 (tiles + 1,)
    entries: np.ndarray  # uint64: the list of tile i is entries[starts[i] : starts[i + 1]]; some more to spare
    middles: np.ndarray  # int64 (tiles,), where in its list the triangles begin
    columns: int  # tiles side by side


class Tile(NamedTuple):
    """A rectangle of pixels."""

    number: int
    left: int
    top: int
    right: int  # excluded
    bottom: int


class Tiles(NamedTuple):
    """Tiles that some threads are to paint, each the next that nobody has taken.

    Each thread has a run of its own, and when that is done, it helps with the ends of others: at one time they write to
    places far from each other, and at the next picture to the same ones again, which their core may still hold.
    """

    taken: np.ndarray  # int64 (runs · APART,): of each run, how many have been taken, from its front, and from its end
    first: int
    last: int  # excluded


class Desks(NamedTuple):
    """What threads work with, a row each."""

    memory: np.ndarray  # uint8 (threads, DESK), for a `Scratch` each: see `kernels.desks`
    doubts: np.ndarray  # int64 (threads, n): how many doubtful pixels follow; each as row · width + column


class Scratch(NamedTuple):
    """What a thread writes on while it does a tile."""

    k: np.ndarray  # float64 (rows · STRIDE,)
    index: np.ndarray  # type: ignore[assignment]  # int32
    doubt: np.ndarray  # bool
    batch: np.ndarray  # float64 (64,)
    stack: np.ndarray  # int64 (STACK,), boxes of a tree
    near: np.ndarray  # float64 (STACK,), where rays enter them
    rest: np.ndarray  # uint8 (32,)
    quick: QuickScratch


class QuickScratch(NamedTuple):
    """What `kernels.quick` writes on while it does a tile, in strips of 4 pixels, row by row of each strip."""

    depth: np.ndarray  # float32 (pixels,), k of the nearest hit so far
    colour: np.ndarray  # int32 (pixels,), red in the lowest byte: in the memory of the depth, once that is done with
    number: np.ndarray  # int32 (pixels,): which of the tile's list that is, counted from 1, 0 for none
    doubt: np.ndarray  # int32 (pixels / 16,): a byte for each row of a strip, and in that a bit a pixel
    table: np.ndarray  # float32, flat: eight numbers for each of the tile's list, for shading; the first row is free
    batch: np.ndarray  # float32, flat: what is computed of eight spheres at once, for drawing
    numbers: np.ndarray  # float32, flat: see `kernels.alike`
    blocks: np.ndarray  # int32, the first pixel of blocks that show anything: first those of one sphere, then others
    firsts: np.ndarray  # int32, which sphere that is
    mixed: np.ndarray  # int32, the others
    columns: np.ndarray  # float32 (8 · 32,), the columns of the table for the pixels of two blocks
    close: np.ndarray  # int32, which pairs of `blocks` have pixels close to another byte
    bits: np.ndarray  # int32, a bit for each of those
    late: np.ndarray  # int64 (1,), how many pixels are to be shaded in float64
    late_columns: np.ndarray  # int32: those; and at the end, some that `kernels.doubts` has decided
    late_rows: np.ndarray  # int32
    spheres: np.ndarray  # int32, what they show
    slopes: np.ndarray  # float64, flat: hu, its rest, hv, its rest of each of the list, see `fine`; the first is free
    sides: np.ndarray  # float64, flat: hw, its rest, c, its rest
    ids: np.ndarray  # int32, the numbers of those spheres; the first is −1


class Quick(NamedTuple):
    """What has to be known of a picture to draw it in single precision: see `quick`."""

    usable: bool
    u: tuple[float, float, float]  # the camera's axes
    v: tuple[float, float, float]
    w: tuple[float, float, float]
    focus: float  # the focal length in pixels
    middle_x: float  # the column of the ray (0, 0, −1)
    middle_y: float  # and the row
    height: float  # of the whole picture
    back: float  # the focal length by half of that
    steep: float  # s of `quick`, at most
    widest: float  # m for which that is so
    lights: np.ndarray  # float32, flat, eight each: place in the camera's axes, half the colour, strength, 5u · how far
    weight: float  # the sum of those
    far: float  # what the error of a light's place adds where it is near
    rounding: float  # what roundings add
    parts: int  # of a pixel, in which places of spheres are whole numbers
    background: int  # bytes: red, green, blue from the lowest on
    flat: int


class Paints(NamedTuple):
    """What a picture is painted with."""

    quick: Quick
    background: np.ndarray  # float64 (3,), from 0 to 255
    backdrop: np.ndarray  # int32 (16,): its bytes as one number, red the lowest, sixteen times
    flat: np.ndarray  # float64 (3,), likewise: the one colour of a stage that has but one
    lights: np.ndarray  # float64 (n, 6): the place as seen from the eye, the colour
    colours: np.ndarray  # float64, flat: red, green, blue, 0 of each material


class Cells(NamedTuple):
    """The cells of some screens, each with the list of the shapes that it may show: see `kernels.cells`."""

    starts: np.ndarray  # int64: where the list of each cell begins, of all screens, row by row
    entries: np.ndarray  # int32, flat: the lists, of shapes and their boxes within the cell
    columns: int  # cells side by side
    per_screen: int  # cells


class Mirrors(NamedTuple):
    """What plane mirrors show: see `mirrors`."""

    of: np.ndarray  # int32: the number of the plane of each row of `View.balls`, −1 for none; empty without planes
    cells: Cells  # the picture's screen, once for each plane
    shift: int  # a cell is 2**shift pixels wide and high


class FullPaints(NamedTuple):
    """What the stage `full` is painted with."""

    background: np.ndarray  # float64 (3,), from 0 to 255
    backdrop: np.ndarray  # int32 (16,): its bytes as one number, red the lowest, sixteen times
    behind: tuple[float, float, float]  # the background's colour
    lights: np.ndarray  # float64 (n, 6): the place as seen from the eye, the colour
    surfaces: np.ndarray  # float64, flat: see `full.surfaces_of`
    cells: Cells  # the six faces of the cube about each light, and its walls: see `lookup`
    beyond: np.ndarray  # int32, flat: for each light and row of `View.balls`, not 0 where walls may shade it
    tree: Tree  # over all shapes
    glass: Mirrors  # where to look for what plane mirrors show
    bits: int  # see `full.Terms`
    specular: bool
    shadows: bool
    mirrors: bool


class FineRays(NamedTuple):
    """What the directions of a picture need for twice the digits: see `fine`."""

    quick: Quick
    across_low: np.ndarray  # the rest of U, eight elements to spare
    up_low: np.ndarray  # the rest of V


class Canvas(NamedTuple):
    """A picture's bytes."""

    bytes: np.ndarray  # uint8, flat
    row_bytes: int  # from a row to the next
    pixel_bytes: int  # 3 or 4
    columns: int  # how many pixels of a row may be written to all of their bytes
    first_row: int  # of the picture, that `bytes` begin with
    wanted: np.ndarray  # uint8 (rows, eights): which eight pixels of a row are painted at all; (0, 0) for all


class HitRows(NamedTuple):
    """Hits of some rows of a picture, flat."""

    t: np.ndarray  # (0,) where only the index is wanted
    index: np.ndarray  # type: ignore[assignment]
    first_row: int
    width: int
    is_left: np.ndarray  # int64 (1,): 1 once some t may be no number, as its last digit is not certain
