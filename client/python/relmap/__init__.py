"""The Python client of relmap, a map server for fleets of stereo robots.

    import relmap

    with relmap.connect("/var/lib/relmap/map") as client:      # or "host:port"
        place = client.localise("left.png", "right.png", camera=1)
        print(place.frame, place.T)                            # pose relative to a frame; 4 x 4, metres

relmap.aio has the same client for asyncio. docs/python.md leads through it.
"""

from relmap.camera import RawCamera, RawStereo, StereoCamera
from relmap.client import Client, IngestSession, connect
from relmap.drawing.picture import Drawing
from relmap.errors import (
    AccessError,
    CameraError,
    ClientClosed,
    ClosureStateError,
    DaemonError,
    DeadlineExceeded,
    PlaceNotRecognised,
    RelmapError,
    RequestError,
    RobotDataError,
    Unreachable,
    ViewExpired,
)
from relmap.events import MapEvent
from relmap.evidence import ClosureMatrix, EdgeEdit, Explanation
from relmap.exports import ExportedFrame, ExportFormat, TrajectoryFile
from relmap.geometry import PoseKind
from relmap.graph import (
    Edge,
    EdgeKind,
    Edges,
    EdgeState,
    Frame,
    Labels,
    MotionSource,
    Session,
    Sessions,
    SessionState,
    Verification,
)
from relmap.ids import EdgeId, FrameId, LandmarkId
from relmap.ingest_core import KeyframeLocalisation, KeyframesRefused
from relmap.keyframe import Keyframe, SessionHeader, decode_keyframe, encode_keyframe, read_keyframes
from relmap.measurements import Features, Tracks
from relmap.operations import AuditLog
from relmap.places import Localisation, PlaceMatch, PlaceMatches
from relmap.reason import Reason, ReasonGroup
from relmap.requests import EdgeAction, EdgeOrder, ImportedLoop
from relmap.routes import (
    Label,
    Neighbourhood,
    Robot,
    Route,
    RouteBy,
    RouteFilter,
    RouteWeights,
    Trajectory,
    TransformBetween,
)
from relmap.skeleton import Skeleton
from relmap.status import DaemonStatus, Robots
from relmap.version import __version__
from relmap.views import View

__all__ = [
    "__version__",
    "AccessError",
    "AuditLog",
    "CameraError",
    "Client",
    "ClientClosed",
    "ClosureMatrix",
    "ClosureStateError",
    "connect",
    "DaemonError",
    "DaemonStatus",
    "DeadlineExceeded",
    "decode_keyframe",
    "Drawing",
    "Edge",
    "EdgeAction",
    "EdgeEdit",
    "EdgeId",
    "EdgeKind",
    "EdgeOrder",
    "Edges",
    "EdgeState",
    "encode_keyframe",
    "Explanation",
    "ExportedFrame",
    "ExportFormat",
    "Features",
    "Frame",
    "FrameId",
    "ImportedLoop",
    "IngestSession",
    "Keyframe",
    "KeyframeLocalisation",
    "KeyframesRefused",
    "Label",
    "Labels",
    "LandmarkId",
    "Localisation",
    "MapEvent",
    "MotionSource",
    "Neighbourhood",
    "PlaceMatch",
    "PlaceMatches",
    "PlaceNotRecognised",
    "PoseKind",
    "RawCamera",
    "RawStereo",
    "read_keyframes",
    "Reason",
    "ReasonGroup",
    "RelmapError",
    "RequestError",
    "Robot",
    "RobotDataError",
    "Robots",
    "Route",
    "RouteBy",
    "RouteFilter",
    "RouteWeights",
    "Session",
    "SessionHeader",
    "Sessions",
    "SessionState",
    "Skeleton",
    "StereoCamera",
    "Tracks",
    "Trajectory",
    "TrajectoryFile",
    "TransformBetween",
    "Unreachable",
    "Verification",
    "View",
    "ViewExpired",
]
