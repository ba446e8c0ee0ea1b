"""Keyframes and their bytes, which are the same over LCM and gRPC and in the journal (docs/protocol.md, Keyframes)."""

from __future__ import annotations

import io
import os
import struct
import uuid as uuids
from dataclasses import dataclass, field
from typing import BinaryIO, Iterator, Sequence, Tuple, Union

import numpy as np

from relmap.camera import RawCamera, RawStereo, StereoCamera
from relmap.geometry import (
    Array,
    canonical_quaternion,
    check_covariance,
    check_transform,
    covariance_of_upper,
    frozen,
    matrix_of_quaternion,
    upper_triangle,
)
from relmap.graph import MotionSource
from relmap.measurements import Features, Tracks
from relmap.record import Record

MAX_KEYFRAME_BYTES = 256 * 1024
"""The most bytes of a keyframe."""
MAX_PICTURE_BYTES = 48 * 1024
"""The most bytes of a keyframe's picture."""

Extension = Tuple[int, bytes]
"""What a later version added: its tag, and its bytes, which are kept as they are."""

_HEAD = struct.Struct("<4sHBB16s")
_CAMERA = struct.Struct("<4d2i")
_BEGIN = struct.Struct("<Iq")
_MOTION = struct.Struct("<7d21d2q")
_COUNTS = struct.Struct("<3H")
_TRACK = np.dtype([("sequence", "<u4"), ("index", "<u4"), ("u_left", "<f4"), ("v", "<f4"), ("u_right", "<f4"), ("level", "u1")])
_FEATURE = np.dtype(
    [("u", "<f4"), ("v", "<f4"), ("disparity", "<f4"), ("scale", "<f4"), ("angle", "<f4"), ("track", "<i2"), ("sift", "u1", 128)]
)
_MAGIC = b"RMKF"
_RAW_TAG = 21
_RAW = struct.Struct("<2iB18d24d")


def check_name(what: str, name: str) -> str:
    """The same name. ValueError: empty, only white space, over 64 bytes of UTF-8, or with a control character."""
    if not isinstance(name, str):
        raise TypeError(f"{what} is a text, not {type(name).__name__}")
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        raise ValueError(f"{what} is not UTF-8") from None
    if not name.strip():
        raise ValueError(f"{what} is empty, or nothing but white space")
    if size > 64:
        raise ValueError(f"{what} of {size} bytes; at most 64")
    if any(ord(c) < 0x20 or 0x7F <= ord(c) < 0xA0 for c in name):
        raise ValueError(f"{what} holds a control character")
    return name


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SessionHeader(Record):
    """What a session begins with, and every keyframe repeats. ValueError: a name, or a nil uuid.

    Attributes:
        uuid: of the session.
        robot, name: for display; 1..64 bytes of UTF-8.
        camera: rectified; with baseline 0 the session is mono: its keyframes have no tracks, motion and disparities.
        oneway: its edges may be travelled only in the direction driven.
        raw: before rectification; None: the pictures came rectified.
        extensions: of a later version, ascending by tag.
    """

    uuid: uuids.UUID
    robot: str
    name: str
    camera: StereoCamera
    oneway: bool = False
    raw: "RawStereo | None" = None
    extensions: Tuple[Extension, ...] = ()

    def __post_init__(self) -> None:
        check_name("robot", self.robot)
        check_name("name", self.name)
        if self.uuid.int == 0:
            raise ValueError("the session's uuid is nil")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Keyframe(Record):
    """A keyframe, as a robot sends it.

    ValueError if relmapd would refuse it: NaN, wrong shapes, a measurement outside the picture, ...

    Attributes:
        header: of its session.
        sequence: becomes the index of the frame; there may be gaps.
        time_us: microseconds UTC.
        T_odom_frame: 4 x 4, pose in the session's own odometry frame, metres.
        step_cov: 6 x 6, covariance of T_previous_this exp(xi); zeros if `source` is START.
        source: where the motion since the previous keyframe comes from.
        driven_us, standing_us: microseconds since the previous keyframe spent driving (faster than 0.05 m/s) and standing.
        tracks: from which landmarks are made.
        features: by which the place is recognised.
        picture: grey JPEG of the rectified left picture, or empty.
        extensions: of a later version, ascending by tag.
    """

    header: SessionHeader
    sequence: int
    time_us: int
    T_odom_frame: Array
    step_cov: Array
    source: MotionSource
    driven_us: int = 0
    standing_us: int = 0
    tracks: Tracks = field(default_factory=Tracks.none)
    features: Features = field(default_factory=Features.none)
    picture: bytes = b""
    extensions: Tuple[Extension, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.sequence < 2**32 - 1:
            raise ValueError(f"sequence is {self.sequence}; must be 0..{2**32 - 2}")
        for name in ("time_us", "driven_us", "standing_us"):
            if not 0 <= getattr(self, name) <= 2**53:
                raise ValueError(f"{name} is {getattr(self, name)}; must be 0..2^53")
        T = check_transform(self.T_odom_frame, "T_odom_frame")
        if np.abs(T[:3, 3]).max() > 1e7:
            raise ValueError(f"T_odom_frame is {np.linalg.norm(T[:3, 3]):g} m from its origin; at most 1e7")
        object.__setattr__(self, "T_odom_frame", frozen(T))
        cov = np.array(self.step_cov, dtype=float)
        if self.source == MotionSource.START:
            if cov.shape != (6, 6) or cov.any():
                raise ValueError("the first keyframe has no step: step_cov must be zeros (6, 6)")
        else:
            cov = check_covariance(cov, "step_cov")
        object.__setattr__(self, "step_cov", frozen(cov))
        self._check_measurements()
        if self.picture and not self.picture.startswith(b"\xff\xd8\xff"):
            raise ValueError("the picture is no JPEG")
        if len(self.picture) > MAX_PICTURE_BYTES:
            raise ValueError(f"a picture of {len(self.picture)} bytes; at most {MAX_PICTURE_BYTES}")

    def _check_measurements(self) -> None:
        camera, tracks, features = self.header.camera, self.tracks, self.features
        if not camera.is_stereo and len(tracks):
            raise ValueError("tracks need metres, and a mono camera has none")
        if not camera.is_stereo and not np.isnan(features.disparity).all():
            raise ValueError("a mono camera measures no disparities")
        if len(tracks) and tracks.sequence.max() > self.sequence:
            raise ValueError(f"a track of keyframe {tracks.sequence.max()}, which is after this one, {self.sequence}")
        for what, u, v in (
            ("a track", tracks.u_left, tracks.v),
            ("a track's u_right", tracks.u_right, tracks.v),
            ("a feature", features.u, features.v),
        ):
            outside = (u < -0.5) | (u > camera.width - 0.5) | (v < -0.5) | (v > camera.height - 0.5)
            if outside.any():
                i = int(np.argmax(outside))
                raise ValueError(f"{what} at ({u[i]}, {v[i]}), outside the picture")
        if np.any(features.disparity > camera.width):
            raise ValueError("a disparity larger than the picture")
        if len(features) and features.track.max() >= len(tracks):
            raise ValueError(f"a feature of track {features.track.max()} among {len(tracks)}")


def _canonical_nan(values: Array) -> Array:
    return np.where(np.isnan(values), np.float32(np.nan), values)


def _put_extensions(extensions: Sequence[Extension]) -> bytes:
    parts = [struct.pack("<H", len(extensions))]
    for tag, data in extensions:
        parts += [struct.pack("<II", tag, len(data)), data]
    return b"".join(parts)


def _raw_camera_numbers(camera: "RawCamera | None") -> Iterator[float]:
    for name in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"):
        yield getattr(camera, name) if camera else 0.0


def _encode_raw(raw: RawStereo) -> bytes:
    numbers = [*_raw_camera_numbers(raw.left), *_raw_camera_numbers(raw.right)]
    for T in (raw.T_right_left, raw.T_body_left):
        numbers += [*T[:3, :3].T.ravel().tolist(), *T[:3, 3].tolist()]
    return _RAW.pack(raw.width, raw.height, 0, *numbers)


def _decode_raw(data: bytes) -> RawStereo:
    if len(data) != _RAW.size:
        raise ValueError("the session's raw calibration is malformed")
    width, height, rectified, *numbers = _RAW.unpack(data)
    if rectified:
        raise ValueError("the session's raw calibration is rectified")
    right = numbers[9:18]
    T = np.tile(np.eye(4), (2, 1, 1))
    for i, twelve in enumerate((numbers[18:30], numbers[30:42])):
        T[i, :3, :3] = np.array(twelve[:9]).reshape(3, 3).T
        T[i, :3, 3] = twelve[9:]
    return RawStereo(RawCamera(*numbers[:9]), RawCamera(*right) if any(right) else None, T[0], width, height, T[1])


def _header_extensions(header: SessionHeader) -> Tuple[Extension, ...]:
    if header.raw is None:
        return header.extensions
    return tuple(sorted((*header.extensions, (_RAW_TAG, _encode_raw(header.raw)))))


def encode_keyframe(keyframe: Keyframe) -> bytes:
    """The bytes of a keyframe; equal keyframes give equal bytes. ValueError: more than 256 KiB."""
    header = keyframe.header
    of_header = _header_extensions(header)
    extended = bool(of_header or keyframe.extensions)
    robot, name = header.robot.encode(), header.name.encode()
    camera, t, f = header.camera, keyframe.tracks, keyframe.features
    tracks = np.empty(len(t), _TRACK)
    for column in ("sequence", "index", "u_left", "v", "level"):
        tracks[column] = getattr(t, column)
    tracks["u_right"] = _canonical_nan(t.u_right)
    features = np.empty(len(f), _FEATURE)
    for column in ("u", "v", "scale", "angle", "track", "sift"):
        features[column] = getattr(f, column)
    features["disparity"] = _canonical_nan(f.disparity)
    parts = [
        _HEAD.pack(_MAGIC, 2 if extended else 1, int(header.oneway), int(keyframe.source), header.uuid.bytes),
        struct.pack("<H", len(robot)) + robot,
        struct.pack("<H", len(name)) + name,
        _CAMERA.pack(camera.f, camera.cx, camera.cy, camera.baseline, camera.width, camera.height),
        _BEGIN.pack(keyframe.sequence, keyframe.time_us),
        _MOTION.pack(
            *canonical_quaternion(keyframe.T_odom_frame[:3, :3]),
            *keyframe.T_odom_frame[:3, 3].tolist(),
            *upper_triangle(keyframe.step_cov).tolist(),
            keyframe.driven_us,
            keyframe.standing_us,
        ),
        _COUNTS.pack(len(t), len(f), len(keyframe.picture)),
        tracks.tobytes(),
        features.tobytes(),
        keyframe.picture,
    ]
    if extended:
        parts += [_put_extensions(of_header), _put_extensions(keyframe.extensions)]
    data = b"".join(parts)
    if len(data) > MAX_KEYFRAME_BYTES:
        raise ValueError(f"a keyframe of {len(data)} bytes; at most {MAX_KEYFRAME_BYTES}")
    return data


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.position = 0

    def take(self, size: int) -> bytes:
        end = self.position + size
        if end > len(self.data):
            raise ValueError(f"keyframe of {len(self.data)} bytes ends early, after {self.position}")
        taken = self.data[self.position : end]
        self.position = end
        return taken

    def unpack(self, form: struct.Struct) -> Tuple[object, ...]:
        return form.unpack(self.take(form.size))

    def text(self) -> str:
        (size,) = struct.unpack("<H", self.take(2))
        return self.take(size).decode()

    def extensions(self) -> Tuple[Extension, ...]:
        (count,) = struct.unpack("<H", self.take(2))
        found = []
        for _ in range(count):
            tag, size = struct.unpack("<II", self.take(8))
            found.append((tag, self.take(size)))
        return tuple(found)


def decode_keyframe(data: bytes) -> Keyframe:
    """The keyframe of its bytes; encode_keyframe() gives the same bytes again. ValueError: it is none, or relmapd would
    refuse it."""
    reader = _Reader(bytes(data))
    magic, version, flags, source, uuid = _HEAD.unpack(reader.take(_HEAD.size))
    if magic != _MAGIC:
        raise ValueError("the bytes are no keyframe")
    if version not in (1, 2):
        raise ValueError(f"keyframe of version {version}; known: up to 2")
    if flags & ~1:
        raise ValueError(f"unknown flags {flags}")
    robot, name = reader.text(), reader.text()
    f, cx, cy, baseline, width, height = _CAMERA.unpack(reader.take(_CAMERA.size))
    sequence, time_us = _BEGIN.unpack(reader.take(_BEGIN.size))
    motion = _MOTION.unpack(reader.take(_MOTION.size))
    n_tracks, n_features, n_picture = _COUNTS.unpack(reader.take(_COUNTS.size))
    tracks = np.frombuffer(reader.take(n_tracks * _TRACK.itemsize), _TRACK)
    features = np.frombuffer(reader.take(n_features * _FEATURE.itemsize), _FEATURE)
    picture = reader.take(n_picture)
    of_header = reader.extensions() if version == 2 else ()
    of_keyframe = reader.extensions() if version == 2 else ()
    if version == 2 and not of_header and not of_keyframe:
        raise ValueError("a keyframe of version 2 without extensions; it must be written as version 1")
    if reader.position != len(reader.data):
        raise ValueError(f"{len(reader.data) - reader.position} bytes after the keyframe's end")
    T = np.eye(4)
    T[:3, :3] = matrix_of_quaternion(*motion[:4])
    T[:3, 3] = motion[4:7]
    raw = [ext for ext in of_header if ext[0] == _RAW_TAG]
    header = SessionHeader(
        uuids.UUID(bytes=uuid),
        robot,
        name,
        StereoCamera(f, cx, cy, baseline, width, height),
        bool(flags & 1),
        _decode_raw(raw[0][1]) if raw else None,
        tuple(ext for ext in of_header if ext[0] != _RAW_TAG),
    )
    return Keyframe(
        header=header,
        sequence=sequence,
        time_us=time_us,
        T_odom_frame=T,
        step_cov=covariance_of_upper(motion[7:28]),
        source=MotionSource(source),
        driven_us=motion[28],
        standing_us=motion[29],
        tracks=Tracks(*(tracks[name] for name in ("sequence", "index", "u_left", "v", "u_right", "level"))),
        features=Features(
            *(features[name] for name in ("u", "v", "scale", "angle", "sift", "disparity", "track"))
        ),
        picture=picture,
        extensions=of_keyframe,
    )


def _parts(file: BinaryIO) -> Iterator[bytes]:
    while head := file.read(4):
        if len(head) < 4:
            raise ValueError("the file of keyframes ends within a length")
        (size,) = struct.unpack("<I", head)
        if size > MAX_KEYFRAME_BYTES:
            raise ValueError(f"a keyframe of {size} bytes, at most {MAX_KEYFRAME_BYTES}: is this a file of keyframes?")
        data = file.read(size)
        if len(data) < size:
            raise ValueError(f"the file of keyframes ends within a keyframe, {size - len(data)} bytes early")
        yield data


def read_keyframes(file: Union[bytes, str, "os.PathLike[str]"]) -> Iterator[Keyframe]:
    """The keyframes of a file as relmap-sim and `relmap-frontend --out` write it: u32 length, then the bytes, of each. They
    are read one by one, so the file may be larger than the memory.

    Args:
        file: its path, or its bytes.

    Raises:
        ValueError: the file is none, or ends early; what comes before is given out.
        OSError: the file cannot be read.
    """
    with io.BytesIO(file) if isinstance(file, bytes) else open(file, "rb") as opened:
        for data in _parts(opened):
            yield decode_keyframe(data)
