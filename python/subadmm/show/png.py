"""PNG files of 8-bit colours."""
import struct
import zlib

import numpy as np


def png_of(pixels) -> bytes:
    """pixels: height x width x 3, uint8."""
    height, width, _ = pixels.shape
    rows = pixels.reshape(height, -1).astype(np.int16)
    left = np.pad(rows, ((0, 0), (3, 0)))[:, :-3]
    above = np.pad(rows, ((1, 0), (0, 0)))[:-1]
    corner = np.pad(above, ((0, 0), (3, 0)))[:, :-3]
    # The filter 'Paeth': what is left of each byte after the neighbour that is nearest to left + above - corner.
    guess = left + above - corner
    a, b, c = abs(guess - left), abs(guess - above), abs(guess - corner)
    rest = rows - np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
    data = np.concatenate([np.full((height, 1), 4), rest & 255], axis=1).astype(np.uint8).tobytes()

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(data, 9)) + chunk(b"IEND", b"")
