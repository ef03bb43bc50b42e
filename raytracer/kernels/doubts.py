"""Doubtful pixels of spheres, decided in two-fold float64 and painted by whoever has found them.

doubts ── _nearest ──> t, sphere ── put ──> bytes of the picture, or a hit
       └─ what two-fold float64 cannot tell either ──> doubts, for `settle`
"""

import numpy as np

from raytracer.camera import fine_ray
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.compiler import called, inlined, variant
from raytracer.kernels.lanes import WIDTH, load
from raytracer.kernels.quick import pad_late, put_late, shade_late
from raytracer.kernels.sixteen import lowest_bit
from raytracer.kernels.strips import put_pixel, start_of
from raytracer.kernels.surfaces import rays_of
from raytracer.kernels.trace import try_twofold
from raytracer.kernels.visibility import holding, sphere_of


def _decide_doubts(view, slow, bins, paints, scratch, doubts, out):
    """Decide and take off the list what two-fold float64 is certain of. `shades` says whether any are to be shaded."""
    if not paints.quick.usable or len(slow.ids):
        return
    width, waiting = len(view.across) - WIDTH, np.uint64(0)
    count, doubts[0] = doubts[0], 0
    for k in range(1, count + 1):
        row, column = doubts[k] // width, doubts[k] % width
        tile = row // TILE_HEIGHT * bins.columns + column // TILE_WIDTH
        t, _, _, sphere, unsure = _nearest(view, bins, paints.quick, tile, row, column)
        if unsure or bins.middles[tile] < bins.starts[tile + 1]:
            doubts[0] += 1
            doubts[doubts[0]] = doubts[k]
        else:
            waiting = put(view, paints, scratch, row, column, t, sphere, waiting, out)
    if shades and waiting:
        _shade_hits(view, paints, scratch, waiting, out)


@inlined
def _put_flat(view, paints, scratch, row, column, t, sphere, waiting, out):
    """A pixel, of which t and the sphere are known; returns how many are waiting to be shaded."""
    put_pixel(out, start_of(out, row, column), paints.quick.background if sphere < 0 else paints.quick.flat)
    return waiting


@inlined
def _put_shaded(view, paints, scratch, row, column, t, sphere, waiting, out):
    sheet = scratch.quick
    if sphere < 0:
        return _put_flat(view, paints, scratch, row, column, t, sphere, waiting, out)
    scratch.k[waiting], sheet.spheres[waiting] = t, sphere
    sheet.late_rows[waiting], sheet.late_columns[waiting] = row, column
    waiting += np.uint64(1)
    if waiting == WIDTH:
        _shade_hits(view, paints, scratch, waiting, out)
        waiting = np.uint64(0)
    return waiting


@inlined
def _put_hit(view, paints, scratch, row, column, t, sphere, waiting, out):
    at = np.uint64((row - out.first_row) * out.width + column)
    out.index[at] = sphere
    if len(out.t):
        out.t[at] = t
    return waiting


@called
def _nearest(view, bins, quick, tile, row, column):
    """What a pixel sees of the spheres of its tile, as `certified.nearer` has it."""
    found = np.inf, 0.0, 0.0, np.int64(-1), False
    across, up = 2.0 * (column - quick.middle_x), 2.0 * (quick.middle_y - row)
    ray = fine_ray(across, up, quick.height, quick.u, quick.v, quick.w, quick.back)
    end = bins.middles[tile]
    for some in range(bins.starts[tile], end, WIDTH):
        bits = holding(bins.entries, some, end, column % TILE_WIDTH, row % TILE_HEIGHT)
        while bits:
            sphere = np.int64(sphere_of(bins.entries[some + lowest_bit(bits) // 2]))
            bits &= bits - 1
            found = try_twofold(found, view.eye, ray, view.balls, sphere, (np.nan, 0.0, 0.0))
    return found


@inlined
def _shade_hits(view, paints, scratch, count, out):
    """Paint up to eight hits."""
    sheet = scratch.quick
    pad_late(sheet, count)
    _, _, direction = rays_of(view, load(sheet.late_rows, 0), load(sheet.late_columns, 0))
    shade_late(view, paints, direction, load(scratch.k, 0), 0, scratch)
    put_late(sheet, count, out)


decide_flat = variant(_decide_doubts, "decide_flat", put=_put_flat, shades=False)
decide_diffuse = variant(_decide_doubts, "decide_diffuse", put=_put_shaded, shades=True)
decide_hits = variant(_decide_doubts, "decide_hits", put=_put_hit, shades=False)


@inlined
def leave_doubts(view, slow, bins, paints, scratch, doubts, out):
    """Decide none of them: they stay on the list."""
