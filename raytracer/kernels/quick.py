"""A tile of small spheres in single precision: sixteen pixels at a time, and float64 for those that are not certain.

    list of the tile ── _look ──> batch   what is drawn of eight spheres
                                  table   what is shaded, a row a sphere
    batch  ── _draw  ──> depth    k of the nearest hit so far
                         number   which of the list that is
                         doubt    where single precision cannot tell
    doubt  ── _decide ─> number   in float64
    number ── _shade ──> colour   where the depth was, blocks of one sphere by `alike`; what is too close to another
                                  byte by shade_anew, in float64
    colour ── put_tile > bytes of the picture

A tile lies in `strips`. The formulas and the bounds of their errors are those of `quick`.
"""

import numpy as np

from raytracer.certified import approach, inner
from raytracer.kernels.alike import shade_alike, shade_alike_unchecked, tabulate
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import called, inlined, variant
from raytracer.kernels.desks import MOST
from raytracer.kernels.lanes import (
    SIXTEEN,
    WIDTH,
    align_stack,
    any_of,
    bits_of,
    blend,
    gather,
    gather_rows,
    load,
    load_low,
    mask_of,
    spread,
    store,
    store_pair,
    whole,
)
from raytracer.kernels.limits import largest, limits_of, no_extremes, widened
from raytracer.kernels.rough import inverse, twice_root
from raytracer.kernels.sixteen import (
    SIDE,
    beyond,
    both,
    columns_of_block,
    gather_to_columns,
    greater,
    load_columns,
    load_numbers,
    load_two,
    lowest_bit,
    mark_block,
    rough_inverse_root,
    rows_of_block,
    sixteen,
    smaller_size,
    spread_rows,
    store_halves,
    store_table,
    times_plus,
    two,
    whole_numbers,
)
from raytracer.kernels.strips import (
    PIXELS,
    STRIP,
    apart,
    bytes_of,
    fetch_row,
    is_in,
    list_pair,
    pixel_of,
    put_pixel,
    put_tile,
    start_of,
)
from raytracer.kernels.surfaces import diffuse_at, meet_spheres
from raytracer.kernels.visibility import AHEAD, corners_of, fetch, from_eye, holding, sphere_of
from raytracer.quick import FARTHEST, LIGHT, NEAREST, ONE_BYTE, coarseness_of, error_of, near_of
from raytracer.shading import to_byte
from raytracer.twofold import select

FEW_LATE = 256  # pixels to be shaded in float64: enough for a while
_MIDDLE, _MIDDLE_Y = TILE_WIDTH // 2, TILE_HEIGHT // 2
_ONE, _SIXTEEN = np.uint64(1), np.uint64(SIXTEEN)
_BORDER = np.float32(0.5 - 5.0 / ONE_BYTE)  # of two bytes, but for what roundings at the end add
_ZERO, _HALF, _UNIT, _THREE = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(3.0)
_STEP, _LARGEST_K = np.float32(SIDE), 1.31  # of a sphere, by that of its middle


def _paint_tile(view, slow, bins, tile, scratch, doubts, paints, out):
    """Paint a tile, unless it has something in it that single precision is not for; returns whether it is painted."""
    first, end, sheet = bins.starts[tile.number], bins.middles[tile.number], scratch.quick
    if not paints.quick.usable or len(slow.ids) or (of_some and len(out.wanted)) or end - first > MOST:
        return False
    if end < bins.starts[tile.number + 1]:
        return False
    fit, extremes = draw_all(view, bins, first, end, tile, paints, sheet)
    if not fit:
        sheet.doubt[:] = 0
        return False
    if certain:
        _decide(view, bins, tile, sheet, doubts)
    colour_all(view, bins, tile, extremes, paints, scratch, doubts, out)
    return True


def _draw_all(view, bins, first, end, tile, paints, sheet):
    """Fill the depth buffer; returns whether single precision is for all spheres, and the extremes of them."""
    align_stack()
    for p in range(np.uint64(0), PIXELS, _SIXTEEN):
        store(sheet.depth, p, spread(np.float32(np.inf)))
        store(sheet.number, p, sixteen(0))
    store(sheet.table, 0, spread(_ZERO))
    tie, extremes, s = (0.0, 0.0), no_extremes(), _longest(paints.quick, tile) / paints.quick.focus
    for at in range(first, end, WIDTH):
        count, row = min(WIDTH, end - at), np.uint64(at - first)
        listed = mask_of((1 << count) - 1)
        unfit, tie, blur, radius, depth = look(view, bins, np.uint64(at), row, tile, s, listed, tie, paints, sheet)
        if any_of(unfit & listed):
            return False, extremes
        extremes = widened(extremes, listed, blur, radius, depth)
        for j in range(np.uint64(0), np.uint64(count)):
            place = np.uint64(at) + j
            fetch(view, sphere_of(bins.entries[place + np.uint64(AHEAD)]))
            draw(bins.entries[place], np.int32(row + j + _ONE), j, sheet)
    return True, extremes


def _look(view, bins, at, row, tile, s, listed, tie, paints, sheet):
    """Work out what is drawn and shaded of the next eight spheres of a list.

    Returns for which of them single precision is not; how much k may be off by now, and 1 by the root of that; and
    1 / w, radius and depth.
    """
    quick, batch, where = paints.quick, sheet.batch, load_low(bins.entries, at)
    x, y, z, radius = gather_rows(view.balls, where)
    x, y, z = x - view.eye[0], y - view.eye[1], z - view.eye[2]
    depth, pixel = -inner(quick.w[0], quick.w[1], quick.w[2], x, y, z), 1.0 / quick.focus
    once = 1.0 / (depth * radius)
    over, over_rho = once * radius, once * depth * depth
    u = inner(quick.u[0], quick.u[1], quick.u[2], x, y, z) * over
    v = inner(quick.v[0], quick.v[1], quick.v[2], x, y, z) * over
    rho, blur = radius * over, over_rho * pixel
    u2, v2, rho2 = u * u, v * v, rho * rho
    m, error, scale, half = 1.0 + u2 + v2, error_of(quick.steep, rho, blur), 1.0, -0.5 * radius
    if certain:
        near = largest(select(listed, near_of(rho, error), 0.0))
        if near > tie[0]:  # a branch that is seldom taken: else all that is drawn would wait for the largest of eight
            tie = near, 1.0 / np.sqrt(near)
        ratio = error * over * (4.0 / _LARGEST_K)  # of the two limits, but for the tie
        scale, half = tie[0] / ratio, half * tie[1] * np.sqrt(ratio)
    square, step = blur * blur * scale, pixel * scale
    unfit = ~((depth > NEAREST) & (depth < FARTHEST) & (rho <= 0.25) & (blur < 128.0) & (m < quick.widest))
    middle_x = u * quick.focus + (quick.middle_x - (tile.left + _MIDDLE))
    middle_y = (quick.middle_y - (tile.top + _MIDDLE_Y)) - v * quick.focus
    whole_x, whole_y = np.floor(middle_x), np.floor(middle_y)
    store_halves(batch, 0, whole_x)
    store_halves(batch, 8, middle_x - whole_x)
    store_halves(batch, 16, whole_y)
    store_halves(batch, 24, middle_y - whole_y)
    store_halves(batch, 32, m * scale)
    store_halves(batch, 40, u * (step + step))
    store_halves(batch, 48, -v * (step + step))
    store_halves(batch, 56, (1.0 + v2 - rho2) * square)
    store_halves(batch, 64, u * v * (square + square))
    store_halves(batch, 72, (1.0 + u2 - rho2) * square)
    store_halves(batch, 80, depth * m)
    store_halves(batch, 88, depth * u * pixel)
    store_halves(batch, 96, depth * v * -pixel)
    store_halves(batch, 104, half)
    if certain:
        store_halves(batch, 112, (_LARGEST_K * tie[0]) * (depth * m))
    if shades:
        parts = np.float64(quick.parts)
        large, by_colour = rho * (quick.focus * parts), (255.0 / parts) * blur
        red, green, blue, _ = gather_rows(paints.colours, gather(view.material, where))
        brightest = 255.0 * greater(greater(red, green), blue)
        off = coarseness_of(quick.parts, blur, s, quick.focus, quick.widest) * brightest
        store_table(
            sheet.table, row + _ONE, middle_x * parts, middle_y * parts, large, depth * (pixel / parts),
            red * by_colour, green * by_colour, blue * by_colour, off,
        )  # fmt: skip
    return unfit, tie, blur, radius, depth


def _draw(entry, number, j, sheet):
    """Draw the sphere of an entry, number j of the eight that were looked at."""
    b, eight = sheet.batch, np.uint64(8)
    start, stop, high, low = corners_of(entry)
    columns, rows = columns_of_block() - b[eight + j], rows_of_block() - b[np.uint64(24) + j]
    middle, e1, e2, xx = b[np.uint64(32) + j], b[np.uint64(40) + j], b[np.uint64(48) + j], b[np.uint64(56) + j]
    xy, yy, k0, k1 = b[np.uint64(64) + j], b[np.uint64(72) + j], b[np.uint64(80) + j], b[np.uint64(88) + j]
    k2, half, rim = b[np.uint64(96) + j], b[np.uint64(104) + j], b[np.uint64(112) + j]
    own = sixteen(number)
    left, right = start // SIDE, (stop + SIDE - 1) // SIDE
    lines = (low - high + SIDE - 1) // SIDE
    top = min(high, TILE_HEIGHT - SIDE * lines)
    for line in range(top, top + SIDE * lines, SIDE):
        y = rows + (np.float32(line - _MIDDLE_Y) - b[np.uint64(16) + j])
        of_row, slope = times_plus(y, times_plus(y, -yy, spread(e2)), spread(middle)), times_plus(y, -xy, spread(e1))
        k_row, shift = times_plus(y, spread(k2), spread(k0)), np.float32(SIDE * left - _MIDDLE) - b[j]
        p = np.uint64(STRIP * left + SIDE * line)
        for _ in range(right - left):
            x, best = columns + shift, load(sheet.depth, p)
            disc = times_plus(x, times_plus(x, -xx, slope), of_row)
            root = twice_root(disc, rough_inverse_root(disc))
            k = times_plus(root, half, times_plus(x, spread(k1), k_row))
            wins = k < best
            store(sheet.depth, p, blend(wins, k, best))
            store(sheet.number, p, blend(wins, own, load_numbers(sheet.number, p)))
            if certain:
                unsure = smaller_size(disc, k - best) <= rim  # also where k is not a number
                if any_of(unsure):
                    mark_block(sheet.doubt, p // np.uint64(SIDE), bits_of(unsure))
            shift += _STEP
            p += np.uint64(STRIP)


@called
def _decide(view, bins, tile, sheet, doubts):
    """Decide in float64 what single precision could not tell, and list what float64 cannot tell either."""
    width = len(view.across) - WIDTH
    for some in range(np.uint64(0), np.uint64(len(sheet.doubt)), _SIXTEEN):
        fours = np.int32(bits_of(load_numbers(sheet.doubt, some) > 0))
        while fours:
            four = some + np.uint64(lowest_bit(fours))
            fours &= fours - 1
            bits = sheet.doubt[four]
            sheet.doubt[four] = 0
            while bits:
                bit = lowest_bit(bits)
                bits &= bits - 1
                p = (np.int32(four) * 4 + bit // 8) * SIDE + bit % 8
                x, y = pixel_of(p)
                if is_in(tile, x, y):
                    number, unsure = _first_of(view, bins, tile, x, y)
                    sheet.number[p] = number
                    if unsure:
                        doubts[0] += 1
                        doubts[doubts[0]] = (tile.top + y) * width + tile.left + x


@called
def _first_of(view, bins, tile, x, y):
    """Which of a tile's list one of its pixels sees, counted from 1; and whether float64 cannot tell."""
    best, number, unsure, balls = np.inf, 0, False, view.balls
    across, up, row = view.across[tile.left + x], view.up[tile.top + y], tile.top + y
    a = (across * view.a2 + view.a1[row]) * across + view.a0[row]
    first, end = bins.starts[tile.number], bins.middles[tile.number]
    for some in range(first, end, WIDTH):
        bits = holding(bins.entries, some, end, x, y)
        while bits:
            place = some + lowest_bit(bits) // 2
            bits &= bits - 1
            i = np.uint64(4) * sphere_of(bins.entries[place])
            radius = balls[i + np.uint64(3)]
            hu, hv, hw, c, edge = from_eye(view, balls[i], balls[i + _ONE], balls[i + np.uint64(2)], radius)
            k, wins, doubt = approach(across * hu + (up * hv + hw), a, c, edge, best)
            unsure |= doubt
            if wins:
                best, number = k, place - first + 1
    return number, unsure


def _colour_all(view, bins, tile, extremes, paints, scratch, doubts, out):
    """Colours, and then bytes."""
    align_stack()
    sheet = scratch.quick
    count = colour_tile(view, bins, tile, extremes, paints, sheet, out)
    put_tile(tile, sheet, out)
    _keep_for_later(bins, tile, count, sheet)


@inlined
def _flat(view, bins, tile, extremes, paints, sheet, out):
    """One colour wherever anything is hit."""
    flat, background = sixteen(paints.quick.flat), sixteen(paints.quick.background)
    for p in range(np.uint64(0), PIXELS, _SIXTEEN):
        store(sheet.colour, p, blend(load_numbers(sheet.number, p) > 0, flat, background))
    return 0


def _shade(view, bins, tile, extremes, paints, sheet, out):
    """`stages.diffuse`; meanwhile the processor fetches where the bytes go.

    Returns how many pairs of blocks have been listed that have pixels close to another byte.
    """
    quick = paints.quick
    (alike, mixed), done, close = _sort_blocks(sixteen(quick.background), sheet), np.uint64(0), 0
    first, end, longest = bins.starts[tile.number], bins.middles[tile.number], _longest(quick, tile)
    worth = end - first <= np.int64(alike)  # else the numbers of all spheres cost more than they save
    if worth and tabulate(view, bins, first, end, tile, longest / quick.focus, paints, sheet.numbers):
        done, close = alike, shade_alike(tile, alike, quick, sheet, out)
    of_slope, of_all, steepest = limits_of(quick, tile, longest, extremes)
    columns, rows, parts = both(columns_of_block()) - _MIDDLE, both(rows_of_block()) - _MIDDLE_Y, np.int32(quick.parts)
    us = (columns + np.float32(tile.left + _MIDDLE - quick.middle_x)) * np.float32(parts)
    vs = (np.float32(quick.middle_y - tile.top - _MIDDLE_Y) - rows) * np.float32(parts)
    columns, rows = whole_numbers(columns) * parts, whole_numbers(rows) * parts
    for k in range(done, alike + mixed, np.uint64(2)):
        fetch_row(tile, tile.top + np.int64(k) // 2, out)
        p, q = np.uint64(sheet.blocks[k]), np.uint64(sheet.blocks[k + _ONE])
        if k < alike:
            spread_rows(sheet.table, sheet.firsts[k], sheet.firsts[k + _ONE], sheet.columns)
        else:
            gather_to_columns(sheet.table, sheet.number, p, q, sheet.columns)
        (x, y), (x2, y2) = pixel_of(np.int64(p)), pixel_of(np.int64(q))
        x, x2, y, y2 = np.int32(x) * parts, np.int32(x2) * parts, np.int32(y) * parts, np.int32(y2) * parts
        u, v = us + two(np.float32(x), np.float32(x2)), vs - two(np.float32(y), np.float32(y2))
        colour, steep, off = _light(quick, sheet, columns + two(x, x2), rows + two(y, y2), u, v)
        hit = load_two(sheet.number, p, q) > 0
        store_pair(sheet.colour, p, q, blend(hit, bytes_of(*colour), quick.background))
        if certain:
            limit = times_plus(times_plus(steep, -of_slope, -of_all), off, _BORDER)
            sure = (apart(*colour) < limit) & (steep < steepest)
            close = list_pair(sheet, close, k, bits_of(hit & ~sure))
    return close


@inlined
def _sort_blocks(background, sheet):
    """List the blocks of 4 × 4 pixels that show but one sphere, and which, then those that show several.

    Returns how many they are, whole pairs both; what shows nothing becomes background.
    """
    alike, mixed = np.uint64(0), np.uint64(0)
    for p in range(np.uint64(0), PIXELS, _SIXTEEN):
        store(sheet.colour, p, background)
        numbers = load_numbers(sheet.number, p)
        hit = np.int32(bits_of(numbers > 0))
        first = sheet.number[p + np.uint64(lowest_bit(hit | 1 << SIXTEEN) % SIXTEEN)]
        is_alike = bits_of(numbers == first) == hit  # never where nothing is hit
        sheet.blocks[alike], sheet.firsts[alike], sheet.mixed[mixed] = p, first, p
        alike += np.uint64(is_alike)
        mixed += np.uint64((hit > 0) & (not is_alike))
    sheet.blocks[alike] = sheet.blocks[max(alike, _ONE) - _ONE]
    sheet.firsts[alike] = sheet.firsts[max(alike, _ONE) - _ONE]
    sheet.mixed[mixed] = sheet.mixed[max(mixed, _ONE) - _ONE]
    alike, mixed = alike + (alike & _ONE), mixed + (mixed & _ONE)
    for k in range(mixed):
        sheet.blocks[alike + k] = sheet.mixed[k]
    return alike, mixed


@inlined
def _longest(quick, tile):
    """The length in pixels of the longest ray of a tile."""
    u = max(abs(tile.left - quick.middle_x), abs(tile.right - quick.middle_x))
    v = max(abs(tile.top - quick.middle_y), abs(tile.bottom - quick.middle_y))
    return np.sqrt(u * u + v * v + quick.focus * quick.focus)


@inlined
def _light(quick, sheet, x, y, u, v):
    """Three channels of two blocks of pixels, from 0 to 255; w / √disc, and c₁ times the sphere's brightest channel.

    Lengths are in parts of a pixel: x and y from the middle of the tile, u and v from that of the picture, so that the
    ray is (u, v, −focus).
    """
    at_x, at_y, size, unit, r, g, b, off = load_columns(sheet.columns)
    fine = quick.focus * quick.parts
    focus, focus2, du, down = np.float32(fine), np.float32(fine * fine), beyond(x, at_x), beyond(y, at_y)
    along, a, size2 = times_plus(du, u, -(down * v)), times_plus(u, u, times_plus(v, v, focus2)), size * size
    disc = times_plus(along, along, a * (size2 - times_plus(du, du, down * down)))
    rough = rough_inverse_root(disc)
    tau = times_plus(twice_root(disc, rough), _HALF, along) * inverse(a)  # −τ
    t, nu, nv, nw = times_plus(-tau, unit, unit), times_plus(-tau, u, du), times_plus(-tau, v, -down), tau * focus
    pu, pv, pw = t * u, t * v, t * focus
    light, nothing = quick.lights, both(spread(_ZERO))
    red, green, blue = nothing, nothing, nothing
    for i in range(np.uint64(0), np.uint64(len(light)), np.uint64(LIGHT)):
        tu, tv, tw = light[i] - pu, light[i + _ONE] - pv, light[i + np.uint64(2)] + pw
        facing = times_plus(nu, tu, times_plus(nv, tv, nw * tw))
        square = times_plus(tu, tu, times_plus(tv, tv, tw * tw))
        rough_length = rough_inverse_root(square)
        shine = greater(facing, _ZERO) * rough_length * times_plus(-(square * rough_length), rough_length, _THREE)
        red = times_plus(shine, light[i + np.uint64(3)], red)
        green = times_plus(shine, light[i + np.uint64(4)], green)
        blue = times_plus(shine, light[i + np.uint64(5)], blue)
    return (red * r, green * g, blue * b), rough * size, off


@called
def _keep_for_later(bins, tile, count, sheet):
    """List the pixels of a tile that are to be shaded in float64, from so many pairs of blocks."""
    late, last = sheet.late[0], bins.starts[tile.number] - 1
    for k in range(count):
        bits = sheet.bits[k]
        while bits:
            bit = lowest_bit(bits)
            p = sheet.blocks[sheet.close[k] + bit // SIXTEEN] + bit % SIXTEEN
            bits = np.int32(bits & (bits - 1))  # of which the highest is the sign
            x, y = pixel_of(p)
            if is_in(tile, x, y):
                sheet.late_columns[late], sheet.late_rows[late] = tile.left + x, tile.top + y
                sheet.spheres[late] = sphere_of(bins.entries[last + sheet.number[p]])
                late += 1
    sheet.late[0] = late


@called
def shade_anew(view, paints, scratch, doubts, out):
    """Shade the pixels that have been listed for that in float64, eight at a time.

    Not at once: what has just been written, a number after the other, cannot be read as a vector before all stores that
    wait for the picture's memory are done. What float64 is not certain of is added to the list of doubts.
    """
    sheet = scratch.quick
    count, sheet.late[0], width = sheet.late[0], 0, len(view.across) - WIDTH
    pad_late(sheet, count)
    for k in range(np.uint64(0), np.uint64(count), np.uint64(WIDTH)):
        where, rows, columns = load(sheet.spheres, k), load(sheet.late_rows, k), load(sheet.late_columns, k)
        t, direction, doubt = meet_spheres(view, rows, columns, where)
        bits = np.int32(bits_of(doubt)) & (1 << min(count - np.int64(k), WIDTH)) - 1
        while bits:
            pixel = k + np.uint64(lowest_bit(bits))
            bits &= bits - 1
            doubts[0] += 1
            doubts[doubts[0]] = sheet.late_rows[pixel] * width + sheet.late_columns[pixel]
        shade_late(view, paints, direction, t, k, scratch)
    put_late(sheet, count, out)


@inlined
def pad_late(sheet, count):
    """Pixels and spheres are read eight at a time."""
    for spare in range(count, count + WIDTH):
        sheet.late_columns[spare], sheet.late_rows[spare] = sheet.late_columns[0], sheet.late_rows[0]
        sheet.spheres[spare] = sheet.spheres[0]


@inlined
def shade_late(view, paints, direction, t, k, scratch):
    """Put colours in the place of eight spheres, from number k on, as `surfaces.diffuse_of` shades them."""
    sheet = scratch.quick
    where, columns = load(sheet.spheres, k), load(sheet.late_columns, k)
    red, green, blue = diffuse_at(view, paints, direction, t, columns, where, scratch)
    red, green, blue = whole(to_byte(red)), whole(to_byte(green)), whole(to_byte(blue))
    store(sheet.spheres, k, red + green * 256 + blue * 65536)


@inlined
def put_late(sheet, count, out):
    """Put so many of those colours where their pixels are."""
    for k in range(count):
        put_pixel(out, start_of(out, sheet.late_rows[k], sheet.late_columns[k]), sheet.spheres[k])


@inlined
def nothing_left(view, paints, scratch, doubts, out):
    """Where nothing has been put off."""


_certain_sphere = variant(_draw, "_certain_sphere", inlined, certain=True)
_unchecked_sphere = variant(_draw, "_unchecked_sphere", inlined, certain=False)
_look_at_shape = variant(_look, "_look_at_shape", inlined, certain=True, shades=False)
_look_at_all = variant(_look, "_look_at_all", inlined, certain=True, shades=True)
_look_unchecked = variant(_look, "_look_unchecked", inlined, certain=False, shades=True)
_draw_shapes = variant(_draw_all, "_draw_shapes", draw=_certain_sphere, look=_look_at_shape)
_draw_certain = variant(_draw_all, "_draw_certain", draw=_certain_sphere, look=_look_at_all)
_draw_unchecked = variant(_draw_all, "_draw_unchecked", draw=_unchecked_sphere, look=_look_unchecked)
_shade_certain = variant(_shade, "_shade_certain", inlined, certain=True, shade_alike=shade_alike)
_shade_unchecked = variant(_shade, "_shade_unchecked", inlined, certain=False, shade_alike=shade_alike_unchecked)
_colour_flat = variant(_colour_all, "_colour_flat", colour_tile=_flat)
_colour_certain = variant(_colour_all, "_colour_certain", colour_tile=_shade_certain)
_colour_unchecked = variant(_colour_all, "_colour_unchecked", colour_tile=_shade_unchecked)


def _quickly(name, draw_all, colour_all, certain=True, of_some=True):
    """How to paint a tile quickly; `of_some` says whether `out` has `wanted`, as a picture of which some pixels are."""
    return variant(_paint_tile, name, draw_all=draw_all, colour_all=colour_all, certain=certain, of_some=of_some)


def hits_quickly(name, put_all):
    """How to put what a tile's pixels hit somewhere, as numbers of the tile's list."""
    return _quickly(name, _draw_shapes, put_all, of_some=False)


flat_quickly = _quickly("flat_quickly", _draw_shapes, _colour_flat)
diffuse_quickly = _quickly("diffuse_quickly", _draw_certain, _colour_certain)
diffuse_quickly_unchecked = _quickly("diffuse_quickly_unchecked", _draw_unchecked, _colour_unchecked, certain=False)


@inlined
def never_quickly(view, slow, bins, tile, scratch, doubts, paints, out):
    """For what single precision is not for."""
    return False
