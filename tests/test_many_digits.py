"""The course's sphere scenes in 50 digits: every byte of every pixel, and in every run a sample of them."""

import mpmath
import naive
import numpy as np
import pytest

from raytracer import eye_hits, interpreter, render_scene

SIZE, DIGITS = 320, 50
SPHERE_SCENES = ["01_one_sphere", "02_three_spheres", "03_shiny_sphere", "04_many_spheres", "08_reflective_sphere",
                 "10_reflections_in_reflections"]  # fmt: skip


class Scene:
    """A scene in numbers of 50 digits."""

    def __init__(self, name):
        said = naive.read(naive.Path(f"scenes/{name}.cli"))
        self.eye, self.background = vector(said["eye"]), vector(said["background"])
        uvw = vector(said["uvw"])
        self.u, self.v, self.w = uvw[:3], uvw[3:6], uvw[6:]
        self.back = mpmath.mpf(naive.focal_length(said["fov"][0]))
        self.lights = [(vector(position), vector(colour)) for position, colour in said["lights"]]
        self.spheres = [
            (vector(centre), mpmath.mpf(radius), vector(material[:3])) for _, centre, radius, material in said["shapes"]
        ]

    def bytes(self, x, y):
        """What the language page says of the pixel in column x and row y."""
        across, up = mpmath.mpf(2 * x - SIZE) / SIZE, mpmath.mpf(SIZE - 2 * y) / SIZE
        ray = [across * a + up * b - self.back * c for a, b, c in zip(self.u, self.v, self.w, strict=True)]
        hits = [(t, k) for k, sphere in enumerate(self.spheres) if (t := first_root(self.eye, ray, sphere)) is not None]
        colour = self.shade(ray, *min(hits)) if hits else self.background
        return [int(mpmath.floor(255 * min(max(c, 0), 1) + mpmath.mpf(1) / 2)) for c in colour]

    def shade(self, ray, t, k):
        centre, radius, diffuse = self.spheres[k]
        point = [e + t * d for e, d in zip(self.eye, ray, strict=True)]
        normal = [(p - c) / radius for p, c in zip(point, centre, strict=True)]
        colour = [mpmath.mpf(0)] * 3
        for position, light in self.lights:
            away = [a - b for a, b in zip(position, point, strict=True)]
            cosine = mpmath.fdot(normal, away) / mpmath.sqrt(mpmath.fdot(away, away))
            colour = [c + d * b * max(cosine, 0) for c, d, b in zip(colour, diffuse, light, strict=True)]
        return colour


def vector(numbers):
    return [mpmath.mpf(number) for number in numbers]


def first_root(eye, ray, sphere):
    centre, radius, _ = sphere
    away = [e - c for e, c in zip(eye, centre, strict=True)]
    a, b, c = mpmath.fdot(ray, ray), 2 * mpmath.fdot(ray, away), mpmath.fdot(away, away) - radius**2
    disc = b * b - 4 * a * c
    if disc < 0:
        return None
    root = mpmath.sqrt(disc)
    return next((t for t in ((-b - root) / (2 * a), (-b + root) / (2 * a)) if t > 0), None)


def assert_bytes(name, pixels):
    picture = render_scene(interpreter(f"scenes/{name}.cli"), "diffuse", SIZE, SIZE)
    with mpmath.workdps(DIGITS):
        scene = Scene(name)
        for x, y in pixels:
            assert picture[y, x].tolist() == scene.bytes(x, y), (x, y)


@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_a_sample_of_pixels_and_of_outlines(name):
    index = eye_hits(interpreter(f"scenes/{name}.cli"), SIZE, SIZE).index
    outline = np.argwhere(index[1:, 1:] != index[:-1, :-1])[:, ::-1]
    rng = np.random.default_rng(4)
    chosen = rng.choice(outline, 120).tolist() + rng.integers(0, SIZE, (180, 2)).tolist()
    assert_bytes(name, chosen)


@pytest.mark.slow
@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_every_pixel(name):
    assert_bytes(name, [(x, y) for y in range(SIZE) for x in range(SIZE)])
