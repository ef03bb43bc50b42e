"""Tracing by a usual method: every number in the method's own precision, nothing scaled, nothing checked."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from raytracer.arrays import Balls, Hits, UsualRays
from raytracer.camera import Raster, directions, eye_grid, rows_of, twofold_eye_rays
from raytracer.methods import Method, row_of


def balls(method: str | Method, centres: np.ndarray, radii: np.ndarray) -> Balls:
    """The spheres as the method sees them."""
    precision = row_of(method).precision
    return Balls(np.ascontiguousarray(centres, precision), np.ascontiguousarray(radii, precision))


def usual_rows(
    method: str | Method, raster: Raster, spheres: Balls, boxes: np.ndarray, rows: slice, path: ModuleType
) -> Hits:
    """What the eye rays of these rows hit first, each sphere looked for in its box; `index` counts spheres."""
    precision = row_of(method).precision
    ox, oy, oz = np.array(raster.camera.eye, precision)
    hits = _no_hits((rows.stop - rows.start, raster.width), precision)
    rays = _eye_rays(method, raster, rows)
    path.usual_eye(method, (ox, oy, oz), rays, spheres, boxes, rows.start, hits.t, hits.index)
    return Hits(hits.t.astype(np.float64), hits.index)


def usual_given(
    method: str | Method,
    origins: np.ndarray,
    rays: np.ndarray,
    centres: np.ndarray,
    radii: np.ndarray,
    path: ModuleType,
) -> Hits:
    """What rays from origins (n, 3) along rays (n, 3) hit first; `index` counts spheres."""
    precision = row_of(method).precision
    x, y, z = np.ascontiguousarray(rays.T, precision)
    zero = np.zeros_like(x)
    vectors = ((x, y, z), (zero, zero, zero)) if row_of(method).twofold else ((x, y, z),)
    hits = _no_hits((len(origins),), precision)
    path.usual_given(method, origins.astype(precision), vectors, balls(method, centres, radii), hits.t, hits.index)
    return Hits(hits.t.astype(np.float64), hits.index)


def _eye_rays(method: str | Method, raster: Raster, rows: slice) -> UsualRays:
    grid = rows_of(eye_grid(raster), rows)
    if not row_of(method).twofold:
        precision = row_of(method).precision
        u, v, back = (tuple(np.array(vector, precision)) for vector in (grid.u, grid.v, grid.back))
        across, up = grid.across.astype(precision), grid.up.astype(precision)
        return (directions(grid._replace(across=across, up=up, u=u, v=v, back=back)),)
    ys, xs = np.mgrid[rows, 0 : raster.width]
    x, y, z, x_low, y_low, z_low, _ = twofold_eye_rays(raster, xs, ys)
    return (x, y, z), (x_low, y_low, z_low)


def _no_hits(shape: tuple[int, ...], precision: type[np.floating]) -> Hits:
    return Hits(np.full(shape, np.inf, precision), np.full(shape, -1, np.int32))
