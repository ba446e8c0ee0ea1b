from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import evidence_pb2 as _evidence_pb2
from relmap.v1 import graph_pb2 as _graph_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from relmap.v1 import skeleton_pb2 as _skeleton_pb2
from relmap.v1 import status_pb2 as _status_pb2
from relmap.v1 import watch_pb2 as _watch_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor
EDGE_ORDER_ID: EdgeOrder
EDGE_ORDER_SUSPICION: EdgeOrder
EDGE_ORDER_TIME: EdgeOrder
EDGE_ORDER_UNSPECIFIED: EdgeOrder
EXPORT_FORMAT_FRAMES: ExportFormat
EXPORT_FORMAT_KITTI: ExportFormat
EXPORT_FORMAT_TUM: ExportFormat
EXPORT_FORMAT_UNSPECIFIED: ExportFormat
ROUTE_BY_CERTAINTY: RouteBy
ROUTE_BY_DISTANCE: RouteBy
ROUTE_BY_TIME: RouteBy
ROUTE_BY_UNSPECIFIED: RouteBy

class ClosureChange(_message.Message):
    __slots__ = ["a", "after", "b", "before", "bound", "bound_frames", "edge_after", "edge_before", "id", "reason_after", "reason_before"]
    AFTER_FIELD_NUMBER: _ClassVar[int]
    A_FIELD_NUMBER: _ClassVar[int]
    BEFORE_FIELD_NUMBER: _ClassVar[int]
    BOUND_FIELD_NUMBER: _ClassVar[int]
    BOUND_FRAMES_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    EDGE_AFTER_FIELD_NUMBER: _ClassVar[int]
    EDGE_BEFORE_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    REASON_AFTER_FIELD_NUMBER: _ClassVar[int]
    REASON_BEFORE_FIELD_NUMBER: _ClassVar[int]
    a: _common_pb2.FrameId
    after: _graph_pb2.EdgeState
    b: _common_pb2.FrameId
    before: _graph_pb2.EdgeState
    bound: int
    bound_frames: int
    edge_after: bool
    edge_before: bool
    id: _common_pb2.EdgeId
    reason_after: _reason_pb2.Reason
    reason_before: _reason_pb2.Reason
    def __init__(self, id: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., a: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., b: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., before: _Optional[_Union[_graph_pb2.EdgeState, str]] = ..., after: _Optional[_Union[_graph_pb2.EdgeState, str]] = ..., reason_before: _Optional[_Union[_reason_pb2.Reason, str]] = ..., reason_after: _Optional[_Union[_reason_pb2.Reason, str]] = ..., edge_before: bool = ..., edge_after: bool = ..., bound: _Optional[int] = ..., bound_frames: _Optional[int] = ...) -> None: ...

class EditEffect(_message.Message):
    __slots__ = ["carried", "closures", "not_carried"]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    CLOSURES_FIELD_NUMBER: _ClassVar[int]
    NOT_CARRIED_FIELD_NUMBER: _ClassVar[int]
    carried: _containers.RepeatedCompositeFieldContainer[_graph_pb2.CarriedStretch]
    closures: _containers.RepeatedCompositeFieldContainer[ClosureChange]
    not_carried: _containers.RepeatedCompositeFieldContainer[_graph_pb2.CarriedStretch]
    def __init__(self, closures: _Optional[_Iterable[_Union[ClosureChange, _Mapping]]] = ..., carried: _Optional[_Iterable[_Union[_graph_pb2.CarriedStretch, _Mapping]]] = ..., not_carried: _Optional[_Iterable[_Union[_graph_pb2.CarriedStretch, _Mapping]]] = ...) -> None: ...

class ExportReply(_message.Message):
    __slots__ = ["data", "frames", "frames_done", "frames_total", "resume_token", "session", "unmeasured"]
    DATA_FIELD_NUMBER: _ClassVar[int]
    FRAMES_DONE_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    FRAMES_TOTAL_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    data: bytes
    frames: _containers.RepeatedCompositeFieldContainer[ExportedFrame]
    frames_done: int
    frames_total: int
    resume_token: str
    session: int
    unmeasured: _containers.RepeatedCompositeFieldContainer[_graph_pb2.Edge]
    def __init__(self, session: _Optional[int] = ..., data: _Optional[bytes] = ..., resume_token: _Optional[str] = ..., frames_done: _Optional[int] = ..., frames_total: _Optional[int] = ..., frames: _Optional[_Iterable[_Union[ExportedFrame, _Mapping]]] = ..., unmeasured: _Optional[_Iterable[_Union[_graph_pb2.Edge, _Mapping]]] = ...) -> None: ...

class ExportRequest(_message.Message):
    __slots__ = ["format", "landmarks", "resume_token", "sessions"]
    FORMAT_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    format: ExportFormat
    landmarks: bool
    resume_token: str
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, format: _Optional[_Union[ExportFormat, str]] = ..., sessions: _Optional[_Iterable[int]] = ..., resume_token: _Optional[str] = ..., landmarks: bool = ...) -> None: ...

class ExportedFrame(_message.Message):
    __slots__ = ["id", "landmarks", "observers", "time_us"]
    ID_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    OBSERVERS_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    id: _common_pb2.FrameId
    landmarks: _containers.RepeatedScalarFieldContainer[float]
    observers: _containers.RepeatedScalarFieldContainer[int]
    time_us: int
    def __init__(self, id: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., time_us: _Optional[int] = ..., landmarks: _Optional[_Iterable[float]] = ..., observers: _Optional[_Iterable[int]] = ...) -> None: ...

class FindLabelsReply(_message.Message):
    __slots__ = ["labels", "map_version", "next_page_token"]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    labels: _containers.RepeatedCompositeFieldContainer[_graph_pb2.LabelledFrames]
    map_version: int
    next_page_token: str
    def __init__(self, labels: _Optional[_Iterable[_Union[_graph_pb2.LabelledFrames, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., map_version: _Optional[int] = ...) -> None: ...

class FindLabelsRequest(_message.Message):
    __slots__ = ["page_size", "page_token", "prefix", "words"]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    PREFIX_FIELD_NUMBER: _ClassVar[int]
    WORDS_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    prefix: str
    words: str
    def __init__(self, prefix: _Optional[str] = ..., page_size: _Optional[int] = ..., page_token: _Optional[str] = ..., words: _Optional[str] = ...) -> None: ...

class FindRouteReply(_message.Message):
    __slots__ = ["resume_token", "route", "steps", "summary"]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    ROUTE_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    SUMMARY_FIELD_NUMBER: _ClassVar[int]
    resume_token: str
    route: int
    steps: _containers.RepeatedCompositeFieldContainer[RouteStep]
    summary: RouteSummary
    def __init__(self, summary: _Optional[_Union[RouteSummary, _Mapping]] = ..., steps: _Optional[_Iterable[_Union[RouteStep, _Mapping]]] = ..., resume_token: _Optional[str] = ..., route: _Optional[int] = ...) -> None: ...

class FindRouteRequest(_message.Message):
    __slots__ = ["alternatives", "by", "count_standing", "covariance", "filter", "max_cost", "or_from", "or_to", "resume_token", "to", "weights"]
    ALTERNATIVES_FIELD_NUMBER: _ClassVar[int]
    BY_FIELD_NUMBER: _ClassVar[int]
    COUNT_STANDING_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    FILTER_FIELD_NUMBER: _ClassVar[int]
    FROM_FIELD_NUMBER: _ClassVar[int]
    MAX_COST_FIELD_NUMBER: _ClassVar[int]
    OR_FROM_FIELD_NUMBER: _ClassVar[int]
    OR_TO_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    TO_FIELD_NUMBER: _ClassVar[int]
    WEIGHTS_FIELD_NUMBER: _ClassVar[int]
    alternatives: int
    by: RouteBy
    count_standing: bool
    covariance: bool
    filter: RouteFilter
    max_cost: float
    or_from: _containers.RepeatedCompositeFieldContainer[RouteEnd]
    or_to: _containers.RepeatedCompositeFieldContainer[RouteEnd]
    resume_token: str
    to: RouteEnd
    weights: RouteWeights
    def __init__(self, to: _Optional[_Union[RouteEnd, _Mapping]] = ..., by: _Optional[_Union[RouteBy, str]] = ..., count_standing: bool = ..., max_cost: _Optional[float] = ..., resume_token: _Optional[str] = ..., or_from: _Optional[_Iterable[_Union[RouteEnd, _Mapping]]] = ..., or_to: _Optional[_Iterable[_Union[RouteEnd, _Mapping]]] = ..., weights: _Optional[_Union[RouteWeights, _Mapping]] = ..., filter: _Optional[_Union[RouteFilter, _Mapping]] = ..., covariance: bool = ..., alternatives: _Optional[int] = ..., **kwargs) -> None: ...

class GetFrameReply(_message.Message):
    __slots__ = ["frame", "map_version"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    frame: _graph_pb2.Frame
    map_version: int
    def __init__(self, frame: _Optional[_Union[_graph_pb2.Frame, _Mapping]] = ..., map_version: _Optional[int] = ...) -> None: ...

class GetFrameRequest(_message.Message):
    __slots__ = ["appearance", "frame", "landmarks", "observations", "picture", "thumbnail"]
    APPEARANCE_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    OBSERVATIONS_FIELD_NUMBER: _ClassVar[int]
    PICTURE_FIELD_NUMBER: _ClassVar[int]
    THUMBNAIL_FIELD_NUMBER: _ClassVar[int]
    appearance: bool
    frame: _common_pb2.FrameId
    landmarks: bool
    observations: bool
    picture: bool
    thumbnail: bool
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., landmarks: bool = ..., observations: bool = ..., appearance: bool = ..., thumbnail: bool = ..., picture: bool = ...) -> None: ...

class GetNeighbourhoodReply(_message.Message):
    __slots__ = ["cut", "edges", "frames", "map_version"]
    CUT_FIELD_NUMBER: _ClassVar[int]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    cut: bool
    edges: _containers.RepeatedCompositeFieldContainer[_graph_pb2.Edge]
    frames: _containers.RepeatedCompositeFieldContainer[NeighbourhoodFrame]
    map_version: int
    def __init__(self, frames: _Optional[_Iterable[_Union[NeighbourhoodFrame, _Mapping]]] = ..., edges: _Optional[_Iterable[_Union[_graph_pb2.Edge, _Mapping]]] = ..., cut: bool = ..., map_version: _Optional[int] = ...) -> None: ...

class GetNeighbourhoodRequest(_message.Message):
    __slots__ = ["landmarks", "max_edges", "max_frames", "max_metres", "root"]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    MAX_EDGES_FIELD_NUMBER: _ClassVar[int]
    MAX_FRAMES_FIELD_NUMBER: _ClassVar[int]
    MAX_METRES_FIELD_NUMBER: _ClassVar[int]
    ROOT_FIELD_NUMBER: _ClassVar[int]
    landmarks: bool
    max_edges: int
    max_frames: int
    max_metres: float
    root: _common_pb2.FrameId
    def __init__(self, root: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., max_edges: _Optional[int] = ..., max_metres: _Optional[float] = ..., max_frames: _Optional[int] = ..., landmarks: bool = ...) -> None: ...

class ImportGraphReply(_message.Message):
    __slots__ = ["frames_known", "journal_sequence", "map_version", "session"]
    FRAMES_KNOWN_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    frames_known: int
    journal_sequence: int
    map_version: int
    session: int
    def __init__(self, session: _Optional[int] = ..., frames_known: _Optional[int] = ..., journal_sequence: _Optional[int] = ..., map_version: _Optional[int] = ...) -> None: ...

class ImportGraphRequest(_message.Message):
    __slots__ = ["first", "frames", "loops", "name", "robot", "session_uuid"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    LOOPS_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    first: int
    frames: _containers.RepeatedCompositeFieldContainer[ImportedFrame]
    loops: _containers.RepeatedCompositeFieldContainer[ImportedLoop]
    name: str
    robot: str
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., robot: _Optional[str] = ..., name: _Optional[str] = ..., first: _Optional[int] = ..., frames: _Optional[_Iterable[_Union[ImportedFrame, _Mapping]]] = ..., loops: _Optional[_Iterable[_Union[ImportedLoop, _Mapping]]] = ...) -> None: ...

class ImportedFrame(_message.Message):
    __slots__ = ["driven_us", "odom_from_frame", "step", "time_us"]
    DRIVEN_US_FIELD_NUMBER: _ClassVar[int]
    ODOM_FROM_FRAME_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    driven_us: int
    odom_from_frame: _common_pb2.Transform
    step: _common_pb2.Covariance
    time_us: int
    def __init__(self, odom_from_frame: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., step: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., time_us: _Optional[int] = ..., driven_us: _Optional[int] = ...) -> None: ...

class ImportedLoop(_message.Message):
    __slots__ = ["covariance", "match", "match_from_query", "query"]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    MATCH_FIELD_NUMBER: _ClassVar[int]
    MATCH_FROM_QUERY_FIELD_NUMBER: _ClassVar[int]
    QUERY_FIELD_NUMBER: _ClassVar[int]
    covariance: _common_pb2.Covariance
    match: int
    match_from_query: _common_pb2.Transform
    query: int
    def __init__(self, query: _Optional[int] = ..., match: _Optional[int] = ..., match_from_query: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ...) -> None: ...

class ListEdgesReply(_message.Message):
    __slots__ = ["edges", "map_version", "next_page_token"]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    edges: _containers.RepeatedCompositeFieldContainer[_graph_pb2.Edge]
    map_version: int
    next_page_token: str
    def __init__(self, edges: _Optional[_Iterable[_Union[_graph_pb2.Edge, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., map_version: _Optional[int] = ...) -> None: ...

class ListEdgesRequest(_message.Message):
    __slots__ = ["frame", "from_us", "kinds", "min_suspicion", "order", "other_session", "page_size", "page_token", "region", "session", "states", "until_us"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    FROM_US_FIELD_NUMBER: _ClassVar[int]
    KINDS_FIELD_NUMBER: _ClassVar[int]
    MIN_SUSPICION_FIELD_NUMBER: _ClassVar[int]
    ORDER_FIELD_NUMBER: _ClassVar[int]
    OTHER_SESSION_FIELD_NUMBER: _ClassVar[int]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    REGION_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    UNTIL_US_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    from_us: int
    kinds: _containers.RepeatedScalarFieldContainer[_graph_pb2.EdgeKind]
    min_suspicion: float
    order: EdgeOrder
    other_session: int
    page_size: int
    page_token: str
    region: Region
    session: int
    states: _containers.RepeatedScalarFieldContainer[_graph_pb2.EdgeState]
    until_us: int
    def __init__(self, states: _Optional[_Iterable[_Union[_graph_pb2.EdgeState, str]]] = ..., kinds: _Optional[_Iterable[_Union[_graph_pb2.EdgeKind, str]]] = ..., session: _Optional[int] = ..., frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., page_size: _Optional[int] = ..., page_token: _Optional[str] = ..., other_session: _Optional[int] = ..., from_us: _Optional[int] = ..., until_us: _Optional[int] = ..., min_suspicion: _Optional[float] = ..., region: _Optional[_Union[Region, _Mapping]] = ..., order: _Optional[_Union[EdgeOrder, str]] = ...) -> None: ...

class ListSessionsReply(_message.Message):
    __slots__ = ["map_version", "next_page_token", "sessions"]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NEXT_PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    map_version: int
    next_page_token: str
    sessions: _containers.RepeatedCompositeFieldContainer[_graph_pb2.Session]
    def __init__(self, sessions: _Optional[_Iterable[_Union[_graph_pb2.Session, _Mapping]]] = ..., next_page_token: _Optional[str] = ..., map_version: _Optional[int] = ...) -> None: ...

class ListSessionsRequest(_message.Message):
    __slots__ = ["page_size", "page_token"]
    PAGE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PAGE_TOKEN_FIELD_NUMBER: _ClassVar[int]
    page_size: int
    page_token: str
    def __init__(self, page_size: _Optional[int] = ..., page_token: _Optional[str] = ...) -> None: ...

class LocaliseReply(_message.Message):
    __slots__ = ["candidates", "correspondences", "covariance", "estimated_focal_length", "frame", "frame_from_view", "inliers", "map_version", "near_prior", "new_place", "probability", "spread", "verification"]
    CANDIDATES_FIELD_NUMBER: _ClassVar[int]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    ESTIMATED_FOCAL_LENGTH_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    FRAME_FROM_VIEW_FIELD_NUMBER: _ClassVar[int]
    INLIERS_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NEAR_PRIOR_FIELD_NUMBER: _ClassVar[int]
    NEW_PLACE_FIELD_NUMBER: _ClassVar[int]
    PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    VERIFICATION_FIELD_NUMBER: _ClassVar[int]
    candidates: int
    correspondences: _containers.RepeatedCompositeFieldContainer[_evidence_pb2.Correspondence]
    covariance: _common_pb2.Covariance
    estimated_focal_length: float
    frame: _common_pb2.FrameId
    frame_from_view: _common_pb2.Transform
    inliers: int
    map_version: int
    near_prior: bool
    new_place: float
    probability: float
    spread: float
    verification: _common_pb2.Verification
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., frame_from_view: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., inliers: _Optional[int] = ..., verification: _Optional[_Union[_common_pb2.Verification, str]] = ..., probability: _Optional[float] = ..., spread: _Optional[float] = ..., new_place: _Optional[float] = ..., candidates: _Optional[int] = ..., map_version: _Optional[int] = ..., near_prior: bool = ..., estimated_focal_length: _Optional[float] = ..., correspondences: _Optional[_Iterable[_Union[_evidence_pb2.Correspondence, _Mapping]]] = ...) -> None: ...

class LocaliseRequest(_message.Message):
    __slots__ = ["correspondences", "prior", "view"]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    PRIOR_FIELD_NUMBER: _ClassVar[int]
    VIEW_FIELD_NUMBER: _ClassVar[int]
    correspondences: bool
    prior: _common_pb2.FrameId
    view: _common_pb2.View
    def __init__(self, view: _Optional[_Union[_common_pb2.View, _Mapping]] = ..., prior: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., correspondences: bool = ...) -> None: ...

class MatchImageReply(_message.Message):
    __slots__ = ["map_version", "message", "new_place", "places", "reason"]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    NEW_PLACE_FIELD_NUMBER: _ClassVar[int]
    PLACES_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    map_version: int
    message: str
    new_place: float
    places: _containers.RepeatedCompositeFieldContainer[PlaceMatch]
    reason: _reason_pb2.Reason
    def __init__(self, places: _Optional[_Iterable[_Union[PlaceMatch, _Mapping]]] = ..., new_place: _Optional[float] = ..., map_version: _Optional[int] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class MatchImageRequest(_message.Message):
    __slots__ = ["correspondences", "max_places", "max_verified", "near", "thumbnails", "view"]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    MAX_PLACES_FIELD_NUMBER: _ClassVar[int]
    MAX_VERIFIED_FIELD_NUMBER: _ClassVar[int]
    NEAR_FIELD_NUMBER: _ClassVar[int]
    THUMBNAILS_FIELD_NUMBER: _ClassVar[int]
    VIEW_FIELD_NUMBER: _ClassVar[int]
    correspondences: bool
    max_places: int
    max_verified: int
    near: _common_pb2.FrameId
    thumbnails: bool
    view: _common_pb2.View
    def __init__(self, view: _Optional[_Union[_common_pb2.View, _Mapping]] = ..., max_places: _Optional[int] = ..., max_verified: _Optional[int] = ..., thumbnails: bool = ..., near: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., correspondences: bool = ...) -> None: ...

class NeighbourhoodFrame(_message.Message):
    __slots__ = ["depth", "distance_m", "frame", "labels", "landmarks", "root_from_frame", "time_us", "unmeasured_steps"]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    ROOT_FROM_FRAME_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_STEPS_FIELD_NUMBER: _ClassVar[int]
    depth: int
    distance_m: float
    frame: _common_pb2.FrameId
    labels: _containers.RepeatedScalarFieldContainer[str]
    landmarks: _containers.RepeatedCompositeFieldContainer[_common_pb2.Vector3]
    root_from_frame: _common_pb2.Transform
    time_us: int
    unmeasured_steps: int
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., root_from_frame: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., depth: _Optional[int] = ..., distance_m: _Optional[float] = ..., time_us: _Optional[int] = ..., labels: _Optional[_Iterable[str]] = ..., landmarks: _Optional[_Iterable[_Union[_common_pb2.Vector3, _Mapping]]] = ..., unmeasured_steps: _Optional[int] = ...) -> None: ...

class PlaceMatch(_message.Message):
    __slots__ = ["correspondences", "covariance", "estimated_focal_length", "frame", "frame_from_view", "inliers", "message", "probability", "reason", "spread", "thumbnail", "verification"]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    ESTIMATED_FOCAL_LENGTH_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    FRAME_FROM_VIEW_FIELD_NUMBER: _ClassVar[int]
    INLIERS_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    THUMBNAIL_FIELD_NUMBER: _ClassVar[int]
    VERIFICATION_FIELD_NUMBER: _ClassVar[int]
    correspondences: _containers.RepeatedCompositeFieldContainer[_evidence_pb2.Correspondence]
    covariance: _common_pb2.Covariance
    estimated_focal_length: float
    frame: _common_pb2.FrameId
    frame_from_view: _common_pb2.Transform
    inliers: int
    message: str
    probability: float
    reason: _reason_pb2.Reason
    spread: float
    thumbnail: bytes
    verification: _common_pb2.Verification
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., probability: _Optional[float] = ..., verification: _Optional[_Union[_common_pb2.Verification, str]] = ..., inliers: _Optional[int] = ..., frame_from_view: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ..., thumbnail: _Optional[bytes] = ..., spread: _Optional[float] = ..., estimated_focal_length: _Optional[float] = ..., correspondences: _Optional[_Iterable[_Union[_evidence_pb2.Correspondence, _Mapping]]] = ...) -> None: ...

class ProposeEdgeReply(_message.Message):
    __slots__ = ["edge", "effect", "journal_sequence", "map_version"]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    EFFECT_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    edge: _graph_pb2.Edge
    effect: EditEffect
    journal_sequence: int
    map_version: int
    def __init__(self, edge: _Optional[_Union[_graph_pb2.Edge, _Mapping]] = ..., effect: _Optional[_Union[EditEffect, _Mapping]] = ..., journal_sequence: _Optional[int] = ..., map_version: _Optional[int] = ...) -> None: ...

class ProposeEdgeRequest(_message.Message):
    __slots__ = ["a", "accept", "b", "dry_run", "idempotency_key", "note"]
    ACCEPT_FIELD_NUMBER: _ClassVar[int]
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    DRY_RUN_FIELD_NUMBER: _ClassVar[int]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    a: _common_pb2.FrameId
    accept: bool
    b: _common_pb2.FrameId
    dry_run: bool
    idempotency_key: str
    note: str
    def __init__(self, a: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., b: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., accept: bool = ..., note: _Optional[str] = ..., idempotency_key: _Optional[str] = ..., dry_run: bool = ...) -> None: ...

class Region(_message.Message):
    __slots__ = ["max_edges", "max_metres", "root"]
    MAX_EDGES_FIELD_NUMBER: _ClassVar[int]
    MAX_METRES_FIELD_NUMBER: _ClassVar[int]
    ROOT_FIELD_NUMBER: _ClassVar[int]
    max_edges: int
    max_metres: float
    root: _common_pb2.FrameId
    def __init__(self, root: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., max_edges: _Optional[int] = ..., max_metres: _Optional[float] = ...) -> None: ...

class RouteEnd(_message.Message):
    __slots__ = ["frame", "label", "robot", "view"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    LABEL_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    VIEW_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    label: str
    robot: str
    view: _common_pb2.View
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., label: _Optional[str] = ..., view: _Optional[_Union[_common_pb2.View, _Mapping]] = ..., robot: _Optional[str] = ...) -> None: ...

class RouteFilter(_message.Message):
    __slots__ = ["avoid_frames", "avoid_labels", "min_support", "no_long_loops", "sessions", "suppose_candidates", "suppose_quarantined"]
    AVOID_FRAMES_FIELD_NUMBER: _ClassVar[int]
    AVOID_LABELS_FIELD_NUMBER: _ClassVar[int]
    MIN_SUPPORT_FIELD_NUMBER: _ClassVar[int]
    NO_LONG_LOOPS_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    SUPPOSE_CANDIDATES_FIELD_NUMBER: _ClassVar[int]
    SUPPOSE_QUARANTINED_FIELD_NUMBER: _ClassVar[int]
    avoid_frames: _containers.RepeatedCompositeFieldContainer[_common_pb2.FrameId]
    avoid_labels: _containers.RepeatedScalarFieldContainer[str]
    min_support: int
    no_long_loops: bool
    sessions: _containers.RepeatedScalarFieldContainer[int]
    suppose_candidates: bool
    suppose_quarantined: bool
    def __init__(self, sessions: _Optional[_Iterable[int]] = ..., avoid_frames: _Optional[_Iterable[_Union[_common_pb2.FrameId, _Mapping]]] = ..., avoid_labels: _Optional[_Iterable[str]] = ..., min_support: _Optional[int] = ..., no_long_loops: bool = ..., suppose_candidates: bool = ..., suppose_quarantined: bool = ...) -> None: ...

class RouteStep(_message.Message):
    __slots__ = ["carried", "covariance", "distance_m", "edge", "frame", "kind", "labels", "long_loop", "start_from_this", "time_s", "to_next", "unmeasured"]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    LONG_LOOP_FIELD_NUMBER: _ClassVar[int]
    START_FROM_THIS_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    TO_NEXT_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    carried: bool
    covariance: _common_pb2.Covariance
    distance_m: float
    edge: _common_pb2.EdgeId
    frame: _common_pb2.FrameId
    kind: _graph_pb2.EdgeKind
    labels: _containers.RepeatedScalarFieldContainer[str]
    long_loop: bool
    start_from_this: _common_pb2.Transform
    time_s: float
    to_next: _common_pb2.Transform
    unmeasured: bool
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., distance_m: _Optional[float] = ..., time_s: _Optional[float] = ..., labels: _Optional[_Iterable[str]] = ..., edge: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., kind: _Optional[_Union[_graph_pb2.EdgeKind, str]] = ..., to_next: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., long_loop: bool = ..., start_from_this: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., carried: bool = ..., unmeasured: bool = ...) -> None: ...

class RouteSummary(_message.Message):
    __slots__ = ["bound_closures", "carried", "cost", "distance_m", "frame_by_frame", "frames_touched", "from_view", "long_loops", "map_version", "no_way_by_edges", "shared", "steps", "time_s", "to", "to_view", "unmeasured", "unmeasured_m", "unmeasured_steps"]
    BOUND_CLOSURES_FIELD_NUMBER: _ClassVar[int]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    COST_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    FRAMES_TOUCHED_FIELD_NUMBER: _ClassVar[int]
    FRAME_BY_FRAME_FIELD_NUMBER: _ClassVar[int]
    FROM_FIELD_NUMBER: _ClassVar[int]
    FROM_VIEW_FIELD_NUMBER: _ClassVar[int]
    LONG_LOOPS_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NO_WAY_BY_EDGES_FIELD_NUMBER: _ClassVar[int]
    SHARED_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    TO_FIELD_NUMBER: _ClassVar[int]
    TO_VIEW_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_M_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_STEPS_FIELD_NUMBER: _ClassVar[int]
    bound_closures: bool
    carried: _containers.RepeatedCompositeFieldContainer[_graph_pb2.CarriedStretch]
    cost: float
    distance_m: float
    frame_by_frame: str
    frames_touched: int
    from_view: LocaliseReply
    long_loops: int
    map_version: int
    no_way_by_edges: bool
    shared: float
    steps: int
    time_s: float
    to: _common_pb2.FrameId
    to_view: LocaliseReply
    unmeasured: _containers.RepeatedCompositeFieldContainer[UnmeasuredStretch]
    unmeasured_m: float
    unmeasured_steps: int
    def __init__(self, to: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., distance_m: _Optional[float] = ..., time_s: _Optional[float] = ..., steps: _Optional[int] = ..., long_loops: _Optional[int] = ..., from_view: _Optional[_Union[LocaliseReply, _Mapping]] = ..., to_view: _Optional[_Union[LocaliseReply, _Mapping]] = ..., frames_touched: _Optional[int] = ..., map_version: _Optional[int] = ..., cost: _Optional[float] = ..., frame_by_frame: _Optional[str] = ..., carried: _Optional[_Iterable[_Union[_graph_pb2.CarriedStretch, _Mapping]]] = ..., unmeasured: _Optional[_Iterable[_Union[UnmeasuredStretch, _Mapping]]] = ..., unmeasured_steps: _Optional[int] = ..., unmeasured_m: _Optional[float] = ..., bound_closures: bool = ..., no_way_by_edges: bool = ..., shared: _Optional[float] = ..., **kwargs) -> None: ...

class RouteWeights(_message.Message):
    __slots__ = ["driven_second", "metre", "square_metre_of_variance", "standing_second"]
    DRIVEN_SECOND_FIELD_NUMBER: _ClassVar[int]
    METRE_FIELD_NUMBER: _ClassVar[int]
    SQUARE_METRE_OF_VARIANCE_FIELD_NUMBER: _ClassVar[int]
    STANDING_SECOND_FIELD_NUMBER: _ClassVar[int]
    driven_second: float
    metre: float
    square_metre_of_variance: float
    standing_second: float
    def __init__(self, metre: _Optional[float] = ..., driven_second: _Optional[float] = ..., standing_second: _Optional[float] = ..., square_metre_of_variance: _Optional[float] = ...) -> None: ...

class SetEdgeStateReply(_message.Message):
    __slots__ = ["also_changed", "edge", "effect", "journal_sequence", "map_version", "shown"]
    ALSO_CHANGED_FIELD_NUMBER: _ClassVar[int]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    EFFECT_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    SHOWN_FIELD_NUMBER: _ClassVar[int]
    also_changed: _containers.RepeatedCompositeFieldContainer[_common_pb2.EdgeId]
    edge: _graph_pb2.Edge
    effect: EditEffect
    journal_sequence: int
    map_version: int
    shown: int
    def __init__(self, edge: _Optional[_Union[_graph_pb2.Edge, _Mapping]] = ..., also_changed: _Optional[_Iterable[_Union[_common_pb2.EdgeId, _Mapping]]] = ..., journal_sequence: _Optional[int] = ..., map_version: _Optional[int] = ..., effect: _Optional[_Union[EditEffect, _Mapping]] = ..., shown: _Optional[int] = ...) -> None: ...

class SetEdgeStateRequest(_message.Message):
    __slots__ = ["alone", "decided", "dry_run", "edge", "idempotency_key", "note", "shown", "state"]
    ALONE_FIELD_NUMBER: _ClassVar[int]
    DECIDED_FIELD_NUMBER: _ClassVar[int]
    DRY_RUN_FIELD_NUMBER: _ClassVar[int]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    SHOWN_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    alone: bool
    decided: bool
    dry_run: bool
    edge: _common_pb2.EdgeId
    idempotency_key: str
    note: str
    shown: int
    state: _graph_pb2.EdgeState
    def __init__(self, edge: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., state: _Optional[_Union[_graph_pb2.EdgeState, str]] = ..., note: _Optional[str] = ..., idempotency_key: _Optional[str] = ..., decided: bool = ..., dry_run: bool = ..., alone: bool = ..., shown: _Optional[int] = ...) -> None: ...

class SetLabelReply(_message.Message):
    __slots__ = ["journal_sequence", "labels", "map_version"]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    journal_sequence: int
    labels: _containers.RepeatedScalarFieldContainer[str]
    map_version: int
    def __init__(self, labels: _Optional[_Iterable[str]] = ..., journal_sequence: _Optional[int] = ..., map_version: _Optional[int] = ...) -> None: ...

class SetLabelRequest(_message.Message):
    __slots__ = ["frame", "idempotency_key", "label", "remove"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    IDEMPOTENCY_KEY_FIELD_NUMBER: _ClassVar[int]
    LABEL_FIELD_NUMBER: _ClassVar[int]
    REMOVE_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    idempotency_key: str
    label: str
    remove: bool
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., label: _Optional[str] = ..., remove: bool = ..., idempotency_key: _Optional[str] = ...) -> None: ...

class TransformBetweenReply(_message.Message):
    __slots__ = ["a_from_b", "carried", "compounded", "covariance", "distance_m", "edges", "map_version", "unmeasured", "unmeasured_m", "unmeasured_steps"]
    A_FROM_B_FIELD_NUMBER: _ClassVar[int]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    COMPOUNDED_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_M_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_STEPS_FIELD_NUMBER: _ClassVar[int]
    a_from_b: _common_pb2.Transform
    carried: _containers.RepeatedCompositeFieldContainer[_graph_pb2.CarriedStretch]
    compounded: bool
    covariance: _common_pb2.Covariance
    distance_m: float
    edges: int
    map_version: int
    unmeasured: _containers.RepeatedCompositeFieldContainer[UnmeasuredStretch]
    unmeasured_m: float
    unmeasured_steps: int
    def __init__(self, a_from_b: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., edges: _Optional[int] = ..., distance_m: _Optional[float] = ..., map_version: _Optional[int] = ..., compounded: bool = ..., carried: _Optional[_Iterable[_Union[_graph_pb2.CarriedStretch, _Mapping]]] = ..., unmeasured: _Optional[_Iterable[_Union[UnmeasuredStretch, _Mapping]]] = ..., unmeasured_steps: _Optional[int] = ..., unmeasured_m: _Optional[float] = ...) -> None: ...

class TransformBetweenRequest(_message.Message):
    __slots__ = ["a", "b"]
    A_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    a: _common_pb2.FrameId
    b: _common_pb2.FrameId
    def __init__(self, a: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., b: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ...) -> None: ...

class UnmeasuredStretch(_message.Message):
    __slots__ = ["distance_m", "first", "last", "steps"]
    DISTANCE_M_FIELD_NUMBER: _ClassVar[int]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    distance_m: float
    first: _common_pb2.FrameId
    last: _common_pb2.FrameId
    steps: int
    def __init__(self, first: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., last: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., steps: _Optional[int] = ..., distance_m: _Optional[float] = ...) -> None: ...

class RouteBy(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class EdgeOrder(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class ExportFormat(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
