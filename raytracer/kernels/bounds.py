"""Which pixels can see which sphere: sixteen spheres at a time.

    balls   x y z r | x y z r | …      float64, the scene's own, flat
      ↓ bound
    records   tile | corners | shape    int32 each, one for each tile that a sphere's box reaches into
      ↓ sort
    entries   the list of each tile, see `Bins`

Single precision does it (the formulas and their errors are those of `glance`), and float64 those sixteen among which
one is not for that. A slow sphere is one that `certified.approach` is not for either: around the eye or close to it, or
reaching behind it.
"""

import numpy as np

from raytracer.boxes import beside, box_of
from raytracer.certified import edge_of, side_of
from raytracer.kernels.compiler import borrowing, called, inlined
from raytracer.kernels.lanes import (
    SIXTEEN,
    WIDTH,
    all_of,
    any_of,
    bits_of,
    load_rows,
    store,
    store_boxes,
)
from raytracer.kernels.rough import inverse
from raytracer.kernels.sixteen import (
    ascending,
    count_ones,
    greater,
    lesser,
    lowest_bit,
    rough_inverse,
    rough_inverse_root,
    singles,
    store_some,
    times_plus,
    whole_numbers,
)
from raytracer.quick import FARTHEST, NEAREST
from raytracer.twofold import select

_WIDE, _HIGH = 7, 5
TILE_WIDTH, TILE_HEIGHT = 1 << _WIDE, 1 << _HIGH  # pixels: a tile's depth buffer fits a core's first cache
_SLOW = -1.0
_ALL = (1 << SIXTEEN) - 1
_NEAREST, _FARTHEST = np.float32(NEAREST), np.float32(FARTHEST)
_WIDEST = np.float32(2.0**20)  # m²
_ROUGH = np.float32(1.0 + 2.0**-12)
_ZERO, _UNIT, _FOUR = np.float32(0.0), np.float32(1.0), np.float32(4.0)


@borrowing
def bound(near, lens, eye, reach, kappa, balls, first, last, columns, records, slow, boxes):
    """Records of spheres first to last − 1, first being a multiple of 8, and in `slow` which of them are slow.

    Returns how many records there are, or would be if there was room for them and SIXTEEN more, and how many slow ones.
    balls has room for whole eights, slow for all of those spheres, boxes for 64 numbers; columns is how many tiles lie
    side by side.
    """
    end, slows, i = 0, 0, np.uint64(first)
    while i < last:
        odd = np.int32(_ALL)
        if near.usable and i + np.uint64(SIXTEEN) <= last:
            odd, end = _bound_sixteen(near, eye, balls, i, columns, records, end, boxes)
        if odd:
            stop = min(i + np.uint64(SIXTEEN), np.uint64(last))
            for eight in range(i, stop, np.uint64(WIDTH)):
                _bound_eight(lens, eye, reach, kappa, balls, eight, boxes)
                for k in range(eight, min(eight + np.uint64(WIDTH), stop)):
                    at = np.uint64(4) * (k - eight)
                    if boxes[at] < 0:
                        slow[slows] = k
                        slows += 1
                    else:
                        end = _record(boxes, at, np.uint64(1), np.int32(k), columns, records, end)
        i += np.uint64(SIXTEEN)
    return end, slows


@inlined
def _bound_sixteen(near, eye, balls, i, columns, records, end, boxes):
    """Record sixteen spheres, unless one is not for single precision; returns whether that is so, and the new end."""
    x, y, z, r = load_rows(balls, i)
    x2, y2, z2, r2 = load_rows(balls, i + np.uint64(WIDTH))
    x, y, z = singles(x - eye[0], x2 - eye[0]), singles(y - eye[1], y2 - eye[1]), singles(z - eye[2], z2 - eye[2])
    left, right, top, bottom, ahead, fit = _glance(near, x, y, z, singles(r, r2))
    odd = np.int32(bits_of(~fit))
    if odd:
        return odd, end
    shown = ahead & (left < right) & (top < bottom)
    box = whole_numbers(left), whole_numbers(right), whole_numbers(top), whole_numbers(bottom)
    left, right, top, bottom = box
    column, row, shapes = left >> _WIDE, top >> _HIGH, ascending() + np.int32(i)
    beside, below = (right - 1 >> _WIDE) - column, (bottom - 1 >> _HIGH) - row
    few, right_too, below_too = shown & (beside < 2) & (below < 2), beside == 1, below == 1
    end = _record_some(box, column, row, few, shapes, columns, records, end)
    end = _record_some(box, column, row + 1, few & below_too, shapes, columns, records, end)
    if any_of(few & right_too):
        end = _record_some(box, column + 1, row, few & right_too, shapes, columns, records, end)
        end = _record_some(box, column + 1, row + 1, few & right_too & below_too, shapes, columns, records, end)
    many = np.int32(bits_of(shown & ~few))
    if many:
        store(boxes, 0, left)
        store(boxes, SIXTEEN, right)
        store(boxes, 2 * SIXTEEN, top)
        store(boxes, 3 * SIXTEEN, bottom)
    while many:
        lane = np.uint64(lowest_bit(many))
        many &= many - 1
        end = _record(boxes, lane, np.uint64(SIXTEEN), np.int32(i + lane), columns, records, end)
    return np.int32(0), end


@inlined
def _record_some(box, column, row, which, shapes, columns, records, end):
    """Record some of sixteen shapes, each in the tile of that column and row; returns the new end."""
    if end + SIXTEEN <= len(records.tiles):
        (left, right, top, bottom), x, y, at = box, column << _WIDE, row << _HIGH, np.uint64(end)
        left, right = greater(left - x, 0), lesser(right - x, TILE_WIDTH)
        high, low = greater(top - y, 0), lesser(bottom - y, TILE_HEIGHT)
        store_some(records.tiles, at, row * columns + column, which)
        store_some(records.corners, at, left | right << 8 | high << 16 | low << 24, which)
        store_some(records.shapes, at, shapes, which)
    return end + count_ones(np.int32(bits_of(which)))


@inlined
def _glance(near, x, y, z, radius):
    """Left, right, top, bottom of the boxes of sixteen spheres; which are ahead; which this is for."""
    u, v, w, four = near.u, near.v, near.w, radius * _FOUR
    across, up = _along(u, x, y, z), _along(v, x, y, z)
    depth = -_along(w, x, y, z)
    away, over = abs(depth), inverse(depth)
    across, up, rho = across * over, up * over, radius * over
    across2, up2, rho2 = across * across, up * up, rho * rho
    m, rest = across2 + up2 + _UNIT, _UNIT - rho2
    fit = (four < away) & (away > _NEAREST) & (away < _FARTHEST) & (m < _WIDEST)
    wider = times_plus(rho2, rough_inverse(rest), _UNIT) * near.focus
    half, pad = rho * wider * _ROUGH, times_plus(m, near.pad, near.slack)
    left, right = _pixels(across * wider + near.middle_x, half, across2 + rest, pad, near.width)
    top, bottom = _pixels(near.middle_y - up * wider, half, up2 + rest, pad, near.height)
    return left, right, top, bottom, depth > _ZERO, fit


@inlined
def _along(axis, x, y, z):
    return times_plus(x, axis[0], times_plus(y, axis[1], z * axis[2]))


@inlined
def _pixels(middle, half, square, pad, size):
    """The first pixel, and the one after the last, that may see an ellipse half · √square wide to both sides."""
    reach = times_plus(half, square * rough_inverse_root(square), pad)
    first, end = np.ceil(middle - reach), np.floor(middle + reach) + _UNIT
    return lesser(greater(first, _ZERO), size), lesser(greater(end, _ZERO), size)


@inlined
def _bound_eight(lens, eye, reach, kappa, balls, i, boxes):
    """Boxes of eight spheres: left, right, top, bottom of each; empty for what cannot be seen, left = −1 if slow."""
    x, y, z, radius = load_rows(balls, i)
    qx, qy, qz = x - eye[0], y - eye[1], z - eye[2]
    box = box_of(lens, qx, qy, qz, radius)
    c, square = side_of(qx, qy, qz, radius)
    quick = box.known & (box.ahead > 0.0) & (edge_of(c, square, reach, kappa) > 0.0)
    hidden = box.known & (box.ahead <= 0.0)
    if not all_of(box.known):
        hidden = hidden | beside(lens, qx, qy, qz, c, square, radius)
    left = select(quick, box.left, select(hidden, 0.0, _SLOW))
    store_boxes(boxes, np.uint64(0), left, select(quick, box.right, 0.0), box.top, box.bottom)


@called
def _record(boxes, at, step, shape, columns, records, end):
    """Record a shape, whose box is boxes[at], boxes[at + step], …, in each of its tiles; returns the new end."""
    left, right, top, bottom = boxes[at], boxes[at + step], boxes[at + step + step], boxes[at + step + step + step]
    if left < right and top < bottom:
        for row in range(top >> _HIGH, (bottom - 1 >> _HIGH) + 1):
            y = row << _HIGH
            high, low = max(top - y, 0), min(bottom - y, TILE_HEIGHT)
            for column in range(left >> _WIDE, (right - 1 >> _WIDE) + 1):
                x = column << _WIDE
                if end < len(records.tiles):
                    corners = max(left - x, 0) | min(right - x, TILE_WIDTH) << 8 | high << 16 | low << 24
                    records.tiles[end], records.corners[end] = row * columns + column, corners
                    records.shapes[end] = shape
                end += 1
    return end


@called
def record_boxes(boxes, first, columns, records):
    """Record shapes by their boxes, flat, the first of which has that number; returns as `bound`."""
    end = 0
    for k in range(np.uint64(len(boxes) // 4)):
        end = _record(boxes, np.uint64(4) * k, np.uint64(1), np.int32(first + k), columns, records, end)
    return end
