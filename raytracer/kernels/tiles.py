"""Tiles to pixels: what a tile's depth buffer holds becomes colours, or hits, or nothing but a background.

    boxes, lists ─ see_tile ─> k, index ─ a painter ─> bytes of a picture, or t and index of hits (`kernels.hits`)
                └─ paint_quickly, for tiles of small spheres ─> the same (see `kernels.quick`, `kernels.hits`)

A painter does one tile, a row at a time, eight pixels at a time. Doubtful pixels are listed, and painted all the same:
then `kernels.doubts` decides most of spheres, and whoever called the rest, and they are painted anew.
"""

import numpy as np

from raytracer.arrays import APART, Tile
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import borrowing, called, inlined, variant
from raytracer.kernels.desks import desk_of
from raytracer.kernels.doubts import decide_diffuse, decide_flat, decide_hits, leave_doubts
from raytracer.kernels.full import radiance
from raytracer.kernels.hits import (
    fine_hits_quickly,
    fine_hits_tile,
    hits_tile,
    no_hits_tile,
    shapes_quickly,
    shapes_tile,
)
from raytracer.kernels.lanes import (
    ALIKE,
    WIDTH,
    align_stack,
    any_of,
    is_hit,
    largest_of,
    load,
    put_alike,
    put_pixels,
    spread,
    take_number,
)
from raytracer.kernels.quick import (
    FEW_LATE,
    diffuse_quickly,
    diffuse_quickly_unchecked,
    flat_quickly,
    never_quickly,
    nothing_left,
    shade_anew,
)
from raytracer.kernels.strips import fetch_row, put_pixel, start_of
from raytracer.kernels.surfaces import diffuse_of_any, diffuse_of_spheres, line_of, normal, ray_of
from raytracer.kernels.visibility import list_doubts, place_of, see_tile, see_tile_unchecked
from raytracer.kernels.waiting import offering, wait_for_help
from raytracer.shading import to_byte
from raytracer.twofold import select

_ROWS_AHEAD = 6  # that the processor fetches, where it does nothing but to write
# For doubts: those of a tile, then of pixels that have been put off until then, and at the end of those of that tile.
ROOM = 3 * TILE_WIDTH * TILE_HEIGHT + FEW_LATE


def _paint(board, seats, view, slow, bins, tiles, desks, worker, paints, out):
    """Paint tiles, as long as there are any and there is room for doubts; others may help: see `offering`.

    Returns whether the caller still has room, so that all tiles are done, or taken.
    """
    helped = offer(board, seats, (view, slow, bins, tiles, desks, paints, out))
    has_room = work(view, slow, bins, tiles, desks, paints, out, worker)
    if helped:
        wait_for_help(board)
    return has_room


def _work(view, slow, bins, tiles, desks, paints, out, worker):
    """What each thread does for that, its number being that of its row of the desks."""
    align_stack()
    scratch, doubts = desk_of(desks.memory, worker), desks.doubts[worker]
    number = _take(tiles, worker) if _has_room(doubts) else -1
    while number >= 0:
        tile = _tile(view, bins, number)
        if len(slow.ids) == 0 and bins.starts[number] == bins.starts[number + 1]:
            fill_tile(scratch, tile, paints, out)
        elif not paint_quickly(view, slow, bins, tile, scratch, doubts, paints, out):
            if see(view, slow, bins, tile, scratch):
                list_doubts(view, tile, scratch, doubts)
            paint_tile(view, scratch, tile, paints, out)
        full = not _has_room(doubts)
        if full or scratch.quick.late[0] > FEW_LATE:
            finish(view, paints, scratch, doubts, out)
        if full:
            decide(view, slow, bins, paints, scratch, doubts, out)
        number = _take(tiles, worker) if _has_room(doubts) else -1
    finish(view, paints, scratch, doubts, out)
    decide(view, slow, bins, paints, scratch, doubts, out)
    return _has_room(doubts)


@inlined
def _has_room(doubts):
    return len(doubts) - doubts[0] > ROOM


@called
def _take(tiles, worker):
    """The number of a tile that nobody has taken, −1 if there is none."""
    runs = len(tiles.taken) // APART
    length = (tiles.last - tiles.first + runs - 1) // runs
    for turn in range(runs):
        run = (worker + turn) % runs
        start, taken = tiles.first + run * length, np.uint64(run * APART)
        end = min(start + length, tiles.last)
        if start + take_number(tiles.taken, taken) < end:
            if turn == 0:
                return start + take_number(tiles.taken, taken + np.uint64(1))
            return end - 1 - take_number(tiles.taken, taken + np.uint64(2))
    return -1


@inlined
def _tile(view, bins, number):
    left, top = number % bins.columns * TILE_WIDTH, number // bins.columns * TILE_HEIGHT
    width, height = len(view.across) - WIDTH, len(view.up) - 1
    return Tile(number, left, top, min(left + TILE_WIDTH, width), min(top + TILE_HEIGHT, height))


@inlined
def put_lanes(out, row, x, right, red, green, blue, scratch):
    """Eight pixels from x on, or as many as there are before `right`."""
    start = start_of(out, row, x)
    if x + WIDTH <= right and x + WIDTH <= out.columns:
        put_pixels(out.bytes, start, np.uint64(out.pixel_bytes), red, green, blue)
    else:
        put_pixels(scratch.rest, np.uint64(0), np.uint64(3), red, green, blue)
        for pixel in range(right - x):
            for colour in range(3):
                out.bytes[start + np.uint64(pixel * out.pixel_bytes + colour)] = scratch.rest[3 * pixel + colour]


@inlined
def _background(paints):
    """Taken out of the loops by hand: for all the compiler knows, to paint changes it."""
    return spread(paints.background[0]), spread(paints.background[1]), spread(paints.background[2])


@called
def _fill_tile(scratch, tile, paints, out):
    """The background."""
    step, right = np.uint64(out.pixel_bytes), min(tile.right, out.columns)
    for row in range(tile.top, tile.bottom):
        fetch_row(tile, row + _ROWS_AHEAD, out)
        start, x = start_of(out, row, tile.left), tile.left
        while x + ALIKE <= right:
            put_alike(out.bytes, start, step, paints.backdrop)
            x, start = x + ALIKE, start + np.uint64(ALIKE) * step
        for _ in range(x, tile.right):
            put_pixel(out, start, paints.backdrop[0])
            start += step


@called
def _flat_tile(view, scratch, tile, paints, out):
    """One colour wherever anything is hit."""
    background, flat = _background(paints), paints.flat
    colour = spread(flat[0]), spread(flat[1]), spread(flat[2])
    for row in range(tile.top, tile.bottom):
        for x in range(tile.left, tile.right, WIDTH):
            hit = is_hit(load(scratch.index, place_of(tile, row, x)))
            red, green, blue = _over(background, hit, *colour)
            put_lanes(out, row, x, tile.right, red, green, blue, scratch)


def _shaded_tile(view, scratch, tile, paints, out):
    background, some = _background(paints), len(out.wanted) > 0
    for row in range(tile.top, tile.bottom):
        line = line_of(view, row)
        for x in range(tile.left, tile.right, WIDTH):
            if some and not out.wanted[row - out.first_row, x // WIDTH]:
                continue
            place = place_of(tile, row, x)
            index = load(scratch.index, place)
            hit = is_hit(index)
            if not any_of(hit):
                put_lanes(out, row, x, tile.right, *background, scratch)
                continue
            where = select(hit, index, spread(largest_of(index)))
            red, green, blue = shade(view, paints, line, load(scratch.k, place), row, x, where, hit, scratch)
            red, green, blue = _over(background, hit, to_byte(red), to_byte(green), to_byte(blue))
            put_lanes(out, row, x, tile.right, red, green, blue, scratch)


@inlined
def _full(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.full`."""
    t, direction = ray_of(view, line, k, x)
    return radiance(view, paints, t, direction, where, hit, x, row, scratch)


@inlined
def _over(background, hit, red, green, blue):
    """The background where nothing is hit."""
    return select(hit, red, background[0]), select(hit, green, background[1]), select(hit, blue, background[2])


_diffuse_tile = variant(_shaded_tile, "_diffuse_tile", shade=diffuse_of_spheres)
_diffuse_any_tile = variant(_shaded_tile, "_diffuse_any_tile", shade=diffuse_of_any)
_normal_tile = variant(_shaded_tile, "_normal_tile", shade=normal)
_full_tile = variant(_shaded_tile, "_full_tile", shade=_full)


def _painter(
    name, paint_tile, fill_tile=_fill_tile, see=see_tile, paint_quickly=never_quickly, finish=nothing_left,
    decide=leave_doubts,
):  # fmt: skip
    work = variant(
        _work, f"{name}_work", paint_tile=paint_tile, fill_tile=fill_tile, see=see, paint_quickly=paint_quickly,
        finish=finish, decide=decide,
    )  # fmt: skip
    return variant(_paint, name, borrowing, work=work, offer=offering(work))


paint_flat = _painter("paint_flat", _flat_tile, paint_quickly=flat_quickly, decide=decide_flat)
_DIFFUSE = {"paint_quickly": diffuse_quickly, "finish": shade_anew, "decide": decide_diffuse}
paint_diffuse = _painter("paint_diffuse", _diffuse_tile, **_DIFFUSE)
paint_diffuse_unchecked = _painter(
    "paint_diffuse_unchecked", _diffuse_tile, see=see_tile_unchecked, paint_quickly=diffuse_quickly_unchecked
)
paint_diffuse_any = _painter("paint_diffuse_any", _diffuse_any_tile, **_DIFFUSE)
paint_full = _painter("paint_full", _full_tile)
paint_normal = _painter("paint_normal", _normal_tile)
find_hits = _painter("find_hits", hits_tile, no_hits_tile)
_BY_SHAPE = {"fill_tile": no_hits_tile, "decide": decide_hits}
find_shapes = _painter("find_shapes", shapes_tile, paint_quickly=shapes_quickly, **_BY_SHAPE)
find_fine_hits = _painter("find_fine_hits", fine_hits_tile, paint_quickly=fine_hits_quickly, **_BY_SHAPE)
