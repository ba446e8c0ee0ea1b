from relmap.v1 import common_pb2 as _common_pb2
from relmap.v1 import reason_pb2 as _reason_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Acknowledgement(_message.Message):
    __slots__ = ["boot_id", "credits", "held", "missing", "next_sequence", "refused", "session", "session_uuid"]
    BOOT_ID_FIELD_NUMBER: _ClassVar[int]
    CREDITS_FIELD_NUMBER: _ClassVar[int]
    HELD_FIELD_NUMBER: _ClassVar[int]
    MISSING_FIELD_NUMBER: _ClassVar[int]
    NEXT_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    boot_id: bytes
    credits: int
    held: _containers.RepeatedCompositeFieldContainer[SequenceRange]
    missing: _containers.RepeatedCompositeFieldContainer[SequenceRange]
    next_sequence: int
    refused: _containers.RepeatedCompositeFieldContainer[Refusal]
    session: int
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., boot_id: _Optional[bytes] = ..., next_sequence: _Optional[int] = ..., held: _Optional[_Iterable[_Union[SequenceRange, _Mapping]]] = ..., missing: _Optional[_Iterable[_Union[SequenceRange, _Mapping]]] = ..., refused: _Optional[_Iterable[_Union[Refusal, _Mapping]]] = ..., credits: _Optional[int] = ..., session: _Optional[int] = ...) -> None: ...

class Gap(_message.Message):
    __slots__ = ["first", "last", "reason", "session_uuid"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    first: int
    last: int
    reason: _reason_pb2.Reason
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., first: _Optional[int] = ..., last: _Optional[int] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ...) -> None: ...

class GetAcknowledgementRequest(_message.Message):
    __slots__ = ["session_uuid"]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ...) -> None: ...

class Hello(_message.Message):
    __slots__ = ["protocol", "robot"]
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    ROBOT_FIELD_NUMBER: _ClassVar[int]
    protocol: _common_pb2.ProtocolVersion
    robot: str
    def __init__(self, protocol: _Optional[_Union[_common_pb2.ProtocolVersion, _Mapping]] = ..., robot: _Optional[str] = ...) -> None: ...

class IngestReply(_message.Message):
    __slots__ = ["acknowledgement", "ended", "localisation", "pace", "welcome"]
    ACKNOWLEDGEMENT_FIELD_NUMBER: _ClassVar[int]
    ENDED_FIELD_NUMBER: _ClassVar[int]
    LOCALISATION_FIELD_NUMBER: _ClassVar[int]
    PACE_FIELD_NUMBER: _ClassVar[int]
    WELCOME_FIELD_NUMBER: _ClassVar[int]
    acknowledgement: Acknowledgement
    ended: SessionEnd
    localisation: Localisation
    pace: Pace
    welcome: Welcome
    def __init__(self, welcome: _Optional[_Union[Welcome, _Mapping]] = ..., acknowledgement: _Optional[_Union[Acknowledgement, _Mapping]] = ..., localisation: _Optional[_Union[Localisation, _Mapping]] = ..., pace: _Optional[_Union[Pace, _Mapping]] = ..., ended: _Optional[_Union[SessionEnd, _Mapping]] = ...) -> None: ...

class IngestRequest(_message.Message):
    __slots__ = ["end", "gap", "hello", "keyframe"]
    END_FIELD_NUMBER: _ClassVar[int]
    GAP_FIELD_NUMBER: _ClassVar[int]
    HELLO_FIELD_NUMBER: _ClassVar[int]
    KEYFRAME_FIELD_NUMBER: _ClassVar[int]
    end: SessionEnd
    gap: Gap
    hello: Hello
    keyframe: KeyframePayload
    def __init__(self, hello: _Optional[_Union[Hello, _Mapping]] = ..., keyframe: _Optional[_Union[KeyframePayload, _Mapping]] = ..., gap: _Optional[_Union[Gap, _Mapping]] = ..., end: _Optional[_Union[SessionEnd, _Mapping]] = ...) -> None: ...

class KeyframePayload(_message.Message):
    __slots__ = ["crc32c", "payload", "sequence", "session_uuid"]
    CRC32C_FIELD_NUMBER: _ClassVar[int]
    PAYLOAD_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    crc32c: int
    payload: bytes
    sequence: int
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., sequence: _Optional[int] = ..., crc32c: _Optional[int] = ..., payload: _Optional[bytes] = ...) -> None: ...

class Localisation(_message.Message):
    __slots__ = ["candidate", "covariance", "frame", "frame_from_keyframe", "sequence", "session", "session_uuid", "withdrawn"]
    CANDIDATE_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    FRAME_FROM_KEYFRAME_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    WITHDRAWN_FIELD_NUMBER: _ClassVar[int]
    candidate: bool
    covariance: _common_pb2.Covariance
    frame: _common_pb2.FrameId
    frame_from_keyframe: _common_pb2.Transform
    sequence: int
    session: int
    session_uuid: bytes
    withdrawn: bool
    def __init__(self, session_uuid: _Optional[bytes] = ..., sequence: _Optional[int] = ..., frame: _Optional[_Union[_common_pb2.FrameId, _Mapping]] = ..., frame_from_keyframe: _Optional[_Union[_common_pb2.Transform, _Mapping]] = ..., covariance: _Optional[_Union[_common_pb2.Covariance, _Mapping]] = ..., withdrawn: bool = ..., session: _Optional[int] = ..., candidate: bool = ...) -> None: ...

class Pace(_message.Message):
    __slots__ = ["rate_hz", "session_uuid"]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    rate_hz: float
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., rate_hz: _Optional[float] = ...) -> None: ...

class Refusal(_message.Message):
    __slots__ = ["crc32c", "message", "reason", "sequence"]
    CRC32C_FIELD_NUMBER: _ClassVar[int]
    MESSAGE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    crc32c: int
    message: str
    reason: _reason_pb2.Reason
    sequence: int
    def __init__(self, sequence: _Optional[int] = ..., crc32c: _Optional[int] = ..., reason: _Optional[_Union[_reason_pb2.Reason, str]] = ..., message: _Optional[str] = ...) -> None: ...

class SequenceRange(_message.Message):
    __slots__ = ["first", "last"]
    FIRST_FIELD_NUMBER: _ClassVar[int]
    LAST_FIELD_NUMBER: _ClassVar[int]
    first: int
    last: int
    def __init__(self, first: _Optional[int] = ..., last: _Optional[int] = ...) -> None: ...

class SessionEnd(_message.Message):
    __slots__ = ["next_sequence", "session_uuid"]
    NEXT_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    SESSION_UUID_FIELD_NUMBER: _ClassVar[int]
    next_sequence: int
    session_uuid: bytes
    def __init__(self, session_uuid: _Optional[bytes] = ..., next_sequence: _Optional[int] = ...) -> None: ...

class Welcome(_message.Message):
    __slots__ = ["boot_id", "map_epoch", "map_uuid", "protocol"]
    BOOT_ID_FIELD_NUMBER: _ClassVar[int]
    MAP_EPOCH_FIELD_NUMBER: _ClassVar[int]
    MAP_UUID_FIELD_NUMBER: _ClassVar[int]
    PROTOCOL_FIELD_NUMBER: _ClassVar[int]
    boot_id: bytes
    map_epoch: int
    map_uuid: bytes
    protocol: _common_pb2.ProtocolVersion
    def __init__(self, protocol: _Optional[_Union[_common_pb2.ProtocolVersion, _Mapping]] = ..., boot_id: _Optional[bytes] = ..., map_uuid: _Optional[bytes] = ..., map_epoch: _Optional[int] = ...) -> None: ...
