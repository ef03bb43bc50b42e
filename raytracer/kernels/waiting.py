"""Threads that wait for each other for a moment, without the interpreter and without going to sleep.

To be woken takes the system 0.1 ms, and the interpreter, which lets only one thread at it, as long again.

    caller   ── kernel: rings ────────────────────── has_ended ──
    helper   ── linger ──┐                          ┌── linger ──
                         └─ takes the task: kernel ─┘
"""

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from raytracer.kernels.compiler import borrowing, inlined
from raytracer.kernels.lanes import PROCESSOR, take_number

_ALIGNED = 8
_FIRST = np.uint64(0)


@intrinsic
def _seen(typing, array):
    """The first element of an int64 array, to which another thread may write at any time."""

    def lower(context, builder, sig, args):
        return builder.load_atomic(context.make_array(sig.args[0])(context, builder, args[0]).data, "acquire", _ALIGNED)

    return types.int64(array), lower


@intrinsic
def _show(typing, array, number):
    """Let other threads see a number there, and all that has been written before."""

    def lower(context, builder, sig, args):
        array, number = args
        builder.store_atomic(number, context.make_array(sig.args[0])(context, builder, array).data, "release", _ALIGNED)
        return context.get_dummy_value()

    return types.void(array, types.int64), lower


@intrinsic
def _pause(typing):
    """A moment in which the core does little."""

    def lower(context, builder, sig, args):
        if PROCESSOR.get("sse2"):
            kind = ir.FunctionType(ir.VoidType(), [])
            builder.call(get_or_insert_function(builder.module, kind, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), lower


@inlined
def _changes(array, before, turns):
    """Whether another thread writes a number other than that before so many turns are over."""
    for _ in range(turns):
        if _seen(array) != before:
            return True
        _pause()
    return False


@borrowing("void(int64[::1], int64[::1], int64)")
def linger(ended, bell, turns):
    """Say that something has ended, and wait until the bell rings, so many turns at most."""
    before = _seen(bell)
    _show(ended, 1)
    _changes(bell, before, turns)


@borrowing("boolean(int64[::1], int64)")
def has_ended(ended, turns):
    """Whether something has ended before so many turns are over."""
    return _changes(ended, 0, turns)


@borrowing
def ring(bell):
    """Call those who linger: whoever does that in a kernel has let go of the interpreter, which they need next."""
    take_number(bell, _FIRST)
