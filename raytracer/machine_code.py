"""Where the machine code of the kernels is kept, and whether some of it is there. Loads no compiler.

numba's cache looks at the file of a kernel only, not at the files it calls into; so the cache lies in a folder named
after all of these.
"""

from __future__ import annotations

import hashlib
import os
from functools import cache
from getpass import getuser
from pathlib import Path
from tempfile import gettempdir

_HERE = Path(__file__).parent
_SOURCES = (
    "arrays",
    "twofold",
    "certified",
    "boxes",
    "facets",
    "shading",
    "bounce",
    "methods",
)  # what kernels call into


@cache
def folder() -> Path | None:
    """The first place that can be written to; None if there is none."""
    kernels = _HERE / "kernels"
    sources = [_HERE / f"{name}.py" for name in _SOURCES] + sorted(kernels.glob("*.py"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]
    places = (
        kernels / "__pycache__",
        Path("~/.cache/raytracer").expanduser(),
        Path(gettempdir()) / f"raytracer-{getuser()}",
    )
    return next((place / digest for place in places if _can_write(place / digest)), None)


def is_kept(kernel: str) -> bool:
    """Whether this kernel has been compiled before."""
    where = folder()
    return where is not None and next(where.glob(f"*/*.{kernel}-*.nbi"), None) is not None


def _can_write(place: Path) -> bool:
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(place, os.W_OK)
