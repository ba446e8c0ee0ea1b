# Made of relmap/aio/ingest.py by client/python/make_sync; do not edit.
"""Streams keyframes of one session to a relmapd."""

from __future__ import annotations

import os
import time as clock
import uuid as uuids
from types import TracebackType
from typing import Optional, Tuple, Type, Union

from relmap.client.calls import Caller
from relmap.client.line import Line
from relmap.camera import RawStereo, StereoCamera
from relmap.connection import Connection
from relmap.errors import DeadlineExceeded, RelmapError, RequestError
from relmap.geometry import ArrayLike
from relmap.graph import MotionSource
from relmap.ingest_core import KeyframeLocalisation
from relmap.ingest_session import IngestState
from relmap.keyframe import Keyframe, SessionHeader
from relmap.measurements import Features, Tracks
from relmap.reason import Reason
from relmap.times import TimeLike
from relmap.v1 import ingest_pb2

LAST_FLUSH_S = 5.0
"""Seconds for which a session that an exception leaves still waits for the daemon's disk."""


class IngestSession:
    """A session of a robot, into which keyframes are streamed. Made by Client.session(); a context manager.

    Keyframes are kept until the daemon has them on disk. A broken connection and a restarted daemon lose nothing: the
    stream is opened again, and what is not durable is sent again. Leaving the context flushes and ends the session. If an
    exception leaves it (Ctrl-C, too), the session stays open, and can be continued under its uuid; what was added is waited
    for, but for at most 5 s. Thread-safe.
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
        self._line = Line(self._state)

    def __repr__(self) -> str:
        added, safe = self.next_sequence, self.settled_sequence
        return f"<{type(self).__name__} {self.header.name!r} of {self.header.robot}: {added} sequences, {safe} of them settled>"

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
            else:
                self._flush_what_can_be()
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
        """Where keyframes were found elsewhere in the map, and closures that are no longer in force, since the last call. Does
        not wait."""
        return self._state.take_news()

    # ---- Keyframes

    def open(self) -> None:
        """Begins to stream; entering the context does it. A session that is continued asks the daemon where to go on.
        RelmapError: it does not answer. ValueError: the session was closed."""
        with self._line.adding:
            if self._line.is_open:
                self._line.check()
                return
            if not self._state.is_new:
                self._state.core.begin_at(self._known_sequence())
            self._line.open()

    def add(
        self,
        time: TimeLike,
        T_odom_frame: ArrayLike,
        step_cov: Optional[ArrayLike] = None,
        *,
        source: Union[None, MotionSource, str] = None,
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
            T_odom_frame: 4 x 4, pose in the session's own odometry frame, metres; camera axes: x right, y down, z forward.
            step_cov: 6 x 6, covariance of T_previous_this exp(xi), xi = (rho in metres, phi in radians); not at the first
                keyframe.
            source: where the motion since the previous keyframe comes from; None: START at first, then VISION.
            tracks: from which landmarks are made.
            features: by which the place is recognised.
            picture: grey JPEG of the rectified left picture, at most 48 KiB: its bytes, or a path.
            driven_us: microseconds driven since the previous keyframe; None: all that it did not stand.
            standing_us: microseconds that it stood.
            sequence: None: the next one. Sequences that are skipped are given up.

        Raises:
            ValueError: relmapd would refuse it: NaN, wrong shapes, a time that does not ascend, ...; or the session is not
                open.
            RelmapError: the session cannot go on.
        """
        with self._line.adding:
            self._line.check()
            return self._put(
                self._state.make(
                    time, T_odom_frame, step_cov, source, tracks, features, picture, driven_us, standing_us, sequence
                )
            )

    def add_keyframe(self, keyframe: Keyframe) -> int:
        """Adds a keyframe that has this session's header. Raises as add()."""
        with self._line.adding:
            return self._put(keyframe)

    def give_up(self, count: int) -> None:
        """The next `count` sequences will never come: a gap. ValueError: count is below 1."""
        with self._line.adding:
            with self._line:
                self._line.check()
                first = self._state.core.next_sequence
                self._state.core.give_up(first, first + count - 1)
                self._line.changed()

    def flush(self, timeout: Optional[float] = None) -> int:
        """Waits until everything that was added is on the daemon's disk, and returns the sequence below which it is.

        Args:
            timeout: seconds; None: as long as the session can go on.

        Raises:
            KeyframesRefused: some were refused for good, and that was not told before.
            DeadlineExceeded: it took longer than `timeout`.
            RelmapError: the session cannot go on.
        """
        until = None if timeout is None else clock.monotonic() + timeout
        with self._line:
            self._line.check()
            while not self._state.core.all_settled:
                self._line.wait(until)
            self._state.raise_refusals()
            return self._state.core.settled_sequence

    def end(self, timeout: float = 10.0) -> bool:
        """Tells the daemon that the session has no more keyframes for now; a later one reopens it. Returns whether the
        daemon has that in its journal; False: `timeout` seconds were not enough, or no keyframe was ever taken."""
        until = clock.monotonic() + timeout
        with self._line:
            self._line.check()
            if self._state.core.settled_sequence == 0:
                return False
            self._state.ending, self._state.ended = True, False
            self._line.changed()
            try:
                while not self._state.ended:
                    self._line.wait(until)
            except DeadlineExceeded:
                return False
            finally:
                self._state.ending = False
            return True

    def close(self) -> None:
        """Stops streaming at once. What is not durable yet is lost here, unless flush() came before. May be called again."""
        self._line.close()

    def _put(self, keyframe: Keyframe) -> int:
        crc, payload = self._state.encode(keyframe)
        with self._line:
            self._line.check()
            while not self._state.has_room(len(payload)):
                self._line.wait(None)
            sequence = self._state.take(keyframe, crc, payload)
            self._line.changed()
            return sequence

    def _flush_what_can_be(self) -> None:
        try:
            self.flush(LAST_FLUSH_S)
        except (RelmapError, ValueError):
            pass  # the exception that leaves the context says more

    def _known_sequence(self) -> int:
        caller = Caller.open(self._state.connection)
        try:
            request = ingest_pb2.GetAcknowledgementRequest(session_uuid=self.uuid.bytes)
            return int((caller.ask(caller.stubs.ingest.GetAcknowledgement, request)).next_sequence)
        except RequestError as error:
            if error.reason != Reason.NO_SUCH_SESSION:
                raise
            return 0
        finally:
            caller.close()


__all__ = ["IngestSession"]
