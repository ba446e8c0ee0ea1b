"""Streams keyframes of one session to a relmapd, from a thread of its own."""

from __future__ import annotations

import os
import threading
import time as clock
import uuid as uuids
from types import TracebackType
from typing import Any, Iterator, Optional, Tuple, Type, Union

import grpc

from relmap.calls import Caller
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


class IngestSession:
    """A session of a robot, into which keyframes are streamed. Made by Client.session(); a context manager.

    Keyframes are kept until the daemon has them on disk. A broken connection and a restarted daemon lose nothing: the
    stream is opened again, and what is not durable is sent again. Leaving the context flushes and ends the session; if an
    exception leaves it, the session stays open, and can be continued under its uuid. Thread-safe.
    """

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
        self._changed = threading.Condition()
        self._thread: Optional[threading.Thread] = None
        self._stopping = False

    def __enter__(self) -> "IngestSession":
        self.open()
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        try:
            if kind is None:
                self.flush()
                self.end()
        finally:
            self.close()

    # ---- What is known

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
        with self._changed:
            return self._state.take_news()

    # ---- Keyframes

    def open(self) -> None:
        """Begins to stream; entering the context does it. A session that is continued asks the daemon where to go on.
        RelmapError: it does not answer."""
        if self._thread is not None:
            return
        if not self._state.is_new:
            self._state.core.begin_at(self._known_sequence())
        self._thread = threading.Thread(target=self._run, name="relmap ingest", daemon=True)
        self._thread.start()

    def add(
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
        """Adds a keyframe, and returns its sequence. Waits while too much is not durable yet.

        Args:
            time: microseconds UTC, or a datetime with a time zone; later than that of the keyframe before.
            T_odom_frame: 4 x 4, pose in the session's own odometry frame, metres.
            step_cov: 6 x 6, covariance of T_previous_this exp(xi); not at the first keyframe.
            source: where the motion since the previous keyframe comes from; None: START at first, then VISION.
            tracks: from which landmarks are made.
            features: by which the place is recognised.
            picture: grey JPEG of the rectified left picture, at most 48 KiB: its bytes, or a path.
            driven_us: microseconds driven since the previous keyframe; None: all that it did not stand.
            standing_us: microseconds that it stood.
            sequence: None: the next one. Sequences that are skipped are given up.

        Raises:
            ValueError: relmapd would refuse it: NaN, wrong shapes, a time that does not ascend, ...
            RelmapError: the session cannot go on.
        """
        with self._changed:
            keyframe = self._state.make(
                time, T_odom_frame, step_cov, source, tracks, features, picture, driven_us, standing_us, sequence
            )
            return self.add_keyframe(keyframe)

    def add_keyframe(self, keyframe: Keyframe) -> int:
        """Adds a keyframe that has this session's header. Raises as add()."""
        crc, payload = self._state.encode(keyframe)
        with self._changed:
            self._check_open()
            while not self._state.has_room(len(payload)):
                self._wait(None)
            sequence = self._state.take(keyframe, crc, payload)
            self._changed.notify_all()
            return sequence

    def give_up(self, count: int) -> None:
        """The next `count` sequences will never come: a gap. ValueError: count is below 1."""
        with self._changed:
            self._check_open()
            first = self._state.core.next_sequence
            self._state.core.give_up(first, first + count - 1)
            self._changed.notify_all()

    def flush(self, timeout: Optional[float] = None) -> int:
        """Waits until everything that was added is on the daemon's disk, and returns the sequence below which it is.

        Raises:
            KeyframesRefused: some were refused for good, and that was not told before.
            DeadlineExceeded: it took longer than `timeout` seconds.
            RelmapError: the session cannot go on.
        """
        until = None if timeout is None else clock.monotonic() + timeout
        with self._changed:
            self._check_open()
            while not self._state.core.all_settled:
                self._wait(until)
            self._state.raise_refusals()
            return self._state.core.settled_sequence

    def end(self, timeout: float = 10.0) -> bool:
        """Tells the daemon that the session has no more keyframes for now; a later one reopens it. Returns whether the
        daemon has that in its journal; False: `timeout` seconds were not enough, or no keyframe was ever taken."""
        until = clock.monotonic() + timeout
        with self._changed:
            self._check_open()
            if self._state.core.settled_sequence == 0:
                return False
            self._state.ending, self._state.ended = True, False
            self._changed.notify_all()
            try:
                while not self._state.ended:
                    self._wait(until)
            except DeadlineExceeded:
                return False
            finally:
                self._state.ending = False
            return True

    def close(self) -> None:
        """Stops streaming at once. What is not durable yet is lost here, unless flush() came before."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    # ---- The thread

    def _check_open(self) -> None:
        if self._state.failure is not None:
            raise self._state.failure
        if self._thread is None or self._stopping:
            raise ValueError("the session is not open: use it as a context manager, or call open()")

    def _wait(self, until: Optional[float]) -> None:
        if until is not None and clock.monotonic() >= until:
            raise DeadlineExceeded(Reason.DEADLINE, "the daemon has not everything on disk yet")
        self._changed.wait(TICK_S)
        self._check_open()

    def _known_sequence(self) -> int:
        caller = Caller.open(self._state.connection)
        try:
            request = ingest_pb2.GetAcknowledgementRequest(session_uuid=self.uuid.bytes)
            return int(caller.ask(caller.stubs.ingest.GetAcknowledgement, request).next_sequence)
        except RequestError as error:
            if error.reason != Reason.NO_SUCH_SESSION:
                raise
            return 0
        finally:
            caller.close()

    def _run(self) -> None:
        while not self._stopping:
            error = self._talk()
            with self._changed:
                if self._stopping:
                    return
                pause = self._state.broken(error)
                self._changed.notify_all()
                if self._state.failure is not None:
                    return
                self._changed.wait_for(lambda: self._stopping, pause)

    def _talk(self) -> RelmapError:
        """Runs one stream until it ends, and returns why it did."""
        try:
            where = self._state.connection.resolve()
            channel = self._state.connection.open(where)
        except RelmapError as error:
            return error
        over = threading.Event()
        try:
            call = Stubs(channel).ingest.Stream(self._requests(over), metadata=self._state.connection.metadata)
            watch = threading.Thread(target=self._watch, args=(call, over), daemon=True)
            watch.start()
            for reply in call:
                with self._changed:
                    self._state.receive(where, reply)
                    self._changed.notify_all()
            return error_of(Reason.UNREACHABLE, "the daemon has ended the stream")
        except grpc.RpcError as error:
            return error_of_rpc(error)
        except RelmapError as error:
            return error
        except Exception as error:  # so that who waits learns of it
            return error_of(Reason.INTERNAL, f"{type(error).__name__}: {error}")
        finally:
            over.set()
            with self._changed:
                self._changed.notify_all()
            channel.close()

    def _requests(self, over: threading.Event) -> Iterator[ingest_pb2.IngestRequest]:
        """What is sent on one stream; a thread of gRPC asks for it."""
        with self._changed:
            hello = self._state.hello()
        yield hello
        while True:
            with self._changed:
                if self._stopping or over.is_set():
                    return
                requests = self._state.outgoing()
                if not requests:
                    self._changed.wait(TICK_S)
            for request in requests:
                yield request

    def _watch(self, call: Any, over: threading.Event) -> None:
        """Ends a stream that is silent, or no longer wanted."""
        while not over.wait(TICK_S):
            with self._changed:
                if self._stopping or self._state.is_silent:
                    break
        call.cancel()
