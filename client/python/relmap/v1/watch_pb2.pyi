from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import graph_pb2 as _graph_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from relmap.v1 import status_pb2 as _status_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor
WATCH_FROM_NOW: WatchFrom
WATCH_FROM_OLDEST: WatchFrom
WATCH_FROM_UNSPECIFIED: WatchFrom

class AddedFrame(_message.Message):
    __slots__ = ["frame", "previous_from_this", "source", "time_us"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    PREVIOUS_FROM_THIS_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    previous_from_this: _common_pb2.Transform
    source: _graph_pb2.MotionSource
    time_us: int
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., time_us: _Optional[int] = ..., previous_from_this: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., source: _Optional[_Union[_graph_pb2.MotionSource, str]] = ...) -> None: ...

class CaughtUp(_message.Message):
    __slots__ = ["journal_sequence", "time_us"]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    journal_sequence: int
    time_us: int
    def __init__(self, journal_sequence: _Optional[int] = ..., time_us: _Optional[int] = ...) -> None: ...

class EdgeRemoved(_message.Message):
    __slots__ = ["edge"]
    EDGE_FIELD_NUMBER: _ClassVar[int]
    edge: _common_pb2.EdgeId
    def __init__(self, edge: _Optional[_Union[_common_pb2.EdgeId, _Mapping]] = ...) -> None: ...

class FrameLabels(_message.Message):
    __slots__ = ["frame", "labels"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    LABELS_FIELD_NUMBER: _ClassVar[int]
    frame: _common_pb2.FrameId
    labels: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., labels: _Optional[_Iterable[str]] = ...) -> None: ...

class FrameRange(_message.Message):
    __slots__ = ["first", "last", "session"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    first: int
    last: int
    session: int
    def __init__(self, session: _Optional[int] = ..., first: _Optional[int] = ..., last: _Optional[int] = ...) -> None: ...

class FramesAdded(_message.Message):
    __slots__ = ["frames"]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    frames: _containers.RepeatedCompositeFieldContainer[AddedFrame]
    def __init__(self, frames: _Optional[_Iterable[_Union[AddedFrame, _Mapping]]] = ...) -> None: ...

class FramesMoved(_message.Message):
    __slots__ = ["frames", "ranges"]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    RANGES_FIELD_NUMBER: _ClassVar[int]
    frames: _containers.RepeatedCompositeFieldContainer[_common_pb2.FrameId]
    ranges: _containers.RepeatedCompositeFieldContainer[FrameRange]
    def __init__(self, frames: _Optional[_Iterable[_Union[_common_pb2.FrameId, _Mapping]]] = ..., ranges: _Optional[_Iterable[_Union[FrameRange, _Mapping]]] = ...) -> None: ...

class FramesRemoved(_message.Message):
    __slots__ = ["first", "session"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    first: int
    session: int
    def __init__(self, session: _Optional[int] = ..., first: _Optional[int] = ...) -> None: ...

class MapEvent(_message.Message):
    __slots__ = ["author", "caught_up", "edge_changed", "edge_removed", "frame_added", "frame_labels", "frames_added", "frames_moved", "frames_removed", "journal_sequence", "label_changed", "map_version", "note", "resume_token", "resync", "robot_changed", "session_changed", "session_deleted", "skipped", "storage_changed", "time_us"]
    AUTHOR_FIELD_NUMBER: _ClassVar[int]
    CAUGHT_UP_FIELD_NUMBER: _ClassVar[int]
    EDGE_CHANGED_FIELD_NUMBER: _ClassVar[int]
    EDGE_REMOVED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_ADDED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_MOVED_FIELD_NUMBER: _ClassVar[int]
    FRAMES_REMOVED_FIELD_NUMBER: _ClassVar[int]
    FRAME_ADDED_FIELD_NUMBER: _ClassVar[int]
    FRAME_LABELS_FIELD_NUMBER: _ClassVar[int]
    JOURNAL_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    LABEL_CHANGED_FIELD_NUMBER: _ClassVar[int]
    MAP_VERSION_FIELD_NUMBER: _ClassVar[int]
    NOTE_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    RESYNC_FIELD_NUMBER: _ClassVar[int]
    ROBOT_CHANGED_FIELD_NUMBER: _ClassVar[int]
    SESSION_CHANGED_FIELD_NUMBER: _ClassVar[int]
    SESSION_DELETED_FIELD_NUMBER: _ClassVar[int]
    SKIPPED_FIELD_NUMBER: _ClassVar[int]
    STORAGE_CHANGED_FIELD_NUMBER: _ClassVar[int]
    TIME_US_FIELD_NUMBER: _ClassVar[int]
    author: str
    caught_up: CaughtUp
    edge_changed: _graph_pb2.Edge
    edge_removed: EdgeRemoved
    frame_added: _common_pb2.FrameId
    frame_labels: FrameLabels
    frames_added: FramesAdded
    frames_moved: FramesMoved
    frames_removed: FramesRemoved
    journal_sequence: int
    label_changed: _graph_pb2.LabelledFrames
    map_version: int
    note: str
    resume_token: str
    resync: Resync
    robot_changed: _status_pb2.Robot
    session_changed: _graph_pb2.Session
    session_deleted: SessionDeleted
    skipped: SkippedSequences
    storage_changed: StorageState
    time_us: int
    def __init__(self, session_changed: _Optional[_Union[_graph_pb2.Session, _Mapping]] = ..., frame_added: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., edge_changed: _Optional[_Union[_graph_pb2.Edge, _Mapping]] = ..., frames_moved: _Optional[_Union[FramesMoved, _Mapping]] = ..., label_changed: _Optional[_Union[_graph_pb2.LabelledFrames, _Mapping]] = ..., frames_added: _Optional[_Union[FramesAdded, _Mapping]] = ..., skipped: _Optional[_Union[SkippedSequences, _Mapping]] = ..., frames_removed: _Optional[_Union[FramesRemoved, _Mapping]] = ..., session_deleted: _Optional[_Union[SessionDeleted, _Mapping]] = ..., edge_removed: _Optional[_Union[EdgeRemoved, _Mapping]] = ..., frame_labels: _Optional[_Union[FrameLabels, _Mapping]] = ..., robot_changed: _Optional[_Union[_status_pb2.Robot, _Mapping]] = ..., storage_changed: _Optional[_Union[StorageState, _Mapping]] = ..., resync: _Optional[_Union[Resync, _Mapping]] = ..., caught_up: _Optional[_Union[CaughtUp, _Mapping]] = ..., resume_token: _Optional[str] = ..., map_version: _Optional[int] = ..., time_us: _Optional[int] = ..., author: _Optional[str] = ..., journal_sequence: _Optional[int] = ..., note: _Optional[str] = ...) -> None: ...

class Resync(_message.Message):
    __slots__ = ["message", "missed_after", "missed_before", "reason"]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    MISSED_AFTER_FIELD_NUMBER: _ClassVar[int]
    MISSED_BEFORE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    message: str
    missed_after: int
    missed_before: int
    reason: _reason_pb2.Reason
    def __init__(self, reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ..., missed_after: _Optional[int] = ..., missed_before: _Optional[int] = ...) -> None: ...

class SessionDeleted(_message.Message):
    __slots__ = ["session", "uuid"]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    UUID_FIELD_NUMBER: _ClassVar[int]
    session: int
    uuid: str
    def __init__(self, session: _Optional[int] = ..., uuid: _Optional[str] = ...) -> None: ...

class SkippedSequences(_message.Message):
    __slots__ = ["first", "last", "reason", "refused", "session"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    first: int
    last: int
    reason: _reason_pb2.Reason
    refused: bool
    session: int
    def __init__(self, session: _Optional[int] = ..., first: _Optional[int] = ..., last: _Optional[int] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., refused: bool = ...) -> None: ...

class StorageState(_message.Message):
    __slots__ = ["message", "reason"]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    message: str
    reason: _reason_pb2.Reason
    def __init__(self, reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class WatchMapRequest(_message.Message):
    __slots__ = ["no_frames", "resume_token", "sessions"]
    FROM_FIELD_NUMBER: _ClassVar[int]
    NO_FRAMES_FIELD_NUMBER: _ClassVar[int]
    RESUME_TOKEN_FIELD_NUMBER: _ClassVar[int]
    SESSIONS_FIELD_NUMBER: _ClassVar[int]
    no_frames: bool
    resume_token: str
    sessions: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, sessions: _Optional[_Iterable[int]] = ..., resume_token: _Optional[str] = ..., no_frames: bool = ..., **kwargs) -> None: ...

class WatchFrom(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
