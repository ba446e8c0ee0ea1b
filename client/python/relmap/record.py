"""What records of the map have in common."""

from __future__ import annotations

import dataclasses
import enum
from typing import Any

import numpy as np

from relmap.ids import EdgeId, FrameId, LandmarkId

_SHOWN = 4  # of a longer list


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        if not (isinstance(a, np.ndarray) and isinstance(b, np.ndarray)) or a.shape != b.shape:
            return False
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f" and b.dtype.kind == "f"))
    return bool(a == b)


def _shown(value: Any) -> str:
    if isinstance(value, (FrameId, EdgeId, LandmarkId)):
        return str(value)
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape}" if value.size > _SHOWN else str(value.tolist())
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, tuple):
        items = [_shown(item) for item in value[:_SHOWN]] + ([f"... {len(value)}"] if len(value) > _SHOWN else [])
        return "(" + ", ".join(items) + ("," if len(items) == 1 else "") + ")"
    return repr(value)


class Record:
    """A record that cannot be changed. Two are equal if they are of one class and all their fields are equal, arrays by
    their contents (NaN equals NaN). Records are not hashable, since arrays are not. Their repr() tells the shapes of arrays,
    and the beginning of long lists."""

    __slots__ = ()
    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        fields = [field.name for field in dataclasses.fields(self) if field.repr]
        return f"{type(self).__name__}({', '.join(f'{name}={_shown(getattr(self, name))}' for name in fields)})"

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = [field.name for field in dataclasses.fields(self) if field.compare]
        return all(_same(getattr(self, name), getattr(other, name)) for name in names)
