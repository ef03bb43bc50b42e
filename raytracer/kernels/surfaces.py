"""What eight hits look like: where they are, their normals and colours.

    k, where ─ surface ─> P, n = r·N, r ─ lights ─> colours

`where` are the places of what is hit among the rows of `View.balls`.
"""

import numpy as np

from raytracer.certified import approach
from raytracer.kernels.compiler import borrowing, inlined, variant
from raytracer.kernels.desks import desk_of
from raytracer.kernels.lanes import WIDTH, at_least, first_of, gather, gather_rows, load, same, spread, store
from raytracer.kernels.visibility import from_eye
from raytracer.shading import cosine, land, land_on_any, towards


def _diffuse(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.diffuse`."""
    p, n, radius = surface(view, line, k, x, where)
    red, green, blue, light = spread(0.0), spread(0.0), spread(0.0), paints.lights
    for i in range(np.uint64(len(light))):
        facing, square = towards(p, n, (light[i, 0], light[i, 1], light[i, 2]))
        shine = cosine(facing, square, radius)
        red, green, blue = red + light[i, 3] * shine, green + light[i, 4] * shine, blue + light[i, 5] * shine
    r, g, b, _ = _colours(view, paints, where)
    return red * r, green * g, blue * b


@inlined
def normal(view, paints, line, k, row, x, where, hit, scratch):
    """`stages.normal`."""
    _, n, radius = _surface_of_any(view, line, k, x, where)
    return (n[0] / radius + 1.0) / 2.0, (n[1] / radius + 1.0) / 2.0, (n[2] / radius + 1.0) / 2.0


@inlined
def line_of(view, row):
    """What a row's rays share: a1 and a0 of D·D, and D but for U·u."""
    up, v, back, r = view.up[row], view.v, view.back, np.uint64(row)
    return view.a1[r], view.a0[r], up * v[0] - back[0], up * v[1] - back[1], up * v[2] - back[2]


@inlined
def _surface_of_spheres(view, line, k, x, where):
    """The hit points as seen from the eye and from their spheres' centres, and the radii."""
    t, direction = ray_of(view, line, k, x)
    (cx, cy, cz, radius), eye = ball_of(view, where), view.eye
    p, n = land(t, direction, (eye[0] - cx, eye[1] - cy, eye[2] - cz), radius)
    return p, n, radius


@inlined
def _surface_of_any(view, line, k, x, where):
    """The same of spheres and triangles."""
    t, direction = ray_of(view, line, k, x)
    return land_on_any(t, direction, view.eye, ball_of(view, where), at_least(where, view.first_facet))


@inlined
def ray_of(view, line, k, x):
    """t, and D."""
    across, (a1, a0, dx, dy, dz), u = load(view.across, x), line, view.u
    t = k / ((across * view.a2 + a1) * across + a0)
    return t, (across * u[0] + dx, across * u[1] + dy, across * u[2] + dz)


@inlined
def ball_of(view, where):
    """Centres and radii of the spheres at these places."""
    if same(where):
        i, balls = np.uint64(4) * np.uint64(first_of(where)), view.balls
        cx, cy, cz, radius = balls[i], balls[i + np.uint64(1)], balls[i + np.uint64(2)], balls[i + np.uint64(3)]
        return spread(cx), spread(cy), spread(cz), spread(radius)
    return gather_rows(view.balls, where)


@inlined
def _colours(view, paints, where):
    """The diffuse colours of the spheres at these places."""
    if same(where):
        i, colours = np.uint64(4) * np.uint64(view.material[np.uint64(first_of(where))]), paints.colours
        return spread(colours[i]), spread(colours[i + np.uint64(1)]), spread(colours[i + np.uint64(2)]), spread(0.0)
    return gather_rows(paints.colours, gather(view.material, where))


@inlined
def _surface_of_hits(view, d, t, _, where):
    """The same of hits that are known."""
    return land_on_any(t, d, view.eye, ball_of(view, where), at_least(where, view.first_facet))


def colours_of_hits(view, paints, t, index, columns, rows, desks, worker, out):
    """The colours of single hits, float64 (n, 3): t, index and pixels are arrays of whole eights."""
    scratch = desk_of(desks.memory, worker)
    for k in range(np.uint64(0), np.uint64(len(t)), np.uint64(WIDTH)):
        _, _, d = rays_of(view, load(rows, k), load(columns, k))
        red, green, blue = colours(view, paints, d, load(t, k), load(columns, k), load(index, k), scratch)
        store(scratch.batch, 0, red)
        store(scratch.batch, WIDTH, green)
        store(scratch.batch, 2 * WIDTH, blue)
        for lane in range(WIDTH):
            for colour in range(3):
                out[k + np.uint64(lane), colour] = scratch.batch[WIDTH * colour + lane]


@inlined
def diffuse_at(view, paints, d, t, columns, index, scratch):
    return _diffuse_of_hits(view, paints, d, t, 0, columns, index, index, scratch)


@inlined
def meet_spheres(view, rows, columns, where):
    """Where the rays of pixels meet the spheres at these places: t, D, and where float64 cannot tell."""
    across, up, d = rays_of(view, rows, columns)
    a = (across * view.a2 + gather(view.a1, rows)) * across + gather(view.a0, rows)
    x, y, z, radius = gather_rows(view.balls, where)
    hu, hv, hw, c, edge = from_eye(view, x, y, z, radius)
    k, _, doubt = approach(across * hu + (up * hv + hw), a, c, edge, np.inf)
    return k / a, d, doubt


@inlined
def rays_of(view, rows, columns):
    """U, V and D of the rays of pixels."""
    across, up, u, v, back = gather(view.across, columns), gather(view.up, rows), view.u, view.v, view.back
    d = (
        across * u[0] + (up * v[0] - back[0]),
        across * u[1] + (up * v[1] - back[1]),
        across * u[2] + (up * v[2] - back[2]),
    )
    return across, up, d


diffuse_of_spheres = variant(_diffuse, "diffuse_of_spheres", inlined, surface=_surface_of_spheres)
diffuse_of_any = variant(_diffuse, "diffuse_of_any", inlined, surface=_surface_of_any)
_diffuse_of_hits = variant(_diffuse, "_diffuse_of_hits", inlined, surface=_surface_of_hits)
diffuse_of = variant(colours_of_hits, "diffuse_of", borrowing, colours=diffuse_at)
