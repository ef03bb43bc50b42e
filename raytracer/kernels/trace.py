"""The loops of `raytracer.plain`, compiled: one sphere and one ray at a time."""

import numpy as np

from raytracer.arrays import Seen
from raytracer.certified import (
    K_ERROR,
    T_TOLERANCE,
    U,
    approach,
    arrive,
    contends,
    distance,
    look,
    look_twofold,
    meet,
    meet_twofold,
    nearer,
    passes,
    rim_of,
)
from raytracer.kernels.compiler import compiled


@compiled
def see(origin, centres, radii):
    """`plain.see`."""
    n = len(radii)
    x, y, z, c, c_error, size = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    rim = np.empty(n)
    ox, oy, oz = origin[0], origin[1], origin[2]
    for i in range(n):
        cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
        x[i], y[i], z[i], _, _, _, c[i], _, error, size[i] = look_twofold(
            ox, oy, oz, cx, cy, cz, radii[i], np.nan, 0.0, 0.0
        )
        c_error[i] = U * abs(c[i]) + error
        rim[i] = rim_of(c[i], size[i])
    return Seen(x, y, z, c, c_error, size, radii, rim)


@compiled
def first_of_grid(grid, seen, boxes, first_row, kappa, first):
    """`plain.first_of_grid`.

    The arrays of the picture are walked through flat, and counted by unsigned numbers: with a sign, an index might be
    meant from the end, and the check for that keeps the inner loops from being vectorised.
    """
    k, index, unsure = first.k.reshape(-1), first.index.reshape(-1), first.unsure.reshape(-1)
    width = np.uint64(len(grid.across))
    for i in range(len(boxes)):
        left, right = np.uint64(boxes[i, 0]), np.uint64(boxes[i, 1])
        for y in range(max(boxes[i, 2] - first_row, 0), min(boxes[i, 3] - first_row, len(grid.up))):
            start = np.uint64(y) * width
            if seen.rim[i] * kappa > 0.0:
                _approach_row(grid, y, seen, i, seen.rim[i] * kappa, left, right, start, k, index, unsure)
            else:
                _meet_row(grid, y, seen, i, left, right, start, k, index, unsure)


@compiled
def distances(grid, seen, first):
    """`plain.distances`."""
    t = np.full(first.index.shape, np.inf)
    ux, uy, uz = grid.u
    bx, by, bz = grid.back
    for y in range(len(grid.up)):
        vx, vy, vz = grid.up[y] * grid.v[0], grid.up[y] * grid.v[1], grid.up[y] * grid.v[2]
        for x in range(len(grid.across)):
            i = first.index[y, x]
            if i >= 0:
                s = grid.across[x]
                dx, dy, dz = s * ux + vx - bx, s * uy + vy - by, s * uz + vz - bz
                h = dx * seen.x[i] + dy * seen.y[i] + dz * seen.z[i]
                a = dx * dx + dy * dy + dz * dz
                t[y, x] = distance(h, a, seen.c[i], np.sqrt(abs(h * h - a * seen.c[i])))
    return t


@compiled
def _approach_row(grid, y, seen, i, rim, left, right, start, k, index, unsure):
    """One quick sphere against the pixels from left to right of row y."""
    across = grid.across
    ux, uy, uz = grid.u
    vx, vy, vz = grid.up[y] * grid.v[0], grid.up[y] * grid.v[1], grid.up[y] * grid.v[2]
    bx, by, bz = grid.back
    lx, ly, lz, c, ml = seen.x[i], seen.y[i], seen.z[i], seen.c[i], grid.reach[y] * seen.size[i]
    for x in range(left, right):
        dx, dy, dz = across[x] * ux + vx - bx, across[x] * uy + vy - by, across[x] * uz + vz - bz
        h = dx * lx + dy * ly + dz * lz
        p = start + x
        found, wins, open_ = approach(h, dx * dx + dy * dy + dz * dz, c, ml, rim, k[p])
        k[p] = found if wins else k[p]
        index[p] = i if wins else index[p]
        unsure[p] = unsure[p] | open_


@compiled
def _meet_row(grid, y, seen, i, left, right, start, k, index, unsure):
    """Any sphere against the pixels from left to right of row y."""
    across = grid.across
    ux, uy, uz = grid.u
    vx, vy, vz = grid.up[y] * grid.v[0], grid.up[y] * grid.v[1], grid.up[y] * grid.v[2]
    bx, by, bz = grid.back
    lx, ly, lz, c, c_error, size = seen.x[i], seen.y[i], seen.z[i], seen.c[i], seen.c_error[i], seen.size[i]
    radius, m = seen.radius[i], grid.reach[y]
    for x in range(left, right):
        dx, dy, dz = across[x] * ux + vx - bx, across[x] * uy + vy - by, across[x] * uz + vz - bz
        a = dx * dx + dy * dy + dz * dz
        p = start + x
        t, _, low = meet(lx, ly, lz, c, c_error, size, radius, dx, dy, dz, a, m, K_ERROR / 2)
        found, wins, open_ = arrive(t, low, a, k[p])
        k[p] = found if wins else k[p]
        index[p] = i if wins else index[p]
        unsure[p] = unsure[p] | open_


@compiled
def nearest_given(origins, rays, centres, radii, nearest):
    """`plain.nearest_given`."""
    best, best_error, best_index, unsure = nearest
    for k in range(len(origins)):
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        for i in range(len(radii)):
            cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
            lx, ly, lz, c, c_error, size = look(ox, oy, oz, cx, cy, cz, radii[i])
            h = rays.x[k] * lx + rays.y[k] * ly + rays.z[k] * lz
            if passes(h, rays.square[k], c, c_error, rays.reach[k] * size, rays.reach[k]):
                continue
            t, error, low = meet(
                lx, ly, lz, c, c_error, size, radii[i],
                rays.x[k], rays.y[k], rays.z[k], rays.square[k], rays.reach[k], T_TOLERANCE,
            )  # fmt: skip
            best[k], _, best_error[k], best_index[k], unsure[k] = nearer(
                best[k], 0.0, best_error[k], best_index[k], unsure[k], t, 0.0, error, low, i
            )


@compiled
def nearest_twofold(origins, rays, boxed, centres, radii, sides, nearest):
    """`plain.nearest_twofold`."""
    best, best_error, best_index, unsure = nearest
    for k in range(len(origins)):
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        dx, dy, dz, m = rays.x[k], rays.y[k], rays.z[k], rays.reach[k]
        dx_low, dy_low, dz_low = rays.x_low[k], rays.y_low[k], rays.z_low[k]
        square = dx * dx + dy * dy + dz * dz
        t_low = 0.0
        i = -1
        while True:
            i = _next_box(boxed.boxes, boxed.x[k], boxed.y[k], i + 1)
            if i == len(radii):
                break
            cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
            lx, ly, lz, c, c_error, size = look(ox, oy, oz, cx, cy, cz, radii[i])
            t, error, low = meet(lx, ly, lz, c, c_error, size, radii[i], dx, dy, dz, square, m, T_TOLERANCE)
            if not contends(t, error, low, best[k], best_error[k]) or _equal(centres, radii, best_index[k], i):
                continue
            lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(
                ox, oy, oz, cx, cy, cz, radii[i], sides.c[i], sides.c_low[i], sides.c_error[i]
            )
            t, rest, error, low = meet_twofold(
                lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size, dx, dy, dz, dx_low, dy_low, dz_low, m
            )
            best[k], t_low, best_error[k], best_index[k], unsure[k] = nearer(
                best[k], t_low, best_error[k], best_index[k], unsure[k], t, rest, error, low, i
            )


@compiled
def polish(origins, rays, centres, radii, sides):
    """`plain.polish`."""
    found = np.empty(len(radii))
    for k in range(len(radii)):
        lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(
            origins[k, 0],
            origins[k, 1],
            origins[k, 2],
            centres[k, 0],
            centres[k, 1],
            centres[k, 2],
            radii[k],
            sides.c[k],
            sides.c_low[k],
            sides.c_error[k],
        )
        found[k], _, _, _ = meet_twofold(
            lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size,
            rays.x[k], rays.y[k], rays.z[k], rays.x_low[k], rays.y_low[k], rays.z_low[k], rays.reach[k],
        )  # fmt: skip
    return found


@compiled
def _next_box(boxes, x, y, i):
    """The first box from number i on in which the pixel lies, or the number of boxes."""
    while i < len(boxes):
        if boxes[i, 0] <= x and x < boxes[i, 1] and boxes[i, 2] <= y and y < boxes[i, 3]:
            return i
        i += 1
    return i


@compiled
def _equal(centres, radii, j, i):
    if j < 0 or radii[j] != radii[i]:
        return False
    return centres[j, 0] == centres[i, 0] and centres[j, 1] == centres[i, 1] and centres[j, 2] == centres[i, 2]
