"""Results of an operator's calls: verify, backup, compact, stats, the audit log."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Any, Callable, Mapping, Optional, Sequence

from relmap.errors import reads_reply
from relmap.ids import FrameId, read_frame_id
from relmap.reason import Reason
from relmap.status import DaemonStatus, read_status
from relmap.tables import Table
from relmap.times import as_datetime
from relmap.v1 import admin_pb2


@dataclass(frozen=True, slots=True)
class Progress:
    """How far long work has come.

    Attributes:
        step: what is being done, for display.
        done, total: in `unit`; total 0: not known.
        unit: "frames", "bytes".
    """

    step: str
    done: int
    total: int
    unit: str


OnProgress = Callable[[Progress], None]
"""Called several times a second during long work. If it raises, the work ends."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Damage that verify found.

    Attributes:
        reason, message: what is wrong.
        frame: where; None: it is not about one frame.
    """

    reason: Reason
    message: str
    frame: Optional[FrameId]


@dataclass(frozen=True, slots=True)
class VerifySummary:
    """What verify checked, and what it found.

    Attributes:
        sessions, frames, edges, landmarks, observations, features, journal_records: numbers checked.
        findings: what is wrong; empty: the map is sound.
    """

    sessions: int
    frames: int
    edges: int
    landmarks: int
    observations: int
    features: int
    journal_records: int
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class Backup:
    """A backup that is complete.

    Attributes:
        folder: on the daemon's machine.
        bytes: of its files.
        durable_sequence: it contains the journal up to and including this sequence.
    """

    folder: str
    bytes: int
    durable_sequence: int


@dataclass(frozen=True, slots=True)
class Compaction:
    """Bytes on disk before and after, without the journal."""

    bytes_before: int
    bytes_after: int


@dataclass(frozen=True, slots=True)
class StoreStats:
    """Sizes on disk, bytes.

    Attributes:
        map_bytes, blob_bytes, garbage_bytes: the map; blobs are a part of it, and garbage, which compact frees, of these.
        journal_bytes, journal_records: the journal.
        dropped: what the daemon cut off the journal when it started, in words.
        properties: of the storage engine.
        status: of the daemon.
    """

    map_bytes: int
    blob_bytes: int
    garbage_bytes: int
    journal_bytes: int
    journal_records: int
    dropped: str
    properties: Mapping[str, str]
    status: DaemonStatus


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """What an operator did or tried.

    Attributes:
        time_us: microseconds UTC.
        who, role, address: the caller; who is empty if he was not known.
        method, request: what, and the request in protobuf's text format.
        request_id, trace_id: as in the daemon's log.
        outcome, message: OK, or why it failed.
        seconds: how long it took.
    """

    time_us: int
    who: str
    role: str
    address: str
    method: str
    request: str
    request_id: str
    trace_id: str
    outcome: Reason
    message: str
    seconds: float

    @property
    def time(self) -> datetime.datetime:
        """The time, UTC."""
        return as_datetime(self.time_us)


def _audit_row(entry: AuditEntry) -> Mapping[str, Any]:
    row = {name: getattr(entry, name) for name in AuditLog.columns()[:-1]}
    row["outcome"] = entry.outcome.name
    return row


class AuditLog(Table[AuditEntry]):
    """What operators did and tried, the newest first."""

    row = staticmethod(_audit_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return "time_us who role address method request message seconds outcome".split()


@reads_reply
def read_progress(message: admin_pb2.Progress) -> Progress:
    """The progress of a message."""
    return Progress(message.step, message.done, message.total, message.unit)


@reads_reply
def read_finding(message: admin_pb2.Finding) -> Finding:
    """The finding of a message."""
    frame = read_frame_id(message.frame) if message.frame.session else None
    return Finding(Reason(message.reason), message.message, frame)


@reads_reply
def read_verify_summary(message: admin_pb2.VerifySummary, findings: tuple[Finding, ...]) -> VerifySummary:
    """The summary of a message, with the findings that came before it."""
    return VerifySummary(
        message.sessions,
        message.frames,
        message.edges,
        message.landmarks,
        message.observations,
        message.features,
        message.journal_records,
        findings,
    )


@reads_reply
def read_stats(message: admin_pb2.GetStatsReply) -> StoreStats:
    """The sizes of a message."""
    return StoreStats(
        message.map_bytes,
        message.blob_bytes,
        message.garbage_bytes,
        message.journal_bytes,
        message.journal_records,
        message.dropped,
        {p.name: p.value for p in message.properties},
        read_status(message.status),
    )


@reads_reply
def read_audit_entry(message: admin_pb2.AuditEntry) -> AuditEntry:
    """The entry of a message."""
    return AuditEntry(
        message.time_us,
        message.who,
        message.role,
        getattr(message, "from"),
        message.method,
        message.request,
        message.request_id,
        message.trace_id,
        Reason(message.outcome),
        message.message,
        message.seconds,
    )
