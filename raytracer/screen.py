"""Eye rays at the machine's limit: `certified`, compiled.

Eye rays share their origin, so a sphere covers an ellipse on the screen, and only pixels in its box can hit it:

    sort        the box of each sphere, sixteen at a time, and the list of each tile that it reaches into
    paint       a tile at a time: a small depth buffer, then colours, while all of it is in the core's first cache

No tree, no ray objects, nothing normalised, and only one square root for a pixel and a sphere. A tile with nothing but
small spheres is painted in single precision (`quick`), with float64 for what that is not certain of. Pixels of which
float64 is not certain are listed, decided by `settle`, and painted anew.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from itertools import accumulate, pairwise
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided

from raytracer import plain
from raytracer.arrays import (
    APART,
    CORNERS,
    FACET,
    Bins,
    Candidates,
    Canvas,
    Desks,
    FineRays,
    FullPaints,
    Glance,
    Grid,
    HitRows,
    Hits,
    Mirrors,
    Paints,
    Piles,
    Quick,
    Records,
    Seen,
    Sides,
    Slow,
    Tiles,
    View,
    aligned,
)
from raytracer.boxes import Lens, make_lens
from raytracer.camera import Raster, columns_and_rows, fine_columns, fine_heights, grid_of
from raytracer.eye import bundle_of, usable_spread
from raytracer.facets import exact_volume
from raytracer.full import surfaces_of, terms_of
from raytracer.glance import make_glance
from raytracer.lookup import light_cells, reach_of, tree_of
from raytracer.mirrors import NO_MIRRORS, see_mirrors
from raytracer.plan import Plan
from raytracer.pool import Call, alone, cores, together
from raytracer.quick import make_quick, packed
from raytracer.scene import Camera, Colour, Light, Materials, Scene, Triangles
from raytracer.settle import Bundle, Index, Targets, known_in_integers, polish, settled
from raytracer.shading import to_byte
from raytracer.stages import light_from_eye

SPARE = 8  # elements at the end of arrays that are read eight at a time
_SPARE_RECORDS = 1 << 10  # beyond those of spheres that reach into one or two tiles
_SPARE = 32  # list entries beyond the last that a kernel may look at
_DOUBTS = 1 << 15  # pixels that a thread lists before they are decided
_WORTH_A_PART = 1 << 12  # spheres that are sorted sooner if another thread helps
_MOST_PARTS = 8  # of what is sorted: for each all tiles are counted anew
_BAND_PIXELS = 1 << 18  # of a numpy stage's block
_PIXELS_A_MOMENT, _SPHERES_A_MOMENT = 1 << 22, 1 << 17  # what is drawn in a few milliseconds
_WORTH_A_THREAD = 8  # a moment
_MOMENTS_A_PIECE = 4
_KEPT = 1 << 26  # bytes of a workspace that is kept
_WORKSPACES = 2  # that are kept, about

_NOT_A_NUMBER_IS_NO_ERROR = np.errstate(all="ignore")


class Workspace:
    """Arrays that outlive a picture: fresh memory costs more than drawing a small one."""

    def __init__(self) -> None:
        self._arrays: dict[str, np.ndarray] = {}
        self.nbytes = 0
        self.desks: Desks | None = None  # of the threads
        self.sorting: tuple[tuple[int, ...], Piles, Bins] | None = None  # room for that, and how many of what it is for

    def array(self, size: int, kind: type, name: str) -> np.ndarray:
        """An array of that size, with anything in it."""
        kept = self._arrays.get(name)
        if kept is None or len(kept) < size:
            self.nbytes -= 0 if kept is None else kept.nbytes
            kept = self._arrays[name] = aligned(size, kind)
            self.nbytes += kept.nbytes
        return kept[:size]

    def zeros(self, size: int, kind: type, name: str) -> np.ndarray:
        array = self.array(size, kind, name)
        array[:] = 0
        return array


_idle: list[Workspace] = []  # threads may take and put them at any time, as that is one step to a list


def _take_workspace() -> Workspace:
    try:
        return _idle.pop()
    except IndexError:
        return Workspace()


def _put_back(workspace: Workspace) -> None:
    if workspace.nbytes < _KEPT and len(_idle) < _WORKSPACES:
        _idle.append(workspace)


class Screen(NamedTuple):
    """A picture's spheres, sorted into the tiles of the screen."""

    raster: Raster
    unit: int  # lengths below are counted in 2**unit of the scene's
    origin: np.ndarray  # (3,)
    order: np.ndarray | None  # int32, the shapes' places in the file by their numbers; None if that is the same
    view: View
    slow: Slow
    bins: Bins
    facet_boxes: np.ndarray  # int32 (n, 4), where the triangles are
    targets: Targets
    workspace: Workspace
    threads: int
    desks: Desks  # at least one a thread

    def bands(self, shading: float = 0.0) -> list[slice]:
        """The picture's rows, cut into pieces that take a moment, some for each core, so that all end at one time."""
        pieces = max(4 * cores(), int(self.moments(shading)))
        return self._cut(min(self._rows // pieces, _BAND_PIXELS // (self.kernels.TILE_HEIGHT * self.raster.width)))

    def pieces(self, moments: float) -> list[slice]:
        """The same where all are at work on the same piece, which takes some moments: they wait for the slowest."""
        return self._cut(self._rows // max(1, int(moments / _MOMENTS_A_PIECE)))

    @property
    def _rows(self) -> int:
        """Of tiles."""
        return len(self.bins.middles) // self.bins.columns

    def _cut(self, rows: int) -> list[slice]:
        """The picture's rows, in pieces of so many rows of tiles, at least one."""
        height = self.raster.height
        starts = range(0, height, max(1, rows) * self.kernels.TILE_HEIGHT)
        return [slice(start, min(start + starts.step, height)) for start in starts]

    def workers(self, moments: float) -> int:
        """How many threads are to paint: to wake another takes longer than to do very little."""
        return min(self.threads, 1 + int(_WORTH_A_THREAD * moments))

    def moments(self, shading: float) -> float:
        """How long the picture will take, about, for two cores."""
        pixels = self.raster.height * self.raster.width
        moments = (1 + len(self.slow.ids) + shading / 8) * pixels / _PIXELS_A_MOMENT
        return moments + int(self.bins.starts[-1]) / _SPHERES_A_MOMENT

    def tiles_of(self, rows: slice, columns: slice = slice(None)) -> Tiles:
        """The tiles of some rows, which are cut between tiles; or those of the first row of tiles in some columns."""
        height, across = self.kernels.TILE_HEIGHT, self.bins.columns
        first, count = rows.start // height * across, -(-(rows.stop - rows.start) // height) * across
        start, stop, _ = columns.indices(count)
        return Tiles(np.zeros(APART * self.threads, np.int64), first + start, first + stop)

    def hits(self, rows: slice, worker: int = 0, polished: bool = False) -> Hits:
        """What the rays of these rows, cut between tiles, hit first: as `Eye.hits`."""
        shape = rows.stop - rows.start, self.raster.width
        hits = Hits(np.empty(shape), np.empty(shape, np.int32))
        hunt = self.hunt(hits, "fine" if polished else "rough", rows.start)
        hunt.find(rows, worker)
        hunt.decide(worker)
        hunt.polish()
        return self.in_scene(hits)

    @_NOT_A_NUMBER_IS_NO_ERROR
    def hunt(self, hits: Hits, kind: str, first_row: int = 0) -> Hunt:
        """Look for `hits` of rows from first_row on, in units, and with numbers of spheres.

        `kind` says what is wanted: "rough" is t good enough to be shaded, "fine" to the last digit; "shapes" is only
        the index.
        """
        flat = HitRows(hits.t.reshape(-1), hits.index.reshape(-1), first_row, self.raster.width, np.zeros(1, np.int64))
        if kind == "rough":
            return Hunt(self, flat, "find_hits", _NO_PAINTS)
        kernel = "find_shapes" if kind == "shapes" else "find_fine_hits"
        return Hunt(self, flat, kernel, _fine_rays(self.raster, self.unit))

    def room_for_hits(self, has_t: bool) -> Hits:
        """Flat arrays for the hits of all pixels, and some elements to spare; without t, that is empty."""
        size = self.raster.height * self.raster.width + SPARE
        t = self.workspace.array(size if has_t else 0, np.float64, "t")
        return Hits(t, self.workspace.array(size, np.int32, "hit"))

    def range_of(self, t: np.ndarray, index: np.ndarray) -> tuple[float, float]:
        """The smallest and the largest t of all hits."""
        near, far = self.kernels.range_of(t.reshape(-1), index.reshape(-1))
        return near, far

    @_NOT_A_NUMBER_IS_NO_ERROR
    def in_scene(self, hits: Hits) -> Hits:
        """t in the scene's unit of length, and places in the file in place of numbers of spheres."""
        t = np.ldexp(hits.t, self.unit) if self.unit else hits.t
        if self.order is None:
            return Hits(t, hits.index)
        return Hits(t, np.where(hits.index >= 0, self.order[hits.index], np.int32(-1)))

    @property
    def kernels(self) -> ModuleType:
        return self.targets.path

    def paint(
        self,
        painter: str,
        tiles: Tiles,
        paints: Paints | FullPaints | FineRays,
        out: Canvas | HitRows,
        worker: int = 0,
        call: Call = alone,
    ) -> Iterator[Pixels]:
        """Paint by a kernel what nobody has taken yet of some tiles; yields doubtful pixels when their list is full.

        What is left of them `doubtful` tells. It is called with `call`, worker 0 having others help.
        """
        kernel, workers = getattr(self.kernels, painter), [worker] if call is alone else range(self.threads)
        while not call(kernel, self.view, self.slow, self.bins, tiles, self.desks, worker, paints, out):
            yield from self.doubtful(*workers)

    def colours(self, kernel: str, pixels: Pixels, hits: Hits, paints: Paints | FullPaints, worker: int) -> np.ndarray:
        """The colours of some pixels that hit something: float64 (n, 3)."""
        count = len(pixels.xs)
        eights = [np.resize(array, -(-count // SPARE) * SPARE) for array in (*hits, pixels.xs, pixels.ys)]
        t, index, columns, rows = eights
        colours, pixel = np.empty((len(t), 3)), (columns.astype(np.int32), rows.astype(np.int32))
        getattr(self.kernels, kernel)(self.view, paints, t, index, *pixel, self.desks, worker, colours)
        return colours[:count]

    @property
    def is_crowded(self) -> bool:
        """Whether some worker has many doubtful pixels on the list, and may soon do nothing more."""
        return bool((self.desks.doubts[:, 0] > _DOUBTS // 4).any())

    def doubtful(self, *workers: int) -> Iterator[Pixels]:
        """The doubtful pixels that these workers have listed, all together, if there are any."""
        lists = [doubts for worker in workers if (doubts := self.desks.doubts[worker])[0]]
        if not lists:
            return
        pixels = np.concatenate([doubts[1 : 1 + doubts[0]] for doubts in lists])
        for doubts in lists:
            doubts[0] = 0
        ys, xs = np.divmod(pixels, self.raster.width)
        yield Pixels(self, xs, ys)


class Hunt(NamedTuple):
    """The hits of a screen, or of some of its rows, while a kernel looks for them."""

    screen: Screen
    out: HitRows
    kernel: str
    paints: Paints | FineRays

    @_NOT_A_NUMBER_IS_NO_ERROR
    def find(self, rows: slice, worker: int = 0, call: Call = alone) -> None:
        """Look for what these rows hit; what is left to do, `decide` does, and at the end `polish`."""
        tiles = self.screen.tiles_of(rows)
        for doubtful in self.screen.paint(self.kernel, tiles, self.paints, self.out, worker, call):
            doubtful.decide(self.out)

    @_NOT_A_NUMBER_IS_NO_ERROR
    def decide(self, *workers: int) -> None:
        """Decide what these workers have listed as doubtful."""
        for doubtful in self.screen.doubtful(*workers):
            doubtful.decide(self.out)

    @_NOT_A_NUMBER_IS_NO_ERROR
    def polish(self) -> None:
        """Bring to the last digit what kernels have left, once all rows are found: before, there may be anything."""
        out = self.out
        if out.is_left[0]:
            left = np.flatnonzero(np.isnan(out.t))
            some, (ys, xs) = Hits(out.t[left], out.index[left]), np.divmod(left, out.width)
            polish(some, (np.arange(len(left)),), Pixels(self.screen, xs, ys + out.first_row), self.screen.targets)
            out.t[left] = some.t


class Pixels(NamedTuple):
    """Some pixels of a screen, to be decided by the levels above float64."""

    screen: Screen
    xs: np.ndarray  # int64 (n,), their columns
    ys: np.ndarray

    @_NOT_A_NUMBER_IS_NO_ERROR
    def hits(self) -> Hits:
        """What they hit, certain."""
        return settled(self, (np.arange(len(self.xs)),), self.screen.targets)

    def decide(self, out: HitRows) -> None:
        """Put what they hit among other hits."""
        where, found = (self.ys - out.first_row) * out.width + self.xs, self.hits()
        out.index[where] = found.index
        if len(out.t):
            out.t[where] = found.t

    def bundle(self, which: Index) -> Bundle:
        screen = self.screen
        return bundle_of(screen.raster, screen.origin, self.xs[which], self.ys[which], screen.kernels)

    def candidates(self, which: Index) -> Candidates:
        screen = self.screen
        return Candidates(*screen.kernels.candidates(screen.slow, screen.bins, self.xs[which], self.ys[which]))


@contextmanager
def open_screen(scene: Scene, raster: Raster, kernels: ModuleType, threads: int | None = None) -> Iterator[Screen]:
    """Sort the scene's spheres into the tiles of the screen. It holds until the context ends."""
    workspace, threads = _take_workspace(), threads or cores()
    unit, origin, balls, corners = scene.in_units
    order, material = scene.numbered
    sight = _sight(raster)
    view, boxes = _view(sight, origin, balls, material), _NO_BOXES
    if len(corners):
        view, boxes = _with_facets(view, workspace, kernels, sight.lens, raster, origin, corners, scene.triangles)
    bins, slow_ids = _sort(workspace, kernels, sight, view, len(scene.spheres), boxes, threads)
    slow, sides = _slow(sight.lens, view, origin, balls, slow_ids) if len(slow_ids) else (_NONE_SLOW, Sides.unknown())
    targets, desks = Targets(balls, sides, kernels, corners, order), _desks(workspace, kernels, threads)
    places = order if len(corners) and len(balls) else None
    yield Screen(raster, unit, origin, places, view, slow, bins, boxes, targets, workspace, threads, desks)
    _put_back(workspace)


def make_paints(plan: Plan, screen: Screen) -> Paints:
    """What the plan's stage is painted with."""
    scene, (flat, background) = plan.scene, plan.stage.flat(plan.scene)
    colours = scene.materials.diffuse.reshape(-1)
    paints = _make_paints(plan.raster, plan.lights, screen.unit, scene.materials.diffuse_range, background, flat)
    return Paints(*paints, colours)


@lru_cache(maxsize=8)
def _make_paints(
    raster: Raster, lights: tuple[Light, ...], unit: int, diffuse: tuple[float, float], background: Colour, flat: Colour
) -> tuple[Quick, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """All but the colours."""
    behind, ahead = _bytes_of(background), _bytes_of(flat)
    quick = make_quick(raster, lights, unit, diffuse, tuple(behind.tolist()), tuple(ahead.tolist()))
    return quick, behind, _backdrop(background), ahead, _lights_from_eye(lights, raster.camera, unit)


def _bytes_of(colour: Colour) -> np.ndarray:
    """A colour from 0 to 255, to be cut off to whole numbers: float64 (3,)."""
    return np.asarray(to_byte(np.array(colour)))


def _backdrop(colour: Colour) -> np.ndarray:
    """See `Paints.backdrop`."""
    return np.full(16, packed(tuple(_bytes_of(colour).tolist())), np.int32)


def _lights_from_eye(lights: tuple[Light, ...], camera: Camera, unit: int) -> np.ndarray:
    """See `Paints.lights`."""
    rows = [(*light_from_eye(light, camera, unit), *light.colour) for light in lights]
    return np.array(rows, np.float64).reshape(-1, 6)


@_NOT_A_NUMBER_IS_NO_ERROR
def make_full_paints(plan: Plan, screen: Screen) -> FullPaints:
    """What the stage `full` is painted with."""
    scene, shapes = plan.scene, (plan.scene.spheres, plan.scene.triangles)
    terms = terms_of(scene, bool(plan.lights))
    lights = tuple(light.position for light in plan.lights) if terms.shadows else ()
    glass = _glass(scene, screen) if terms.mirrors else NO_MIRRORS
    return FullPaints(
        _bytes_of(scene.background), _backdrop(scene.background), scene.background,
        _lights_from_eye(plan.lights, scene.camera, screen.unit),
        surfaces_of(scene.materials).reshape(-1),
        *light_cells(*shapes, screen.unit, reach_of(*shapes, screen.unit, screen.view.eye), lights, screen.kernels),
        tree_of(*shapes, screen.unit, screen.kernels), glass,
        terms.bits, terms.specular, terms.shadows, terms.mirrors,
    )  # fmt: skip


def _glass(scene: Scene, screen: Screen) -> Mirrors:
    balls, corners, shown = screen.targets.balls, screen.targets.corners, screen.facet_boxes
    return see_mirrors(
        make_lens(screen.raster), screen.view.eye, balls, corners, scene.triangles, screen.unit, shown, screen.kernels
    )


def _fine_rays(raster: Raster, unit: int) -> FineRays:
    black = 0.0, 0.0, 0.0
    quick, *_ = _make_paints(raster, (), unit, (0.0, 0.0), black, black)
    return FineRays(quick, *_spare_rests(raster.of_any_camera))


@lru_cache(maxsize=8)
def _spare_rests(raster: Raster) -> tuple[np.ndarray, np.ndarray]:
    """The rests of U, with eight columns to spare, and of V."""
    (_, across), (_, up) = fine_columns(raster), fine_heights(raster)
    return np.append(across, np.zeros(SPARE)), up


_AXIS = 0.0, 0.0, 0.0
_NO_QUICK = Quick(
    False, _AXIS, _AXIS, _AXIS, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.empty(0, np.float32), 0.0, 0.0, 0.0, 1, 0, 0
)  # fmt: skip
_NO_PAINTS = Paints(
    _NO_QUICK, np.zeros(3), np.zeros(16, np.int32), np.zeros(3), np.empty((0, 6)), Materials().diffuse.reshape(-1)
)


_NO_SPHERES = np.empty(0)
_NO_BOXES = np.empty((0, 4), np.int32)
_NO_IDS = np.empty(0, np.int32)
_NONE_SLOW = Slow(np.empty(0, np.int32), _NO_BOXES, Seen(*[_NO_SPHERES] * len(Seen._fields)))


ALL = np.empty((0, 0), np.uint8)  # of a canvas is wanted


def make_canvas(picture: np.ndarray, first_row: int = 0, wanted: np.ndarray = ALL) -> Canvas | None:
    """The bytes of a picture (height, width, 3), or of its rows from one on; `wanted` as in `Canvas`.

    None if its pixels are not three or four bytes apart.
    """
    height, width, _ = picture.shape
    row, pixel, byte = picture.strides
    if byte != 1 or pixel not in (3, 4) or row < width * pixel:
        return None
    size = (height - 1) * row + (width - 1) * pixel + 3
    flat = picture.reshape(-1) if picture.flags.c_contiguous else as_strided(picture, (size,), (1,))
    return Canvas(flat, row, pixel, width if pixel == 3 else width - 1, first_row, wanted)


def _desks(workspace: Workspace, kernels: ModuleType, workers: int) -> Desks:
    """Desks for so many threads or more, without the doubts of an earlier picture."""
    desks = workspace.desks
    if desks is None or len(desks.memory) < workers:
        memory = workspace.zeros(workers * kernels.DESK, np.uint8, "desks").reshape(workers, -1)
        doubts = workspace.array(workers * _DOUBTS, np.int64, "doubts").reshape(workers, -1)
        desks = workspace.desks = Desks(memory, doubts)
    desks.doubts[:, 0] = 0
    return desks


class _Sight(NamedTuple):
    """What the camera and the picture's size alone decide."""

    lens: Lens
    glance: Glance
    rays: Grid  # with columns and rows to spare
    kappa: float  # see `plain.see`


@lru_cache(maxsize=8)
@_NOT_A_NUMBER_IS_NO_ERROR
def _sight(raster: Raster) -> _Sight:
    kappa, rays = usable_spread(raster), grid_of(raster, *_spare_columns_and_rows(raster.of_any_camera))
    return _Sight(make_lens(raster), make_glance(raster, kappa), rays, kappa)


def _view(sight: _Sight, origin: np.ndarray, balls: np.ndarray, material: np.ndarray) -> View:
    x, y, z = origin.tolist()
    return View(*sight.rays, sight.kappa, (x, y, z), balls.reshape(-1), material, _NO_SPHERES, _NO_SPHERES, len(balls))


@lru_cache(maxsize=8)
def _spare_columns_and_rows(raster: Raster) -> tuple[np.ndarray, np.ndarray]:
    """With eight columns and one row to spare."""
    across, up = columns_and_rows(raster)
    return np.append(across, np.full(SPARE, across[-1])), np.append(up, up[-1])


def _with_facets(
    view: View, workspace: Workspace, kernels: ModuleType, lens: Lens, raster: Raster, origin: np.ndarray,
    corners: np.ndarray, triangles: Triangles,
) -> tuple[View, np.ndarray]:  # fmt: skip
    """The view with triangles as well, and their boxes, int32 (n, 4): empty for those whose plane holds the eye."""
    count, back = len(corners), view.back
    table = workspace.array(len(view.balls) + 4 * count, np.float64, "table")
    facets = workspace.array(FACET * count, np.float64, "facets")
    away = workspace.array(CORNERS * count, np.float64, "corners")
    boxes = workspace.array(4 * count, np.int32, "facet boxes")
    table[: len(view.balls)] = view.balls
    frame, volumes = (view.u, view.v, (-back[0], -back[1], -back[2]), raster.camera.w), np.full(count, np.nan)
    while kernels.see_facets(
        lens, frame, view.reach, view.kappa, view.eye, corners, triangles.corner_numbers, volumes, facets,
        table[len(view.balls) :], away, boxes,
    ):  # fmt: skip
        for i in np.flatnonzero(np.isnan(volumes)):
            volumes[i] = exact_volume(origin, corners[i])
    table = table.view()
    table.flags.writeable = False  # to the kernels, arrays that can be written to are others
    return view._replace(balls=table, facets=facets, corners=away), boxes.reshape(-1, 4)


def _sort(
    workspace: Workspace,
    kernels: ModuleType,
    sight: _Sight,
    view: View,
    spheres: int,
    facet_boxes: np.ndarray,
    threads: int,
) -> tuple[Bins, np.ndarray]:
    """The lists of all tiles; and the slow spheres, which are in none."""
    columns = -(-(len(view.across) - SPARE) // kernels.TILE_WIDTH)
    rows = -(-(len(view.up) - 1) // kernels.TILE_HEIGHT)
    parts = min(threads, 1 + spheres // _WORTH_A_PART, _MOST_PARTS)
    key = parts, spheres, len(facet_boxes), columns, rows
    if workspace.sorting is None or workspace.sorting[0] != key:
        workspace.sorting = key, *_piles(workspace, *key)
    _, piles, bins = workspace.sorting
    call = together(parts)
    while not call(kernels.sort, sight.glance, sight.lens, view, facet_boxes.reshape(-1), piles, bins):
        workspace.sorting = key, *_piles(workspace, *key, (piles.found[:, 0] + kernels.SIXTEEN).tolist())
        _, piles, bins = workspace.sorting
    slow = zip(piles.cuts, piles.found[:parts, 1].tolist(), strict=False)
    return bins, np.concatenate([_NO_IDS, *(piles.slow[first : first + count] for first, count in slow if count)])


def _piles(
    workspace: Workspace, parts: int, spheres: int, facets: int, columns: int, rows: int, sizes: list[int] | None = None
) -> tuple[Piles, Bins]:
    """Room to sort, for so many records of each part."""
    array, tiles = workspace.array, columns * rows
    cuts = [spheres * part // parts // SPARE * SPARE for part in range(parts)] + [spheres]
    if sizes is None:
        sizes = [(last - first) * 9 // 8 + _SPARE_RECORDS for first, last in pairwise(cuts)]
        sizes += [2 * facets + _SPARE_RECORDS] if facets else []
    parts, rooms = len(sizes), [0, *accumulate(sizes)]
    piles = Piles(
        np.array(cuts), np.array(rooms),
        Records(*(array(rooms[-1], np.int32, f"records' {name}") for name in Records._fields)),
        array(spheres, np.int32, "slow"),
        array(64 * parts, np.int32, "boxes").reshape(parts, -1),
        array(2 * parts, np.int64, "found").reshape(parts, -1),
        array(parts * tiles, np.int64, "counts").reshape(parts, -1),
        array(4 * APART, np.int64, "progress"),
    )  # fmt: skip
    starts, middles = array(tiles + 1, np.int64, "starts"), array(tiles, np.int64, "middles")
    return piles, Bins(starts, array(rooms[-1] + _SPARE, np.uint64, "entries"), middles, columns)


@_NOT_A_NUMBER_IS_NO_ERROR
def _slow(lens: Lens, view: View, origin: np.ndarray, balls: np.ndarray, ids: np.ndarray) -> tuple[Slow, Sides]:
    """What has to be known of the slow spheres."""
    some = balls[ids]
    boxes, front = plain.bound(lens, origin, some)
    seen = plain.see(view, view.kappa, origin, some, front)
    seen, sides = known_in_integers(origin, some, seen)
    return Slow(ids, boxes, seen), sides._replace(which=ids[sides.which])
