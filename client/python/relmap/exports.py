"""What Client.export_trajectories() and export_frames() give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmap.enums import NumberedEnum
from relmap.errors import reads_reply
from relmap.geometry import Array, frozen
from relmap.graph import Edges
from relmap.ids import FrameId, read_frame_id
from relmap.record import Record
from relmap.v1 import map_pb2


class ExportFormat(NumberedEnum):
    """The format of a trajectory's file."""

    TUM = 1
    """Lines "time tx ty tz qx qy qz qw", time in seconds; lines with # name session and frame."""
    KITTI = 2
    """Lines with the upper three rows of the pose matrix, row by row."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TrajectoryFile(Record):
    """The trajectory of one session, as a file.

    Attributes:
        session: its number.
        data: the bytes of the file.
        doubtful: its edges that nothing measured, or along which the robot was carried.
    """

    session: int
    data: bytes
    doubtful: Edges


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ExportedFrame(Record):
    """A frame, with the landmarks that are based in it if they were asked for.

    Attributes:
        id: its identity.
        time_us: microseconds UTC.
        landmarks: float32 (n, 3), metres, in the frame's coordinates.
        observers: uint32 (n,), number of frames that determine each.
    """

    id: FrameId
    time_us: int
    landmarks: Array
    observers: Array


@reads_reply
def read_exported_frame(message: map_pb2.ExportedFrame) -> ExportedFrame:
    """The frame of a message."""
    return ExportedFrame(
        read_frame_id(message.id),
        message.time_us,
        frozen(np.array(message.landmarks, np.float32).reshape(-1, 3)),
        frozen(np.array(message.observers, np.uint32)),
    )
