"""PNG files, written a band of rows at a time, with 8 or 16 bits a number: the picture is never there as a whole.

A PNG holds one zlib stream of all rows. A band is deflated on its own, wherever that may be, and ends at a whole byte
without ending the stream (zlib's `Z_SYNC_FLUSH`); so bands, one behind the other, are one stream, once it is begun and
ended. That takes the checksum of all bytes, which is worked out from those of the bands (M. Adler's sum, RFC 1950).
Each row is written as its difference from the one above (PNG's filter 2), but for the first of a band; of such rows,
looking for runs only is a half or a third of the work, for files half as large again.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from typing import IO, NamedTuple

import numpy as np

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BEGIN, _END = b"\x78\x9c", b"\x03\x00"  # of a zlib stream: its header; an empty last block
_AS_IT_IS, _MINUS_ABOVE = 0, 2  # filters
_MODULUS = 65521  # of Adler's sum
_MOST = 1 << 30  # bytes of a chunk; the format allows twice as many
_HEAD = struct.Struct("<IQ")
SMALLEST = 1 / 1032  # of its size is what deflate makes of a picture at best


class Band(NamedTuple):
    """Some rows, deflated."""

    checksum: int  # of what was deflated
    length: int  # bytes of that
    deflated: bytes

    def pack(self) -> bytes:
        """All of it as bytes."""
        return _HEAD.pack(self.checksum, self.length) + self.deflated

    @classmethod
    def unpack(cls, packed: bytes) -> Band:
        checksum, length = _HEAD.unpack_from(packed)
        return cls(checksum, length, packed[_HEAD.size :])


def deflate_rows(rows: np.ndarray) -> Band:
    """A band of a picture: uint8 or uint16 (rows, width, 3)."""
    numbers = rows.astype(">u2" if rows.dtype == np.uint16 else np.uint8, copy=False)
    plain = np.ascontiguousarray(numbers).view(np.uint8).reshape(len(rows), -1)
    filtered = np.empty((len(plain), plain.shape[1] + 1), np.uint8)
    filtered[:, 0], filtered[0, 0] = _MINUS_ABOVE, _AS_IT_IS
    filtered[0, 1:] = plain[0]
    np.subtract(plain[1:], plain[:-1], out=filtered[1:, 1:])
    deflate = zlib.compressobj(wbits=-zlib.MAX_WBITS, strategy=zlib.Z_RLE)
    deflated = deflate.compress(filtered.data) + deflate.flush(zlib.Z_SYNC_FLUSH)
    return Band(zlib.adler32(filtered.data), filtered.nbytes, deflated)


def write_png(file: IO[bytes], width: int, height: int, bits: int, bands: Iterable[Band]) -> None:
    """A picture of all bands, from the top."""
    file.write(_SIGNATURE)
    _write_chunk(file, b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0))
    _write_chunk(file, b"IDAT", _BEGIN)
    checksum = 1
    for band in bands:
        for start in range(0, len(band.deflated), _MOST):
            _write_chunk(file, b"IDAT", band.deflated[start : start + _MOST])
        checksum = _joined(checksum, band)
    _write_chunk(file, b"IDAT", _END + struct.pack(">I", checksum))
    _write_chunk(file, b"IEND", b"")


def _write_chunk(file: IO[bytes], kind: bytes, data: bytes) -> None:
    file.write(struct.pack(">I", len(data)) + kind)
    file.write(data)
    file.write(struct.pack(">I", zlib.crc32(data, zlib.crc32(kind))))


def _joined(before: int, band: Band) -> int:
    """The checksum of what comes before and the band: low half 1 + Σ bytes, high half the sum of the low halves."""
    low, high, more, more_high = before & 0xFFFF, before >> 16, band.checksum & 0xFFFF, band.checksum >> 16
    high = (high + more_high + band.length * (low - 1)) % _MODULUS
    return high << 16 | (low + more - 1) % _MODULUS
