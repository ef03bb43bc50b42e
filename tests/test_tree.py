"""Many rays and many spheres: the tree misses nothing that testing every sphere finds."""

import numpy as np
import pytest

from raytracer import backend, exact, ray_intersect_scene, trace

pytestmark = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
backend.load()


def cloud(kind: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    count = 400
    centres, radii = rng.uniform(-5, 5, (count, 3)), rng.uniform(0.05, 0.8, count)
    if kind == "flat":
        centres[:, 1] = 2.0
    elif kind == "one place":
        centres[:] = 1.0
    elif kind == "lattice, with its ties":
        centres, radii = np.round(centres), np.full(count, 1.0)
    elif kind == "a ground and dust":
        radii = np.where(np.arange(count) == 7, 1e4, 1e-3)
        centres[7] = 0.0, -1e4 - 5, 0.0
    elif kind == "far away":
        centres += 1e9
    elif kind == "tiny":
        centres, radii = centres * 1e-200, radii * 1e-200
    elif kind == "a line of two":
        centres, radii = centres[:17] * [1, 0, 0], radii[:17]
    return centres, radii


KINDS = [
    "anywhere",
    "flat",
    "one place",
    "lattice, with its ties",
    "a ground and dust",
    "far away",
    "tiny",
    "a line of two",
]


@pytest.mark.parametrize("kind", KINDS)
def test_the_tree_finds_what_every_sphere_does(kind, monkeypatch):
    rng = np.random.default_rng(5)
    centres, radii = cloud(kind, rng)
    middle, size = centres.mean(axis=0), np.abs(centres - centres.mean(axis=0)).max()
    origins = middle + rng.uniform(-1.2, 1.2, (1500, 3)) * size
    directions = np.round(rng.normal(size=(1500, 3)) * 2)  # many along an axis, some through lattice points
    directions[~directions.any(axis=1)] = 1.0
    if kind.startswith("lattice"):
        origins = np.round(origins)
    found = ray_intersect_scene(origins, directions, centres, radii)
    monkeypatch.setattr(trace, "_FEW", 10**9)
    every = ray_intersect_scene(origins, directions, centres, radii)
    np.testing.assert_array_equal(found.index, every.index)
    np.testing.assert_array_equal(found.t, every.t)
    assert (found.index >= 0).sum() > 30
    spheres = list(zip(centres.tolist(), radii.tolist(), strict=True))
    for k in range(0, 1500, 60):
        assert found.index[k] == exact.nearest_hit(origins[k].tolist(), directions[k].tolist(), spheres)[1]


@pytest.mark.parametrize("count", [17, 64, 65, 512, 513, 5000])
def test_every_sphere_is_in_the_tree(count):
    centres = np.column_stack([np.arange(count) * 3.0, np.zeros(count), np.zeros(count)])
    origins, directions = centres + np.array([0.0, 0.0, 5.0]), np.tile([0.0, 0.0, -1.0], (count, 1))
    found = ray_intersect_scene(origins, directions, centres, np.ones(count))
    np.testing.assert_array_equal(found.index, np.arange(count))
    np.testing.assert_array_equal(found.t, 4.0)
