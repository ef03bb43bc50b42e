"""Which pixels can see a sphere: the bounding box of the ellipse that it covers on the screen.

With M = (u, v, −d·w) the frame's matrix and n₁, n₂, n₃ the rows of M⁻¹, the sphere's centre is at x = n₁·(C − O),
y = n₂·(C − O), z = n₃·(C − O) in the coordinates of the screen, and a ray is (U, V, 1) there. The lines that touch the
ellipse are those of the dual conic K, Kᵢⱼ = xᵢ xⱼ − r² nᵢ·nⱼ (R. Hartley, A. Zisserman, Multiple View Geometry, 8.3),
so U lies between the roots of K₃₃ U² − 2 K₁₃ U + K₁₁ = 0:

    U = (K₁₃ ± r √(|x n₃ − z n₁|² − r² |n₁ × n₃|²)) / K₃₃

and V likewise. Written so, the root's argument does not cancel for small spheres.
"""

from __future__ import annotations

import numpy as np

from raytracer.camera import Raster, inverse_frame

_PAD = 1e-9  # relative, against rounding, beside a pixel all around
_CROSSES = 1e-6  # K₃₃ / z² below this: the sphere reaches the plane of the eye, the ellipse opens up


def screen_boxes(raster: Raster, eye: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Boxes that hold every pixel whose ray may hit: int32 (s, 4), left, right, top, bottom, ends excluded.

    The eye (3,), the centres (s, 3) and the radii (s,) are in one unit of length, of anyone's choice. A sphere behind
    the eye has an empty box, one around the eye or beside it that of the whole picture.
    """
    width, height = raster.width, raster.height
    whole = np.broadcast_to(np.array([0, width, 0, height], np.int32), (len(radii), 4))
    n = inverse_frame(raster.camera)
    if n is None:
        return np.ascontiguousarray(whole)
    with np.errstate(all="ignore"):
        n, e = _without_powers_of_two(n)
        lengths, _ = _without_powers_of_two(np.column_stack([centres - eye, radii]))
        radii = lengths[:, 3]
        x, y, z = n @ lengths[:, :3].T
        r2 = radii * radii
        k33 = z * z - r2 * (n[2] @ n[2])
        apart = k33 > _CROSSES * (z * z + r2 * (n[2] @ n[2]))
        left, right = np.ldexp(_range(x, z, radii, n[0], n[2], k33), e[0] - e[2])
        bottom, top = np.ldexp(_range(y, z, radii, n[1], n[2], k33), e[1] - e[2])
        # U = (2x − W) / H and V = (H − 2y) / H, solved for x and y
        first = np.stack([(left * height + width) / 2, (1 - top) * height / 2])
        last = np.stack([(right * height + width) / 2, (1 - bottom) * height / 2])
        size = np.array([[width], [height]])
        first, end = np.clip(np.floor(first) - 1, 0, size), np.clip(np.ceil(last) + 2, 0, size)
        box = np.stack([first[0], end[0], first[1], end[1]], axis=1)
        known = apart & np.isfinite(box).all(axis=1)
        box = np.where((known & (z > 0))[:, None], box, 0)
    return np.where(known[:, None], box, whole).astype(np.int32)


def _without_powers_of_two(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows whose largest component is near 1, so that their squares are in range, and the exponents taken out."""
    exponents = np.frexp(np.abs(rows).max(axis=1, initial=0.0))[1]
    return np.ldexp(rows, -exponents[:, None]), exponents


def _range(
    x: np.ndarray, z: np.ndarray, radii: np.ndarray, n1: np.ndarray, n3: np.ndarray, k33: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The ellipse's extent along one axis of the screen, padded."""
    across = x[:, None] * n3 - z[:, None] * n1
    normal = np.cross(n1, n3)
    root = np.sqrt(np.einsum("ij,ij->i", across, across) - radii * radii * (normal @ normal))
    middle = (x * z - radii * radii * (n1 @ n3)) / k33
    half = radii * root / k33
    half = half * (1 + _PAD) + _PAD * np.abs(middle)
    return middle - half, middle + half
