"""Every method: right within its stated limits, seen to fail beyond them; and the one that has no limits."""

import dataclasses
import math

import numpy as np
import pytest
from cases import CASES

from raytracer import METHODS, backend, exact, eye_hits, families, interpreter, plain, ray_intersect_scene, render_scene
from raytracer.arrays import Hits
from raytracer.families import FAMILIES, bundles
from raytracer.methods import CERTIFIED, Limits
from raytracer.verify import judge, verify

USUAL = [name for name in METHODS if name != CERTIFIED]
SEED = 20


def truth_of(bundle, swell=1.0):
    spheres = list(zip(bundle.centres.tolist(), (bundle.radii * swell).tolist(), strict=True))
    rays = zip(bundle.origins.tolist(), bundle.directions.tolist(), strict=True)
    t, index = zip(*(exact.nearest_hit(origin, direction, spheres) for origin, direction in rays), strict=True)
    return np.array(t), np.array(index)


def found_by(method, bundle):
    return ray_intersect_scene(bundle.origins, bundle.directions, bundle.centres, bundle.radii, method=method)


@pytest.mark.parametrize("family", FAMILIES)
def test_certified_is_exact_in_every_family(family):
    verdict = verify(family, CERTIFIED, rays=12_800, seed=SEED)
    assert verdict.rays >= 12_800
    assert verdict.wrong == 0
    assert verdict.worst <= 1


def test_a_verdict_counts_what_is_wrong():
    truth = Hits(np.array([1.0, 2.0, np.inf, 4.0]), np.array([0, 1, -1, 0]))
    found = Hits(np.array([1.0 + 2 * np.spacing(1.0), 2.0, 3.0, 4.0]), np.array([0, 0, 0, 0]))
    assert judge(found, truth) == (4, 2, 2.0)
    beyond = Hits(np.array([np.inf, 0.0]), np.array([0, 0]))
    assert judge(beyond, beyond) == (2, 0, 0.0)
    assert judge(Hits(np.array([1.0, 0.0]), beyond.index), beyond).worst == np.inf


@pytest.mark.parametrize("method", USUAL)
def test_every_method_is_right_on_ordinary_rays(method):
    wrong = total = 0
    for bundle in bundles("ordinary", 1300, SEED):
        wrong += int((found_by(method, bundle).index != truth_of(bundle)[1]).sum())
        total += len(bundle.origins)
    assert wrong <= (0 if METHODS[method].precision == np.float64 else total // 200)


MAKERS = {
    "far": lambda rng, level: families.far_small(rng, level),
    "ground": lambda rng, level: families.ground(rng, level),
    "size": lambda rng, level: families.sized(rng, level),
    "step": lambda rng, level: families.stepped(rng, level),
    "apart": lambda rng, level: families.shells(rng, level),
}
BEYOND = {
    "far": 3,
    "ground": 4,
    "size": 30,
    "step": 30,
    "apart": 2.6,
}  # how far above its limit a method must have failed


def mistakes(method, kind, level):
    """Rays of some bundles whose hit is wrong, or t by more than a thousandth; those close to tangent do not count."""
    count = 0
    for seed in range(5):
        bundle = MAKERS[kind](np.random.default_rng(seed), level)
        t, index = truth_of(bundle)
        clear = np.ones(len(t), bool)
        if kind != "apart":
            clear = (truth_of(bundle, 0.99)[1] == index) & (truth_of(bundle, 1.01)[1] == index)
        hits = found_by(method, bundle)
        with np.errstate(all="ignore"):
            good_t = (hits.t == t) | (np.abs(hits.t - t) <= 1e-3 * t)
        count += int((clear & ((hits.index != index) | ((index >= 0) & ~good_t))).sum())
    return count


LIMITS = [
    (name, field.name, getattr(METHODS[name].limits, field.name))
    for name in METHODS
    for field in dataclasses.fields(Limits)
    if getattr(METHODS[name].limits, field.name) is not None
]


@pytest.mark.parametrize(("method", "kind", "limit"), LIMITS)
def test_a_method_is_right_up_to_its_limit_and_seen_to_fail_beyond(method, kind, limit):
    signs = (1, -1) if kind in ("size", "step") else (1,)
    for sign in signs:
        for part in (0.5, 0.8, 1.0):
            assert mistakes(method, kind, sign * part * limit) == 0
        assert mistakes(method, kind, sign * (limit + BEYOND[kind])) > 0


def test_certified_states_no_limits_and_every_other_method_does():
    assert METHODS[CERTIFIED].limits == Limits()
    assert all(METHODS[name].limits != Limits() for name in USUAL)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
def test_both_paths_find_the_same_bits(method, monkeypatch):
    scene = interpreter("scenes/04_many_spheres.cli")
    found = []
    for path in (plain, backend.load()):
        monkeypatch.setattr(backend, "choose", lambda tests, loops, path=path: path)
        monkeypatch.setattr(backend, "loaded", lambda path=path: path)
        hits = [found_by(method, bundle) for family in FAMILIES for bundle in bundles(family, 64, SEED)]
        found.append([array for pair in [*hits, eye_hits(scene, 40, 30, method=method)] for array in pair])
    for array, other in zip(*found, strict=True):
        np.testing.assert_array_equal(array, other)


@pytest.mark.parametrize("method", METHODS)
def test_a_method_draws_ordinary_scenes_as_they_are(method):
    scene = interpreter("scenes/04_many_spheres.cli")
    truth, found = eye_hits(scene, 90, 70), eye_hits(scene, 90, 70, method=method)
    assert (truth.index != found.index).mean() < 0.005
    picture = render_scene(scene, "hit", 90, 70, method=method)
    np.testing.assert_array_equal((picture == (204, 51, 77)).all(axis=2), found.index >= 0)


def test_the_textbook_fails_on_known_cases_and_two_fold_arithmetic_on_none_that_is_no_tie():
    def wrong(method):
        names = set()
        for case in CASES:
            centres, radii = zip(*case.spheres, strict=True)
            hits = ray_intersect_scene([case.origin], [case.direction], centres, radii, method=method)
            if (hits.index[0], math.isclose(hits.t[0], case.t, rel_tol=1e-15)) != (case.index, True):
                names.add(case.name)
        return names

    assert {"far small, missed", "ground, c cancels", "tiny", "huge", "short direction"} <= wrong("textbook")
    assert wrong("double_double") <= {"nearly tangent, large numbers", "shells one ulp apart"}
    assert wrong(CERTIFIED) == set()


def test_the_picture_of_errors_names_what_is_wrong():
    from raytracer.stages import FALSE_HIT, FALSE_MISS, NOTHING, ULPS, WRONG_SHAPE

    def counts(scene, method):
        picture = render_scene(interpreter(f"scenes/hard/{scene}.cli"), "error", 64, 64, method=method)
        colours = {"wrong": WRONG_SHAPE, "hit": FALSE_HIT, "miss": FALSE_MISS, "nothing": NOTHING, "exact": ULPS[0][1]}
        same = {name: np.floor(255 * np.array(colour) + 0.5) for name, colour in colours.items()}
        return {name: int((picture == colour).all(axis=2).sum()) for name, colour in same.items()}

    for scene in ("01_far_small_sphere", "05_shells_one_ulp_apart", "10_huge_scene"):
        certain, textbook = counts(scene, CERTIFIED), counts(scene, "textbook")
        assert certain["exact"] + certain["nothing"] == 64 * 64
        assert textbook["wrong"] + textbook["hit"] + textbook["miss"] > 500
        truth = eye_hits(interpreter(f"scenes/hard/{scene}.cli"), 64, 64)
        found = eye_hits(interpreter(f"scenes/hard/{scene}.cli"), 64, 64, method="textbook")
        assert textbook["hit"] == ((found.index >= 0) & (truth.index < 0)).sum()
        assert textbook["miss"] == ((found.index < 0) & (truth.index >= 0)).sum()
        assert textbook["wrong"] == ((found.index >= 0) & (truth.index >= 0) & (found.index != truth.index)).sum()


def test_a_method_that_there_is_not_is_refused():
    scene = interpreter("scenes/01_one_sphere.cli")
    for refuse in (
        lambda: render_scene(scene, method="guess"),
        lambda: eye_hits(scene, method="guess"),
        lambda: ray_intersect_scene([[0, 0, 0]], [[0, 0, 1]], [[0, 0, 5]], [1], method="guess"),
    ):
        with pytest.raises(ValueError, match="expected one of certified, textbook"):
            refuse()
