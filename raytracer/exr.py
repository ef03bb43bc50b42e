"""OpenEXR: the colours as they are, not cut off at white, and what each pixel shows, and how far away.

R G B   float32, the stage's colours
Z       float32, t of the eye ray's hit; +inf for a miss
id      uint32, the shape's place among all shapes of the file, from 0; 4294967295 for a miss
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from raytracer.image import check_can_save, drafted, is_file_to_be
from raytracer.render import Progress, Watch, draw, hits_of, open_tracer
from raytracer.tiled import Picture


def save_exr(
    picture: Picture,
    path: Path,
    threads: int | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> None:
    """Draw a picture of one sample a pixel into an OpenEXR file, whole or not at all.

    Raises ValueError for more samples, or where OpenEXR is not installed; what `Picture.plan` does; `OSError`.
    """
    try:
        import OpenEXR
    except ImportError:
        raise ValueError(f"{path}: OpenEXR is not installed; pip install OpenEXR brings it") from None
    if picture.samples != 1:
        raise ValueError(f"found {picture.samples} samples, expected 1: a pixel of an OpenEXR file shows one shape")
    check_can_save(path)
    path = path.resolve()
    if not is_file_to_be(path):
        raise ValueError(f"{path}: found a pipe or a device, expected a file")
    plan = picture.plan()
    colours = draw(plan, threads=threads, progress=progress, cancelled=cancelled)
    with open_tracer(plan, threads) as tracer:
        hits = hits_of(plan, tracer, Watch(threads), polished=True)
    red, green, blue = (np.ascontiguousarray(colours[..., k]) for k in range(3))
    with np.errstate(over="ignore"):
        channels = {"R": red, "G": green, "B": blue, "Z": hits.t.astype(np.float32), "id": hits.index.astype(np.uint32)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with drafted(path) as draft:
        OpenEXR.File(header, channels).write(str(draft))
