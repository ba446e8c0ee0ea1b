"""Routes, transforms and neighbourhoods."""

from __future__ import annotations

from typing import List, Optional, Sequence, Union

from relmap.aio.base import ClientBase
from relmap.ids import FrameLike, frame_message
from relmap.requests import route_request
from relmap.routes import (
    Neighbourhood,
    Route,
    RouteBy,
    RouteEnd,
    RouteFilter,
    RouteParts,
    RouteWeights,
    TransformBetween,
    read_neighbourhood,
    read_transform_between,
)
from relmap.v1 import map_pb2
from relmap.views import View


class RouteCalls(ClientBase):
    """Calls about the way from one place to another."""

    async def find_route(
        self,
        start: RouteEnd,
        goal: RouteEnd,
        *,
        by: Union[RouteBy, str] = RouteBy.DISTANCE,
        weights: Optional[RouteWeights] = None,
        count_standing: bool = False,
        max_cost: float = 0.0,
        or_from: Sequence[RouteEnd] = (),
        or_to: Sequence[RouteEnd] = (),
        filter: RouteFilter = RouteFilter(),
        covariance: bool = False,
        alternatives: int = 0,
        timeout: Optional[float] = None,
    ) -> Route:
        """The cheapest route, of one version of the map. A stream that breaks is resumed; if the version expires meanwhile,
        the route is sought again.

        Args:
            start, goal: a FrameId or its text "3:120", a Label or its text, a View, or a Robot.
            by: what is minimised: "distance", "time" or "certainty"; `weights` instead: a weighted sum.
            count_standing: times include those that robots stood still.
            max_cost: in the unit of the cost; 0: no limit.
            or_from, or_to: alternatives to start and goal; the route is the cheapest from any to any.
            filter: what the route may use.
            covariance: with the covariance of each pose, as Route.cov.
            alternatives: so many other routes, at most 5, as Route.alternatives.

        Raises:
            RequestError: NOT_CONNECTED, OUT_OF_REACH, COST_LIMIT, NO_SUCH_FRAME, NO_SUCH_LABEL.
            PlaceNotRecognised: for an end that is a view.
            ViewExpired: the version expired again and again: try again when the daemon is less busy.
        """
        countdown = self._caller.countdown(timeout)

        async def known(end: RouteEnd) -> RouteEnd:
            return await self._with_camera(end, countdown) if isinstance(end, View) else end

        request = route_request(
            await known(start), await known(goal), by, weights, count_standing, max_cost,
            [await known(end) for end in or_from], [await known(end) for end in or_to],
            filter, await self._numbers(filter.sessions, countdown), covariance, alternatives,
        )  # fmt: skip
        parts: List[RouteParts] = []
        for reply in await self._replies(self._map.FindRoute, request, countdown):
            while len(parts) <= reply.route:
                parts.append(RouteParts())
            parts[reply.route].add(reply)
        first = parts[0] if parts else RouteParts()
        return first.route(tuple(other.route() for other in parts[1:]))

    async def transform_between(
        self, a: FrameLike, b: FrameLike, *, timeout: Optional[float] = None
    ) -> TransformBetween:
        """The relative transform between two frames, along the path between them. RequestError: NO_SUCH_FRAME,
        NOT_CONNECTED, OUT_OF_REACH."""
        request = map_pb2.TransformBetweenRequest(a=frame_message(a), b=frame_message(b))
        return read_transform_between(await self._ask(self._map.TransformBetween, request, timeout))

    async def neighbourhood(
        self,
        root: FrameLike,
        *,
        max_edges: int = 0,
        max_metres: float = 0.0,
        max_frames: int = 0,
        landmarks: bool = False,
        timeout: Optional[float] = None,
    ) -> Neighbourhood:
        """The part of the map around a frame, in that frame's coordinates (relative poses). RequestError: NO_SUCH_FRAME.

        Args:
            root: the frame.
            max_edges: depth of the search; 0: 30.
            max_metres: along the path; 0: no limit.
            max_frames: 0: 1000.
            landmarks: with the landmarks that are based in the frames.
        """
        request = map_pb2.GetNeighbourhoodRequest(
            root=frame_message(root),
            max_edges=max_edges,
            max_metres=max_metres,
            max_frames=max_frames,
            landmarks=landmarks,
        )
        return read_neighbourhood(await self._ask(self._map.GetNeighbourhood, request, timeout))
