"""What the pixels of one tile see first: a depth buffer, and one sphere after the other drawn into it.

    ┌ tile ───────────────┐        k       a·t of the nearest hit so far: a = D·D is the same for all spheres of a pixel
    │      ┌ box ┐        │        index   which sphere that is
    │      │▒▒▒▒▒│        │        doubt   whether float64 cannot tell
    │      │▒▒▒▒▒│        │
    │      └─────┘        │        rows of TILE_WIDTH pixels, and 8 to spare, and a row to spare:
                                   what is drawn of a box is whole vectors, and may reach beyond
    └─────────────────────┘

A box has no mask: beyond it the sphere is not hit. What the spheres of eight list entries need is computed at once.
A vector holds eight pixels of a row, or four of one and four of the next: of boxes that are no wider.
"""

import numpy as np

from raytracer.arrays import FACET
from raytracer.certified import (
    FACET_ERROR,
    K_ERROR,
    STEEP,
    TIE,
    approach,
    approach_facet,
    arrive,
    beside_edges,
    edge_of,
    inner,
    meet,
    side_of,
)
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import called, compiled, inlined, variant
from raytracer.kernels.lanes import (
    WIDTH,
    all_of,
    any_of,
    bits_of,
    blend,
    fetch_ahead,
    gather_rows,
    load,
    load_low,
    load_pair,
    mask_of,
    spread,
    spread_pair,
    store,
    store_pair,
)
from raytracer.kernels.sixteen import load_numbers, lowest_bit

STRIDE = TILE_WIDTH + WIDTH
_HALF, _NEXT_ROW = np.uint64(WIDTH // 2), np.uint64(STRIDE)
AHEAD = 24  # list entries: how long before it is wanted a sphere is fetched


def _see(view, slow, bins, tile, scratch):
    """Fill the depth buffer of a tile; returns whether there are doubts."""
    for p in range(np.uint64(0), np.uint64((TILE_HEIGHT + 1) * STRIDE), np.uint64(WIDTH)):
        store(scratch.k, p, spread(np.inf))
        store(scratch.index, p, spread(np.int32(-1)))
    doubts = False
    for i in range(len(slow.ids)):
        doubts |= _draw_slow(view, slow, i, tile, scratch)
    end = bins.middles[tile.number]
    for first in range(bins.starts[tile.number], end, WIDTH):
        _look_at_eight(view, bins, first, scratch)
        for j in range(np.uint64(0), np.uint64(min(WIDTH, end - first))):
            doubts |= _draw(draw_row, draw_pair, view, bins, np.uint64(first) + j, j, tile, scratch)
    for place in range(end, bins.starts[tile.number + 1]):
        doubts |= _draw_facet(view, bins.entries[place], tile, scratch)
    return doubts


@inlined
def _look_at_eight(view, bins, first, scratch):
    """What the next eight spheres of a list have in common with all rows: h is across·hu + up·hv + hw; c and edge."""
    batch = scratch.batch
    hu, hv, hw, c, edge = from_eye(view, *gather_rows(view.balls, load_low(bins.entries, first)))
    store(batch, 0, hu)
    store(batch, 8, hv)
    store(batch, 16, hw)
    store(batch, 24, c)
    store(batch, 32, edge)


@inlined
def from_eye(view, x, y, z, radius):
    """A sphere as eye rays see it: h is across·hu + (up·hv + hw); c and edge."""
    u, v, back = view.u, view.v, view.back
    lx, ly, lz = view.eye[0] - x, view.eye[1] - y, view.eye[2] - z
    c, square = side_of(lx, ly, lz, radius)
    hu, hv = inner(u[0], u[1], u[2], lx, ly, lz), inner(v[0], v[1], v[2], lx, ly, lz)
    return hu, hv, -inner(back[0], back[1], back[2], lx, ly, lz), c, edge_of(c, square, view.reach, view.kappa)


@inlined
def _draw(draw_row, draw_pair, view, bins, place, j, tile, scratch):
    """Draw the sphere at a place of the list, number j of the eight that were looked at."""
    fetch(view, sphere_of(bins.entries[place + np.uint64(AHEAD)]))
    entry, batch = bins.entries[place], scratch.batch
    i, (start, stop, high, low) = np.int32(sphere_of(entry)), corners_of(entry)
    hu, hv, hw = batch[j], batch[j + np.uint64(8)], batch[j + np.uint64(16)]
    c, edge = batch[j + np.uint64(24)], batch[j + np.uint64(32)]
    doubts, line, x, p = False, high, np.uint64(tile.left + start), np.uint64(high * STRIDE + start)
    while line < low:
        row = np.uint64(tile.top + line)
        hr = view.up[row] * hv + hw
        if stop - start <= WIDTH // 2:
            doubts |= draw_pair(view, i, row, x, p, hu, hr, view.up[row + np.uint64(1)] * hv + hw, c, edge, scratch)
            line, p = line + 2, p + _NEXT_ROW + _NEXT_ROW
        else:
            doubts |= draw_row(view, i, row, x, p, p + np.uint64(stop - start), hu, hr, c, edge, scratch)
            line, p = line + 1, p + _NEXT_ROW
    return doubts


@inlined
def place_of(tile, row, x):
    """Where a pixel of the picture is in the depth buffer."""
    return np.uint64((row - tile.top) * STRIDE + x - tile.left)


@inlined
def fetch(view, sphere):
    """A sphere will be wanted soon: to be drawn, and then to be painted."""
    fetch_ahead(view.balls, np.uint64(4) * sphere)
    fetch_ahead(view.material, sphere)


@inlined
def sphere_of(entry):
    return entry & np.uint64(0xFFFFFFFF)


@inlined
def corners_of(entry):
    """Left, right, top, bottom of an entry's box within the tile."""
    corners = np.int64(entry >> np.uint64(32))
    return corners & 255, corners >> 8 & 255, corners >> 16 & 255, corners >> 24


def _draw_row(view, i, row, x, p, end, hu, hr, c, edge, scratch):
    """A row of a box, which begins with column x of the picture and is from p to `end` in the buffer.

    Returns whether there are doubts.
    """
    doubts, a2, a1, a0 = False, view.a2, view.a1[row], view.a0[row]
    while p < end:
        across, best = load(view.across, x), load(scratch.k, p)
        a = (across * a2 + a1) * across + a0
        k, wins, doubt = approach(across * hu + hr, a, c, edge, best)
        _keep(scratch, p, wins, k, best, i)
        if certain and any_of(doubt):
            _note(scratch.doubt, p, bits_of(doubt))
            doubts = True
        x += np.uint64(WIDTH)
        p += np.uint64(WIDTH)
    return doubts


def _draw_pair(view, i, row, x, p, hu, hr, next_hr, c, edge, scratch):
    """Four pixels of a row and the four below them."""
    below, next_row, doubts = p + _NEXT_ROW, row + np.uint64(1), False
    across, best = load_pair(view.across, x, x), load_pair(scratch.k, p, below)
    a1, a0 = spread_pair(view.a1[row], view.a1[next_row]), spread_pair(view.a0[row], view.a0[next_row])
    a = (across * view.a2 + a1) * across + a0
    k, wins, doubt = approach(across * hu + spread_pair(hr, next_hr), a, c, edge, best)
    store_pair(scratch.k, p, below, blend(wins, k, best))
    store_pair(scratch.index, p, below, blend(wins, spread(i), load_pair(scratch.index, p, below)))
    if certain and any_of(doubt):
        bits = bits_of(doubt)
        _note(scratch.doubt, p, bits & 15)
        _note(scratch.doubt, below, bits >> 4)
        doubts = True
    return doubts


@inlined
def _keep(scratch, p, wins, k, best, i):
    """Put what wins into the depth buffer."""
    store(scratch.k, p, blend(wins, k, best))
    store(scratch.index, p, blend(wins, spread(i), load(scratch.index, p)))


@called
def _draw_facet(view, entry, tile, scratch):
    """A triangle in its box. Returns whether there are doubts."""
    i, (start, stop, high, low) = np.int32(sphere_of(entry)), corners_of(entry)
    f, at, doubts = view.facets, np.uint64(FACET) * (np.uint64(i) - np.uint64(view.first_facet)), False
    for line in range(high, low):
        row = np.uint64(tile.top + line)
        up, a1, a0 = view.up[row], view.a1[row], view.a0[row]
        x, p, end = np.uint64(tile.left + start), np.uint64(line * STRIDE + start), np.uint64(line * STRIDE + stop)
        while p < end:
            across = load(view.across, x)
            first, second = _linear(f, at, across, up), _linear(f, at + np.uint64(3), across, up)
            third = _linear(f, at + np.uint64(6), across, up)
            least, beside = beside_edges(first, second, third)
            if not all_of(beside):
                best, slope = load(scratch.k, p), _linear(f, at + np.uint64(9), across, up)
                a = (across * view.a2 + a1) * across + a0
                k, wins, doubt = approach_facet(least, slope, f[at + np.uint64(12)], a, best)
                if any_of(doubt):
                    sides = first > FACET_ERROR, second > FACET_ERROR, third > FACET_ERROR
                    tie = abs(k - best) <= TIE * k
                    settled, twins = _on_edges(view, f, at, across, up, sides, doubt & (slope > STEEP), tie, scratch, p)
                    doubt, wins = doubt & ~settled, wins & ~twins
                    if any_of(doubt):
                        _note(scratch.doubt, p, bits_of(doubt))
                        doubts = True
                _keep(scratch, p, wins, k, best, i)
            x += np.uint64(WIDTH)
            p += np.uint64(WIDTH)
    return doubts


@inlined
def _on_edges(view, f, at, across, up, sides, doubt, tie, scratch, p):
    """Of pixels whose ray may go through an edge: those of which that is certain, and what comes of it.

    And those of them where the triangle that was met already has that edge too: both are met at the same t, and the
    first of the file, which is drawn first, stays.
    """
    settled, twins, place = doubt & ~tie, across < -np.inf, at + np.uint64(13)
    for edge in range(3):
        zero = np.int64(f[place + np.uint64(edge)])
        on = (((across == 0.0) | (zero & 1 > 0)) & ((up == 0.0) | (zero & 2 > 0))) & (zero & 4 > 0)
        settled = settled & (sides[edge] | on)
        others = sides[(edge + 1) % 3] & sides[(edge + 2) % 3]
        shared = doubt & tie & on & others
        if any_of(shared):
            bits = bits_of(shared)
            for lane in range(WIDTH):
                if bits >> lane & 1 and not _has_edge(view, f, scratch.index[p + np.uint64(lane)], at, edge):
                    bits ^= np.uint8(1 << lane)
            twins = twins | mask_of(bits)
    return settled | twins, twins


@inlined
def _has_edge(view, f, j, at, edge):
    """Whether shape j is a triangle that has the same two corners."""
    if j < view.first_facet:
        return False
    corners, found = np.uint64(FACET) * np.uint64(j - view.first_facet) + np.uint64(16), 0
    for corner in (f[at + np.uint64(16 + edge)], f[at + np.uint64(16 + (edge + 1) % 3)]):
        for k in range(np.uint64(3)):
            if f[corners + k] == corner:
                found += 1
    return found == 2


@inlined
def _linear(f, at, across, up):
    return across * f[at] + (up * f[at + np.uint64(1)] + f[at + np.uint64(2)])


@called
def _draw_slow(view, slow, i, tile, scratch):
    """Any sphere in its box."""
    start, stop = max(slow.boxes[i, 0] - tile.left, 0), min(slow.boxes[i, 1] - tile.left, TILE_WIDTH)
    c, c_error, size, radius = slow.seen.c[i], slow.seen.c_error[i], slow.seen.size[i], slow.seen.radius[i]
    doubts = False
    for row in range(max(slow.boxes[i, 2], tile.top), min(slow.boxes[i, 3], tile.bottom)):
        hu, hr = slow.seen.hu[i], view.up[row] * slow.seen.hv[i] + slow.seen.hw[i]
        x, end = np.uint64(tile.left + start), np.uint64(tile.left + stop)
        p = np.uint64((row - tile.top) * STRIDE + start)
        while x < end:
            across, best = load(view.across, x), load(scratch.k, p)
            a = (across * view.a2 + view.a1[row]) * across + view.a0[row]
            t, _, low = meet(across * hu + hr, a, c, c_error, size, radius, view.reach, K_ERROR / 2)
            k, wins, doubt = arrive(t, low, a, best)
            _keep(scratch, p, wins, k, best, slow.ids[i])
            if any_of(doubt):
                _note(scratch.doubt, p, bits_of(doubt))
                doubts = True
            x += np.uint64(WIDTH)
            p += np.uint64(WIDTH)
    return doubts


@inlined
def _note(doubt, p, bits):
    """Mark the pixels from p on whose bits are set."""
    for lane in range(WIDTH):
        if bits >> lane & 1:
            doubt[p + np.uint64(lane)] = True


@called
def list_doubts(view, tile, scratch, doubts):
    """Add the tile's doubtful pixels, as row · width + column, to a list, whose first element is its length."""
    width = len(view.across) - WIDTH
    for line in range(tile.bottom - tile.top):
        for x in range(tile.right - tile.left):
            if scratch.doubt[line * STRIDE + x]:
                doubts[0] += 1
                doubts[doubts[0]] = (tile.top + line) * width + tile.left + x
    scratch.doubt[:] = False


_certain_row = variant(_draw_row, "_certain_row", inlined, certain=True)
_unchecked_row = variant(_draw_row, "_unchecked_row", inlined, certain=False)  # to measure what certainty costs
_certain_pair = variant(_draw_pair, "_certain_pair", inlined, certain=True)
_unchecked_pair = variant(_draw_pair, "_unchecked_pair", inlined, certain=False)
see_tile = variant(_see, "see_tile", draw_row=_certain_row, draw_pair=_certain_pair)
see_tile_unchecked = variant(_see, "see_tile_unchecked", draw_row=_unchecked_row, draw_pair=_unchecked_pair)


@compiled
def candidates(slow, bins, xs, ys):
    """`plain.candidates_of` for the spheres of a screen: starts and ids."""
    starts, no_ids = np.zeros(len(xs) + 1, np.int64), np.empty(0, np.int32)
    for k in range(len(xs)):
        starts[k + 1] = starts[k] + _merge(slow, bins, xs[k], ys[k], no_ids, 0)
    ids = np.empty(starts[-1], np.int32)
    for k in range(len(xs)):
        _merge(slow, bins, xs[k], ys[k], ids, starts[k])
    return starts, ids


@called
def _merge(slow, bins, x, y, ids, at):
    """Write a pixel's candidates, ascending, to `ids` from `at` on, if it has room; returns how many there are."""
    tile, found, slows = y // TILE_HEIGHT * bins.columns + x // TILE_WIDTH, 0, 0
    for some in range(bins.starts[tile], bins.starts[tile + 1], WIDTH):
        bits = holding(bins.entries, some, bins.starts[tile + 1], x % TILE_WIDTH, y % TILE_HEIGHT)
        while bits:
            place = some + lowest_bit(bits) // 2
            bits &= bits - 1
            _put_in_order(ids, at, found, np.int32(sphere_of(bins.entries[place])))
            found += 1
    for i in range(len(slow.ids)):
        slows += _is_within(slow.boxes[i], x, y)
    if len(ids) and slows:
        _merge_slow(slow, x, y, ids, at, at + found, slows)
    return found + slows


@inlined
def _merge_slow(slow, x, y, ids, at, end, slows):
    """Put so many slow spheres of a pixel among the others, which ascend in `ids` from `at` to `end`."""
    place, free = end - 1, end + slows - 1
    for i in range(len(slow.ids) - 1, -1, -1):
        if _is_within(slow.boxes[i], x, y):
            while place >= at and ids[place] > slow.ids[i]:
                ids[free] = ids[place]
                place, free = place - 1, free - 1
            ids[free] = slow.ids[i]
            free -= 1


@inlined
def _is_within(box, x, y):
    return box[0] <= x and x < box[1] and box[2] <= y and y < box[3]


@inlined
def _put_in_order(ids, at, found, number):
    """Put a number among the `found` ascending ones in `ids` from `at` on, if that has room: mostly it is the last."""
    if len(ids):
        place = at + found
        while place > at and ids[place - 1] > number:
            ids[place] = ids[place - 1]
            place -= 1
        ids[place] = number


@inlined
def holding(entries, place, end, x, y):
    """Which list entries have a box that a tile's pixel is in, of eight from one place on, `end` excluded.

    Two bits each, the upper one or none.
    """
    boxes = load_numbers(entries, np.uint64(place))
    columns = ((boxes & 255) <= x) & ((boxes >> 8 & 255) > x)
    rows = ((boxes >> 16 & 255) <= y) & (boxes >> 24 > y)
    return np.int32(bits_of(columns & rows)) & 0xAAAA & (1 << 2 * min(end - place, WIDTH)) - 1
