"""Times: relmap has whole microseconds UTC since 1970; Python has datetimes."""

from __future__ import annotations

import datetime
from typing import Union

TimeLike = Union[int, datetime.datetime]
"""A time: whole microseconds UTC since 1970, or a datetime with a time zone."""

_EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.timezone.utc)
_MICROSECOND = datetime.timedelta(microseconds=1)


def as_us(time: TimeLike) -> int:
    """Microseconds UTC of a time. ValueError: a datetime without a time zone, or out of range. TypeError: it is neither."""
    if isinstance(time, datetime.datetime):
        if time.tzinfo is None:
            raise ValueError("a datetime without a time zone; say datetime.timezone.utc, or .astimezone() if it is local")
        time = (time - _EPOCH) // _MICROSECOND
    if isinstance(time, bool) or not hasattr(time, "__index__"):
        raise TypeError(f"a time is whole microseconds or a datetime, not {type(time).__name__}")
    time = time.__index__()
    if not 0 <= time <= 2**53:
        raise ValueError(f"a time of {time} us; must be 0..2^53")
    return time


def as_datetime(time_us: int) -> datetime.datetime:
    """The time, in UTC, of microseconds since 1970."""
    return _EPOCH + time_us * _MICROSECOND
