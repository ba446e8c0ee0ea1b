"""What is stored: frames, sessions, edges, labels, robots, the status."""

from __future__ import annotations

from typing import Any, AsyncIterator, Optional

from relmap.aio.base import ClientBase
from relmap.graph import Edge, Edges, Frame, LabelledFrames, Labels, Sessions, read_edge, read_frame
from relmap.ids import FrameLike, SessionLike, as_session, frame_message, read_frame_id
from relmap.requests import EdgeOrder, KindsLike, OrderLike, StatesLike, edges_request
from relmap.status import DaemonStatus, Robots, read_robot, read_status
from relmap.times import TimeLike
from relmap.v1 import map_pb2, status_pb2


class StoredCalls(ClientBase):
    """Calls that tell what the map holds."""

    async def frame(
        self,
        frame: FrameLike,
        *,
        landmarks: bool = False,
        observations: bool = False,
        appearance: bool = False,
        thumbnail: bool = False,
        picture: bool = False,
        timeout: Optional[float] = None,
    ) -> Frame:
        """A keyframe of the map, with what is asked for. RequestError: NO_SUCH_FRAME."""
        request = map_pb2.GetFrameRequest(
            frame=frame_message(frame),
            landmarks=landmarks,
            observations=observations,
            appearance=appearance,
            thumbnail=thumbnail,
            picture=picture,
        )
        reply = await self._ask(self._map.GetFrame, request, timeout)
        return read_frame(reply.frame, landmarks, observations, appearance, picture)

    async def sessions(self, *, timeout: Optional[float] = None) -> Sessions:
        """All sessions, of one version of the map."""
        return await self._list_sessions(timeout)

    async def edges(
        self,
        *,
        states: StatesLike = (),
        kinds: KindsLike = (),
        session: SessionLike = 0,
        other_session: SessionLike = 0,
        frame: Optional[FrameLike] = None,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        min_suspicion: float = 0.0,
        around: Optional[FrameLike] = None,
        around_edges: int = 0,
        around_metres: float = 0.0,
        order: OrderLike = EdgeOrder.ID,
        timeout: Optional[float] = None,
    ) -> Edges:
        """Edges, all of one version of the map: if that version expires meanwhile, the list is read again.

        Args:
            states, kinds: only these, or their names ("accepted", "loop"); empty: all.
            session: with an end in this session; 0: any. With `other_session`: between the two, or within one.
            frame: of this frame.
            since, until: of which the newer end was taken since then, and before then.
            min_suspicion: only loop closures at least as suspicious, 0..1.
            around: with an end at most `around_edges` edges (0: 30) and `around_metres` (0: no limit) from this frame.
            order: "id", "suspicion" (closures only, the most suspicious first) or "time" (closures only, the newest first).

        Raises:
            RequestError: NO_SUCH_SESSION, NO_SUCH_FRAME.
            ViewExpired: the version expired again and again; use iter_edges(), or narrower filters.
        """

        countdown = self._caller.countdown(timeout)
        one = await self._number(session, countdown, "session", 0)
        other = await self._number(other_session, countdown, "other_session", 0)

        def request() -> map_pb2.ListEdgesRequest:
            return edges_request(
                states, kinds, one, other, frame, since, until, min_suspicion, around, around_edges, around_metres, order
            )

        return Edges(await self._list(self._map.ListEdges, request, lambda reply: reply.edges, read_edge, countdown))

    def iter_edges(
        self,
        *,
        states: StatesLike = (),
        kinds: KindsLike = (),
        session: SessionLike = 0,
        other_session: SessionLike = 0,
        frame: Optional[FrameLike] = None,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        min_suspicion: float = 0.0,
        around: Optional[FrameLike] = None,
        around_edges: int = 0,
        around_metres: float = 0.0,
        order: OrderLike = EdgeOrder.ID,
        page_size: int = 0,
        timeout: Optional[float] = None,
    ) -> AsyncIterator[Edge]:
        """The same page by page, for maps whose edges do not fit into memory.

        All are of one version of the map. If it expires before the first edge was given out, the list begins again by
        itself; afterwards ViewExpired is raised, since edges of two versions do not go together: begin again.

        Args:
            states, kinds, session, other_session, frame, since, until, min_suspicion, around, around_edges, around_metres,
                order: as in edges().
            page_size: how many are asked for at once; 0: as many as the daemon likes.
            timeout: seconds for each page, since what is done with the edges takes time, too.
        """

        def request(one: int, other: int) -> map_pb2.ListEdgesRequest:
            made = edges_request(
                states, kinds, one, other, frame, since, until, min_suspicion, around, around_edges, around_metres, order
            )
            made.page_size = page_size
            return made

        # So that wrong arguments are told here, and not when the first edge is asked for.
        ends = as_session(session, "session", 0), as_session(other_session, "other_session", 0)
        request(*(1 if isinstance(end, str) else end for end in ends))

        async def replies() -> AsyncIterator[Any]:
            one, other = await self._looked_up(list(ends), timeout)
            async for reply in self._pages(self._map.ListEdges, request(one, other), timeout):
                yield reply

        return self._given(replies, lambda reply: reply.edges, read_edge, "items", "list")

    async def labels(
        self, prefix: str = "", words: str = "", *, timeout: Optional[float] = None
    ) -> Labels:
        """Labels, ascending, with their frames.

        Args:
            prefix: of the label; upper and lower case of a to z are equal.
            words: for each of these words, the label has a word that begins with it.
        """

        def read(message: Any) -> LabelledFrames:
            return LabelledFrames(message.label, tuple(read_frame_id(frame) for frame in message.frames))

        def request() -> map_pb2.FindLabelsRequest:
            return map_pb2.FindLabelsRequest(prefix=prefix, words=words)

        return Labels(await self._list(self._map.FindLabels, request, lambda reply: reply.labels, read, timeout))

    async def robots(self, *, timeout: Optional[float] = None) -> Robots:
        """Sessions heard of in the last minute, and for ten minutes those that fell silent without having ended."""
        reply = await self._ask(self._map.ListRobots, status_pb2.ListRobotsRequest(), timeout)
        return Robots(read_robot(robot) for robot in reply.robots)

    async def status(self, *, timeout: Optional[float] = None) -> DaemonStatus:
        """The status of the daemon."""
        return read_status(await self._ask(self._map.GetStatus, status_pb2.GetStatusRequest(), timeout))
