"""Pictures as they are sent: the bytes of a JPEG or PNG file. Arrays are encoded as PNG here, with zlib alone."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path
from typing import Union

import numpy as np

from relmap.geometry import Array

PictureLike = Union[str, "os.PathLike[str]", bytes, Array]
"""A picture: the path of a JPEG or PNG file, the bytes of one, or an array, H x W (grey) or H x W x 3 (RGB), of uint8."""

KINDS_OF_PICTURES = "a path, bytes (of an open file: file.read()) or an array of uint8 (of another picture: numpy.asarray)"
"""What a picture may be, for messages."""

MAX_PICTURE_BYTES = 16 * 2**20
"""The largest file that relmapd takes."""


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def encode_png(pixels: Array) -> bytes:
    """The bytes of a PNG file of an array of uint8, H x W (grey) or H x W x 3 (RGB). ValueError: another array."""
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8:
        kind = pixels.dtype if isinstance(pixels, np.ndarray) else type(pixels).__name__
        raise ValueError(f"a picture of {kind}; must be an array of uint8")
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[:, :, 0]
    if not (pixels.ndim == 2 or (pixels.ndim == 3 and pixels.shape[2] == 3)) or 0 in pixels.shape:
        raise ValueError(f"a picture of shape {pixels.shape}; must be H x W (grey) or H x W x 3 (RGB)")
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels).reshape(height, -1)
    # Each row as its difference to the row above (filter 2), which compresses better and costs little.
    filtered = np.empty((height, rows.shape[1] + 1), dtype=np.uint8)
    filtered[:, 0] = 2
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    header = struct.pack(">IIBBBBB", width, height, 8, 0 if pixels.ndim == 2 else 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 1))
        + _chunk(b"IEND", b"")
    )


def picture_bytes(picture: PictureLike) -> bytes:
    """The bytes to send. ValueError: no picture, or more than 16 MB; OSError: the file cannot be read."""
    if isinstance(picture, np.ndarray):
        data = encode_png(picture)
    elif isinstance(picture, (bytes, bytearray, memoryview)):
        data = bytes(picture)
    elif isinstance(picture, (str, os.PathLike)):
        data = Path(picture).read_bytes()
    else:
        raise TypeError(f"a picture is {KINDS_OF_PICTURES}, not {type(picture).__name__}")
    if len(data) > MAX_PICTURE_BYTES:
        raise ValueError(f"a picture of {len(data)} bytes; at most {MAX_PICTURE_BYTES}")
    if not data.startswith((b"\xff\xd8\xff", b"\x89PNG")):
        raise ValueError("a picture that is neither JPEG nor PNG")
    return data
