"""Rays that start on a shape: what `bounce` promises, and that other ways to start them fail where they must."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from raytracer import exact
from raytracer.bounce import LEAVING, blocks_sphere, meet_sphere, within_edges
from raytracer.contacts import from_spheres, from_triangles, touching
from raytracer.offsets import OFFSETS, Leaving, moved_by_ulps, seen_from

U = 2.0**-53
SEEDS = st.integers(0, 2**32 - 1)
POWERS = st.floats(-6, 12)
SMALL = st.integers(-40, 40).map(float)
POINT = st.tuples(SMALL, SMALL, SMALL)


def units(rng, count):
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def on_spheres(seed, power, distance, slope, count=200):
    """Points of spheres as seen from their centres, off by up to an ulp of their distance from the eye; |P|; r."""
    rng = np.random.default_rng(seed)
    radius, size = 10.0**power, 10.0**distance
    normals = units(rng, count)
    beside = np.cross(normals, units(rng, count))
    directions = beside + slope * normals
    points = radius * normals + U * size * rng.uniform(-1, 1, (count, 3))
    return points, directions * 10.0 ** rng.uniform(-3, 3, (count, 1)), radius, size


def met(points, directions, radius, size, own, from_outside):
    d = tuple(directions.T)
    a = (directions * directions).sum(axis=1)
    with np.errstate(all="ignore"):
        t = meet_sphere(tuple(points.T), d, a, 1.0 / a, radius, size, np.bool_(own), np.bool_(from_outside))
        blocked = blocks_sphere(tuple(points.T), d, a, 1.0 / a, radius, size, np.bool_(own))
    return t, blocked


@given(SEEDS, POWERS, POWERS, st.floats(-7, 3))
def test_a_ray_that_leaves_a_sphere_outward_never_meets_it(seed, power, distance, slope):
    """Not even if nobody knows that it is the sphere it leaves, but for its distance."""
    points, directions, radius, size = on_spheres(seed, power, min(distance, power + 6), 10.0**slope)
    outward = (points * directions).sum(axis=1) > 0.0
    for own in (True, False):
        t, blocked = met(points, directions, radius, size, own, False)
        assert (t[outward] == np.inf).all()
        assert not blocked[outward].any()


@given(SEEDS, POWERS, st.floats(-9, 3))
def test_a_ray_from_inside_meets_the_far_side(seed, power, slope):
    """At −2h/a, but for the rounding of h, even if the ray only grazes the sphere."""
    points, directions, radius, size = on_spheres(seed, power, power, -(10.0**slope))
    t, _ = met(points, directions, radius, size, True, False)
    for point, direction, found in zip(points.tolist(), directions.tolist(), t.tolist(), strict=True):
        terms = [Fraction(x) * Fraction(y) for x, y in zip(point, direction, strict=True)]
        a = sum(Fraction(x) ** 2 for x in direction)
        assert abs(found * a + 2 * sum(terms)) <= 16 * U * sum(map(abs, terms))


@given(SEEDS, st.integers(0, 2), st.integers(0, 2), st.booleans(), st.floats(-3, 6))
def test_two_triangles_that_share_an_edge_leave_no_hole(seed, first, second, turned, power):
    """Rays from anywhere, through the edge but for some ulps; corners in any order."""
    rng, count = np.random.default_rng(seed), 300
    p = rng.uniform(-1, 1, (count, 3)) * 10.0**power
    a, b = p + units(rng, count) * rng.uniform(1, 9, (count, 1)), p + units(rng, count) * rng.uniform(1, 9, (count, 1))
    d = a + rng.uniform(0.05, 0.95, (count, 1)) * (b - a) - p
    d *= 1.0 + rng.integers(-2, 3, (count, 3)) * 2.0**-52
    middle, side = (a + b) / 2.0, np.cross(a - p, b - p)
    seen = np.linalg.norm(side, axis=1) > 0.1
    c, e = middle + rng.uniform(0.2, 2, (count, 1)) * side, middle - rng.uniform(0.2, 2, (count, 1)) * side
    one, other = np.roll([a, b, c], first, axis=0), np.roll([a, b, e][:: -1 if turned else 1], second, axis=0)

    def hit(corners):
        return within_edges(tuple(p.T), tuple(d.T), *(tuple(corner.T) for corner in corners))

    assert (hit(one) | hit(other))[seen].all()


@given(POINT, POINT.filter(any), POINT, st.integers(1, 60).map(float))
def test_blocks_sphere_agrees_with_integers(point, direction, centre, radius):
    line = exact.line(point, direction, centre, radius)
    o, d = np.subtract(point, centre), np.array(direction)
    size, a = float(np.abs(point).sum()), float(d @ d)
    assume(abs(line.c) > 8 * LEAVING * (o @ o + radius * radius + radius * size))  # well away from the shape
    assume(abs(line.disc) > 1e-9 * float(line.a) * radius**2)  # and not tangent
    root = exact.hits(point, direction, [(centre, radius)])[0]
    t = np.inf if root is None else root.nearest_float()
    assume(abs(t - 1) > 1e-9)
    assert bool(blocks_sphere(tuple(o), tuple(d), a, 1.0 / a, radius, size, np.False_)) == (t < 1)


@given(SEEDS, st.floats(-3, 9))
def test_the_project_lands_on_its_spheres_within_the_bound(seed, power):
    rays = from_spheres(np.random.default_rng(seed), 10.0**power, 100)
    p, own = np.stack(rays.landed[0], axis=-1), seen_from(rays.own, rays.eyes)
    for point, (x, y, z, radius) in zip(p.tolist(), own.tolist(), strict=True):
        square = sum(u * u for u in np.subtract(point, (x, y, z)).tolist())
        bound = LEAVING * (square + radius * radius + radius * sum(map(abs, point)))
        assert abs(exact.side(point, (x, y, z), radius)) <= bound


@pytest.mark.parametrize("make", [from_spheres, from_triangles])
@pytest.mark.parametrize("power", range(10))
def test_the_default_never_hits_what_it_leaves(make, power):
    rays = make(np.random.default_rng(power), 10.0**power, 5000)
    assert len(rays.t) >= 4990
    assert not OFFSETS["bounce"].self_hits(rays).any()


def rate(name, make, scale):
    return float(OFFSETS[name].self_hits(make(np.random.default_rng(4), scale, 5000)).mean())


def test_other_ways_hit_what_they_leave_where_that_is_known():
    assert all(rate("none", make, 1.0) > 0.1 for make in (from_spheres, from_triangles))
    assert rate("fixed 1e-4", from_spheres, 1.0) == 0.0
    assert rate("fixed 1e-4", from_spheres, 1e9) > 0.03
    assert rate("fixed 1e-4, float32", from_spheres, 1e5) > 0.3
    assert rate("wächter_binder", from_triangles, 1.0) < 0.05  # what it was made for
    assert rate("wächter_binder", from_spheres, 1.0) > 0.1
    assert rate("wächter_binder, float64", from_spheres, 1.0) > 0.1


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_ulps_are_counted_away_from_the_surface(kind):
    p = np.array([[1.0, -1.0, 0.0], [3.0, -3.0, 0.01]], kind)
    n = np.array([[1.0, -1.0, 1.0], [0.5, 0.5, -1.0]], kind)
    ulp, tiny = np.spacing(kind(1.0)), {np.float32: 2.0**-16, np.float64: 2.0**-45}[kind]
    expected = [[1 + 256 * ulp, -1 - 256 * ulp, tiny], [3 + 256 * ulp, -3 + 256 * ulp, kind(0.01) - kind(tiny)]]
    np.testing.assert_array_equal(moved_by_ulps(p, n), np.array(expected, kind))


@pytest.mark.parametrize("name", OFFSETS)
def test_every_way_is_right_where_there_is_room(name):
    """A ball a radius away from another, seen from two radii away: all find it, at the same t."""
    eyes, own, other = np.array([[0.0, 3.0, 0.0]]), np.array([[0.0, 0.0, 0.0, 1.0]]), np.array([[0.0, 3.0, 0.0, 1.0]])
    rays = Leaving(eyes, np.array([[0.0, -1.0, 0.0]]), own, np.array([[0.0, 1.0, 0.0]]))
    assert rays.t.tolist() == [2.0]
    assert OFFSETS[name].meets(rays, other)[0] == pytest.approx(1.0, abs=2e-4)
    assert OFFSETS[name].meets(rays, np.array([[9.0, 3.0, 0.0, 1.0]]))[0] == np.inf
    assert OFFSETS[name].about
    assert OFFSETS[name].source


def test_the_given_t_is_the_nearest_float_or_its_neighbour():
    rays = touching(np.random.default_rng(3), 1.0, 200).rays
    rows = zip(rays.eyes.tolist(), rays.looks.tolist(), rays.own.tolist(), rays.t.tolist(), strict=True)
    for eye, look, (x, y, z, radius), t in rows:
        assert abs(exact.nearest_hit(eye, look, [((x, y, z), radius)])[0] - t) <= np.spacing(t)
