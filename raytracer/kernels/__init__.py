"""The compiled path: the same formulas as the numpy path. Importing this loads numba."""

from raytracer.kernels.compiler import cache_named_after_sources

with cache_named_after_sources():
    from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH, begin, bound, fill
    from raytracer.kernels.tiles import find_hits, paint_diffuse, paint_flat, paint_normal
    from raytracer.kernels.trace import nearest_given, nearest_twofold, polish
    from raytracer.kernels.usual import usual_eye, usual_given
    from raytracer.kernels.visibility import STRIDE, candidates

__all__ = [
    "STRIDE",
    "TILE_HEIGHT",
    "TILE_WIDTH",
    "begin",
    "bound",
    "candidates",
    "fill",
    "find_hits",
    "nearest_given",
    "nearest_twofold",
    "paint_diffuse",
    "paint_flat",
    "paint_normal",
    "polish",
    "usual_eye",
    "usual_given",
]
