"""Keeps a stream of keyframes open: what an ingest session does in a task of its own."""

from __future__ import annotations

import asyncio
import time as clock
from types import TracebackType
from typing import Any, Optional, Type

import grpc.aio

from relmap.connection import Stubs
from relmap.errors import DeadlineExceeded, RelmapError, error_of, error_of_rpc
from relmap.ingest_session import TICK_S, IngestState
from relmap.reason import Reason


class Line:
    """Sends what an ingest session wants to be sent, and takes in what the daemon says; opens another stream when one breaks.

    Its context guards the state. Here that is nothing, since nothing else runs between two awaits; in the blocking client it
    is a lock (relmap/client/line.py).

    Attributes:
        adding: held by who adds to the session, so that keyframes keep their order.
    """

    def __init__(self, state: IngestState) -> None:
        self.adding = asyncio.Lock()
        self._state = state
        self._heard = asyncio.Event()  # by who waits
        self._added = asyncio.Event()  # by who sends
        self._task: Optional["asyncio.Task[None]"] = None
        self._closed = False

    async def __aenter__(self) -> "Line":
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        pass

    @property
    def is_open(self) -> bool:
        """Whether open() was called."""
        return self._task is not None

    def open(self) -> None:
        """Begins to stream."""
        self._task = asyncio.create_task(self._run())

    async def close(self) -> None:
        """Ends the stream at once."""
        self._closed = True
        if self._task is not None:
            self._task.cancel()
            try:
                await self._task
            except asyncio.CancelledError:
                pass

    def check(self) -> None:
        """Raises why the session cannot go on: RelmapError; ValueError: it is not open."""
        self._state.check(self.is_open, self._closed)

    def changed(self) -> None:
        """There is something to send."""
        self._added.set()

    async def wait(self, until: Optional[float]) -> None:
        """Waits for the daemon's next message, not for long. DeadlineExceeded: it is later than `until`, of the monotonic
        clock; else raises as check()."""
        if until is not None and clock.monotonic() >= until:
            raise DeadlineExceeded(Reason.DEADLINE, "the daemon has not everything on disk yet")
        self._heard.clear()
        try:
            await asyncio.wait_for(self._heard.wait(), TICK_S)
        except asyncio.TimeoutError:
            pass
        self.check()

    async def _run(self) -> None:
        try:
            while True:
                pause = self._state.broken(await self._talk())
                self._heard.set()
                if self._state.failure is not None:
                    return
                await asyncio.sleep(pause)
        except asyncio.CancelledError:
            if self._closed:
                raise
            # The loop ends. The exception ends here, too: its frames would keep objects of gRPC until the interpreter ends,
            # at which grpcio 1.51 sometimes hangs.
            self._state.warn_of_loss()

    async def _talk(self) -> RelmapError:
        """Runs one stream until it ends, and returns why it did."""
        try:
            where = self._state.connection.resolve()
            channel = self._state.connection.open_aio(where)
        except RelmapError as error:
            return error
        call = Stubs(channel).ingest.Stream(metadata=self._state.connection.metadata)
        sending = asyncio.create_task(self._send(call))
        try:
            async for reply in call:
                self._state.receive(where, reply)
                self._heard.set()
                self._added.set()
            return error_of(Reason.UNREACHABLE, "the daemon has ended the stream")
        except grpc.aio.AioRpcError as error:
            return error_of_rpc(error)
        except RelmapError as error:
            return error
        except asyncio.CancelledError:
            if self._closed or not self._state.is_silent:
                raise  # it is this task that is cancelled, by close() or at the loop's end; else _send() has cancelled the call
            return error_of(Reason.UNREACHABLE, "the daemon does not answer")
        except Exception as error:  # so that who waits learns of it
            return error_of(Reason.INTERNAL, f"{type(error).__name__}: {error}")
        finally:
            sending.cancel()
            call.cancel()
            await asyncio.gather(sending, return_exceptions=True)
            await channel.close()

    async def _send(self, call: Any) -> None:
        try:
            await call.write(self._state.hello())
            while True:
                self._added.clear()
                for request in self._state.outgoing():
                    await call.write(request)
                if self._state.is_silent:
                    call.cancel()
                    return
                try:
                    await asyncio.wait_for(self._added.wait(), TICK_S)
                except asyncio.TimeoutError:
                    pass
        except (grpc.aio.AioRpcError, asyncio.InvalidStateError):
            return  # the reader tells why


__all__ = ["Line"]
