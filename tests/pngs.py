"""PNG files read by the format's definition (RFC 2083), 8 or 16 bits; every checksum is checked."""

import struct
import zlib

import numpy as np


def read_png(path):
    """uint8 or uint16 (height, width, 3)."""
    return decode_png(path.read_bytes())


def decode_png(data):
    """The same of a file's bytes."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, place = [], 8
    while place < len(data):
        (length,) = struct.unpack_from(">I", data, place)
        kind, body = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        assert struct.unpack_from(">I", data, place + 8 + length)[0] == zlib.crc32(kind + body)
        chunks.append((kind, body))
        place += 12 + length
    assert chunks[0][0] == b"IHDR"
    assert chunks[-1] == (b"IEND", b"")
    width, height, bits, colour, *rest = struct.unpack(">IIBBBBB", chunks[0][1])
    assert (colour, rest) == (2, [0, 0, 0])
    flat = np.frombuffer(zlib.decompress(b"".join(body for kind, body in chunks if kind == b"IDAT")), np.uint8)
    rows = flat.reshape(height, -1)
    out = np.zeros((height, rows.shape[1] - 1), np.uint8)
    for y, (kind, *_) in enumerate(rows):
        assert kind in (0, 2)
        out[y] = rows[y, 1:] + (out[y - 1] if kind == 2 else 0)
    return out.view(np.uint8 if bits == 8 else ">u2").reshape(height, width, 3)
