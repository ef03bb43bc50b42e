"""Stages that look at the hits of the whole picture: from t and index to bytes, rows at a time."""

import numpy as np

from raytracer.kernels.compiler import borrowing
from raytracer.kernels.desks import desk_of
from raytracer.kernels.lanes import WIDTH, is_hit, load, spread
from raytracer.kernels.strips import start_of
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
    near, far = np.inf, 0.0
    for p in range(len(t)):
        if index[p] >= 0:
            near, far = min(near, t[p]), max(far, t[p])
    return near, far


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
    """`stages.edges` of rows first to last − 1."""
    height, step = (len(index) - WIDTH) // width, np.uint64(width)
    for row in range(first, last):
        below = step if row + 1 < height else np.uint64(0)
        for x in range(width):
            p = np.uint64(row * width + x)
            right = np.uint64(1) if x + 1 < width else np.uint64(0)
            edge = (index[p] != index[p + right]) | (index[p] != index[p + below])
            start = start_of(out, row, x)
            byte = np.uint8(0) if edge else np.uint8(255)
            out.bytes[start], out.bytes[start + np.uint64(1)], out.bytes[start + np.uint64(2)] = byte, byte, byte
