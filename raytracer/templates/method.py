"""A method of one's own: how rays meet a sphere, many at once, in numpy.

python -m sketch --plug my_method.py          # x shows where it is wrong, against exact arithmetic
python -m raytracer test my_method.py         # rays where methods fail
"""

import numpy as np


def method(origin, direction, centre, r):
    """t of the first hit with t > 0, +inf for a miss: an array, one t a ray.

    origin, direction and centre are each x, y, z. The direction's are arrays, one number a ray; the rest are arrays or
    single numbers.
    """
    away = [o - c for o, c in zip(origin, centre)]
    a = sum(d * d for d in direction)
    h = sum(d * x for d, x in zip(direction, away))
    c = sum(x * x for x in away) - r * r
    disc = h * h - a * c
    root = np.sqrt(np.maximum(disc, 0.0))
    near, far = (-h - root) / a, (-h + root) / a
    t = np.where(near > 0, near, np.where(far > 0, far, np.inf))
    return np.where(disc >= 0, t, np.inf)
