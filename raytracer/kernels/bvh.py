"""A tree of boxes about many spheres, for rays that share nothing.

Spheres are sorted along a curve that fills space (G. Morton, 1966) and cut into eights, these into eights of eights:

    level 0    box of spheres 0…7 | 8…15 | …          a box's children lie side by side, so there are no pointers,
    level 1    box of boxes 0…7   | …                 and one ray is tested against all eight of them at once
    …          until eight boxes or fewer are left

A box is wider than its spheres by more than rounding may take away, and a ray's time in it is stretched likewise
(T. Ize, Robust BVH Ray Traversal, JCGT 2, 2013): so no sphere is missed that is hit in truth.
"""

import numpy as np

from raytracer.arrays import Tree
from raytracer.certified import T_TOLERANCE, U, inner, look, meet, nearer, passes
from raytracer.kernels.compiler import called, compiled, inlined
from raytracer.kernels.lanes import WIDTH, bits_of, load, spread, store
from raytracer.twofold import select

_BITS = 20  # of a place along the curve, for each axis
_WIDER, _LONGER = 8.0 * U, 1.0 + 8.0 * U
_DEEPEST = 24  # levels


@compiled
def build(balls, order):
    """The tree over spheres (n, 4) in an order, `order` being int64 (n,)."""
    n = len(order)
    low, high, spheres = np.empty((n, 3)), np.empty((n, 3)), np.full((4, -(-n // WIDTH) * WIDTH), np.nan)
    for i in range(n):
        for axis in range(3):
            wider = balls[i, 3] + _WIDER * (abs(balls[i, axis]) + balls[i, 3])
            low[i, axis], high[i, axis] = balls[i, axis] - wider, balls[i, axis] + wider
    for place in range(n):
        for column in range(4):
            spheres[column, place] = balls[order[place], column]
    return enclose(low, high, order, spheres.reshape(-1))


@compiled
def enclose(shape_low, shape_high, order, spheres):
    """The tree over boxes (n, 3) in an order, in which −1 leaves a place empty; `spheres` as in `Tree`, or nothing."""
    n, eights = len(order), -(-len(order) // WIDTH)
    ids = np.full(eights * WIDTH, -1, np.int32)
    levels, counts = np.zeros(_DEEPEST, np.int64), np.zeros(_DEEPEST, np.int64)
    count, depth, total = eights, 0, 0
    while True:
        levels[depth], counts[depth] = total, count
        total += -(-count // WIDTH) * WIDTH
        depth += 1
        if count <= WIDTH:
            break
        count = -(-count // WIDTH)
    low, high = np.full((3, total), np.inf), np.full((3, total), -np.inf)
    for place in range(n):
        i = order[place]
        ids[place] = i
        if i >= 0:
            for axis in range(3):
                low[axis, place >> 3] = min(low[axis, place >> 3], shape_low[i, axis])
                high[axis, place >> 3] = max(high[axis, place >> 3], shape_high[i, axis])
    for level in range(1, depth):
        for node in range(counts[level - 1]):
            child, parent = levels[level - 1] + node, levels[level] + (node >> 3)
            for axis in range(3):
                low[axis, parent] = min(low[axis, parent], low[axis, child])
                high[axis, parent] = max(high[axis, parent], high[axis, child])
    return Tree(ids, spheres, low.reshape(-1), high.reshape(-1), levels, counts, depth)


@compiled
def along_curve(balls):
    """Where the centres of spheres (n, 4) lie along the curve: uint64 (n,)."""
    n, low, high = len(balls), np.full(3, np.inf), np.full(3, -np.inf)
    for i in range(n):
        for axis in range(3):
            low[axis], high[axis] = min(low[axis], balls[i, axis]), max(high[axis], balls[i, axis])
    places = np.empty(n, np.uint64)
    for i in range(n):
        place = np.uint64(0)
        for axis in range(3):
            part = (balls[i, axis] - low[axis]) / (high[axis] - low[axis])
            part = part if part >= 0.0 and part <= 1.0 else 0.0  # not a number where all lie in one plane
            place |= _spaced(np.uint64(part * ((1 << _BITS) - 1))) << np.uint64(axis)
        places[i] = place
    return places


@inlined
def _spaced(x):
    """The bits of x with two zeros between them (S. Anderson, Bit Twiddling Hacks)."""
    x = (x | x << np.uint64(32)) & np.uint64(0x1F00000000FFFF)
    x = (x | x << np.uint64(16)) & np.uint64(0x1F0000FF0000FF)
    x = (x | x << np.uint64(8)) & np.uint64(0x100F00F00F00F00F)
    x = (x | x << np.uint64(4)) & np.uint64(0x10C30C30C30C30C3)
    return (x | x << np.uint64(2)) & np.uint64(0x1249249249249249)


@compiled
def nearest_in_tree(origins, rays, balls, tree, nearest):
    """`plain.nearest_given`, by the tree."""
    stack, near, times = np.empty(WIDTH * _DEEPEST, np.int64), np.empty(WIDTH * _DEEPEST), np.empty(WIDTH)
    for k in range(len(origins)):
        _nearest(origins, rays, balls, tree, nearest, k, stack, near, times)


@called
def _nearest(origins, rays, balls, tree, nearest, k, stack, near, times):
    """One ray: the boxes that it may enter before it hits what is known are on the stack, the nearest on top."""
    best, best_error, best_index, unsure = nearest
    ray = _ray(origins, rays, k)
    top = _push(tree, ray, tree.depth - 1, 0, np.inf, stack, near, times, 0)
    while top > 0:
        top -= 1
        if near[top] > best[k] + best_error[k]:
            continue
        level, node = stack[top] & 31, stack[top] >> 5
        if level > 0:
            top = _push(tree, ray, level - 1, node * WIDTH, best[k] + best_error[k], stack, near, times, top)
            continue
        bits = _maybe_hit(tree, ray, node * WIDTH)
        for lane in range(WIDTH):
            i = tree.ids[node * WIDTH + lane]
            if bits >> lane & 1 and i >= 0:
                t, error, low = _meet(ray, balls, i)
                best[k], _, best_error[k], best_index[k], unsure[k] = nearer(
                    best[k], 0.0, best_error[k], best_index[k], unsure[k], t, 0.0, error, low, i
                )


@compiled
def candidates_in_tree(origins, rays, balls, tree):
    """The spheres that rays do not certainly miss: starts and ids, as in `Candidates`."""
    stack, near, times = np.empty(WIDTH * _DEEPEST, np.int64), np.empty(WIDTH * _DEEPEST), np.empty(WIDTH)
    starts, nothing = np.zeros(len(origins) + 1, np.int64), np.empty(0, np.int32)
    for k in range(len(origins)):
        starts[k + 1] = starts[k] + _collect(_ray(origins, rays, k), tree, nothing, 0, stack, near, times)
    ids = np.empty(starts[-1], np.int32)
    for k in range(len(origins)):
        _collect(_ray(origins, rays, k), tree, ids, starts[k], stack, near, times)
        ids[starts[k] : starts[k + 1]].sort()
    return starts, ids


@called
def _collect(ray, tree, ids, at, stack, near, times):
    """Write what a ray does not certainly miss to `ids` from `at` on, if it has room; returns how many there are."""
    found = 0
    top = _push(tree, ray, tree.depth - 1, 0, np.inf, stack, near, times, 0)
    while top > 0:
        top -= 1
        level, node = stack[top] & 31, stack[top] >> 5
        if level > 0:
            top = _push(tree, ray, level - 1, node * WIDTH, np.inf, stack, near, times, top)
            continue
        bits = _maybe_hit(tree, ray, node * WIDTH)
        for lane in range(WIDTH):
            i = tree.ids[node * WIDTH + lane]
            if bits >> lane & 1 and i >= 0:
                if len(ids):
                    ids[at + found] = i
                found += 1
    return found


@inlined
def _ray(origins, rays, k):
    """Origin, direction, its inverse, D·D and reach."""
    x, y, z = rays.x[k], rays.y[k], rays.z[k]
    origin = origins[k, 0], origins[k, 1], origins[k, 2]
    return origin, (x, y, z), (1.0 / x, 1.0 / y, 1.0 / z), rays.square[k], rays.reach[k]


@inlined
def _push(tree, ray, level, first, farthest, stack, near, times, top):
    """Put those of eight boxes on the stack that the ray enters before `farthest`, the farthest first."""
    size, at = np.uint64(len(tree.low) // 3), np.uint64(tree.levels[level] + first)
    enter, leave = spread(0.0), spread(np.inf)
    for axis in range(3):
        place = at + size * np.uint64(axis)
        a = (load(tree.low, place) - ray[0][axis]) * ray[2][axis]
        b = (load(tree.high, place) - ray[0][axis]) * ray[2][axis]
        first_side, last_side = select(a < b, a, b), select(a < b, b, a)
        enter = select(first_side > enter, first_side, enter)  # what is not a number says nothing
        leave = select(last_side < leave, last_side, leave)
    bits = bits_of((enter <= leave * _LONGER) & (enter <= farthest * _LONGER))
    store(times, 0, enter)
    base = top
    for lane in range(min(WIDTH, tree.counts[level] - first)):
        if bits >> lane & 1:
            place = top
            while place > base and near[place - 1] < times[lane]:
                near[place], stack[place] = near[place - 1], stack[place - 1]
                place -= 1
            near[place], stack[place] = times[lane] * (1.0 - 8.0 * U), (first + lane) << 5 | level
            top += 1
    return top


@inlined
def _maybe_hit(tree, ray, first):
    """Which of eight spheres the ray's line does not certainly miss, as bits."""
    (ox, oy, oz), (dx, dy, dz), _, a, m = ray
    size, at = np.uint64(len(tree.ids)), np.uint64(first)
    cx, cy, cz = load(tree.spheres, at), load(tree.spheres, at + size), load(tree.spheres, at + size + size)
    lx, ly, lz, c, c_error, distance = look(ox, oy, oz, cx, cy, cz, load(tree.spheres, at + size + size + size))
    missed = passes(inner(dx, dy, dz, lx, ly, lz), a, c, c_error, m * distance, m)
    return bits_of(missed) ^ np.uint8(255)


@inlined
def _meet(ray, balls, i):
    (ox, oy, oz), (dx, dy, dz), _, a, m = ray
    lx, ly, lz, c, c_error, distance = look(ox, oy, oz, balls[i, 0], balls[i, 1], balls[i, 2], balls[i, 3])
    return meet(inner(dx, dy, dz, lx, ly, lz), a, c, c_error, distance, balls[i, 3], m, T_TOLERANCE)
