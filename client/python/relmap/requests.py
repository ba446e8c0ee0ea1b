"""Requests as messages: arguments are checked here, before anything is sent."""

from __future__ import annotations

import math
import uuid as uuids
from dataclasses import dataclass
from typing import Iterator, Optional, Sequence, Union

import numpy as np

from relmap.choices import choice, choices
from relmap.enums import NamedEnum, NumberedEnum
from relmap.geometry import (
    Array,
    ArrayLike,
    check_covariance,
    check_transform,
    covariance_message,
    frozen,
    transform_message,
)
from relmap.graph import EdgeKind, EdgeState
from relmap.ids import EdgeLike, FrameLike, edge_message, frame_message
from relmap.record import Record
from relmap.routes import RouteBy, RouteEnd, RouteFilter, RouteWeights, end_message
from relmap.times import TimeLike, as_us
from relmap.v1 import graph_pb2, map_pb2

MAX_PIECE = 1000
"""The most frames, and loops, of a graph that are sent at once."""


class EdgeAction(NamedEnum):
    """What an operator does to a loop closure."""

    REMOVE = "remove"
    """Removes it, with all closures that agree with it."""
    REMOVE_ALONE = "remove_alone"
    """Removes only this closure; those that agree with it stay."""
    RESTORE = "restore"
    """Restores it, with those that were removed with it."""
    ACCEPT = "accept"
    """Puts it into force whatever its state; it is never outvoted."""
    WITHDRAW = "withdraw"
    """Withdraws ACCEPT: it returns to its state before."""


class EdgeOrder(NumberedEnum):
    """The order of a list of edges."""

    ID = 1
    SUSPICION = 2
    """Loop closures only, the most suspicious first."""
    TIME = 3
    """Loop closures only, the newest first."""


OrderLike = Union[EdgeOrder, str]
"""An order, or its name: "id", "suspicion", "time"."""
StatesLike = Union[EdgeState, str, Sequence[Union[EdgeState, str]]]
"""States, or their names, such as "accepted"; one, or several."""
KindsLike = Union[EdgeKind, str, Sequence[Union[EdgeKind, str]]]
"""Kinds, or their names, such as "loop"; one, or several."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ImportedLoop(Record):
    """A loop closure of a graph that is imported. ValueError: not finite, or no transform or covariance.

    Attributes:
        query, match: indices of the later and the earlier frame.
        T_match_query: 4 x 4, metres.
        cov: 6 x 6, covariance of T_match_query exp(xi).
    """

    query: int
    match: int
    T_match_query: Array
    cov: Array

    def __post_init__(self) -> None:
        if not 0 <= self.match < self.query:
            raise ValueError(f"a loop from {self.query} to {self.match}; query is the later frame")
        object.__setattr__(self, "T_match_query", frozen(check_transform(self.T_match_query, "T_match_query")))
        object.__setattr__(self, "cov", frozen(check_covariance(self.cov, "the covariance of a loop")))


def as_uuid(uuid: Union[str, bytes, uuids.UUID]) -> uuids.UUID:
    """The uuid that is meant. ValueError: it is none."""
    if isinstance(uuid, uuids.UUID):
        return uuid
    try:
        return uuids.UUID(bytes=uuid) if isinstance(uuid, bytes) else uuids.UUID(uuid)
    except (ValueError, AttributeError, TypeError):
        raise ValueError(f"{uuid!r} is no uuid") from None


def _finite(what: str, value: float, low: float = 0.0, high: float = math.inf) -> float:
    number = float(value)
    if not math.isfinite(number) or not low <= number <= high:
        raise ValueError(f"{what} is {value!r}; must be {low:g} or more" + (f", at most {high:g}" if high < math.inf else ""))
    return number


def edges_request(
    states: StatesLike,
    kinds: KindsLike,
    session: int,
    other_session: int,
    frame: Optional[FrameLike],
    since: Optional[TimeLike],
    until: Optional[TimeLike],
    min_suspicion: float,
    around: Optional[FrameLike],
    around_edges: int,
    around_metres: float,
    order: OrderLike,
) -> map_pb2.ListEdgesRequest:
    """The request of Client.edges(). ValueError: a filter that means nothing."""
    request = map_pb2.ListEdgesRequest(
        session=session,
        other_session=other_session,
        from_us=0 if since is None else as_us(since),
        until_us=0 if until is None else as_us(until),
        min_suspicion=_finite("min_suspicion", min_suspicion, 0.0, 1.0),
    )
    if request.other_session and not request.session:
        raise ValueError("other_session needs session")
    request.states.extend(int(state) for state in choices("states", EdgeState, states))
    request.kinds.extend(int(kind) for kind in choices("kinds", EdgeKind, kinds))
    by = choice("order", EdgeOrder, order)
    if by != EdgeOrder.ID:
        request.order = int(by)  # type: ignore[assignment]
    if frame is not None:
        request.frame.CopyFrom(frame_message(frame))
    if around is not None:
        request.region.root.CopyFrom(frame_message(around))
        request.region.max_edges = around_edges
        request.region.max_metres = _finite("around_metres", around_metres)
    elif around_edges or around_metres:
        raise ValueError("around_edges and around_metres need around")
    return request


_STATE_OF = {
    EdgeAction.REMOVE: graph_pb2.EDGE_STATE_REMOVED,
    EdgeAction.REMOVE_ALONE: graph_pb2.EDGE_STATE_REMOVED,
    EdgeAction.RESTORE: graph_pb2.EDGE_STATE_ACCEPTED,
    EdgeAction.ACCEPT: graph_pb2.EDGE_STATE_ACCEPTED,
    EdgeAction.WITHDRAW: graph_pb2.EDGE_STATE_CANDIDATE,
}


def edge_state_request(
    edge: EdgeLike, action: Union[EdgeAction, str], note: str, dry_run: bool, shown: int
) -> map_pb2.SetEdgeStateRequest:
    """The request of Client.edit_edge(). ValueError: there is no such action."""
    try:
        known = EdgeAction(action)
    except ValueError:
        names = ", ".join(repr(a.value) for a in EdgeAction)
        raise ValueError(f"action is {action!r}; must be one of {names}") from None
    return map_pb2.SetEdgeStateRequest(
        edge=edge_message(edge),
        state=_STATE_OF[known],
        note=note,
        decided=known == EdgeAction.ACCEPT,
        alone=known == EdgeAction.REMOVE_ALONE,
        dry_run=dry_run,
        shown=shown,
    )


def route_request(
    start: RouteEnd,
    goal: RouteEnd,
    by: Union[RouteBy, str],
    weights: Optional[RouteWeights],
    count_standing: bool,
    max_cost: float,
    or_from: Sequence[RouteEnd],
    or_to: Sequence[RouteEnd],
    filter: RouteFilter,
    sessions: Sequence[int],
    covariance: bool,
    alternatives: int,
) -> map_pb2.FindRouteRequest:
    """The request of Client.find_route(); `sessions` are the numbers of those of the filter. ValueError: a number that is
    impossible."""
    if not 0 <= alternatives <= 5:
        raise ValueError(f"alternatives is {alternatives}; must be 0..5")
    request = map_pb2.FindRouteRequest(
        to=end_message(goal),
        by=int(choice("by", RouteBy, by)),  # type: ignore[arg-type]
        count_standing=count_standing,
        max_cost=_finite("max_cost", max_cost),
        or_from=[end_message(end) for end in or_from],
        or_to=[end_message(end) for end in or_to],
        covariance=covariance,
        alternatives=alternatives,
    )
    getattr(request, "from").CopyFrom(end_message(start))
    if weights is not None:
        names = ("metre", "driven_second", "standing_second", "square_metre_of_variance")
        values = {name: _finite(name, getattr(weights, name), 0.0, 1e9) for name in names}
        if not any(values.values()):
            raise ValueError("all weights are 0")
        request.weights.CopyFrom(map_pb2.RouteWeights(**values))
    request.filter.CopyFrom(
        map_pb2.RouteFilter(
            sessions=sessions,
            avoid_frames=[frame_message(frame) for frame in filter.avoid_frames],
            avoid_labels=filter.avoid_labels,
            min_support=filter.min_support,
            no_long_loops=not filter.long_loops,
            suppose_candidates=filter.suppose_candidates,
            suppose_quarantined=filter.suppose_quarantined,
        )
    )
    return request


def _shaped(what: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = np.asarray(values)
    if array.shape != shape:
        raise ValueError(f"{what} has shape {array.shape}; must be {shape}")
    return array


def import_requests(
    session: uuids.UUID,
    T_odom_frame: ArrayLike,
    time_us: ArrayLike,
    robot: str,
    name: str,
    first: int,
    step_cov: Optional[ArrayLike],
    driven_us: Optional[ArrayLike],
    loops: Sequence[ImportedLoop],
) -> Iterator[map_pb2.ImportGraphRequest]:
    """The pieces of a graph, in the order in which they are sent. ValueError: shapes differ, or something is not finite."""
    T = np.asarray(T_odom_frame, dtype=float)
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise ValueError(f"T_odom_frame has shape {T.shape}; must be (n, 4, 4)")
    n = len(T)
    times = _shaped("time_us", time_us, (n,)).astype(np.int64)
    driven = None if driven_us is None else _shaped("driven_us", driven_us, (n,)).astype(np.int64)
    covs = None if step_cov is None else _shaped("step_cov", step_cov, (n, 6, 6)).astype(float)
    frames = []
    for i in range(n):
        frame = map_pb2.ImportedFrame(
            odom_from_frame=transform_message(check_transform(T[i], f"T_odom_frame[{i}]")),
            time_us=as_us(int(times[i])),
            driven_us=0 if driven is None else int(driven[i]),
        )
        if covs is not None and first + i > 0 and not np.isnan(covs[i]).all():
            frame.step.CopyFrom(covariance_message(check_covariance(covs[i], f"step_cov[{i}]")))
        frames.append(frame)
    waiting = sorted(loops, key=lambda loop: loop.query)
    if waiting and waiting[-1].query >= first + n:
        raise ValueError(f"a loop of frame {waiting[-1].query}; the last one is {first + n - 1}")
    begin = 0
    while begin < n or waiting:
        piece = frames[begin : begin + MAX_PIECE]
        end = first + begin + len(piece)
        now = [loop for loop in waiting if loop.query < end][:MAX_PIECE]
        waiting = waiting[len(now) :]
        yield map_pb2.ImportGraphRequest(
            session_uuid=session.bytes,
            robot=robot,
            name=name,
            first=first + begin,
            frames=piece,
            loops=[
                map_pb2.ImportedLoop(
                    query=loop.query,
                    match=loop.match,
                    match_from_query=transform_message(loop.T_match_query),
                    covariance=covariance_message(loop.cov),
                )
                for loop in now
            ],
        )
        begin += len(piece)
