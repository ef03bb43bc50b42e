"""The compiled path: the same formulas as the numpy path, run ray by ray. Importing this loads numba."""

from raytracer.kernels.compiler import cache_named_after_sources

with cache_named_after_sources():
    from raytracer.kernels.trace import distances, first_of_grid, nearest_given, nearest_twofold, polish, see
    from raytracer.kernels.usual import usual_eye, usual_given

__all__ = [
    "distances",
    "first_of_grid",
    "nearest_given",
    "nearest_twofold",
    "polish",
    "see",
    "usual_eye",
    "usual_given",
]
