"""Loop closures: why they are believed, and edits."""

from __future__ import annotations

from typing import Optional, Union

from relmap.aio.base import ClientBase
from relmap.evidence import ClosureMatrix, EdgeEdit, Explanation, read_count, read_edit, read_explanation
from relmap.ids import EdgeLike, FrameLike, SessionsLike, edge_message, frame_message
from relmap.requests import EdgeAction, edge_state_request
from relmap.v1 import evidence_pb2, map_pb2


class ClosureCalls(ClientBase):
    """Calls that judge loop closures."""

    async def explain_edge(
        self, edge: EdgeLike, *, pictures: bool = False, timeout: Optional[float] = None
    ) -> Explanation:
        """What a loop closure is believed for. RequestError: NO_SUCH_EDGE. ClosureStateError: ODOMETRY_EDGE.

        Args:
            edge: the closure.
            pictures: with the pictures of both ends, which Explanation.draw_pair() draws.
        """
        request = evidence_pb2.ExplainEdgeRequest(edge=edge_message(edge), pictures=pictures)
        return read_explanation(await self._ask(self._map.ExplainEdge, request, timeout), pictures)

    async def closure_matrix(
        self, sessions: SessionsLike = (), *, timeout: Optional[float] = None
    ) -> ClosureMatrix:
        """How many loop closures there are between each two sessions; only pairs with one of `sessions`, if any are given.
        RequestError: NO_SUCH_SESSION."""
        countdown = self._caller.countdown(timeout)
        numbers = await self._numbers(sessions, countdown)

        def request() -> evidence_pb2.GetClosureMatrixRequest:
            return evidence_pb2.GetClosureMatrixRequest(sessions=numbers)

        cells = await self._list(self._map.GetClosureMatrix, request, lambda reply: reply.cells, read_count, countdown)
        return ClosureMatrix(cells)

    async def edit_edge(
        self,
        edge: EdgeLike,
        action: Union[EdgeAction, str],
        *,
        note: str = "",
        dry_run: bool = False,
        shown: int = 0,
        timeout: Optional[float] = None,
    ) -> EdgeEdit:
        """Edits a loop closure, and returns what changed. An edit that the connection breaks is sent again, and done once.

        Args:
            edge: the closure.
            action: "remove" (with all closures that agree with it), "remove_alone", "restore", "accept" (whatever its
                state; it is never outvoted), or "withdraw" (an operator's decision).
            note: for the journal.
            dry_run: tells what the edit would change, and changes nothing.
            shown: of a removal: EdgeEdit.shown of a dry run; refused if by now other closures would be removed.

        Raises:
            RequestError: NO_SUCH_EDGE.
            ClosureStateError: WRONG_STATE, ODOMETRY_EDGE.
            DaemonError: UNSUPPORTED: the closure has no metric transform. READ_ONLY.
            AccessError: the caller is no operator.
        """
        request = edge_state_request(edge, action, note, dry_run, shown)
        return read_edit(await self._edit(self._map.SetEdgeState, request, timeout))

    async def propose_edge(
        self,
        a: FrameLike,
        b: FrameLike,
        *,
        accept: bool = False,
        note: str = "",
        dry_run: bool = False,
        timeout: Optional[float] = None,
    ) -> EdgeEdit:
        """Verifies two frames by geometry, and proposes the result as a loop closure, which is judged like any other.

        Args:
            a, b: the frames, in any order.
            accept: put it into force at once.
            note: for the journal, with `accept`.
            dry_run: changes nothing.

        Raises:
            PlaceNotRecognised: TOO_FEW_FEATURES, TOO_FEW_INLIERS, POOR_SPREAD: geometry does not confirm it.
            RequestError: NO_SUCH_FRAME, INVALID_ARGUMENT: too near to each other along one drive; NOT_STEREO, ...
            ClosureStateError: WRONG_STATE: there is a closure between the two.
        """
        request = map_pb2.ProposeEdgeRequest(
            a=frame_message(a), b=frame_message(b), accept=accept, note=note, dry_run=dry_run
        )
        return read_edit(await self._edit(self._map.ProposeEdge, request, timeout))
