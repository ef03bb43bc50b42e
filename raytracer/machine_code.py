"""Where the machine code of the kernels is kept, and whether some of it is there. Loads no compiler.

numba's cache looks at the file of a kernel only, not at the files it calls into; so the cache lies in a folder named
after all of these.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from getpass import getuser
from pathlib import Path
from tempfile import gettempdir

_HERE = Path(__file__).parent
SOURCES = (  # what kernels call into; `kernels.compiler` compiles these, and no others
    "alike", "arrays", "bounce", "boxes", "camera", "certified", "facets", "fine", "methods", "quick", "shading",
    "twofold",
)  # fmt: skip


@cache
def folder() -> Path | None:
    """The first place that can be written to; None if there is none."""
    kernels = _HERE / "kernels"
    sources = [_HERE / f"{name}.py" for name in SOURCES] + sorted(kernels.glob("*.py"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]
    return next((place / digest for place in _places() if _can_write(place / digest)), None)


def _places() -> Iterator[Path]:
    """Where it may be kept, the best place first."""
    yield _HERE / "kernels" / "__pycache__"
    with suppress(RuntimeError):  # there is no home
        yield Path("~/.cache/raytracer").expanduser()
    with suppress(KeyError, ImportError, OSError):  # nobody knows the user's name
        yield Path(gettempdir()) / f"raytracer-{getuser()}"


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
