"""t to the last digit from what a picture's rays share: the bounds of its errors hold, and it says where it is not."""

from fractions import Fraction
from math import sqrt

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from raytracer import exact, fine
from raytracer.camera import focal_length, make_raster
from raytracer.scene import Camera

HEIGHT, WIDTH = 1080, 1920
U2 = Fraction(2) ** -106


def turned(seed: int) -> Camera:
    """A camera anywhere."""
    rng = np.random.default_rng(seed)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    eye = rng.normal(size=3) * 10.0 ** rng.uniform(-2, 2)
    u, v, w = (tuple(row) for row in axes.tolist())
    return Camera(tuple(eye.tolist()), u, v, w, float(rng.uniform(20, 100)))


def twofold(numerator: int, divisor: int) -> tuple[float, float]:
    high = float(Fraction(numerator, divisor))
    return high, float(Fraction(numerator, divisor) - Fraction(high))


def whole(pair: tuple[float, float]) -> Fraction:
    return Fraction(float(pair[0])) + Fraction(float(pair[1]))


def inner(a: list[Fraction], b: list[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


CASES = st.tuples(
    st.integers(0, 2**32 - 1),
    st.integers(0, WIDTH - 1),
    st.integers(0, HEIGHT - 1),
    st.floats(-1, 3).map(lambda power: 10.0**power),  # how far the sphere is
    st.floats(-6, -0.7).map(lambda power: 10.0**power),  # its radius by that
    st.floats(0, 1) | st.floats(-12, -1).map(lambda power: 1 - 10.0**power) | st.floats(1, 2),  # how far from the ray
)


def met(case):
    """h, a, c of a ray and a sphere as `fine` has them, and exactly; m and l; the sphere, and the ray's direction."""
    seed, x, y, distance, rho, beside = case
    camera = turned(seed)
    raster, back = make_raster(camera, WIDTH, HEIGHT), focal_length(camera.fov)
    steps, unit = raster.whole_direction(x, y)
    d = [Fraction(step, unit) for step in steps]
    ahead = np.array([float(part) for part in d])
    ahead *= distance / np.linalg.norm(ahead)
    aside = np.cross(ahead, np.random.default_rng(seed + 1).normal(size=3))
    aside /= np.linalg.norm(aside)
    radius = distance * rho
    centre = tuple((np.array(camera.eye) + ahead + aside * (radius * beside)).tolist())
    across, up = (twofold(int(number), raster.whole_height) for number in raster.numerators(x, y))
    hu, hv, hw, c = fine.seen(camera.eye, centre, radius, camera.u, camera.v, camera.w, back)
    frame = fine.frame_of(camera.u, camera.v, camera.w, back)
    a1, a0 = fine.square_of_row(up, frame)
    h, a = (
        fine.linear(across, hu, fine.linear(up, hv, hw)),
        fine.linear(across, fine.linear(across, frame[0], a1), a0),
    )
    away = [Fraction(o) - Fraction(p) for o, p in zip(camera.eye, centre, strict=True)]
    true = inner(d, away), inner(d, d), inner(away, away) - Fraction(radius) ** 2
    terms = zip(camera.u, camera.v, camera.w, strict=True)
    m = sqrt(sum((abs(across[0] * u) + abs(up[0] * v) + abs(back * w)) ** 2 for u, v, w in terms))
    size = sqrt(inner(away, away) + Fraction(radius) ** 2)
    return (h, a, c), true, (Fraction(m), Fraction(size)), (camera.eye, centre, radius), (steps, unit)


@given(CASES)
def test_what_a_picture_shares_is_known_to_twice_the_digits(case):
    found, true, (m, size), _, _ = met(case)
    for pair, value, bound in zip(found, true, (64 * m * size, 64 * m * m, 40 * size * size), strict=True):
        assert abs(whole(pair) - value) <= bound * U2


@given(CASES)
def test_what_is_certain_is_the_last_digit(case):
    found, (h, a, c), _, (eye, centre, radius), direction = met(case)
    with np.errstate(all="ignore"):
        t, sure = fine.meet(*((np.float64(high), low) for high, low in found))
    if sure:
        assert h * h > a * c
        nearest, _ = exact.nearest_of([*eye, *centre, radius], *direction)
        assert abs(t - nearest) <= np.spacing(nearest) * (t != nearest)


def test_most_hits_are_certain():
    rng, sure = np.random.default_rng(1), 0
    for seed in range(200):
        case = seed, int(rng.integers(WIDTH)), int(rng.integers(HEIGHT)), 10.0, 0.01, float(rng.uniform(0, 0.999))
        found, *_ = met(case)
        sure += bool(fine.meet(*((np.float64(high), low) for high, low in found))[1])
    assert sure == 200
