from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor
VERIFICATION_COMPOUNDED: Verification
VERIFICATION_EPIPOLAR: Verification
VERIFICATION_HOMOGRAPHY: Verification
VERIFICATION_IMPORTED: Verification
VERIFICATION_NONE: Verification
VERIFICATION_PNP: Verification
VERIFICATION_STEREO: Verification

class Camera(_message.Message):
    __slots__ = ["baseline", "cx", "cy", "f", "height", "width"]
    BASELINE_FIELD_NUMBER: _ClassVar[int]
    CX_FIELD_NUMBER: _ClassVar[int]
    CY_FIELD_NUMBER: _ClassVar[int]
    F_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    baseline: float
    cx: float
    cy: float
    f: float
    height: int
    width: int
    def __init__(self, f: _Optional[float] = ..., cx: _Optional[float] = ..., cy: _Optional[float] = ..., baseline: _Optional[float] = ..., width: _Optional[int] = ..., height: _Optional[int] = ...) -> None: ...

class Covariance(_message.Message):
    __slots__ = ["upper"]
    UPPER_FIELD_NUMBER: _ClassVar[int]
    upper: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, upper: _Optional[_Iterable[float]] = ...) -> None: ...

class EdgeId(_message.Message):
    __slots__ = ["frame", "ordinal"]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    ORDINAL_FIELD_NUMBER: _ClassVar[int]
    frame: FrameId
    ordinal: int
    def __init__(self, frame: _Optional[_Union[FrameId, _Mapping]] = ..., ordinal: _Optional[int] = ...) -> None: ...

class Feature(_message.Message):
    __slots__ = ["angle", "disparity", "scale", "sift", "u", "v"]
    ANGLE_FIELD_NUMBER: _ClassVar[int]
    DISPARITY_FIELD_NUMBER: _ClassVar[int]
    SCALE_FIELD_NUMBER: _ClassVar[int]
    SIFT_FIELD_NUMBER: _ClassVar[int]
    U_FIELD_NUMBER: _ClassVar[int]
    V_FIELD_NUMBER: _ClassVar[int]
    angle: float
    disparity: float
    scale: float
    sift: bytes
    u: float
    v: float
    def __init__(self, u: _Optional[float] = ..., v: _Optional[float] = ..., disparity: _Optional[float] = ..., scale: _Optional[float] = ..., angle: _Optional[float] = ..., sift: _Optional[bytes] = ...) -> None: ...

class FeatureSet(_message.Message):
    __slots__ = ["features"]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    features: _containers.RepeatedCompositeFieldContainer[Feature]
    def __init__(self, features: _Optional[_Iterable[_Union[Feature, _Mapping]]] = ...) -> None: ...

class FrameId(_message.Message):
    __slots__ = ["index", "session"]
    INDEX_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    index: int
    session: int
    def __init__(self, session: _Optional[int] = ..., index: _Optional[int] = ...) -> None: ...

class LandmarkId(_message.Message):
    __slots__ = ["base", "slot"]
    BASE_FIELD_NUMBER: _ClassVar[int]
    SLOT_FIELD_NUMBER: _ClassVar[int]
    base: FrameId
    slot: int
    def __init__(self, base: _Optional[_Union[FrameId, _Mapping]] = ..., slot: _Optional[int] = ...) -> None: ...

class Picture(_message.Message):
    __slots__ = ["data"]
    DATA_FIELD_NUMBER: _ClassVar[int]
    data: bytes
    def __init__(self, data: _Optional[bytes] = ...) -> None: ...

class ProtocolVersion(_message.Message):
    __slots__ = ["major", "minor"]
    MAJOR_FIELD_NUMBER: _ClassVar[int]
    MINOR_FIELD_NUMBER: _ClassVar[int]
    major: int
    minor: int
    def __init__(self, major: _Optional[int] = ..., minor: _Optional[int] = ...) -> None: ...

class Quaternion(_message.Message):
    __slots__ = ["w", "x", "y", "z"]
    W_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    w: float
    x: float
    y: float
    z: float
    def __init__(self, w: _Optional[float] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class RawCamera(_message.Message):
    __slots__ = ["cx", "cy", "fx", "fy", "k1", "k2", "k3", "p1", "p2"]
    CX_FIELD_NUMBER: _ClassVar[int]
    CY_FIELD_NUMBER: _ClassVar[int]
    FX_FIELD_NUMBER: _ClassVar[int]
    FY_FIELD_NUMBER: _ClassVar[int]
    K1_FIELD_NUMBER: _ClassVar[int]
    K2_FIELD_NUMBER: _ClassVar[int]
    K3_FIELD_NUMBER: _ClassVar[int]
    P1_FIELD_NUMBER: _ClassVar[int]
    P2_FIELD_NUMBER: _ClassVar[int]
    cx: float
    cy: float
    fx: float
    fy: float
    k1: float
    k2: float
    k3: float
    p1: float
    p2: float
    def __init__(self, fx: _Optional[float] = ..., fy: _Optional[float] = ..., cx: _Optional[float] = ..., cy: _Optional[float] = ..., k1: _Optional[float] = ..., k2: _Optional[float] = ..., p1: _Optional[float] = ..., p2: _Optional[float] = ..., k3: _Optional[float] = ...) -> None: ...

class RawStereo(_message.Message):
    __slots__ = ["height", "left", "right", "right_from_left", "width"]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FROM_LEFT_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    height: int
    left: RawCamera
    right: RawCamera
    right_from_left: Transform
    width: int
    def __init__(self, left: _Optional[_Union[RawCamera, _Mapping]] = ..., right: _Optional[_Union[RawCamera, _Mapping]] = ..., right_from_left: _Optional[_Union[Transform, _Mapping]] = ..., width: _Optional[int] = ..., height: _Optional[int] = ...) -> None: ...

class Transform(_message.Message):
    __slots__ = ["rotation", "translation"]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    TRANSLATION_FIELD_NUMBER: _ClassVar[int]
    rotation: Quaternion
    translation: Vector3
    def __init__(self, rotation: _Optional[_Union[Quaternion, _Mapping]] = ..., translation: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class Vector3(_message.Message):
    __slots__ = ["x", "y", "z"]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class View(_message.Message):
    __slots__ = ["camera", "either_eye", "features", "frame", "left", "raw", "rectified", "right", "session", "supposed"]
    CAMERA_FIELD_NUMBER: _ClassVar[int]
    EITHER_EYE_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    LEFT_FIELD_NUMBER: _ClassVar[int]
    RAW_FIELD_NUMBER: _ClassVar[int]
    RECTIFIED_FIELD_NUMBER: _ClassVar[int]
    RIGHT_FIELD_NUMBER: _ClassVar[int]
    SESSION_FIELD_NUMBER: _ClassVar[int]
    SUPPOSED_FIELD_NUMBER: _ClassVar[int]
    camera: Camera
    either_eye: bool
    features: FeatureSet
    frame: FrameId
    left: Picture
    raw: RawStereo
    rectified: bool
    right: Picture
    session: int
    supposed: bool
    def __init__(self, left: _Optional[_Union[Picture, _Mapping]] = ..., features: _Optional[_Union[FeatureSet, _Mapping]] = ..., frame: _Optional[_Union[FrameId, _Mapping]] = ..., right: _Optional[_Union[Picture, _Mapping]] = ..., camera: _Optional[_Union[Camera, _Mapping]] = ..., raw: _Optional[_Union[RawStereo, _Mapping]] = ..., session: _Optional[int] = ..., rectified: bool = ..., supposed: bool = ..., either_eye: bool = ...) -> None: ...

class Verification(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
