"""A ray tracer in the course's own style: one ray, one sphere, one hit at a time.

    python -m sketch --plug my_tracer.py          # in the window; v compares with the reference, saving draws anew
    python -m raytracer render SCENE -o out.png --plug my_tracer.py
    python -m raytracer test my_tracer.py         # what is right, and what is not

Delete whatever you do not want to write yourself: the tracer's own part stands in for it. Vectors and colours are
tuples of three numbers.
"""

from math import radians, sqrt, tan

STAGE = "diffuse"  # what `shade` draws; "full" with ambient and specular light, shadows and mirrors


def eye_ray(camera, x, y, width, height):
    """The direction of the ray through column x and row y, counted from the top left; it need not be of length 1.

    The camera has eye, u (right), v (up), w (backwards) and fov, the whole vertical angle in degrees.
    """
    across = (2 * x - width) / height
    up = (height - 2 * y) / height
    d = 1 / tan(radians(camera.fov) / 2)
    return [across * u + up * v - d * w for u, v, w in zip(camera.u, camera.v, camera.w)]


def intersect(ray, sphere):
    """t of the first hit with t > 0, at ray.origin + t * ray.direction, or None.

    The sphere has a centre and a radius. At the first stage True and False will do.
    """
    away = [o - c for o, c in zip(ray.origin, sphere.centre)]
    a = dot(ray.direction, ray.direction)
    b = 2 * dot(ray.direction, away)
    c = dot(away, away) - sphere.radius**2
    disc = b * b - 4 * a * c
    if disc < 0:
        return None
    root = sqrt(disc)
    for t in ((-b - root) / (2 * a), (-b + root) / (2 * a)):
        if t > 0:
            return t
    return None


def shade(hit):
    """The colour of a hit, 0 to 1.

    A hit has point, normal (of length 1), ray, t, shape, material (diffuse, ambient, specular, power, k_refl), lights
    (each with position and colour) and scene (with background, camera, spheres, triangles). hit.trace(origin,
    direction) is what another ray hits first, or None.
    """
    colour = [0.0, 0.0, 0.0]
    for light in hit.lights:
        to_light = unit([q - p for q, p in zip(light.position, hit.point)])
        cosine = max(0.0, dot(hit.normal, to_light))
        for k in range(3):
            colour[k] += hit.material.diffuse[k] * light.colour[k] * cosine
    return colour


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def unit(a):
    length = sqrt(dot(a, a))
    return [x / length for x in a]
