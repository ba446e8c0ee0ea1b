"""What happens to the map, as it happens."""

from __future__ import annotations

import asyncio
import math
import time
from typing import AsyncIterator, List, Optional, Union

from relmap.aio.base import FIRST_PAUSE_S, MAX_PAUSE_S, ClientBase
from relmap.aio.calls import Caller
from relmap.errors import ClientClosed, DaemonError, Unreachable
from relmap.events import MapEvent, StorageChanged, read_event
from relmap.ids import SessionsLike, as_sessions
from relmap.reason import Reason
from relmap.v1 import watch_pb2


class WatchCalls(ClientBase):
    """The call that follows the map."""

    def watch(
        self,
        *,
        sessions: SessionsLike = (),
        oldest: bool = False,
        resume_token: str = "",
        no_frames: bool = False,
        patience: Optional[float] = 60.0,
        silence: float = 45.0,
    ) -> AsyncIterator[MapEvent]:
        """What happens to the map, without end. Goes on where it was after a broken connection and a restarted daemon.

        To hold a copy of something, begin to watch, list it, and apply all events to what was listed; at a Resync, list
        again.

        Args:
            sessions: only events of these; empty: of all.
            oldest: begins with the oldest event that is kept, about an hour ago; else with now.
            resume_token: MapEvent.origin.resume_token of an event that was seen: goes on after it.
            no_frames: without frames that are added, moved or skipped, which are most events.
            patience: seconds for which it tries to reach a daemon that is gone; None: for ever.
            silence: seconds without a message after which the daemon counts as gone; it sends one at least every 15 s.

        Raises:
            Unreachable: the daemon was gone for longer than `patience`.
            RequestError: the token is none, NO_SUCH_SESSION. ClientClosed.
            DaemonError: BUDGET_EXCEEDED: too many watch already.
        """
        if not silence > 0:
            raise ValueError(f"silence is {silence}; must be above 0")
        start = watch_pb2.WATCH_FROM_OLDEST if oldest else watch_pb2.WATCH_FROM_NOW
        request = watch_pb2.WatchMapRequest(
            sessions=[], resume_token=resume_token, no_frames=no_frames, **{"from": start}
        )
        return self._watch(as_sessions(sessions), request, patience, silence)

    async def _watch(
        self,
        sessions: List[Union[int, str]],
        request: watch_pb2.WatchMapRequest,
        patience: Optional[float],
        silence: float,
    ) -> AsyncIterator[MapEvent]:
        request.sessions.extend(await self._looked_up(sessions, None))
        caller = self._caller
        gone_since: Optional[float] = None
        pause = FIRST_PAUSE_S
        storage: Optional[StorageChanged] = None
        try:
            while True:
                try:
                    async for message in caller.stream(caller.stubs.map.WatchMap, request, math.inf, silence):
                        gone_since, pause = None, FIRST_PAUSE_S
                        request.resume_token = message.resume_token or request.resume_token
                        event = read_event(message)
                        if isinstance(event, StorageChanged):
                            if storage is not None and storage.storage == event.storage:
                                continue  # told at the beginning of each stream
                            storage = event
                        yield event
                    raise Unreachable(Reason.UNREACHABLE, "the daemon has ended the stream")
                except DaemonError as error:
                    if not isinstance(error, Unreachable) and error.reason != Reason.SHUTTING_DOWN:
                        raise
                    lost = error
                gone_since = time.monotonic() if gone_since is None else gone_since
                again: Optional[Caller] = None
                while again is None:
                    left = math.inf if patience is None else gone_since + patience - time.monotonic()
                    if left <= 0:
                        raise lost
                    await asyncio.sleep(min(pause, left))
                    pause = min(2 * pause, MAX_PAUSE_S)
                    if self._caller.closed:
                        raise ClientClosed
                    try:
                        limit = min(self._connection.timeout, silence, left)
                        again = await Caller.open(self._connection.with_timeout(limit))
                    except DaemonError as error:
                        lost = error if isinstance(error, Unreachable) else lost
                await self._forget(caller)
                caller = again
                self._own.add(caller)
                if self._caller.closed:
                    raise ClientClosed  # in the meantime
        finally:
            await self._forget(caller)
