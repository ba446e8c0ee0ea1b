"""What the calls of a client share."""

from __future__ import annotations

import asyncio
import uuid as uuids
from typing import Any, AsyncIterator, Awaitable, Callable, List, Optional, Set, TypeVar, Union

from relmap.aio.calls import Caller
from relmap.connection import Timeout
from relmap.errors import Unreachable, ViewExpired
from relmap.graph import Sessions, read_session
from relmap.ids import SessionLike, SessionsLike, as_session, as_sessions
from relmap.operations import OnProgress, read_progress
from relmap.v1 import admin_pb2, map_pb2
from relmap.views import View

T = TypeVar("T")

LONG_S = 24 * 3600.0
"""Seconds that calls may take which read or write the whole map, unless they are given a timeout."""
FIRST_PAUSE_S, MAX_PAUSE_S = 0.1, 2.0
"""Pauses before a call is sent again."""

_MAX_RESTARTS = 5  # of a list whose version of the map expired


def copied(request: Any) -> Any:
    """A copy of a message."""
    copy = type(request)()
    copy.CopyFrom(request)
    return copy


class ClientBase:
    """What the calls of a client share: the connection, calls that are sent again, and lists of one version of the map."""

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self._connection = caller.connection
        self._map = caller.stubs.map
        self._admin = caller.stubs.admin
        self._ingest = caller.stubs.ingest
        self._own: Set[Caller] = set()  # of watchers that connected again

    async def _forget(self, caller: Caller) -> None:
        if caller is not self._caller:
            self._own.discard(caller)
            await caller.close()

    async def _ask(self, method: Any, request: Any, timeout: Timeout) -> Any:
        return await self._caller.ask(method, request, timeout)

    async def _list_sessions(self, timeout: Timeout) -> Sessions:
        return Sessions(
            await self._list(
                self._map.ListSessions, map_pb2.ListSessionsRequest, lambda reply: reply.sessions, read_session, timeout
            )
        )

    async def _numbers(self, sessions: SessionsLike, timeout: Timeout) -> List[int]:
        """The numbers of the sessions that are meant; the daemon is asked only if one is named. RequestError as
        Sessions.number_of()."""
        return await self._looked_up(as_sessions(sessions), timeout)

    async def _number(self, session: SessionLike, timeout: Timeout, what: str = "session", least: int = 1) -> int:
        """The same of one session; `what` and `least` as in as_session()."""
        return (await self._looked_up([as_session(session, what, least)], timeout))[0]

    async def _looked_up(self, known: List[Union[int, str]], timeout: Timeout) -> List[int]:
        listed = Sessions() if all(isinstance(one, int) for one in known) else await self._list_sessions(timeout)
        return [listed.number_of(one) for one in known]

    async def _with_camera(self, view: View, timeout: Timeout) -> View:
        """The view with the number of the session whose camera took it."""
        if view.camera_called is None:
            return view
        return view.of_session(await self._number(view.camera_called, timeout))

    async def _edit(self, method: Any, request: Any, timeout: Timeout) -> Any:
        request.idempotency_key = uuids.uuid4().hex  # so that it may be sent again
        return await self._retry(method, request, timeout)

    async def _retry(self, method: Any, request: Any, timeout: Timeout) -> Any:
        pause = FIRST_PAUSE_S
        while True:
            try:
                return await self._ask(method, request, timeout)
            except Unreachable:
                if pause > 1:
                    raise
            await asyncio.sleep(pause)
            pause *= 4

    async def _work(self, method: Any, request: Any, on_progress: Optional[OnProgress], timeout: Timeout) -> Any:
        last = admin_pb2.Progress()
        async for reply in self._caller.stream(method, request, timeout):
            if on_progress is not None and reply.WhichOneof("outcome") is None:
                on_progress(read_progress(reply))
            last = reply
        return last

    async def _pages(self, method: Any, request: Any, timeout: Timeout) -> AsyncIterator[Any]:
        while True:
            reply = await self._ask(method, request, timeout)
            yield reply
            if not reply.next_page_token:
                return
            request.page_token = reply.next_page_token

    async def _list(
        self,
        method: Any,
        request: Callable[[], Any],
        items: Callable[[Any], Any],
        read: Callable[[Any], T],
        timeout: Timeout,
    ) -> List[T]:
        """All pages of a list; if its version of the map expires, once more from the beginning."""
        countdown = self._caller.countdown(timeout)

        async def whole() -> List[T]:
            found: List[T] = []
            async for reply in self._pages(method, request(), countdown):
                found.extend(read(item) for item in items(reply))
            return found

        return await self._restarted(whole)

    async def _replies(self, method: Any, request: Any, timeout: Timeout) -> List[Any]:
        """All replies of a stream; if its version of the map expires, once more from the beginning."""
        countdown = self._caller.countdown(timeout)

        async def whole() -> List[Any]:
            return [reply async for reply in self._caller.resumed(method, copied(request), countdown)]

        return await self._restarted(whole)

    async def _restarted(self, attempt: Callable[[], Awaitable[T]]) -> T:
        for _ in range(_MAX_RESTARTS):
            try:
                return await attempt()
            except ViewExpired as error:
                last = error
        raise last

    async def _given(
        self,
        replies: Callable[[], AsyncIterator[Any]],
        items: Callable[[Any], Any],
        read: Callable[[Any], T],
        what: str,
        whole: str,
    ) -> AsyncIterator[T]:
        """The items of replies; begins again only while nothing was given out."""
        given = 0
        for attempt in range(_MAX_RESTARTS):
            try:
                async for reply in replies():
                    for item in items(reply):
                        given += 1
                        yield read(item)
                return
            except ViewExpired as error:
                if given:
                    raise ViewExpired(
                        error.reason,
                        f"{error.message} ({given} {what} of it were given out; begin the {whole} again)",
                        error.request_id,
                    ) from None
                if attempt + 1 == _MAX_RESTARTS:
                    raise
