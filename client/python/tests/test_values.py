"""What is checked before anything is sent, and what results are like."""

from __future__ import annotations

import dataclasses
import datetime
import pathlib
import pickle
import struct
import zlib

import numpy as np
import pytest
import relmap
from relmap import geometry
from relmap.address import ServerAddress, resolve_server
from relmap.crc32c import crc32c
from relmap.graph import EdgeEvent
from relmap.measurements import Features, Tracks
from relmap.pictures import encode_png, picture_bytes
from relmap.requests import as_uuid, edges_request
from relmap.times import as_us


def test_ids_are_read_and_written() -> None:
    frame = relmap.FrameId.parse("3:120")
    assert frame == relmap.FrameId(3, 120) and str(frame) == "3:120"
    assert str(relmap.EdgeId.parse("3:120/1")) == "3:120/1"
    assert relmap.FrameId(1, 9) < relmap.FrameId(1, 10) < relmap.FrameId(2, 0)
    for text in ("", "3", "3:", "3:x", "-1:2", "3:99999999999"):
        with pytest.raises(ValueError):
            relmap.FrameId.parse(text)
    for text in ("3:1", "3:1/", "3:1/x"):
        with pytest.raises(ValueError):
            relmap.EdgeId.parse(text)


def test_exp_and_log_are_inverse() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        xi = rng.normal(0, 1, 6)
        xi[3:] *= min(1.0, 3.1 / np.linalg.norm(xi[3:]))
        T = geometry.check_transform(geometry.exp(xi))
        np.testing.assert_allclose(geometry.log(T), xi, atol=1e-9)
        np.testing.assert_allclose(geometry.inverse(T) @ T, np.eye(4), atol=1e-12)
        step = rng.normal(0, 1e-5, 6)
        right = geometry.log(T @ geometry.exp(step) @ geometry.inverse(T))
        np.testing.assert_allclose(right, geometry.adjoint(T) @ step, atol=1e-9)


def test_rotations_are_the_same_one_by_one_and_all_at_once() -> None:
    axis = np.random.default_rng(4).normal(size=(5, 40, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    angles = np.array([0, 1e-12, 1e-9, 1e-6, 0.1, 1.5, 2.2, 3.1, np.pi - 1e-9, np.pi]).repeat(4)
    phi = axis * angles[:, None]
    R = geometry.so3_exp(phi)
    assert R.shape == (5, 40, 3, 3)
    back = geometry.so3_log(R)
    # Of half a turn either direction of the axis is right.
    same = np.where(np.sum(back * phi, axis=-1, keepdims=True) < 0, -back, back)
    np.testing.assert_allclose(same[:, :-4], back[:, :-4])
    np.testing.assert_allclose(same, phi, atol=1e-8)
    for one, turn, vector in zip(phi[0], R[0], back[0]):
        np.testing.assert_array_equal(geometry.so3_exp(one), turn)
        np.testing.assert_array_equal(geometry.so3_log(turn), vector)


def test_messages_of_transforms_come_back() -> None:
    T = geometry.exp(np.array([1.0, -2, 3, 0.3, -0.2, 2.5]))
    back = geometry.read_transform(geometry.transform_message(T))
    np.testing.assert_allclose(back, T, atol=1e-12)
    cov = np.diag([1.0, 2, 3, 4, 5, 6]) + 0.1
    assert np.array_equal(geometry.read_covariance(geometry.covariance_message(cov)), cov)
    with pytest.raises(ValueError):
        back[0, 0] = 2


@pytest.mark.parametrize(
    "T",
    [np.eye(3), np.full((4, 4), np.nan), np.diag([1.0, 1, -1, 1]), 2 * np.eye(4), [[1, 2], [3, 4]], np.zeros((4, 4))],
)
def test_what_is_no_transform_is_refused(T: object) -> None:
    with pytest.raises(ValueError):
        geometry.check_transform(T)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "cov", [np.zeros((6, 6)), -np.eye(6), np.eye(5), np.full((6, 6), 1.0), np.triu(np.full((6, 6), 0.5)) + np.eye(6)]
)
def test_what_is_no_covariance_is_refused(cov: np.ndarray) -> None:  # type: ignore[type-arg]
    with pytest.raises(ValueError):
        geometry.check_covariance(cov)


def test_cameras_are_checked() -> None:
    good = dict(f=400.0, cx=256.0, cy=192.0, baseline=0.1, width=512, height=384)
    relmap.StereoCamera(**good)  # type: ignore[arg-type]
    for change in ({"f": float("nan")}, {"f": 0}, {"cx": -1}, {"baseline": 11}, {"width": 3}, {"height": 20000}):
        with pytest.raises(ValueError):
            relmap.StereoCamera(**{**good, **change})  # type: ignore[arg-type]


def _decoded_png(data: bytes) -> tuple[int, int, int, bytes]:
    """Width, height, kind of colour and rows of a PNG with filter 2."""
    position, idat, header = 8, b"", b""
    while position < len(data):
        size, kind = struct.unpack(">I4s", data[position : position + 8])
        body = data[position + 8 : position + 8 + size]
        assert struct.unpack(">I", data[position + 8 + size : position + 12 + size])[0] == zlib.crc32(kind + body)
        header, idat = (body, idat) if kind == b"IHDR" else (header, idat + body if kind == b"IDAT" else idat)
        position += 12 + size
    width, height, _, colour = struct.unpack(">IIBB", header[:10])
    return width, height, colour, zlib.decompress(idat)


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (1, 1), (480, 640)])
def test_arrays_become_png(shape: tuple[int, ...]) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    width, height, colour, raw = _decoded_png(encode_png(pixels))
    assert (width, height, colour) == (shape[1], shape[0], 0 if len(shape) == 2 else 2)
    rows = np.frombuffer(raw, np.uint8).reshape(height, -1)
    assert (rows[:, 0] == 2).all()
    assert np.array_equal(np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8), pixels.reshape(height, -1))


@pytest.mark.parametrize(
    "picture",
    [np.zeros((4, 4)), np.zeros((4, 4, 4), np.uint8), np.zeros(4, np.uint8), np.zeros((0, 4), np.uint8), b"GIF89a", b""],
)
def test_what_is_no_picture_is_refused(picture: object) -> None:
    with pytest.raises(ValueError):
        picture_bytes(picture)  # type: ignore[arg-type]


def test_views_are_one_thing() -> None:
    pixels = np.zeros((64, 64), np.uint8)
    assert relmap.View(left=pixels).message.left.data.startswith(b"\x89PNG")
    nan = relmap.Features.none()
    for wrong in (
        {},
        {"left": pixels, "frame": relmap.FrameId(1, 1)},
        {"right": pixels, "frame": relmap.FrameId(1, 1)},
        {"features": nan},
        {"left": pixels, "camera": 0},
        {"frame": relmap.FrameId(1, 1), "camera": 2},
    ):
        with pytest.raises(ValueError):
            relmap.View(**wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="StereoCamera"):
        relmap.View(left=pixels, camera=True)


def _tracks(**change: object) -> Tracks:
    n = 3
    good = dict(
        sequence=np.zeros(n, int), index=np.arange(n), u_left=np.full(n, 9.0), v=np.full(n, 5.0),
        u_right=np.array([8, 7, np.nan]), level=np.zeros(n, int),
    )  # fmt: skip
    return Tracks(**{**good, **change})  # type: ignore[arg-type]


def test_tracks_are_checked() -> None:
    assert len(_tracks()) == 3
    for change in (
        {"u_left": np.array([1, 2, np.nan])},
        {"v": np.full(3, np.inf)},
        {"u_right": np.full(3, np.inf)},
        {"u_right": np.full(3, 10.0)},
        {"level": np.full(3, 8)},
        {"index": np.zeros(3, int)},
        {"index": np.arange(4)},
        {"sequence": np.array([-1, 0, 0])},
        {"sequence": np.array([0.5, 0, 0])},
        {"sequence": np.array([2**33, 0, 0])},
        {"u_left": np.zeros((3, 1))},
    ):
        with pytest.raises(ValueError):
            _tracks(**change)


def test_features_are_checked() -> None:
    def features(n: int = 2, **change: object) -> Features:
        good = dict(
            u=np.ones(n), v=np.ones(n), scale=np.ones(n), angle=np.zeros(n), sift=np.zeros((n, 128), np.uint8)
        )
        return Features(**{**good, **change})  # type: ignore[arg-type]

    assert np.isnan(features().disparity).all() and (features().track == -1).all()
    for change in (
        {"scale": np.zeros(2)},
        {"scale": np.full(2, np.nan)},
        {"disparity": np.full(2, -1.0)},
        {"sift": np.full((2, 128), 0.5)},
        {"sift": np.zeros((2, 64), np.uint8)},
        {"track": np.array([-2, 0])},
        {"u": np.ones(3)},
    ):
        with pytest.raises(ValueError):
            features(**change)
    with pytest.raises(ValueError):
        features(1025)


def test_times_need_a_zone() -> None:
    utc = datetime.timezone.utc
    assert as_us(datetime.datetime(1970, 1, 2, tzinfo=utc)) == 86_400_000_000
    assert as_us(np.int64(5)) == 5  # type: ignore[arg-type]
    with pytest.raises(ValueError):
        as_us(datetime.datetime(2026, 1, 1))
    with pytest.raises(ValueError):
        as_us(-1)
    for wrong in (1.5, "now", True):
        with pytest.raises(TypeError):
            as_us(wrong)  # type: ignore[arg-type]


def test_requests_are_checked() -> None:
    def edges(**change: object) -> object:
        good = dict(
            states=(), kinds=(), session=0, other_session=0, frame=None, since=None, until=None, min_suspicion=0.0,
            around=None, around_edges=0, around_metres=0.0, order=relmap.EdgeOrder.ID,
        )  # fmt: skip
        return edges_request(**{**good, **change})  # type: ignore[arg-type]

    edges()
    for change in (
        {"min_suspicion": float("nan")},
        {"min_suspicion": 2.0},
        {"other_session": 3},
        {"around_edges": 4},
        {"around": "1:2", "around_metres": float("inf")},
        {"frame": "x"},
        {"session": -1},
    ):
        with pytest.raises(ValueError):
            edges(**change)
    with pytest.raises(ValueError):
        as_uuid("no uuid")


def test_records_cannot_be_changed_and_compare_by_contents() -> None:
    a, b = _tracks(), _tracks()
    assert a == b and a != _tracks(v=np.zeros(3)) and not hasattr(a, "__dict__")
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.v = np.zeros(3)  # type: ignore[misc]
    with pytest.raises(ValueError):
        a.v[0] = 1
    with pytest.raises(TypeError):
        hash(a)


def test_crc32c() -> None:
    def slow(data: bytes) -> int:
        register = 0xFFFFFFFF
        for byte in data:
            register ^= byte
            for _ in range(8):
                register = (register >> 1) ^ (0x82F63B78 if register & 1 else 0)
        return register ^ 0xFFFFFFFF

    assert crc32c(b"123456789") == 0xE3069283
    data = np.random.default_rng(5).integers(0, 256, 9000, dtype=np.uint8).tobytes()
    for size in (0, 1, 3, 4, 5, 7, 63, 64, 4095, 4096, 4097, 8191, 9000):
        assert crc32c(data[:size]) == slow(data[:size]), size


def test_addresses_are_found_as_by_cpp(tmp_path: pathlib.Path) -> None:
    def endpoint(text: str) -> ServerAddress:
        (tmp_path / "endpoint").write_text(text)
        return resolve_server(tmp_path)

    assert resolve_server("map.lab:50070") == ServerAddress("map.lab:50070")
    assert resolve_server("unix:/run/relmap/socket").is_socket
    here = endpoint("address 0.0.0.0:5\npid 12\nboot ab\nlater something\n")
    assert here == ServerAddress("localhost:5", "ab", 12) and not here.is_socket
    assert endpoint("address [::]:5\npid 12\nboot ab\n").address == "localhost:5"
    both = endpoint("socket /a b/50%?#/socket\naddress 1.2.3.4:5\npid 1\nboot ab\n")
    assert both.address == "unix:/a b/50%25%3f%23/socket"
    for text in ("", "address nonsense\nboot ab\n", "address 1.2.3.4:5\n", "address 1.2.3.4:99999\nboot ab\n"):
        with pytest.raises(relmap.RelmapError, match="does not say where"):
            endpoint(text)
    for text in ("nowhere", "host:", "host:x", ":5", "host:0", "host:65536"):
        with pytest.raises(relmap.RequestError):
            resolve_server(text)


def test_enumerations_print_as_names() -> None:
    state, later = relmap.EdgeState.ACCEPTED, relmap.Reason(999)
    assert (str(state), repr(state), f"{state}", f"{state:>9}") == ("ACCEPTED", "EdgeState.ACCEPTED", "ACCEPTED", " ACCEPTED")
    assert (str(later), repr(later)) == ("UNKNOWN_999", "Reason.UNKNOWN_999")
    assert state == 2 and f"{state:d}" == "2" and {2: "x"}[state] == "x"
    assert pickle.loads(pickle.dumps(state)) is state
    for member in (relmap.EdgeAction.REMOVE, relmap.EdgeOrder.TIME, relmap.PoseKind.RELATIVE, relmap.RouteBy.TIME, relmap.ExportFormat.TUM):
        assert str(member) == member.name and repr(member) == f"{type(member).__name__}.{member.name}"
    event = EdgeEvent(7, state, relmap.Reason.CONSISTENT, None, "", 0, "")
    assert "state=EdgeState.ACCEPTED, reason=Reason.CONSISTENT" in repr(event)
