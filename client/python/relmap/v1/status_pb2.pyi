from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Component(_message.Message):
    __slots__ = ["message", "name", "reason"]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    message: str
    name: str
    reason: _reason_pb2.Reason
    def __init__(self, name: _Optional[str] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class ConnectionCounts(_message.Message):
    __slots__ = ["displaced", "limit", "message", "open", "reason", "refused"]
    DISPLACED_FIELD_NUMBER: _ClassVar[int]
    LIMIT_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    OPEN_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    displaced: int
    limit: int
    message: str
    open: int
    reason: _reason_pb2.Reason
    refused: int
    def __init__(self, open: _Optional[int] = ..., limit: _Optional[int] = ..., refused: _Optional[int] = ..., displaced: _Optional[int] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class DoubtfulCamera(_message.Message):
    __slots__ = ["against", "contradicted", "message", "name", "robot", "session"]
    AGAINST_FIELD_NUMBER: _ClassVar[int]
    CONTRADICTED_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    against: _containers.RepeatedScalarFieldContainer[int]
    contradicted: int
    message: str
    name: str
    robot: str
    session: int
    def __init__(self, session: _Optional[int] = ..., robot: _Optional[str] = ..., name: _Optional[str] = ..., against: _Optional[_Iterable[int]] = ..., contradicted: _Optional[int] = ..., message: _Optional[str] = ...) -> None: ...

class EdgeCounts(_message.Message):
    __slots__ = ["accepted", "candidate", "quarantined", "removed"]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    CANDIDATE_FIELD_NUMBER: _ClassVar[int]
    QUARANTINED_FIELD_NUMBER: _ClassVar[int]
    REMOVED_FIELD_NUMBER: _ClassVar[int]
    accepted: int
    candidate: int
    quarantined: int
    removed: int
    def __init__(self, candidate: _Optional[int] = ..., accepted: _Optional[int] = ..., quarantined: _Optional[int] = ..., removed: _Optional[int] = ...) -> None: ...

class GetStatusReply(_message.Message):
    __slots__ = ["access_message", "access_reason", "active_frames_mean", "applied_sequence", "boot_id", "caller_name", "caller_role", "certificate_message", "certificate_reason", "clock_steps", "commit", "components", "connections", "data_folder", "deterministic", "doubtful_cameras", "durable_sequence", "frames", "gaps", "ingest", "labels", "last_clock_step_s", "lcm_message", "lcm_reason", "lcm_url", "log_level", "lookup_lag", "lookup_lag_s", "loop_closures", "map_epoch", "map_uuid", "map_version", "memory_budget", "memory_shares", "memory_used", "methods", "numerical_failures", "pending_frames", "pid", "places", "places_left_out", "protocol", "queued", "refused", "refused_by_reason", "relaxation", "resident_bytes", "resident_max_bytes", "route_cells", "sessions", "solves", "storage_message", "storage_reason", "time_us", "uptime_us", "version", "vocabulary_crc32c", "vocabulary_source", "vocabulary_words"]
    ACCESS_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    ACCESS_REASON_FIELD_NUMBER: _ClassVar[int]
    ACTIVE_FRAMES_MEAN_FIELD_NUMBER: _ClassVar[int]
    APPLIED_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    BOOT_ID_FIELD_NUMBER: _ClassVar[int]
    CALLER_NAME_FIELD_NUMBER: _ClassVar[int]
    CALLER_ROLE_FIELD_NUMBER: _ClassVar[int]
    CERTIFICATE_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    CERTIFICATE_REASON_FIELD_NUMBER: _ClassVar[int]
    CLOCK_STEPS_FIELD_NUMBER: _ClassVar[int]
    COMMIT_FIELD_NUMBER: _ClassVar[int]
    COMPONENTS_FIELD_NUMBER: _ClassVar[int]
    CONNECTIONS_FIELD_NUMBER: _ClassVar[int]
    DATA_FOLDER_FIELD_NUMBER: _ClassVar[int]
    DETERMINISTIC_FIELD_NUMBER: _ClassVar[int]
    DOUBTFUL_CAMERAS_FIELD_NUMBER: _ClassVar[int]
    DURABLE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    GAPS_FIELD_NUMBER: _ClassVar[int]
    INGEST_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    LAST_CLOCK_STEP_S_FIELD_NUMBER: _ClassVar[int]
    LCM_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    LCM_REASON_FIELD_NUMBER: _ClassVar[int]
    LCM_URL_FIELD_NUMBER: _ClassVar[int]
    LOG_LEVEL_FIELD_NUMBER: _ClassVar[int]
    LOOKUP_LAG_FIELD_NUMBER: _ClassVar[int]
    LOOKUP_LAG_S_FIELD_NUMBER: _ClassVar[int]
    LOOP_CLOSURES_FIELD_NUMBER: _ClassVar[int]
    MAP_EPOCH_FIELD_NUMBER: _ClassVar[int]
    MAP_UUID_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    MEMORY_BUDGET_FIELD_NUMBER: _ClassVar[int]
    MEMORY_SHARES_FIELD_NUMBER: _ClassVar[int]
    MEMORY_USED_FIELD_NUMBER: _ClassVar[int]
    METHODS_FIELD_NUMBER: _ClassVar[int]
    NUMERICAL_FAILURES_FIELD_NUMBER: _ClassVar[int]
    PENDING_FRAMES_FIELD_NUMBER: _ClassVar[int]
    PID_FIELD_NUMBER: _ClassVar[int]
    PLACES_FIELD_NUMBER: _ClassVar[int]
    PLACES_LEFT_OUT_FIELD_NUMBER: _ClassVar[int]
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    QUEUED_FIELD_NUMBER: _ClassVar[int]
    REFUSED_BY_REASON_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    RELAXATION_FIELD_NUMBER: _ClassVar[int]
    RESIDENT_BYTES_FIELD_NUMBER: _ClassVar[int]
    RESIDENT_MAX_BYTES_FIELD_NUMBER: _ClassVar[int]
    ROUTE_CELLS_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    SOLVES_FIELD_NUMBER: _ClassVar[int]
    STORAGE_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    STORAGE_REASON_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    UPTIME_US_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    VOCABULARY_CRC32C_FIELD_NUMBER: _ClassVar[int]
    VOCABULARY_SOURCE_FIELD_NUMBER: _ClassVar[int]
    VOCABULARY_WORDS_FIELD_NUMBER: _ClassVar[int]
    access_message: str
    access_reason: _reason_pb2.Reason
    active_frames_mean: float
    applied_sequence: int
    boot_id: str
    caller_name: str
    caller_role: str
    certificate_message: str
    certificate_reason: _reason_pb2.Reason
    clock_steps: int
    commit: str
    components: _containers.RepeatedCompositeFieldContainer[Component]
    connections: ConnectionCounts
    data_folder: str
    deterministic: bool
    doubtful_cameras: _containers.RepeatedCompositeFieldContainer[DoubtfulCamera]
    durable_sequence: int
    frames: int
    gaps: int
    ingest: IngestCounts
    labels: int
    last_clock_step_s: float
    lcm_message: str
    lcm_reason: _reason_pb2.Reason
    lcm_url: str
    log_level: str
    lookup_lag: int
    lookup_lag_s: float
    loop_closures: EdgeCounts
    map_epoch: int
    map_uuid: str
    map_version: int
    memory_budget: int
    memory_shares: _containers.RepeatedCompositeFieldContainer[MemoryShare]
    memory_used: int
    methods: _containers.RepeatedCompositeFieldContainer[MethodCount]
    numerical_failures: int
    pending_frames: int
    pid: int
    places: int
    places_left_out: int
    protocol: _common_pb2.ProtocolVersion
    queued: int
    refused: int
    refused_by_reason: _containers.RepeatedCompositeFieldContainer[ReasonCount]
    relaxation: Latency
    resident_bytes: int
    resident_max_bytes: int
    route_cells: RouteCells
    sessions: int
    solves: int
    storage_message: str
    storage_reason: _reason_pb2.Reason
    time_us: int
    uptime_us: int
    version: str
    vocabulary_crc32c: int
    vocabulary_source: str
    vocabulary_words: int
    def __init__(self, version: _Optional[str] = ..., boot_id: _Optional[str] = ..., protocol: _Optional[_Union[_common_pb2.ProtocolVersion, _Mapping]] = ..., pid: _Optional[int] = ..., time_us: _Optional[int] = ..., uptime_us: _Optional[int] = ..., data_folder: _Optional[str] = ..., lcm_url: _Optional[str] = ..., deterministic: bool = ..., storage_reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., storage_message: _Optional[str] = ..., map_version: _Optional[int] = ..., sessions: _Optional[int] = ..., frames: _Optional[int] = ..., gaps: _Optional[int] = ..., refused: _Optional[int] = ..., refused_by_reason: _Optional[_Iterable[_Union[ReasonCount, _Mapping]]] = ..., loop_closures: _Optional[_Union[EdgeCounts, _Mapping]] = ..., places: _Optional[int] = ..., labels: _Optional[int] = ..., durable_sequence: _Optional[int] = ..., applied_sequence: _Optional[int] = ..., queued: _Optional[int] = ..., lookup_lag: _Optional[int] = ..., lookup_lag_s: _Optional[float] = ..., pending_frames: _Optional[int] = ..., relaxation: _Optional[_Union[Latency, _Mapping]] = ..., active_frames_mean: _Optional[float] = ..., solves: _Optional[int] = ..., numerical_failures: _Optional[int] = ..., memory_budget: _Optional[int] = ..., memory_used: _Optional[int] = ..., memory_shares: _Optional[_Iterable[_Union[MemoryShare, _Mapping]]] = ..., resident_bytes: _Optional[int] = ..., resident_max_bytes: _Optional[int] = ..., vocabulary_crc32c: _Optional[int] = ..., vocabulary_words: _Optional[int] = ..., vocabulary_source: _Optional[str] = ..., ingest: _Optional[_Union[IngestCounts, _Mapping]] = ..., methods: _Optional[_Iterable[_Union[MethodCount, _Mapping]]] = ..., lcm_reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., lcm_message: _Optional[str] = ..., places_left_out: _Optional[int] = ..., route_cells: _Optional[_Union[RouteCells, _Mapping]] = ..., map_uuid: _Optional[str] = ..., map_epoch: _Optional[int] = ..., doubtful_cameras: _Optional[_Iterable[_Union[DoubtfulCamera, _Mapping]]] = ..., connections: _Optional[_Union[ConnectionCounts, _Mapping]] = ..., access_reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., access_message: _Optional[str] = ..., certificate_reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., certificate_message: _Optional[str] = ..., commit: _Optional[str] = ..., log_level: _Optional[str] = ..., components: _Optional[_Iterable[_Union[Component, _Mapping]]] = ..., clock_steps: _Optional[int] = ..., last_clock_step_s: _Optional[float] = ..., caller_name: _Optional[str] = ..., caller_role: _Optional[str] = ...) -> None: ...

class GetStatusRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class IngestCounts(_message.Message):
    __slots__ = ["acknowledgements", "incomplete", "keyframes", "not_taken", "parts", "parts_corrupt", "repeats", "robots"]
    ACKNOWLEDGEMENTS_FIELD_NUMBER: _ClassVar[int]
    INCOMPLETE_FIELD_NUMBER: _ClassVar[int]
    KEYFRAMES_FIELD_NUMBER: _ClassVar[int]
    NOT_TAKEN_FIELD_NUMBER: _ClassVar[int]
    PARTS_CORRUPT_FIELD_NUMBER: _ClassVar[int]
    PARTS_FIELD_NUMBER: _ClassVar[int]
    REPEATS_FIELD_NUMBER: _ClassVar[int]
    ROBOTS_FIELD_NUMBER: _ClassVar[int]
    acknowledgements: int
    incomplete: int
    keyframes: int
    not_taken: _containers.RepeatedCompositeFieldContainer[ReasonCount]
    parts: int
    parts_corrupt: int
    repeats: int
    robots: int
    def __init__(self, parts: _Optional[int] = ..., parts_corrupt: _Optional[int] = ..., keyframes: _Optional[int] = ..., repeats: _Optional[int] = ..., acknowledgements: _Optional[int] = ..., robots: _Optional[int] = ..., incomplete: _Optional[int] = ..., not_taken: _Optional[_Iterable[_Union[ReasonCount, _Mapping]]] = ...) -> None: ...

class Latency(_message.Message):
    __slots__ = ["max_us", "p50_us", "p99_us"]
    MAX_US_FIELD_NUMBER: _ClassVar[int]
    P50_US_FIELD_NUMBER: _ClassVar[int]
    P99_US_FIELD_NUMBER: _ClassVar[int]
    max_us: float
    p50_us: float
    p99_us: float
    def __init__(self, p50_us: _Optional[float] = ..., p99_us: _Optional[float] = ..., max_us: _Optional[float] = ...) -> None: ...

class ListRobotsReply(_message.Message):
    __slots__ = ["robots"]
    ROBOTS_FIELD_NUMBER: _ClassVar[int]
    robots: _containers.RepeatedCompositeFieldContainer[Robot]
    def __init__(self, robots: _Optional[_Iterable[_Union[Robot, _Mapping]]] = ...) -> None: ...

class ListRobotsRequest(_message.Message):
    __slots__ = []
    def __init__(self) -> None: ...

class MemoryShare(_message.Message):
    __slots__ = ["allowance", "name", "used"]
    ALLOWANCE_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    USED_FIELD_NUMBER: _ClassVar[int]
    allowance: int
    name: str
    used: int
    def __init__(self, name: _Optional[str] = ..., used: _Optional[int] = ..., allowance: _Optional[int] = ...) -> None: ...

class MethodCount(_message.Message):
    __slots__ = ["calls", "failures", "failures_by_reason", "max_us", "mean_us", "method"]
    CALLS_FIELD_NUMBER: _ClassVar[int]
    FAILURES_BY_REASON_FIELD_NUMBER: _ClassVar[int]
    FAILURES_FIELD_NUMBER: _ClassVar[int]
    MAX_US_FIELD_NUMBER: _ClassVar[int]
    MEAN_US_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    calls: int
    failures: int
    failures_by_reason: _containers.RepeatedCompositeFieldContainer[ReasonCount]
    max_us: float
    mean_us: float
    method: str
    def __init__(self, method: _Optional[str] = ..., calls: _Optional[int] = ..., failures: _Optional[int] = ..., mean_us: _Optional[float] = ..., max_us: _Optional[float] = ..., failures_by_reason: _Optional[_Iterable[_Union[ReasonCount, _Mapping]]] = ...) -> None: ...

class ReasonCount(_message.Message):
    __slots__ = ["count", "reason"]
    COUNT_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    count: int
    reason: _reason_pb2.Reason
    def __init__(self, reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., count: _Optional[int] = ...) -> None: ...

class Robot(_message.Message):
    __slots__ = ["blocked", "bytes_per_s", "credits", "dropped_messages", "incomplete", "keyframes_per_s", "lag_us", "limit_hz", "missing", "name", "next_sequence", "not_taken", "pending", "queued_messages", "refused", "robot", "same_name", "seen", "session", "silent", "silent_us", "uuid"]
    BLOCKED_FIELD_NUMBER: _ClassVar[int]
    BYTES_PER_S_FIELD_NUMBER: _ClassVar[int]
    CREDITS_FIELD_NUMBER: _ClassVar[int]
    DROPPED_MESSAGES_FIELD_NUMBER: _ClassVar[int]
    INCOMPLETE_FIELD_NUMBER: _ClassVar[int]
    KEYFRAMES_PER_S_FIELD_NUMBER: _ClassVar[int]
    LAG_US_FIELD_NUMBER: _ClassVar[int]
    LIMIT_HZ_FIELD_NUMBER: _ClassVar[int]
    MISSING_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    NEXT_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    NOT_TAKEN_FIELD_NUMBER: _ClassVar[int]
    PENDING_FIELD_NUMBER: _ClassVar[int]
    QUEUED_MESSAGES_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    SAME_NAME_FIELD_NUMBER: _ClassVar[int]
    SEEN_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SILENT_FIELD_NUMBER: _ClassVar[int]
    SILENT_US_FIELD_NUMBER: _ClassVar[int]
    UUID_FIELD_NUMBER: _ClassVar[int]
    blocked: _reason_pb2.Reason
    bytes_per_s: float
    credits: int
    dropped_messages: int
    incomplete: int
    keyframes_per_s: float
    lag_us: int
    limit_hz: float
    missing: int
    name: str
    next_sequence: int
    not_taken: _containers.RepeatedCompositeFieldContainer[ReasonCount]
    pending: int
    queued_messages: int
    refused: _containers.RepeatedCompositeFieldContainer[ReasonCount]
    robot: str
    same_name: _containers.RepeatedScalarFieldContainer[str]
    seen: int
    session: int
    silent: bool
    silent_us: int
    uuid: str
    def __init__(self, uuid: _Optional[str] = ..., session: _Optional[int] = ..., robot: _Optional[str] = ..., name: _Optional[str] = ..., keyframes_per_s: _Optional[float] = ..., bytes_per_s: _Optional[float] = ..., silent_us: _Optional[int] = ..., lag_us: _Optional[int] = ..., next_sequence: _Optional[int] = ..., seen: _Optional[int] = ..., missing: _Optional[int] = ..., incomplete: _Optional[int] = ..., pending: _Optional[int] = ..., queued_messages: _Optional[int] = ..., dropped_messages: _Optional[int] = ..., credits: _Optional[int] = ..., refused: _Optional[_Iterable[_Union[ReasonCount, _Mapping]]] = ..., not_taken: _Optional[_Iterable[_Union[ReasonCount, _Mapping]]] = ..., blocked: _Optional[_Union[_reason_pb2.Reason, str]] = ..., limit_hz: _Optional[float] = ..., same_name: _Optional[_Iterable[str]] = ..., silent: bool = ...) -> None: ...

class RouteCells(_message.Message):
    __slots__ = ["changed_chunks", "chunks", "missing_because", "outdated_cells", "weights"]
    CHANGED_CHUNKS_FIELD_NUMBER: _ClassVar[int]
    CHUNKS_FIELD_NUMBER: _ClassVar[int]
    MISSING_BECAUSE_FIELD_NUMBER: _ClassVar[int]
    OUTDATED_CELLS_FIELD_NUMBER: _ClassVar[int]
    WEIGHTS_FIELD_NUMBER: _ClassVar[int]
    changed_chunks: int
    chunks: int
    missing_because: str
    outdated_cells: int
    weights: int
    def __init__(self, missing_because: _Optional[str] = ..., weights: _Optional[int] = ..., chunks: _Optional[int] = ..., changed_chunks: _Optional[int] = ..., outdated_cells: _Optional[int] = ...) -> None: ...
