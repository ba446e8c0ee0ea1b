"""Calls over gRPC with their deadlines, names and errors; a stream of replies that breaks goes on where it broke."""

from __future__ import annotations

import math
import time
from typing import Any, AsyncIterator, Optional

import grpc.aio

from relmap.connection import Connection, Stubs, check_boot, unreachable
from relmap.errors import RelmapError, Unreachable, error_of_rpc
from relmap.v1 import status_pb2

MAX_RESUMPTIONS = 3
"""How often a stream is resumed without progress in between."""


class AioCaller:
    """Calls over one channel of grpc.aio, from one event loop.

    Attributes:
        connection: what it was connected with.
        stubs: of the services.
    """

    def __init__(self, connection: Connection, channel: Any) -> None:
        self.connection = connection
        self.stubs = Stubs(channel)
        self._channel = channel
        self._metadata = connection.metadata

    @staticmethod
    async def open(connection: Connection) -> "AioCaller":
        """Connects, and checks that the daemon answers. RelmapError: why not."""
        where = connection.resolve()
        caller = AioCaller(connection, connection.open_aio(where))
        try:
            reply = await caller.ask(caller.stubs.map.GetStatus, status_pb2.GetStatusRequest())
            check_boot(connection, where, reply.boot_id)
        except RelmapError as error:
            await caller.close()
            raise unreachable(connection, where, error) from None
        return caller

    async def close(self) -> None:
        """Closes the channel; calls under way fail."""
        await self._channel.close()

    def _limit(self, timeout: Optional[float]) -> Optional[float]:
        if timeout is None:
            return self.connection.timeout
        return None if timeout == math.inf else timeout

    async def ask(self, method: Any, request: Any, timeout: Optional[float] = None) -> Any:
        """The reply to a request. RelmapError: why there is none."""
        try:
            return await method(request, timeout=self._limit(timeout), metadata=self._metadata)
        except grpc.aio.AioRpcError as error:
            raise error_of_rpc(error) from None

    async def stream(self, method: Any, request: Any, timeout: Optional[float] = None) -> AsyncIterator[Any]:
        """The replies to a request; not resumed. The timeout is for all of them; None: that of the connection, inf: none."""
        call = method(request, timeout=self._limit(timeout), metadata=self._metadata)
        try:
            async for reply in call:
                yield reply
        except grpc.aio.AioRpcError as error:
            raise error_of_rpc(error) from None
        finally:
            call.cancel()

    async def resumed(self, method: Any, request: Any, timeout: Optional[float] = None) -> AsyncIterator[Any]:
        """The replies to a request with a resume_token: a stream that breaks goes on after the last reply."""
        until = time.monotonic() + (self.connection.timeout if timeout is None else timeout)
        broken = 0
        while True:
            try:
                async for reply in self.stream(method, request, max(until - time.monotonic(), 0.001)):
                    yield reply
                    request.resume_token = reply.resume_token
                    broken = 0
                return
            except Unreachable:
                broken += 1
                if not request.resume_token or broken > MAX_RESUMPTIONS:
                    raise
