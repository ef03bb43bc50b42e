"""The loops of `raytracer.plain`, compiled: one sphere and one ray at a time."""

import numpy as np

from raytracer.arrays import TwofoldRays
from raytracer.camera import fine_ray
from raytracer.certified import (
    T_TOLERANCE,
    contends,
    inner,
    look,
    look_twofold,
    meet,
    meet_twofold,
    nearer,
    passes,
    refine,
)
from raytracer.kernels.compiler import called, compiled, inlined
from raytracer.kernels.lanes import WIDTH, all_of, bits_of, gather_rows, is_hit, load, spread, store
from raytracer.twofold import select


@compiled
def nearest_given(origins, rays, balls, nearest):
    """`plain.nearest_given`: eight rays at a time, and the rest one by one."""
    ox, oy, oz = origins[:, 0].copy(), origins[:, 1].copy(), origins[:, 2].copy()
    eights = len(ox) // WIDTH * WIDTH
    for k in range(np.uint64(0), np.uint64(eights), np.uint64(WIDTH)):
        _nearest_of_eight(ox, oy, oz, rays, balls, nearest, k)
    for k in range(eights, len(ox)):
        for i in range(len(balls)):
            lx, ly, lz, c, c_error, size = look(ox[k], oy[k], oz[k], balls[i, 0], balls[i, 1], balls[i, 2], balls[i, 3])
            h, a, m = inner(rays.x[k], rays.y[k], rays.z[k], lx, ly, lz), rays.square[k], rays.reach[k]
            t, error, low = meet(h, a, c, c_error, size, balls[i, 3], m, T_TOLERANCE)
            nearest.t[k], _, nearest.error[k], nearest.index[k], nearest.unsure[k] = nearer(
                nearest.t[k], 0.0, nearest.error[k], nearest.index[k], nearest.unsure[k], t, 0.0, error, low, i
            )


@inlined
def _nearest_of_eight(ox, oy, oz, rays, balls, nearest, k):
    x, y, z, a, m = load(rays.x, k), load(rays.y, k), load(rays.z, k), load(rays.square, k), load(rays.reach, k)
    best, best_error, best_index, unsure = spread(np.inf), spread(0.0), spread(np.int32(-1)), a < 0.0
    for i in range(len(balls)):
        cx, cy, cz, radius = balls[i, 0], balls[i, 1], balls[i, 2], balls[i, 3]
        lx, ly, lz, c, c_error, size = look(load(ox, k), load(oy, k), load(oz, k), cx, cy, cz, radius)
        h = inner(x, y, z, lx, ly, lz)
        if all_of(passes(h, a, c, c_error, m * size, m)):
            continue
        t, error, low = meet(h, a, c, c_error, size, radius, m, T_TOLERANCE)
        best, _, best_error, best_index, unsure = nearer(
            best, 0.0, best_error, best_index, unsure, t, 0.0, error, low, spread(np.int32(i))
        )
    store(nearest.t, k, best)
    store(nearest.error, k, best_error)
    store(nearest.index, k, best_index)
    bits = bits_of(unsure)
    for lane in range(WIDTH):
        nearest.unsure[k + np.uint64(lane)] = bits >> lane & 1


@compiled
def refine_given(origins, rays, balls, t, index, unsure):
    """`plain.refine_given`: eight rays at a time, and the rest one by one."""
    ox, oy, oz = origins[:, 0].copy(), origins[:, 1].copy(), origins[:, 2].copy()
    eights, left, count = len(t) // WIDTH * WIDTH if len(balls) else 0, np.empty(len(t), np.int64), 0
    table = balls.reshape(-1)
    for k in range(np.uint64(0), np.uint64(eights), np.uint64(WIDTH)):
        bits = _refine_eight(ox, oy, oz, rays, table, t, index, k)
        for lane in range(WIDTH):
            place = k + np.uint64(lane)
            if bits >> lane & 1 and not unsure[place]:
                left[count] = place
                count += 1
    for k in range(eights, len(t)):
        i = index[k]
        if i >= 0 and not unsure[k]:
            x, y, z = (rays.x[k], 0.0), (rays.y[k], 0.0), (rays.z[k], 0.0)
            cx, cy, cz, radius = balls[i, 0], balls[i, 1], balls[i, 2], balls[i, 3]
            finer, sure = refine(t[k], x, y, z, ox[k], oy[k], oz[k], cx, cy, cz, radius)
            if sure:
                t[k] = finer
            else:
                left[count] = k
                count += 1
    return left[:count]


@inlined
def _refine_eight(ox, oy, oz, rays, table, t, index, k):
    """Refine eight hits, and return, as bits, those of which it is not certain. What is unsure is settled later."""
    x, y, z = (load(rays.x, k), 0.0), (load(rays.y, k), 0.0), (load(rays.z, k), 0.0)
    found, hit = load(t, k), is_hit(load(index, k))
    cx, cy, cz, radius = gather_rows(table, select(hit, load(index, k), spread(np.int32(0))))
    finer, sure = refine(found, x, y, z, load(ox, k), load(oy, k), load(oz, k), cx, cy, cz, radius)
    store(t, k, select(hit & sure, finer, found))
    return bits_of(hit & ~sure)


@compiled
def fine_rays(across, up, height, u, v, w, back):
    """`plain.fine_rays`."""
    n = len(across)
    x, y, z, reach = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    x_low, y_low, z_low = np.empty(n), np.empty(n), np.empty(n)
    for k in range(len(across)):
        x[k], y[k], z[k], x_low[k], y_low[k], z_low[k], reach[k] = fine_ray(across[k], up[k], height, u, v, w, back)
    return TwofoldRays(x, y, z, x_low, y_low, z_low, reach)


@compiled
def nearest_twofold(origins, rays, candidates, balls, sides, nearest):
    """`plain.nearest_twofold`."""
    best, best_error, best_index, unsure = nearest
    table = balls.reshape(-1)
    for k in range(len(origins)):
        found = best[k], 0.0, best_error[k], np.int64(best_index[k]), unsure[k]
        origin = origins[k, 0], origins[k, 1], origins[k, 2]
        ray = rays.x[k], rays.y[k], rays.z[k], rays.x_low[k], rays.y_low[k], rays.z_low[k], rays.reach[k]
        for place in range(candidates.starts[k], candidates.starts[k + 1]):
            i = np.int64(candidates.ids[place])
            found = try_twofold(found, origin, ray, table, i, _known_side(sides, i))
        best[k], _, best_error[k], best_index[k], unsure[k] = found


@called
def try_twofold(found, origin, ray, table, i, side):
    """The nearest hit so far, as `nearer` has it, after sphere i; of equal ones it is the first."""
    (best, _, best_error, best_index, _), (ox, oy, oz), (dx, dy, dz, dx_low, dy_low, dz_low, m) = found, origin, ray
    cx, cy, cz, radius = table[4 * i], table[4 * i + 1], table[4 * i + 2], table[4 * i + 3]
    lx, ly, lz, c, c_error, size = look(ox, oy, oz, cx, cy, cz, radius)
    h, square = inner(dx, dy, dz, lx, ly, lz), inner(dx, dy, dz, dx, dy, dz)
    t, error, low = meet(h, square, c, c_error, size, radius, m, T_TOLERANCE)
    if not contends(t, error, low, best, best_error):
        return found
    if _equal(table, best_index, i):
        return best, found[1], best_error, min(best_index, i), found[4]
    lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(ox, oy, oz, cx, cy, cz, radius, *side)
    t, rest, error, low = meet_twofold(
        lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size, dx, dy, dz, dx_low, dy_low, dz_low, m
    )
    return nearer(*found, t, rest, error, low, i)


@compiled
def polish(origins, rays, balls, known):
    """`plain.polish`."""
    found = np.empty(len(balls))
    for k in range(len(balls)):
        lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(
            origins[k, 0], origins[k, 1], origins[k, 2], balls[k, 0], balls[k, 1], balls[k, 2], balls[k, 3],
            known[0][k], known[1][k], known[2][k],
        )  # fmt: skip
        found[k], _, _, _ = meet_twofold(
            lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size,
            rays.x[k], rays.y[k], rays.z[k], rays.x_low[k], rays.y_low[k], rays.z_low[k], rays.reach[k],
        )  # fmt: skip
    return found


@compiled
def _known_side(sides, i):
    """`plain.known_sides` for one sphere."""
    k = np.searchsorted(sides.which, i)
    if k < len(sides.which) and sides.which[k] == i:
        return sides.c[k], sides.c_low[k], sides.c_error[k]
    return np.nan, 0.0, 0.0


@compiled
def _equal(table, j, i):
    a, b = 4 * i, 4 * j
    if j < 0 or table[a + 3] != table[b + 3]:
        return False
    return table[a] == table[b] and table[a + 1] == table[b + 1] and table[a + 2] == table[b + 2]
