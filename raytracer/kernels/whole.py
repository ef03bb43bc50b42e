"""Stages that look at the hits of the whole picture: from t and index to bytes, rows at a time."""

import numpy as np

from raytracer.kernels.compiler import borrowing, inlined
from raytracer.kernels.desks import desk_of
from raytracer.kernels.lanes import WIDTH, equal, is_hit, load, mask_of, smallest_of, spread
from raytracer.kernels.tiles import put_lanes
from raytracer.shading import grey_of, to_byte
from raytracer.twofold import select


@borrowing
def mean_of_blocks(large, side, wanted, out):
    """The means of side × side blocks of bytes, rounded, of a picture (rows, columns, 3), where they are wanted."""
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            if not wanted[row, column]:
                continue
            red, green, blue = 0, 0, 0
            for y in range(row * side, row * side + side):
                for x in range(column * side, column * side + side):
                    red += large[y, x, 0]
                    green += large[y, x, 1]
                    blue += large[y, x, 2]
            half, count = side * side // 2, side * side
            out[row, column, 0] = (red + half) // count
            out[row, column, 1] = (green + half) // count
            out[row, column, 2] = (blue + half) // count


@borrowing
def range_of(t, index):
    """The smallest and the largest t of all hits, or +inf and 0."""
    near, far, eights = spread(np.inf), spread(0.0), np.uint64(len(t) // WIDTH * WIDTH)
    for p in range(np.uint64(0), eights, np.uint64(WIDTH)):
        hit, some = is_hit(load(index, p)), load(t, p)
        near, far = select(hit & (some < near), some, near), select(hit & (some > far), some, far)
    nearest, farthest = smallest_of(near), -smallest_of(-far)
    for p in range(eights, np.uint64(len(t))):
        if index[p] >= 0:
            nearest, farthest = min(nearest, t[p]), max(farthest, t[p])
    return nearest, farthest


@borrowing
def paint_depth(t, index, near, far, first, last, width, desks, worker, paints, out):
    """`stages.depth` of rows first to last − 1. The arrays have eight elements to spare."""
    scratch = desk_of(desks.memory, worker)
    for row in range(first, last):
        for x in range(0, width, WIDTH):
            p = np.uint64(row * width + x)
            grey = to_byte(grey_of(load(t, p), near, far))
            grey = select(is_hit(load(index, p)), grey, spread(paints.background[0]))
            put_lanes(out, row, x, width, grey, grey, grey, scratch)


@borrowing
def paint_edges(t, index, near, far, first, last, width, desks, worker, paints, out):
    """`stages.edges` of rows first to last − 1. The arrays have eight elements to spare."""
    scratch, height = desk_of(desks.memory, worker), (len(index) - WIDTH) // width
    for row in range(first, last):
        below = np.uint64(width if row + 1 < height else 0)
        for x in range(0, width, WIDTH):
            p = np.uint64(row * width + x)
            here = load(index, p)
            same_right = equal(here, load(index, p + np.uint64(1))) | ~_before(width - 1 - x)
            same = same_right & equal(here, load(index, p + below))
            grey = select(same, spread(255.0), spread(0.0))
            put_lanes(out, row, x, width, grey, grey, grey, scratch)


@inlined
def _before(count):
    """The first so many of eight lanes."""
    return mask_of(np.uint8((1 << min(count, WIDTH)) - 1))
