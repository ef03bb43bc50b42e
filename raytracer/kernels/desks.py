"""A thread's desk: one block of memory, and which of the arrays that a kernel writes on lies where in it.

To hand over dozens of arrays would take the interpreter longer than some kernels take; and of parts of one block the
compiler knows that they do not overlap.
"""

from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import from_dtype
from numba.core import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from raytracer.arrays import QuickScratch, Scratch
from raytracer.kernels.bounds import TILE_HEIGHT, TILE_WIDTH
from raytracer.kernels.lanes import SIXTEEN
from raytracer.kernels.visibility import STRIDE

MOST = 1 << 12  # spheres of a tile's list; of more, the table would leave the core's caches
_PAGE, _STEP = 4096, 1088  # bytes: each array begins a step further in its page, and where a line of the cache does
_NUMBERS = 1 << 14  # of spheres of a tile, for the blocks that show but one
_STACK = 8 * 24  # boxes that may wait, eight a level
_PIXELS, _BUFFER = TILE_HEIGHT * TILE_WIDTH, (TILE_HEIGHT + 1) * STRIDE
_BLOCKS, _LATE = _PIXELS // SIXTEEN + 4, 2 * _PIXELS
_ARRAYS = {
    Scratch: {
        "k": (np.float64, _BUFFER),
        "index": (np.int32, _BUFFER),
        "doubt": (np.bool_, _BUFFER),
        "batch": (np.float64, 64),
        "stack": (np.int64, _STACK),
        "near": (np.float64, _STACK),
        "rest": (np.uint8, 32),
    },
    QuickScratch: {
        "depth": (np.float32, _PIXELS),
        "number": (np.int32, _PIXELS),
        "doubt": (np.int32, _PIXELS // 16),
        "table": (np.float32, 8 * (MOST + SIXTEEN)),
        "batch": (np.float32, 160),
        "numbers": (np.float32, _NUMBERS),
        "blocks": (np.int32, _BLOCKS),
        "firsts": (np.int32, _BLOCKS),
        "mixed": (np.int32, _BLOCKS),
        "columns": (np.float32, 8 * 2 * SIXTEEN),
        "close": (np.int32, _BLOCKS),
        "bits": (np.int32, _BLOCKS),
        "late": (np.int64, 1),
        "late_columns": (np.int32, _LATE),
        "late_rows": (np.int32, _LATE),
        "spheres": (np.int32, _LATE),
        "slopes": (np.float64, 4 * (MOST + SIXTEEN)),
        "sides": (np.float64, 4 * (MOST + SIXTEEN)),
        "ids": (np.int32, MOST + SIXTEEN),
    },
}


class _Part(NamedTuple):
    """An array of a desk."""

    start: int  # bytes
    kind: type
    count: int


def _lay_out() -> tuple[dict[type, dict[str, _Part]], int]:
    """Where the arrays are, and how many bytes a desk has.

    A load waits for an earlier store to the same place of another page, as if that were to the same memory.
    """
    start, end, parts = 0, 0, dict[type, dict[str, _Part]]()
    for owner, arrays in _ARRAYS.items():
        parts[owner] = {}
        for name, (kind, count) in arrays.items():
            end += (start - end) % _PAGE
            parts[owner][name] = _Part(end, kind, count)
            start, end = start + _STEP, end + count * np.dtype(kind).itemsize
    depth = parts[QuickScratch]["depth"]
    parts[QuickScratch]["colour"] = depth._replace(kind=np.int32)
    return parts, end + -end % _PAGE


_PARTS, DESK = _lay_out()


@intrinsic
def desk_of(typing, desks, worker):
    """The `Scratch` of a worker, in its row of uint8 (workers, DESK)."""
    types_of = {
        owner: {name: types.Array(from_dtype(np.dtype(part.kind)), 1, "C") for name, part in parts.items()}
        for owner, parts in _PARTS.items()
    }
    quick = types.NamedTuple([types_of[QuickScratch][name] for name in QuickScratch._fields], QuickScratch)
    others = types_of[Scratch] | {"quick": quick}
    scratch = types.NamedTuple([others[name] for name in Scratch._fields], Scratch)

    def lower(context, builder, sig, args):
        memory = make_array(sig.args[0])(context, builder, args[0])
        start = builder.mul(args[1], builder.extract_value(memory.strides, 0))

        def array(owner, name):
            part, kind = _PARTS[owner][name], types_of[owner][name]
            whole, size = make_array(kind)(context, builder), np.dtype(part.kind).itemsize
            place = builder.gep(memory.data, [builder.add(start, _word(part.start))])
            data = builder.bitcast(place, whole.data.type)
            populate_array(whole, data, [_word(part.count)], [_word(size)], _word(size), None)
            return whole._getvalue()

        parts = [array(QuickScratch, name) for name in QuickScratch._fields]
        inner = context.make_tuple(builder, quick, parts)
        parts = [inner if name == "quick" else array(Scratch, name) for name in Scratch._fields]
        return context.make_tuple(builder, scratch, parts)

    return scratch(desks, types.int64), lower


def _word(number):
    return ir.Constant(ir.IntType(64), number)
