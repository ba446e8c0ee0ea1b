"""Enumerations, which print as names: numbers say nothing to who reads them."""

from __future__ import annotations

import enum
from typing import Optional, TypeVar

O = TypeVar("O", bound="OpenEnum")

_NUMERIC_FORMATS = "bcdoxXneEfFgG%"


class NamedEnum(enum.Enum):
    """An enumeration whose members print as their names; repr() has the class before it."""

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"{type(self).__name__}.{self.name}"

    def __format__(self, spec: str) -> str:
        return format(self.name, spec)


class NumberedEnum(NamedEnum, enum.IntEnum):
    """One whose members are numbers, too, but print as names, unless a number's format is asked for: ``f"{state:d}"``."""

    def __format__(self, spec: str) -> str:
        return format(int(self) if spec and spec[-1] in _NUMERIC_FORMATS else self.name, spec)


class OpenEnum(NumberedEnum):
    """One to which a newer relmapd may add: a number not known here becomes a member ``UNKNOWN_<number>``."""

    @classmethod
    def _missing_(cls: type[O], value: object) -> Optional[O]:
        if not isinstance(value, int):
            return None
        later = int.__new__(cls, value)
        later._name_ = f"UNKNOWN_{value}"
        later._value_ = value
        return later
