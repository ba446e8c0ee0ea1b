"""Arguments that are one of a few: a member of an enumeration, or its name."""

from __future__ import annotations

import enum
from typing import Sequence, Type, TypeVar, Union, cast

E = TypeVar("E", bound=enum.Enum)


def choice(what: str, kind: Type[E], value: Union[E, str]) -> E:
    """The member that is meant: it itself, or its name in upper or lower case. ValueError: there is none; it tells them all."""
    try:
        return kind[value.upper()] if isinstance(value, str) else kind(value)
    except (KeyError, ValueError):
        names = ", ".join(repr(member.name.lower()) for member in kind)
        raise ValueError(f"{what} is {value!r}; must be one of {names}") from None


def choices(what: str, kind: Type[E], values: Union[E, str, Sequence[Union[E, str]]]) -> list[E]:
    """The members that are meant, by one or several. ValueError: there is no such member."""
    if isinstance(values, str) or isinstance(values, kind):
        return [choice(what, kind, values)]
    several = cast(Sequence[Union[E, str]], values)
    return [choice(what, kind, value) for value in several]
