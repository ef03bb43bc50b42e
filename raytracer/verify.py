"""A method against exact arithmetic, family by family."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from raytracer import exact
from raytracer.arrays import Hits
from raytracer.families import Bundle, bundles
from raytracer.trace import ray_intersect_scene


class Verdict(NamedTuple):
    """What came of some rays."""

    rays: int
    wrong: int  # hit or miss, or which sphere
    worst: float  # error of t in ulps of the true t, over rays that are right

    def __str__(self) -> str:
        return f"{self.rays} rays, {self.wrong} wrong, t off by at most {self.worst:.3g} ulp"


def true_hits(bundle: Bundle) -> Hits:
    """What exact arithmetic says."""
    spheres = list(zip(bundle.centres.tolist(), bundle.radii.tolist(), strict=True))
    hits = Hits(np.empty(len(bundle.origins)), np.empty(len(bundle.origins), np.int32))
    for k, (origin, direction) in enumerate(zip(bundle.origins.tolist(), bundle.directions.tolist(), strict=True)):
        hits.t[k], hits.index[k] = exact.nearest_hit(origin, direction, spheres)
    return hits


def judge(found: Hits, truth: Hits) -> Verdict:
    """How far what was found is from the truth; a t beyond float64 has to be what it is beyond it."""
    right = found.index == truth.index
    hit = right & (truth.index >= 0)
    known = hit & np.isfinite(truth.t) & (truth.t > 0)
    ulps = np.abs(found.t[known] - truth.t[known]) / np.spacing(truth.t[known])
    beyond = hit & ~known & (found.t != truth.t)
    worst = np.inf if beyond.any() else float(ulps.max(initial=0.0))
    return Verdict(len(right), int((~right).sum()), worst)


def verify(family: str, method: str, rays: int, seed: int) -> Verdict:
    """A method on at least so many rays of a family."""
    verdicts = list(_verdicts(family, method, rays, seed))
    return Verdict(sum(v.rays for v in verdicts), sum(v.wrong for v in verdicts), max(v.worst for v in verdicts))


def _verdicts(family: str, method: str, rays: int, seed: int) -> Iterator[Verdict]:
    for bundle in bundles(family, rays, seed):
        found = ray_intersect_scene(bundle.origins, bundle.directions, bundle.centres, bundle.radii, method)
        yield judge(found, true_hits(bundle))
