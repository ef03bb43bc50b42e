"""The loops of `raytracer.plain`, compiled: one sphere and one ray at a time."""

import numpy as np

from raytracer.arrays import Seen
from raytracer.certified import U, contends, look, look_twofold, meet, meet_twofold, nearer
from raytracer.kernels.compiler import compiled


@compiled
def see(origin, centres, radii):
    """`plain.see`."""
    n = len(radii)
    x, y, z, c, c_error, size = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    ox, oy, oz = origin[0], origin[1], origin[2]
    for i in range(n):
        cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
        x[i], y[i], z[i], _, _, _, c[i], _, error, size[i] = look_twofold(ox, oy, oz, cx, cy, cz, radii[i], False)
        c_error[i] = U * abs(c[i]) + error
    return Seen(x, y, z, c, c_error, size, radii)


@compiled
def nearest_eye(rays, seen, boxes, first_row, nearest):
    """`plain.nearest_eye`."""
    rows = rays.x.shape[0]
    best, best_error, best_index, unsure = nearest
    for i in range(len(boxes)):
        left, right, top, bottom = boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3]
        lx, ly, lz, c, c_error = seen.x[i], seen.y[i], seen.z[i], seen.c[i], seen.c_error[i]
        size, radius = seen.size[i], seen.radius[i]
        for y in range(max(top - first_row, 0), min(bottom - first_row, rows)):
            for x in range(left, right):
                t, error, low = meet(
                    lx, ly, lz, c, c_error, size, radius,
                    rays.x[y, x], rays.y[y, x], rays.z[y, x], rays.square[y, x], rays.reach[y, x],
                )  # fmt: skip
                best[y, x], _, best_error[y, x], best_index[y, x], unsure[y, x] = nearer(
                    best[y, x], 0.0, best_error[y, x], best_index[y, x], unsure[y, x], t, 0.0, error, low, i
                )


@compiled
def nearest_given(origins, rays, centres, radii, nearest):
    """`plain.nearest_given`."""
    best, best_error, best_index, unsure = nearest
    for k in range(len(origins)):
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        for i in range(len(radii)):
            cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
            lx, ly, lz, c, c_error, size = look(ox, oy, oz, cx, cy, cz, radii[i])
            t, error, low = meet(
                lx, ly, lz, c, c_error, size, radii[i],
                rays.x[k], rays.y[k], rays.z[k], rays.square[k], rays.reach[k],
            )  # fmt: skip
            best[k], _, best_error[k], best_index[k], unsure[k] = nearer(
                best[k], 0.0, best_error[k], best_index[k], unsure[k], t, 0.0, error, low, i
            )


@compiled
def nearest_twofold(origins, rays, boxed, centres, radii, on, nearest):
    """`plain.nearest_twofold`."""
    best, best_error, best_index, unsure = nearest
    for k in range(len(origins)):
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        dx, dy, dz, m = rays.x[k], rays.y[k], rays.z[k], rays.reach[k]
        dx_low, dy_low, dz_low = rays.x_low[k], rays.y_low[k], rays.z_low[k]
        square = dx * dx + dy * dy + dz * dz
        t_low = 0.0
        for i in range(len(radii)):
            if not _inside(boxed.x[k], boxed.y[k], boxed.boxes, i):
                continue
            cx, cy, cz = centres[i, 0], centres[i, 1], centres[i, 2]
            lx, ly, lz, c, c_error, size = look(ox, oy, oz, cx, cy, cz, radii[i])
            t, error, low = meet(lx, ly, lz, c, c_error, size, radii[i], dx, dy, dz, square, m)
            if not contends(t, error, low, best[k], best_error[k]) or _equal(centres, radii, best_index[k], i):
                continue
            lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(
                ox, oy, oz, cx, cy, cz, radii[i], on[i]
            )
            t, rest, error, low = meet_twofold(
                lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size, dx, dy, dz, dx_low, dy_low, dz_low, m
            )
            best[k], t_low, best_error[k], best_index[k], unsure[k] = nearer(
                best[k], t_low, best_error[k], best_index[k], unsure[k], t, rest, error, low, i
            )


@compiled
def polish(origins, rays, centres, radii, on):
    """`plain.polish`."""
    found = np.empty(len(radii))
    for k in range(len(radii)):
        lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size = look_twofold(
            origins[k, 0], origins[k, 1], origins[k, 2], centres[k, 0], centres[k, 1], centres[k, 2], radii[k], on[k]
        )
        found[k], _, _, _ = meet_twofold(
            lx, ly, lz, lx_low, ly_low, lz_low, c, c_low, c_error, size,
            rays.x[k], rays.y[k], rays.z[k], rays.x_low[k], rays.y_low[k], rays.z_low[k], rays.reach[k],
        )  # fmt: skip
    return found


@compiled
def _inside(x, y, boxes, i):
    return boxes[i, 0] <= x < boxes[i, 1] and boxes[i, 2] <= y < boxes[i, 3]


@compiled
def _equal(centres, radii, j, i):
    if j < 0 or radii[j] != radii[i]:
        return False
    return centres[j, 0] == centres[i, 0] and centres[j, 1] == centres[i, 1] and centres[j, 2] == centres[i, 2]
