"""The robot's half of the keyframe protocol: what is sent and when, without threads and I/O (docs/protocol.md).

Every keyframe is kept until the daemon has it on disk, and sent again if a connection broke or the daemon misses it.
"""

from __future__ import annotations

import uuid as uuids
from collections import deque
from dataclasses import dataclass
from typing import Deque, Dict, List, Optional, Tuple

from relmap.errors import RobotDataError, reads_reply
from relmap.geometry import Array, read_covariance, read_transform
from relmap.ids import FrameId, read_frame_id
from relmap.reason import Reason
from relmap.record import Record
from relmap.v1 import ingest_pb2

WHOLE_SESSION = 2**32 - 1
"""The sequence of a refusal that is of the whole session."""

_SILENCE_S = 1.0  # without an acknowledgement for so long, only the oldest keyframe is sent, to hear one
_AGAIN_S = 10.0  # a keyframe that the daemon has not mentioned is sent again
_MISSING_S = 1.0  # one that it reports missing, too, but not more often than this
_UNDER_WAY_BYTES = 4 * 2**20


@dataclass(frozen=True, slots=True)
class Refusal:
    """A keyframe that the daemon will never take.

    Attributes:
        sequence: its sequence; WHOLE_SESSION: all of the session.
        reason, message: why.
    """

    sequence: int
    reason: Reason
    message: str


class KeyframesRefused(RobotDataError):
    """The daemon refused keyframes of an ingest session for good; the session goes on without them.

    Attributes:
        refusals: all that were not told before; `reason` and `message` are those of the first.
    """

    refusals: Tuple[Refusal, ...]

    def __init__(self, refusals: Tuple[Refusal, ...]) -> None:
        first = refusals[0]
        which = "the session" if first.sequence == WHOLE_SESSION else f"keyframe {first.sequence}"
        more = f" (and {len(refusals) - 1} more)" if len(refusals) > 1 else ""
        super().__init__(first.reason, f"{which}: {first.message}{more}")
        self.refusals = refusals


@dataclass(frozen=True, slots=True)
class SessionStatus:
    """What the daemon knows of a session that is received.

    Attributes:
        uuid: of the session.
        session: its number in the map; 0: it has not begun.
        next_sequence: everything below is durable, refused or given up.
        held, missing: ranges (first, last) at or above it that wait for the disk, and of which nothing was received.
        refused: the newest refusals, at most 64.
        credits: how far beyond next_sequence may be sent.
    """

    uuid: uuids.UUID
    session: int
    next_sequence: int
    held: Tuple[Tuple[int, int], ...]
    missing: Tuple[Tuple[int, int], ...]
    refused: Tuple[Refusal, ...]
    credits: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class KeyframeLocalisation(Record):
    """News: a keyframe of the session was found elsewhere in the map, or its closure is no longer in force.

    Attributes:
        keyframe: which.
        frame: where.
        T_frame_keyframe: 4 x 4, relative pose of the keyframe in that frame, metres.
        cov: 6 x 6, covariance of T_frame_keyframe exp(xi).
        withdrawn: the closure is no longer in force.
        candidate: it awaits confirmation by another keyframe.
    """

    keyframe: FrameId
    frame: FrameId
    T_frame_keyframe: Array
    cov: Array
    withdrawn: bool
    candidate: bool


@reads_reply
def read_session_status(message: ingest_pb2.Acknowledgement) -> SessionStatus:
    """What an acknowledgement says. DaemonError: CORRUPT: it makes no sense."""
    return SessionStatus(
        uuids.UUID(bytes=message.session_uuid),
        message.session,
        message.next_sequence,
        tuple((r.first, r.last) for r in message.held),
        tuple((r.first, r.last) for r in message.missing),
        tuple(Refusal(r.sequence, Reason(r.reason), r.message) for r in message.refused),
        message.credits,
    )


def read_keyframe_localisation(message: ingest_pb2.Localisation) -> KeyframeLocalisation:
    """The news of a message. ValueError: it makes no sense."""
    return KeyframeLocalisation(
        FrameId(message.session, message.sequence),
        read_frame_id(message.frame),
        read_transform(message.frame_from_keyframe),
        read_covariance(message.covariance),
        message.withdrawn,
        message.candidate,
    )


@dataclass
class _Item:
    request: ingest_pb2.IngestRequest
    last: int  # of a gap; of a keyframe its sequence
    size: int
    sent_at: Optional[float] = None
    held: bool = False

    @property
    def under_way(self) -> int:
        return self.size if self.sent_at is not None and not self.held else 0


class IngestCore:
    """What is to be sent of one session. Not thread-safe; times are seconds of a monotonic clock."""

    def __init__(self, uuid: uuids.UUID) -> None:
        self._uuid = uuid.bytes
        self._items: Dict[int, _Item] = {}  # ascending by sequence
        self._unsent: Deque[int] = deque()
        self._next = 0
        self._acknowledged = 0
        self._send_end = 0
        self._bytes = 0
        self._under_way = 0  # bytes that were sent, and that the daemon does not have yet
        self._looked_at = 0.0
        self._welcomed = False
        self._map: Optional[Tuple[bytes, int]] = None  # of the daemon that has acknowledged something
        self._welcomed_map: Optional[Tuple[bytes, int]] = None
        self._first_of_stream = False
        self._heard_at: Optional[float] = None
        self._refused: Dict[int, Refusal] = {}
        self._told = 0
        self.session = 0
        """The session's number in the map; 0: not known yet."""

    @property
    def next_sequence(self) -> int:
        """The sequence of the next keyframe."""
        return self._next

    @property
    def settled_sequence(self) -> int:
        """Everything below is durable, refused or given up."""
        return self._acknowledged

    @property
    def unsettled_bytes(self) -> int:
        """Bytes of keyframes that are kept since they are not durable yet."""
        return self._bytes

    @property
    def all_settled(self) -> bool:
        """Whether nothing is kept."""
        return not self._items

    def begin_at(self, sequence: int) -> None:
        """Continues a session of which everything below `sequence` is settled. Before the first keyframe."""
        self._next = self._acknowledged = sequence

    def add_keyframe(self, sequence: int, crc: int, payload: bytes) -> None:
        """Takes a keyframe. ValueError: its sequence was passed. Sequences that are skipped are given up as a gap."""
        if sequence < self._next:
            raise ValueError(f"keyframe {sequence} after {self._next - 1}: sequences ascend")
        if sequence > self._next:
            self.give_up(self._next, sequence - 1, Reason.CAPTURE_FAILED)
        keyframe = ingest_pb2.KeyframePayload(
            session_uuid=self._uuid, sequence=sequence, crc32c=crc, payload=payload
        )
        self._put(sequence, sequence, ingest_pb2.IngestRequest(keyframe=keyframe), len(payload))
        self._next = sequence + 1

    def give_up(self, first: int, last: int, reason: Reason = Reason.DROPPED_BY_ROBOT) -> None:
        """Gives up the sequences first..last, which must follow what was added. ValueError: they do not."""
        if first != self._next or last < first:
            raise ValueError(f"a gap {first}..{last}; the next sequence is {self._next}")
        gap = ingest_pb2.Gap(session_uuid=self._uuid, first=first, last=last, reason=int(reason))  # type: ignore[arg-type]
        self._put(first, last, ingest_pb2.IngestRequest(gap=gap), 0)
        self._next = last + 1

    def welcome(self, message: ingest_pb2.Welcome) -> Optional[str]:
        """A daemon introduced itself. Returns why nothing may be sent to it; None: it may."""
        if message.protocol.major != 1:
            return f"the daemon has protocol {message.protocol.major}.{message.protocol.minor}; this is 1.0"
        served = (message.map_uuid, message.map_epoch)
        if message.map_uuid and self._map and self._map[0] and self._map[0] != message.map_uuid:
            return "the daemon serves another map than the one in which the session began"
        self._welcomed, self._first_of_stream, self._heard_at = True, True, None
        self._welcomed_map = served
        self._send_all_again()
        return None

    def broken(self) -> None:
        """The stream ended: what was sent may be lost."""
        self._welcomed = False

    def acknowledge(self, message: ingest_pb2.Acknowledgement, now: float) -> bool:
        """Takes in an acknowledgement; returns whether more than before is settled."""
        if message.session_uuid != self._uuid:
            return False
        if message.next_sequence < self._acknowledged:
            if not self._first_of_stream:
                return False  # a newer one overtook it
            self._fill_hole(message.next_sequence)
        self._first_of_stream = False
        self._map = self._welcomed_map
        self._heard_at = now
        self.session = message.session or self.session
        for refusal in message.refused:
            self._refuse(Refusal(refusal.sequence, Reason(refusal.reason), refusal.message))
        progress = message.next_sequence > self._acknowledged
        self._acknowledged = message.next_sequence
        self._send_end = message.next_sequence + message.credits
        while self._items and next(iter(self._items.values())).last < self._acknowledged:
            self._drop(next(iter(self._items)))
        for held in message.held:
            for sequence in range(held.first, min(held.last, self._next) + 1):
                item = self._items.get(sequence)
                if item is not None and not item.held:
                    self._under_way -= item.under_way
                    item.held = True
        self._send_missing(message, now)
        return progress

    def take_refusals(self) -> Tuple[Refusal, ...]:
        """Refusals that were not taken before."""
        new = tuple(self._refused.values())[self._told :]
        self._told = len(self._refused)
        return new

    def poll(self, now: float) -> List[ingest_pb2.IngestRequest]:
        """What is to be sent now."""
        if not self._welcomed or not self._items:
            return []
        if self._heard_at is None or now - self._heard_at >= _SILENCE_S:
            return self._probe(now)
        sends = []
        while self._unsent and self._unsent[0] < self._send_end and self._under_way < _UNDER_WAY_BYTES:
            item = self._items.get(self._unsent.popleft())
            if item is not None and not item.held and item.sent_at is None:
                self._mark_sent(item, now)
                sends.append(item.request)
        return sends

    def end(self) -> ingest_pb2.IngestRequest:
        """Says that the session has no more keyframes for now."""
        return ingest_pb2.IngestRequest(
            end=ingest_pb2.SessionEnd(session_uuid=self._uuid, next_sequence=self._next)
        )

    def _put(self, first: int, last: int, request: ingest_pb2.IngestRequest, size: int) -> None:
        self._items[first] = _Item(request, last, size)
        self._unsent.append(first)
        self._bytes += size

    def _drop(self, sequence: int) -> None:
        item = self._items.pop(sequence)
        self._bytes -= item.size
        self._under_way -= item.under_way

    def _mark_sent(self, item: _Item, now: float) -> None:
        self._under_way -= item.under_way
        item.sent_at = now
        self._under_way += item.under_way

    def _refuse(self, refusal: Refusal) -> None:
        self._refused.setdefault(refusal.sequence, refusal)

    def _fill_hole(self, next_sequence: int) -> None:
        """The map was restored from a backup: what it lost, and is no longer kept here, is given up."""
        lowest = min(self._items, default=self._next)
        if next_sequence < lowest:
            kept = self._items
            self._items = {}
            gap = ingest_pb2.Gap(
                session_uuid=self._uuid, first=next_sequence, last=lowest - 1, reason=int(Reason.MAP_RESTORED)  # type: ignore[arg-type]
            )
            self._items[next_sequence] = _Item(ingest_pb2.IngestRequest(gap=gap), lowest - 1, 0)
            self._items.update(kept)
        self._send_all_again()

    def _send_all_again(self) -> None:
        for item in self._items.values():
            item.held, item.sent_at = False, None
        self._under_way = 0
        self._unsent = deque(self._items)

    def _send_missing(self, message: ingest_pb2.Acknowledgement, now: float) -> None:
        again = []
        for missing in message.missing:
            for sequence in range(missing.first, min(missing.last, self._next) + 1):
                item = self._items.get(sequence)
                if item is not None and item.sent_at is not None and now - item.sent_at > _MISSING_S:
                    again.append(sequence)
        if now - self._looked_at > _MISSING_S:
            self._looked_at = now
            for sequence, item in self._items.items():
                if item.sent_at is not None and not item.held and now - item.sent_at > _AGAIN_S:
                    again.append(sequence)
        for sequence in sorted(set(again), reverse=True):
            item = self._items[sequence]
            self._under_way -= item.under_way
            item.sent_at = None
            self._unsent.appendleft(sequence)

    def _probe(self, now: float) -> List[ingest_pb2.IngestRequest]:
        item = next(iter(self._items.values()))
        if item.sent_at is not None and now - item.sent_at < _SILENCE_S:
            return []
        self._mark_sent(item, now)
        return [item.request]
