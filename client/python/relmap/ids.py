"""Identities of what the map holds, as they are written: "3:120" is a frame, "3:120/1" an edge, "3:120.17" a landmark."""

from __future__ import annotations

import operator
import re
import uuid as uuids
from dataclasses import dataclass
from typing import Any, Protocol, Sequence, Union, cast

from relmap.v1 import common_pb2

_MAX_U32 = 2**32 - 1
_DIGITS = re.compile(r"[0-9]+")


def _u32(what: str, value: int) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= _MAX_U32:
        raise ValueError(f"{what} is {value!r}; must be a whole number 0..{_MAX_U32}")


@dataclass(frozen=True, order=True, slots=True)
class FrameId:
    """A keyframe of the map. ValueError: a number is negative or too large.

    Attributes:
        session: number of the session in the map, from 1.
        index: the keyframe's sequence; there may be gaps.
    """

    session: int
    index: int

    def __post_init__(self) -> None:
        _u32("session", self.session)
        _u32("index", self.index)

    @staticmethod
    def parse(text: str) -> "FrameId":
        """Reads "3:120". ValueError: it is not of this form."""
        match = re.fullmatch(r"(\d+):(\d+)", text)
        if match is None:
            raise ValueError(f"{text!r} is no frame; write SESSION:INDEX, such as 3:120")
        return FrameId(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.session}:{self.index}"


@dataclass(frozen=True, order=True, slots=True)
class EdgeId:
    """An edge, stored with the newer of its frames.

    Attributes:
        frame: the newer end.
        ordinal: 0 is the edge of the robot's own motion; 1, 2, ... are loop closures.
    """

    frame: FrameId
    ordinal: int

    def __post_init__(self) -> None:
        _u32("ordinal", self.ordinal)

    @staticmethod
    def parse(text: str) -> "EdgeId":
        """Reads "3:120/1". ValueError: it is not of this form."""
        frame, slash, ordinal = text.partition("/")
        if not slash or not ordinal.isdecimal():
            raise ValueError(f"{text!r} is no edge; write SESSION:INDEX/ORDINAL, such as 3:120/1")
        return EdgeId(FrameId.parse(frame), int(ordinal))

    def __str__(self) -> str:
        return f"{self.frame}/{self.ordinal}"


@dataclass(frozen=True, order=True, slots=True)
class LandmarkId:
    """A landmark: the slot-th whose base frame is `base`."""

    base: FrameId
    slot: int

    def __str__(self) -> str:
        return f"{self.base}.{self.slot}"


class HasFrameId(Protocol):
    """A record of a frame."""

    @property
    def id(self) -> FrameId:
        """Its identity."""


class HasEdgeId(Protocol):
    """A record of an edge."""

    @property
    def id(self) -> EdgeId:
        """Its identity."""


class HasNumber(Protocol):
    """A session of the map, or one into which keyframes are streamed."""

    @property
    def number(self) -> int:
        """Its number in the map, from 1."""


FrameLike = Union[FrameId, str, HasFrameId]
"""A frame: its id, its text "3:120", or a Frame."""
EdgeLike = Union[EdgeId, str, HasEdgeId]
"""An edge: its id, its text "3:120/1", or an Edge."""
SessionLike = Union[int, str, uuids.UUID, HasNumber]
"""A session of the map: its number, name, "ROBOT/NAME", uuid, or a Session. A text of digits only is a number. For names and
uuids the client asks the daemon which sessions there are, before each call."""
SessionsLike = Union[SessionLike, Sequence[SessionLike]]
"""Sessions: one, or several."""


def as_frame(frame: FrameLike) -> FrameId:
    """The frame that is meant. ValueError: the text is no frame. TypeError: it is neither."""
    if isinstance(frame, FrameId):
        return frame
    if isinstance(frame, str):
        return FrameId.parse(frame)
    known = getattr(frame, "id", None)
    if isinstance(known, FrameId):
        return known
    raise TypeError(f"a frame is a FrameId, a Frame or a text such as '3:120', not {type(frame).__name__}")


def as_edge(edge: EdgeLike) -> EdgeId:
    """The edge that is meant. ValueError: the text is no edge. TypeError: it is neither."""
    if isinstance(edge, EdgeId):
        return edge
    if isinstance(edge, str):
        return EdgeId.parse(edge)
    known = getattr(edge, "id", None)
    if isinstance(known, EdgeId):
        return known
    raise TypeError(f"an edge is an EdgeId, an Edge or a text such as '3:120/1', not {type(edge).__name__}")


def as_session(session: SessionLike, what: str = "session", least: int = 1) -> Union[int, str]:
    """The number of the session that is meant; or the name or uuid, if only the map tells its number (Sessions.number_of()).
    ValueError: the number is below `least`, or too large, or the text is empty. TypeError: it is no session."""
    if isinstance(session, uuids.UUID) or (isinstance(session, str) and session and not _DIGITS.fullmatch(session)):
        return str(session)
    known: Any = getattr(session, "number", session)
    if isinstance(known, str):
        if not known:
            raise ValueError(f"{what} is an empty text; must be a session's number, name or uuid")
        known = int(known)
    if isinstance(known, bool) or not hasattr(known, "__index__"):
        raise TypeError(f"{what} is a session's number, name or uuid, or a Session, not {type(session).__name__}")
    number = operator.index(known)
    if not least <= number <= _MAX_U32:
        raise ValueError(f"{what} is {number}; must be a session's number, {least} or more")
    return number


def as_sessions(sessions: SessionsLike) -> list[Union[int, str]]:
    """Each session that is meant, as as_session() has it. ValueError, TypeError as as_session()."""
    if isinstance(sessions, (str, bytes, uuids.UUID)) or hasattr(sessions, "number") or hasattr(sessions, "__index__"):
        return [as_session(cast(SessionLike, sessions))]
    return [as_session(session, "a session") for session in sessions]


def read_frame_id(message: common_pb2.FrameId) -> FrameId:
    """The frame of a message."""
    return FrameId(message.session, message.index)


def read_edge_id(message: common_pb2.EdgeId) -> EdgeId:
    """The edge of a message."""
    return EdgeId(FrameId(message.frame.session, message.frame.index), message.ordinal)


def frame_message(frame: FrameLike) -> common_pb2.FrameId:
    """A frame as a message. ValueError, TypeError as as_frame()."""
    known = as_frame(frame)
    return common_pb2.FrameId(session=known.session, index=known.index)


def edge_message(edge: EdgeLike) -> common_pb2.EdgeId:
    """An edge as a message. ValueError, TypeError as as_edge()."""
    known = as_edge(edge)
    return common_pb2.EdgeId(frame=frame_message(known.frame), ordinal=known.ordinal)
