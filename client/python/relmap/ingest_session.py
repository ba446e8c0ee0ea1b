"""What blocking and asynchronous ingest sessions share: making keyframes of arrays, and taking in the daemon's messages."""

from __future__ import annotations

import os
import time as clock
import uuid as uuids
import warnings
from collections import deque
from pathlib import Path
from typing import Deque, List, Optional, Tuple, Union

import numpy as np

from relmap.address import ServerAddress
from relmap.camera import RawStereo, StereoCamera
from relmap.choices import choice
from relmap.connection import Connection
from relmap.crc32c import crc32c
from relmap.errors import RelmapError, Unreachable, error_of
from relmap.geometry import ArrayLike
from relmap.graph import MotionSource
from relmap.ingest_core import IngestCore, KeyframeLocalisation, KeyframesRefused, read_keyframe_localisation
from relmap.keyframe import Keyframe, SessionHeader, encode_keyframe
from relmap.measurements import Features, Tracks
from relmap.reason import Reason
from relmap.requests import as_uuid
from relmap.times import TimeLike, as_us
from relmap.v1 import common_pb2, ingest_pb2

FIRST_PAUSE_S, MAX_PAUSE_S = 0.1, 2.0
"""Pauses before another stream is opened."""
SILENCE_S = 10.0
"""A stream on which something was sent and nothing is received for so long is opened again."""
END_AGAIN_S = 0.2
"""The session's end is told so often until the daemon has it."""
TICK_S = 0.1
"""How often it is looked what is to be sent, at least."""

_TRY_AGAIN = {Reason.UNREACHABLE, Reason.SHUTTING_DOWN, Reason.READ_ONLY, Reason.DEADLINE, Reason.RATE_LIMITED}


class IngestState:
    """The state of an ingest session. Guarded by its owner.

    Attributes:
        header: of the session.
        core: what is to be sent.
        failure: why the session cannot go on; None: it can.
        ended: the daemon has the session's end in its journal.
        rate_hz: keyframes a second that the daemon asks for; 0: any.
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
        if not isinstance(camera, StereoCamera):
            raise TypeError(f"camera is a StereoCamera, not {type(camera).__name__}")
        if max_unsettled_bytes < 2**20:
            raise ValueError(f"max_unsettled_bytes is {max_unsettled_bytes}; must be at least 1 MiB")
        known = uuids.uuid4() if uuid is None else as_uuid(uuid)
        named = name or f"{robot} {clock.strftime('%Y-%m-%d %H:%M:%S', clock.gmtime())}"
        self.header = SessionHeader(known, robot, named, camera, oneway, raw)
        self.connection = connection
        self.is_new = uuid is None
        self.max_unsettled_bytes = max_unsettled_bytes
        self.patience = patience
        self.core = IngestCore(known)
        self.failure: Optional[RelmapError] = None
        self.ending = False
        self.ended = False
        self.rate_hz = 0.0
        self._news: Deque[KeyframeLocalisation] = deque()
        self._last_us: Optional[int] = None
        self._gone_since: Optional[float] = None
        self._unanswered_since: Optional[float] = None
        self._end_at = 0.0
        self._pause = FIRST_PAUSE_S

    def check(self, is_open: bool, is_closed: bool) -> None:
        """Raises why the session cannot go on: RelmapError; ValueError: it is not open."""
        if is_closed:
            raise ValueError("the session is closed; go on with it by client.session(..., uuid=session.uuid)")
        if self.failure is not None:
            raise self.failure
        if not is_open:
            raise ValueError("the session is not open: use it as a context manager, or call open()")

    def warn_of_loss(self) -> None:
        """Warns if keyframes are not on the daemon's disk: of a session that was not closed when the program ends."""
        if not self.core.all_settled:
            lost = self.core.next_sequence - self.core.settled_sequence
            warnings.warn(
                f"the session {self.header.name!r} was not closed: {lost} of its keyframes are not on the daemon's disk, and"
                " lost; use `with client.session(...)`",
                RuntimeWarning,
                stacklevel=2,
            )

    # ---- Keyframes

    def make(
        self,
        time: TimeLike,
        T_odom_frame: ArrayLike,
        step_cov: Optional[ArrayLike],
        source: Union[None, MotionSource, str],
        tracks: Optional[Tracks],
        features: Optional[Features],
        picture: Union[bytes, "os.PathLike[str]", str],
        driven_us: Optional[int],
        standing_us: int,
        sequence: Optional[int],
    ) -> Keyframe:
        """A keyframe of the arguments of add(). ValueError: relmapd would refuse it."""
        time_us = as_us(time)
        index = self.core.next_sequence if sequence is None else sequence
        if source is not None:
            source = choice("source", MotionSource, source)
        else:
            first = self._last_us is None and index == 0
            source = MotionSource.START if first or not self.header.camera.is_stereo else MotionSource.VISION
        if step_cov is None:
            if source != MotionSource.START:
                raise ValueError("step_cov is missing: the covariance of the motion since the previous keyframe (6, 6)")
            step_cov = np.zeros((6, 6))
        elapsed = time_us - self._last_us if self._last_us is not None else 0
        if driven_us is None:
            driven_us = max(elapsed - standing_us, 0)
        if 0 < elapsed < driven_us + standing_us:
            raise ValueError(f"driven {driven_us} us and standing {standing_us} us, in {elapsed} us")
        if not isinstance(picture, (bytes, str, os.PathLike)):
            raise TypeError(f"picture is the bytes or the path of a JPEG, not {type(picture).__name__}")
        data = picture if isinstance(picture, bytes) else Path(picture).read_bytes()
        return Keyframe(
            header=self.header,
            sequence=index,
            time_us=time_us,
            T_odom_frame=np.asarray(T_odom_frame),
            step_cov=np.asarray(step_cov),
            source=source,
            driven_us=driven_us,
            standing_us=standing_us,
            tracks=tracks if tracks is not None else Tracks.none(),
            features=features if features is not None else Features.none(),
            picture=data,
        )

    def encode(self, keyframe: Keyframe) -> Tuple[int, bytes]:
        """The checksum and the bytes of a keyframe. ValueError: it is of another session, or too large, or no later than the one
        before."""
        if keyframe.header != self.header:
            raise ValueError("the keyframe's header is not that of this session")
        if self._last_us is not None and keyframe.time_us <= self._last_us:
            raise ValueError(f"a keyframe of {keyframe.time_us} us after one of {self._last_us} us: times ascend")
        payload = encode_keyframe(keyframe)
        return crc32c(payload), payload

    def take(self, keyframe: Keyframe, crc: int, payload: bytes) -> int:
        """Keeps a keyframe until it is durable; returns its sequence."""
        self.core.add_keyframe(keyframe.sequence, crc, payload)
        self._last_us = keyframe.time_us
        return keyframe.sequence

    def has_room(self, size: int) -> bool:
        """Whether a keyframe of so many bytes can be kept now."""
        kept = self.core.unsettled_bytes
        return kept == 0 or kept + size <= self.max_unsettled_bytes

    def raise_refusals(self) -> None:
        """KeyframesRefused, if there are refusals that were not told before."""
        refusals = self.core.take_refusals()
        if refusals:
            raise KeyframesRefused(refusals)

    def take_news(self) -> Tuple[KeyframeLocalisation, ...]:
        """News that were not taken before. May be called without a guard."""
        return tuple(self._news.popleft() for _ in range(len(self._news)))

    # ---- One stream

    def hello(self) -> ingest_pb2.IngestRequest:
        """The first message of a stream."""
        protocol = common_pb2.ProtocolVersion(major=1, minor=0)
        self._unanswered_since = clock.monotonic()
        return ingest_pb2.IngestRequest(hello=ingest_pb2.Hello(protocol=protocol, robot=self.header.robot))

    def outgoing(self) -> List[ingest_pb2.IngestRequest]:
        """What is to be sent now."""
        now = clock.monotonic()
        requests = self.core.poll(now)
        if self.ending and not self.ended and self.core.all_settled and now - self._end_at >= END_AGAIN_S:
            self._end_at = now
            requests.append(self.core.end())
        if requests and self._unanswered_since is None:
            self._unanswered_since = now
        return requests

    @property
    def is_silent(self) -> bool:
        """Whether the daemon does not answer on this stream any more."""
        return self._unanswered_since is not None and clock.monotonic() - self._unanswered_since > SILENCE_S

    def receive(self, where: ServerAddress, reply: ingest_pb2.IngestReply) -> None:
        """Takes in a message of the daemon. RelmapError: the stream must be closed. What makes no sense is ignored."""
        self._unanswered_since = None
        kind = reply.WhichOneof("content")
        if kind == "welcome":
            self._receive_welcome(where, reply.welcome)
        elif kind == "acknowledgement":
            self._gone_since, self._pause = None, FIRST_PAUSE_S
            self.core.acknowledge(reply.acknowledgement, clock.monotonic())
        elif kind == "localisation" and reply.localisation.session_uuid == self.header.uuid.bytes:
            try:
                self._news.append(read_keyframe_localisation(reply.localisation))
            except ValueError:
                pass
        elif kind == "pace" and reply.pace.session_uuid == self.header.uuid.bytes:
            self.rate_hz = reply.pace.rate_hz
        elif kind == "ended" and reply.ended.session_uuid == self.header.uuid.bytes:
            self.ended = self.ending

    def _receive_welcome(self, where: ServerAddress, welcome: ingest_pb2.Welcome) -> None:
        if where.boot_id and welcome.boot_id.hex() != where.boot_id:
            raise Unreachable(Reason.UNREACHABLE, f"another daemon answers at {where.address}")
        why_not = self.core.welcome(welcome)
        if why_not:
            raise error_of(Reason.WRONG_MAP, why_not)

    def broken(self, error: RelmapError) -> float:
        """A stream ended for this reason. Returns the pause before the next; sets `failure` if there will be none."""
        self.core.broken()
        self._unanswered_since = None
        now = clock.monotonic()
        self._gone_since = now if self._gone_since is None else self._gone_since
        if error.reason not in _TRY_AGAIN or now - self._gone_since > self.patience:
            self.failure = error
        pause = self._pause
        self._pause = min(2 * self._pause, MAX_PAUSE_S)
        return pause
