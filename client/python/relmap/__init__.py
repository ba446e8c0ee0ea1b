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
from relmap.exports import ExportFormat
from relmap.geometry import PoseKind
from relmap.graph import EdgeKind, EdgeState, MotionSource, SessionState, Verification
from relmap.ids import EdgeId, FrameId, LandmarkId
from relmap.ingest_core import KeyframesRefused
from relmap.keyframe import Keyframe, SessionHeader, decode_keyframe, encode_keyframe, read_keyframes
from relmap.measurements import Features, Tracks
from relmap.reason import Reason, ReasonGroup
from relmap.requests import EdgeAction, EdgeOrder, ImportedLoop
from relmap.routes import Label, Robot, RouteBy, RouteFilter, RouteWeights
from relmap.version import __version__
from relmap.views import View

__all__ = [
    "AccessError",
    "CameraError",
    "Client",
    "ClientClosed",
    "ClosureStateError",
    "DaemonError",
    "DeadlineExceeded",
    "Drawing",
    "EdgeAction",
    "EdgeId",
    "EdgeKind",
    "EdgeOrder",
    "EdgeState",
    "ExportFormat",
    "Features",
    "FrameId",
    "ImportedLoop",
    "IngestSession",
    "Keyframe",
    "KeyframesRefused",
    "Label",
    "LandmarkId",
    "MotionSource",
    "PlaceNotRecognised",
    "PoseKind",
    "RawCamera",
    "RawStereo",
    "Reason",
    "ReasonGroup",
    "RelmapError",
    "RequestError",
    "Robot",
    "RobotDataError",
    "RouteBy",
    "RouteFilter",
    "RouteWeights",
    "SessionHeader",
    "SessionState",
    "StereoCamera",
    "Tracks",
    "Unreachable",
    "Verification",
    "View",
    "ViewExpired",
    "__version__",
    "connect",
    "decode_keyframe",
    "encode_keyframe",
    "read_keyframes",
]
