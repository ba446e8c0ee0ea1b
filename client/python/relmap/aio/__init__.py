"""The client of a running relmapd, for asyncio.

    async with await relmap.aio.connect("/var/lib/relmap/map") as client:
        place = await client.localise("left.png", "right.png", camera=1)

Used from one event loop. It has the methods of relmap.Client, which is made of this source (client/python/make_sync): what
blocks there is awaited here, and iterators are asynchronous.
"""

from __future__ import annotations

import os
from types import TracebackType
from typing import Optional, Type, Union

from relmap.aio.calls import Caller
from relmap.aio.closures import ClosureCalls
from relmap.aio.edits import EditCalls
from relmap.aio.exporting import ExportCalls
from relmap.aio.ingest import AsyncIngestSession
from relmap.aio.keyframes import KeyframeCalls
from relmap.aio.operating import OperatorCalls
from relmap.aio.places import PlaceCalls
from relmap.aio.routes import RouteCalls
from relmap.aio.shapes import ShapeCalls
from relmap.aio.stored import StoredCalls
from relmap.aio.watching import WatchCalls
from relmap.connection import Connection
from relmap.credentials import PathLike, credentials_of


async def connect(
    server: PathLike,
    *,
    token: Optional[str] = None,
    tls: Union[None, bool, bytes, PathLike] = None,
    credentials: Optional[PathLike] = None,
    timeout: float = 60.0,
    request_id: str = "",
    traceparent: str = "",
) -> "AsyncClient":
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
    return AsyncClient(await Caller.open(connection))


class AsyncClient(
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

    async def __aenter__(self) -> "AsyncClient":
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """Closes the connection; calls under way fail."""
        await self._caller.close()
        for caller in tuple(self._own):
            await self._forget(caller)

    async def connect_again(self) -> "AsyncClient":
        """Another client of the same server, since a restarted daemon may use another port. Raises as connect()."""
        return AsyncClient(await Caller.open(self._connection))


__all__ = ["AsyncClient", "AsyncIngestSession", "connect"]
