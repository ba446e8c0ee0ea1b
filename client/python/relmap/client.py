"""The client of a running relmapd. Made of relmap/aio.py by client/python/make_sync; do not edit.

    with relmap.connect("/var/lib/relmap/map") as client:
        place = client.localise("left.png", "right.png", camera=1)

Thread-safe, but for its iterators and ingest sessions, of which each belongs to one thread at a time.
"""

from __future__ import annotations

import math
import time
import uuid as uuids
from types import TracebackType
from typing import Any, Iterator, Callable, List, Optional, Sequence, Set, Type, TypeVar, Union

from relmap.calls import Caller
from relmap.ingest import IngestSession
from relmap.camera import RawStereo, StereoCamera
from relmap.connection import Connection
from relmap.credentials import PathLike, credentials_of
from relmap.drawing.picture import Drawing, draw_map
from relmap.errors import ClientClosed, DaemonError, Unreachable, ViewExpired
from relmap.events import MapEvent, StorageChanged, read_event
from relmap.evidence import ClosureMatrix, EdgeEdit, Explanation, read_count, read_edit, read_explanation
from relmap.exports import ExportedFrame, ExportFormat, TrajectoryFile, read_exported_frame
from relmap.geometry import ArrayLike
from relmap.graph import (
    Edge,
    EdgeKind,
    Edges,
    EdgeState,
    Frame,
    LabelledFrames,
    Session,
    Sessions,
    read_edge,
    read_frame,
    read_session,
)
from relmap.ids import EdgeLike, FrameLike, as_frame, edge_message, frame_message, read_frame_id
from relmap.ingest_core import SessionStatus, read_session_status
from relmap.operations import (
    AuditLog,
    Backup,
    Compaction,
    Finding,
    OnProgress,
    StoreStats,
    VerifySummary,
    read_audit_entry,
    read_finding,
    read_progress,
    read_stats,
    read_verify_summary,
)
from relmap.pictures import PictureLike
from relmap.places import Localisation, PlaceMatches, read_localisation, read_matches
from relmap.reason import Reason
from relmap.requests import (
    EdgeAction,
    EdgeOrder,
    ImportedLoop,
    as_uuid,
    edge_state_request,
    edges_request,
    import_requests,
    route_request,
)
from relmap.routes import (
    Neighbourhood,
    Route,
    RouteBy,
    RouteEnd,
    RouteFilter,
    RouteParts,
    RouteWeights,
    Trajectory,
    TransformBetween,
    parse_tum,
    read_neighbourhood,
    read_transform_between,
)
from relmap.skeleton import Skeleton, SkeletonChain, joined_chains, read_chain, read_closures, skeleton_of_edges
from relmap.status import DaemonStatus, Robots, read_robot, read_status
from relmap.times import TimeLike, as_us
from relmap.v1 import admin_pb2, evidence_pb2, ingest_pb2, map_pb2, skeleton_pb2, status_pb2, watch_pb2
from relmap.views import CameraLike, ViewLike, view_message

T = TypeVar("T")

LONG_S = 24 * 3600.0
"""Seconds that calls may take which read or write the whole map, unless they are given a timeout."""

_MAX_RESTARTS = 5  # of a list whose version of the map expired
_FIRST_PAUSE_S, _MAX_PAUSE_S = 0.1, 2.0


def _copy(request: Any) -> Any:
    copy = type(request)()
    copy.CopyFrom(request)
    return copy


def connect(
    server: PathLike,
    *,
    token: Optional[str] = None,
    tls: Union[None, bool, bytes, PathLike] = None,
    credentials: Optional[PathLike] = None,
    timeout: float = 60.0,
    request_id: str = "",
    traceparent: str = "",
) -> "Client":
    """Connects to a running relmapd.

    Args:
        server: the data folder of a daemon on this machine, or "HOST:PORT".
        token: who the caller is, of `relmap-admin credentials new --token`; with `tls`.
        tls: certificate of the authority that issued the daemon's: a path, or its bytes (PEM).
        credentials: instead of both: a file of `relmap-admin credentials new`. A data folder needs none.
        timeout: seconds that a call may take; a whole list or stream is one call.
        request_id: names the calls in the daemon's log; at most 64 letters, digits and "-_.".
        traceparent: the trace that the calls belong to (W3C Trace Context).

    Raises:
        Unreachable: no daemon answers; the message says why.
        AccessError: the daemon does not know the caller, or the data folder may not be read.
        RequestError: `server` is neither a folder nor HOST:PORT.
        DaemonError: NO_SUCH_FILE, BAD_CONFIG: the credentials cannot be used.
        ValueError: arguments that do not go together.
    """
    shown = credentials_of(credentials, token, tls)
    connection = Connection(str(server), shown, timeout, request_id, traceparent)
    return Client(Caller.open(connection))


class Client:
    """A client of a running relmapd. Made by connect(); a context manager, which closes it.

    Every method raises Unreachable, DeadlineExceeded, AccessError or another RelmapError if the daemon refuses; the
    comments in relmap/v1/map.proto and admin.proto list the reasons of each call. Wrong arguments raise ValueError or
    TypeError before anything is sent. A `timeout` of None is that of connect().
    """

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self._connection = caller.connection
        self._map = caller.stubs.map
        self._admin = caller.stubs.admin
        self._ingest = caller.stubs.ingest
        self._own: Set[Caller] = set()  # of watchers that connected again

    def __enter__(self) -> "Client":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection; calls under way fail."""
        self._caller.close()
        for caller in tuple(self._own):
            self._forget(caller)

    def connect_again(self) -> "Client":
        """Another client of the same server, since a restarted daemon may use another port. Raises as connect()."""
        return Client(Caller.open(self._connection))

    # ---- Places

    def localise(
        self,
        view: ViewLike,
        right: Optional[PictureLike] = None,
        *,
        camera: Optional[CameraLike] = None,
        prior: Optional[FrameLike] = None,
        correspondences: bool = False,
        timeout: Optional[float] = None,
    ) -> Localisation:
        """Recognises the place of a view, and returns the view's pose relative to a frame there, in metres.

        Args:
            view: a View, a FrameId (what that frame saw), or a picture: a path, bytes, or an array of uint8 (H x W, or
                H x W x 3 in RGB).
            right: the right picture of a stereo pair.
            camera: that took the pictures; None: not known, and the focal length is estimated.
            prior: a frame near the view: its surroundings are searched first.
            correspondences: with the points that the view and the frame both show.

        Raises:
            PlaceNotRecognised: NEW_PLACE, AMBIGUOUS_PLACE, TOO_FEW_INLIERS, EMPTY_MAP, ...
            RequestError: NO_CALIBRATION, WRONG_CALIBRATION, NOT_STEREO, NO_SUCH_FRAME, a damaged picture, ...
            CameraError: ROWS_APART: the pair is not rectified.
        """
        request = map_pb2.LocaliseRequest(view=view_message(view, right, camera), correspondences=correspondences)
        if prior is not None:
            request.prior.CopyFrom(frame_message(prior))
        return read_localisation(self._ask(self._map.Localise, request, timeout), correspondences)

    def match_image(
        self,
        view: ViewLike,
        right: Optional[PictureLike] = None,
        *,
        camera: Optional[CameraLike] = None,
        max_places: int = 0,
        max_verified: int = 0,
        thumbnails: bool = False,
        near: Optional[FrameLike] = None,
        correspondences: bool = False,
        timeout: Optional[float] = None,
    ) -> PlaceMatches:
        """The places that a picture of any camera could show, and the probability that it shows none of them.

        Args:
            view, right, camera: as in localise().
            max_places: how many to return; 0: 20.
            max_verified: on how many geometry is tried; 0: 10, at most 20.
            thumbnails: with thumbnails of the places.
            near: a frame supposed to be near: places around it are more likely.
            correspondences: with the points that the view and each place both show.

        Raises:
            PlaceNotRecognised: EMPTY_MAP, TOO_FEW_FEATURES. If nothing is recognised, the call succeeds, and the
                result's `reason` says why.
            RequestError: as localise().
        """
        request = map_pb2.MatchImageRequest(
            view=view_message(view, right, camera),
            max_places=max_places,
            max_verified=max_verified,
            thumbnails=thumbnails,
            correspondences=correspondences,
        )
        if near is not None:
            request.near.CopyFrom(frame_message(near))
        return read_matches(self._ask(self._map.MatchImage, request, timeout), correspondences)

    # ---- Routes and transforms

    def find_route(
        self,
        start: RouteEnd,
        goal: RouteEnd,
        *,
        by: RouteBy = RouteBy.DISTANCE,
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
            by: what is minimised; `weights` instead: a weighted sum.
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
        request = route_request(
            start, goal, by, weights, count_standing, max_cost, or_from, or_to, filter, covariance, alternatives
        )
        parts: List[RouteParts] = []
        for reply in self._replies(self._map.FindRoute, request, timeout):
            while len(parts) <= reply.route:
                parts.append(RouteParts())
            parts[reply.route].add(reply)
        first = parts[0] if parts else RouteParts()
        return first.route(tuple(other.route() for other in parts[1:]))

    def transform_between(
        self, a: FrameLike, b: FrameLike, *, timeout: Optional[float] = None
    ) -> TransformBetween:
        """The relative transform between two frames, along the path between them. RequestError: NO_SUCH_FRAME,
        NOT_CONNECTED, OUT_OF_REACH."""
        request = map_pb2.TransformBetweenRequest(a=frame_message(a), b=frame_message(b))
        return read_transform_between(self._ask(self._map.TransformBetween, request, timeout))

    def neighbourhood(
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
        return read_neighbourhood(self._ask(self._map.GetNeighbourhood, request, timeout))

    # ---- What is stored

    def frame(
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
        reply = self._ask(self._map.GetFrame, request, timeout)
        return read_frame(reply.frame, landmarks, observations, appearance, picture)

    def sessions(self, *, timeout: Optional[float] = None) -> Sessions:
        """All sessions, of one version of the map."""
        return Sessions(
            self._list(
                self._map.ListSessions, map_pb2.ListSessionsRequest, lambda reply: reply.sessions, read_session, timeout
            )
        )

    def edges(
        self,
        *,
        states: Sequence[EdgeState] = (),
        kinds: Sequence[EdgeKind] = (),
        session: int = 0,
        other_session: int = 0,
        frame: Optional[FrameLike] = None,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        min_suspicion: float = 0.0,
        around: Optional[FrameLike] = None,
        around_edges: int = 0,
        around_metres: float = 0.0,
        order: EdgeOrder = EdgeOrder.ID,
        timeout: Optional[float] = None,
    ) -> Edges:
        """Edges, all of one version of the map: if that version expires meanwhile, the list is read again.

        Args:
            states, kinds: only these; empty: all.
            session: with an end in this session; 0: any. With `other_session`: between the two, or within one.
            frame: of this frame.
            since, until: of which the newer end was taken since then, and before then.
            min_suspicion: only loop closures at least as suspicious, 0..1.
            around: with an end at most `around_edges` edges (0: 30) and `around_metres` (0: no limit) from this frame.
            order: by id, suspicion (the most suspicious first) or time (the newest first).

        Raises:
            RequestError: NO_SUCH_SESSION, NO_SUCH_FRAME.
            ViewExpired: the version expired again and again; use iter_edges(), or narrower filters.
        """

        def request() -> map_pb2.ListEdgesRequest:
            return edges_request(
                states, kinds, session, other_session, frame, since, until, min_suspicion, around, around_edges,
                around_metres, order,
            )  # fmt: skip

        return Edges(self._list(self._map.ListEdges, request, lambda reply: reply.edges, read_edge, timeout))

    def iter_edges(
        self,
        *,
        states: Sequence[EdgeState] = (),
        kinds: Sequence[EdgeKind] = (),
        session: int = 0,
        other_session: int = 0,
        frame: Optional[FrameLike] = None,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        min_suspicion: float = 0.0,
        around: Optional[FrameLike] = None,
        around_edges: int = 0,
        around_metres: float = 0.0,
        order: EdgeOrder = EdgeOrder.ID,
        page_size: int = 0,
        timeout: Optional[float] = None,
    ) -> Iterator[Edge]:
        """The same page by page, for maps whose edges do not fit into memory.

        All are of one version of the map. If it expires before the first edge was given out, the list begins again by
        itself; afterwards ViewExpired is raised, since edges of two versions do not go together: begin again.

        Args:
            states, kinds, session, other_session, frame, since, until, min_suspicion, around, around_edges, around_metres,
                order: as in edges().
            page_size: how many are asked for at once; 0: as many as the daemon likes.
        """

        def request() -> map_pb2.ListEdgesRequest:
            made = edges_request(
                states, kinds, session, other_session, frame, since, until, min_suspicion, around, around_edges,
                around_metres, order,
            )  # fmt: skip
            made.page_size = page_size
            return made

        for edge in self._iterate(self._map.ListEdges, request, lambda reply: reply.edges, read_edge, timeout):
            yield edge

    def labels(
        self, prefix: str = "", words: str = "", *, timeout: Optional[float] = None
    ) -> Sequence[LabelledFrames]:
        """Labels, ascending, with their frames.

        Args:
            prefix: of the label; upper and lower case of a to z are equal.
            words: for each of these words, the label has a word that begins with it.
        """

        def read(message: Any) -> LabelledFrames:
            return LabelledFrames(message.label, tuple(read_frame_id(frame) for frame in message.frames))

        def request() -> map_pb2.FindLabelsRequest:
            return map_pb2.FindLabelsRequest(prefix=prefix, words=words)

        return tuple(self._list(self._map.FindLabels, request, lambda reply: reply.labels, read, timeout))

    def robots(self, *, timeout: Optional[float] = None) -> Robots:
        """Sessions heard of in the last minute, and for ten minutes those that fell silent without having ended."""
        reply = self._ask(self._map.ListRobots, status_pb2.ListRobotsRequest(), timeout)
        return Robots(read_robot(robot) for robot in reply.robots)

    def status(self, *, timeout: Optional[float] = None) -> DaemonStatus:
        """The status of the daemon."""
        return read_status(self._ask(self._map.GetStatus, status_pb2.GetStatusRequest(), timeout))

    # ---- Loop closures

    def explain_edge(
        self, edge: EdgeLike, *, pictures: bool = False, timeout: Optional[float] = None
    ) -> Explanation:
        """What a loop closure is believed for. RequestError: NO_SUCH_EDGE. ClosureStateError: ODOMETRY_EDGE.

        Args:
            edge: the closure.
            pictures: with the pictures of both ends, which Explanation.draw_pair() draws.
        """
        request = evidence_pb2.ExplainEdgeRequest(edge=edge_message(edge), pictures=pictures)
        return read_explanation(self._ask(self._map.ExplainEdge, request, timeout), pictures)

    def closure_matrix(
        self, sessions: Sequence[int] = (), *, timeout: Optional[float] = None
    ) -> ClosureMatrix:
        """How many loop closures there are between each two sessions; only pairs with one of `sessions`, if any are given.
        RequestError: NO_SUCH_SESSION."""

        def request() -> evidence_pb2.GetClosureMatrixRequest:
            return evidence_pb2.GetClosureMatrixRequest(sessions=sessions)

        cells = self._list(self._map.GetClosureMatrix, request, lambda reply: reply.cells, read_count, timeout)
        return ClosureMatrix(cells)

    def edit_edge(
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
        return read_edit(self._edit(self._map.SetEdgeState, request, timeout))

    def propose_edge(
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
        return read_edit(self._edit(self._map.ProposeEdge, request, timeout))

    # ---- Other edits

    def set_label(
        self, frame: FrameLike, label: str, present: bool = True, *, timeout: Optional[float] = None
    ) -> tuple[str, ...]:
        """Adds a label to a frame, or removes it if `present` is False. Returns the frame's labels afterwards.
        RequestError: NO_SUCH_FRAME, NO_SUCH_LABEL. RobotDataError: BAD_NAME."""
        request = map_pb2.SetLabelRequest(frame=frame_message(frame), label=label, remove=not present)
        return tuple((self._edit(self._map.SetLabel, request, timeout)).labels)

    def import_graph(
        self,
        session: Union[str, bytes, uuids.UUID],
        T_odom_frame: ArrayLike,
        time_us: ArrayLike,
        *,
        robot: str,
        name: str,
        first: int = 0,
        step_cov: Optional[ArrayLike] = None,
        driven_us: Optional[ArrayLike] = None,
        loops: Sequence[ImportedLoop] = (),
        timeout: Optional[float] = None,
    ) -> int:
        """Imports a pose graph that was made elsewhere, whose frames have no pictures. Returns the session's number.

        What the map already holds stays, so the same graph may be imported again, and continued. It is sent in pieces of
        at most 1000 frames.

        Args:
            session: uuid of the session; the same graph has the same.
            T_odom_frame: (n, 4, 4), poses in the graph's own odometry; cameras' axes: x right, y down, z forward.
            time_us: (n,), microseconds UTC, ascending.
            robot, name: for display.
            first: index of the first of these frames.
            step_cov: (n, 6, 6), covariances of the steps from the frame before; that of the first is not used. NaN: that
                motion is not known. None: none is.
            driven_us: (n,), durations of the steps, for routes by time.
            loops: loop closures between these frames, or to frames that were imported before.

        Raises:
            RobotDataError: BAD_NAME, TIME_BACKWARDS, BAD_COVARIANCE, CALIBRATION_CHANGED (the session is a robot's), ...
            DaemonError: BUDGET_EXCEEDED: another graph is being imported.
        """
        number = 0
        for request in import_requests(
            as_uuid(session), T_odom_frame, time_us, robot, name, first, step_cov, driven_us, loops
        ):
            number = (self._retry(self._map.ImportGraph, request, timeout)).session
        return number

    # ---- Events

    def watch(
        self,
        *,
        sessions: Sequence[int] = (),
        oldest: bool = False,
        resume_token: str = "",
        no_frames: bool = False,
        patience: Optional[float] = 60.0,
        silence: float = 45.0,
    ) -> Iterator[MapEvent]:
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
            sessions=sessions, resume_token=resume_token, no_frames=no_frames, **{"from": start}
        )
        caller = self._caller
        gone_since: Optional[float] = None
        pause = _FIRST_PAUSE_S
        storage: Optional[StorageChanged] = None
        try:
            while True:
                try:
                    for message in caller.stream(caller.stubs.map.WatchMap, request, math.inf, silence):
                        gone_since, pause = None, _FIRST_PAUSE_S
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
                    time.sleep(min(pause, left))
                    pause = min(2 * pause, _MAX_PAUSE_S)
                    if self._caller.closed:
                        raise ClientClosed
                    try:
                        limit = min(self._connection.timeout, silence, left)
                        again = Caller.open(self._connection.with_timeout(limit))
                    except DaemonError as error:
                        lost = error if isinstance(error, Unreachable) else lost
                self._forget(caller)
                caller = again
                self._own.add(caller)
                if self._caller.closed:
                    raise ClientClosed  # in the meantime
        finally:
            self._forget(caller)

    # ---- Pictures of the map, and exports

    def skeleton(
        self,
        level: int = 1,
        *,
        sessions: Sequence[int] = (),
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
        request = skeleton_pb2.GetSkeletonRequest(level=level, sessions=sessions, candidates=candidates)
        chains: List[SkeletonChain] = []
        closures: List[skeleton_pb2.SkeletonClosures] = []
        total, version = 0, 0
        for reply in self._replies(self._map.GetSkeleton, request, timeout):
            chains.extend(read_chain(chain) for chain in reply.chains)
            closures.append(reply.closures)
            total, version = reply.frames_total, reply.map_version
        return Skeleton(joined_chains(chains), read_closures(closures), total, version)

    def draw_map(
        self,
        *,
        sessions: Sequence[int] = (),
        level: int = 1,
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
            level: as in skeleton().
            candidates: with closures that are not in force.
            labels: with labels.
            width: of the picture, points.

        Raises:
            RequestError: NO_SUCH_SESSION.
            ViewExpired: as skeleton().
        """
        try:
            skeleton = self.skeleton(level, sessions=sessions, candidates=candidates, timeout=timeout)
        except DaemonError as error:
            if error.reason != Reason.UNIMPLEMENTED:
                raise
            skeleton = self._skeleton_of_edges(sessions, candidates, timeout)  # of an older daemon
        named = self.labels(timeout=timeout) if labels else ()
        names = {session.number: session.name for session in self.sessions(timeout=timeout)}
        return draw_map(skeleton.relaxed_picture(), width, names, named)

    def export_trajectories(
        self,
        format: ExportFormat = ExportFormat.TUM,
        sessions: Sequence[int] = (),
        *,
        timeout: Optional[float] = LONG_S,
    ) -> tuple[TrajectoryFile, ...]:
        """The trajectory of each session as a file: its odometry edges, chained. Closures do not bend it. All are of one
        version of the map: if that expires meanwhile, they are read again.

        Args:
            format: TUM ("time tx ty tz qx qy qz qw") or KITTI (the upper three rows of the pose matrix).
            sessions: empty: all but mono sessions.

        Raises:
            RequestError: NO_SUCH_SESSION, NOT_STEREO: a mono session, which has no motion.
            ViewExpired: the version expired again and again; export one session at a time.
        """
        if format not in (ExportFormat.TUM, ExportFormat.KITTI):
            raise ValueError(f"format is {format!r}; must be TUM or KITTI")
        request = map_pb2.ExportRequest(format=int(format), sessions=sessions)  # type: ignore[arg-type]
        files: List[TrajectoryFile] = []
        for reply in self._replies(self._map.Export, request, timeout):
            doubtful = Edges(read_edge(edge) for edge in reply.unmeasured)
            if files and files[-1].session == reply.session:
                last = files[-1]
                files[-1] = TrajectoryFile(last.session, last.data + reply.data, Edges(last.doubtful + doubtful))
            else:
                files.append(TrajectoryFile(reply.session, reply.data, doubtful))
        return tuple(files)

    def odometry(self, session: int, *, timeout: Optional[float] = LONG_S) -> Trajectory:
        """The motion of a session, chained along its odometry edges: it drifts, and knows of no closure. Raises as
        export_trajectories()."""
        files = self.export_trajectories(ExportFormat.TUM, [session], timeout=timeout)
        return parse_tum(session, b"".join(file.data for file in files))

    def export_frames(
        self, sessions: Sequence[int] = (), *, landmarks: bool = False, timeout: Optional[float] = LONG_S
    ) -> Iterator[ExportedFrame]:
        """The frames of each session, ascending, with their landmarks if `landmarks` is set. A stream that breaks goes on.

        All are of one version of the map. If it expires before the first frame was given out, the export begins again by
        itself; afterwards ViewExpired is raised, since frames of two versions do not go together: begin again.

        Raises:
            RequestError: NO_SUCH_SESSION, NOT_STEREO.
            ViewExpired: as above; the message says how many frames were given out.
        """
        request = map_pb2.ExportRequest(
            format=map_pb2.EXPORT_FORMAT_FRAMES, sessions=sessions, landmarks=landmarks
        )
        until = self._until(timeout)

        def replies() -> Iterator[Any]:
            return self._caller.resumed(self._map.Export, _copy(request), until - time.monotonic())

        for frame in self._given(replies, lambda reply: reply.frames, read_exported_frame, "frames", "export"):
            yield frame

    # ---- For operators

    def verify(
        self,
        sessions: Sequence[int] = (),
        *,
        on_progress: Optional[OnProgress] = None,
        timeout: Optional[float] = LONG_S,
    ) -> VerifySummary:
        """Checks everything that is stored, and changes nothing. Damage is in the result's findings.

        Args:
            sessions: only these; empty: all.
            on_progress: called several times a second; if it raises, the work ends.

        Raises:
            DaemonError: BUDGET_EXCEEDED: the daemon verifies, backs up or compacts already.
        """
        request = admin_pb2.VerifyRequest(sessions=sessions)
        findings: List[Finding] = []
        summary = admin_pb2.VerifySummary()
        for reply in self._caller.stream(self._admin.Verify, request, timeout):
            findings.extend(read_finding(finding) for finding in reply.findings)
            if reply.HasField("summary"):
                summary = reply.summary
            if on_progress is not None and reply.HasField("progress"):
                on_progress(read_progress(reply.progress))
        return read_verify_summary(summary, tuple(findings))

    def backup(
        self, folder: str, *, on_progress: Optional[OnProgress] = None, timeout: Optional[float] = LONG_S
    ) -> Backup:
        """Writes a data folder on the daemon's machine with all that was durable when the call came.

        Args:
            folder: absolute, below one of the daemon's --backup-root, and not there yet.
            on_progress: as in verify().

        Raises:
            RequestError: INVALID_ARGUMENT: the folder.
            DaemonError: BUDGET_EXCEEDED, UNSUPPORTED, DISK_FULL.
        """
        outcome = self._work(self._admin.Backup, admin_pb2.BackupRequest(folder=folder), on_progress, timeout)
        return Backup(outcome.backup.folder, outcome.backup.bytes, outcome.backup.durable_sequence)

    def compact(
        self, *, on_progress: Optional[OnProgress] = None, timeout: Optional[float] = LONG_S
    ) -> Compaction:
        """Frees the disk space of replaced and deleted data; meanwhile it needs room for a second copy of the map.
        DaemonError: BUDGET_EXCEEDED, DISK_FULL."""
        outcome = self._work(self._admin.Compact, admin_pb2.CompactRequest(), on_progress, timeout)
        return Compaction(outcome.compact.bytes_before, outcome.compact.bytes_after)

    def repair(self, sessions: Sequence[int] = (), *, timeout: Optional[float] = None) -> None:
        """Always refused (DaemonError, FOLDER_LOCKED), since a map is repaired only while no daemon serves it; the message
        says how."""
        request = admin_pb2.RepairRequest(sessions=sessions)
        for _ in self._caller.stream(self._admin.Repair, request, timeout):
            pass

    def reindex(self, vocabulary: str = "", *, timeout: Optional[float] = None) -> None:
        """Always refused (DaemonError, FOLDER_LOCKED), since words are computed anew only while no daemon serves the map; the
        message says how."""
        request = admin_pb2.ReindexRequest(vocabulary=vocabulary)
        for _ in self._caller.stream(self._admin.Reindex, request, timeout):
            pass

    def stats(self, *, timeout: Optional[float] = None) -> StoreStats:
        """Sizes of what is stored."""
        return read_stats(self._ask(self._admin.GetStats, admin_pb2.GetStatsRequest(), timeout))

    def wait_idle(self, *, timeout: Optional[float] = None) -> int:
        """Returns when everything durable is applied, looked up and relaxed, and deletions are complete, with the journal
        sequence up to which it is. DeadlineExceeded: it took longer."""
        reply = self._ask(self._admin.WaitIdle, admin_pb2.WaitIdleRequest(), timeout)
        return int(reply.applied_sequence)

    def commit(self, *, timeout: Optional[float] = None) -> int:
        """Commits now what is dirty, and returns the journal sequence up to which the map is committed."""
        reply = self._ask(self._admin.Commit, admin_pb2.CommitRequest(), timeout)
        return int(reply.applied_sequence)

    def set_log_level(self, level: str = "", *, timeout: Optional[float] = None) -> str:
        """Changes what the daemon's log tells (trace, debug, info, warning, error), and returns the former level. Empty: only
        asks. RequestError: there is no such level."""
        reply = self._ask(self._admin.SetLogLevel, admin_pb2.SetLogLevelRequest(level=level), timeout)
        return str(reply.former)

    def freeze_session(
        self, session: int, frozen: bool = True, *, timeout: Optional[float] = None
    ) -> None:
        """Freezes a session, or thaws it: a frozen one takes no keyframes, and its edges and landmarks do not change.
        RequestError: NO_SUCH_SESSION. RobotDataError: SESSION_DELETED."""
        request = admin_pb2.FreezeSessionRequest(session=session, frozen=frozen)
        self._edit(self._admin.FreezeSession, request, timeout)

    def delete_session(
        self,
        session: int,
        uuid: str,
        *,
        on_progress: Optional[OnProgress] = None,
        timeout: Optional[float] = LONG_S,
    ) -> None:
        """Deletes a session for good; returns when all its frames are gone.

        Args:
            session, uuid: both must be of the session, as a safeguard.
            on_progress: as in verify(); the deletion continues even if it raises.

        Raises:
            RequestError: NO_SUCH_SESSION, INVALID_ARGUMENT: the uuid is another's.
            DeadlineExceeded: the deletion continues; the same call reports its progress.
        """
        request = admin_pb2.DeleteSessionRequest(session=session, uuid=uuid, idempotency_key=uuids.uuid4().hex)
        self._work(self._admin.DeleteSession, request, on_progress, timeout)

    def audit(
        self,
        *,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        who: str = "",
        method: str = "",
        failed: bool = False,
        limit: int = 1000,
        timeout: Optional[float] = None,
    ) -> AuditLog:
        """What operators did and tried, the newest first. If entries are deleted while it is read, it is read again.

        Args:
            since, until: entries since then, and before then.
            who: of this caller; empty: of all.
            method: of this method, such as "Map.SetEdgeState"; empty: of all.
            failed: only what did not succeed.
            limit: at most so many.

        Raises:
            DaemonError: UNSUPPORTED: the daemon keeps no audit log.
            ViewExpired: entries were deleted again and again; ask for fewer, by `limit` or `since`.
        """
        request = admin_pb2.ListAuditRequest(
            from_us=0 if since is None else as_us(since),
            until_us=0 if until is None else as_us(until),
            who=who,
            method=method,
            failed=failed,
            page_size=min(limit, 1000),
        )
        until_s = self._until(timeout)

        def read() -> AuditLog:
            entries: List[Any] = []
            if limit > 0:
                for reply in self._pages(self._admin.ListAudit, _copy(request), until_s):
                    entries.extend(read_audit_entry(entry) for entry in reply.entries)
                    if len(entries) >= limit:
                        break
            return AuditLog(entries[:limit])

        return self._restarted(read)

    # ---- Keyframes

    def session(
        self,
        robot: str,
        camera: StereoCamera,
        *,
        name: str = "",
        uuid: Union[None, str, bytes, uuids.UUID] = None,
        oneway: bool = False,
        raw: Optional[RawStereo] = None,
        max_unsettled_bytes: int = 64 * 2**20,
        patience: float = 60.0,
    ) -> IngestSession:
        """A session of a robot, into which keyframes are streamed; a context manager, which flushes and ends it.

        Args:
            robot: the robot's name.
            camera: its rectified camera.
            name: of the session, for display; empty: the robot's name and the time.
            uuid: of the session; None: a new one. That of a session that the map has: continues it.
            oneway: its edges may be travelled only in the direction driven.
            raw: the rig before rectification, by which pictures in questions are rectified.
            max_unsettled_bytes: add() waits while more is not durable yet.
            patience: seconds for which a daemon that is gone is waited for.

        Raises:
            ValueError: a name, or the uuid.
        """
        return IngestSession(
            self._connection, robot, camera, name, uuid, oneway, raw, max_unsettled_bytes, patience
        )

    def acknowledgement(
        self, uuid: Union[str, bytes, uuids.UUID], *, timeout: Optional[float] = None
    ) -> SessionStatus:
        """What the daemon knows of a session that is, or was, received. RequestError: NO_SUCH_SESSION."""
        request = ingest_pb2.GetAcknowledgementRequest(session_uuid=as_uuid(uuid).bytes)
        return read_session_status(self._ask(self._ingest.GetAcknowledgement, request, timeout))

    # ---- What the methods share

    def _forget(self, caller: Caller) -> None:
        if caller is not self._caller:
            self._own.discard(caller)
            caller.close()

    def _ask(self, method: Any, request: Any, timeout: Optional[float]) -> Any:
        return self._caller.ask(method, request, timeout)

    def _edit(self, method: Any, request: Any, timeout: Optional[float]) -> Any:
        request.idempotency_key = uuids.uuid4().hex  # so that it may be sent again
        return self._retry(method, request, timeout)

    def _retry(self, method: Any, request: Any, timeout: Optional[float]) -> Any:
        pause = _FIRST_PAUSE_S
        while True:
            try:
                return self._ask(method, request, timeout)
            except Unreachable:
                if pause > 1:
                    raise
            time.sleep(pause)
            pause *= 4

    def _work(self, method: Any, request: Any, on_progress: Optional[OnProgress], timeout: Optional[float]) -> Any:
        last = admin_pb2.Progress()
        for reply in self._caller.stream(method, request, timeout):
            if on_progress is not None and reply.WhichOneof("outcome") is None:
                on_progress(read_progress(reply))
            last = reply
        return last

    def _pages(self, method: Any, request: Any, until: float) -> Iterator[Any]:
        while True:
            reply = self._ask(method, request, max(until - time.monotonic(), 0.001))
            yield reply
            if not reply.next_page_token:
                return
            request.page_token = reply.next_page_token

    def _until(self, timeout: Optional[float]) -> float:
        return time.monotonic() + (self._connection.timeout if timeout is None else timeout)

    def _list(
        self,
        method: Any,
        request: Callable[[], Any],
        items: Callable[[Any], Any],
        read: Callable[[Any], T],
        timeout: Optional[float],
    ) -> List[T]:
        """All pages of a list; if its version of the map expires, once more from the beginning."""
        until = self._until(timeout)

        def whole() -> List[T]:
            found: List[T] = []
            for reply in self._pages(method, request(), until):
                found.extend(read(item) for item in items(reply))
            return found

        return self._restarted(whole)

    def _replies(self, method: Any, request: Any, timeout: Optional[float]) -> List[Any]:
        """All replies of a stream; if its version of the map expires, once more from the beginning."""
        until = self._until(timeout)

        def whole() -> List[Any]:
            return [reply for reply in self._caller.resumed(method, _copy(request), until - time.monotonic())]

        return self._restarted(whole)

    def _restarted(self, attempt: Callable[[], T]) -> T:
        for _ in range(_MAX_RESTARTS):
            try:
                return attempt()
            except ViewExpired as error:
                last = error
        raise last

    def _iterate(
        self,
        method: Any,
        request: Callable[[], Any],
        items: Callable[[Any], Any],
        read: Callable[[Any], T],
        timeout: Optional[float],
    ) -> Iterator[T]:
        """The items of a list, page by page."""
        until = self._until(timeout)

        def replies() -> Iterator[Any]:
            return self._pages(method, request(), until)

        for item in self._given(replies, items, read, "items", "list"):
            yield item

    def _given(
        self,
        replies: Callable[[], Iterator[Any]],
        items: Callable[[Any], Any],
        read: Callable[[Any], T],
        what: str,
        whole: str,
    ) -> Iterator[T]:
        """The items of replies; begins again only while nothing was given out."""
        given = 0
        for attempt in range(_MAX_RESTARTS):
            try:
                for reply in replies():
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

    def _skeleton_of_edges(
        self, sessions: Sequence[int], candidates: bool, timeout: Optional[float]
    ) -> Skeleton:
        edges = self.edges(states=() if candidates else (EdgeState.ACCEPTED,), timeout=timeout)
        wanted = set(sessions)
        return skeleton_of_edges(
            edge for edge in edges if not wanted or {edge.a.session, edge.b.session} <= wanted
        )


__all__ = ["Client", "IngestSession", "connect"]
