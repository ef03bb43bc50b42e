"""A whole tracer of one's own: everything from the scene to the picture.

python -m sketch --plug my_tracer.py
"""

from math import radians, sqrt, tan

STAGE = "hit"  # which stage's picture `render_scene` draws, and is compared with


def render_scene(scene, width, height):
    """Rows of pixels, the top row first; a pixel is three numbers, red, green and blue, 0 to 1.

    The scene has camera (eye, u, v, w, fov), background, lights (position, colour), spheres (radius, centre, material)
    and triangles (vertices, material); a material has diffuse, ambient, specular, power and k_refl.
    """
    return [[pixel(scene, x, y, width, height) for x in range(width)] for y in range(height)]


def pixel(scene, x, y, width, height):
    camera = scene.camera
    across, up, d = (2 * x - width) / height, (height - 2 * y) / height, 1 / tan(radians(camera.fov) / 2)
    direction = [across * u + up * v - d * w for u, v, w in zip(camera.u, camera.v, camera.w)]
    hits = [t for sphere in scene.spheres if (t := intersect(camera.eye, direction, sphere)) is not None]
    return (0.8, 0.2, 0.3) if hits else scene.background


def intersect(origin, direction, sphere):
    away = [o - c for o, c in zip(origin, sphere.centre)]
    a, b, c = dot(direction, direction), 2 * dot(direction, away), dot(away, away) - sphere.radius**2
    disc = b * b - 4 * a * c
    if disc < 0:
        return None
    roots = (-b - sqrt(disc)) / (2 * a), (-b + sqrt(disc)) / (2 * a)
    return next((t for t in roots if t > 0), None)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
