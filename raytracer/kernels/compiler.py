"""The one place that says how kernels are compiled.

No fast-math flag: contracting a·a − b·b turns it into noise, reassociation breaks every error-free sum, and assuming
that there is no NaN or infinity deletes the test for a miss. Division by zero gives what IEEE 754 says, no exception.

The arithmetic that numpy runs on arrays is compiled here for single numbers, from the same source. Where machine code
is kept, `machine_code` says.
"""

from __future__ import annotations

import atexit
import math
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial, wraps
from importlib import import_module
from threading import Lock, Thread, current_thread, main_thread
from types import FunctionType, ModuleType
from typing import Any

import numba
from numba.extending import overload, register_jitable

from raytracer import machine_code, twofold
from raytracer.kernels.lanes import PROCESSOR, MarkPairs, Marks, Mask, blend, fused


@overload(twofold.select)
def _select(condition, yes, no):
    if isinstance(condition, (Mask, Marks, MarkPairs)):
        return lambda condition, yes, no: blend(condition, yes, no)
    return lambda condition, yes, no: yes if condition else no


if PROCESSOR.get("fma"):  # else a fused operation is a slow call, and not on every system there

    @overload(twofold.two_product)
    def _two_product(a, b):
        def product_and_error(a, b):
            product = a * b
            return product, fused(a, b, -product)

        return product_and_error

    @overload(twofold.times_plus)
    def _times_plus(a, b, c):
        return lambda a, b, c: fused(a, b, c)


@overload(twofold.exponent)
def _exponent(x):
    return lambda x: math.frexp(x)[1]


@overload(twofold.scale)
def _scale(x, n):
    return lambda x, n: math.ldexp(x, n)


def _compile_calls_into(module: ModuleType) -> None:
    """Let kernels call every function that this module defines."""
    for function in vars(module).values():
        own = isinstance(function, FunctionType) and function.__module__ == module.__name__
        if own and function not in _OVERLOADED:
            register_jitable(function)


_OVERLOADED = (twofold.select, twofold.exponent, twofold.scale)
if PROCESSOR.get("fma"):
    _OVERLOADED += (twofold.two_product, twofold.times_plus)
for _name in machine_code.SOURCES:
    _compile_calls_into(import_module(f"raytracer.{_name}"))


_CACHE = machine_code.folder()
_at_work: list[Thread] = []
_LOOK_UP = 0.1  # seconds; what comes just before a wait, or to another thread, does not wake whom Python tells of it


def apart(compile_: Callable[[object], object]) -> Callable[[object], object]:
    """Compile in a thread of its own if it is the main thread that wants to, which waits.

    An exception that a signal raises in the middle of it leaves locks behind that others wait for, or ends the process
    where it hits a part of LLVM that asks Python for something; and it takes as long as compiling does to be answered.
    """

    @wraps(compile_)
    def compile_apart(signature: object) -> object:
        if current_thread() is not main_thread():
            return compile_(signature)
        made, ended = Future[object](), Lock()
        ended.acquire()  # a lock alone: an exception that a signal raises in a Future's wait may leave that locked

        def work() -> None:
            try:
                made.set_result(compile_(signature))
            except BaseException as error:
                made.set_exception(error)
            _at_work.remove(thread)
            ended.release()

        thread = Thread(target=work, name="compiler", daemon=True)
        _at_work.append(thread)
        thread.start()
        while not ended.acquire(timeout=_LOOK_UP):
            pass
        return made.result()

    return compile_apart


@atexit.register
def _let_end() -> None:
    """Compiling cannot be stopped, and would end badly where Python and LLVM are half gone; what it makes is kept."""
    for thread in tuple(_at_work):
        if thread.is_alive():  # it is not if what interrupted it came before it began
            thread.join()


def compiled(function: FunctionType, **options: object) -> Any:
    """A kernel made of a function."""
    kept = _CACHE is not None
    kernel = numba.njit(function, cache=kept, nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)
    kernel.compile = apart(kernel.compile)
    return kernel


# For kernels that make no arrays: without counting who still uses those that they are given.
borrowing = partial(compiled, _nrt=False)

# For parts of those that Python does not call: without what takes its arguments apart, a quarter of all machine code.
called = partial(borrowing, no_cpython_wrapper=True)

# For parts of kernels: a call would hand over each array of its arguments in seven pieces.
inlined = partial(called, forceinline=True)


def variant(template: FunctionType, name: str, compile_=called, **names):
    """A kernel made of a function that names some others which are not defined: those given here.

    It closes over nothing. Of what closes over a kernel, numba finds no machine code again in another process.
    """
    function = FunctionType(template.__code__, {**template.__globals__, **names}, name)
    function.__module__, function.__qualname__ = template.__module__, name
    return compile_(function)


@contextmanager
def cache_named_after_sources() -> Iterator[None]:
    """While this lasts, kernels that are defined take their machine code from, and put it into, that folder."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(_CACHE or before)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
