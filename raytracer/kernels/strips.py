"""A tile in strips: how its pixels lie while it is drawn in single precision, and how they become bytes.

    ┌ strips, 4 pixels wide ──┐
    │ 0 1 2 3 │ 128 129 … │   │
    │ 4 5 6 7 │ 132       │   │
    │ …       │ …         │   │
    └─────────────────────────┘

So 4 × 4 pixels are sixteen numbers in a row, from whichever row of the tile on.
"""

import numpy as np

from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import inlined
from raytracer.kernels.lanes import SIXTEEN, fetch_to_write
from raytracer.kernels.sixteen import SIDE, larger_size, pack, put_sixteen, rest, rounded

STRIP = SIDE * TILE_HEIGHT  # pixels of a strip
PIXELS = np.uint64(TILE_WIDTH * TILE_HEIGHT)


@inlined
def pixel_of(p):
    """Column and row of pixel p of the strips."""
    return p // STRIP * SIDE + p % SIDE, p // SIDE % TILE_HEIGHT


@inlined
def is_in(tile, x, y):
    """Whether the picture has that pixel of the tile."""
    return tile.left + x < tile.right and tile.top + y < tile.bottom


@inlined
def bytes_of(red, green, blue):
    """Channels from 0 on as `pack` has them."""
    return pack(rounded(red), rounded(green), rounded(blue))


@inlined
def apart(red, green, blue):
    """How far the one of three channels that is closest to another byte is from its own, ½ at most."""
    return larger_size(larger_size(rest(red), rest(green)), rest(blue))


@inlined
def list_pair(sheet, close, k, bits):
    """List blocks k and k + 1, if there are any bits; returns how many are listed then. Nobody could tell a branch."""
    sheet.close[close], sheet.bits[close] = k, bits
    return close + (bits != 0)


@inlined
def fetch_row(tile, row, out):
    """A row of a tile will be written to, if the tile has it."""
    if row >= tile.bottom:
        return
    start = start_of(out, row, tile.left)
    for at in range(np.uint64(0), np.uint64((tile.right - tile.left) * out.pixel_bytes), np.uint64(64)):
        fetch_to_write(out.bytes, start + at)


@inlined
def put_tile(tile, sheet, out):
    """A tile's colours as bytes of the picture."""
    step, right = np.uint64(out.pixel_bytes), min(tile.right, out.columns)
    for row in range(tile.bottom - tile.top):
        start = start_of(out, tile.top + row, tile.left)
        x, p = tile.left, np.uint64(SIDE * row)
        while x + SIXTEEN <= right:
            put_sixteen(out.bytes, start, step, sheet.colour, p, np.uint64(STRIP))
            x, start, p = x + SIXTEEN, start + np.uint64(SIXTEEN) * step, p + np.uint64(SIXTEEN // SIDE * STRIP)
        for pixel in range(tile.right - x):
            put_pixel(out, start, sheet.colour[p + np.uint64(pixel // SIDE * STRIP + pixel % SIDE)])
            start += step


@inlined
def start_of(out, row, column):
    """Where a pixel's bytes begin."""
    return np.uint64((row - out.first_row) * out.row_bytes + column * out.pixel_bytes)


@inlined
def put_pixel(out, start, colour):
    for channel in range(3):
        out.bytes[start + np.uint64(channel)] = colour >> 8 * channel & 255
