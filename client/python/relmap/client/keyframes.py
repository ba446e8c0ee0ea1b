# Made of relmap/aio/keyframes.py by client/python/make_sync; do not edit.
"""Ingest sessions."""

from __future__ import annotations

import uuid as uuids
from typing import Optional, Union

from relmap.client.base import ClientBase
from relmap.client.ingest import IngestSession
from relmap.camera import RawStereo, StereoCamera
from relmap.ingest_core import SessionStatus, read_session_status
from relmap.requests import as_uuid
from relmap.v1 import ingest_pb2


class KeyframeCalls(ClientBase):
    """Calls by which keyframes are streamed."""

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
