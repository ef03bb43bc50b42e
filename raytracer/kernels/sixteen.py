"""What singles and numbers can do beyond what they have in common with lanes, mostly for blocks of 4 × 4 pixels.

 0  1  2  3
 4  5  6  7       the pixels of a block, as they lie in a vector
 8  9 10 11
12 13 14 15
"""

from llvmlite import ir
from numba.core import types
from numba.core.cgutils import get_or_insert_function
from numba.extending import intrinsic

from raytracer.kernels.lanes import (
    FLOATS,
    INTEGERS,
    LANES,
    MARKS,
    NUMBER_PAIRS,
    NUMBERS,
    PROCESSOR,
    SINGLE_PAIRS,
    SINGLES,
    SIXTEEN,
    WIDTH,
    _address,
    _instruction,
    _joined,
    _load,
    _load_halves,
    _order,
    _put_bytes,
    _spread,
)

SIDE = 4
_FLOAT, _INT32, _INT64, _BIT, _BYTE = ir.FloatType(), ir.IntType(32), ir.IntType(64), ir.IntType(1), ir.IntType(8)
_COLUMNS = 2 * SIDE  # numbers of a row of a table


def _first(kinds, *args):
    """The first of these types that is one of those kinds."""
    return next(arg for arg in args if arg in kinds)


@intrinsic
def times_plus(typing, a, b, c):
    """a · b + c, rounded once or twice, whichever the processor does sooner."""
    kind = _first(FLOATS, a, b, c)

    def lower(context, builder, sig, args):
        a, b, c = args
        if not PROCESSOR.get("fma"):
            return builder.fadd(builder.fmul(a, b), c)
        return _instruction("llvm.fma")(builder, *args)

    return kind(kind, kind, kind), lower


def _called(builder, name, result, *args):
    """The call of a function of that name."""
    kind = ir.FunctionType(result, [arg.type for arg in args])
    return builder.call(get_or_insert_function(builder.module, kind, name), args)


def _by_sixteens(feature, instruction, exactly):
    """An instruction, on each sixteen of vectors, or what it stands for."""

    def lower(context, builder, sig, args):
        if not PROCESSOR.get(feature):
            return exactly(builder, *args)
        parts = [[_part(builder, arg, start) for arg in args] for start in range(0, args[0].type.count, SIXTEEN)]
        return _joined(builder, [instruction(builder, *some) for some in parts])

    return lower


def _part(builder, x, start):
    """Sixteen of a vector."""
    return builder.shuffle_vector(x, x, _order(range(start, start + SIXTEEN)))


def _estimate(instruction, exactly):
    """A processor's own estimate to 14 bits, or what it stands for."""

    def estimate(builder, x):
        all_of_them = ir.Constant(ir.IntType(SIXTEEN), -1)
        return _called(builder, f"llvm.x86.avx512.{instruction}.ps.512", x.type, x, x, all_of_them)

    return _by_sixteens("avx512f", estimate, exactly)


def _over(builder, x):
    return builder.fdiv(ir.Constant(x.type, [1.0] * x.type.count), x)


def _over_root(builder, x):
    return _over(builder, _instruction("llvm.sqrt")(builder, x))


@intrinsic
def rough_inverse(typing, x):
    """1 / x, to 2⁻¹⁴ of itself."""
    return x(x), _estimate("rcp14", _over)


@intrinsic
def rough_inverse_root(typing, x):
    """1 / √x, to 2⁻¹⁴ of itself; not a number for x below 0."""
    return x(x), _estimate("rsqrt14", _over_root)


def _choice(sign):
    """Of two the one that a comparison names."""

    def make(typing, a, b):
        kind = _first(FLOATS + INTEGERS, a, b)
        compare = ir.IRBuilder.icmp_signed if kind in INTEGERS else ir.IRBuilder.fcmp_ordered
        return kind(kind, kind), lambda context, builder, sig, args: builder.select(
            compare(builder, sign, *args), *args
        )

    return make


lesser = intrinsic(_choice("<"))  # in each lane; b where one is not a number
greater = intrinsic(_choice(">"))


@intrinsic
def sixteen(typing, number):
    """The same integer sixteen times."""
    return NUMBERS(types.int32), lambda context, builder, sig, args: _spread(builder, args[0], SIXTEEN)


@intrinsic
def whole_numbers(typing, singles):
    """Singles cut off to whole numbers."""
    kind = _numbers_of(singles)
    return kind(singles), lambda context, builder, sig, args: builder.fptosi(args[0], kind.vector)


def _on_sixteen(instruction, result, *flags):
    """A masked instruction of AVX-512 on sixteen singles, without a mask; the last of its flags comes at the end."""

    def call(builder, *args):
        bits, (*before, last) = ir.IntType(SIXTEEN), [ir.Constant(_INT32, flag) for flag in flags]
        args = [*args, *before, ir.Constant(result, ir.Undefined), ir.Constant(bits, -1), last]
        return _called(builder, f"llvm.x86.avx512.mask.{instruction}.512", result, *args)

    return call


_NEAREST, _AS_IT_IS, _SMALLEST_SIZE, _LARGEST_SIZE = 0, 4, 10, 11
_rest = _on_sixteen("reduce.ps", SINGLES.vector, _NEAREST, _AS_IT_IS)
_smaller = _on_sixteen("range.ps", SINGLES.vector, _SMALLEST_SIZE, _AS_IT_IS)
_larger = _on_sixteen("range.ps", SINGLES.vector, _LARGEST_SIZE, _AS_IT_IS)
_rounded = _on_sixteen("cvtps2dq", NUMBERS.vector, _AS_IT_IS)


@intrinsic
def rest(typing, x):
    """How far singles are above the nearest whole numbers."""

    def exactly(builder, x):
        return builder.fsub(x, _instruction("llvm.rint")(builder, x))

    return x(x), _by_sixteens("avx512dq", _rest, exactly)


def _size(choose, by_sixteens):
    """Of the sizes of two the one that is chosen."""

    def make(typing, a, b):
        def exactly(builder, *args):
            return _instruction(f"llvm.{choose}")(builder, *[_instruction("llvm.fabs")(builder, arg) for arg in args])

        return a(a, b), _by_sixteens("avx512dq", by_sixteens, exactly)

    return make


smaller_size = intrinsic(_size("minnum", _smaller))  # of |a| and |b|; if one is not a number, the other
larger_size = intrinsic(_size("maxnum", _larger))


def _numbers_of(singles):
    """The type of whole numbers that are as many as these singles."""
    return INTEGERS[FLOATS.index(singles) - 1]


@intrinsic
def rounded(typing, x):
    """The nearest whole numbers of singles."""
    kind = _numbers_of(x)

    def exactly(builder, x):
        return builder.fptosi(_instruction("llvm.rint")(builder, x), kind.vector)

    return kind(x), _by_sixteens("avx512f", _rounded, exactly)


@intrinsic
def pack(typing, red, green, blue):
    """Colours as one number each, red in the lowest byte, of channels from 0 on, cut off at 255; the upper is any."""
    return red(red, green, blue), _by_sixteens("avx512bw", _packed, _shifted)


def _packed(builder, red, green, blue):
    """By instructions that cut off what is beyond a byte."""
    words, bytes_ = ir.VectorType(ir.IntType(16), 2 * SIXTEEN), ir.VectorType(_BYTE, 4 * SIXTEEN)
    pairs = [_called(builder, "llvm.x86.avx512.packssdw.512", words, a, b) for a, b in ((red, green), (blue, blue))]
    channels = _called(builder, "llvm.x86.avx512.packuswb.512", bytes_, *pairs)  # four of red, of green, of blue, …
    order = [4 * SIDE * quad + SIDE * channel + i for quad in range(SIDE) for i in range(SIDE) for channel in range(4)]
    return builder.bitcast(builder.shuffle_vector(channels, channels, _order(order)), NUMBERS.vector)


def _shifted(builder, *channels):
    """By whichever instructions there are."""
    kind, packed = channels[0].type, None
    for i, channel in enumerate(channels):
        most, places = (ir.Constant(kind, [number] * kind.count) for number in (255, 8 * i))
        byte = builder.select(builder.icmp_signed("<", channel, most), channel, most)
        byte = builder.shl(byte, places)
        packed = builder.or_(packed, byte) if packed else byte
    return packed


@intrinsic
def lowest_bit(typing, bits):
    """The number of the lowest bit that is set, of a number that is not 0."""

    def lower(context, builder, sig, args):
        return builder.cttz(args[0], ir.Constant(_BIT, 1))

    return types.int32(types.int32), lower


@intrinsic
def count_ones(typing, bits):
    """How many bits of a number are set."""
    return bits(bits), lambda context, builder, sig, args: builder.ctpop(args[0])


@intrinsic
def singles(typing, a, b):
    """Two times eight lanes of float64 as sixteen singles."""
    return SINGLES(LANES, LANES), lambda context, builder, sig, args: _joined(
        builder, [_halves(builder, lanes) for lanes in args]
    )


@intrinsic
def ascending(typing):
    """0 to 15."""
    numbers = ir.Constant(NUMBERS.vector, list(range(SIXTEEN)))
    return NUMBERS(), lambda context, builder, sig, args: numbers


@intrinsic
def store_some(typing, array, i, numbers, marks):
    """Those of sixteen int32 that are marked, one behind the other from element i of an array on.

    Of the fifteen elements behind them, anything may be left in some.
    """

    def lower(context, builder, sig, args):
        array, i, numbers, marks = args
        if PROCESSOR.get("avx512f"):
            vector = NUMBERS.vector
            kind = ir.FunctionType(vector, [vector, vector, marks.type])
            compress = get_or_insert_function(builder.module, kind, "llvm.x86.avx512.mask.compress.v16i32")
            # to memory, some processors do the same a hundred times slower
            dense = builder.call(compress, [numbers, numbers, marks])
            builder.store(dense, _address(context, builder, sig.args[0], array, i, vector), align=4)
            return context.get_dummy_value()
        first = context.make_array(sig.args[0])(context, builder, array).data
        for lane in range(SIXTEEN):
            place = ir.Constant(_INT32, lane)
            builder.store(builder.extract_element(numbers, place), builder.gep(first, [i]))
            i = builder.add(i, builder.zext(builder.extract_element(marks, place), i.type))
        return context.get_dummy_value()

    return types.void(array, types.uint64, NUMBERS, MARKS), lower


@intrinsic
def columns_of_block(typing):
    """In which column of the block each pixel is."""
    numbers = ir.Constant(SINGLES.vector, [float(i % SIDE) for i in range(SIXTEEN)])
    return SINGLES(), lambda context, builder, sig, args: numbers


@intrinsic
def rows_of_block(typing):
    """In which row of the block each pixel is."""
    numbers = ir.Constant(SINGLES.vector, [float(i // SIDE) for i in range(SIXTEEN)])
    return SINGLES(), lambda context, builder, sig, args: numbers


@intrinsic
def load_numbers(typing, array, i):
    """Sixteen int32 of an array, from element i on."""
    return _load(array, NUMBERS)


@intrinsic
def mark_block(typing, array, row, bits):
    """Set the bits of a block, whose rows have a byte each of an int32 array, from that one on."""

    def lower(context, builder, sig, args):
        array, row, bits = args
        start = builder.bitcast(context.make_array(sig.args[0])(context, builder, array).data, _BYTE.as_pointer())
        place = builder.bitcast(builder.gep(start, [row]), _INT32.as_pointer())
        marks = builder.load(place, align=1)
        for line in range(SIDE):
            own = builder.and_(bits, ir.Constant(_INT32, (1 << SIDE) - 1 << SIDE * line))
            marks = builder.or_(marks, builder.shl(own, ir.Constant(_INT32, (8 - SIDE) * line)))
        builder.store(marks, place, align=1)
        return context.get_dummy_value()

    return types.void(array, types.uint64, types.int32), lower


@intrinsic
def store_halves(typing, array, i, lanes):
    """Eight lanes as float32, from element i of an array on."""

    def lower(context, builder, sig, args):
        array, i, lanes = args
        halves = _halves(builder, lanes)
        builder.store(halves, _address(context, builder, sig.args[0], array, i, halves.type), align=4)
        return context.get_dummy_value()

    return types.void(array, types.uint64, LANES), lower


def _halves(builder, lanes):
    return builder.fptrunc(lanes, ir.VectorType(_FLOAT, WIDTH))


@intrinsic
def store_table(typing, table, row, a, b, c, d, e, f, g, h):
    """Eight lanes each as the columns of rows `row` to `row` + 7 of a flat float32 table of eight columns.

    The first two are rounded to whole numbers, and stored as such: see `beyond`.
    """

    def lower(context, builder, sig, args):
        table, row, *columns = args
        kinds = [_wholes] * 2 + [_halves] * (_COLUMNS - 2)
        stored = [of_kind(builder, column) for of_kind, column in zip(kinds, columns, strict=True)]
        for i, values in enumerate(_turned(builder, stored)):
            place = builder.add(builder.mul(row, ir.Constant(row.type, _COLUMNS)), ir.Constant(row.type, _COLUMNS * i))
            builder.store(values, _address(context, builder, sig.args[0], table, place, values.type), align=4)
        return context.get_dummy_value()

    return types.void(table, types.uint64, *[LANES] * _COLUMNS), lower


def _wholes(builder, lanes):
    """The nearest whole numbers, in the place of singles."""
    lanes = _instruction("llvm.rint")(builder, lanes)
    return builder.bitcast(builder.fptosi(lanes, ir.VectorType(_INT32, WIDTH)), ir.VectorType(_FLOAT, WIDTH))


@intrinsic
def beyond(typing, numbers, wholes):
    """How far whole numbers are beyond those that are in the place of singles, as singles, rounded."""

    def lower(context, builder, sig, args):
        numbers, wholes = args
        return builder.sitofp(builder.sub(numbers, builder.bitcast(wholes, numbers.type)), wholes.type)

    return wholes(numbers, wholes), lower


def _turned(builder, columns):
    """The rows of eight columns of eight, by shuffles that cross the vector's halves only once."""

    def shuffle(a, b, *order):
        return builder.shuffle_vector(a, b, _order(order))

    halves = []
    for p, q, r, s in (columns[:SIDE], columns[SIDE:]):
        pq = shuffle(p, q, 0, 8, 1, 9, 4, 12, 5, 13), shuffle(p, q, 2, 10, 3, 11, 6, 14, 7, 15)
        rs = shuffle(r, s, 0, 8, 1, 9, 4, 12, 5, 13), shuffle(r, s, 2, 10, 3, 11, 6, 14, 7, 15)
        halves.append(
            [
                shuffle(pq[k], rs[k], *order)
                for k in (0, 1)
                for order in ((0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15))
            ]
        )
    near = [shuffle(a, b, 0, 1, 2, 3, 8, 9, 10, 11) for a, b in zip(*halves, strict=True)]
    far = [shuffle(a, b, 4, 5, 6, 7, 12, 13, 14, 15) for a, b in zip(*halves, strict=True)]
    return near + far


@intrinsic
def load_two(typing, array, i, j):
    """Sixteen int32 of an array from element i on, and sixteen from j on."""
    return _load_halves(array, NUMBER_PAIRS)


@intrinsic
def two(typing, a, b):
    """Sixteen times one number, float32 or int32, and sixteen times another."""
    kind = NUMBER_PAIRS if a in types.integer_domain else SINGLE_PAIRS

    def lower(context, builder, sig, args):
        return _joined(builder, [_spread(builder, number, SIXTEEN) for number in args])

    return kind(kind.single, kind.single), lower


@intrinsic
def both(typing, singles):
    """Singles twice."""
    return SINGLE_PAIRS(SINGLES), lambda context, builder, sig, args: _joined(builder, [args[0], args[0]])


@intrinsic
def gather_to_columns(typing, table, numbers, i, j, columns):
    """The rows of a flat float32 table of eight columns, into `columns`: each of the eight for thirty-two pixels.

    Which rows the sixteen int32 say that begin with element i of an array, and those with element j.
    """

    def lower(context, builder, sig, args):
        table, numbers, *places, out = args
        for start, place in zip((0, SIXTEEN), places, strict=True):
            for i, column in enumerate(_gather(context, builder, sig, table, numbers, place)):
                _store_column(context, builder, sig.args[4], out, 2 * SIXTEEN * i + start, column)
        return context.get_dummy_value()

    return types.void(table, numbers, types.uint64, types.uint64, columns), lower


@intrinsic
def spread_rows(typing, table, a, b, columns):
    """Two rows of such a table, likewise: row a for the first sixteen pixels, row b for the rest."""

    def lower(context, builder, sig, args):
        table, *rows, out = args
        first = context.make_array(sig.args[0])(context, builder, table).data
        for start, row in zip((0, SIXTEEN), rows, strict=True):
            place = builder.mul(builder.sext(row, _INT64), ir.Constant(_INT64, _COLUMNS))
            for i in range(_COLUMNS):
                number = builder.load(builder.gep(first, [builder.add(place, ir.Constant(_INT64, i))]))
                column = _spread(builder, number, SIXTEEN)
                _store_column(context, builder, sig.args[3], out, 2 * SIXTEEN * i + start, column)
        return context.get_dummy_value()

    return types.void(table, types.int32, types.int32, columns), lower


def _store_column(context, builder, kind, columns, start, column):
    place = ir.Constant(_INT64, start)
    builder.store(column, _address(context, builder, kind, columns, place, column.type), align=4)


@intrinsic
def load_columns(typing, columns):
    """The eight that `gather_to_columns` or `spread_rows` has left."""

    def lower(context, builder, sig, args):
        starts = [ir.Constant(_INT64, 2 * SIXTEEN * i) for i in range(_COLUMNS)]
        addresses = [_address(context, builder, sig.args[0], args[0], i, SINGLE_PAIRS.vector) for i in starts]
        pairs = [builder.load(address, align=4) for address in addresses]
        return context.make_tuple(builder, sig.return_type, pairs)

    return types.UniTuple(SINGLE_PAIRS, _COLUMNS)(columns), lower


def _gather(context, builder, sig, table, numbers, at):
    """Eight columns of sixteen rows."""
    first = context.make_array(sig.args[1])(context, builder, numbers).data
    starts = []
    for lane in range(SIXTEEN):
        place = builder.gep(first, [builder.add(at, ir.Constant(at.type, lane))])
        # one by one, as to take a vector apart costs more: the compiler does that if it has loaded one there
        number = builder.load_atomic(place, "monotonic", 4)
        starts.append(builder.mul(builder.zext(number, _INT64), ir.Constant(_INT64, _COLUMNS)))
    columns = []
    for half in (0, SIDE):
        rows = []
        for start in starts:
            place = builder.add(start, ir.Constant(_INT64, half))
            address = _address(context, builder, sig.args[0], table, place, ir.VectorType(_FLOAT, SIDE))
            rows.append(builder.load(address, align=4))
        columns += _four_columns(builder, [_joined(builder, rows[k::SIDE]) for k in range(SIDE)])
    return columns


def _four_columns(builder, rows):
    """Four vectors: in each quarter of them, the columns of what is in that quarter of four."""

    def shuffle(a, b, *order):
        quarters = [[SIXTEEN * (i // SIDE) + SIDE * q + i % SIDE for i in order] for q in range(SIDE)]
        return builder.shuffle_vector(a, b, _order([i for quarter in quarters for i in quarter]))

    p, q, r, s = rows
    near = shuffle(p, q, 0, 4, 1, 5), shuffle(r, s, 0, 4, 1, 5)
    far = shuffle(p, q, 2, 6, 3, 7), shuffle(r, s, 2, 6, 3, 7)
    return [shuffle(a, b, *order) for a, b in (near, far) for order in ((0, 1, 4, 5), (2, 3, 6, 7))]


@intrinsic
def put_sixteen(typing, picture, start, step, colours, at, apart):
    """Sixteen pixels of a row as bytes, from byte `start` of a flat picture on; a pixel takes `step` bytes, 3 or 4.

    Four and four of them lie together, int32 with red in the lowest byte, the first from element `at` on and the next
    so far apart. A fourth byte stays what it is.
    """

    def lower(context, builder, sig, args):
        picture, start, step, colours, at, apart = args
        row, quads = ir.VectorType(_INT32, SIDE), []
        for _ in range(SIDE):
            quads.append(builder.load(_address(context, builder, sig.args[3], colours, at, row), align=4))
            at = builder.add(at, apart)
        wide = builder.bitcast(_joined(builder, quads), ir.VectorType(_BYTE, 4 * SIXTEEN))
        three = [4 * pixel + colour for pixel in range(SIXTEEN) for colour in range(3)]
        _put_bytes(context, builder, sig.args[0], picture, start, step, wide, three, range(4 * SIXTEEN))
        return context.get_dummy_value()

    return types.void(picture, types.uint64, types.uint64, colours, types.uint64, types.uint64), lower
