"""Reasons and exceptions."""

from __future__ import annotations

import grpc
import numpy as np
import pytest
import relmap
from relmap.errors import error_of, error_of_rpc
from relmap.graph import DoubtKind, EdgeKind, EdgeState, MotionSource, SessionState, Verification
from relmap.v1 import common_pb2, graph_pb2, reason_pb2


def test_reasons_are_those_of_the_protocol() -> None:
    wire = {name.removeprefix("REASON_"): number for name, number in reason_pb2.Reason.items()}
    assert {reason.name: int(reason) for reason in relmap.Reason} == wire


@pytest.mark.parametrize(
    "kind, wire, prefix",
    [
        (EdgeKind, graph_pb2.EdgeKind, "EDGE_KIND_"),
        (EdgeState, graph_pb2.EdgeState, "EDGE_STATE_"),
        (MotionSource, graph_pb2.MotionSource, "MOTION_SOURCE_"),
        (SessionState, graph_pb2.SessionState, "SESSION_STATE_"),
        (DoubtKind, graph_pb2.DoubtKind, "DOUBT_KIND_"),
        (Verification, common_pb2.Verification, "VERIFICATION_"),
    ],
)
def test_enumerations_are_those_of_the_protocol(kind, wire, prefix) -> None:  # type: ignore[no-untyped-def]
    assert {e.name: int(e) for e in kind} == {name.removeprefix(prefix): number for name, number in wire.items()}
    assert kind(77).name == "UNKNOWN_77"


def test_every_reason_has_a_class_of_its_group() -> None:
    expected = {
        "TIME_BACKWARDS": relmap.RobotDataError,
        "NO_SUCH_FRAME": relmap.RequestError,
        "NEW_PLACE": relmap.PlaceNotRecognised,
        "WRONG_STATE": relmap.ClosureStateError,
        "DISK_FULL": relmap.DaemonError,
        "UNREACHABLE": relmap.Unreachable,
        "DEADLINE": relmap.DeadlineExceeded,
        "VIEW_EXPIRED": relmap.ViewExpired,
        "NOT_ALLOWED": relmap.AccessError,
        "ROWS_APART": relmap.CameraError,
    }
    for name, kind in expected.items():
        assert type(error_of(relmap.Reason[name], "why")) is kind
    for reason in relmap.Reason:
        if reason != relmap.Reason.OK:
            assert type(error_of(reason, "why")) is not relmap.RelmapError, reason
    assert issubclass(relmap.Unreachable, ConnectionError) and issubclass(relmap.DeadlineExceeded, TimeoutError)


class _Failed:
    def __init__(self, code: grpc.StatusCode, details: bytes = b"") -> None:
        self._code, self._details = code, details

    def code(self) -> grpc.StatusCode:
        return self._code

    def details(self) -> str:
        return "said by gRPC"

    def trailing_metadata(self):  # type: ignore[no-untyped-def]
        return (("grpc-status-details-bin", self._details),) if self._details else None


def test_errors_come_from_the_details() -> None:
    details = reason_pb2.Error(reason=reason_pb2.REASON_NO_SUCH_EDGE, message="no 1:2/3", request_id="r-1")
    error = error_of_rpc(_Failed(grpc.StatusCode.NOT_FOUND, details.SerializeToString()))
    assert type(error) is relmap.RequestError
    assert (error.reason, error.message, error.request_id) == (relmap.Reason.NO_SUCH_EDGE, "no 1:2/3", "r-1")
    assert str(error) == "NO_SUCH_EDGE: no 1:2/3"


def test_a_reason_of_a_newer_daemon_is_told_with_its_number() -> None:
    for number, kind in ((35, relmap.RobotDataError), (75, relmap.RequestError), (999, relmap.DaemonError)):
        details = reason_pb2.Error(message="something new")
        details.reason = number
        error = error_of_rpc(_Failed(grpc.StatusCode.INTERNAL, details.SerializeToString()))
        assert isinstance(error, kind) and error.reason == number and error.reason.name == f"UNKNOWN_{number}"


def test_errors_without_details_are_those_of_the_code() -> None:
    assert isinstance(error_of_rpc(_Failed(grpc.StatusCode.UNAVAILABLE)), relmap.Unreachable)
    assert isinstance(error_of_rpc(_Failed(grpc.StatusCode.UNAVAILABLE, b"\xff\xff garbage")), relmap.Unreachable)
    assert error_of_rpc(_Failed(grpc.StatusCode.UNKNOWN)).reason == relmap.Reason.INTERNAL


def test_what_a_question_asks_is_no_data_of_a_robot() -> None:
    """BAD_SIZE of a keyframe is about what a robot sent, of a picture in a question about what was asked."""
    assert type(error_of(relmap.Reason.BAD_SIZE, "why")) is relmap.RobotDataError
    assert type(error_of(relmap.Reason.BAD_SIZE, "why", asks=True)) is relmap.RequestError
    assert type(error_of(relmap.Reason.NEW_PLACE, "why", asks=True)) is relmap.PlaceNotRecognised
    assert type(error_of(relmap.Reason.DEADLINE, "why", asks=True)) is relmap.DeadlineExceeded


def test_a_picture_of_another_size_than_its_camera_is_a_wrong_question(client: relmap.Client) -> None:
    grey = np.zeros((100, 120), np.uint8)
    small = relmap.StereoCamera(f=400, cx=256, cy=192, baseline=0.12, width=512, height=384)
    calls = (
        lambda: client.localise(grey, camera=small),
        lambda: client.match_image(grey, camera=small),
        lambda: client.find_route("1:1", relmap.View(left=grey, camera=small)),
    )
    for call in calls:
        with pytest.raises(relmap.RequestError, match="120 x 100") as raised:
            call()
        assert raised.value.reason == relmap.Reason.BAD_SIZE
    with pytest.raises(relmap.RequestError) as raised:
        client.set_label("1:1", "two\nlines")
    assert raised.value.reason == relmap.Reason.BAD_NAME
