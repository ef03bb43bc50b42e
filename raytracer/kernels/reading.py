"""Lines of spheres and surfaces, read as the interpreter reads them, and each number as Python's `float` does.

A number of up to 19 digits is an integer w times a power of ten: w fits two float64, and so does 10ᵏ up to k = 44, for
5⁴⁴ < 2¹⁰⁶. So w · 10ᵏ or w ÷ 10ᵏ in two-fold float64 is off by less than 2⁻¹⁰⁰ of itself, which leaves no doubt how it
rounds unless it is nearly half way between two float64. Then, and for whatever else is unusual, nothing is read, and
whoever called has it read by Python.
"""

import numpy as np

from raytracer.kernels.compiler import borrowing, called, inlined
from raytracer.twofold import divide, multiply

_MOST_DIGITS, _LARGEST_POWER = 19, 44
_TENS = np.array([float(10**k) for k in range(_LARGEST_POWER + 1)])
_TENS_LOW = np.array([float(10**k - int(float(10**k))) for k in range(_LARGEST_POWER + 1)])
_SLACK = 1.0 + 2.0**-30

_NEWLINE, _RETURN, _BLANK, _TAB, _HASH, _PLUS, _MINUS, _DOT, _ZERO, _NINE = b"\n\r \t#+-.09"
_SPHERE, _SURFACE, _E, _LARGE_E = np.frombuffer(b"sphere", np.uint8), np.frombuffer(b"surface", np.uint8), *b"eE"
_NOTHING = -1  # a place where there is nothing that can be read here


@borrowing
def read_plain(text, spheres, surfaces, material):
    """Read text, uint8 (n,), whose last byte is a newline; returns how many spheres and how many surfaces there are.

    spheres (…, 4), surfaces (…, 11) and material (…,), the surface of each sphere counted from −1, have room for all of
    them. A count below 0 says that something is not as plain as that, and that nothing counts.
    """
    p, balls, rows = 0, 0, 0
    while p < len(text):
        p = _past_blanks(text, p)
        if not _ends_line(text[p]):
            if _is_word(text, p, _SPHERE):
                p = _numbers(text, p + len(_SPHERE), spheres, balls, 4)
                if p == _NOTHING or not spheres[balls, 0] > 0.0:
                    return _NOTHING, rows
                material[balls] = rows - 1
                balls += 1
            elif _is_word(text, p, _SURFACE):
                p = _numbers(text, p + len(_SURFACE), surfaces, rows, 11)
                if p == _NOTHING:
                    return _NOTHING, rows
                rows += 1
            else:
                return _NOTHING, rows
        p = _past_line(text, p)
        if p == _NOTHING:
            return _NOTHING, rows
    return balls, rows


@inlined
def _past_blanks(text, p):
    while text[p] in (_BLANK, _TAB):
        p += 1
    return p


@inlined
def _ends_line(byte):
    return byte in (_NEWLINE, _RETURN, _HASH)


@inlined
def _is_word(text, p, word):
    """Whether a word stands there, with a blank behind it."""
    if p + len(word) >= len(text):
        return False
    for k in range(len(word)):
        if text[p + k] != word[k]:
            return False
    return text[p + len(word)] in (_BLANK, _TAB)


@inlined
def _past_line(text, p):
    """The place behind the end of the line, before which there may be a comment of plain text."""
    if text[p] == _HASH:
        while text[p] != _NEWLINE:
            if text[p] == 0 or text[p] > 127 or (text[p] == _RETURN and text[p + 1] != _NEWLINE):
                return _NOTHING
            p += 1
    if text[p] == _RETURN:
        p += 1
    return p + 1 if p < len(text) and text[p] == _NEWLINE else _NOTHING


@inlined
def _numbers(text, p, table, row, count):
    """Read the numbers that the rest of a line has, and has to have, into a row of a table."""
    for k in range(count):
        start = _past_blanks(text, p)
        if start == p:
            return _NOTHING
        value, p = _number(text, start)
        if p == _NOTHING:
            return _NOTHING
        table[row, k] = value
    p = _past_blanks(text, p)
    return p if _ends_line(text[p]) else _NOTHING


@called
def _number(text, p):
    """The number that begins there, and the place behind it."""
    negative = text[p] == _MINUS
    if negative or text[p] == _PLUS:
        p += 1
    whole, digits, power, some, fraction = np.uint64(0), 0, 0, False, False
    while True:
        byte = text[p]
        if _ZERO <= byte <= _NINE:
            whole = whole * np.uint64(10) + np.uint64(byte - _ZERO)
            digits += 1 if digits > 0 or whole > np.uint64(0) else 0  # even where 2⁶⁴ has become 0
            power -= 1 if fraction else 0
            some = True
        elif byte == _DOT and not fraction:
            fraction = True
        else:
            break
        p += 1
    if not some or digits > _MOST_DIGITS:
        return 0.0, _NOTHING
    if text[p] in (_E, _LARGE_E):
        exponent, p = _exponent(text, p + 1)
        power += exponent
    if p == _NOTHING or abs(power) > _LARGEST_POWER:
        return 0.0, _NOTHING
    value, sure = _scaled(whole, power)
    return -value if negative else value, p if sure else _NOTHING


@inlined
def _exponent(text, p):
    negative = text[p] == _MINUS
    if negative or text[p] == _PLUS:
        p += 1
    exponent, start = 0, p
    while _ZERO <= text[p] <= _NINE and p - start < 4:
        exponent = 10 * exponent + text[p] - _ZERO
        p += 1
    if p == start or p - start == 4:
        return 0, _NOTHING
    return -exponent if negative else exponent, p


@inlined
def _scaled(whole, power):
    """The float64 nearest to whole · 10^power, and whether that is certain."""
    high = np.float64(whole)
    low = np.float64(np.int64(whole - np.uint64(high)))
    ten, ten_low = _TENS[abs(power)], _TENS_LOW[abs(power)]
    if power < 0:
        high, low = divide(high, low, ten, ten_low)
    else:
        high, low = multiply(high, low, ten, ten_low)
    return high, high + low * _SLACK == high
