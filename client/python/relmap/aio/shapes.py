"""The shape of the map, and pictures of it."""

from __future__ import annotations

from typing import List, Optional, Set

from relmap.aio.stored import StoredCalls
from relmap.drawing.picture import Drawing, draw_map
from relmap.errors import DaemonError
from relmap.graph import EdgeState
from relmap.ids import SessionsLike, as_sessions
from relmap.reason import Reason
from relmap.skeleton import Skeleton, SkeletonChain, joined_chains, read_chain, read_closures, skeleton_of_edges
from relmap.v1 import skeleton_pb2


def _level_for(frames: int) -> int:
    """How much of a map with so many frames a picture shows."""
    return next((level for level, most in ((3, 20_000), (2, 300_000), (1, 3_000_000)) if frames <= most), 0)


class ShapeCalls(StoredCalls):
    """Calls that draw the map."""

    async def skeleton(
        self,
        level: int = 1,
        *,
        sessions: SessionsLike = (),
        candidates: bool = False,
        timeout: Optional[float] = None,
    ) -> Skeleton:
        """The shape of the map, small enough to draw; of one version: if that expires meanwhile, it is read again.

        Args:
            level: beside junctions, of 64 consecutive frames about 1 (0), 4 (1), 16 (2), or all (3); 1 is for drawing.
            sessions: only these; empty: all.
            candidates: with closures that are not in force.

        Raises:
            RequestError: NO_SUCH_SESSION.
            ViewExpired: the version expired again and again; ask for a lower level, or for fewer sessions.
            ValueError: the level.
        """
        if level not in (0, 1, 2, 3):
            raise ValueError(f"level is {level!r}; must be 0, 1, 2 or 3")
        countdown = self._caller.countdown(timeout)
        request = skeleton_pb2.GetSkeletonRequest(
            level=level, sessions=await self._numbers(sessions, countdown), candidates=candidates
        )
        chains: List[SkeletonChain] = []
        closures: List[skeleton_pb2.SkeletonClosures] = []
        total, version = 0, 0
        for reply in await self._replies(self._map.GetSkeleton, request, countdown):
            chains.extend(read_chain(chain) for chain in reply.chains)
            closures.append(reply.closures)
            total, version = reply.frames_total, reply.map_version
        return Skeleton(joined_chains(chains), read_closures(closures), total, version)

    async def draw_map(
        self,
        *,
        sessions: SessionsLike = (),
        level: Optional[int] = None,
        candidates: bool = False,
        labels: bool = True,
        width: int = 900,
        timeout: Optional[float] = None,
    ) -> Drawing:
        """The map seen from above, as an SVG that notebooks show.

        Positions are a relaxed picture: cycles are bent until they close. Never measure distances in it; ask
        transform_between() instead.

        Args:
            sessions: only these; empty: all.
            level: as in skeleton(); None: every frame of a map with up to 20,000 in these sessions, fewer points of more.
            candidates: with closures that are not in force.
            labels: with labels.
            width: of the picture, points.

        Raises:
            RequestError: NO_SUCH_SESSION.
            ViewExpired: as skeleton().
        """
        listed = await self.sessions(timeout=timeout)
        wanted = [listed.number_of(session) for session in as_sessions(sessions)]
        if level is None:
            level = _level_for(sum(session.frames for session in listed if not wanted or session.number in wanted))
        try:
            skeleton = await self.skeleton(level, sessions=wanted, candidates=candidates, timeout=timeout)
        except DaemonError as error:
            if error.reason != Reason.UNIMPLEMENTED:
                raise
            skeleton = await self._skeleton_of_edges(set(wanted), candidates, timeout)  # of an older daemon
        named = await self.labels(timeout=timeout) if labels else ()
        names = {session.number: session.name for session in listed}
        return draw_map(skeleton.relaxed_picture(), width, names, named)

    async def _skeleton_of_edges(
        self, wanted: Set[int], candidates: bool, timeout: Optional[float]
    ) -> Skeleton:
        edges = await self.edges(states=() if candidates else (EdgeState.ACCEPTED,), timeout=timeout)
        return skeleton_of_edges(
            edge for edge in edges if not wanted or {edge.a.session, edge.b.session} <= wanted
        )
