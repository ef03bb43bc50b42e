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
    ts = [intersect(camera.eye, direction, sphere) for sphere in scene.spheres]
    ts += [intersect_triangle(camera.eye, direction, triangle) for triangle in scene.triangles]
    return scene.background if all(t is None for t in ts) else (0.8, 0.2, 0.3)


def intersect(origin, direction, sphere):
    away = [o - c for o, c in zip(origin, sphere.centre)]
    a, b, c = dot(direction, direction), 2 * dot(direction, away), dot(away, away) - sphere.radius**2
    disc = b * b - 4 * a * c
    if disc < 0:
        return None
    roots = (-b - sqrt(disc)) / (2 * a), (-b + sqrt(disc)) / (2 * a)
    return next((t for t in roots if t > 0), None)


def intersect_triangle(origin, direction, triangle):
    """Moeller and Trumbore: t and the weights of the second and third vertex solve three linear equations."""
    first, second, third = triangle.vertices
    edge, other = minus(second, first), minus(third, first)
    away, p = minus(origin, first), cross(direction, other)
    determinant = dot(edge, p)
    if determinant == 0:
        return None
    q = cross(away, edge)
    v, w, t = dot(away, p) / determinant, dot(direction, q) / determinant, dot(other, q) / determinant
    return t if v >= 0 and w >= 0 and v + w <= 1 and t > 0 else None


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
