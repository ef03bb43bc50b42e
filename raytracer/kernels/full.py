"""Light that has been thrown back once or many times, eight rays at a time: the stage `full`.

    a hit ─ land ─> P, N ─ lights ──────────────> ambient + Σ (diffuse + specular), if nothing blocks the way
                      └─── mirror ─> next hit ──> the same again, weighed by k_refl

Rays towards one light share an origin too: the light. Seen from there, the directions are cut into the cells of a cube,
and each cell has the list of shapes that reach into it; a ray is tested against those of its cell (`light_cells`). The
first mirrored rays off a plane are looked up likewise, on the picture's own screen (`mirrors`), others in a tree.
Eight rays stay together however their ways part; those that are done are only not looked at any more.
"""

import numpy as np

from raytracer.arrays import CELL_BITS, CORNERS
from raytracer.bounce import (
    MOST_REFLECTIONS,
    away_from,
    blocks_own,
    blocks_sphere,
    hits_sphere,
    land_again,
    plane_ahead,
    reflected,
    size_of,
    sphere_hit_at,
    within_edges,
)
from raytracer.certified import inner
from raytracer.kernels.cells import spot_of
from raytracer.kernels.compiler import borrowing, inlined, variant
from raytracer.kernels.lanes import (
    WIDTH,
    all_of,
    any_of,
    at_least,
    equal_to,
    first_of,
    first_where,
    gather,
    gather_rows,
    in_box,
    is_hit,
    lane_numbers,
    load,
    same,
    smallest_of,
    spread,
    store,
    whole,
)
from raytracer.kernels.surfaces import colours_of_hits
from raytracer.shading import cosine, highlight, land_on_any, land_on_plane, raised_to_whole, towards, unit_of
from raytracer.twofold import select

_LONGER = 1.0 + 2.0**-40
CELL = float(1 << CELL_BITS)  # pixels of a face of a light's cube that a cell is wide and high


@inlined
def radiance(view, paints, t, d, where, hit, x, row, scratch):
    """The colours that come along eight eye rays D from hits at t on the shapes at these places.

    They are those of a row from column x on; if not, row is −1.
    """
    row_of, flat = rows_at(view.balls, where), at_least(where, view.first_facet)
    if all_of(flat):
        p, n, radius = land_on_plane(d, row_of), (row_of[0], row_of[1], row_of[2]), spread(1.0)
    else:
        p, n, radius = land_on_any(t, d, view.eye, row_of, flat)
    red, green, blue, weight = spread(0.0), spread(0.0), spread(0.0), select(hit, spread(1.0), 0.0)
    background = paints.behind
    for bounce in range(MOST_REFLECTIONS + 1):
        material, shown = spread(np.int32(3)) * numbers_at(view.material, where), weight > 0.0
        ambient = rows_at(paints.surfaces, material + spread(np.int32(1)))
        light = _light(view, paints, p, n, radius, d, where, shown, material, scratch)
        red = red + select(shown, weight * (ambient[0] + light[0]), 0.0)
        green = green + select(shown, weight * (ambient[1] + light[1]), 0.0)
        blue = blue + select(shown, weight * (ambient[2] + light[2]), 0.0)
        weight = select(shown, weight * ambient[3], 0.0)
        if bounce == MOST_REFLECTIONS or not paints.mirrors or not any_of(weight > 0.0):
            break
        d, facing = reflected(d, n, radius)
        plane = _plane_of(paints.glass, where, weight > 0.0) if bounce == 0 and row >= 0 else -1
        t, found = _nearest(view, paints, p, d, where, facing < 0.0, weight > 0.0, plane, x, row, scratch)
        missed = (weight > 0.0) & ~is_hit(found)
        red = red + select(missed, weight * background[0], 0.0)
        green = green + select(missed, weight * background[1], 0.0)
        blue = blue + select(missed, weight * background[2], 0.0)
        weight = select(missed, 0.0, weight)
        if not any_of(weight > 0.0):
            break
        where = select(is_hit(found), found, where)
        flat = at_least(where, view.first_facet)
        p, n, radius = land_again(t, p, d, gather_rows(view.balls, where), view.eye, flat)
    return red, green, blue


@inlined
def _light(view, paints, p, n, radius, d, where, shown, material, scratch):
    """What all lights add, where it is shown."""
    red, green, blue, spark, lights = spread(0.0), spread(0.0), spread(0.0), spread(0.0), paints.lights
    dr, dg, db, power = rows_at(paints.surfaces, material)
    sr, sg, sb, _ = rows_at(paints.surfaces, material + spread(np.int32(2)))
    size, unit, shiny = size_of(p), d, ~((sr == 0.0) & (sg == 0.0) & (sb == 0.0))
    sparkles = paints.specular and any_of(shiny)
    if sparkles:
        unit = unit_of(d)
    for i in range(np.uint64(len(lights))):
        light = lights[i, 0], lights[i, 1], lights[i, 2]
        facing, square = towards(p, n, light)
        shine = cosine(facing, square, radius)
        if sparkles:
            spark = highlight(p, n, radius, light, square, unit)
            spark = raised_to_whole(spark, power, paints.bits) if paints.bits >= 0 else _raised(spark, power, scratch)
            spark = select(shiny, spark, 0.0)
        lit = shown & ((shine > 0.0) | (spark > 0.0))
        if paints.shadows and any_of(lit):
            lit = lit & ~_blocked(view, paints, i, p, light, square, where, size, lit)
        if any_of(lit):
            red = red + select(lit, lights[i, 3] * (dr * shine + sr * spark), 0.0)
            green = green + select(lit, lights[i, 4] * (dg * shine + sg * spark), 0.0)
            blue = blue + select(lit, lights[i, 5] * (db * shine + sb * spark), 0.0)
    return red, green, blue


@inlined
def _raised(x, power, scratch):
    """Each lane to the power that the other has there, one after the other."""
    store(scratch.batch, 0, x)
    store(scratch.batch, WIDTH, power)
    for lane in range(np.uint64(WIDTH)):
        scratch.batch[lane] = scratch.batch[lane] ** scratch.batch[lane + np.uint64(WIDTH)]
    return load(scratch.batch, 0)


@inlined
def _blocked(view, paints, i, p, light, a, where, size, asked):
    """Whether something stands between P and light i, where that is asked."""
    d = light[0] - p[0], light[1] - p[1], light[2] - p[2]
    cells, blocked, left = paints.cells, ~asked, asked
    (cell, spot), per_light = _cell(cells.columns, d), 6 * cells.per_screen + 1
    first = np.int64(i) * np.int64(per_light)
    beyond = _beyond_walls(view, paints, i, first + per_light - 1, where, asked)
    while any_of(left):
        chosen = first_where(left, cell)
        group = left & equal_to(cell, chosen)
        start, stop = cells.starts[first + chosen], cells.starts[first + chosen + 1]
        for place in range(start, stop):
            if not any_of(group & ~blocked):
                break
            if not any_of(group & in_box(spot, cells.entries[2 * place + 1])):
                continue
            j = cells.entries[2 * place]
            own = equal_to(where, np.int64(j))
            if not all_of(own | ~group):
                blocked = blocked | (group & _blocks(view, paints, j, p, d, a, 1.0 / a, own, size))
            elif j < view.first_facet:
                o = away_from(_row(view.balls, np.uint64(4) * np.uint64(j)), p, view.eye)
                blocked = blocked | (group & blocks_own(o, d, a))
        left = left & ~group
        if not any_of(left):
            left, beyond, cell = beyond & ~blocked, beyond & ~beyond, spread(np.int32(per_light - 1))
    return blocked & asked


@inlined
def _beyond_walls(view, paints, i, cell, where, asked):
    """Which of the asked rays light i's walls may block: those from shapes that are not all on its side of them."""
    if len(paints.beyond) == 0 or paints.cells.starts[cell] == paints.cells.starts[cell + 1]:
        return asked & ~asked
    shapes = len(paints.beyond) // len(paints.lights)
    return asked & at_least(numbers_at(paints.beyond, where + spread(np.int32(i * shapes))), 1)


@inlined
def _cell(resolution, d):
    """The cell of the light's cube that D comes from: 6 faces of rows of cells; and where in the cell, as a spot."""
    x, y, z = -d[0], -d[1], -d[2]
    ax, ay, az = abs(x), abs(y), abs(z)
    of_x, of_y = (ax >= ay) & (ax >= az), ay >= az
    along = select(of_x, x, select(of_y, y, z))
    across, down = select(of_x, y, select(of_y, z, x)), select(of_x, z, select(of_y, x, y))
    face = select(of_x, 0.0, select(of_y, 1.0, 2.0)) * 2.0 + select(along < 0.0, 1.0, 0.0)
    half, last = resolution * (0.5 * CELL), resolution * CELL - 1.0
    over = half / abs(along)
    x, y = np.floor(across * over + half), np.floor(down * over + half)
    x, y = select(x < last, x, last), select(y < last, y, last)
    column, row = np.floor(x * (1.0 / CELL)), np.floor(y * (1.0 / CELL))
    spot = spot_of(whole(x - column * CELL), whole(y - row * CELL))
    return whole((face * resolution + row) * resolution + column), spot


@inlined
def _blocks(view, paints, j, p, d, a, over_a, own, size):
    """Whether shape j stands between P and P + D."""
    row = _row(view.balls, np.uint64(4) * np.uint64(j))
    if j < view.first_facet:
        return blocks_sphere(away_from(row, p, view.eye), d, a, over_a, row[3], size, own)
    corners, at = view.corners, np.uint64(CORNERS) * np.uint64(j - view.first_facet)
    over, under = plane_ahead(p, d, row, corners[at + np.uint64(9)], size, own)
    between = (over > 0.0) & (over < under)
    if any_of(between):
        between = between & _within(corners, at, p, d)
    return between


@inlined
def _within(corners, at, p, d):
    first = corners[at], corners[at + np.uint64(1)], corners[at + np.uint64(2)]
    second = corners[at + np.uint64(3)], corners[at + np.uint64(4)], corners[at + np.uint64(5)]
    third = corners[at + np.uint64(6)], corners[at + np.uint64(7)], corners[at + np.uint64(8)]
    return within_edges(p, d, first, second, third)


@inlined
def _plane_of(glass, where, asked):
    """The number of the plane in which all asked rays are thrown back; −1 if there is none."""
    if len(glass.of) == 0:
        return -1
    planes = numbers_at(glass.of, where)
    plane = first_where(asked, planes)
    return plane if all_of(equal_to(planes, plane) | ~asked) else -1


@inlined
def _nearest(view, paints, p, d, where, from_outside, asked, plane, x, row, scratch):
    """What rays from P on the shapes at these places hit first.

    A plane's number says that they are eye rays of a row from column x on, thrown back there.
    """
    a, index, size = inner(d[0], d[1], d[2], d[0], d[1], d[2]), spread(np.int32(-1)), size_of(p)
    over_a, best = 1.0 / a, select(asked, spread(np.inf), -np.inf)
    tree, stack, near, top, over_d = paints.tree, scratch.stack, scratch.near, 1, d
    stack[0], near[0], ids, start, stop, step = 0, 0.0, tree.ids, 0, WIDTH, 1
    spot = where
    if plane >= 0:
        spot, start, stop = _list_of(paints.glass, plane, x, row)
        ids, step = paints.glass.cells.entries, 2
    elif len(tree.ids) > WIDTH:
        over_d = 1.0 / d[0], 1.0 / d[1], 1.0 / d[2]
        top = _push(tree, view.eye, p, over_d, best, tree.depth - 1, 0, stack, near, 0)
    while top > 0:
        top -= 1
        if not any_of(near[top] <= best):
            continue
        if plane < 0:
            level, node = stack[top] & 31, stack[top] >> 5
            start, stop = node * WIDTH, (node + 1) * WIDTH
            if level > 0:
                top = _push(tree, view.eye, p, over_d, best, level - 1, start, stack, near, top)
                continue
        for place in range(start, stop, step):
            j = ids[place]
            if j < 0:
                break
            own = equal_to(where, np.int64(j))
            may_hit = asked & ~(own & (from_outside | (j >= view.first_facet)))
            if not any_of(may_hit & in_box(spot, ids[place + 1]) if plane >= 0 else may_hit):
                continue
            t = _meet(view, paints, j, p, d, a, over_a, own, size, from_outside)
            closer = (t < best) | ((t == best) & at_least(index, j))  # of equally near ones that with the least number
            index, best = select(closer, spread(j), index), select(closer, t, best)
    return best, index


@inlined
def _list_of(glass, plane, x, row):
    """Eight pixels of a row as a spot in their cell; and where the list of what a plane shows there begins and ends."""
    (shift, cells), last = (glass.shift, glass.cells), (1 << glass.shift) - 1
    cell = plane * cells.per_screen + (row >> shift) * cells.columns + (x >> shift)
    spot = spot_of(spread(np.int32(x & last)) + lane_numbers(), spread(np.int32(row & last)))
    return spot, 2 * cells.starts[cell], 2 * cells.starts[cell + 1]


@inlined
def _push(tree, eye, p, over_d, best, level, first, stack, near, top):
    """Put those of up to eight boxes on the stack that any of the rays may hit something in, the farthest first."""
    size, at, base = np.uint64(len(tree.low) // 3), np.uint64(tree.levels[level] + first), top
    for child in range(np.uint64(min(WIDTH, tree.counts[level] - first))):
        enter, leave = spread(0.0), spread(np.inf)
        for axis in range(3):
            place = at + child + size * np.uint64(axis)
            one, other = (
                ((tree.low[place] - eye[axis]) - p[axis]) * over_d[axis],
                ((tree.high[place] - eye[axis]) - p[axis]) * over_d[axis],
            )
            first_side, last_side = select(one < other, one, other), select(one < other, other, one)
            enter = select(first_side > enter, first_side, enter)  # what is not a number says nothing
            leave = select(last_side < leave, last_side, leave)
        open_ = (enter <= leave * _LONGER) & (enter <= best)
        if any_of(open_):
            time, place = smallest_of(select(open_, enter, np.inf)), top
            while place > base and near[place - 1] < time:
                near[place], stack[place] = near[place - 1], stack[place - 1]
                place -= 1
            near[place], stack[place] = time, (first + np.int64(child)) << 5 | level
            top += 1
    return top


@inlined
def _meet(view, paints, j, p, d, a, over_a, own, size, from_outside):
    """Where rays meet shape j, +inf where they do not."""
    row = _row(view.balls, np.uint64(4) * np.uint64(j))
    if j < view.first_facet:
        hit, h, c, disc = hits_sphere(away_from(row, p, view.eye), d, a, over_a, row[3], size, own, from_outside)
        t = spread(np.inf)
        if any_of(hit):
            t = select(hit, sphere_hit_at(h, c, disc, over_a), np.inf)
        return t
    corners, at = view.corners, np.uint64(CORNERS) * np.uint64(j - view.first_facet)
    over, under = plane_ahead(p, d, row, corners[at + np.uint64(9)], size, own)
    ahead, t = over > 0.0, spread(np.inf)
    if any_of(ahead):
        ahead = ahead & _within(corners, at, p, d)
        if any_of(ahead):
            t = select(ahead, over / under, np.inf)
    return t


@inlined
def rows_at(table, places):
    """`gather_rows`, of which all lanes may want the same."""
    if same(places):
        x, y, z, w = _row(table, np.uint64(4) * np.uint64(first_of(places)))
        return spread(x), spread(y), spread(z), spread(w)
    return gather_rows(table, places)


@inlined
def numbers_at(array, places):
    """`gather`, likewise."""
    if same(places):
        return spread(array[np.uint64(first_of(places))])
    return gather(array, places)


@inlined
def _row(table, row):
    return table[row], table[row + np.uint64(1)], table[row + np.uint64(2)], table[row + np.uint64(3)]


@inlined
def _radiance_at(view, paints, d, t, columns, index, scratch):
    return radiance(view, paints, t, d, index, spread(0.0) == 0.0, 0, -1, scratch)


radiance_of = variant(colours_of_hits, "radiance_of", borrowing, colours=_radiance_at)
