"""Exceptions: one class for each group of reasons, all under RelmapError.

Wrong arguments that can be judged without a daemon raise ValueError or TypeError before anything is sent.
"""

from __future__ import annotations

import functools
from typing import Any, Callable, Mapping, Type, TypeVar, cast

import grpc

from relmap.reason import Reason, ReasonGroup
from relmap.v1 import reason_pb2

E = TypeVar("E", bound="RelmapError")
F = TypeVar("F", bound=Callable[..., Any])


def _unpickled(kind: Type[E], values: Mapping[str, Any], args: Any) -> E:
    error = kind.__new__(kind, *args)
    error.args = args
    error.__dict__.update(values)
    return error


class RelmapError(Exception):
    """A call that failed.

    Attributes:
        reason: why.
        message: what exactly is wrong, with the numbers.
        request_id: the id under which the daemon logged the call; empty if it never reached one.
    """

    reason: Reason
    message: str
    request_id: str

    def __init__(self, reason: Reason, message: str, request_id: str = "") -> None:
        super().__init__(f"{reason.name}: {message}")
        self.reason = reason
        self.message = message
        self.request_id = request_id

    def __reduce__(self) -> Any:  # for pickle: worker processes pass exceptions on
        return _unpickled, (type(self), self.__dict__, self.args)


class RobotDataError(RelmapError):
    """What a robot, or an imported graph, sent cannot be taken: TIME_BACKWARDS, CALIBRATION_CHANGED, SESSION_FROZEN, ..."""


class RequestError(RelmapError):
    """What was asked for cannot be answered: NO_SUCH_FRAME, NOT_CONNECTED, NOT_A_PICTURE, NO_CALIBRATION, ... Reasons of what
    robots send are of this class where the call sends none of it: BAD_SIZE of a picture in a question, BAD_NAME of a label."""


class ClientClosed(RequestError):
    """The client was closed (INVALID_ARGUMENT)."""

    def __init__(self) -> None:
        super().__init__(
            Reason.INVALID_ARGUMENT, "the client is closed; call connect() again, or connect_again() of the closed one"
        )


class PlaceNotRecognised(RelmapError):
    """The map does not recognise what the view shows: NEW_PLACE, AMBIGUOUS_PLACE, TOO_FEW_INLIERS, EMPTY_MAP, ..."""


class ClosureStateError(RelmapError):
    """The state of an edge does not allow what was asked for: WRONG_STATE, ODOMETRY_EDGE, ..."""


class DaemonError(RelmapError):
    """The daemon or its disk cannot do it now: UNREACHABLE, READ_ONLY, BUDGET_EXCEEDED, DISK_FULL, UNIMPLEMENTED, ...; or
    its reply is malformed (CORRUPT)."""


class Unreachable(DaemonError, ConnectionError):
    """No daemon answers there (UNREACHABLE)."""


class DeadlineExceeded(DaemonError, TimeoutError):
    """The call took longer than its timeout (DEADLINE). An edit may have been done all the same."""


class ViewExpired(DaemonError):
    """The version of the map that a list or stream was read from is gone (VIEW_EXPIRED): begin it again."""


class AccessError(RelmapError):
    """The caller is not known, or may not do this: UNAUTHENTICATED, NOT_ALLOWED, REPLAYED."""


class CameraError(RelmapError):
    """Something is wrong with a camera, or with its calibration as the pictures show it: ROWS_APART, EYE_DEAD, ..."""


_BY_REASON: Mapping[Reason, Type[RelmapError]] = {
    Reason.UNREACHABLE: Unreachable,
    Reason.DEADLINE: DeadlineExceeded,
    Reason.VIEW_EXPIRED: ViewExpired,
}
_BY_GROUP: Mapping[ReasonGroup, Type[RelmapError]] = {
    ReasonGroup.ROBOT_DATA: RobotDataError,
    ReasonGroup.REQUEST: RequestError,
    ReasonGroup.PLACE: PlaceNotRecognised,
    ReasonGroup.CLOSURE: ClosureStateError,
    ReasonGroup.DAEMON: DaemonError,
    ReasonGroup.ACCESS: AccessError,
    ReasonGroup.CAMERA: CameraError,
}
# What a status of gRPC means that carries no reason, as where nothing answers.
_BY_CODE = {
    grpc.StatusCode.UNAVAILABLE: Reason.UNREACHABLE,
    grpc.StatusCode.DEADLINE_EXCEEDED: Reason.DEADLINE,
    grpc.StatusCode.CANCELLED: Reason.DEADLINE,
    grpc.StatusCode.UNIMPLEMENTED: Reason.UNIMPLEMENTED,
    grpc.StatusCode.RESOURCE_EXHAUSTED: Reason.BUDGET_EXCEEDED,
    grpc.StatusCode.UNAUTHENTICATED: Reason.UNAUTHENTICATED,
    grpc.StatusCode.PERMISSION_DENIED: Reason.NOT_ALLOWED,
    grpc.StatusCode.INVALID_ARGUMENT: Reason.INVALID_ARGUMENT,
    grpc.StatusCode.DATA_LOSS: Reason.DATA_LOSS,
}


def error_of(reason: Reason, message: str, request_id: str = "", asks: bool = False) -> RelmapError:
    """The exception of a reason, of the class that its group has; with `asks`, of a call that sends nothing of a robot's, so
    that none is a RobotDataError. It is returned, not raised."""
    kind: Type[RelmapError] = _BY_REASON.get(reason) or _BY_GROUP.get(reason.group) or RelmapError
    if asks and kind is RobotDataError:
        kind = RequestError
    return kind(reason, message, request_id)


def reads_reply(read: F) -> F:
    """Makes a function that reads a daemon's message raise a DaemonError (CORRUPT) where the message makes no sense: a bare
    ValueError would say that the caller's arguments are wrong."""

    @functools.wraps(read)
    def checked(*args: Any, **named: Any) -> Any:
        try:
            return read(*args, **named)
        except (ValueError, LookupError, ArithmeticError) as error:
            raise DaemonError(Reason.CORRUPT, f"the daemon's reply is malformed: {error}") from error

    return cast(F, checked)


def silent(seconds: float) -> Unreachable:
    """The exception of a stream on which nothing came for so long. It is returned, not raised."""
    return Unreachable(
        Reason.UNREACHABLE, f"nothing was heard for {seconds:g} s: the connection is cut, or the daemon is stopped"
    )


def error_of_rpc(error: Any, asks: bool = False) -> RelmapError:
    """The exception of a failed call of gRPC (grpc.RpcError of either kind), by grpc-status-details-bin if it is there. `asks`
    as in error_of()."""
    details = reason_pb2.Error()
    for key, value in error.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            try:
                details.ParseFromString(value)
            except Exception:  # what a proxy put there
                details.Clear()
    if details.reason:
        return error_of(Reason(details.reason), details.message, details.request_id, asks)
    return error_of(_BY_CODE.get(error.code(), Reason.INTERNAL), error.details() or "the call failed")
