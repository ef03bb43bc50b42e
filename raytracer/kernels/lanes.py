"""Eight numbers as one value, or sixteen of half the length: what a processor computes at once.

A kernel that is written with lanes in place of numbers runs for eight pixels, spheres or rays in one go, on whatever
vectors the processor has. The compiler vectorises plain loops too, but not those with a branch, a slice or many arrays,
and it does not say when it gives up. The formulas of `certified`, plain arithmetic, take lanes as they take numbers.

    Lanes    <8 x double>   + − × ÷, −x, abs, sqrt, floor, ceil, comparisons; a number beside lanes counts eight times
    Mask     <8 x i1>       & | ~; any_of, all_of, bits_of; `select(mask, lanes, lanes)`
    Places   <8 x i32>      eight int32
    Singles  <16 x float>   + − × ÷, −x, abs, comparisons; see `sixteen`
    Marks    <16 x i1>      as a mask
    Numbers  <16 x i32>     + & | << >>, comparisons

    SinglePairs, MarkPairs, NumberPairs   two of these, so that the processor has two independent things to do

Arrays are one-dimensional and contiguous; nothing checks their ends.
"""

import operator

import numpy as np
from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba import config
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

WIDTH, SIXTEEN, ALIKE = 8, 16, 64

# What the processor can do, unless numba is told to compile for another one.
PROCESSOR = {} if config.CPU_NAME or config.CPU_FEATURES else dict(get_host_cpu_features())

_DOUBLE, _FLOAT, _INT32, _BYTE, _BIT = ir.DoubleType(), ir.FloatType(), ir.IntType(32), ir.IntType(8), ir.IntType(1)
_FOUR = 4  # numbers of a row of a table


def _kind(name, element, width, single):
    """A class of vectors, which has one type; `single` is the number that may stand beside them."""
    # kept machine code names classes by their modules
    return type(
        name, (types.Type,), {"vector": ir.VectorType(element, width), "single": single, "__module__": __name__}
    )


Lanes, Singles, SinglePairs = (
    _kind("Lanes", _DOUBLE, WIDTH, types.float64),
    _kind("Singles", _FLOAT, SIXTEEN, types.float32),
    _kind("SinglePairs", _FLOAT, 2 * SIXTEEN, types.float32),
)
Mask, Marks, MarkPairs = (
    _kind("Mask", _BIT, WIDTH, types.boolean),
    _kind("Marks", _BIT, SIXTEEN, types.boolean),
    _kind("MarkPairs", _BIT, 2 * SIXTEEN, types.boolean),
)
Places, Numbers, NumberPairs = (
    _kind("Places", _INT32, WIDTH, types.int32),
    _kind("Numbers", _INT32, SIXTEEN, types.int32),
    _kind("NumberPairs", _INT32, 2 * SIXTEEN, types.int32),
)
LANES, MASK, PLACES = Lanes("lanes"), Mask("mask"), Places("places")
SINGLES, MARKS, NUMBERS = Singles("singles"), Marks("marks"), Numbers("numbers")
SINGLE_PAIRS, MARK_PAIRS, NUMBER_PAIRS = (
    SinglePairs("single pairs"),
    MarkPairs("mark pairs"),
    NumberPairs("number pairs"),
)
_MASK_OF = {
    LANES: MASK, PLACES: MASK, MASK: MASK, SINGLES: MARKS, NUMBERS: MARKS, SINGLE_PAIRS: MARK_PAIRS,
    NUMBER_PAIRS: MARK_PAIRS,
}  # fmt: skip
FLOATS, INTEGERS = (LANES, SINGLES, SINGLE_PAIRS), (NUMBERS, NUMBER_PAIRS)


@register_model(Lanes)
@register_model(Mask)
@register_model(Places)
@register_model(Singles)
@register_model(Marks)
@register_model(Numbers)
@register_model(SinglePairs)
@register_model(MarkPairs)
@register_model(NumberPairs)
class _Vector(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, kind.vector)


@lower_cast(types.Number, Lanes)
@lower_cast(types.Integer, Places)
@lower_cast(types.Boolean, Mask)
@lower_cast(types.Number, Singles)
@lower_cast(types.Integer, Numbers)
@lower_cast(types.Boolean, Marks)
@lower_cast(types.Number, SinglePairs)
@lower_cast(types.Integer, NumberPairs)
@lower_cast(types.Boolean, MarkPairs)
def _many(context, builder, number, kind, value):
    return _spread(builder, context.cast(builder, value, number, kind.single), kind.vector.count)


def _spread(builder, value, width=WIDTH):
    vector = ir.VectorType(value.type, width)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_INT32, 0))
    return builder.shuffle_vector(first, first, _order([0] * width))


def _order(numbers):
    return ir.Constant(ir.VectorType(_INT32, len(numbers)), list(numbers))


# ---------------------------------------------------------------------------------------------------- operators


def _operator(symbol, operand, result, count, lower):
    """Let a symbol take so many operands, of which one at least is a vector and the rest may be single values."""
    vector, single = type(operand), types.Boolean if operand.single is types.boolean else types.Number

    @infer_global(symbol)
    class Operator(AbstractTemplate):
        def generic(self, args, kws):
            fits = len(args) == count and all(isinstance(arg, (vector, single)) for arg in args)
            some = any(isinstance(arg, vector) for arg in args)
            return signature(result, *[operand] * count) if fits and some else None

    lower_builtin(symbol, *[vector] * count)(lambda context, builder, sig, args: lower(builder, *args))


def _instruction(name):
    """The call of an LLVM intrinsic whose operands and result are lanes or singles."""

    def lower(builder, *args):
        kind = ir.FunctionType(args[0].type, [arg.type for arg in args])
        return builder.call(get_or_insert_function(builder.module, kind, name + _suffix(args[0].type)), args)

    return lower


def _suffix(kind):
    """What LLVM calls a type in the names of intrinsics."""
    width = f"v{kind.count}" if isinstance(kind, ir.VectorType) else ""
    return f".{width}f{32 if getattr(kind, 'element', kind) == _FLOAT else 64}"


def _comparison(sign):
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _comparison_of_numbers(sign):
    return lambda builder, a, b: builder.icmp_signed(sign, a, b)


for _symbol, _lower in (
    (operator.add, ir.IRBuilder.fadd),
    (operator.sub, ir.IRBuilder.fsub),
    (operator.mul, ir.IRBuilder.fmul),
    (operator.truediv, ir.IRBuilder.fdiv),
):
    for _floats in FLOATS:
        _operator(_symbol, _floats, _floats, 2, _lower)
for _symbol, _lower in (
    (operator.neg, ir.IRBuilder.fneg),
    (abs, _instruction("llvm.fabs")),
):
    for _floats in FLOATS:
        _operator(_symbol, _floats, _floats, 1, _lower)
for _symbol, _lower in (
    (np.sqrt, _instruction("llvm.sqrt")),
    (np.floor, _instruction("llvm.floor")),
    (np.ceil, _instruction("llvm.ceil")),
):
    for _floats in FLOATS:
        _operator(_symbol, _floats, _floats, 1, _lower)
for _symbol, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
):
    for _floats in FLOATS:
        _operator(_symbol, _floats, _MASK_OF[_floats], 2, _comparison(_sign))
    for _integers in INTEGERS:
        _operator(_symbol, _integers, _MASK_OF[_integers], 2, _comparison_of_numbers(_sign))
_operator(operator.add, PLACES, PLACES, 2, ir.IRBuilder.add)
_operator(operator.mul, PLACES, PLACES, 2, ir.IRBuilder.mul)
for _symbol, _lower in (
    (operator.add, ir.IRBuilder.add),
    (operator.sub, ir.IRBuilder.sub),
    (operator.mul, ir.IRBuilder.mul),
    (operator.and_, ir.IRBuilder.and_),
    (operator.or_, ir.IRBuilder.or_),
    (operator.xor, ir.IRBuilder.xor),
    (operator.lshift, ir.IRBuilder.shl),
    (operator.rshift, ir.IRBuilder.lshr),
):
    for _integers in INTEGERS:
        _operator(_symbol, _integers, _integers, 2, _lower)
for _mask in (MASK, MARKS, MARK_PAIRS):
    _operator(operator.and_, _mask, _mask, 2, ir.IRBuilder.and_)
    _operator(operator.or_, _mask, _mask, 2, ir.IRBuilder.or_)
    _operator(operator.invert, _mask, _mask, 1, ir.IRBuilder.not_)


@intrinsic
def blend(typing, mask, yes, no):
    """In each lane `yes` or `no`, of which one may be a number."""
    usual = next(kind for kind in FLOATS if _MASK_OF[kind] == mask)
    kind = next((arg for arg in (yes, no) if arg in _MASK_OF), usual)
    return kind(_MASK_OF[kind], kind, kind), lambda context, builder, sig, args: builder.select(*args)


@intrinsic
def fused(typing, a, b, c):
    """a · b + c, rounded once, of lanes, singles or numbers."""
    kind = next((arg for arg in (a, b, c) if arg in FLOATS), types.float64)
    call = _instruction("llvm.fma")
    return kind(kind, kind, kind), lambda context, builder, sig, args: call(builder, *args)


@intrinsic
def spread(typing, number):
    """The same number in all lanes: of a float64, an integer, or in singles of a float32."""
    kind = PLACES if isinstance(number, types.Integer) else SINGLES if number == types.float32 else LANES

    def lower(context, builder, sig, args):
        return _spread(builder, args[0], kind.vector.count)

    return kind(kind.single), lower


@intrinsic
def any_of(typing, mask):
    """Whether any lane is true."""

    def lower(context, builder, sig, args):
        bits = ir.IntType(mask.vector.count)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), ir.Constant(bits, 0))

    return types.boolean(mask), lower


@intrinsic
def all_of(typing, mask):
    """Whether all lanes are true."""

    def lower(context, builder, sig, args):
        return builder.icmp_unsigned("==", builder.bitcast(args[0], _BYTE), ir.Constant(_BYTE, 255))

    return types.boolean(mask), lower


@intrinsic
def bits_of(typing, mask):
    """A number whose bit i is lane i."""
    number = {WIDTH: types.uint8, SIXTEEN: types.uint16}.get(mask.vector.count, types.uint32)

    def lower(context, builder, sig, args):
        return builder.bitcast(args[0], ir.IntType(mask.vector.count))

    return number(mask), lower


@intrinsic
def mask_of(typing, bits):
    """The mask whose lane i is bit i of a byte."""

    def lower(context, builder, sig, args):
        return builder.bitcast(args[0], ir.VectorType(_BIT, WIDTH))

    return MASK(types.uint8), lower


@intrinsic
def same(typing, places):
    """Whether all lanes are equal to the first."""

    def lower(context, builder, sig, args):
        first = builder.shuffle_vector(args[0], args[0], _order([0] * WIDTH))
        equal = builder.bitcast(builder.icmp_signed("==", args[0], first), _BYTE)
        return builder.icmp_unsigned("==", equal, ir.Constant(_BYTE, 255))

    return types.boolean(places), lower


@intrinsic
def first_of(typing, places):
    """The first lane."""
    return types.int32(places), lambda context, builder, sig, args: builder.extract_element(
        args[0], ir.Constant(_INT32, 0)
    )


@intrinsic
def largest_of(typing, places):
    """The largest of the lanes."""

    def lower(context, builder, sig, args):
        kind = ir.FunctionType(_INT32, [args[0].type])
        return builder.call(get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.smax.v{WIDTH}i32"), args)

    return types.int32(places), lower


@intrinsic
def equal(typing, places, others):
    """Where two places are the same."""

    def lower(context, builder, sig, args):
        return builder.icmp_signed("==", *args)

    return MASK(places, places), lower


@intrinsic
def equal_to(typing, places, number):
    """Where a place is a number."""

    def lower(context, builder, sig, args):
        return builder.icmp_signed("==", args[0], _spread(builder, builder.trunc(args[1], _INT32)))

    return MASK(places, types.int64), lower


@intrinsic
def in_box(typing, spots, box):
    """Where a spot lies in an entry's box: see `kernels.cells`."""

    def lower(context, builder, sig, args):
        highest = ir.Constant(args[0].type, [0x80808080 - 2**32] * WIDTH)
        kept = builder.and_(builder.sub(args[0], _spread(builder, args[1])), highest)
        return builder.icmp_signed("==", kept, highest)

    return MASK(spots, types.int32), lower


@intrinsic
def lane_numbers(typing):
    """The places 0 to 7."""
    numbers = ir.Constant(ir.VectorType(_INT32, WIDTH), list(range(WIDTH)))
    return PLACES(), lambda context, builder, sig, args: numbers


@intrinsic
def first_where(typing, mask, places):
    """The place in the first lane whose mask is set, if there is any."""

    def lower(context, builder, sig, args):
        bits = builder.zext(builder.bitcast(args[0], _BYTE), _INT32)
        lane = builder.cttz(builder.or_(bits, ir.Constant(_INT32, 1 << WIDTH)), ir.Constant(_BIT, 1))
        lane = builder.and_(lane, ir.Constant(_INT32, WIDTH - 1))
        return builder.sext(builder.extract_element(args[1], lane), ir.IntType(64))

    return types.int64(mask, places), lower


@intrinsic
def whole(typing, lanes):
    """Whole numbers as places."""
    return PLACES(lanes), lambda context, builder, sig, args: builder.fptosi(args[0], ir.VectorType(_INT32, WIDTH))


@intrinsic
def at_least(typing, places, number):
    """Where a place is not below a number."""

    def lower(context, builder, sig, args):
        number = builder.trunc(args[1], _INT32)
        return builder.icmp_signed(">=", args[0], _spread(builder, number))

    return MASK(places, types.int64), lower


@intrinsic
def smallest_of(typing, lanes):
    """The smallest of the lanes, none of which is not a number."""

    def lower(context, builder, sig, args):
        kind = ir.FunctionType(_DOUBLE, [args[0].type])
        name = f"llvm.vector.reduce.fmin.v{WIDTH}f64"
        return builder.call(get_or_insert_function(builder.module, kind, name), args, fastmath=["nnan"])

    return types.float64(lanes), lower


@intrinsic
def is_hit(typing, places):
    """Where a place is not negative."""

    def lower(context, builder, sig, args):
        return builder.icmp_signed(">=", args[0], ir.Constant(args[0].type, None))

    return MASK(places), lower


# ------------------------------------------------------------------------------------------------------- arrays


def _address(context, builder, kind, array, index, vector):
    """Where the element lies, as a pointer to a vector."""
    start = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(start, [index]), vector.as_pointer())


@intrinsic
def load(typing, array, i):
    """Eight numbers of an array, from element i on, lanes of float64 or places of int32; or singles of float32."""
    return _load(array, {types.int32: PLACES, types.float32: SINGLES}.get(array.dtype, LANES))


def _load(array, kind):
    def lower(context, builder, sig, args):
        return builder.load(_address(context, builder, sig.args[0], args[0], args[1], kind.vector), align=4)

    return kind(array, types.uint64), lower


@intrinsic
def store(typing, array, i, value):
    """Put lanes, places, singles or numbers into an array, from element i on."""

    def lower(context, builder, sig, args):
        builder.store(args[2], _address(context, builder, sig.args[0], args[0], args[1], args[2].type), align=4)
        return context.get_dummy_value()

    return types.void(array, types.uint64, value), lower


@intrinsic
def load_low(typing, array, i):
    """The low halves of eight uint64, from element i on, as places."""

    def lower(context, builder, sig, args):
        vector = ir.VectorType(ir.IntType(64), WIDTH)
        wide = builder.load(_address(context, builder, sig.args[0], args[0], args[1], vector), align=8)
        return builder.trunc(wide, ir.VectorType(_INT32, WIDTH))

    return PLACES(array, types.uint64), lower


@intrinsic
def load_pair(typing, array, i, j):
    """Four numbers of an array from element i on, and four from j on: lanes of float64, places of int32."""
    return _load_halves(array, PLACES if array.dtype == types.int32 else LANES)


def _load_halves(array, kind):
    def lower(context, builder, sig, args):
        array, *starts = args
        half = ir.VectorType(kind.vector.element, kind.vector.count // 2)
        addresses = [_address(context, builder, sig.args[0], array, start, half) for start in starts]
        return _joined(builder, [builder.load(address, align=4) for address in addresses])

    return kind(array, types.uint64, types.uint64), lower


@intrinsic
def store_pair(typing, array, i, j, value):
    """Put one half of a vector into an array from element i on, the other from j on."""

    def lower(context, builder, sig, args):
        array, *starts, value = args
        half = value.type.count // 2
        for lane, start in zip((0, half), starts, strict=True):
            part = builder.shuffle_vector(value, value, _order(range(lane, lane + half)))
            builder.store(part, _address(context, builder, sig.args[0], array, start, part.type), align=4)
        return context.get_dummy_value()

    return types.void(array, types.uint64, types.uint64, value), lower


@intrinsic
def spread_pair(typing, a, b):
    """One number in the first four lanes, another in the rest."""

    def lower(context, builder, sig, args):
        first, last = (_spread(builder, number) for number in args)
        return builder.shuffle_vector(first, last, _order(range(WIDTH // 2, WIDTH + WIDTH // 2)))

    return LANES(types.float64, types.float64), lower


def _joined(builder, vectors):
    """Vectors one behind the other, as one."""
    while len(vectors) > 1:
        width = 2 * vectors[0].type.count
        pairs = zip(vectors[::2], vectors[1::2], strict=True)
        vectors = [builder.shuffle_vector(a, b, _order(range(width))) for a, b in pairs]
    return vectors[0]


def _columns(context, builder, rows):
    """Four lanes: the columns of eight rows of four numbers, by shuffles that cross the vector only once."""

    def shuffle(a, b, *order):
        return builder.shuffle_vector(a, b, _order(order))

    near, far = (
        (
            shuffle(a, b, 0, 8, 2, 10, 4, 12, 6, 14),  # two of column 0, two of 2, two of 0, two of 2
            shuffle(a, b, 1, 9, 3, 11, 5, 13, 7, 15),
        )
        for a, b in (
            (_joined(builder, [rows[i], rows[i + 2]]), _joined(builder, [rows[i + 1], rows[i + 3]])) for i in (0, 4)
        )
    )
    columns = [shuffle(a, b, 0, 1, 4, 5, 8, 9, 12, 13) for a, b in zip(near, far, strict=True)]
    columns += [shuffle(a, b, 2, 3, 6, 7, 10, 11, 14, 15) for a, b in zip(near, far, strict=True)]
    return context.make_tuple(builder, types.UniTuple(LANES, _FOUR), columns)


def _rows(context, builder, kind, table, places):
    """The rows of a flat table of four columns at some places."""
    row, rows = ir.VectorType(_DOUBLE, _FOUR), []
    for place in places:
        start = builder.mul(place, ir.Constant(place.type, _FOUR))
        rows.append(builder.load(_address(context, builder, kind, table, start, row), align=8))
    return rows


@intrinsic
def load_rows(typing, table, i):
    """Eight rows of a flat table of four columns, from row i on, as four lanes."""

    def lower(context, builder, sig, args):
        table, i = args
        places = [builder.add(i, ir.Constant(i.type, lane)) for lane in range(WIDTH)]
        return _columns(context, builder, _rows(context, builder, sig.args[0], table, places))

    return types.UniTuple(LANES, _FOUR)(table, types.uint64), lower


@intrinsic
def gather_rows(typing, table, places):
    """The rows of a flat table of four columns at eight places, as four lanes."""

    def lower(context, builder, sig, args):
        table, lanes = args
        which = [builder.extract_element(lanes, ir.Constant(_INT32, lane)) for lane in range(WIDTH)]
        places = [builder.zext(place, ir.IntType(64)) for place in which]
        return _columns(context, builder, _rows(context, builder, sig.args[0], table, places))

    return types.UniTuple(LANES, _FOUR)(table, places), lower


@intrinsic
def store_rows(typing, table, i, a, b, c, d):
    """Four lanes as the columns of rows i to i + 7 of a flat table of four columns."""

    def lower(context, builder, sig, args):
        table, i, *columns = args
        wide, kind = _joined(builder, columns), ir.VectorType(_DOUBLE, _FOUR)
        for row in range(WIDTH):
            values = builder.shuffle_vector(wide, wide, _order(range(row, _FOUR * WIDTH, WIDTH)))
            start = builder.add(builder.mul(i, ir.Constant(i.type, _FOUR)), ir.Constant(i.type, _FOUR * row))
            builder.store(values, _address(context, builder, sig.args[0], table, start, kind), align=8)
        return context.get_dummy_value()

    return types.void(table, types.uint64, *[LANES] * _FOUR), lower


@intrinsic
def gather(typing, array, places):
    """The numbers of an array at eight places."""
    kind = PLACES if array.dtype == types.int32 else LANES

    def lower(context, builder, sig, args):
        found = ir.Constant(kind.vector, ir.Undefined)
        start = context.make_array(sig.args[0])(context, builder, args[0]).data
        for lane in range(WIDTH):
            where = ir.Constant(_INT32, lane)
            place = builder.zext(builder.extract_element(args[1], where), ir.IntType(64))
            found = builder.insert_element(found, builder.load(builder.gep(start, [place])), where)
        return found

    return kind(array, places), lower


@intrinsic
def store_boxes(typing, table, i, left, right, top, bottom):
    """Four lanes of whole numbers as rows i to i + 7 of a flat int32 table of four columns."""

    def lower(context, builder, sig, args):
        vector = ir.VectorType(_INT32, WIDTH)
        wide = _joined(builder, [builder.fptosi(lanes, vector) for lanes in args[2:]])
        order = [WIDTH * column + row for row in range(WIDTH) for column in range(_FOUR)]
        start = builder.mul(args[1], ir.Constant(args[1].type, _FOUR))
        rows = builder.shuffle_vector(wide, wide, _order(order))
        builder.store(rows, _address(context, builder, sig.args[0], args[0], start, rows.type), align=4)
        return context.get_dummy_value()

    return types.void(table, types.uint64, LANES, LANES, LANES, LANES), lower


@intrinsic
def align_stack(typing):
    """Let the function that says so begin its part of the stack at a cache line.

    Else vectors that have to wait there for a register lie across two of them, mostly, and take twice as long.
    """

    def lower(context, builder, sig, args):
        attributes = builder.function.attributes
        attributes.add("nounwind")  # which is so, and without any other the next one would not be written
        attributes.alignstack = 64
        return context.get_dummy_value()

    return types.void(), lower


@intrinsic
def fetch_ahead(typing, array, i):
    """Ask the processor to bring an element of an array into its cache: it will be wanted soon."""
    return _fetch(array, 0)


@intrinsic
def fetch_to_write(typing, array, i):
    """The same for an element that will be written to."""
    return _fetch(array, 1)


def _fetch(array, writes):
    def lower(context, builder, sig, args):
        start = context.make_array(sig.args[0])(context, builder, args[0]).data
        pointer = builder.bitcast(builder.gep(start, [args[1]]), _BYTE.as_pointer())
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, _INT32, _INT32, _INT32])
        prefetch = get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(prefetch, [pointer, *(ir.Constant(_INT32, n) for n in (writes, 3, 1))])
        return context.get_dummy_value()

    return types.void(array, types.uint64), lower


@intrinsic
def take_number(typing, array, i):
    """Element i of an int64 array, which then is one more: threads that ask at one time get different ones."""

    def lower(context, builder, sig, args):
        start = context.make_array(sig.args[0])(context, builder, args[0]).data
        return builder.atomic_rmw("add", builder.gep(start, [args[1]]), ir.Constant(ir.IntType(64), 1), "monotonic")

    return types.int64(array, types.uint64), lower


# ------------------------------------------------------------------------------------------------------- pixels


@intrinsic
def put_pixels(typing, picture, start, step, red, green, blue):
    """Eight pixels as bytes, from byte `start` of a flat picture on; a pixel takes `step` bytes, 3 or 4.

    The lanes are from 0 to 255 already, and cut off to whole numbers. The fourth byte stays what it is.
    """

    def lower(context, builder, sig, args):
        picture, start, step, *colours = args
        bytes_ = [builder.fptoui(lanes, ir.VectorType(_INT32, WIDTH)) for lanes in colours]
        red, green, blue = (builder.trunc(lanes, ir.VectorType(_BYTE, WIDTH)) for lanes in bytes_)
        wide = _joined(builder, [red, green, blue, blue])
        three, four = (
            [WIDTH * colour + pixel for pixel in range(WIDTH) for colour in range(step_bytes)] for step_bytes in (3, 4)
        )
        _put_bytes(context, builder, sig.args[0], picture, start, step, wide, three, four)
        return context.get_dummy_value()

    return types.void(picture, types.uint64, types.uint64, LANES, LANES, LANES), lower


@intrinsic
def put_alike(typing, picture, start, step, colours):
    """ALIKE pixels of one colour, as `put_pixels` puts eight: an array has it sixteen times, red in the lowest byte.

    Of a number, the compiler would make the bytes one by one.
    """

    def lower(context, builder, sig, args):
        picture, start, step, colours = args
        zero, bytes_ = ir.Constant(start.type, 0), ir.VectorType(_BYTE, 4 * SIXTEEN)
        wide = builder.load(_address(context, builder, sig.args[3], colours, zero, bytes_), align=4)
        three = [4 * (pixel % SIXTEEN) + byte for pixel in range(ALIKE) for byte in range(3)]
        four = [byte % (4 * SIXTEEN) for byte in range(4 * ALIKE)]
        _put_bytes(context, builder, sig.args[0], picture, start, step, wide, three, four)
        return context.get_dummy_value()

    return types.void(picture, types.uint64, types.uint64, colours), lower


def _put_bytes(context, builder, kind, picture, start, step, wide, three, four):
    """Pixels of three or four bytes into a flat picture: in which order, of a vector that has the bytes of all."""
    with builder.if_else(builder.icmp_unsigned("==", step, ir.Constant(step.type, 3))) as (of_three, of_four):
        with of_three:
            pixels = builder.shuffle_vector(wide, wide, _order(three))
            builder.store(pixels, _address(context, builder, kind, picture, start, pixels.type), align=1)
        with of_four:
            pixels = builder.shuffle_vector(wide, wide, _order(four))
            address = _address(context, builder, kind, picture, start, pixels.type)
            keep = ir.Constant(ir.VectorType(_BIT, len(four)), [True, True, True, False] * (len(four) // 4))
            builder.store(builder.select(keep, pixels, builder.load(address, align=1)), address, align=1)
