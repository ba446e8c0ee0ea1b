"""What the map holds: sessions, frames, edges and labels."""

from __future__ import annotations

import datetime
import uuid as uuids
from dataclasses import dataclass
from typing import Any, Iterable, Mapping, Optional, Sequence, Union

import numpy as np

from relmap.camera import RawStereo, StereoCamera, read_camera, read_raw
from relmap.enums import OpenEnum
from relmap.errors import RequestError, reads_reply
from relmap.geometry import Array, frozen, read_covariance, read_transform
from relmap.ids import EdgeId, FrameId, LandmarkId, read_edge_id, read_frame_id
from relmap.measurements import Features, read_feature_set
from relmap.reason import Reason
from relmap.record import Record
from relmap.tables import Table
from relmap.times import as_datetime
from relmap.v1 import graph_pb2

class EdgeKind(OpenEnum):
    """What an edge is: of the robot's own motion, a loop closure, or a bridge over motion that was not measured."""

    UNSPECIFIED = 0
    ODOMETRY = 1
    LOOP = 2
    PRIOR = 3


class EdgeState(OpenEnum):
    """The state of a loop closure. Only ACCEPTED ones are in force."""

    UNSPECIFIED = 0
    CANDIDATE = 1
    ACCEPTED = 2
    QUARANTINED = 3
    REMOVED = 4


class MotionSource(OpenEnum):
    """Where the motion since the previous keyframe comes from."""

    START = 0
    """The first keyframe of a session, or one that no motion joins to the one before."""
    VISION = 1
    ONE_EYE = 2
    """Vision with one eye: the scale is not measured by it."""
    GYRO = 3
    """Rotation from a gyro, translation extrapolated."""
    CONSTANT_VELOCITY = 4
    UNSENSED = 5
    """The robot may have been carried."""


class Verification(OpenEnum):
    """How geometry confirmed a place. EPIPOLAR and HOMOGRAPHY have no metres."""

    NONE = 0
    STEREO = 1
    PNP = 2
    EPIPOLAR = 3
    IMPORTED = 4
    HOMOGRAPHY = 5
    COMPOUNDED = 6


class DoubtKind(OpenEnum):
    """What speaks against a loop closure."""

    UNSPECIFIED = 0
    FEW_INLIERS = 1
    POOR_SPREAD = 2
    IMPROBABLE = 3
    RUNNER_UP = 4
    CHANGED = 5
    CONTRADICTION = 6
    LONELY = 7
    TENSION = 8
    UNSEEN = 9


class SessionState(OpenEnum):
    """The state of a session. A FROZEN one takes no keyframes and does not change; a DELETING one goes frame by frame."""

    OPEN = 0
    ENDED = 1
    FROZEN = 2
    DELETING = 3


@dataclass(frozen=True, slots=True)
class EdgeEvent:
    """A change of a loop closure's state.

    Attributes:
        journal_sequence: orders the events of a map.
        state, reason: after it.
        cause: the closure whose proposal or edit caused it; None: not known.
        note: the operator's.
        time_us: when, microseconds UTC; 0: not known.
        author: who, by his credentials, or "relmapd"; empty: not known.
    """

    journal_sequence: int
    state: EdgeState
    reason: Reason
    cause: Optional[EdgeId]
    note: str
    time_us: int
    author: str


@dataclass(frozen=True, slots=True)
class Uniqueness:
    """How much the place that a closure recognised stands out from all other places.

    Attributes:
        runner_up: the best fitting of the other places that geometry confirms; None: there is none.
        runner_up_inliers: its inliers.
        runner_up_probability: by appearance, 0..1.
        alike: number of other places that geometry confirms.
        differs: of what both views should show, the share in which they differ, 0..1; None: not measured.
        compared, changed: cells of the picture in which landmarks should be found, and those in which none was.
    """

    runner_up: Optional[FrameId]
    runner_up_inliers: int
    runner_up_probability: float
    alike: int
    differs: Optional[float]
    compared: int
    changed: int


@dataclass(frozen=True, slots=True)
class Doubt:
    """One thing that speaks against a loop closure.

    Attributes:
        kind: what.
        weight: its part of the suspicion, 0..1.
        message: in words, with the numbers.
    """

    kind: DoubtKind
    weight: float
    message: str


@dataclass(frozen=True, slots=True)
class Suspicion:
    """How doubtful a loop closure is, for ordering those that a person looks at; it decides nothing.

    Attributes:
        value: 0: nothing speaks against it; 1: it is wrong as far as the map can tell.
        doubts: the heaviest first.
        remark: what else to know, in words: what the map does not know of it, or that an operator put it into force
            and has neither withdrawn that nor removed it.
    """

    value: float
    doubts: tuple[Doubt, ...]
    remark: str


@dataclass(frozen=True, slots=True)
class CarriedStretch:
    """Consecutive frames of a session along which its robot was carried, by a lift or a train.

    Attributes:
        first, last: the older end, the newer end.
        closures: the closures that show it, at most 16.
    """

    first: FrameId
    last: FrameId
    closures: tuple[EdgeId, ...]


@dataclass(frozen=True, slots=True)
class UnmeasuredStretch:
    """Consecutive frames of a session between which nothing measured how its robot moved.

    Attributes:
        first, last: the older end, the newer end.
        steps: number of odometry edges.
        distance_m: a guess of its length.
    """

    first: FrameId
    last: FrameId
    steps: int
    distance_m: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Measurement(Record):
    """A relative pose as the robot itself or a closure's verification measured it, before anything was refined.

    Attributes:
        T_ab: 4 x 4, relative pose of b in a, metres.
        cov: 6 x 6, covariance of T_ab exp(xi).
    """

    T_ab: Array
    cov: Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Edge(Record):
    """An edge of the map: a step of a robot's motion, or a loop closure.

    Attributes:
        id: its identity, "3:120/1".
        a, b: the older and the newer end.
        kind, state, reason: what it is, its state, and why it is in it.
        carries: it is an edge of the graph while accepted; False: a closure that only binds landmarks.
        T_ab: 4 x 4, relative pose of b in a, metres.
        cov: 6 x 6, covariance of T_ab exp(xi).
        support: number of observations whose path uses it.
        prior_active: it has too little support, and so keeps the prior of its measurement.
        source: of the robot's motion.
        unmeasured: nothing measured T_ab; it is a guess with this covariance.
        driven_s, standing_s: time that the robot drove and stood along it.
        verification, inliers, probability, spread: the evidence of a closure.
        bound: number of observations and landmarks that it justifies.
        consistent_with: closures that agree with it.
        history: changes of its state, oldest first.
        uniqueness: of a closure, if it is known.
        carried_by: of motion: closures which show that the robot was carried along it.
        carried: of a closure which shows that.
        suspicion: of a closure: what speaks against it.
        time_us: when its newer end was taken, microseconds UTC; 0: the daemon does not tell.
        measured: what T_ab was before anything was refined; None: the daemon does not tell.
    """

    id: EdgeId
    a: FrameId
    b: FrameId
    kind: EdgeKind
    state: EdgeState
    reason: Reason
    carries: bool
    T_ab: Array
    cov: Array
    support: int
    prior_active: bool
    source: MotionSource
    unmeasured: bool
    driven_s: float
    standing_s: float
    verification: Verification
    inliers: int
    probability: float
    spread: float
    bound: int
    consistent_with: tuple[EdgeId, ...]
    history: tuple[EdgeEvent, ...]
    uniqueness: Optional[Uniqueness]
    carried_by: tuple[EdgeId, ...]
    carried: Optional[CarriedStretch]
    suspicion: Optional[Suspicion]
    time_us: int
    measured: Optional[Measurement] = None

    @property
    def T(self) -> Array:
        """The same as T_ab (4 x 4)."""
        return self.T_ab

    @property
    def in_force(self) -> bool:
        """Whether it is accepted."""
        return self.state == EdgeState.ACCEPTED


def _edge_row(edge: Edge) -> Mapping[str, Any]:
    return {
        "id": str(edge.id),
        "a": str(edge.a),
        "b": str(edge.b),
        "kind": edge.kind.name.lower(),
        "state": edge.state.name.lower(),
        "reason": edge.reason.name,
        "carries": edge.carries,
        "metres": float(np.linalg.norm(edge.T_ab[:3, 3])),
        "support": edge.support,
        "verification": edge.verification.name.lower(),
        "inliers": edge.inliers,
        "probability": edge.probability,
        "spread": edge.spread,
        "suspicion": edge.suspicion.value if edge.suspicion else float("nan"),
        "time_us": edge.time_us,
    }


class Edges(Table[Edge]):
    """A list of edges, of one version of the map."""

    row = staticmethod(_edge_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return (
            "id a b kind state reason carries metres support verification inliers probability spread suspicion time_us"
        ).split()


@dataclass(frozen=True, slots=True)
class Session:
    """A drive of one robot, with one camera.

    Attributes:
        number: its number in the map, from 1.
        uuid: as the robot knows it, 32 hexadecimal digits with hyphens.
        robot, name: for display; the name is unique in the map.
        state: open, ended, frozen, or being deleted.
        camera: rectified.
        raw: before rectification; None: the pictures came rectified, or it is not known.
        oneway: its edges may be travelled only in the direction driven.
        first, last: lowest and highest index of its frames.
        frames: number of its frames.
        first_time_us, last_time_us: microseconds UTC.
        refused, given_up: numbers of sequences.
        next_sequence: everything below is applied, refused or given up.
    """

    number: int
    uuid: str
    robot: str
    name: str
    state: SessionState
    camera: StereoCamera
    raw: Optional[RawStereo]
    oneway: bool
    first: int
    last: int
    frames: int
    first_time_us: int
    last_time_us: int
    refused: int
    given_up: int
    next_sequence: int

    @property
    def began(self) -> datetime.datetime:
        """The time of its first frame, UTC."""
        return as_datetime(self.first_time_us)


def _session_row(session: Session) -> Mapping[str, Any]:
    names = ("number", "name", "robot", "frames", "first", "last", "first_time_us", "last_time_us", "uuid")
    row = {name: getattr(session, name) for name in names}
    row["state"] = session.state.name.lower()
    return row


def _uuid_text(text: str) -> Optional[str]:
    try:
        return str(uuids.UUID(text))
    except ValueError:
        return None


class Sessions(Table[Session]):
    """All sessions of one version of the map, ascending by number."""

    row = staticmethod(_session_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return "number name robot frames first last first_time_us last_time_us uuid state".split()

    def named(self, name: str) -> Session:
        """The session of this name. KeyError: there is none."""
        for session in self:
            if session.name == name:
                return session
        raise KeyError(f"no session is named {name!r}; there are " + ", ".join(repr(s.name) for s in self[:20]))

    def number_of(self, session: Union[int, str]) -> int:
        """The number of the session of this number, name, "ROBOT/NAME" or uuid; a number is not looked up.

        A session that is being deleted counts only if no other is called so. RequestError: NO_SUCH_SESSION: none is;
        INVALID_ARGUMENT: several are."""
        if isinstance(session, int):
            return session
        uuid = _uuid_text(session)
        called = [s for s in self if session in (s.name, f"{s.robot}/{s.name}") or s.uuid == uuid]
        called = [s for s in called if s.state != SessionState.DELETING] or called
        if not called:
            raise RequestError(Reason.NO_SUCH_SESSION, f"no session is called {session!r}")
        if len(called) > 1:
            which = ", ".join(f"{s.number} (robot {s.robot})" for s in called)
            raise RequestError(
                Reason.INVALID_ARGUMENT,
                f"{len(called)} sessions are called {session!r}: {which}; name one by its number, uuid or as ROBOT/NAME",
            )
        return called[0].number


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FramePicture(Record):
    """The picture that the map keeps of a frame: of the rectified left camera, grey, possibly reduced.

    Attributes:
        data: a JPEG file; empty: there is none, and `reason` and `message` say why.
        width, height: its pixels.
        scale: pixels of the picture for each pixel of the session's camera, in whose pixels measurements are.
        reason, message: OK, or why there is no picture.
    """

    data: bytes
    width: int
    height: int
    scale: float
    reason: Reason
    message: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Landmarks(Record):
    """Landmarks that are based in a frame, one element each in every array.

    Attributes:
        slot: uint32 (n,).
        points: float64 (n, 3), metres, in the frame's coordinates.
        observers: uint32 (n,), number of frames that determine each.
    """

    slot: Array
    points: Array
    observers: Array

    def __len__(self) -> int:
        return len(self.slot)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Observations(Record):
    """What a frame sees of landmarks, one element each in every array.

    Attributes:
        landmark: of each, None if older landmarks around it make its own unnecessary.
        closure: of each, the closure that justifies it; None: tracking.
        u_left, v, u_right: float32 (n,), pixels; u_right is NaN if only the left eye sees it.
        level: uint8 (n,), pyramid level.
    """

    landmark: tuple[Optional[LandmarkId], ...]
    closure: tuple[Optional[EdgeId], ...]
    u_left: Array
    v: Array
    u_right: Array
    level: Array

    def __len__(self) -> int:
        return len(self.landmark)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Frame(Record):
    """A keyframe of the map.

    Attributes:
        id: its identity, "3:120".
        time_us: microseconds UTC.
        labels: its labels.
        edges: stored with it: the robot's own motion first, then closures.
        incoming: edges to it that are stored with newer frames.
        T_odom_frame: 4 x 4, pose in the robot's own odometry, as received: it drifts.
        mean_error: mean reprojection error in pixels; None: never relaxed.
        landmark_count, observation_count, appearance_count: what it holds.
        landmarks, observations, features: if they were asked for, else None.
        thumbnail: a small JPEG, if it was asked for and there is one, else empty.
        picture: the kept picture, if it was asked for, else None.
    """

    id: FrameId
    time_us: int
    labels: tuple[str, ...]
    edges: Edges
    incoming: tuple[EdgeId, ...]
    T_odom_frame: Array
    mean_error: Optional[float]
    landmark_count: int
    observation_count: int
    appearance_count: int
    landmarks: Optional[Landmarks]
    observations: Optional[Observations]
    features: Optional[Features]
    thumbnail: bytes
    picture: Optional[FramePicture]


@dataclass(frozen=True, slots=True)
class LabelledFrames:
    """A label, and the frames that have it."""

    label: str
    frames: tuple[FrameId, ...]


def _label_row(labelled: LabelledFrames) -> Mapping[str, Any]:
    return {"label": labelled.label, "frames": ", ".join(str(frame) for frame in labelled.frames)}


class Labels(Table[LabelledFrames]):
    """Labels, ascending, with their frames."""

    row = staticmethod(_label_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return ("label", "frames")


def _edge_ids(messages: Iterable[Any]) -> tuple[EdgeId, ...]:
    return tuple(read_edge_id(message) for message in messages)


def read_carried(message: graph_pb2.CarriedStretch) -> CarriedStretch:
    """The carried stretch of a message."""
    return CarriedStretch(read_frame_id(message.first), read_frame_id(message.last), _edge_ids(message.closures))


def _read_event(message: graph_pb2.EdgeEvent) -> EdgeEvent:
    return EdgeEvent(
        message.journal_sequence,
        EdgeState(message.state),
        Reason(message.reason),
        read_edge_id(message.cause) if message.HasField("cause") else None,
        message.note,
        message.time_us,
        message.author,
    )


def _read_uniqueness(message: graph_pb2.Uniqueness) -> Uniqueness:
    return Uniqueness(
        read_frame_id(message.runner_up) if message.HasField("runner_up") else None,
        message.runner_up_inliers,
        message.runner_up_probability,
        message.alike,
        message.differs if message.HasField("differs") else None,
        message.compared,
        message.changed,
    )


def _read_suspicion(message: graph_pb2.Suspicion) -> Suspicion:
    doubts = tuple(Doubt(DoubtKind(d.kind), d.weight, d.message) for d in message.doubts)
    return Suspicion(message.value, doubts, message.remark)


def _read_measurement(message: graph_pb2.Measurement) -> Measurement:
    return Measurement(read_transform(message.a_from_b), read_covariance(message.covariance))


@reads_reply
def read_edge(message: graph_pb2.Edge) -> Edge:
    """The edge of a message."""
    return Edge(
        id=read_edge_id(message.id),
        a=read_frame_id(message.a),
        b=read_frame_id(message.b),
        kind=EdgeKind(message.kind),
        state=EdgeState(message.state),
        reason=Reason(message.reason),
        carries=message.carries,
        T_ab=read_transform(message.a_from_b),
        cov=read_covariance(message.covariance),
        support=message.support,
        prior_active=message.prior_active,
        source=MotionSource(message.source),
        unmeasured=message.unmeasured,
        driven_s=message.driven_s,
        standing_s=message.standing_s,
        verification=Verification(message.verification),
        inliers=message.inliers,
        probability=message.probability,
        spread=message.spread,
        bound=message.bound,
        consistent_with=_edge_ids(message.consistent_with),
        history=tuple(_read_event(event) for event in message.history),
        uniqueness=_read_uniqueness(message.uniqueness) if message.HasField("uniqueness") else None,
        carried_by=_edge_ids(message.carried_by),
        carried=read_carried(message.carried) if message.HasField("carried") else None,
        suspicion=_read_suspicion(message.suspicion) if message.HasField("suspicion") else None,
        time_us=message.time_us,
        measured=_read_measurement(message.measured) if message.HasField("measured") else None,
    )


@reads_reply
def read_session(message: graph_pb2.Session) -> Session:
    """The session of a message."""
    return Session(
        number=message.number,
        uuid=message.uuid,
        robot=message.robot,
        name=message.name,
        state=SessionState(message.state),
        camera=read_camera(message.camera),
        raw=read_raw(message.raw) if message.HasField("raw") else None,
        oneway=message.oneway,
        first=message.first,
        last=message.last,
        frames=message.frames,
        first_time_us=message.first_time_us,
        last_time_us=message.last_time_us,
        refused=message.refused,
        given_up=message.given_up,
        next_sequence=message.next_sequence,
    )


def read_picture(message: graph_pb2.FramePicture) -> FramePicture:
    """The kept picture of a message."""
    return FramePicture(
        message.data, message.width, message.height, message.scale, Reason(message.reason), message.message
    )


def _read_landmarks(messages: Sequence[graph_pb2.Landmark]) -> Landmarks:
    points = np.array([(m.point.x, m.point.y, m.point.z) for m in messages], dtype=float).reshape(-1, 3)
    return Landmarks(
        frozen(np.array([m.id.slot for m in messages], np.uint32)),
        frozen(points),
        frozen(np.array([m.observers for m in messages], np.uint32)),
    )


def _read_observations(messages: Sequence[graph_pb2.Observation]) -> Observations:
    return Observations(
        tuple(
            LandmarkId(read_frame_id(m.landmark.base), m.landmark.slot) if m.HasField("landmark") else None
            for m in messages
        ),
        tuple(read_edge_id(m.closure) if m.HasField("closure") else None for m in messages),
        frozen(np.array([m.u_left for m in messages], np.float32)),
        frozen(np.array([m.v for m in messages], np.float32)),
        frozen(np.array([m.u_right if m.HasField("u_right") else np.nan for m in messages], np.float32)),
        frozen(np.array([m.level for m in messages], np.uint8)),
    )


@reads_reply
def read_frame(message: graph_pb2.Frame, landmarks: bool, observations: bool, appearance: bool, picture: bool) -> Frame:
    """The frame of a message; the flags say what was asked for."""
    return Frame(
        id=read_frame_id(message.id),
        time_us=message.time_us,
        labels=tuple(message.labels),
        edges=Edges(read_edge(edge) for edge in message.edges),
        incoming=_edge_ids(message.incoming),
        T_odom_frame=read_transform(message.odometry_from_frame),
        mean_error=message.mean_error if message.HasField("mean_error") else None,
        landmark_count=message.landmark_count,
        observation_count=message.observation_count,
        appearance_count=message.appearance_count,
        landmarks=_read_landmarks(message.landmarks) if landmarks else None,
        observations=_read_observations(message.observations) if observations else None,
        features=read_feature_set(message.appearance) if appearance else None,
        thumbnail=message.thumbnail,
        picture=read_picture(message.picture) if picture else None,
    )
