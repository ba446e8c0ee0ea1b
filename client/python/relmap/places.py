"""Where a view was taken, and which places it could show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence

import numpy as np

from relmap.errors import reads_reply
from relmap.geometry import Array, PoseKind, frozen, read_covariance, read_transform
from relmap.graph import Verification
from relmap.ids import FrameId, read_frame_id
from relmap.reason import Reason
from relmap.record import Record
from relmap.tables import Table
from relmap.v1 import evidence_pb2, map_pb2


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Correspondences(Record):
    """Points that a view and a frame of the map both show, one element each in every array.

    Attributes:
        view: float32 (n, 2), pixels u, v in the view's left picture as it was sent.
        frame: float32 (n, 2), pixels in the frame's rectified left camera.
        inlier: bool (n,), it agrees with the transform that was found.
        residual: float32 (n,), pixels in the view between where it was measured and where the transform puts the point of the
            map; NaN: without metres, or without a transform.
        seen_in: of each, the frame beside it that has measured the landmark; None: the frame itself.
    """

    view: Array
    frame: Array
    inlier: Array
    residual: Array
    seen_in: tuple[Optional[FrameId], ...]

    def __len__(self) -> int:
        return len(self.inlier)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Localisation(Record):
    """The pose of a view, relative to a frame of the map. There are no global coordinates.

    Attributes:
        frame: the frame in which it is.
        T_frame_view: 4 x 4, pose of the view's rectified left camera in that frame, metres.
        cov: 6 x 6, covariance of T_frame_view exp(xi).
        inliers: features that agree.
        verification: STEREO or PNP.
        probability: of the place, by appearance, 0..1.
        spread: share of the picture that the inliers span, 0..1.
        new_place: probability, by appearance, that the map does not hold the place.
        candidates: number of places on which geometry was tried.
        near_prior: found around the prior; probability and new_place are not set.
        estimated_focal_length: pixels of the picture, if its camera was not known, else None.
        correspondences: if they were asked for, else None.
        map_version: the version of the map that was asked.
    """

    frame: FrameId
    T_frame_view: Array
    cov: Array
    inliers: int
    verification: Verification
    probability: float
    spread: float
    new_place: float
    candidates: int
    near_prior: bool
    estimated_focal_length: Optional[float]
    correspondences: Optional[Correspondences]
    map_version: int

    @property
    def T(self) -> Array:
        """The same as T_frame_view (4 x 4)."""
        return self.T_frame_view

    @property
    def kind(self) -> PoseKind:
        """What the pose is: relative to `frame`."""
        return PoseKind.RELATIVE


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PlaceMatch(Record):
    """A place that a view could show.

    Attributes:
        frame: its most probable frame, or one beside it that geometry confirmed.
        probability: by appearance, 0..1.
        verification: NONE: `reason` and `message` say why.
        inliers, spread: of the verification.
        T_frame_view: 4 x 4, relative pose of the view, if it is verified in metres, else None.
        cov: 6 x 6, covariance of T_frame_view exp(xi), or None.
        estimated_focal_length: as in Localisation.
        reason, message: OK, or why geometry has not confirmed the place.
        thumbnail: a small JPEG, if it was asked for, else empty.
        correspondences: if they were asked for, else None.
    """

    frame: FrameId
    probability: float
    verification: Verification
    inliers: int
    spread: float
    T_frame_view: Optional[Array]
    cov: Optional[Array]
    estimated_focal_length: Optional[float]
    reason: Reason
    message: str
    thumbnail: bytes
    correspondences: Optional[Correspondences]


def _match_row(match: PlaceMatch) -> Mapping[str, Any]:
    return {
        "frame": str(match.frame),
        "probability": match.probability,
        "verification": match.verification.name.lower(),
        "inliers": match.inliers,
        "spread": match.spread,
        "reason": match.reason.name,
        "message": match.message,
    }


class PlaceMatches(Table[PlaceMatch]):
    """Places that a view could show: verified ones by number of inliers, then the others by probability.

    Attributes:
        new_place: probability, by appearance, that the map does not hold the place.
        reason, message: OK, or why no place is verified.
    """

    new_place: float
    reason: Reason
    message: str
    row = staticmethod(_match_row)

    @classmethod
    def columns(cls) -> Sequence[str]:
        """The names of the columns of to_pandas()."""
        return "frame probability verification inliers spread reason message".split()


def read_correspondences(messages: Sequence[evidence_pb2.Correspondence]) -> Correspondences:
    """The correspondences of messages."""
    n = len(messages)
    residual = [m.residual if m.HasField("residual") else np.nan for m in messages]
    return Correspondences(
        frozen(np.array([(m.u, m.v) for m in messages], np.float32).reshape(n, 2)),
        frozen(np.array([(m.frame_u, m.frame_v) for m in messages], np.float32).reshape(n, 2)),
        frozen(np.array([m.inlier for m in messages], bool)),
        frozen(np.array(residual, np.float32)),
        tuple(read_frame_id(m.seen_in) if m.HasField("seen_in") else None for m in messages),
    )


@reads_reply
def read_localisation(message: map_pb2.LocaliseReply, correspondences: bool = False) -> Localisation:
    """The localisation of a message."""
    return Localisation(
        frame=read_frame_id(message.frame),
        T_frame_view=read_transform(message.frame_from_view),
        cov=read_covariance(message.covariance),
        inliers=message.inliers,
        verification=Verification(message.verification),
        probability=message.probability,
        spread=message.spread,
        new_place=message.new_place,
        candidates=message.candidates,
        near_prior=message.near_prior,
        estimated_focal_length=message.estimated_focal_length or None,
        correspondences=read_correspondences(message.correspondences) if correspondences else None,
        map_version=message.map_version,
    )


def _read_match(message: map_pb2.PlaceMatch, correspondences: bool) -> PlaceMatch:
    metric = message.HasField("frame_from_view")
    return PlaceMatch(
        frame=read_frame_id(message.frame),
        probability=message.probability,
        verification=Verification(message.verification),
        inliers=message.inliers,
        spread=message.spread,
        T_frame_view=read_transform(message.frame_from_view) if metric else None,
        cov=read_covariance(message.covariance) if metric else None,
        estimated_focal_length=message.estimated_focal_length or None,
        reason=Reason(message.reason),
        message=message.message,
        thumbnail=message.thumbnail,
        correspondences=read_correspondences(message.correspondences) if correspondences else None,
    )


@reads_reply
def read_matches(message: map_pb2.MatchImageReply, correspondences: bool = False) -> PlaceMatches:
    """The matches of a message."""
    matches = PlaceMatches(_read_match(place, correspondences) for place in message.places)
    matches.new_place = message.new_place
    matches.reason = Reason(message.reason)
    matches.message = message.message
    return matches
