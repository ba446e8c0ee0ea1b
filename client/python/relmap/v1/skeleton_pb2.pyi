from relmap.v1 import graph_pb2 as _graph_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class GetSkeletonReply(_message.Message):
    __slots__ = ["chains", "closures", "commit_number", "frames_done", "frames_total", "map_version", "resume_token"]
    CHAINS_FIELD_NUMBER: _ClassVar[int]
    CLOSURES_FIELD_NUMBER: _ClassVar[int]
    COMMIT_NUMBER_FIELD_NUMBER: _ClassVar[int]
    FRAMES_DONE_FIELD_NUMBER: _ClassVar[int]
    FRAMES_TOTAL_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    chains: _containers.RepeatedCompositeFieldContainer[SkeletonChain]
    closures: SkeletonClosures
    commit_number: int
    frames_done: int
    frames_total: int
    map_version: int
    resume_token: str
    def __init__(self, map_version: _Optional[int] = ..., commit_number: _Optional[int] = ..., frames_done: _Optional[int] = ..., frames_total: _Optional[int] = ..., chains: _Optional[_Iterable[_Union[SkeletonChain, _Mapping]]] = ..., closures: _Optional[_Union[SkeletonClosures, _Mapping]] = ..., resume_token: _Optional[str] = ...) -> None: ...

class GetSkeletonRequest(_message.Message):
    __slots__ = ["candidates", "level", "resume_token", "sessions"]
    CANDIDATES_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    candidates: bool
    level: int
    resume_token: str
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, level: _Optional[int] = ..., sessions: _Optional[_Iterable[int]] = ..., candidates: bool = ..., resume_token: _Optional[str] = ...) -> None: ...

class SkeletonChain(_message.Message):
    __slots__ = ["carried", "frames", "index", "session", "step", "time_ms", "unmeasured", "variance"]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    INDEX_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    TIME_MS_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    VARIANCE_FIELD_NUMBER: _ClassVar[int]
    carried: _containers.RepeatedScalarFieldContainer[int]
    frames: _containers.RepeatedScalarFieldContainer[int]
    index: _containers.RepeatedScalarFieldContainer[int]
    session: int
    step: _containers.RepeatedScalarFieldContainer[float]
    time_ms: _containers.RepeatedScalarFieldContainer[int]
    unmeasured: _containers.RepeatedScalarFieldContainer[int]
    variance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, session: _Optional[int] = ..., index: _Optional[_Iterable[int]] = ..., time_ms: _Optional[_Iterable[int]] = ..., step: _Optional[_Iterable[float]] = ..., variance: _Optional[_Iterable[float]] = ..., frames: _Optional[_Iterable[int]] = ..., unmeasured: _Optional[_Iterable[int]] = ..., carried: _Optional[_Iterable[int]] = ...) -> None: ...

class SkeletonClosures(_message.Message):
    __slots__ = ["a_from_b", "alike", "carries", "index_a", "index_b", "ordinal", "session_a", "session_b", "state", "suspicion", "variance"]
    ALIKE_FIELD_NUMBER: _ClassVar[int]
    A_FROM_B_FIELD_NUMBER: _ClassVar[int]
    CARRIES_FIELD_NUMBER: _ClassVar[int]
    INDEX_A_FIELD_NUMBER: _ClassVar[int]
    INDEX_B_FIELD_NUMBER: _ClassVar[int]
    ORDINAL_FIELD_NUMBER: _ClassVar[int]
    SESSION_A_FIELD_NUMBER: _ClassVar[int]
    SESSION_B_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    SUSPICION_FIELD_NUMBER: _ClassVar[int]
    VARIANCE_FIELD_NUMBER: _ClassVar[int]
    a_from_b: _containers.RepeatedScalarFieldContainer[float]
    alike: _containers.RepeatedScalarFieldContainer[int]
    carries: _containers.RepeatedScalarFieldContainer[bool]
    index_a: _containers.RepeatedScalarFieldContainer[int]
    index_b: _containers.RepeatedScalarFieldContainer[int]
    ordinal: _containers.RepeatedScalarFieldContainer[int]
    session_a: _containers.RepeatedScalarFieldContainer[int]
    session_b: _containers.RepeatedScalarFieldContainer[int]
    state: _containers.RepeatedScalarFieldContainer[_graph_pb2.EdgeState]
    suspicion: _containers.RepeatedScalarFieldContainer[float]
    variance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, session_b: _Optional[_Iterable[int]] = ..., index_b: _Optional[_Iterable[int]] = ..., ordinal: _Optional[_Iterable[int]] = ..., session_a: _Optional[_Iterable[int]] = ..., index_a: _Optional[_Iterable[int]] = ..., state: _Optional[_Iterable[_Union[_graph_pb2.EdgeState, str]]] = ..., carries: _Optional[_Iterable[bool]] = ..., a_from_b: _Optional[_Iterable[float]] = ..., variance: _Optional[_Iterable[float]] = ..., suspicion: _Optional[_Iterable[float]] = ..., alike: _Optional[_Iterable[int]] = ...) -> None: ...
