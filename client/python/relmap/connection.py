"""How to reach a daemon: what connect() was given, and the channels and calls that follow from it."""

from __future__ import annotations

import atexit
import re
import time
import weakref
from dataclasses import dataclass, replace
from typing import Any, Optional, Tuple, Union

import grpc
import grpc.aio

from relmap.address import ServerAddress, resolve_server
from relmap.credentials import Credentials
from relmap.errors import RelmapError, Unreachable
from relmap.reason import Reason
from relmap.v1 import admin_pb2_grpc, ingest_pb2_grpc, map_pb2_grpc

MAX_REPLY_BYTES = 16 * 2**20
"""The largest message that is taken from a daemon."""

_OPTIONS = (
    ("grpc.max_receive_message_length", MAX_REPLY_BYTES),
    ("grpc.max_send_message_length", -1),
    ("grpc.enable_http_proxy", 0),
    # A connection of its own: one that is shared may lead to a daemon that was killed.
    ("grpc.use_local_subchannel_pool", 1),
    ("grpc.max_reconnect_backoff_ms", 1000),
)
_open_channels: "weakref.WeakSet[Any]" = weakref.WeakSet()


@atexit.register
def close_channels() -> None:
    """Ends all calls of blocking clients, at the end of the program. grpcio's own thread does it, and for that the interpreter
    must still run: a channel with a call that is not over, as that of a watch which Ctrl-C ended, would be closed when the
    interpreter takes its objects apart, and would then wait for ever for that thread."""
    for channel in tuple(_open_channels):
        channel.close()


Metadata = Optional[Tuple[Tuple[str, str], ...]]
"""The metadata of a call."""


def checked_timeout(timeout: float) -> float:
    """The same timeout. ValueError: it is not above 0. TypeError: it is no number."""
    if isinstance(timeout, (str, bytes)) or not hasattr(timeout, "__float__"):
        raise TypeError(f"timeout is in seconds (math.inf: no limit), not {type(timeout).__name__}")
    if not timeout > 0:
        raise ValueError(f"timeout is {timeout} s; must be above 0")
    return timeout


class Countdown:
    """What is left of a timeout that several requests share. Begins when it is made.

    Attributes:
        asked: the timeout that the caller asked for, seconds; errors name it.
    """

    def __init__(self, asked: float) -> None:
        self.asked = asked
        self._until = time.monotonic() + asked

    @property
    def left(self) -> float:
        """Seconds that are left; above 0, since a call with too little of them fails as it should."""
        return max(self._until - time.monotonic(), 0.001)


Timeout = Union[None, float, Countdown]
"""Of one request: seconds, what is left of a countdown, or None: the timeout of the connection."""


@dataclass(frozen=True)
class Connection:
    """What a client was connected with. Immutable; channels are opened from it, again after the daemon was restarted.

    Attributes:
        server: data folder, or HOST:PORT.
        credentials: None: no TLS.
        timeout: seconds that a call may take.
        request_id: names the calls in the daemon's log; empty: the daemon makes a name for each.
        traceparent: the trace that the calls belong to; empty: none.
    """

    server: str
    credentials: Optional[Credentials]
    timeout: float
    request_id: str = ""
    traceparent: str = ""

    def __post_init__(self) -> None:
        checked_timeout(self.timeout)
        for what, text in (("request_id", self.request_id), ("traceparent", self.traceparent)):
            if not re.fullmatch(r"[!-~]*", text):
                raise ValueError(f"{what} is {text!r}; must be printable ASCII without spaces")

    @property
    def metadata(self) -> Metadata:
        """What names the calls in the daemon's log."""
        named = (("x-request-id", self.request_id), ("traceparent", self.traceparent))
        return tuple((key, value) for key, value in named if value) or None

    def resolve(self) -> ServerAddress:
        """Where the daemon answers now; RelmapError as resolve_server()."""
        return resolve_server(self.server)

    def open(self, where: ServerAddress) -> Any:
        """A grpc.Channel to this address."""
        if where.is_socket or self.credentials is None:
            channel = grpc.insecure_channel(where.address, options=_OPTIONS)
        else:
            channel = grpc.secure_channel(where.address, self.credentials.channel_credentials(), options=_OPTIONS)
        _open_channels.add(channel)
        return channel

    def open_aio(self, where: ServerAddress) -> Any:
        """A grpc.aio.Channel to this address."""
        if where.is_socket or self.credentials is None:
            return grpc.aio.insecure_channel(where.address, options=_OPTIONS)
        return grpc.aio.secure_channel(where.address, self.credentials.channel_credentials(), options=_OPTIONS)

    def with_timeout(self, timeout: Optional[float]) -> "Connection":
        """The same with another timeout; None: the same."""
        return self if timeout is None else replace(self, timeout=timeout)


class Stubs:
    """The stubs of the three services over one channel, of either kind.

    Attributes:
        map, admin, ingest: stubs.
    """

    def __init__(self, channel: Any) -> None:
        self.map: Any = map_pb2_grpc.MapStub(channel)  # type: ignore[no-untyped-call]
        self.admin: Any = admin_pb2_grpc.AdminStub(channel)  # type: ignore[no-untyped-call]
        self.ingest: Any = ingest_pb2_grpc.IngestStub(channel)  # type: ignore[no-untyped-call]


def unreachable(connection: Connection, where: ServerAddress, error: RelmapError) -> RelmapError:
    """Why a connection failed, with what else may be the cause; other failures than Unreachable as they are."""
    if not isinstance(error, Unreachable):
        return error
    named = f" (written by process {where.pid})" if where.pid else ""
    cause = ""
    if not where.is_socket:
        cause = (
            ", or it serves TLS, and needs credentials"
            if connection.credentials is None
            else ", or it and the credentials do not trust each other"
        )
    return Unreachable(
        error.reason, f"nothing answers at {where.address}{named}{cause}: {error.message}", error.request_id
    )


def check_boot(connection: Connection, where: ServerAddress, boot_id: str) -> None:
    """Unreachable if another daemon answers than the one that wrote DIR/endpoint, which remains after a crash."""
    if where.boot_id and boot_id != where.boot_id:
        if connection.resolve().boot_id == boot_id:
            return  # it started in that one's place while this connected
        raise Unreachable(
            Reason.UNREACHABLE,
            f"the daemon that served {connection.server} is gone; another answers at {where.address}",
        )
