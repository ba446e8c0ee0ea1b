"""What happens to the map, as Client.watch() tells it. Every event carries the state after it."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Callable, Optional

from relmap.errors import reads_reply
from relmap.geometry import Array, read_transform
from relmap.graph import Edge, MotionSource, SessionState, read_edge
from relmap.ids import EdgeId, FrameId, read_edge_id, read_frame_id
from relmap.reason import Reason
from relmap.record import Record
from relmap.status import Condition, RobotStatus, read_robot
from relmap.times import as_datetime
from relmap.v1 import graph_pb2, watch_pb2


@dataclass(frozen=True, slots=True)
class EventOrigin:
    """Where an event comes from.

    Attributes:
        time_us: when the record that brought it about was submitted, microseconds UTC; 0: no record did.
        author: who did it, by his credentials, or "relmapd" for what no caller did: the daemon itself, or a robot's
            own stream; empty: not of the log.
        journal_sequence: of that record.
        note: an operator's.
        resume_token: goes on after this event.
    """

    time_us: int
    author: str
    journal_sequence: int
    note: str
    resume_token: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapEvent(Record):
    """Something that happened to the map. Its class says what: SessionChanged, EdgeChanged, FramesAdded, ..., CaughtUp.

    Attributes:
        origin: when, by whom, and how to go on after it.
    """

    origin: EventOrigin

    @property
    def time(self) -> Optional[datetime.datetime]:
        """The time, UTC; None: it belongs to none, as CaughtUp and StorageChanged."""
        return as_datetime(self.origin.time_us) if self.origin.time_us else None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SessionChanged(MapEvent):
    """A session began, ended, was frozen or thawed, or its deletion began.

    Attributes:
        session, uuid, robot, name: which; its number, and its names.
        state: now.
    """

    session: int
    uuid: str
    robot: str
    name: str
    state: SessionState


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SessionDeleted(MapEvent):
    """The last frame of a deleted session is gone.

    Attributes:
        session, uuid: of the session.
    """

    session: int
    uuid: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EdgeChanged(MapEvent):
    """A loop closure was proposed or changed its state. Of `edge` only its ends, state, reason, transform and evidence are
    set; Client.explain_edge() has the rest."""

    edge: Edge


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EdgeRemoved(MapEvent):
    """A closure went with a deleted session."""

    edge: EdgeId


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class AddedFrame(Record):
    """A frame that was added.

    Attributes:
        frame: which.
        time_us: microseconds UTC.
        T_previous_frame: 4 x 4, relative to the frame before, as it was then; None: no motion joins it to one.
        source: of that motion.
    """

    frame: FrameId
    time_us: int
    T_previous_frame: Optional[Array]
    source: MotionSource


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FramesAdded(MapEvent):
    """Frames of any sessions, in the order in which the map took them in."""

    frames: tuple[AddedFrame, ...]


@dataclass(frozen=True, slots=True)
class FrameRange:
    """Frames of one session, from the index `first` to `last`, inclusive."""

    session: int
    first: int
    last: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FramesMoved(MapEvent):
    """Frames whose edges were changed by relaxation."""

    ranges: tuple[FrameRange, ...]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FramesRemoved(MapEvent):
    """Of a session that is being deleted: the frame with index `first` and all after it are gone."""

    session: int
    first: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FramesSkipped(MapEvent):
    """Sequences that will have no frame.

    Attributes:
        session, first, last: which, inclusive.
        reason: why.
        refused: they were refused; False: the robot gave them up.
    """

    session: int
    first: int
    last: int
    reason: Reason
    refused: bool


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LabelsChanged(MapEvent):
    """The labels of a frame changed to these."""

    frame: FrameId
    labels: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RobotChanged(MapEvent):
    """A robot appeared, fell silent, or is blocked for another reason. Not kept, so never told again."""

    robot: RobotStatus


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StorageChanged(MapEvent):
    """Whether keyframes are taken in, or why not. Told at first, and when it changes."""

    storage: Condition


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Resync(MapEvent):
    """Events were lost to this watcher: list again what you hold. The events after it are of what happens from here on.

    Attributes:
        reason, message: VIEW_EXPIRED: they were too long ago, or the watcher too slow. WRONG_MAP: it is another map.
        missed_after, missed_before: journal sequences between which they lie; 0: not known.
    """

    reason: Reason
    message: str
    missed_after: int
    missed_before: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CaughtUp(MapEvent):
    """Everything was told up to here; comes at least every 15 seconds.

    Attributes:
        committed_sequence: journal sequence up to which the map is committed.
        committed_us: when, microseconds UTC.
    """

    committed_sequence: int
    committed_us: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class UnknownEvent(MapEvent):
    """An event of a newer relmapd, that this version does not know."""


def _session_changed(o: EventOrigin, m: graph_pb2.Session) -> SessionChanged:
    return SessionChanged(o, m.number, m.uuid, m.robot, m.name, SessionState(m.state))


def _frames_added(o: EventOrigin, m: watch_pb2.FramesAdded) -> FramesAdded:
    return FramesAdded(
        o,
        tuple(
            AddedFrame(
                read_frame_id(f.frame),
                f.time_us,
                read_transform(f.previous_from_this) if f.HasField("previous_from_this") else None,
                MotionSource(f.source),
            )
            for f in m.frames
        ),
    )


_Read = Callable[[EventOrigin, watch_pb2.MapEvent], MapEvent]
_READ: dict[str, _Read] = {
    "session_changed": lambda o, e: _session_changed(o, e.session_changed),
    "edge_changed": lambda o, e: EdgeChanged(o, read_edge(e.edge_changed)),
    "frames_moved": lambda o, e: FramesMoved(
        o, tuple(FrameRange(r.session, r.first, r.last) for r in e.frames_moved.ranges)
    ),
    "frames_added": lambda o, e: _frames_added(o, e.frames_added),
    "skipped": lambda o, e: FramesSkipped(
        o, e.skipped.session, e.skipped.first, e.skipped.last, Reason(e.skipped.reason), e.skipped.refused
    ),
    "frames_removed": lambda o, e: FramesRemoved(o, e.frames_removed.session, e.frames_removed.first),
    "session_deleted": lambda o, e: SessionDeleted(o, e.session_deleted.session, e.session_deleted.uuid),
    "edge_removed": lambda o, e: EdgeRemoved(o, read_edge_id(e.edge_removed.edge)),
    "frame_labels": lambda o, e: LabelsChanged(
        o, read_frame_id(e.frame_labels.frame), tuple(e.frame_labels.labels)
    ),
    "robot_changed": lambda o, e: RobotChanged(o, read_robot(e.robot_changed)),
    "storage_changed": lambda o, e: StorageChanged(
        o, Condition(Reason(e.storage_changed.reason), e.storage_changed.message)
    ),
    "resync": lambda o, e: Resync(
        o, Reason(e.resync.reason), e.resync.message, e.resync.missed_after, e.resync.missed_before
    ),
    "caught_up": lambda o, e: CaughtUp(o, e.caught_up.journal_sequence, e.caught_up.time_us),
}


@reads_reply
def read_event(message: watch_pb2.MapEvent) -> MapEvent:
    """The event of a message."""
    origin = EventOrigin(
        message.time_us, message.author, message.journal_sequence, message.note, message.resume_token
    )
    read = _READ.get(message.WhichOneof("event") or "")
    return read(origin, message) if read else UnknownEvent(origin)
