"""Eight numbers as one: each operation is the one on single numbers, eight times."""

import operator

import numpy as np
import pytest

from raytracer import backend

pytestmark = pytest.mark.skipif(backend.why_no_compiler() != "", reason="numba is not installed")
if not backend.why_no_compiler():
    import raytracer.kernels  # noqa: F401 (brings select for lanes)
    from raytracer import twofold
    from raytracer.kernels import lanes as k
    from raytracer.kernels import sixteen as s
    from raytracer.kernels.cells import spot_of
    from raytracer.kernels.compiler import borrowing

    EIGHT = np.uint64(8)
A = np.array([1.5, -2.0, 0.0, -0.0, np.inf, np.nan, 1e300, -7.25])
B = np.array([0.5, -2.0, 3.0, 1.0, -np.inf, 1.0, 1e300, 2.0])


@pytest.mark.parametrize("symbol", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_arithmetic(symbol):
    @borrowing
    def run(a, b, out):
        k.store(out, 0, symbol(k.load(a, 0), k.load(b, 0)))
        k.store(out, EIGHT, symbol(k.load(a, 0), 3.0))

    out = np.empty(16)
    run(A, B, out)
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(out, np.concatenate([symbol(A, B), symbol(A, 3.0)]))


@pytest.mark.parametrize("symbol", [operator.neg, abs, np.sqrt, np.floor, np.ceil])
def test_functions(symbol):
    @borrowing
    def run(a, out):
        k.store(out, 0, symbol(k.load(a, 0)))

    out = np.empty(8)
    run(A, out)
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(out, symbol(A))


@pytest.mark.parametrize("symbol", [operator.lt, operator.le, operator.gt, operator.ge, operator.eq])
def test_comparisons_and_masks(symbol):
    @borrowing
    def run(a, b, out):
        mask, positive = symbol(k.load(a, 0), k.load(b, 0)), k.load(a, 0) > 0.0
        k.store(out, 0, twofold.select(mask & positive, k.load(a, 0), -1.0))
        return k.bits_of(mask | positive), k.bits_of(~mask), k.any_of(mask), k.all_of(mask)

    out = np.empty(8)
    bits, others, some, every = run(A, B, out)
    with np.errstate(all="ignore"):
        mask, positive = symbol(A, B), A > 0
    np.testing.assert_array_equal(out, np.where(mask & positive, A, -1.0))
    assert bits == sum(1 << i for i in range(8) if (mask | positive)[i])
    assert others == sum(1 << i for i in range(8) if not mask[i])
    assert (some, every) == (mask.any(), mask.all())


def test_rows_are_turned_into_columns():
    table = np.arange(80.0)
    places = np.array([3, 0, 19, 7, 7, 1, 12, 5], np.int32)

    @borrowing
    def run(table, places, out):
        columns, gathered = k.load_rows(table, 2), k.gather_rows(table, k.load(places, 0))
        for i in range(4):
            k.store(out, np.uint64(8 * i), columns[i])
            k.store(out, np.uint64(32 + 8 * i), gathered[i])
        k.store(out, np.uint64(64), k.gather(table, k.load(places, 0)))
        return k.first_of(k.load(places, 0)), k.largest_of(k.load(places, 0)), k.same(k.load(places, 0))

    out = np.empty(72)
    assert run(table, places, out) == (3, 19, False)
    rows = table.reshape(-1, 4)
    np.testing.assert_array_equal(out[:32].reshape(4, 8), rows[2:10].T)
    np.testing.assert_array_equal(out[32:64].reshape(4, 8), rows[places].T)
    np.testing.assert_array_equal(out[64:], table[places])


def test_boxes_and_pixels_are_written_in_rows():
    @borrowing
    def run(numbers, boxes, three, four):
        a, b, c, d = k.load(numbers, 0), k.load(numbers, 8), k.load(numbers, 16), k.load(numbers, 24)
        k.store_boxes(boxes, 1, a, b, c, d)
        k.put_pixels(three, 2, 3, a, b, c)
        k.put_pixels(four, 4, 4, a, b, c)

    numbers = np.arange(32.0) * 7 + 0.5
    boxes, three, four = np.full(40, -5, np.int32), np.full(28, 1, np.uint8), np.full(40, 2, np.uint8)
    run(numbers, boxes, three, four)
    columns = np.floor(numbers).astype(int).reshape(4, 8)
    assert boxes.tolist() == [-5] * 4 + columns.T.ravel().tolist() + [-5] * 4
    assert three.tolist() == [1, 1, *columns[:3].T.ravel().tolist(), 1, 1]
    assert four[4:36].reshape(8, 4)[:, :3].tolist() == columns[:3].T.tolist()
    assert (four[4:36].reshape(8, 4)[:, 3] == 2).all()
    assert (four[:4] == 2).all()
    assert (four[36:] == 2).all()


@pytest.mark.parametrize("step", [3, 4])
def test_pixels_of_one_colour(step):
    @borrowing
    def run(picture, step, colours):
        k.put_alike(picture, np.uint64(step), np.uint64(step), colours)

    picture = np.full((k.ALIKE + 2, step), 7, np.uint8)
    run(picture.reshape(-1), step, np.full(16, 0x030201, np.int32))
    expected = np.full((k.ALIKE + 2, step), 7, np.uint8)
    expected[1:-1, :3] = 1, 2, 3
    np.testing.assert_array_equal(picture, expected)


def test_pairs_of_rows():
    numbers, places = np.arange(40.0), np.arange(40, dtype=np.int32)

    @borrowing
    def run(numbers, places, out):
        k.store_pair(out, 2, 10, k.load_pair(numbers, 3, 20))
        k.store(out, np.uint64(16), k.spread_pair(1.5, -2.5))
        return k.largest_of(k.load_pair(places, 1, 30))

    out = np.zeros(24)
    assert run(numbers, places, out) == 33
    assert out.tolist() == [0, 0, 3, 4, 5, 6, 0, 0, 0, 0, 20, 21, 22, 23, 0, 0, *[1.5] * 4, *[-2.5] * 4]


def test_places_are_compared_and_picked():
    words = np.arange(8, dtype=np.uint64) * 3 + (np.uint64(9) << np.uint64(32))

    @borrowing
    def run(words, a, out):
        low = k.load_low(words, 0)
        k.store(out, 0, low)
        k.store(out, EIGHT, k.spread(np.int32(3)) * low + k.spread(np.int32(1)))
        k.store(out, np.uint64(16), k.whole(k.load(a, 0)))
        high = k.at_least(low, 12)
        return (
            k.bits_of(k.equal_to(low, 9)),
            k.bits_of(high),
            k.first_where(high, low),
            k.bits_of(k.mask_of(np.uint8(90))),
        )

    out = np.zeros(24, np.int32)
    whole = np.array([0, -1, 2, 3.9, 1e6, 5, -6.5, 7])
    assert run(words, whole, out) == (1 << 3, 0b11110000, 12, 90)
    assert out.tolist() == [*range(0, 24, 3), *range(1, 72, 9), *whole.astype(int).tolist()]


def test_the_smallest():
    @borrowing
    def run(a):
        return k.smallest_of(k.load(a, 0))

    assert run(np.array([0, 1, 2, 0.5, -1, 20, 2.5, 3])) == -1


def test_spots_in_a_box_of_a_cell():
    """`in_box` for all corners of a cell and for boxes at its edges, against comparisons."""

    @borrowing
    def run(x, y, box):
        return k.bits_of(k.in_box(spot_of(k.load(x, 0), k.load(y, 0)), box))

    x = np.array([0, 1, 5, 63, 64, 126, 127, 127], np.int32)
    for y in (x, x[::-1].copy(), np.full(8, 64, np.int32)):
        for left, right, top, bottom in ((0, 127, 0, 127), (1, 126, 0, 127), (64, 64, 5, 64), (0, 0, 127, 127)):
            box = np.int32(left | (127 - right) << 8 | top << 16 | (127 - bottom) << 24)
            expected = (left <= x) & (x <= right) & (top <= y) & (y <= bottom)
            assert run(x, y, box) == sum(1 << i for i in range(8) if expected[i])
    assert lane_numbers_of() == list(range(8))


def lane_numbers_of():
    @borrowing
    def run(out):
        k.store(out, 0, k.lane_numbers())

    out = np.empty(8, np.int32)
    run(out)
    return out.tolist()


X = (np.arange(16, dtype=np.float32) - 5) / np.float32(3)
Y = np.float32(2.0) ** np.arange(-8, 8, dtype=np.float32)


@pytest.mark.parametrize("symbol", [operator.add, operator.sub, operator.mul, operator.truediv])
def test_arithmetic_of_singles_and_of_pairs(symbol):
    @borrowing
    def run(x, y, out):
        k.store(out, 0, symbol(k.load(x, 0), k.load(y, 0)))
        pair = symbol(s.both(k.load(x, 0)), s.two(np.float32(2.0), np.float32(3.0)))
        k.store_pair(out, np.uint64(16), np.uint64(32), -abs(pair))

    out = np.empty(48, np.float32)
    run(X, Y, out)
    expected = [symbol(X, Y), -abs(symbol(X, np.float32(2))), -abs(symbol(X, np.float32(3)))]
    np.testing.assert_array_equal(out, np.concatenate(expected))


def test_rough_inverses_and_roots():
    @borrowing
    def run(y, out):
        k.store(out, 0, s.rough_inverse(k.load(y, 0)))
        k.store(out, np.uint64(16), s.rough_inverse_root(k.load(y, 0)))
        pair = s.rough_inverse_root(s.both(k.load(y, 0)) * s.two(np.float32(3.0), np.float32(-1.0)))
        k.store_pair(out, np.uint64(32), np.uint64(48), pair)
        k.store(out, np.uint64(64), s.times_plus(k.load(y, 0), k.load(y, 0), 1.0))

    out = np.empty(80, np.float32)
    run(Y, out)
    wide = Y.astype(np.float64)
    for found, true in ((out[:16], 1 / wide), (out[16:32], wide**-0.5), (out[32:48], (3 * wide) ** -0.5)):
        assert (abs(found / true - 1) < 2.0**-14).all()
    assert np.isnan(out[48:64]).all()
    np.testing.assert_allclose(out[64:], wide * wide + 1, rtol=2.0**-23)


def test_choices_marks_and_numbers():
    @borrowing
    def run(x, y, numbers, out, found):
        less, most = s.lesser(k.load(x, 0), k.load(y, 0)), s.greater(k.load(x, 0), np.float32(1.0))
        k.store(out, 0, k.blend(less < k.load(y, 0), less, most))
        k.store(found, 0, (s.load_numbers(numbers, 0) & s.sixteen(5)) << 2 | 1)
        k.store(found, np.uint64(16), s.whole_numbers(k.load(y, 0)))
        pair = s.load_two(numbers, np.uint64(16), np.uint64(0))
        k.store_pair(found, np.uint64(32), np.uint64(48), pair >> 1)
        return k.bits_of(pair > 20), s.lowest_bit(np.int32(40)), k.any_of(pair > 40)

    out, numbers, found = np.empty(16, np.float32), np.arange(32, dtype=np.int32), np.empty(64, np.int32)
    bits, lowest, some = run(X, Y, numbers, out, found)
    less = np.minimum(X, Y)
    np.testing.assert_array_equal(out, np.where(less < Y, less, np.maximum(X, 1)))
    expected = [(numbers[:16] & 5) * 4 + 1, Y.astype(np.int32), numbers[16:] >> 1, numbers[:16] >> 1]
    np.testing.assert_array_equal(found, np.concatenate(expected))
    assert (bits, lowest, some) == (0b1111111111100000, 3, False)


def test_rounding_and_packing():
    @borrowing
    def run(x, y, out, colours):
        pair = s.both(k.load(x, 0)) * s.two(np.float32(1.0), np.float32(-3.0))
        k.store_pair(out, np.uint64(0), np.uint64(16), s.rest(pair))
        k.store(out, np.uint64(32), s.larger_size(k.load(x, 0), k.load(y, 0)))
        k.store_pair(colours, np.uint64(0), np.uint64(16), s.rounded(pair))
        red, green, blue = s.sixteen(np.int32(7)), s.rounded(k.load(y, 0)), s.sixteen(np.int32(40_000))
        k.store(colours, np.uint64(32), s.pack(red, green, blue))

    x, y = np.linspace(-2.5, 2.5, 16, dtype=np.float32), np.linspace(0.1, 900, 16, dtype=np.float32)
    x[3] = np.nan
    out, colours = np.empty(48, np.float32), np.empty(48, np.int32)
    run(x, y, out, colours)
    pair = np.concatenate([x, -3 * x])
    np.testing.assert_array_equal(out[:32], pair - np.rint(pair))
    np.testing.assert_array_equal(out[32:], np.fmax(abs(x), abs(y)))
    known = ~np.isnan(pair)
    np.testing.assert_array_equal(colours[:32][known], np.rint(pair[known]))
    expected = 7 | np.minimum(np.rint(y), 255).astype(np.int32) << 8 | 255 << 16
    np.testing.assert_array_equal(colours[32:] & 0xFFFFFF, expected)


def test_a_table_of_eight_columns():
    @borrowing
    def run(columns, numbers, table, place, out, spread):
        c = columns
        s.store_table(
            table, np.uint64(1), k.load(c, 0), k.load(c, np.uint64(8)), k.load(c, np.uint64(16)),
            k.load(c, np.uint64(24)), k.load(c, np.uint64(32)), k.load(c, np.uint64(40)), k.load(c, np.uint64(48)),
            k.load(c, np.uint64(56)),
        )  # fmt: skip
        s.gather_to_columns(table, numbers, np.uint64(0), np.uint64(16), place)
        found = s.load_columns(place)
        s.spread_rows(table, numbers[0], numbers[1], spread)
        for i in range(8):
            k.store_pair(out, np.uint64(32 * i), np.uint64(32 * i + 16), found[i])
        s.store_halves(out, np.uint64(256), k.load(c, 0))

    rng = np.random.default_rng(1)
    columns, table = rng.normal(size=(8, 8)) * 1e6, np.zeros((9, 8), np.float32)
    numbers, out = rng.integers(0, 9, 32).astype(np.int32), np.empty(264, np.float32)
    place, spread = np.empty(256, np.float32), np.empty(256, np.float32)
    run(columns.reshape(-1), numbers, table.reshape(-1), place, out, spread)
    np.testing.assert_array_equal(table[1:, 2:], columns[2:].T.astype(np.float32))
    bits = table.view(np.int32)
    np.testing.assert_array_equal(bits[1:, :2], np.rint(columns[:2]).T)
    np.testing.assert_array_equal(out[:256].view(np.int32).reshape(8, 32), bits[numbers].T)
    np.testing.assert_array_equal(spread.view(np.int32).reshape(8, 32), bits[np.repeat(numbers[:2], 16)].T)
    np.testing.assert_array_equal(out[256:], columns[0].astype(np.float32))


def test_how_far_whole_numbers_are_beyond_others_is_rounded_once():
    @borrowing
    def run(numbers, wholes, out):
        first, second = np.uint64(0), np.uint64(16)
        found = s.beyond(s.load_two(numbers, first, second), s.load_columns(wholes)[0])
        k.store_pair(out, first, second, found)

    rng = np.random.default_rng(3)
    numbers, wholes = rng.integers(-(1 << 29), 1 << 29, (2, 256)).astype(np.int32)
    out = np.empty(32, np.float32)
    run(numbers, wholes.view(np.float32), out)
    np.testing.assert_array_equal(out, (numbers - wholes)[:32].astype(np.float32))


@pytest.mark.parametrize("step", [3, 4])
def test_a_row_of_four_blocks_as_bytes(step):
    @borrowing
    def run(picture, step, colours):
        s.put_sixteen(picture, np.uint64(step), np.uint64(step), colours, np.uint64(4), np.uint64(16))

    rng = np.random.default_rng(2)
    colours = rng.integers(0, 1 << 24, (4, 4, 4), dtype=np.int32)  # block, row, column
    picture = np.full((18, step), 7, np.uint8)
    run(picture.reshape(-1), step, colours.reshape(-1))
    expected = np.full((18, step), 7, np.uint8)
    expected[1:17, :3] = colours[:, 1].reshape(-1)[:, None] >> np.array([0, 8, 16]) & 255
    np.testing.assert_array_equal(picture, expected)
