"""The compiled path: the same formulas as the numpy path. Importing this loads numba."""

from raytracer.kernels.compiler import cache_named_after_sources

with cache_named_after_sources():
    from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH, bound
    from raytracer.kernels.bvh import along_curve, build, candidates_in_tree, enclose, nearest_in_tree
    from raytracer.kernels.cells import bound_images, sort_into_cells
    from raytracer.kernels.desks import DESK
    from raytracer.kernels.facets import see_facets
    from raytracer.kernels.full import radiance_of
    from raytracer.kernels.lanes import SIXTEEN
    from raytracer.kernels.reading import read_plain
    from raytracer.kernels.sorting import sort
    from raytracer.kernels.surfaces import diffuse_of
    from raytracer.kernels.tiles import (
        ROOM,
        find_fine_hits,
        find_hits,
        find_shapes,
        paint_diffuse,
        paint_diffuse_any,
        paint_diffuse_unchecked,
        paint_flat,
        paint_full,
        paint_normal,
    )
    from raytracer.kernels.trace import fine_rays, nearest_given, nearest_twofold, polish, refine_given
    from raytracer.kernels.usual import usual_eye, usual_given
    from raytracer.kernels.visibility import candidates
    from raytracer.kernels.waiting import has_ended, linger
    from raytracer.kernels.whole import mean_of_blocks, paint_depth, paint_edges, range_of

__all__ = [
    "DESK",
    "ROOM",
    "SIXTEEN",
    "TILE_HEIGHT",
    "TILE_WIDTH",
    "along_curve",
    "bound",
    "bound_images",
    "build",
    "candidates",
    "candidates_in_tree",
    "diffuse_of",
    "enclose",
    "find_fine_hits",
    "find_hits",
    "find_shapes",
    "fine_rays",
    "has_ended",
    "linger",
    "mean_of_blocks",
    "nearest_given",
    "nearest_in_tree",
    "nearest_twofold",
    "paint_depth",
    "paint_diffuse",
    "paint_diffuse_any",
    "paint_diffuse_unchecked",
    "paint_edges",
    "paint_flat",
    "paint_full",
    "paint_normal",
    "polish",
    "radiance_of",
    "range_of",
    "read_plain",
    "refine_given",
    "see_facets",
    "sort",
    "sort_into_cells",
    "usual_eye",
    "usual_given",
]
