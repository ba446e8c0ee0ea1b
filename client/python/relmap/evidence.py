"""Why a loop closure is believed, and how many there are between sessions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, Union

import numpy as np

from relmap.choices import choice
from relmap.errors import reads_reply
from relmap.geometry import Array, frozen, read_covariance, read_transform
from relmap.graph import (
    CarriedStretch,
    Edge,
    EdgeState,
    FramePicture,
    read_carried,
    read_edge,
    read_picture,
)
from relmap.ids import EdgeId, FrameId, read_edge_id, read_frame_id
from relmap.places import Correspondences, read_correspondences
from relmap.reason import Reason
from relmap.record import Record
from relmap.tables import Table
from relmap.v1 import evidence_pb2, map_pb2

if TYPE_CHECKING:
    from relmap.drawing.picture import Drawing


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MotionVerdict(Record):
    """What the way between the ends without this closure says of it.

    Attributes:
        verdict: OK: it agrees. CONTRADICTS_MOTION, CARRIED: it does not. NOT_CONNECTED, OUT_OF_REACH: it says
            nothing. NOT_STEREO: the closure measured no metres.
        message: in words.
        edges, distance_m: of the way.
        T_ab: 4 x 4, relative pose by the way, metres.
        cov: 6 x 6, covariance of T_ab exp(xi).
        metres_apart, radians_apart: between what the closure says and what the way says.
        sigmas_apart: Mahalanobis distance of the two.
    """

    verdict: Reason
    message: str
    edges: int
    distance_m: float
    T_ab: Array
    cov: Array
    metres_apart: float
    radians_apart: float
    sigmas_apart: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """Another closure that agrees with the one in question, or contradicts it.

    Attributes:
        edge, a, b, state: of the other closure.
        agrees: False: it contradicts.
    """

    edge: EdgeId
    a: FrameId
    b: FrameId
    state: EdgeState
    agrees: bool


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Explanation(Record):
    """What a loop closure is believed for.

    Attributes:
        edge: with its history and suspicion.
        picture_a, picture_b: of its older and newer end, if they were asked for, else None.
        correspondences: what both pictures show, found anew; the view is b, the frame is a.
        correspondences_reason, correspondences_message: OK, or why there are none.
        motion: what the way without the closure says now; the doubts in `edge.suspicion` say what the robot's motion said when
            the daemon judged the closure.
        agreements: other closures, at most 256.
        runner_up: picture of the best of the other places, if there is one and pictures were asked for.
        map_version: the version of the map that was asked.
    """

    edge: Edge
    picture_a: Optional[FramePicture]
    picture_b: Optional[FramePicture]
    correspondences: Correspondences
    correspondences_reason: Reason
    correspondences_message: str
    motion: Optional[MotionVerdict]
    agreements: tuple[Agreement, ...]
    runner_up: Optional[FramePicture]
    map_version: int

    def draw_pair(self, width: int = 900) -> "Drawing":
        """Both pictures side by side with lines between what they both show, `width` points wide; an SVG. ValueError: the
        pictures were not asked for."""
        from relmap.drawing.pair import draw_pair

        return draw_pair(self, width)

    def _repr_html_(self) -> str:
        from relmap.drawing.html import explanation_html

        return explanation_html(self)


@dataclass(frozen=True, slots=True)
class ClosureCount:
    """The loop closures between two sessions, or within one.

    Attributes:
        session_a, session_b: session_a <= session_b.
        candidate, accepted, quarantined, removed: numbers by state.
        most_suspicious: of those in force; None: none is.
        suspicion: of it.
    """

    session_a: int
    session_b: int
    candidate: int
    accepted: int
    quarantined: int
    removed: int
    most_suspicious: Optional[EdgeId]
    suspicion: float


def _count_row(count: ClosureCount) -> Mapping[str, Any]:
    names = ("session_a", "session_b", "candidate", "accepted", "quarantined", "removed", "suspicion")
    row = {name: getattr(count, name) for name in names}
    row["most_suspicious"] = str(count.most_suspicious) if count.most_suspicious else ""
    return row


class ClosureMatrix(Table[ClosureCount]):
    """Numbers of closures by pairs of sessions, ascending; pairs without closures are left out."""

    row = staticmethod(_count_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return "session_a session_b candidate accepted quarantined removed suspicion most_suspicious".split()

    def counts(self, state: Union[EdgeState, str] = EdgeState.ACCEPTED) -> tuple[tuple[int, ...], Array]:
        """The n sessions that have closures, and the symmetric matrix (n, n) of the numbers of those in this state."""
        name = choice("state", EdgeState, state).name.lower()
        sessions = sorted({s for count in self for s in (count.session_a, count.session_b)})
        place = {session: i for i, session in enumerate(sessions)}
        matrix = np.zeros((len(sessions), len(sessions)), np.int64)
        for count in self:
            a, b = place[count.session_a], place[count.session_b]
            matrix[a, b] = matrix[b, a] = getattr(count, name)
        return tuple(sessions), frozen(matrix)


@dataclass(frozen=True, slots=True)
class ClosureChange:
    """What an edit changes of one closure.

    Attributes:
        id, a, b: the closure and its ends, older and newer.
        before, after: its states; None: it did not, or does not, exist.
        reason_before, reason_after: why it is in them.
        edge_before, edge_after: whether it is an edge of the graph.
        bound, bound_frames: observations and landmarks that it justifies while in force, and frames that have them.
    """

    id: EdgeId
    a: FrameId
    b: FrameId
    before: Optional[EdgeState]
    after: Optional[EdgeState]
    reason_before: Reason
    reason_after: Reason
    edge_before: bool
    edge_after: bool
    bound: int
    bound_frames: int


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EdgeEdit(Record):
    """The result of an edit of a closure or of a proposal; of a dry run, the result that it would have.

    Attributes:
        edge: afterwards.
        changes: all closures that change.
        carried, not_carried: stretches along which the robot counts as carried from now on, or no longer.
        done: it was not a dry run.
        shown: of a dry run of a removal: pass it on as `shown`, and the removal is refused if it would remove others by then.
        journal_sequence: of the record; 0: a dry run.
        map_version: afterwards.
    """

    edge: Edge
    changes: tuple[ClosureChange, ...]
    carried: tuple[CarriedStretch, ...]
    not_carried: tuple[CarriedStretch, ...]
    done: bool
    shown: int
    journal_sequence: int
    map_version: int

    def _repr_html_(self) -> str:
        from relmap.drawing.html import edit_html

        return edit_html(self)


@reads_reply
def read_explanation(message: evidence_pb2.ExplainEdgeReply, pictures: bool) -> Explanation:
    """The explanation of a message; `pictures` says whether they were asked for."""
    motion = message.motion
    return Explanation(
        edge=read_edge(message.edge),
        picture_a=read_picture(message.picture_a) if pictures else None,
        picture_b=read_picture(message.picture_b) if pictures else None,
        correspondences=read_correspondences(message.correspondences),
        correspondences_reason=Reason(message.correspondences_reason),
        correspondences_message=message.correspondences_message,
        motion=MotionVerdict(
            Reason(motion.verdict),
            motion.message,
            motion.edges,
            motion.distance_m,
            read_transform(motion.a_from_b),
            read_covariance(motion.covariance),
            motion.metres_apart,
            motion.radians_apart,
            motion.sigmas_apart,
        )
        if message.HasField("motion")
        else None,
        agreements=tuple(
            Agreement(read_edge_id(a.edge), read_frame_id(a.a), read_frame_id(a.b), EdgeState(a.state), a.agrees)
            for a in message.agreements
        ),
        runner_up=read_picture(message.runner_up) if pictures and message.HasField("runner_up") else None,
        map_version=message.map_version,
    )


@reads_reply
def read_count(message: evidence_pb2.ClosureMatrixCell) -> ClosureCount:
    """The cell of a message."""
    return ClosureCount(
        message.session_a,
        message.session_b,
        message.candidate,
        message.accepted,
        message.quarantined,
        message.removed,
        read_edge_id(message.most_suspicious) if message.HasField("most_suspicious") else None,
        message.suspicion,
    )


def _read_change(message: map_pb2.ClosureChange) -> ClosureChange:
    return ClosureChange(
        read_edge_id(message.id),
        read_frame_id(message.a),
        read_frame_id(message.b),
        EdgeState(message.before) if message.before else None,
        EdgeState(message.after) if message.after else None,
        Reason(message.reason_before),
        Reason(message.reason_after),
        message.edge_before,
        message.edge_after,
        message.bound,
        message.bound_frames,
    )


@reads_reply
def read_edit(message: Any) -> EdgeEdit:
    """The result of a SetEdgeStateReply or ProposeEdgeReply."""
    return EdgeEdit(
        edge=read_edge(message.edge),
        changes=tuple(_read_change(change) for change in message.effect.closures),
        carried=tuple(read_carried(stretch) for stretch in message.effect.carried),
        not_carried=tuple(read_carried(stretch) for stretch in message.effect.not_carried),
        done=message.journal_sequence != 0,
        shown=getattr(message, "shown", 0),
        journal_sequence=message.journal_sequence,
        map_version=message.map_version,
    )
