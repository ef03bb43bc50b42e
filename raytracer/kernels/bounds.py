"""Which pixels can see which sphere: eight spheres at a time.

    balls   x y z r | x y z r | …      float64, the scene's own, flat
      ↓ box_of
    boxes   left right top bottom | …  int32, flat; empty for what cannot be seen, left = −1 for a slow sphere
    counts  how many boxes reach into each tile, int64
      ↓ begin, fill
    entries   the list of each tile, see `Bins`

A slow sphere is one that `certified.approach` is not for: around the eye or close to it, or reaching behind it.
"""

import numpy as np

from raytracer.boxes import beside, box_of
from raytracer.certified import edge_of, side_of
from raytracer.kernels.compiler import borrowing, inlined
from raytracer.kernels.lanes import WIDTH, all_of, load_rows, store_boxes
from raytracer.twofold import select

_WIDE, _HIGH = 7, 5
TILE_WIDTH, TILE_HEIGHT = 1 << _WIDE, 1 << _HIGH  # pixels: a tile's depth buffer fits a core's first cache
_SLOW = -1.0


@borrowing
def bound(lens, eye, reach, kappa, balls, first, last, boxes, counts, columns):
    """Boxes of spheres first to last − 1, first being a multiple of 8; returns how many of them are slow.

    balls and boxes have room for whole eights. columns is how many tiles lie side by side.
    """
    slow = 0
    for i in range(np.uint64(first), np.uint64(last), np.uint64(WIDTH)):
        x, y, z, radius = load_rows(balls, i)
        qx, qy, qz = x - eye[0], y - eye[1], z - eye[2]
        box = box_of(lens, qx, qy, qz, radius)
        c, square = side_of(qx, qy, qz, radius)
        quick = box.known & (box.ahead > 0.0) & (edge_of(c, square, reach, kappa) > 0.0)
        hidden = box.known & (box.ahead <= 0.0)
        if not all_of(box.known):
            hidden = hidden | beside(lens, qx, qy, qz, c, square, radius)
        left = select(quick, box.left, select(hidden, 0.0, _SLOW))
        store_boxes(boxes, i, left, select(quick, box.right, 0.0), box.top, box.bottom)
        slow += _count(boxes, i, min(i + np.uint64(WIDTH), np.uint64(last)), counts, columns)
    return slow


@borrowing
def count(boxes, first, last, counts, columns):
    """Count the tiles of the boxes first to last − 1."""
    _count(boxes, np.uint64(first), np.uint64(last), counts, columns)


@inlined
def _count(boxes, first, last, counts, columns):
    """Count the tiles of some boxes; returns how many of them are slow."""
    slow = 0
    for i in range(first, last):
        left, right, top, bottom = _box(boxes, i)
        if left < 0:
            slow += 1
        elif left < right and top < bottom:
            for row in range(top >> _HIGH, (bottom - 1 >> _HIGH) + 1):
                for column in range(left >> _WIDE, (right - 1 >> _WIDE) + 1):
                    counts[np.uint64(row * columns + column)] += 1
    return slow


@inlined
def _box(boxes, i):
    box = np.uint64(4) * i
    return (
        boxes[box],
        boxes[box + np.uint64(1)],
        boxes[box + np.uint64(2)],
        boxes[box + np.uint64(3)],
    )


@borrowing
def begin(counts, starts):
    """Where each tile's list begins, from counts (threads, tiles), which become where each thread's part of it begins.

    starts has one element more than there are tiles.
    """
    total = 0
    for tile in range(counts.shape[1]):
        starts[tile] = total
        for thread in range(counts.shape[0]):
            count = counts[thread, tile]
            counts[thread, tile] = total
            total += count
    starts[-1] = total


@borrowing
def fill(boxes, first, last, places, entries, columns):
    """Put spheres first to last − 1 into the lists of their tiles; `places` is where each list goes on."""
    for i in range(np.uint64(first), np.uint64(last)):
        left, right, top, bottom = _box(boxes, i)
        if 0 <= left < right and top < bottom:
            for row in range(top >> _HIGH, (bottom - 1 >> _HIGH) + 1):
                y = row << _HIGH
                high, low = max(top - y, 0), min(bottom - y, TILE_HEIGHT)
                for column in range(left >> _WIDE, (right - 1 >> _WIDE) + 1):
                    x = column << _WIDE
                    tile = np.uint64(row * columns + column)
                    place = np.uint64(places[tile])
                    corners = max(left - x, 0) | min(right - x, TILE_WIDTH) << 8 | high << 16 | low << 24
                    entries[place] = np.uint64(corners) << np.uint64(32) | i
                    places[tile] = place + np.uint64(1)
