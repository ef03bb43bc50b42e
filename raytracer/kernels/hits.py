"""Hits of a tile as numbers, a row at a time: t and index of what each pixel sees, or the index alone.

    k, index (`visibility`) ── hits_tile ───────> t = k / a, good enough to be shaded; index
                            ├─ shapes_tile ─────> index
                            └─ fine_hits_tile ──> t to the last digit, not a number where that is not certain; index
    number (`quick`) ──┬─ shapes_quickly ───────> index
                       └─ fine_hits_quickly ────> t to the last digit, or the pixel is listed as doubtful; index

In single precision no t is worked out. Of the spheres of a list, all that their pixels share is tabulated first.

What differs between these is given to the two templates, `_put_tile` and `_put_strips`, by name (see `variant`).
"""

import numpy as np

from raytracer import fine
from raytracer.camera import fine_rest
from raytracer.certified import fine_direction, refine
from raytracer.kernels.compiler import called, inlined, variant
from raytracer.kernels.lanes import (
    WIDTH,
    align_stack,
    any_of,
    at_least,
    bits_of,
    first_of,
    gather,
    gather_rows,
    is_hit,
    largest_of,
    load,
    load_low,
    load_pair,
    same,
    spread,
    store,
    store_rows,
)
from raytracer.kernels.quick import hits_quickly
from raytracer.kernels.sixteen import SIDE
from raytracer.kernels.strips import STRIP
from raytracer.kernels.surfaces import ball_of
from raytracer.kernels.visibility import place_of
from raytracer.twofold import select

_BELOW = np.int32(-1)
_ONE, _TWO, _THREE, _FOUR = (np.uint64(k) for k in range(1, 5))


def _put_tile(view, scratch, tile, paints, out):
    """Put what the pixels of a tile hit into the rows of `out`, eight at a time; t if that is wanted (`has_t`)."""
    for row in range(tile.top, tile.bottom):
        start, rests = _start_of(out, row), rests_of(view, paints, row)
        for x in range(tile.left, tile.right, WIDTH):
            index, at, room = index_of(scratch, tile, row, x), start + np.uint64(x), tile.right - x
            _put(out.index, at, room, index, scratch.quick.bits)
            if has_t:
                t = spread(np.inf)
                if any_of(is_hit(index)):
                    t = select(is_hit(index), t_of(view, paints, scratch, tile, row, x, index, rests, out), np.inf)
                _put(out.t, at, room, t, scratch.batch)


@inlined
def _start_of(out, row):
    """Where a row begins."""
    return np.uint64((row - out.first_row) * out.width)


@inlined
def _put(array, at, room, eight, rest):
    """Eight numbers, or as many as there is room for."""
    if room >= WIDTH:
        store(array, at, eight)
    else:
        store(rest, 0, eight)
        for pixel in range(np.uint64(room)):
            array[at + pixel] = rest[pixel]


@called
def no_hits_tile(scratch, tile, paints, out):
    """Of a tile in which there is nothing."""
    for row in range(tile.top, tile.bottom):
        start = _start_of(out, row)
        for x in range(tile.left, tile.right, WIDTH):
            at, room = start + np.uint64(x), tile.right - x
            _put(out.index, at, room, spread(np.int32(-1)), scratch.quick.bits)
            if len(out.t):
                _put(out.t, at, room, spread(np.inf), scratch.batch)


# ------------------------------------------------------------------------------------------------ of a depth buffer


@inlined
def _index_in_buffer(scratch, tile, row, x):
    return load(scratch.index, place_of(tile, row, x))


@inlined
def _no_rests(view, paints, row):
    """Of a row, where t is rough."""
    return 0.0


@inlined
def _fine_rests(view, rays, row):
    """D of a row's rays but for U·u, each component in two-fold float64."""
    up, quick = (view.up[np.uint64(row)], rays.up_low[np.uint64(row)]), rays.quick
    v, w, back = quick.v, quick.w, quick.back
    return fine_rest(up, v[0], w[0], back), fine_rest(up, v[1], w[1], back), fine_rest(up, v[2], w[2], back)


@inlined
def _t_in_buffer(view, paints, scratch, tile, row, x, index, rests, out):
    across, r = load(view.across, x), np.uint64(row)
    return load(scratch.k, place_of(tile, row, x)) / ((across * view.a2 + view.a1[r]) * across + view.a0[r])


@inlined
def _fine_t_in_buffer(view, rays, scratch, tile, row, x, index, rests, out):
    hit, across, low, u = is_hit(index), load(view.across, x), load(rays.across_low, x), view.u
    dx = fine_direction(across, low, u[0], *rests[0])
    dy = fine_direction(across, low, u[1], *rests[1])
    dz = fine_direction(across, low, u[2], *rests[2])
    cx, cy, cz, radius = ball_of(view, select(hit, index, spread(largest_of(index))))
    t, eye = _t_in_buffer(view, rays, scratch, tile, row, x, index, rests, out), view.eye
    finer, sure = refine(t, dx, dy, dz, eye[0], eye[1], eye[2], cx, cy, cz, radius)
    sure = sure & ~at_least(index, view.first_facet)
    if any_of(hit & ~sure):
        out.is_left[0] = 1
    return select(sure, finer, np.nan)


_BUFFER = {"index_of": _index_in_buffer, "t_of": _t_in_buffer, "rests_of": _no_rests}
hits_tile = variant(_put_tile, "hits_tile", has_t=True, **_BUFFER)
shapes_tile = variant(_put_tile, "shapes_tile", has_t=False, **_BUFFER)
fine_hits_tile = variant(
    _put_tile, "fine_hits_tile", has_t=True, **_BUFFER | {"t_of": _fine_t_in_buffer, "rests_of": _fine_rests}
)


# -------------------------------------------------------------------------------------------------------- of strips


def _put_strips(view, bins, tile, extremes, rays, scratch, doubts, out):
    """The same of a tile in single precision: what its strips hold are numbers of its list, counted from 1."""
    align_stack()
    sheet, quick = scratch.quick, rays.quick
    _list_ids(bins, tile, sheet)
    if has_t:
        _tabulate(view, bins, tile, quick, sheet)
    frame = fine.frame_of(quick.u, quick.v, quick.w, quick.back)
    for row in range(tile.top, tile.bottom):
        start, line = _start_of(out, row), _line_of(view, rays, row, frame)
        for x in range(tile.left, tile.right, WIDTH):
            number, at, room = _number_of(sheet, tile, row, x), start + np.uint64(x), tile.right - x
            hit, index, t = is_hit(number + _BELOW), spread(_BELOW), spread(np.inf)
            if any_of(hit):
                which = select(hit, number, spread(largest_of(number)))
                index = select(hit, _ids(sheet, which), _BELOW)
                if has_t:
                    found, sure = _meet(view, rays, frame, line, sheet, x, which)
                    t = select(hit, found, np.inf)
                    if any_of(hit & ~sure):
                        _list(view, row, x, bits_of(hit & ~sure), room, doubts)
            _put(out.index, at, room, index, sheet.bits)
            if has_t:
                _put(out.t, at, room, t, scratch.batch)


@inlined
def _number_of(sheet, tile, row, x):
    """What is in the strips for eight pixels."""
    p = np.uint64((x - tile.left) // SIDE * STRIP + (row - tile.top) * SIDE)
    return load_pair(sheet.number, p, p + np.uint64(STRIP))


@inlined
def _ids(sheet, which):
    """The spheres that are so numbered in the list."""
    return spread(sheet.ids[np.uint64(first_of(which))]) if same(which) else gather(sheet.ids, which)


@called
def _list_ids(bins, tile, sheet):
    """Which spheres those of the list are."""
    first, end = bins.starts[tile.number], bins.middles[tile.number]
    for at in range(first, end, WIDTH):
        store(sheet.ids, np.uint64(at - first + 1), load_low(bins.entries, np.uint64(at)))


@called
def _tabulate(view, bins, tile, quick, sheet):
    """How rays from the eye see the spheres of the list."""
    count = bins.middles[tile.number] - bins.starts[tile.number]
    for row in range(np.uint64(1), np.uint64(count + 1), np.uint64(WIDTH)):
        cx, cy, cz, radius = gather_rows(view.balls, load(sheet.ids, row))
        hu, hv, hw, c = fine.seen(view.eye, (cx, cy, cz), radius, quick.u, quick.v, quick.w, quick.back)
        store_rows(sheet.slopes, row, hu[0], hu[1], hv[0], hv[1])
        store_rows(sheet.sides, row, hw[0], hw[1], c[0], c[1])


@inlined
def _line_of(view, rays, row, frame):
    """V, a1 and a0 of a row."""
    up = view.up[np.uint64(row)], rays.up_low[np.uint64(row)]
    return up, *fine.square_of_row(up, frame)


@inlined
def _meet(view, rays, frame, line, sheet, x, which):
    """t of eight hits of spheres of the list to the last digit, and where that is certain."""
    across, (up, a1, a0) = (load(view.across, x), load(rays.across_low, x)), line
    a = fine.linear(across, fine.linear(across, frame[0], a1), a0)
    slope, rest, c = _seen(sheet, up, which)
    return fine.meet(fine.linear(across, slope, rest), a, c)


@inlined
def _seen(sheet, up, which):
    """hu, V·hv + hw and c."""
    if same(which):
        i, slopes, sides = _FOUR * np.uint64(first_of(which)), sheet.slopes, sheet.sides
        hv, hw = (slopes[i + _TWO], slopes[i + _THREE]), (sides[i], sides[i + _ONE])
        rest, rest_low = fine.linear(up, hv, hw)
        slope, c = (spread(slopes[i]), spread(slopes[i + _ONE])), (spread(sides[i + _TWO]), spread(sides[i + _THREE]))
        return slope, (spread(rest), spread(rest_low)), c
    hu, hu_low, hv, hv_low = gather_rows(sheet.slopes, which)
    hw, hw_low, c, c_low = gather_rows(sheet.sides, which)
    return (hu, hu_low), fine.linear(up, (hv, hv_low), (hw, hw_low)), (c, c_low)


@called
def _list(view, row, x, bits, room, doubts):
    """List some of eight pixels as doubtful."""
    width = len(view.across) - WIDTH
    for pixel in range(min(room, WIDTH)):
        if bits >> pixel & 1:
            doubts[0] += 1
            doubts[doubts[0]] = row * width + x + pixel


shapes_quickly = hits_quickly("shapes_quickly", variant(_put_strips, "_put_shapes", has_t=False))
fine_hits_quickly = hits_quickly("fine_hits_quickly", variant(_put_strips, "_put_fine_hits", has_t=True))
