# Made of relmap/aio/__init__.py by client/python/make_sync; do not edit.
"""The client of a running relmapd.

    with relmap.connect("/var/lib/relmap/map") as client:
        place = client.localise("left.png", "right.png", camera=1)

Thread-safe, but for its iterators, of which each belongs to one thread at a time. relmap.aio has the same for asyncio.
"""

from __future__ import annotations

import os
from types import TracebackType
from typing import Optional, Type, Union

from relmap.client.calls import Caller
from relmap.client.closures import ClosureCalls
from relmap.client.edits import EditCalls
from relmap.client.exporting import ExportCalls
from relmap.client.ingest import IngestSession
from relmap.client.keyframes import KeyframeCalls
from relmap.client.operating import OperatorCalls
from relmap.client.places import PlaceCalls
from relmap.client.routes import RouteCalls
from relmap.client.shapes import ShapeCalls
from relmap.client.stored import StoredCalls
from relmap.client.watching import WatchCalls
from relmap.connection import Connection
from relmap.credentials import PathLike, credentials_of


def connect(
    server: PathLike,
    *,
    token: Optional[str] = None,
    tls: Union[None, bool, bytes, PathLike] = None,
    credentials: Optional[PathLike] = None,
    timeout: float = 60.0,
    request_id: str = "",
    traceparent: str = "",
) -> "Client":
    """Connects to a running relmapd.

    Args:
        server: the data folder of a daemon on this machine, or "HOST:PORT", such as "map.lab:50070".
        token: who the caller is, of `relmap-admin credentials new --token`; with `tls`. White space around it is ignored.
        tls: certificate of the authority that issued the daemon's: a path, or its bytes (PEM).
        credentials: instead of both: a file of `relmap-admin credentials new`. A data folder needs none.
        timeout: seconds that a call may take; a whole list or stream is one call. math.inf: no limit.
        request_id: names the calls in the daemon's log; at most 64 letters, digits and "-_.".
        traceparent: the trace that the calls belong to (W3C Trace Context).

    Raises:
        Unreachable: no daemon answers; the message says why.
        AccessError: the daemon does not know the caller, or the data folder may not be read.
        RequestError: `server` is neither a folder nor HOST:PORT.
        OSError: a file of credentials cannot be read.
        ValueError, TypeError: it holds none, or others can read it; arguments that do not go together, or mean nothing.
    """
    if not isinstance(server, (str, os.PathLike)):
        raise TypeError(f"server is a data folder or 'HOST:PORT', not {type(server).__name__}")
    shown = credentials_of(credentials, token, tls)
    connection = Connection(os.fspath(server), shown, timeout, request_id, traceparent)
    return Client(Caller.open(connection))


class Client(
    PlaceCalls,
    RouteCalls,
    ShapeCalls,
    ClosureCalls,
    EditCalls,
    WatchCalls,
    ExportCalls,
    KeyframeCalls,
    OperatorCalls,
    StoredCalls,
):
    """A client of a running relmapd. Made by connect(); a context manager, which closes it.

    Every method raises Unreachable, DeadlineExceeded, AccessError or another RelmapError if the daemon refuses; the
    comments in relmap/v1/map.proto and admin.proto list the reasons of each call. Wrong arguments raise ValueError or
    TypeError before anything is sent. A `timeout` is in seconds; None: that of connect().
    """

    def __repr__(self) -> str:
        closed = ", closed" if self._caller.closed else ""
        return f"<{type(self).__name__} of {self._connection.server}{closed}>"

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection; calls under way fail."""
        self._caller.close()
        for caller in tuple(self._own):
            self._forget(caller)

    def connect_again(self) -> "Client":
        """Another client of the same server, since a restarted daemon may use another port. Raises as connect()."""
        return Client(Caller.open(self._connection))


__all__ = ["Client", "IngestSession", "connect"]
