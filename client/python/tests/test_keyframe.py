"""The bytes of keyframes are those of C++."""

from __future__ import annotations

import dataclasses
import pathlib
import struct
import uuid
from typing import Iterator, List

import numpy as np
import points_world
import pytest
import relmap
from relmap.camera import RawCamera, RawStereo


def _records(data: bytes) -> Iterator[bytes]:
    position = 0
    while position < len(data):
        (size,) = struct.unpack_from("<I", data, position)
        yield data[position + 4 : position + 4 + size]
        position += 4 + size


def test_keyframes_of_cpp_are_written_as_they_were(keyframe_files: List[pathlib.Path]) -> None:
    with_pictures = 0
    for path in keyframe_files:
        count = 0
        for record in _records(path.read_bytes()):
            keyframe = relmap.decode_keyframe(record)
            assert relmap.encode_keyframe(keyframe) == record
            count += 1
            with_pictures += bool(keyframe.picture)
        assert count > 5
        assert len(list(relmap.read_keyframes(path.read_bytes()))) == count
    assert with_pictures > 5


def _keyframe(**change: object) -> relmap.Keyframe:
    *_, last = points_world.drive(4)
    header = relmap.SessionHeader(uuid.UUID(int=7), "cart", "morning", points_world.CAMERA)
    good = dict(
        header=header, sequence=3, time_us=10**15, T_odom_frame=last.T_odom_frame, step_cov=points_world.STEP_COV,
        source=relmap.MotionSource.VISION, tracks=last.tracks, features=last.features,
    )  # fmt: skip
    return relmap.Keyframe(**{**good, **change})  # type: ignore[arg-type]


def test_a_raw_calibration_and_extensions_are_kept() -> None:
    raw = RawStereo(
        RawCamera(500, 501, 320, 240, 0.1), RawCamera(502, 503, 321, 241, -0.1, 0.01, 1e-3, 2e-3, 1e-4),
        relmap.geometry.exp(np.array([-0.1, 0, 0, 0.01, 0.02, 0.03])), 640, 480,
        relmap.geometry.exp(np.array([0.5, 0.1, 0, 0.3, 0.2, -0.3])),
    )  # fmt: skip
    header = dataclasses.replace(_keyframe().header, raw=raw, oneway=True, extensions=((5, b"five"), (40, b"")))
    keyframe = _keyframe(header=header, extensions=((99, b"later"),))
    data = relmap.encode_keyframe(keyframe)
    again = relmap.decode_keyframe(data)
    assert again.header == keyframe.header and again.extensions == keyframe.extensions
    assert relmap.encode_keyframe(again) == data
    assert struct.unpack_from("<H", data, 4) == (2,)


def test_rotations_are_written_the_same_each_time() -> None:
    rng = np.random.default_rng(11)
    for _ in range(300):
        T = relmap.geometry.exp(np.concatenate([rng.normal(0, 9, 3), rng.normal(0, 1.5, 3)]))
        data = relmap.encode_keyframe(_keyframe(T_odom_frame=T))
        assert relmap.encode_keyframe(relmap.decode_keyframe(data)) == data


def test_hostile_keyframes_are_refused() -> None:
    none = relmap.Tracks.none()
    good = _keyframe()
    outside = dataclasses.replace(good.tracks, u_left=good.tracks.u_left + 600)
    later = dataclasses.replace(good.tracks, sequence=good.tracks.sequence + np.uint32(9))
    mono = dataclasses.replace(good.header, camera=dataclasses.replace(points_world.CAMERA, baseline=0.0))
    for change in (
        {"sequence": -1},
        {"sequence": 2**32 - 1},
        {"time_us": -1},
        {"driven_us": -5},
        {"T_odom_frame": np.full((4, 4), np.nan)},
        {"T_odom_frame": np.eye(3)},
        {"T_odom_frame": np.diag([1.0, 1, 1, 1]) + np.eye(4, k=3) * 1e8},
        {"step_cov": np.zeros((6, 6))},
        {"step_cov": np.eye(3)},
        {"source": relmap.MotionSource.START},
        {"tracks": outside},
        {"tracks": later},
        {"tracks": none},  # features name tracks that are not there
        {"header": mono},
        {"picture": b"GIF89a"},
        {"picture": b"\xff\xd8\xff" + bytes(48 * 1024)},
    ):
        with pytest.raises(ValueError):
            _keyframe(**change)
    for wrong in ("", " ", "x" * 65, "a\nb"):
        with pytest.raises(ValueError):
            dataclasses.replace(good.header, robot=wrong)


def test_damaged_bytes_are_refused() -> None:
    data = relmap.encode_keyframe(_keyframe())
    for size in (0, 3, 40, 200, 400, len(data) - 1):
        with pytest.raises(ValueError):
            relmap.decode_keyframe(data[:size])
    with pytest.raises(ValueError):
        relmap.decode_keyframe(data + b"x")
    with pytest.raises(ValueError):
        relmap.decode_keyframe(b"RMKX" + data[4:])
    with pytest.raises(ValueError):
        relmap.decode_keyframe(data[:4] + b"\x09\x00" + data[6:])
