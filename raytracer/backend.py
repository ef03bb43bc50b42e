"""Which of the two paths traces: numpy, at hand at once, or the kernels, fast once their compiler is loaded.

Loading the compiler takes longer than numpy takes for a small picture. Nobody knows how many pictures will follow, so
numpy is used until it has cost as much as loading would have: then the whole never costs more than twice the best (the
ski-rental rule: R. Karp, "On-line algorithms versus off-line algorithms", 1992). Both paths draw the same bytes.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from threading import Lock
from types import ModuleType

from raytracer import machine_code, plain
from raytracer.pool import linger_by

_PRICE = 0.5  # seconds to load the compiler and what it has compiled before
_PRICE_OF_COMPILING = 6.0  # seconds, if it has compiled nothing before
_SECONDS_A_TEST, _SECONDS_A_LOOP = 1e-7, 3e-4  # numpy: a ray against a sphere; a sphere against a block of rays

_loading, _counting = Lock(), Lock()
_loaded: ModuleType | None = None
_spent = 0.0
_fault = ""


def why_no_compiler() -> str:
    """What keeps the kernels from being compiled, in a few words; nothing if all is there, as far as is known."""
    return _fault or ("" if find_spec("numba") else "numba is not installed")


def load() -> ModuleType:
    """The compiled path, loaded if it was not; the numpy path where the compiler cannot be loaded."""
    global _loaded
    with _loading:
        if _loaded is None:
            _loaded = import_kernels() or plain
        return _loaded


def loaded() -> ModuleType | None:
    """The path that is used for everything from now on, once there is one."""
    return _loaded


def is_ready(kernel: str) -> bool:
    """Whether a kernel has machine code: made by this process, or kept."""
    return is_loaded(kernel) or machine_code.is_kept(kernel)


def is_loaded(kernel: str) -> bool:
    """Whether a kernel can be called at once."""
    return _loaded is not None and bool(getattr(_loaded, kernel).signatures)


def choose(tests: int, loops: int, kernel: str = "") -> ModuleType:
    """The path for so many tests of a ray against a shape, in so many loops over rays.

    Loading costs more if a kernel that is wanted has never been compiled.
    """
    global _spent
    if _loaded is not None:
        return _loaded
    seconds = tests * _SECONDS_A_TEST + loops * _SECONDS_A_LOOP
    with _counting:
        price = _PRICE if not kernel or machine_code.is_kept(kernel) else _PRICE_OF_COMPILING
        rent = _spent + seconds <= price
        if rent:
            _spent += seconds
    return plain if rent else load()


def import_kernels() -> ModuleType | None:
    """The kernels, without using them from now on; None if their compiler cannot be loaded."""
    global _fault
    try:
        kernels = import_module("raytracer.kernels")
    except ImportError as error:
        _fault = why_no_compiler() or f"numba cannot be loaded ({error})"
        return None
    linger_by(kernels)
    return kernels
