from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import graph_pb2 as _graph_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Agreement(_message.Message):
    __slots__ = ["a", "agrees", "b", "edge", "state"]
    AGREES_FIELD_NUMBER: _ClassVar[int]
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    a: _common_pb2.FrameId
    agrees: bool
    b: _common_pb2.FrameId
    edge: _common_pb2.EdgeId
    state: _graph_pb2.EdgeState
    def __init__(self, edge: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., a: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., b: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., state: _Optional[_Union[_graph_pb2.EdgeState, str]] = ..., agrees: bool = ...) -> None: ...

class ClosureMatrixCell(_message.Message):
    __slots__ = ["accepted", "candidate", "most_suspicious", "quarantined", "removed", "session_a", "session_b", "suspicion"]
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    CANDIDATE_FIELD_NUMBER: _ClassVar[int]
    MOST_SUSPICIOUS_FIELD_NUMBER: _ClassVar[int]
    QUARANTINED_FIELD_NUMBER: _ClassVar[int]
    REMOVED_FIELD_NUMBER: _ClassVar[int]
    SESSION_A_FIELD_NUMBER: _ClassVar[int]
    SESSION_B_FIELD_NUMBER: _ClassVar[int]
    SUSPICION_FIELD_NUMBER: _ClassVar[int]
    accepted: int
    candidate: int
    most_suspicious: _common_pb2.EdgeId
    quarantined: int
    removed: int
    session_a: int
    session_b: int
    suspicion: float
    def __init__(self, session_a: _Optional[int] = ..., session_b: _Optional[int] = ..., candidate: _Optional[int] = ..., accepted: _Optional[int] = ..., quarantined: _Optional[int] = ..., removed: _Optional[int] = ..., most_suspicious: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., suspicion: _Optional[float] = ...) -> None: ...

class Correspondence(_message.Message):
    __slots__ = ["frame_u", "frame_v", "inlier", "residual", "seen_in", "u", "v"]
    FRAME_U_FIELD_NUMBER: _ClassVar[int]
    FRAME_V_FIELD_NUMBER: _ClassVar[int]
    INLIER_FIELD_NUMBER: _ClassVar[int]
    RESIDUAL_FIELD_NUMBER: _ClassVar[int]
    SEEN_IN_FIELD_NUMBER: _ClassVar[int]
    U_FIELD_NUMBER: _ClassVar[int]
    V_FIELD_NUMBER: _ClassVar[int]
    frame_u: float
    frame_v: float
    inlier: bool
    residual: float
    seen_in: _common_pb2.FrameId
    u: float
    v: float
    def __init__(self, u: _Optional[float] = ..., v: _Optional[float] = ..., frame_u: _Optional[float] = ..., frame_v: _Optional[float] = ..., inlier: bool = ..., residual: _Optional[float] = ..., seen_in: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ...) -> None: ...

class ExplainEdgeReply(_message.Message):
    __slots__ = ["agreements", "correspondences", "correspondences_message", "correspondences_reason", "edge", "map_version", "motion", "picture_a", "picture_b", "runner_up"]
    AGREEMENTS_FIELD_NUMBER: _ClassVar[int]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    CORRESPONDENCES_MESSAGE_FIELD_NUMBER: _ClassVar[int]
    CORRESPONDENCES_REASON_FIELD_NUMBER: _ClassVar[int]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    MOTION_FIELD_NUMBER: _ClassVar[int]
    PICTURE_A_FIELD_NUMBER: _ClassVar[int]
    PICTURE_B_FIELD_NUMBER: _ClassVar[int]
    RUNNER_UP_FIELD_NUMBER: _ClassVar[int]
    agreements: _containers.RepeatedCompositeFieldContainer[Agreement]
    correspondences: _containers.RepeatedCompositeFieldContainer[Correspondence]
    correspondences_message: str
    correspondences_reason: _reason_pb2.Reason
    edge: _graph_pb2.Edge
    map_version: int
    motion: MotionVerdict
    picture_a: _graph_pb2.FramePicture
    picture_b: _graph_pb2.FramePicture
    runner_up: _graph_pb2.FramePicture
    def __init__(self, edge: _Optional[_Union[_graph_pb2.Edge, _Mapping]] = ..., picture_a: _Optional[_Union[_graph_pb2.FramePicture, _Mapping]] = ..., picture_b: _Optional[_Union[_graph_pb2.FramePicture, _Mapping]] = ..., correspondences: _Optional[_Iterable[_Union[Correspondence, _Mapping]]] = ..., correspondences_reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., correspondences_message: _Optional[str] = ..., motion: _Optional[_Union[MotionVerdict, _Mapping]] = ..., agreements: _Optional[_Iterable[_Union[Agreement, _Mapping]]] = ..., runner_up: _Optional[_Union[_graph_pb2.FramePicture, _Mapping]] = ..., map_version: _Optional[int] = ...) -> None: ...

class ExplainEdgeRequest(_message.Message):
    __slots__ = ["edge", "pictures"]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    PICTURES_FIELD_NUMBER: _ClassVar[int]
    edge: _common_pb2.EdgeId
    pictures: bool
    def __init__(self, edge: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., pictures: bool = ...) -> None: ...

class GetClosureMatrixReply(_message.Message):
    __slots__ = ["cells", "map_version", "next_page_token"]
    CELLS_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    cells: _containers.RepeatedCompositeFieldContainer[ClosureMatrixCell]
    map_version: int
    next_page_token: str
    def __init__(self, cells: _Optional[_Iterable[_Union[ClosureMatrixCell, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., map_version: _Optional[int] = ...) -> None: ...

class GetClosureMatrixRequest(_message.Message):
    __slots__ = ["page_size", "page_token", "sessions"]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, sessions: _Optional[_Iterable[int]] = ..., page_size: _Optional[int] = ..., page_token: _Optional[str] = ...) -> None: ...

class MotionVerdict(_message.Message):
    __slots__ = ["a_from_b", "covariance", "distance_m", "edges", "message", "metres_apart", "radians_apart", "sigmas_apart", "verdict"]
    A_FROM_B_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    METRES_APART_FIELD_NUMBER: _ClassVar[int]
    RADIANS_APART_FIELD_NUMBER: _ClassVar[int]
    SIGMAS_APART_FIELD_NUMBER: _ClassVar[int]
    VERDICT_FIELD_NUMBER: _ClassVar[int]
    a_from_b: _common_pb2.Transform
    covariance: _common_pb2.Covariance
    distance_m: float
    edges: int
    message: str
    metres_apart: float
    radians_apart: float
    sigmas_apart: float
    verdict: _reason_pb2.Reason
    def __init__(self, verdict: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ..., edges: _Optional[int] = ..., distance_m: _Optional[float] = ..., a_from_b: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., metres_apart: _Optional[float] = ..., radians_apart: _Optional[float] = ..., sigmas_apart: _Optional[float] = ...) -> None: ...
