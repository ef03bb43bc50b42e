"""Blocks of 4 × 4 pixels that show one sphere each, in single precision, two at a time.

    list of the tile ── tabulate ──> numbers   eight spheres at a time: what their pixels share, then for each light
    blocks, firsts   ── _shade   ──> colour

The formulas and the bounds of their errors are those of `alike`.
"""

import numpy as np

from raytracer.alike import NEAREST_LIGHT, bounds_of, cubic_error, cubic_of, least_error, rim_error
from raytracer.certified import inner
from raytracer.kernels.compiler import called, inlined, variant
from raytracer.kernels.lanes import WIDTH, bits_of, blend, gather, gather_rows, load_low, spread, store_pair
from raytracer.kernels.rough import inverse, twice_root
from raytracer.kernels.sixteen import (
    both,
    columns_of_block,
    greater,
    load_two,
    rough_inverse_root,
    rows_of_block,
    store_halves,
    times_plus,
    two,
)
from raytracer.kernels.strips import apart, bytes_of, fetch_row, list_pair, pixel_of
from raytracer.quick import ONE_BYTE, U

_X_REST, _X_WHOLE, _Y_REST, _Y_WHOLE, _X_SLOPE, _Y_SLOPE, _START, _SIZE2 = range(8)
_B, _TWICE_ROOT_B, _ROOT_B, _RIM_ERROR, _SURE, _RIM, _OF_A_SPHERE = range(8, 15)
_ACROSS, _DOWN, _ALONG, _CUBIC, _COLOUR, _OF_A_LIGHT = 0, 1, 2, 3, 7, 10
_EIGHT, _ONE = np.uint64(WIDTH), np.uint64(1)
_ZERO, _HALF, _UNIT = np.float32(0.0), np.float32(0.5), np.float32(1.0)


@inlined
def _put(table, batch, column, lanes):
    """A number of eight spheres."""
    store_halves(table, (batch + np.uint64(column)) * _EIGHT, lanes)


@called
def tabulate(view, bins, first, end, tile, s, paints, numbers):
    """Work out the numbers of all spheres of a list; returns whether there is room, and lights are far enough away."""
    quick, (sigma, tilt) = paints.quick, bounds_of(s)
    of_a_batch = np.uint64(_OF_A_SPHERE + _OF_A_LIGHT * len(paints.lights))
    if np.uint64(end - first + WIDTH) * of_a_batch > np.uint64(len(numbers)):
        return False
    batch, nearest = np.uint64(0), spread(0.0)
    for at in range(np.uint64(first), np.uint64(end), _EIGHT):
        where = load_low(bins.entries, at)
        x, y, z, radius = gather_rows(view.balls, where)
        x, y, z = x - view.eye[0], y - view.eye[1], z - view.eye[2]
        over = -1.0 / inner(quick.w[0], quick.w[1], quick.w[2], x, y, z)
        pixels, rho = quick.focus * over, radius * over
        across = inner(quick.u[0], quick.u[1], quick.u[2], x, y, z) * pixels
        down = -inner(quick.v[0], quick.v[1], quick.v[2], x, y, z) * pixels
        size = radius * pixels
        size2 = size * size
        b = across * across + down * down + (quick.focus * quick.focus - size2)
        root = np.sqrt(b)
        over_root, blur = 1.0 / root, 1.0 / size
        column, row = across + (quick.middle_x - tile.left), down + (quick.middle_y - tile.top)
        whole_column, whole_row = np.floor(column), np.floor(row)
        _put(numbers, batch, _X_REST, column - whole_column)
        _put(numbers, batch, _X_WHOLE, whole_column)
        _put(numbers, batch, _Y_REST, row - whole_row)
        _put(numbers, batch, _Y_WHOLE, whole_row)
        _put(numbers, batch, _X_SLOPE, across * over_root)
        _put(numbers, batch, _Y_SLOPE, down * over_root)
        _put(numbers, batch, _START, size2 * over_root)
        _put(numbers, batch, _SIZE2, size2)
        _put(numbers, batch, _B, b)
        _put(numbers, batch, _TWICE_ROOT_B, root + root)
        _put(numbers, batch, _ROOT_B, root)
        red, green, blue, _ = gather_rows(paints.colours, gather(view.material, where))
        colour, light = (255.0 * red, 255.0 * green, 255.0 * blue), batch + np.uint64(_OF_A_SPHERE)
        weight, error, near = _tabulate_lights(quick, paints.lights, numbers, light, x, y, z, radius, blur, colour)
        nearest = greater(nearest, near)
        brightest = greater(greater(colour[0], colour[1]), colour[2])
        p, f = (abs(across) + abs(down)) * over_root, quick.focus * blur
        rim = rim_error(sigma, p, rho, blur) + (2.0**-53 * quick.widest) * f * f
        spare = (5.0 + 2.0 * len(paints.lights)) / ONE_BYTE
        least = brightest * (weight * least_error(sigma, tilt, p, rho, blur) + error)
        _put(numbers, batch, _RIM_ERROR, brightest * weight * (1.035 * (rho + 1.0)) * rim * size)
        _put(numbers, batch, _SURE, (0.5 - spare) - least)
        _put(numbers, batch, _RIM, 18.0 * rim * size2)
        batch += of_a_batch
    return bits_of(nearest < 1.0 / NEAREST_LIGHT) == (1 << WIDTH) - 1


@inlined
def _tabulate_lights(quick, lights, numbers, light, x, y, z, radius, blur, colour):
    """The numbers of eight spheres that are another for each light.

    Returns the sums of the lights' strengths, times how much an error of V matters, and of their own errors; and ε of
    the nearest light.
    """
    weight, error, nearest = spread(0.0), spread((2.0 * U) * quick.weight), spread(0.0)
    for i in range(len(lights)):
        tx, ty, tz = lights[i, 0] - x, lights[i, 1] - y, lights[i, 2] - z
        nearness = 1.0 / np.sqrt(inner(tx, ty, tz, tx, ty, tz))
        epsilon, by_size = radius * nearness, nearness * blur
        nearest = greater(nearest, epsilon)
        _put(numbers, light, _ACROSS, inner(quick.u[0], quick.u[1], quick.u[2], tx, ty, tz) * by_size)
        _put(numbers, light, _DOWN, -inner(quick.v[0], quick.v[1], quick.v[2], tx, ty, tz) * by_size)
        _put(numbers, light, _ALONG, inner(x, y, z, tx, ty, tz) * nearness / radius)
        for k, coefficient in enumerate(cubic_of(epsilon)):
            _put(numbers, light, _CUBIC + k, coefficient)
        for channel in range(3):
            _put(numbers, light, _COLOUR + channel, colour[channel] * lights[i, 3 + channel])
        strength, slope = max(lights[i, 3], lights[i, 4], lights[i, 5]), epsilon * 3.0 + 1.0
        weight = weight + strength * slope
        error = error + strength * (slope * (4.3 * U) + cubic_error(epsilon) + nearness * (quick.far * 2.0**-20))
        light += np.uint64(_OF_A_LIGHT)
    return weight, error, nearest


def _shade(tile, count, quick, sheet, out):
    """`stages.diffuse` of so many blocks; meanwhile the processor fetches where the bytes go.

    Returns how many pairs have been listed that have pixels close to another byte.
    """
    numbers, close, lights = sheet.numbers, 0, np.uint64(len(quick.lights)) // _EIGHT
    columns, rows = both(columns_of_block()), both(rows_of_block())
    for k in range(np.uint64(0), count, np.uint64(2)):
        fetch_row(tile, tile.top + np.int64(k) // 2, out)
        p, q = np.uint64(sheet.blocks[k]), np.uint64(sheet.blocks[k + _ONE])
        at = _place_of(sheet.firsts[k], lights), _place_of(sheet.firsts[k + _ONE], lights)
        (column, row), (column2, row2) = pixel_of(np.int64(p)), pixel_of(np.int64(q))
        x = columns + (two(np.float32(column), np.float32(column2)) - _number(numbers, at, _X_WHOLE))
        y = rows + (two(np.float32(row), np.float32(row2)) - _number(numbers, at, _Y_WHOLE))
        x, y = x - _number(numbers, at, _X_REST), y - _number(numbers, at, _Y_REST)
        e = times_plus(y, _number(numbers, at, _Y_SLOPE), _number(numbers, at, _START))
        e = times_plus(x, _number(numbers, at, _X_SLOPE), e)
        h = times_plus(-x, x, times_plus(-y, y, _number(numbers, at, _SIZE2)))
        disc = times_plus(e, e, h)
        rough = rough_inverse_root(disc)
        a = times_plus(e, _number(numbers, at, _TWICE_ROOT_B), _number(numbers, at, _B) - h)
        root = times_plus(twice_root(disc, rough), _HALF, e)
        tau = times_plus(root, _number(numbers, at, _ROOT_B), -h) * inverse(a)  # −τ
        red, green, blue = _lights(numbers, at, lights, x, y, tau)
        hit = load_two(sheet.number, p, q) > 0
        store_pair(sheet.colour, p, q, blend(hit, bytes_of(red, green, blue), quick.background))
        if certain:
            limit = times_plus(-rough, _number(numbers, at, _RIM_ERROR), _number(numbers, at, _SURE))
            bits = bits_of(hit & ~((apart(red, green, blue) < limit) & (disc > _number(numbers, at, _RIM))))
            close = list_pair(sheet, close, k, bits)
    return close


@inlined
def _lights(numbers, at, lights, x, y, tau):
    """What all lights together give to three channels, from 0 to 255."""
    along, nothing = _UNIT - tau, both(spread(_ZERO))
    red, green, blue = nothing, nothing, nothing
    for i in range(lights):
        light = np.uint64(_OF_A_SPHERE) + i * np.uint64(_OF_A_LIGHT)
        slope = times_plus(x, _number(numbers, at, light), y * _number(numbers, at, light + np.uint64(_DOWN)))
        v = times_plus(slope, along, -(tau * _number(numbers, at, light + np.uint64(_ALONG))))
        cubic, colour = light + np.uint64(_CUBIC), light + np.uint64(_COLOUR)
        shine = times_plus(v, _number(numbers, at, cubic + np.uint64(3)), _number(numbers, at, cubic + np.uint64(2)))
        shine = times_plus(times_plus(v, shine, _number(numbers, at, cubic + _ONE)), v, _number(numbers, at, cubic))
        shine = greater(shine, _ZERO)
        red = times_plus(shine, _number(numbers, at, colour), red)
        green = times_plus(shine, _number(numbers, at, colour + _ONE), green)
        blue = times_plus(shine, _number(numbers, at, colour + np.uint64(2)), blue)
    return red, green, blue


@inlined
def _place_of(number, lights):
    """Where the numbers of a sphere of the list begin, which is counted from 1."""
    nth = np.uint64(number) - _ONE
    batch = nth // _EIGHT
    return batch * _EIGHT * (np.uint64(_OF_A_SPHERE) + np.uint64(_OF_A_LIGHT) * lights) + (nth - batch * _EIGHT)


@inlined
def _number(numbers, places, n):
    """Number n of two spheres, each for sixteen pixels."""
    first, second = places
    n = np.uint64(n) * _EIGHT
    return two(numbers[first + n], numbers[second + n])


shade_alike = variant(_shade, "shade_alike", certain=True)
shade_alike_unchecked = variant(_shade, "shade_alike_unchecked", certain=False)
