from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor
DOUBT_KIND_CHANGED: DoubtKind
DOUBT_KIND_CONTRADICTION: DoubtKind
DOUBT_KIND_FEW_INLIERS: DoubtKind
DOUBT_KIND_IMPROBABLE: DoubtKind
DOUBT_KIND_LONELY: DoubtKind
DOUBT_KIND_POOR_SPREAD: DoubtKind
DOUBT_KIND_RUNNER_UP: DoubtKind
DOUBT_KIND_TENSION: DoubtKind
DOUBT_KIND_UNSEEN: DoubtKind
DOUBT_KIND_UNSPECIFIED: DoubtKind
EDGE_KIND_LOOP: EdgeKind
EDGE_KIND_ODOMETRY: EdgeKind
EDGE_KIND_PRIOR: EdgeKind
EDGE_KIND_UNSPECIFIED: EdgeKind
EDGE_STATE_ACCEPTED: EdgeState
EDGE_STATE_CANDIDATE: EdgeState
EDGE_STATE_QUARANTINED: EdgeState
EDGE_STATE_REMOVED: EdgeState
EDGE_STATE_UNSPECIFIED: EdgeState
MOTION_SOURCE_CONSTANT_VELOCITY: MotionSource
MOTION_SOURCE_GYRO: MotionSource
MOTION_SOURCE_ONE_EYE: MotionSource
MOTION_SOURCE_START: MotionSource
MOTION_SOURCE_UNSENSED: MotionSource
MOTION_SOURCE_VISION: MotionSource
SESSION_STATE_DELETING: SessionState
SESSION_STATE_ENDED: SessionState
SESSION_STATE_FROZEN: SessionState
SESSION_STATE_OPEN: SessionState

class CarriedStretch(_message.Message):
    __slots__ = ["closures", "first", "last"]
    CLOSURES_FIELD_NUMBER: _ClassVar[int]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    closures: _containers.RepeatedCompositeFieldContainer[_common_pb2.EdgeId]
    first: _common_pb2.FrameId
    last: _common_pb2.FrameId
    def __init__(self, first: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., last: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., closures: _Optional[_Iterable[_Union[_common_pb2.EdgeId, _Mapping]]] = ...) -> None: ...

class Doubt(_message.Message):
    __slots__ = ["kind", "message", "weight"]
    KIND_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    WEIGHT_FIELD_NUMBER: _ClassVar[int]
    kind: DoubtKind
    message: str
    weight: float
    def __init__(self, kind: _Optional[_Union[DoubtKind, str]] = ..., weight: _Optional[float] = ..., message: _Optional[str] = ...) -> None: ...

class Edge(_message.Message):
    __slots__ = ["a", "a_from_b", "b", "bound", "carried", "carried_by", "carries", "consistent_with", "covariance", "driven_s", "history", "id", "inliers", "kind", "measured", "prior_active", "probability", "reason", "source", "spread", "standing_s", "state", "support", "suspicion", "time_us", "uniqueness", "unmeasured", "verification"]
    A_FIELD_NUMBER: _ClassVar[int]
    A_FROM_B_FIELD_NUMBER: _ClassVar[int]
    BOUND_FIELD_NUMBER: _ClassVar[int]
    B_FIELD_NUMBER: _ClassVar[int]
    CARRIED_BY_FIELD_NUMBER: _ClassVar[int]
    CARRIED_FIELD_NUMBER: _ClassVar[int]
    CARRIES_FIELD_NUMBER: _ClassVar[int]
    CONSISTENT_WITH_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    DRIVEN_S_FIELD_NUMBER: _ClassVar[int]
    HISTORY_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    INLIERS_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    MEASURED_FIELD_NUMBER: _ClassVar[int]
    PRIOR_ACTIVE_FIELD_NUMBER: _ClassVar[int]
    PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    SPREAD_FIELD_NUMBER: _ClassVar[int]
    STANDING_S_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    SUPPORT_FIELD_NUMBER: _ClassVar[int]
    SUSPICION_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    UNIQUENESS_FIELD_NUMBER: _ClassVar[int]
    UNMEASURED_FIELD_NUMBER: _ClassVar[int]
    VERIFICATION_FIELD_NUMBER: _ClassVar[int]
    a: _common_pb2.FrameId
    a_from_b: _common_pb2.Transform
    b: _common_pb2.FrameId
    bound: int
    carried: CarriedStretch
    carried_by: _containers.RepeatedCompositeFieldContainer[_common_pb2.EdgeId]
    carries: bool
    consistent_with: _containers.RepeatedCompositeFieldContainer[_common_pb2.EdgeId]
    covariance: _common_pb2.Covariance
    driven_s: float
    history: _containers.RepeatedCompositeFieldContainer[EdgeEvent]
    id: _common_pb2.EdgeId
    inliers: int
    kind: EdgeKind
    measured: Measurement
    prior_active: bool
    probability: float
    reason: _reason_pb2.Reason
    source: MotionSource
    spread: float
    standing_s: float
    state: EdgeState
    support: int
    suspicion: Suspicion
    time_us: int
    uniqueness: Uniqueness
    unmeasured: bool
    verification: _common_pb2.Verification
    def __init__(self, id: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., a: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., b: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., kind: _Optional[_Union[EdgeKind, str]] = ..., state: _Optional[_Union[EdgeState, str]] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., carries: bool = ..., a_from_b: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., support: _Optional[int] = ..., prior_active: bool = ..., source: _Optional[_Union[MotionSource, str]] = ..., driven_s: _Optional[float] = ..., standing_s: _Optional[float] = ..., verification: _Optional[_Union[_common_pb2.Verification, str]] = ..., inliers: _Optional[int] = ..., bound: _Optional[int] = ..., probability: _Optional[float] = ..., spread: _Optional[float] = ..., consistent_with: _Optional[_Iterable[_Union[_common_pb2.EdgeId, _Mapping]]] = ..., history: _Optional[_Iterable[_Union[EdgeEvent, _Mapping]]] = ..., uniqueness: _Optional[_Union[Uniqueness, _Mapping]] = ..., carried_by: _Optional[_Iterable[_Union[_common_pb2.EdgeId, _Mapping]]] = ..., carried: _Optional[_Union[CarriedStretch, _Mapping]] = ..., unmeasured: bool = ..., suspicion: _Optional[_Union[Suspicion, _Mapping]] = ..., time_us: _Optional[int] = ..., measured: _Optional[_Union[Measurement, _Mapping]] = ...) -> None: ...

class EdgeEvent(_message.Message):
    __slots__ = ["author", "cause", "journal_sequence", "note", "reason", "state", "time_us"]
    AUTHOR_FIELD_NUMBER: _ClassVar[int]
    CAUSE_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    author: str
    cause: _common_pb2.EdgeId
    journal_sequence: int
    note: str
    reason: _reason_pb2.Reason
    state: EdgeState
    time_us: int
    def __init__(self, journal_sequence: _Optional[int] = ..., state: _Optional[_Union[EdgeState, str]] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., cause: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., note: _Optional[str] = ..., time_us: _Optional[int] = ..., author: _Optional[str] = ...) -> None: ...

class Frame(_message.Message):
    __slots__ = ["appearance", "appearance_count", "edges", "id", "incoming", "labels", "landmark_count", "landmarks", "mean_error", "observation_count", "observations", "odometry_from_frame", "payload_crc32c", "picture", "thumbnail", "time_us"]
    APPEARANCE_COUNT_FIELD_NUMBER: _ClassVar[int]
    APPEARANCE_FIELD_NUMBER: _ClassVar[int]
    EDGES_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    INCOMING_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    LANDMARKS_FIELD_NUMBER: _ClassVar[int]
    LANDMARK_COUNT_FIELD_NUMBER: _ClassVar[int]
    MEAN_ERROR_FIELD_NUMBER: _ClassVar[int]
    OBSERVATIONS_FIELD_NUMBER: _ClassVar[int]
    OBSERVATION_COUNT_FIELD_NUMBER: _ClassVar[int]
    ODOMETRY_FROM_FRAME_FIELD_NUMBER: _ClassVar[int]
    PAYLOAD_CRC32C_FIELD_NUMBER: _ClassVar[int]
    PICTURE_FIELD_NUMBER: _ClassVar[int]
    THUMBNAIL_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    appearance: _common_pb2.FeatureSet
    appearance_count: int
    edges: _containers.RepeatedCompositeFieldContainer[Edge]
    id: _common_pb2.FrameId
    incoming: _containers.RepeatedCompositeFieldContainer[_common_pb2.EdgeId]
    labels: _containers.RepeatedScalarFieldContainer[str]
    landmark_count: int
    landmarks: _containers.RepeatedCompositeFieldContainer[Landmark]
    mean_error: float
    observation_count: int
    observations: _containers.RepeatedCompositeFieldContainer[Observation]
    odometry_from_frame: _common_pb2.Transform
    payload_crc32c: int
    picture: FramePicture
    thumbnail: bytes
    time_us: int
    def __init__(self, id: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., time_us: _Optional[int] = ..., labels: _Optional[_Iterable[str]] = ..., edges: _Optional[_Iterable[_Union[Edge, _Mapping]]] = ..., incoming: _Optional[_Iterable[_Union[_common_pb2.EdgeId, _Mapping]]] = ..., odometry_from_frame: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., mean_error: _Optional[float] = ..., landmark_count: _Optional[int] = ..., observation_count: _Optional[int] = ..., appearance_count: _Optional[int] = ..., payload_crc32c: _Optional[int] = ..., landmarks: _Optional[_Iterable[_Union[Landmark, _Mapping]]] = ..., observations: _Optional[_Iterable[_Union[Observation, _Mapping]]] = ..., appearance: _Optional[_Union[_common_pb2.FeatureSet, _Mapping]] = ..., thumbnail: _Optional[bytes] = ..., picture: _Optional[_Union[FramePicture, _Mapping]] = ...) -> None: ...

class FramePicture(_message.Message):
    __slots__ = ["data", "height", "message", "reason", "scale", "width"]
    DATA_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SCALE_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    data: bytes
    height: int
    message: str
    reason: _reason_pb2.Reason
    scale: float
    width: int
    def __init__(self, data: _Optional[bytes] = ..., width: _Optional[int] = ..., height: _Optional[int] = ..., scale: _Optional[float] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class LabelledFrames(_message.Message):
    __slots__ = ["frames", "label"]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    LABEL_FIELD_NUMBER: _ClassVar[int]
    frames: _containers.RepeatedCompositeFieldContainer[_common_pb2.FrameId]
    label: str
    def __init__(self, label: _Optional[str] = ..., frames: _Optional[_Iterable[_Union[_common_pb2.FrameId, _Mapping]]] = ...) -> None: ...

class Landmark(_message.Message):
    __slots__ = ["id", "observers", "point"]
    ID_FIELD_NUMBER: _ClassVar[int]
    OBSERVERS_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    id: _common_pb2.LandmarkId
    observers: int
    point: _common_pb2.Vector3
    def __init__(self, id: _Optional[_Union[_common_pb2.LandmarkId, _Mapping]] = ..., point: _Optional[_Union[_common_pb2.Vector3, _Mapping]] = ..., observers: _Optional[int] = ...) -> None: ...

class Measurement(_message.Message):
    __slots__ = ["a_from_b", "covariance"]
    A_FROM_B_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    a_from_b: _common_pb2.Transform
    covariance: _common_pb2.Covariance
    def __init__(self, a_from_b: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ...) -> None: ...

class Observation(_message.Message):
    __slots__ = ["closure", "landmark", "level", "u_left", "u_right", "v"]
    CLOSURE_FIELD_NUMBER: _ClassVar[int]
    LANDMARK_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    U_LEFT_FIELD_NUMBER: _ClassVar[int]
    U_RIGHT_FIELD_NUMBER: _ClassVar[int]
    V_FIELD_NUMBER: _ClassVar[int]
    closure: _common_pb2.EdgeId
    landmark: _common_pb2.LandmarkId
    level: int
    u_left: float
    u_right: float
    v: float
    def __init__(self, landmark: _Optional[_Union[_common_pb2.LandmarkId, _Mapping]] = ..., closure: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ..., u_left: _Optional[float] = ..., v: _Optional[float] = ..., u_right: _Optional[float] = ..., level: _Optional[int] = ...) -> None: ...

class Session(_message.Message):
    __slots__ = ["camera", "first", "first_time_us", "frames", "given_up", "last", "last_time_us", "name", "next_sequence", "number", "oneway", "raw", "refused", "robot", "state", "uuid"]
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    FIRST_TIME_US_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    GIVEN_UP_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    LAST_TIME_US_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    NEXT_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    ONEWAY_FIELD_NUMBER: _ClassVar[int]
    RAW_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    UUID_FIELD_NUMBER: _ClassVar[int]
    camera: _common_pb2.Camera
    first: int
    first_time_us: int
    frames: int
    given_up: int
    last: int
    last_time_us: int
    name: str
    next_sequence: int
    number: int
    oneway: bool
    raw: _common_pb2.RawStereo
    refused: int
    robot: str
    state: SessionState
    uuid: str
    def __init__(self, number: _Optional[int] = ..., uuid: _Optional[str] = ..., robot: _Optional[str] = ..., name: _Optional[str] = ..., camera: _Optional[_Union[_common_pb2.Camera, _Mapping]] = ..., oneway: bool = ..., first: _Optional[int] = ..., last: _Optional[int] = ..., frames: _Optional[int] = ..., first_time_us: _Optional[int] = ..., last_time_us: _Optional[int] = ..., refused: _Optional[int] = ..., given_up: _Optional[int] = ..., next_sequence: _Optional[int] = ..., state: _Optional[_Union[SessionState, str]] = ..., raw: _Optional[_Union[_common_pb2.RawStereo, _Mapping]] = ...) -> None: ...

class Suspicion(_message.Message):
    __slots__ = ["doubts", "remark", "value"]
    DOUBTS_FIELD_NUMBER: _ClassVar[int]
    REMARK_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    doubts: _containers.RepeatedCompositeFieldContainer[Doubt]
    remark: str
    value: float
    def __init__(self, value: _Optional[float] = ..., doubts: _Optional[_Iterable[_Union[Doubt, _Mapping]]] = ..., remark: _Optional[str] = ...) -> None: ...

class Uniqueness(_message.Message):
    __slots__ = ["alike", "changed", "compared", "differs", "runner_up", "runner_up_inliers", "runner_up_probability"]
    ALIKE_FIELD_NUMBER: _ClassVar[int]
    CHANGED_FIELD_NUMBER: _ClassVar[int]
    COMPARED_FIELD_NUMBER: _ClassVar[int]
    DIFFERS_FIELD_NUMBER: _ClassVar[int]
    RUNNER_UP_FIELD_NUMBER: _ClassVar[int]
    RUNNER_UP_INLIERS_FIELD_NUMBER: _ClassVar[int]
    RUNNER_UP_PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    alike: int
    changed: int
    compared: int
    differs: float
    runner_up: _common_pb2.FrameId
    runner_up_inliers: int
    runner_up_probability: float
    def __init__(self, runner_up: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., runner_up_inliers: _Optional[int] = ..., runner_up_probability: _Optional[float] = ..., alike: _Optional[int] = ..., differs: _Optional[float] = ..., compared: _Optional[int] = ..., changed: _Optional[int] = ...) -> None: ...

class EdgeKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class EdgeState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class MotionSource(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class DoubtKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class SessionState(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
