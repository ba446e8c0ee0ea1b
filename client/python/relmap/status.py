"""The status of the daemon and of its robots, as operators see it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence

from relmap.errors import reads_reply
from relmap.reason import Reason
from relmap.tables import Table
from relmap.v1 import status_pb2


@dataclass(frozen=True, slots=True)
class Condition:
    """The state of a part of the daemon: OK, or what is wrong with it."""

    reason: Reason
    message: str

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return self.reason == Reason.OK


@dataclass(frozen=True, slots=True)
class DoubtfulCamera:
    """A session whose calibration contradicts that of others where their pictures show the same places.

    Attributes:
        session, robot, name: the session.
        against: sessions that it contradicts.
        contradicted: keyframes that show it, since the daemon started.
        message: the calibration that would fit.
    """

    session: int
    robot: str
    name: str
    against: tuple[int, ...]
    contradicted: int
    message: str


@dataclass(frozen=True, slots=True)
class MethodCount:
    """Calls of a method since the daemon started.

    Attributes:
        method: "Map.Localise".
        calls, failures: numbers.
        mean_us, max_us: microseconds.
        failures_by_reason: numbers by reason.
    """

    method: str
    calls: int
    failures: int
    mean_us: float
    max_us: float
    failures_by_reason: Mapping[Reason, int]


@dataclass(frozen=True, slots=True)
class DaemonStatus:
    """The status of the daemon; relmap/v1/status.proto has what is not here, in `message`.

    Attributes:
        version, commit: of relmapd.
        boot_id: new at every start.
        pid, uptime_us, data_folder, log_level, deterministic: of the process.
        caller_name, caller_role: of who asks: the name in the credentials, and reader, robot or operator.
        storage, lcm, access, certificate, connections: conditions of its parts.
        components: conditions of storage, worker and intake.
        map_uuid, map_epoch: which map it serves.
        map_version: of now.
        sessions, frames, gaps, labels: what the map holds.
        refused: keyframes refused for good; refused_by_reason: the same by reason.
        closures_candidate, closures_accepted, closures_quarantined, closures_removed: numbers of closures.
        places, places_left_out: frames that can be recognised, and those for which there was no room.
        durable_sequence, applied_sequence, queued: the journal.
        lookup_lag, lookup_lag_s: keyframes that wait to be looked up, and for how long the first has.
        pending_frames: waiting for relaxation.
        memory_budget, memory_used, resident_bytes: bytes.
        doubtful_cameras: sessions whose calibration seems wrong.
        methods: calls by method.
        message: the whole message, relmap.v1.status_pb2.GetStatusReply.
    """

    version: str
    commit: str
    boot_id: str
    pid: int
    uptime_us: int
    data_folder: str
    log_level: str
    caller_name: str
    caller_role: str
    deterministic: bool
    storage: Condition
    lcm: Condition
    access: Condition
    certificate: Condition
    connections: Condition
    components: Mapping[str, Condition]
    map_uuid: str
    map_epoch: int
    map_version: int
    sessions: int
    frames: int
    gaps: int
    labels: int
    refused: int
    refused_by_reason: Mapping[Reason, int]
    closures_candidate: int
    closures_accepted: int
    closures_quarantined: int
    closures_removed: int
    places: int
    places_left_out: int
    durable_sequence: int
    applied_sequence: int
    queued: int
    lookup_lag: int
    lookup_lag_s: float
    pending_frames: int
    memory_budget: int
    memory_used: int
    resident_bytes: int
    doubtful_cameras: tuple[DoubtfulCamera, ...]
    methods: tuple[MethodCount, ...]
    message: status_pb2.GetStatusReply


@dataclass(frozen=True, slots=True)
class RobotStatus:
    """A session that is being received, or fell silent within ten minutes. Counts are since the daemon first heard of it.

    Attributes:
        uuid, session, robot, name: the session; its number is 0 while it has not begun.
        keyframes_per_s, bytes_per_s: over the last ten seconds.
        silent_s: since the last message from it.
        lag_s: from the time stamp of its newest durable keyframe until it was durable; None: none is.
        next_sequence: everything below is settled.
        seen: 1 + the highest sequence of which anything was received.
        missing, incomplete, pending: sequences between the two.
        credits: how far ahead it may send.
        refused, not_taken: numbers by reason.
        blocked: OK, or why nothing of it is written now.
        limit_hz: keyframes a second that it may send; 0: no limit.
        same_name: uuids of sessions that other robots of the same name send now.
        silent: nothing was received for a minute, though its session has not ended.
    """

    uuid: str
    session: int
    robot: str
    name: str
    keyframes_per_s: float
    bytes_per_s: float
    silent_s: float
    lag_s: Optional[float]
    next_sequence: int
    seen: int
    missing: int
    incomplete: int
    pending: int
    credits: int
    refused: Mapping[Reason, int]
    not_taken: Mapping[Reason, int]
    blocked: Reason
    limit_hz: float
    same_name: tuple[str, ...]
    silent: bool


def _robot_row(robot: RobotStatus) -> Mapping[str, Any]:
    return {name: getattr(robot, name) for name in Robots.columns()[:-1]} | {"blocked": robot.blocked.name}


class Robots(Table[RobotStatus]):
    """Sessions that are being received, by robot and session."""

    row = staticmethod(_robot_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return "robot name session keyframes_per_s silent_s lag_s next_sequence seen missing silent blocked".split()


def _counts(messages: Sequence[status_pb2.ReasonCount]) -> Mapping[Reason, int]:
    return {Reason(m.reason): m.count for m in messages}


@reads_reply
def read_robot(message: status_pb2.Robot) -> RobotStatus:
    """The robot of a message."""
    return RobotStatus(
        uuid=message.uuid,
        session=message.session,
        robot=message.robot,
        name=message.name,
        keyframes_per_s=message.keyframes_per_s,
        bytes_per_s=message.bytes_per_s,
        silent_s=message.silent_us / 1e6,
        lag_s=message.lag_us / 1e6 if message.lag_us >= 0 else None,
        next_sequence=message.next_sequence,
        seen=message.seen,
        missing=message.missing,
        incomplete=message.incomplete,
        pending=message.pending,
        credits=message.credits,
        refused=_counts(message.refused),
        not_taken=_counts(message.not_taken),
        blocked=Reason(message.blocked),
        limit_hz=message.limit_hz,
        same_name=tuple(message.same_name),
        silent=message.silent,
    )


@reads_reply
def read_status(m: status_pb2.GetStatusReply) -> DaemonStatus:
    """The status of a message."""
    return DaemonStatus(
        version=m.version,
        commit=m.commit,
        boot_id=m.boot_id,
        pid=m.pid,
        uptime_us=m.uptime_us,
        data_folder=m.data_folder,
        log_level=m.log_level,
        caller_name=m.caller_name,
        caller_role=m.caller_role,
        deterministic=m.deterministic,
        storage=Condition(Reason(m.storage_reason), m.storage_message),
        lcm=Condition(Reason(m.lcm_reason), m.lcm_message),
        access=Condition(Reason(m.access_reason), m.access_message),
        certificate=Condition(Reason(m.certificate_reason), m.certificate_message),
        connections=Condition(Reason(m.connections.reason), m.connections.message),
        components={c.name: Condition(Reason(c.reason), c.message) for c in m.components},
        map_uuid=m.map_uuid,
        map_epoch=m.map_epoch,
        map_version=m.map_version,
        sessions=m.sessions,
        frames=m.frames,
        gaps=m.gaps,
        labels=m.labels,
        refused=m.refused,
        refused_by_reason=_counts(m.refused_by_reason),
        closures_candidate=m.loop_closures.candidate,
        closures_accepted=m.loop_closures.accepted,
        closures_quarantined=m.loop_closures.quarantined,
        closures_removed=m.loop_closures.removed,
        places=m.places,
        places_left_out=m.places_left_out,
        durable_sequence=m.durable_sequence,
        applied_sequence=m.applied_sequence,
        queued=m.queued,
        lookup_lag=m.lookup_lag,
        lookup_lag_s=m.lookup_lag_s,
        pending_frames=m.pending_frames,
        memory_budget=m.memory_budget,
        memory_used=m.memory_used,
        resident_bytes=m.resident_bytes,
        doubtful_cameras=tuple(
            DoubtfulCamera(c.session, c.robot, c.name, tuple(c.against), c.contradicted, c.message)
            for c in m.doubtful_cameras
        ),
        methods=tuple(
            MethodCount(c.method, c.calls, c.failures, c.mean_us, c.max_us, _counts(c.failures_by_reason))
            for c in m.methods
        ),
        message=m,
    )
