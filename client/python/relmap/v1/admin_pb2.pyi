from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from relmap.v1 import status_pb2 as _status_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class AuditEntry(_message.Message):
    __slots__ = ["message", "method", "outcome", "request", "request_id", "role", "seconds", "time_us", "trace_id", "who"]
    FROM_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    OUTCOME_FIELD_NUMBER: _ClassVar[int]
    REQUEST_FIELD_NUMBER: _ClassVar[int]
    REQUEST_ID_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    SECONDS_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    TRACE_ID_FIELD_NUMBER: _ClassVar[int]
    WHO_FIELD_NUMBER: _ClassVar[int]
    message: str
    method: str
    outcome: _reason_pb2.Reason
    request: str
    request_id: str
    role: str
    seconds: float
    time_us: int
    trace_id: str
    who: str
    def __init__(self, time_us: _Optional[int] = ..., who: _Optional[str] = ..., role: _Optional[str] = ..., method: _Optional[str] = ..., request: _Optional[str] = ..., request_id: _Optional[str] = ..., outcome: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ..., seconds: _Optional[float] = ..., trace_id: _Optional[str] = ..., **kwargs) -> None: ...

class BackupOutcome(_message.Message):
    __slots__ = ["bytes", "durable_sequence", "folder"]
    BYTES_FIELD_NUMBER: _ClassVar[int]
    DURABLE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    FOLDER_FIELD_NUMBER: _ClassVar[int]
    bytes: int
    durable_sequence: int
    folder: str
    def __init__(self, folder: _Optional[str] = ..., bytes: _Optional[int] = ..., durable_sequence: _Optional[int] = ...) -> None: ...

class BackupRequest(_message.Message):
    __slots__ = ["folder"]
    FOLDER_FIELD_NUMBER: _ClassVar[int]
    folder: str
    def __init__(self, folder: _Optional[str] = ...) -> None: ...

class CommitReply(_message.Message):
    __slots__ = ["applied_sequence"]
    APPLIED_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    applied_sequence: int
    def __init__(self, applied_sequence: _Optional[int] = ...) -> None: ...

class CommitRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class CompactOutcome(_message.Message):
    __slots__ = ["bytes_after", "bytes_before"]
    BYTES_AFTER_FIELD_NUMBER: _ClassVar[int]
    BYTES_BEFORE_FIELD_NUMBER: _ClassVar[int]
    bytes_after: int
    bytes_before: int
    def __init__(self, bytes_before: _Optional[int] = ..., bytes_after: _Optional[int] = ...) -> None: ...

class CompactRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class DeleteSessionRequest(_message.Message):
    __slots__ = ["idempotency_key", "session", "uuid"]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    UUID_FIELD_NUMBER: _ClassVar[int]
    idempotency_key: str
    session: int
    uuid: str
    def __init__(self, session: _Optional[int] = ..., uuid: _Optional[str] = ..., idempotency_key: _Optional[str] = ...) -> None: ...

class EngineProperty(_message.Message):
    __slots__ = ["name", "value"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    name: str
    value: str
    def __init__(self, name: _Optional[str] = ..., value: _Optional[str] = ...) -> None: ...

class Finding(_message.Message):
    __slots__ = ["frame", "message", "reason", "repaired"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REPAIRED_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    message: str
    reason: _reason_pb2.Reason
    repaired: bool
    def __init__(self, reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., message: _Optional[str] = ..., repaired: bool = ...) -> None: ...

class FreezeSessionReply(_message.Message):
    __slots__ = ["map_version"]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    map_version: int
    def __init__(self, map_version: _Optional[int] = ...) -> None: ...

class FreezeSessionRequest(_message.Message):
    __slots__ = ["frozen", "idempotency_key", "session"]
    FROZEN_FIELD_NUMBER: _ClassVar[int]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    frozen: bool
    idempotency_key: str
    session: int
    def __init__(self, session: _Optional[int] = ..., frozen: bool = ..., idempotency_key: _Optional[str] = ...) -> None: ...

class GetStatsReply(_message.Message):
    __slots__ = ["blob_bytes", "disk_bytes", "dropped", "edges", "garbage_bytes", "journal_bytes", "journal_records", "landmarks", "map_bytes", "observations", "properties", "status"]
    BLOB_BYTES_FIELD_NUMBER: _ClassVar[int]
    DISK_BYTES_FIELD_NUMBER: _ClassVar[int]
    DROPPED_FIELD_NUMBER: _ClassVar[int]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    GARBAGE_BYTES_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_BYTES_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_RECORDS_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    MAP_BYTES_FIELD_NUMBER: _ClassVar[int]
    OBSERVATIONS_FIELD_NUMBER: _ClassVar[int]
    PROPERTIES_FIELD_NUMBER: _ClassVar[int]
    STATUS_FIELD_NUMBER: _ClassVar[int]
    blob_bytes: int
    disk_bytes: int
    dropped: str
    edges: int
    garbage_bytes: int
    journal_bytes: int
    journal_records: int
    landmarks: int
    map_bytes: int
    observations: int
    properties: _containers.RepeatedCompositeFieldContainer[EngineProperty]
    status: _status_pb2.GetStatusReply
    def __init__(self, disk_bytes: _Optional[int] = ..., journal_bytes: _Optional[int] = ..., journal_records: _Optional[int] = ..., observations: _Optional[int] = ..., landmarks: _Optional[int] = ..., edges: _Optional[int] = ..., properties: _Optional[_Iterable[_Union[EngineProperty, _Mapping]]] = ..., status: _Optional[_Union[_status_pb2.GetStatusReply, _Mapping]] = ..., map_bytes: _Optional[int] = ..., blob_bytes: _Optional[int] = ..., garbage_bytes: _Optional[int] = ..., dropped: _Optional[str] = ...) -> None: ...

class GetStatsRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class ListAuditReply(_message.Message):
    __slots__ = ["entries", "next_page_token", "unreadable"]
    ENTRIES_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    UNREADABLE_FIELD_NUMBER: _ClassVar[int]
    entries: _containers.RepeatedCompositeFieldContainer[AuditEntry]
    next_page_token: str
    unreadable: int
    def __init__(self, entries: _Optional[_Iterable[_Union[AuditEntry, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., unreadable: _Optional[int] = ...) -> None: ...

class ListAuditRequest(_message.Message):
    __slots__ = ["failed", "from_us", "method", "page_size", "page_token", "until_us", "who"]
    FAILED_FIELD_NUMBER: _ClassVar[int]
    FROM_US_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    UNTIL_US_FIELD_NUMBER: _ClassVar[int]
    WHO_FIELD_NUMBER: _ClassVar[int]
    failed: bool
    from_us: int
    method: str
    page_size: int
    page_token: str
    until_us: int
    who: str
    def __init__(self, from_us: _Optional[int] = ..., until_us: _Optional[int] = ..., who: _Optional[str] = ..., method: _Optional[str] = ..., failed: bool = ..., page_size: _Optional[int] = ..., page_token: _Optional[str] = ...) -> None: ...

class Progress(_message.Message):
    __slots__ = ["backup", "compact", "done", "step", "total", "unit"]
    BACKUP_FIELD_NUMBER: _ClassVar[int]
    COMPACT_FIELD_NUMBER: _ClassVar[int]
    DONE_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    TOTAL_FIELD_NUMBER: _ClassVar[int]
    UNIT_FIELD_NUMBER: _ClassVar[int]
    backup: BackupOutcome
    compact: CompactOutcome
    done: int
    step: str
    total: int
    unit: str
    def __init__(self, step: _Optional[str] = ..., done: _Optional[int] = ..., total: _Optional[int] = ..., unit: _Optional[str] = ..., backup: _Optional[_Union[BackupOutcome, _Mapping]] = ..., compact: _Optional[_Union[CompactOutcome, _Mapping]] = ...) -> None: ...

class ReindexRequest(_message.Message):
    __slots__ = ["idempotency_key", "vocabulary"]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    VOCABULARY_FIELD_NUMBER: _ClassVar[int]
    idempotency_key: str
    vocabulary: str
    def __init__(self, vocabulary: _Optional[str] = ..., idempotency_key: _Optional[str] = ...) -> None: ...

class RepairRequest(_message.Message):
    __slots__ = ["idempotency_key", "sessions"]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    idempotency_key: str
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, sessions: _Optional[_Iterable[int]] = ..., idempotency_key: _Optional[str] = ...) -> None: ...

class SetLogLevelReply(_message.Message):
    __slots__ = ["former", "level"]
    FORMER_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    former: str
    level: str
    def __init__(self, level: _Optional[str] = ..., former: _Optional[str] = ...) -> None: ...

class SetLogLevelRequest(_message.Message):
    __slots__ = ["level"]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    level: str
    def __init__(self, level: _Optional[str] = ...) -> None: ...

class VerifyReply(_message.Message):
    __slots__ = ["findings", "progress", "summary"]
    FINDINGS_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    findings: _containers.RepeatedCompositeFieldContainer[Finding]
    progress: Progress
    summary: VerifySummary
    def __init__(self, progress: _Optional[_Union[Progress, _Mapping]] = ..., findings: _Optional[_Iterable[_Union[Finding, _Mapping]]] = ..., summary: _Optional[_Union[VerifySummary, _Mapping]] = ...) -> None: ...

class VerifyRequest(_message.Message):
    __slots__ = ["sessions"]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, sessions: _Optional[_Iterable[int]] = ...) -> None: ...

class VerifySummary(_message.Message):
    __slots__ = ["edges", "features", "findings", "frames", "journal_records", "landmarks", "observations", "sessions"]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    FINDINGS_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_RECORDS_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    OBSERVATIONS_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    edges: int
    features: int
    findings: int
    frames: int
    journal_records: int
    landmarks: int
    observations: int
    sessions: int
    def __init__(self, sessions: _Optional[int] = ..., frames: _Optional[int] = ..., edges: _Optional[int] = ..., landmarks: _Optional[int] = ..., observations: _Optional[int] = ..., features: _Optional[int] = ..., journal_records: _Optional[int] = ..., findings: _Optional[int] = ...) -> None: ...

class WaitIdleReply(_message.Message):
    __slots__ = ["applied_sequence", "map_version"]
    APPLIED_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    applied_sequence: int
    map_version: int
    def __init__(self, applied_sequence: _Optional[int] = ..., map_version: _Optional[int] = ...) -> None: ...

class WaitIdleRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...
