"""CRC-32C (Castagnoli), the checksum of keyframes, in numpy.

A register is linear over GF(2): that of two pieces is that of the first, shifted by the length of the second, xor that of
the second. So many pieces are computed side by side, and joined in pairs.
"""

from __future__ import annotations

import functools

import numpy as np

from relmap.geometry import Array

_PIECES = 1024  # a power of 2
_POLYNOMIAL = 0x82F63B78


@functools.lru_cache(maxsize=None)
def _shift_tables(power: int) -> Array:
    """uint32 (4, 256): what 2^power bytes of zeros make of each byte of a register."""
    if power == 0:
        one = np.arange(256, dtype=np.uint32)
        for _ in range(8):
            one = np.where(one & 1, (one >> 1) ^ np.uint32(_POLYNOMIAL), one >> 1).astype(np.uint32)
        others = [(np.arange(256, dtype=np.uint32) << np.uint32(8 * (k - 1))) for k in (1, 2, 3)]
        return np.stack([one, *others])
    half = _shift_tables(power - 1)
    return np.stack([_shifted(half[k], half) for k in range(4)])


def _shifted(registers: Array, tables: Array) -> Array:
    out = tables[0][registers & 0xFF]
    out ^= tables[1][(registers >> 8) & 0xFF]
    out ^= tables[2][(registers >> 16) & 0xFF]
    out ^= tables[3][registers >> 24]
    return np.asarray(out)


def crc32c(data: bytes) -> int:
    """The checksum of the bytes, 0..2^32-1."""
    if len(data) < 4:
        register, table = 0xFFFFFFFF, _shift_tables(0)[0]
        for byte in data:
            register = int(table[(register ^ byte) & 0xFF]) ^ (register >> 8)
        return register ^ 0xFFFFFFFF
    words_power = max((-(-len(data) // (4 * _PIECES)) - 1).bit_length(), 0)
    words = 1 << words_power  # of four bytes, in each piece
    padded = np.zeros(4 * words * _PIECES, np.uint8)  # zeros before the data change nothing
    tail = padded[len(padded) - len(data) :]
    tail[:] = np.frombuffer(data, np.uint8)
    tail[:4] ^= 0xFF  # the register begins with ones
    pieces = padded.view("<u4").reshape(_PIECES, words)
    tables = _shift_tables(2)
    registers = np.zeros(_PIECES, np.uint32)
    for column in range(words):
        registers = _shifted(registers ^ pieces[:, column], tables)
    power = words_power + 2
    while len(registers) > 1:
        registers = _shifted(registers[0::2], _shift_tables(power)) ^ registers[1::2]
        power += 1
    return int(registers[0]) ^ 0xFFFFFFFF
