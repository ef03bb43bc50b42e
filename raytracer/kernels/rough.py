"""Quotients and roots to about the last digit of single precision: the processor's rough ones after a Newton step."""

import numpy as np

from raytracer.kernels.compiler import inlined
from raytracer.kernels.sixteen import rough_inverse, times_plus

_UNIT, _THREE = np.float32(1.0), np.float32(3.0)


@inlined
def inverse(x):
    """1 / x."""
    over = rough_inverse(x)
    return times_plus(times_plus(-x, over, _UNIT), over, over)


@inlined
def twice_root(x, rough):
    """2√x, from a rough 1 / √x."""
    root = x * rough
    return root * times_plus(-root, rough, _THREE)
