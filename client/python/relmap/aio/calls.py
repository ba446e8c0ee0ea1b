"""Calls over gRPC with their deadlines, names and errors; a stream of replies that breaks goes on where it broke."""

from __future__ import annotations

import math
from typing import Any, AsyncIterator, Optional

import grpc.aio

from relmap.aio.silence import Heard
from relmap.connection import Connection, Countdown, Stubs, Timeout, check_boot, checked_timeout, unreachable
from relmap.errors import ClientClosed, DeadlineExceeded, RelmapError, Unreachable, error_of_rpc
from relmap.v1 import map_pb2, status_pb2

MAX_RESUMPTIONS = 3
"""How often a stream is resumed without progress in between."""


class Caller:
    """Calls over one channel of grpc.aio, from one event loop.

    Attributes:
        connection: what it was connected with.
        stubs: of the services.
        closed: whether close() was called; every call then raises ClientClosed.
    """

    def __init__(self, connection: Connection, channel: Any) -> None:
        self.connection = connection
        self.stubs = Stubs(channel)
        self.closed = False
        self._channel = channel
        self._metadata = connection.metadata

    @staticmethod
    async def open(connection: Connection) -> "Caller":
        """Connects, and checks that the daemon answers. RelmapError: why not."""
        where = connection.resolve()
        caller = Caller(connection, connection.open_aio(where))
        try:
            reply = await caller.ask(caller.stubs.map.GetStatus, status_pb2.GetStatusRequest())
            check_boot(connection, where, reply.boot_id)
        except RelmapError as error:
            await caller.close()
            raise unreachable(connection, where, error) from None
        return caller

    async def close(self) -> None:
        """Closes the channel; calls under way fail."""
        self.closed = True
        await self._channel.close()

    def _call(self, method: Any, request: Any, timeout: Timeout) -> Any:
        if self.closed:
            raise ClientClosed
        limit = timeout.left if isinstance(timeout, Countdown) else self._asked(timeout)
        return method(request, timeout=None if limit == math.inf else limit, metadata=self._metadata)

    def _failed(self, error: Any, request: Any, timeout: Timeout) -> RelmapError:
        if self.closed:
            return ClientClosed()
        failed = error_of_rpc(error, asks=not isinstance(request, map_pb2.ImportGraphRequest))
        asked = self._asked(timeout)
        if isinstance(failed, DeadlineExceeded) and asked != math.inf:
            return DeadlineExceeded(failed.reason, f"{failed.message}; the timeout was {asked:g} s", failed.request_id)
        return failed

    def _asked(self, timeout: Timeout) -> float:
        if isinstance(timeout, Countdown):
            return timeout.asked
        return self.connection.timeout if timeout is None else checked_timeout(timeout)

    def countdown(self, timeout: Timeout) -> Countdown:
        """A countdown that begins now, from the timeout; None: from that of the connection. One that runs goes on."""
        return timeout if isinstance(timeout, Countdown) else Countdown(self._asked(timeout))

    async def ask(self, method: Any, request: Any, timeout: Timeout = None) -> Any:
        """The reply to a request. RelmapError: why there is none."""
        try:
            return await self._call(method, request, timeout)
        except grpc.aio.AioRpcError as error:
            raise self._failed(error, request, timeout) from None

    async def stream(
        self, method: Any, request: Any, timeout: Timeout = None, silence: Optional[float] = None
    ) -> AsyncIterator[Any]:
        """The replies to a request; not resumed. The timeout is for all of them; None: that of the connection, inf: none.
        With `silence`, Unreachable is raised if no reply comes for so many seconds."""
        call = self._call(method, request, timeout)
        try:
            async for reply in call if silence is None else Heard(call, silence):
                yield reply
        except grpc.aio.AioRpcError as error:
            raise self._failed(error, request, timeout) from None
        finally:
            call.cancel()

    async def resumed(self, method: Any, request: Any, countdown: Countdown) -> AsyncIterator[Any]:
        """The replies to a request with a resume_token: a stream that breaks goes on after the last reply."""
        broken = 0
        while True:
            try:
                async for reply in self.stream(method, request, countdown):
                    yield reply
                    request.resume_token = reply.resume_token
                    broken = 0
                return
            except Unreachable:
                broken += 1
                if not request.resume_token or broken > MAX_RESUMPTIONS:
                    raise
