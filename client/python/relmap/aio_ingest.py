"""Streams keyframes of one session to a relmapd, for asyncio."""

from __future__ import annotations

import asyncio
import os
import time as clock
import uuid as uuids
from types import TracebackType
from typing import Any, Optional, Tuple, Type, Union

import grpc.aio

from relmap.aio_calls import AioCaller
from relmap.camera import RawStereo, StereoCamera
from relmap.connection import Connection, Stubs
from relmap.errors import DeadlineExceeded, RelmapError, RequestError, error_of, error_of_rpc
from relmap.geometry import ArrayLike
from relmap.graph import MotionSource
from relmap.ingest_core import KeyframeLocalisation
from relmap.ingest_session import TICK_S, IngestState
from relmap.keyframe import Keyframe, SessionHeader
from relmap.measurements import Features, Tracks
from relmap.reason import Reason
from relmap.times import TimeLike
from relmap.v1 import ingest_pb2


class AsyncIngestSession:
    """A session of a robot, into which keyframes are streamed. Made by AsyncClient.session(); an asynchronous context
    manager. As relmap.IngestSession, which describes it; used from one event loop."""

    def __init__(
        self,
        connection: Connection,
        robot: str,
        camera: StereoCamera,
        name: str,
        uuid: Union[None, str, bytes, uuids.UUID],
        oneway: bool,
        raw: Optional[RawStereo],
        max_unsettled_bytes: int,
        patience: float,
    ) -> None:
        self._state = IngestState(
            connection, robot, camera, name, uuid, oneway, raw, max_unsettled_bytes, patience
        )
        self._heard = asyncio.Event()  # by who waits
        self._added = asyncio.Event()  # by who sends
        self._task: Optional["asyncio.Task[None]"] = None
        self._closed = False

    async def __aenter__(self) -> "AsyncIngestSession":
        await self.open()
        return self

    async def __aexit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        try:
            if kind is None:
                await self.flush()
                await self.end()
        finally:
            await self.close()

    @property
    def header(self) -> SessionHeader:
        """The session's header, which every keyframe repeats."""
        return self._state.header

    @property
    def uuid(self) -> uuids.UUID:
        """The session's uuid, under which it can be continued."""
        return self._state.header.uuid

    @property
    def number(self) -> int:
        """The session's number in the map; 0: not known yet, as before the first flush()."""
        return self._state.core.session

    @property
    def next_sequence(self) -> int:
        """The sequence of the next keyframe."""
        return self._state.core.next_sequence

    @property
    def settled_sequence(self) -> int:
        """Every keyframe below is durable, refused or given up."""
        return self._state.core.settled_sequence

    @property
    def rate_hz(self) -> float:
        """Keyframes a second that the daemon asks for; 0: any."""
        return self._state.rate_hz

    def take_news(self) -> Tuple[KeyframeLocalisation, ...]:
        """Where keyframes were found elsewhere in the map, and closures that are no longer in force, since the last call."""
        return self._state.take_news()

    async def open(self) -> None:
        """Begins to stream; entering the context does it. Raises as IngestSession.open()."""
        if self._task is not None:
            return
        if not self._state.is_new:
            self._state.core.begin_at(await self._known_sequence())
        self._task = asyncio.create_task(self._run())

    async def add(
        self,
        time: TimeLike,
        T_odom_frame: ArrayLike,
        step_cov: Optional[ArrayLike] = None,
        *,
        source: Optional[MotionSource] = None,
        tracks: Optional[Tracks] = None,
        features: Optional[Features] = None,
        picture: Union[bytes, str, "os.PathLike[str]"] = b"",
        driven_us: Optional[int] = None,
        standing_us: int = 0,
        sequence: Optional[int] = None,
    ) -> int:
        """Adds a keyframe, and returns its sequence. Arguments and exceptions are those of IngestSession.add()."""
        return await self.add_keyframe(
            self._state.make(
                time, T_odom_frame, step_cov, source, tracks, features, picture, driven_us, standing_us, sequence
            )
        )

    async def add_keyframe(self, keyframe: Keyframe) -> int:
        """Adds a keyframe that has this session's header. Raises as IngestSession.add()."""
        crc, payload = self._state.encode(keyframe)
        self._check_open()
        while not self._state.has_room(len(payload)):
            await self._wait(None)
        sequence = self._state.take(keyframe, crc, payload)
        self._added.set()
        return sequence

    async def give_up(self, count: int) -> None:
        """The next `count` sequences will never come: a gap. ValueError: count is below 1."""
        self._check_open()
        first = self._state.core.next_sequence
        self._state.core.give_up(first, first + count - 1)
        self._added.set()

    async def flush(self, timeout: Optional[float] = None) -> int:
        """Waits until everything that was added is on the daemon's disk, and returns the sequence below which it is. Raises
        as IngestSession.flush()."""
        until = None if timeout is None else clock.monotonic() + timeout
        self._check_open()
        while not self._state.core.all_settled:
            await self._wait(until)
        self._state.raise_refusals()
        return self._state.core.settled_sequence

    async def end(self, timeout: float = 10.0) -> bool:
        """Tells the daemon that the session has no more keyframes for now. Returns as IngestSession.end()."""
        until = clock.monotonic() + timeout
        self._check_open()
        if self._state.core.settled_sequence == 0:
            return False
        self._state.ending, self._state.ended = True, False
        self._added.set()
        try:
            while not self._state.ended:
                await self._wait(until)
        except DeadlineExceeded:
            return False
        finally:
            self._state.ending = False
        return True

    async def close(self) -> None:
        """Stops streaming at once. What is not durable yet is lost here, unless flush() came before."""
        self._closed = True
        if self._task is not None:
            self._task.cancel()
            try:
                await self._task
            except asyncio.CancelledError:
                pass

    def _check_open(self) -> None:
        if self._state.failure is not None:
            raise self._state.failure
        if self._task is None or self._closed:
            raise ValueError("the session is not open: use it as a context manager, or call open()")

    async def _wait(self, until: Optional[float]) -> None:
        if until is not None and clock.monotonic() >= until:
            raise DeadlineExceeded(Reason.DEADLINE, "the daemon has not everything on disk yet")
        self._heard.clear()
        try:
            await asyncio.wait_for(self._heard.wait(), TICK_S)
        except asyncio.TimeoutError:
            pass
        self._check_open()

    async def _known_sequence(self) -> int:
        caller = await AioCaller.open(self._state.connection)
        try:
            request = ingest_pb2.GetAcknowledgementRequest(session_uuid=self.uuid.bytes)
            return int((await caller.ask(caller.stubs.ingest.GetAcknowledgement, request)).next_sequence)
        except RequestError as error:
            if error.reason != Reason.NO_SUCH_SESSION:
                raise
            return 0
        finally:
            await caller.close()

    async def _run(self) -> None:
        while True:
            pause = self._state.broken(await self._talk())
            self._heard.set()
            if self._state.failure is not None:
                return
            await asyncio.sleep(pause)

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
            if self._closed:
                raise
            return error_of(Reason.UNREACHABLE, "the daemon does not answer")
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
