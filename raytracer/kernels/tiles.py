"""Tiles to pixels: what a tile's depth buffer holds becomes colours, or hits, or nothing but a background.

    boxes, lists ─ see_tile ─> k, index ─ a painter ─> bytes of a picture, or t and index of hits

A painter does one tile, a row at a time, eight pixels at a time. Doubtful pixels are listed, and painted all the same:
whoever called decides them and paints them anew.
"""

import numpy as np

from raytracer.arrays import Tile
from raytracer.certified import fine_direction, refine
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import borrowing, inlined, variant
from raytracer.kernels.full import radiance
from raytracer.kernels.lanes import (
    WIDTH,
    any_of,
    at_least,
    first_of,
    gather,
    gather_rows,
    is_hit,
    largest_of,
    load,
    put_pixels,
    same,
    spread,
    store,
    take_number,
)
from raytracer.kernels.visibility import STRIDE, list_doubts, see_tile, see_tile_unchecked
from raytracer.shading import cosine, land, land_on_any, to_byte, towards
from raytracer.twofold import select


def _paint(view, slow, bins, tiles, scratch, doubts, paints, out):
    """Paint tiles, as long as there are any and there is room for doubts; returns whether all are done, or taken."""
    while len(doubts) - doubts[0] > TILE_WIDTH * TILE_HEIGHT:
        number = take_number(tiles.next)
        if number >= tiles.last:
            return True
        tile = _tile(view, bins, number)
        if len(slow.ids) == 0 and bins.starts[number] == bins.starts[number + 1]:
            fill_tile(scratch, tile, paints, out)
            continue
        if see(view, slow, bins, tile, scratch):
            list_doubts(view, tile, scratch, doubts)
        paint_tile(view, scratch, tile, paints, out)
    return False


@inlined
def _tile(view, bins, number):
    left, top = number % bins.columns * TILE_WIDTH, number // bins.columns * TILE_HEIGHT
    width, height = len(view.across) - WIDTH, len(view.up) - 1
    return Tile(number, left, top, min(left + TILE_WIDTH, width), min(top + TILE_HEIGHT, height))


@inlined
def put_lanes(out, row, x, right, red, green, blue, scratch):
    """Eight pixels from x on, or as many as there are before `right`."""
    start = np.uint64((row - out.first_row) * out.row_bytes + x * out.pixel_bytes)
    if x + WIDTH <= right and x + WIDTH <= out.columns:
        put_pixels(out.bytes, start, np.uint64(out.pixel_bytes), red, green, blue)
    else:
        put_pixels(scratch.rest, np.uint64(0), np.uint64(3), red, green, blue)
        for pixel in range(right - x):
            for colour in range(3):
                out.bytes[start + np.uint64(pixel * out.pixel_bytes + colour)] = scratch.rest[3 * pixel + colour]


@inlined
def _background(paints):
    """Taken out of the loops by hand: for all the compiler knows, to paint changes it."""
    return spread(paints.background[0]), spread(paints.background[1]), spread(paints.background[2])


@borrowing
def _fill_tile(scratch, tile, paints, out):
    """The background."""
    red, green, blue = _background(paints)
    for row in range(tile.top, tile.bottom):
        for x in range(tile.left, tile.right, WIDTH):
            put_lanes(out, row, x, tile.right, red, green, blue, scratch)


@borrowing
def _flat_tile(view, scratch, tile, paints, out):
    """One colour wherever anything is hit."""
    background, flat = _background(paints), paints.flat
    colour = spread(flat[0]), spread(flat[1]), spread(flat[2])
    for row in range(tile.top, tile.bottom):
        for x in range(tile.left, tile.right, WIDTH):
            hit = is_hit(load(scratch.index, _place(tile, row, x)))
            red, green, blue = _over(background, hit, *colour)
            put_lanes(out, row, x, tile.right, red, green, blue, scratch)


def _shaded_tile(view, scratch, tile, paints, out):
    background, some = _background(paints), len(out.wanted) > 0
    for row in range(tile.top, tile.bottom):
        line = _line(view, row)
        for x in range(tile.left, tile.right, WIDTH):
            if some and not out.wanted[row - out.first_row, x // WIDTH]:
                continue
            place = _place(tile, row, x)
            index = load(scratch.index, place)
            hit = is_hit(index)
            if not any_of(hit):
                put_lanes(out, row, x, tile.right, *background, scratch)
                continue
            where = select(hit, index, spread(largest_of(index)))
            red, green, blue = shade(view, paints, line, load(scratch.k, place), row, x, where, hit, scratch)
            red, green, blue = _over(background, hit, to_byte(red), to_byte(green), to_byte(blue))
            put_lanes(out, row, x, tile.right, red, green, blue, scratch)


def _diffuse(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.diffuse`."""
    p, n, radius = surface(view, line, k, x, where)
    red, green, blue, light = spread(0.0), spread(0.0), spread(0.0), paints.lights
    for i in range(np.uint64(len(light))):
        facing, square = towards(p, n, (light[i, 0], light[i, 1], light[i, 2]))
        shine = cosine(facing, square, radius)
        red, green, blue = red + light[i, 3] * shine, green + light[i, 4] * shine, blue + light[i, 5] * shine
    r, g, b, _ = _colours(view, paints, where)
    return red * r, green * g, blue * b


@inlined
def _normal(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.normal`."""
    _, n, radius = _surface_of_any(view, line, k, x, where)
    return (n[0] / radius + 1.0) / 2.0, (n[1] / radius + 1.0) / 2.0, (n[2] / radius + 1.0) / 2.0


@inlined
def _full(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.full`."""
    t, direction = _ray(view, line, k, x)
    return radiance(view, paints, t, direction, where, hit, x, row, scratch)


@inlined
def _place(tile, row, x):
    """Where a pixel is in the depth buffer."""
    return np.uint64((row - tile.top) * STRIDE + x - tile.left)


@inlined
def _line(view, row):
    """What a row's rays share: a1 and a0 of D·D, and D but for U·u."""
    up, v, back, r = view.up[row], view.v, view.back, np.uint64(row)
    return view.a1[r], view.a0[r], up * v[0] - back[0], up * v[1] - back[1], up * v[2] - back[2]


@inlined
def _surface_of_spheres(view, line, k, x, where):
    """The hit points as seen from the eye and from their spheres' centres, and the radii."""
    t, direction = _ray(view, line, k, x)
    (cx, cy, cz, radius), eye = _ball(view, where), view.eye
    p, n = land(t, direction, (eye[0] - cx, eye[1] - cy, eye[2] - cz), radius)
    return p, n, radius


@inlined
def _surface_of_any(view, line, k, x, where):
    """The same of spheres and triangles."""
    t, direction = _ray(view, line, k, x)
    return land_on_any(t, direction, view.eye, _ball(view, where), at_least(where, view.first_facet))


@inlined
def _ray(view, line, k, x):
    """t, and D."""
    across, (a1, a0, dx, dy, dz), u = load(view.across, x), line, view.u
    t = k / ((across * view.a2 + a1) * across + a0)
    return t, (across * u[0] + dx, across * u[1] + dy, across * u[2] + dz)


@inlined
def _ball(view, where):
    """Centres and radii of the spheres at these places."""
    if same(where):
        i, balls = np.uint64(4) * np.uint64(first_of(where)), view.balls
        cx, cy, cz, radius = balls[i], balls[i + np.uint64(1)], balls[i + np.uint64(2)], balls[i + np.uint64(3)]
        return spread(cx), spread(cy), spread(cz), spread(radius)
    return gather_rows(view.balls, where)


@inlined
def _colours(view, paints, where):
    """The diffuse colours of the spheres at these places."""
    if same(where):
        i, colours = np.uint64(4) * np.uint64(view.material[np.uint64(first_of(where))]), paints.colours
        return spread(colours[i]), spread(colours[i + np.uint64(1)]), spread(colours[i + np.uint64(2)]), spread(0.0)
    return gather_rows(paints.colours, gather(view.material, where))


@inlined
def _over(background, hit, red, green, blue):
    """The background where nothing is hit."""
    return select(hit, red, background[0]), select(hit, green, background[1]), select(hit, blue, background[2])


@inlined
def _put_hits(out, at, room, t, place, scratch):
    """Eight hits, or as many as there is room for."""
    if room >= WIDTH:
        store(out.t, at, t)
        store(out.index, at, load(scratch.index, place))
    else:
        store(scratch.batch, 0, t)
        for pixel in range(np.uint64(room)):
            out.t[at + pixel] = scratch.batch[pixel]
            out.index[at + pixel] = scratch.index[place + pixel]


@borrowing
def _hits_tile(view, scratch, tile, paints, out):
    """t and index as they are in the buffer."""
    for row in range(tile.top, tile.bottom):
        a1, a0, _, _, _ = _line(view, row)
        start = np.uint64((row - out.first_row) * out.width)
        for x in range(tile.left, tile.right, WIDTH):
            across, place, at = load(view.across, x), _place(tile, row, x), start + np.uint64(x)
            index = load(scratch.index, place)
            t = load(scratch.k, place) / ((across * view.a2 + a1) * across + a0)
            t = select(is_hit(index), t, np.inf)
            _put_hits(out, at, tile.right - x, t, place, scratch)


@borrowing
def _fine_hits_tile(view, scratch, tile, fine, out):
    """t to the last digit, and index; where that is not certain, NaN."""
    for row in range(tile.top, tile.bottom):
        a1, a0, _, _, _ = _line(view, row)
        start, r = np.uint64((row - out.first_row) * out.width), np.uint64(row)
        for x in range(tile.left, tile.right, WIDTH):
            across, place, at = load(view.across, x), _place(tile, row, x), start + np.uint64(x)
            index, low, u, eye = load(scratch.index, place), load(fine.across_low, x), view.u, view.eye
            hit = is_hit(index)
            if not any_of(hit):
                _put_hits(out, at, tile.right - x, spread(np.inf), place, scratch)
                continue
            t = load(scratch.k, place) / ((across * view.a2 + a1) * across + a0)
            cx, cy, cz, radius = _ball(view, select(hit, index, spread(largest_of(index))))
            dx = fine_direction(across, low, u[0], fine.x[r], fine.x_low[r])
            dy = fine_direction(across, low, u[1], fine.y[r], fine.y_low[r])
            dz = fine_direction(across, low, u[2], fine.z[r], fine.z_low[r])
            finer, sure = refine(t, dx, dy, dz, eye[0], eye[1], eye[2], cx, cy, cz, radius)
            sure = sure & ~at_least(index, view.first_facet)
            t = select(hit, select(sure, finer, np.nan), np.inf)
            _put_hits(out, at, tile.right - x, t, place, scratch)


@borrowing
def _no_hits_tile(scratch, tile, paints, out):
    for row in range(tile.top, tile.bottom):
        start = (row - out.first_row) * out.width
        for x in range(start + tile.left, start + tile.right):
            out.t[x], out.index[x] = np.inf, -1


_diffuse_of_spheres = variant(_diffuse, "_diffuse_of_spheres", inlined, surface=_surface_of_spheres)
_diffuse_of_any = variant(_diffuse, "_diffuse_of_any", inlined, surface=_surface_of_any)
_diffuse_tile = variant(_shaded_tile, "_diffuse_tile", shade=_diffuse_of_spheres)
_diffuse_any_tile = variant(_shaded_tile, "_diffuse_any_tile", shade=_diffuse_of_any)
_normal_tile = variant(_shaded_tile, "_normal_tile", shade=_normal)
_full_tile = variant(_shaded_tile, "_full_tile", shade=_full)
paint_flat = variant(_paint, "paint_flat", paint_tile=_flat_tile, fill_tile=_fill_tile, see=see_tile)
paint_diffuse = variant(_paint, "paint_diffuse", paint_tile=_diffuse_tile, fill_tile=_fill_tile, see=see_tile)
paint_diffuse_unchecked = variant(
    _paint, "paint_diffuse_unchecked", paint_tile=_diffuse_tile, fill_tile=_fill_tile, see=see_tile_unchecked
)
paint_diffuse_any = variant(
    _paint, "paint_diffuse_any", paint_tile=_diffuse_any_tile, fill_tile=_fill_tile, see=see_tile
)
paint_full = variant(_paint, "paint_full", paint_tile=_full_tile, fill_tile=_fill_tile, see=see_tile)
paint_normal = variant(_paint, "paint_normal", paint_tile=_normal_tile, fill_tile=_fill_tile, see=see_tile)
find_hits = variant(_paint, "find_hits", paint_tile=_hits_tile, fill_tile=_no_hits_tile, see=see_tile)
find_fine_hits = variant(_paint, "find_fine_hits", paint_tile=_fine_hits_tile, fill_tile=_no_hits_tile, see=see_tile)
