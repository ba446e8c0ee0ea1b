"""Exports: trajectories and frames."""

from __future__ import annotations

from typing import Any, AsyncIterator, List, Optional, Union

from relmap.aio.base import LONG_S, ClientBase
from relmap.choices import choice
from relmap.connection import Countdown
from relmap.exports import ExportedFrame, ExportFormat, TrajectoryFile, read_exported_frame
from relmap.graph import Edges, read_edge
from relmap.ids import SessionLike, SessionsLike, as_sessions
from relmap.routes import Trajectory, parse_tum
from relmap.v1 import map_pb2


class ExportCalls(ClientBase):
    """Calls that export the map."""

    async def export_trajectories(
        self,
        format: Union[ExportFormat, str] = ExportFormat.TUM,
        sessions: SessionsLike = (),
        *,
        timeout: Optional[float] = LONG_S,
    ) -> tuple[TrajectoryFile, ...]:
        """The trajectory of each session as a file: its odometry edges, chained. Closures do not bend it. All are of one
        version of the map: if that expires meanwhile, they are read again.

        Args:
            format: TUM, or "tum" ("time tx ty tz qx qy qz qw") or KITTI (the upper three rows of the pose matrix).
            sessions: empty: all but mono sessions.

        Raises:
            RequestError: NO_SUCH_SESSION, NOT_STEREO: a mono session, which has no motion.
            ViewExpired: the version expired again and again; export one session at a time.
        """
        kind = choice("format", ExportFormat, format)
        countdown = self._caller.countdown(timeout)
        return await self._trajectories(kind, await self._numbers(sessions, countdown), countdown)

    async def _trajectories(
        self, format: ExportFormat, sessions: List[int], countdown: Countdown
    ) -> tuple[TrajectoryFile, ...]:
        request = map_pb2.ExportRequest(format=int(format), sessions=sessions)  # type: ignore[arg-type]
        files: List[TrajectoryFile] = []
        for reply in await self._replies(self._map.Export, request, countdown):
            doubtful = Edges(read_edge(edge) for edge in reply.unmeasured)
            if files and files[-1].session == reply.session:
                last = files[-1]
                files[-1] = TrajectoryFile(last.session, last.data + reply.data, Edges(last.doubtful + doubtful))
            else:
                files.append(TrajectoryFile(reply.session, reply.data, doubtful))
        return tuple(files)

    async def odometry(self, session: SessionLike, *, timeout: Optional[float] = LONG_S) -> Trajectory:
        """The motion of a session, chained along its odometry edges: it drifts, and knows of no closure. Raises as
        export_trajectories()."""
        countdown = self._caller.countdown(timeout)
        number = await self._number(session, countdown)
        files = await self._trajectories(ExportFormat.TUM, [number], countdown)
        return parse_tum(number, b"".join(file.data for file in files))

    def export_frames(
        self, sessions: SessionsLike = (), *, landmarks: bool = False, timeout: Optional[float] = LONG_S
    ) -> AsyncIterator[ExportedFrame]:
        """The frames of each session, ascending, with their landmarks if `landmarks` is set. A stream that breaks goes on.

        All are of one version of the map. If it expires before the first frame was given out, the export begins again by
        itself; afterwards ViewExpired is raised, since frames of two versions do not go together: begin again.

        Raises:
            RequestError: NO_SUCH_SESSION, NOT_STEREO.
            ViewExpired: as above; the message says how many frames were given out.
        """
        as_sessions(sessions)  # so that wrong arguments are told here, and not when the first frame is asked for
        countdown = self._caller.countdown(timeout)

        async def replies() -> AsyncIterator[Any]:
            request = map_pb2.ExportRequest(
                format=map_pb2.EXPORT_FORMAT_FRAMES,
                sessions=await self._numbers(sessions, countdown),
                landmarks=landmarks,
            )
            async for reply in self._caller.resumed(self._map.Export, request, countdown):
                yield reply

        return self._given(replies, lambda reply: reply.frames, read_exported_frame, "frames", "export")
