"""Routes, transforms between frames, and the surroundings of a frame."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional, Sequence, Union

import numpy as np

from relmap.enums import NumberedEnum
from relmap.errors import reads_reply
from relmap.geometry import (
    Array,
    PoseKind,
    chain,
    frozen,
    matrix_of_quaternion,
    read_covariance,
    read_transform,
)
from relmap.graph import (
    CarriedStretch,
    EdgeKind,
    Edges,
    UnmeasuredStretch,
    read_carried,
    read_edge,
)
from relmap.ids import EdgeId, FrameId, FrameLike, HasFrameId, SessionsLike, frame_message, read_edge_id, read_frame_id
from relmap.places import Localisation, read_localisation
from relmap.record import Record
from relmap.tables import make_table
from relmap.v1 import map_pb2
from relmap.views import View

if TYPE_CHECKING:
    from relmap.drawing.picture import Drawing


@dataclass(frozen=True, slots=True)
class Label:
    """An end of a route: any frame with this label."""

    text: str


@dataclass(frozen=True, slots=True)
class Robot:
    """An end of a route: the newest frame of the robot of this name."""

    name: str


RouteEnd = Union[FrameId, HasFrameId, Label, Robot, View, str]
"""An end of a route: a frame, the frames of a label, a robot, or a view. A text is a frame if it has the form "3:120", else a label."""


class RouteBy(NumberedEnum):
    """What a route minimises."""

    DISTANCE = 1
    """Metres."""
    TIME = 2
    """Seconds."""
    CERTAINTY = 3
    """The sum of the variances of the edges' translations, square metres."""


@dataclass(frozen=True, slots=True)
class RouteWeights:
    """The cost of an edge as a weighted sum; each weight is 0, or 1e-9 to 1e9, and not all are 0.

    Attributes:
        metre: of its length.
        driven_second, standing_second: of the time that robots drove and stood along it.
        square_metre_of_variance: of the trace of the covariance of its translation.
    """

    metre: float = 0.0
    driven_second: float = 0.0
    standing_second: float = 0.0
    square_metre_of_variance: float = 0.0


@dataclass(frozen=True, slots=True)
class RouteFilter:
    """What a route may use.

    Attributes:
        sessions: only frames of these may be passed; empty: all.
        avoid_frames: at most 10,000 frames that it avoids.
        avoid_labels: at most 100 labels whose frames it avoids.
        min_support: minimum number of observations that use an edge.
        long_loops: with loop edges longer than 5 m, which are only assumed to be passable.
        suppose_candidates, suppose_quarantined: treat such closures as edges.
    """

    sessions: SessionsLike = ()
    avoid_frames: Sequence[FrameLike] = ()
    avoid_labels: Sequence[str] = ()
    min_support: int = 0
    long_loops: bool = True
    suppose_candidates: bool = False
    suppose_quarantined: bool = False


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Route(Record):
    """A route, step by step: n frames, one element each in every list and array.

    Attributes:
        frames: tuple of n frames, from the start to the goal.
        T: float64 (n, 4, 4), pose of each frame in the first one, chained along the route (relative).
        cov: float64 (n, 6, 6), covariance of each T exp(xi), if it was asked for, else None.
        T_to_next: float64 (n - 1, 4, 4), the edges.
        distance_m, time_s: float64 (n,), from the start.
        labels: of each frame.
        edges: n - 1 edges; kinds: their kinds.
        long_loop, carried, unmeasured: bool (n - 1,), of each edge: longer than 5 m; the robot was carried; a guess.
        cost: the minimised cost.
        long_loops: number of loop edges longer than 5 m.
        carried_stretches, unmeasured_stretches: in the order of the route, at most 256 each.
        unmeasured_m: the part of the length that is a guess.
        frame_by_frame: why the daemon had to search frame by frame; empty: it searched by cells.
        bound_closures, no_way_by_edges: see relmap/v1/map.proto, RouteSummary.
        from_view, to_view: how ends that are views were localised.
        shared: of an alternative: the share of its length on or beside the routes before it, 0..0.75.
        alternatives: other routes, by cost, if they were asked for.
        map_version: the version of the map that was asked.
    """

    frames: tuple[FrameId, ...]
    T: Array
    cov: Optional[Array]
    T_to_next: Array
    distance_m: Array
    time_s: Array
    labels: tuple[tuple[str, ...], ...]
    edges: tuple[EdgeId, ...]
    kinds: tuple[EdgeKind, ...]
    long_loop: Array
    carried: Array
    unmeasured: Array
    cost: float
    long_loops: int
    carried_stretches: tuple[CarriedStretch, ...]
    unmeasured_stretches: tuple[UnmeasuredStretch, ...]
    unmeasured_m: float
    frame_by_frame: str
    bound_closures: bool
    no_way_by_edges: bool
    from_view: Optional[Localisation]
    to_view: Optional[Localisation]
    shared: float
    alternatives: tuple["Route", ...]
    map_version: int

    @property
    def kind(self) -> PoseKind:
        """What the poses are: relative to the first frame."""
        return PoseKind.RELATIVE

    @property
    def length_m(self) -> float:
        """The length of the whole route, metres."""
        return float(self.distance_m[-1]) if len(self.frames) else 0.0

    @property
    def duration_s(self) -> float:
        """The time that the robots took for it, seconds."""
        return float(self.time_s[-1]) if len(self.frames) else 0.0

    def __len__(self) -> int:
        return len(self.frames)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each frame. ImportError if pandas is not installed."""
        edges: list[Optional[str]] = [str(edge) for edge in self.edges] + [None]
        kinds: list[Optional[str]] = [kind.name.lower() for kind in self.kinds] + [None]
        return make_table(
            {
                "frame": [str(frame) for frame in self.frames],
                "x": self.T[:, 0, 3],
                "y": self.T[:, 1, 3],
                "z": self.T[:, 2, 3],
                "distance_m": self.distance_m,
                "time_s": self.time_s,
                "labels": [", ".join(labels) for labels in self.labels],
                "edge": edges[: len(self.frames)],
                "kind": kinds[: len(self.frames)],
            }
        )

    def draw(self, width: int = 800) -> "Drawing":
        """The route seen from above, `width` points wide; an SVG, which notebooks show."""
        from relmap.drawing.picture import draw_route

        return draw_route(self, width)

    def _repr_svg_(self) -> str:
        return self.draw().svg


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TransformBetween(Record):
    """The transform between two frames along the path between them.

    Attributes:
        T_ab: 4 x 4, relative pose of b in a, metres.
        cov: 6 x 6, covariance of T_ab exp(xi).
        edges: number of edges on the path.
        distance_m: length of the path.
        compounded: the covariance is compounded from those of single edges.
        carried, unmeasured: stretches of the path; if any is unmeasured, T_ab is a guess.
        unmeasured_m: the part of the length that is a guess.
        map_version: the version of the map that was asked.
    """

    T_ab: Array
    cov: Array
    edges: int
    distance_m: float
    compounded: bool
    carried: tuple[CarriedStretch, ...]
    unmeasured: tuple[UnmeasuredStretch, ...]
    unmeasured_m: float
    map_version: int

    @property
    def T(self) -> Array:
        """The same as T_ab (4 x 4)."""
        return self.T_ab

    @property
    def kind(self) -> PoseKind:
        """What the pose is: relative to a."""
        return PoseKind.RELATIVE


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Neighbourhood(Record):
    """The part of the map around a frame, in that frame's coordinates: n frames in the order of discovery.

    Attributes:
        frames: the root first.
        T: float64 (n, 4, 4), T_root_frame: relative poses along the shortest paths.
        depth: int64 (n,), edges from the root.
        distance_m: float64 (n,), along the path.
        time_us: int64 (n,), microseconds UTC.
        labels: of each frame.
        landmarks: of each frame, float64 (m, 3) in the root's coordinates; empty if they were not asked for.
        unmeasured_steps: int64 (n,), on the path from the root; if there are any, T is a guess.
        edges: edges of the graph between these frames.
        cut: there are more frames within the limits than max_frames.
        map_version: the version of the map that was asked.
    """

    frames: tuple[FrameId, ...]
    T: Array
    depth: Array
    distance_m: Array
    time_us: Array
    labels: tuple[tuple[str, ...], ...]
    landmarks: tuple[Array, ...]
    unmeasured_steps: Array
    edges: Edges
    cut: bool
    map_version: int

    @property
    def kind(self) -> PoseKind:
        """What the poses are: relative to the root."""
        return PoseKind.RELATIVE

    def __len__(self) -> int:
        return len(self.frames)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each frame. ImportError if pandas is not installed."""
        return make_table(
            {
                "frame": [str(frame) for frame in self.frames],
                "x": self.T[:, 0, 3],
                "y": self.T[:, 1, 3],
                "z": self.T[:, 2, 3],
                "depth": self.depth,
                "distance_m": self.distance_m,
                "time_us": self.time_us,
                "labels": [", ".join(labels) for labels in self.labels],
            }
        )

    def draw(self, width: int = 800) -> "Drawing":
        """The surroundings seen from above, `width` points wide; an SVG, which notebooks show."""
        from relmap.drawing.picture import draw_neighbourhood

        return draw_neighbourhood(self, width)

    def _repr_svg_(self) -> str:
        return self.draw().svg


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Trajectory(Record):
    """The motion of one session, chained along its odometry edges: n frames.

    Attributes:
        session: its number.
        time_us: int64 (n,), microseconds UTC, as far as the digits of the file go.
        T: float64 (n, 4, 4), poses in the first frame. They are odometry: closures do not bend them.
    """

    session: int
    time_us: Array
    T: Array

    @property
    def kind(self) -> PoseKind:
        """What the poses are: odometry."""
        return PoseKind.ODOMETRY

    def __len__(self) -> int:
        return len(self.time_us)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each frame. ImportError if pandas is not installed."""
        return make_table(
            {"time_us": self.time_us, "x": self.T[:, 0, 3], "y": self.T[:, 1, 3], "z": self.T[:, 2, 3]}
        )


def end_message(end: RouteEnd) -> map_pb2.RouteEnd:
    """An end of a route as a message. TypeError: it is none."""
    if isinstance(end, str):
        end = FrameId.parse(end) if re.fullmatch(r"\d+:\d+", end) else Label(end)
    if isinstance(end, FrameId) or isinstance(getattr(end, "id", None), FrameId):
        return map_pb2.RouteEnd(frame=frame_message(end))  # type: ignore[arg-type]
    if isinstance(end, Label):
        return map_pb2.RouteEnd(label=end.text)
    if isinstance(end, Robot):
        return map_pb2.RouteEnd(robot=end.name)
    if isinstance(end, View):
        return map_pb2.RouteEnd(view=end.message)
    raise TypeError(f"an end of a route is a FrameId, Label, Robot, View or text, not {type(end).__name__}")


def read_unmeasured(message: map_pb2.UnmeasuredStretch) -> UnmeasuredStretch:
    """The unmeasured stretch of a message."""
    return UnmeasuredStretch(
        read_frame_id(message.first), read_frame_id(message.last), message.steps, message.distance_m
    )


@dataclass
class RouteParts:
    """Collects the messages of one route of a stream. Internal."""

    summary: map_pb2.RouteSummary = field(default_factory=map_pb2.RouteSummary)
    steps: list[map_pb2.RouteStep] = field(default_factory=list)

    def add(self, message: map_pb2.FindRouteReply) -> None:
        """Takes in the next message."""
        if message.HasField("summary"):
            self.summary = message.summary
        self.steps.extend(message.steps)

    @reads_reply
    def route(self, alternatives: tuple[Route, ...] = ()) -> Route:
        """The route that was collected."""
        s, steps = self.summary, self.steps
        to_next = [read_transform(step.to_next) for step in steps[:-1]]
        with_cov = bool(steps) and all(step.HasField("covariance") for step in steps)
        if with_cov:
            T = np.stack([read_transform(step.start_from_this) for step in steps])
        else:
            T = chain(to_next) if steps else np.empty((0, 4, 4))
        return Route(
            frames=tuple(read_frame_id(step.frame) for step in steps),
            T=frozen(T),
            cov=frozen(np.stack([read_covariance(step.covariance) for step in steps])) if with_cov else None,
            T_to_next=frozen(np.stack(to_next) if to_next else np.empty((0, 4, 4))),
            distance_m=frozen(np.array([step.distance_m for step in steps], float)),
            time_s=frozen(np.array([step.time_s for step in steps], float)),
            labels=tuple(tuple(step.labels) for step in steps),
            edges=tuple(read_edge_id(step.edge) for step in steps[:-1]),
            kinds=tuple(EdgeKind(step.kind) for step in steps[:-1]),
            long_loop=frozen(np.array([step.long_loop for step in steps[:-1]], bool)),
            carried=frozen(np.array([step.carried for step in steps[:-1]], bool)),
            unmeasured=frozen(np.array([step.unmeasured for step in steps[:-1]], bool)),
            cost=s.cost,
            long_loops=s.long_loops,
            carried_stretches=tuple(read_carried(stretch) for stretch in s.carried),
            unmeasured_stretches=tuple(read_unmeasured(stretch) for stretch in s.unmeasured),
            unmeasured_m=s.unmeasured_m,
            frame_by_frame=s.frame_by_frame,
            bound_closures=s.bound_closures,
            no_way_by_edges=s.no_way_by_edges,
            from_view=read_localisation(s.from_view) if s.HasField("from_view") else None,
            to_view=read_localisation(s.to_view) if s.HasField("to_view") else None,
            shared=s.shared,
            alternatives=alternatives,
            map_version=s.map_version,
        )


@reads_reply
def read_transform_between(message: map_pb2.TransformBetweenReply) -> TransformBetween:
    """The transform of a message."""
    return TransformBetween(
        T_ab=read_transform(message.a_from_b),
        cov=read_covariance(message.covariance),
        edges=message.edges,
        distance_m=message.distance_m,
        compounded=message.compounded,
        carried=tuple(read_carried(stretch) for stretch in message.carried),
        unmeasured=tuple(read_unmeasured(stretch) for stretch in message.unmeasured),
        unmeasured_m=message.unmeasured_m,
        map_version=message.map_version,
    )


def _points(messages: Any) -> Array:
    return frozen(np.array([(p.x, p.y, p.z) for p in messages], dtype=float).reshape(-1, 3))


@reads_reply
def read_neighbourhood(message: map_pb2.GetNeighbourhoodReply) -> Neighbourhood:
    """The neighbourhood of a message."""
    frames = message.frames
    return Neighbourhood(
        frames=tuple(read_frame_id(f.frame) for f in frames),
        T=frozen(np.stack([read_transform(f.root_from_frame) for f in frames]) if frames else np.empty((0, 4, 4))),
        depth=frozen(np.array([f.depth for f in frames], np.int64)),
        distance_m=frozen(np.array([f.distance_m for f in frames], float)),
        time_us=frozen(np.array([f.time_us for f in frames], np.int64)),
        labels=tuple(tuple(f.labels) for f in frames),
        landmarks=tuple(_points(f.landmarks) for f in frames),
        unmeasured_steps=frozen(np.array([f.unmeasured_steps for f in frames], np.int64)),
        edges=Edges(read_edge(edge) for edge in message.edges),
        cut=message.cut,
        map_version=message.map_version,
    )


@reads_reply
def parse_tum(session: int, text: bytes) -> Trajectory:
    """The trajectory of a session's file in the format TUM: "time tx ty tz qx qy qz qw", time in seconds."""
    times, poses = [], []
    for line in text.decode().splitlines():
        if not line or line.startswith("#"):
            continue
        time, tx, ty, tz, qx, qy, qz, qw = line.split()
        seconds, _, fraction = time.partition(".")
        times.append(int(seconds) * 1_000_000 + int((fraction + "000000")[:6]))
        poses.append((float(qw), float(qx), float(qy), float(qz), float(tx), float(ty), float(tz)))
    T = np.tile(np.eye(4), (len(poses), 1, 1))
    for i, p in enumerate(poses):
        T[i, :3, :3] = matrix_of_quaternion(*p[:4])
        T[i, :3, 3] = p[4:]
    return Trajectory(session, frozen(np.array(times, np.int64)), frozen(T))
