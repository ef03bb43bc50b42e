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
            (vector(centre), mpmath.mpf(radius), vector(material)) for _, centre, radius, material in said["shapes"]
        ]

    def bytes(self, x, y, stage="diffuse"):
        """What is to be cut off to whole numbers, for the pixel in column x and row y."""
        across, up = mpmath.mpf(2 * x - SIZE) / SIZE, mpmath.mpf(SIZE - 2 * y) / SIZE
        ray = [across * a + up * b - self.back * c for a, b, c in zip(self.u, self.v, self.w, strict=True)]
        colour = self.diffuse(ray) if stage == "diffuse" else self.full(self.eye, ray, None, 10)
        return [255 * min(max(c, 0), 1) + mpmath.mpf(1) / 2 for c in colour]

    def first_hit(self, origin, ray, left):
        """t and the number of the sphere; the one that the ray leaves is outside of it, and not met again."""
        roots = ((first_root(origin, ray, sphere), k) for k, sphere in enumerate(self.spheres) if k != left)
        return min(((t, k) for t, k in roots if t is not None), default=None)

    def full(self, origin, ray, left, reflections):
        """ambient + k_refl · C of the mirrored ray + what the lights add that nothing hides; all eyes are outside."""
        hit = self.first_hit(origin, ray, left)
        if hit is None:
            return self.background
        t, k = hit
        centre, radius, material = self.spheres[k]
        point = [o + t * d for o, d in zip(origin, ray, strict=True)]
        normal, unit = [(p - c) / radius for p, c in zip(point, centre, strict=True)], unit_of(ray)
        colour = material[3:6]
        for position, light in self.lights:
            away = [a - b for a, b in zip(position, point, strict=True)]
            cosine = mpmath.fdot(normal, unit_of(away))
            blocked = self.first_hit(point, away, k)
            if cosine <= 0 or (blocked is not None and blocked[0] < 1):
                continue
            half = unit_of([a - b for a, b in zip(unit_of(away), unit, strict=True)])
            shine = max(mpmath.fdot(normal, half), 0) ** material[9]
            added = [d * cosine + s * shine for d, s in zip(material[:3], material[6:9], strict=True)]
            colour = [c + b * a for c, b, a in zip(colour, light, added, strict=True)]
        if material[10] > 0 and reflections > 0:
            along = 2 * mpmath.fdot(unit, normal)
            mirrored = self.full(point, [u - along * n for u, n in zip(unit, normal, strict=True)], k, reflections - 1)
            colour = [c + material[10] * m for c, m in zip(colour, mirrored, strict=True)]
        return colour

    def diffuse(self, ray):
        hit = self.first_hit(self.eye, ray, None)
        return self.background if hit is None else self.shade(ray, *hit)

    def shade(self, ray, t, k):
        centre, radius, diffuse = *self.spheres[k][:2], self.spheres[k][2][:3]
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


def unit_of(numbers):
    length = mpmath.sqrt(mpmath.fdot(numbers, numbers))
    return [number / length for number in numbers]


def first_root(eye, ray, sphere):
    centre, radius, _ = sphere
    away = [e - c for e, c in zip(eye, centre, strict=True)]
    a, b, c = mpmath.fdot(ray, ray), 2 * mpmath.fdot(ray, away), mpmath.fdot(away, away) - radius**2
    disc = b * b - 4 * a * c
    if disc < 0:
        return None
    root = mpmath.sqrt(disc)
    return next((t for t in ((-b - root) / (2 * a), (-b + root) / (2 * a)) if t > 0), None)


def assert_bytes(name, pixels, stage="diffuse"):
    picture = render_scene(interpreter(f"scenes/{name}.cli"), stage, SIZE, SIZE)
    with mpmath.workdps(DIGITS):
        scene = Scene(name)
        for x, y in pixels:
            for found, true in zip(picture[y, x].tolist(), scene.bytes(x, y, stage), strict=True):
                on_the_border = abs(true - mpmath.nint(true)) < 1e-12  # some colours of the file are, such as 0.7 · 1
                assert found == int(true) or (on_the_border and abs(found - true) < 1), (x, y)


@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_a_sample_of_pixels_and_of_outlines(name):
    index = eye_hits(interpreter(f"scenes/{name}.cli"), SIZE, SIZE).index
    outline = np.argwhere(index[1:, 1:] != index[:-1, :-1])[:, ::-1]
    rng = np.random.default_rng(4)
    chosen = rng.choice(outline, 120).tolist() + rng.integers(0, SIZE, (180, 2)).tolist()
    assert_bytes(name, chosen)


@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_a_sample_of_pixels_in_all_light(name):
    """Mirrors in mirrors magnify errors, up to ten times after each other: float64 has digits enough for a byte."""
    rng = np.random.default_rng(11)
    assert_bytes(name, rng.integers(0, SIZE, (60, 2)).tolist(), "full")


@pytest.mark.slow
@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_every_fourth_pixel_in_all_light(name):
    assert_bytes(name, [(x, y) for y in range(0, SIZE, 2) for x in range(0, SIZE, 2)], "full")


@pytest.mark.slow
@pytest.mark.parametrize("name", SPHERE_SCENES)
def test_every_pixel(name):
    assert_bytes(name, [(x, y) for y in range(SIZE) for x in range(SIZE)])
