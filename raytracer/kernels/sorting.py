"""From shapes to the list of each tile: some threads take one part of the shapes after the other.

    a part ── bound ─────────> records       who is done with that counts the records of each tile
    counts ── _begin ────────> starts        by one thread, once all parts are counted
    records ── _fill ────────> entries       of each tile's list, part by part

Triangles, whose boxes are known, are the last part, and so the last of each list.
"""

import numpy as np

from raytracer.arrays import APART, Records
from raytracer.kernels.bounds import bound, record_boxes
from raytracer.kernels.compiler import borrowing, called, inlined
from raytracer.kernels.lanes import SIXTEEN, fetch_to_write
from raytracer.kernels.waiting import add, offering, show, wait_for_help, wait_until

_TAKEN, _COUNTED, _BEGUN, _FILLED = (APART * place for place in range(4))  # of the progress
_FITS = _BEGUN + 1  # whether all records are there, once the lists are begun
_SPARE = 32  # list entries beyond the last that a kernel may look at


@called
def _sort_parts(near, lens, view, facet_boxes, piles, bins, worker):
    """What each thread does to sort."""
    parts, progress = len(piles.found), piles.progress
    part = add(progress, _TAKEN, 1)
    while part < parts:
        if part < len(piles.cuts) - 1:
            _bound_part(near, lens, view, piles, bins.columns, part)
        else:
            _record_facets(view, facet_boxes, piles, bins.columns, part)
        add(progress, _COUNTED, 1)
        part = add(progress, _TAKEN, 1)
    if worker == 0:
        wait_until(progress, _COUNTED, parts)
        progress[_FITS] = _begin(piles, bins)
        show(progress, _BEGUN, 1)
    wait_until(progress, _BEGUN, 1)
    fits, part = progress[_FITS] != 0, add(progress, _FILLED, 1)
    while fits and part < parts:
        _fill(_records_of(piles, part), piles.found[part, 0], piles.counts[part], bins.entries)
        part = add(progress, _FILLED, 1)
    return fits


_offer = offering(_sort_parts)


@borrowing
def sort(board, seats, near, lens, view, facet_boxes, piles, bins):
    """Sort shapes into the lists of tiles; others may help: see `offering`. Spheres that are slow are in none.

    Returns whether there was room for all records, and SIXTEEN more of each part; piles.found tells how many there are.
    """
    for place in range(_FILLED + 1):
        piles.progress[place] = 0
    helped = _offer(board, seats, (near, lens, view, facet_boxes, piles, bins))
    fits = _sort_parts(near, lens, view, facet_boxes, piles, bins, 0)
    if helped:
        wait_for_help(board)
    return fits


@inlined
def _records_of(piles, part):
    start, end, records = piles.rooms[part], piles.rooms[part + 1], piles.records
    return Records(records.tiles[start:end], records.corners[start:end], records.shapes[start:end])


@called
def _bound_part(near, lens, view, piles, columns, part):
    """Record some of the spheres, and count those records."""
    first, last, records = piles.cuts[part], piles.cuts[part + 1], _records_of(piles, part)
    slow, boxes = piles.slow[first:last], piles.boxes[part]
    end, slows = bound(
        near, lens, view.eye, view.reach, view.kappa, view.balls, first, last, columns, records, slow, boxes
    )
    piles.found[part, 0], piles.found[part, 1] = end, slows
    _count(records, end, piles.counts[part])


@called
def _record_facets(view, boxes, piles, columns, part):
    """Record the triangles, and count those records."""
    records = _records_of(piles, part)
    end = record_boxes(boxes, view.first_facet, columns, records)
    piles.found[part, 0], piles.found[part, 1] = end, 0
    _count(records, end, piles.counts[part])


@called
def _count(records, end, counts):
    """How many records each tile has, if there is room for all of them."""
    counts[:] = 0
    if _fit(records, end):
        for k in range(np.uint64(end)):
            counts[np.uint64(records.tiles[k])] += 1


@inlined
def _fit(records, end):
    return end + SIXTEEN <= len(records.tiles)


@called
def _begin(piles, bins):
    """Where each tile's list begins, and in piles.counts each part of it; returns whether all records are there."""
    counts, total, facets = piles.counts, 0, len(piles.cuts) - 1
    for part in range(len(piles.found)):
        if not _fit(_records_of(piles, part), piles.found[part, 0]):
            return False
    for tile in range(counts.shape[1]):
        bins.starts[tile] = total
        for part in range(counts.shape[0]):
            if part == facets:
                bins.middles[tile] = total
            count = counts[part, tile]
            counts[part, tile] = total
            total += count
        if facets == counts.shape[0]:
            bins.middles[tile] = total
    bins.starts[counts.shape[1]] = total
    bins.entries[total : total + _SPARE] = 0
    return True


@called
def _fill(records, end, places, entries):
    """Put records into the lists of their tiles; `places` is where each list goes on."""
    for k in range(np.uint64(end)):
        tile = np.uint64(records.tiles[k])
        place = np.uint64(places[tile])
        entries[place] = np.uint64(np.uint32(records.corners[k])) << np.uint64(32) | np.uint64(records.shapes[k])
        fetch_to_write(entries, place + np.uint64(8))
        places[tile] = place + np.uint64(1)
