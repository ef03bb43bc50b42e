"""Threads that wait for each other for a moment, and help each other, without the interpreter and without sleeping.

To be woken takes the system 0.1 ms, and the interpreter, which lets only one thread at it, as long again.

    caller   ── kernel: offers seats ── work ─────── waits ──   board   bell, asked | seats | busy | work | arguments …
    helper   ── linger ──────┐                   ┌── linger ──
                             └ claims one: work ─┘

Whoever offers work writes it on the board, unless another thread has, and how many may help. Who claims a seat before
it is withdrawn does the same work with the same arguments, and the seat's number. All that is in one kernel: nothing
that interrupts the interpreter comes between, and what the caller holds outlives the help.
"""

import os

from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from raytracer.arrays import APART, ASKED, BELL, BOARD, SEATS, TAKEN
from raytracer.kernels.compiler import borrowing, inlined, variant
from raytracer.kernels.lanes import PROCESSOR

_ALIGNED = 8
_BUSY, _WORK, _ARGUMENTS = (APART * place for place in range(2, 5))  # on the board as well
_SPIN = 1 << 14  # turns, after which a thread that waits lets others at its core
_WORD = ir.IntType(64)


def _place(context, builder, array_type, array, at):
    return builder.gep(context.make_array(array_type)(context, builder, array).data, [at])


@intrinsic
def seen(typing, array, at):
    """An element of an int64 array, to which another thread may write at any time."""

    def lower(context, builder, sig, args):
        return builder.load_atomic(_place(context, builder, sig.args[0], *args), "acquire", _ALIGNED)

    return types.int64(array, types.int64), lower


@intrinsic
def show(typing, array, at, number):
    """Let other threads see a number there, and all that has been written before."""

    def lower(context, builder, sig, args):
        array, at, number = args
        builder.store_atomic(number, _place(context, builder, sig.args[0], array, at), "release", _ALIGNED)
        return context.get_dummy_value()

    return types.void(array, types.int64, types.int64), lower


@intrinsic
def add(typing, array, at, number):
    """Add to an element that others may change; returns what it was."""

    def lower(context, builder, sig, args):
        array, at, number = args
        return builder.atomic_rmw("add", _place(context, builder, sig.args[0], array, at), number, "acq_rel")

    return types.int64(array, types.int64, types.int64), lower


@intrinsic
def _replace(typing, array, at, before, after):
    """Write a number if another is there; returns whether it was."""

    def lower(context, builder, sig, args):
        array, at, before, after = args
        place = _place(context, builder, sig.args[0], array, at)
        return builder.extract_value(builder.cmpxchg(place, before, after, "acq_rel", "acquire"), 1)

    return types.boolean(array, types.int64, types.int64, types.int64), lower


@intrinsic
def _pause(typing):
    """A moment in which the core does little."""

    def lower(context, builder, sig, args):
        if PROCESSOR.get("sse2"):
            kind = ir.FunctionType(ir.VoidType(), [])
            builder.call(get_or_insert_function(builder.module, kind, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), lower


_BY_ADDRESS = types.voidptr, types.int64  # what a function is given that is called so: where arguments are, and a seat


def offering(work):
    """A part of kernels: `offer(board, seats, arguments)` lets so many of those who linger do work(*arguments, seat).

    Seats are counted from 1. `work` is a kernel, and borrows what it is given. It returns whether anybody may help, who
    is to be waited for then, by `wait_for_help`.
    """

    @intrinsic
    def write_work(typing, board, arguments):
        kind = typing.resolve_value_type(work)
        signature = kind.get_call_type(typing, (*arguments.types, types.int64), {})

        def lower(context, builder, sig, args):
            _write(context, builder, sig.args, args, context.get_function(kind, signature))
            return context.get_dummy_value()

        return types.void(board, arguments), lower

    return variant(_offer, f"offer_{work.__name__}", inlined, write_work=write_work)


def _offer(board, seats, arguments):
    if seats <= 0 or not _replace(board, TAKEN, 0, 1):
        return False
    write_work(board, arguments)
    show(board, _BUSY, seats)
    show(board, SEATS, seats)
    show(board, ASKED, 0)
    return True


@inlined
def wait_for_help(board):
    """Withdraw the seats that nobody has claimed, and wait until those who have are done."""
    left = seen(board, SEATS)
    while not _replace(board, SEATS, left, 0):
        left = seen(board, SEATS)
    add(board, _BUSY, -left)
    wait_until(board, _BUSY, 0)
    show(board, TAKEN, 0)


def _write(context, builder, kinds, values, call):
    """Write on the board what is to be called by its address, and with what."""
    (board_kind, kind), (board, arguments), conv = kinds, values, context.call_conv
    value = context.get_value_type(kind)
    if (size := context.get_abi_sizeof(value)) > 8 * (BOARD - _ARGUMENTS):
        raise ValueError(f"found {size} bytes of arguments, expected {8 * (BOARD - _ARGUMENTS)} at most")
    function_type = conv.get_function_type(types.none, _BY_ADDRESS)
    function = ir.Function(builder.module, function_type, f"{builder.function.name}.by_a_helper")
    function.linkage = "internal"
    inner = ir.IRBuilder(function.append_basic_block())
    where, seat = conv.get_arguments(function)
    given = inner.load(inner.bitcast(where, value.as_pointer()), align=_ALIGNED)
    call(inner, (*(inner.extract_value(given, k) for k in range(len(kind.types))), seat))
    conv.return_value(inner, context.get_dummy_value())
    address, room = (_place(context, builder, board_kind, board, ir.Constant(_WORD, at)) for at in (_WORK, _ARGUMENTS))
    builder.store(builder.ptrtoint(function, _WORD), address)
    builder.store(arguments, builder.bitcast(room, value.as_pointer()), align=_ALIGNED)


@intrinsic
def _do_work(typing, board, seat):
    """Do what is written on the board."""

    def lower(context, builder, sig, args):
        (board, seat), conv = args, context.call_conv

        def place(k):
            return _place(context, builder, sig.args[0], board, ir.Constant(_WORD, k))

        kind = conv.get_function_type(types.none, _BY_ADDRESS).as_pointer()
        function = builder.inttoptr(builder.load(place(_WORK)), kind)
        where = builder.bitcast(place(_ARGUMENTS), ir.IntType(8).as_pointer())
        conv.call_function(builder, function, types.none, _BY_ADDRESS, (where, seat))
        return context.get_dummy_value()

    return types.void(board, types.int64), lower


@intrinsic
def _make_way(typing):
    """Let another thread run that waits for this core, if the system can be told so."""

    def lower(context, builder, sig, args):
        if hasattr(os, "sched_yield"):
            builder.call(get_or_insert_function(builder.module, ir.FunctionType(ir.IntType(32), []), "sched_yield"), [])
        return context.get_dummy_value()

    return types.void(), lower


@inlined
def becomes(array, at, number, turns):
    """Whether an element is that number before so many turns are over."""
    for _ in range(turns):
        if seen(array, at) == number:
            return True
        _pause()
    return False


@inlined
def wait_until(array, at, number):
    """Until an element is that number: another thread is about to write it."""
    while not becomes(array, at, number, _SPIN):
        _make_way()


@inlined
def _help(board):
    """Claim a seat and do the work, if there is one; returns whether there was."""
    seat = seen(board, SEATS)
    if seat <= 0 or not _replace(board, SEATS, seat, seat - 1):
        return False
    _do_work(board, seat)
    add(board, _BUSY, -1)
    return True


@borrowing
def linger(ended, board, turns):
    """Say that something has ended, then help until the bell rings, or until nobody wants help for so many turns."""
    before, turn = seen(board, BELL), 0
    show(ended, 0, 1)
    while turn < turns and seen(board, BELL) == before:
        if _help(board):
            turn = 0
        _pause()
        turn += 1


@borrowing
def has_ended(ended, turns):
    """Whether something has ended before so many turns are over."""
    return becomes(ended, 0, 1, turns)
