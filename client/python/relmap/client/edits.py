# Made of relmap/aio/edits.py by client/python/make_sync; do not edit.
"""Labels, and graphs that were made elsewhere."""

from __future__ import annotations

import uuid as uuids
from typing import Optional, Sequence, Union

from relmap.client.base import ClientBase
from relmap.geometry import ArrayLike
from relmap.ids import FrameLike, frame_message
from relmap.requests import ImportedLoop, as_uuid, import_requests
from relmap.v1 import map_pb2


class EditCalls(ClientBase):
    """Calls that add to the map what no robot measured."""

    def set_label(
        self, frame: FrameLike, label: str, present: bool = True, *, timeout: Optional[float] = None
    ) -> tuple[str, ...]:
        """Adds a label to a frame, or removes it if `present` is False. Returns the frame's labels afterwards.
        RequestError: NO_SUCH_FRAME, NO_SUCH_LABEL, BAD_NAME."""
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
