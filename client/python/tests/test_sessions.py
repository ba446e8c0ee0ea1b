"""Sessions as arguments: numbers, names, ROBOT/NAME, uuids and records, wherever one is asked for."""

from __future__ import annotations

import asyncio
import dataclasses
import uuid
from typing import Any, Callable, Iterator

import numpy as np
import points_world
import pytest
import relmap
import relmap.aio
from conftest import PATIENCE_S, Daemon
from fake_daemon import FakeDaemon
from relmap import events
from relmap.v1 import graph_pb2, map_pb2

# What each call answers, of the session that it is given; for a wrong number another.
CALLS: dict[str, Callable[[Any, Any], Any]] = {
    "edges": lambda c, s: [edge.id for edge in c.edges(session=s, other_session=1)],
    "edges, other_session": lambda c, s: [edge.id for edge in c.edges(session=1, other_session=s)],
    "iter_edges": lambda c, s: [edge.id for edge in c.iter_edges(session=s, other_session=s)],
    "odometry": lambda c, s: c.odometry(s).T.shape,
    "export_trajectories": lambda c, s: [file.session for file in c.export_trajectories("tum", s)],
    "export_frames": lambda c, s: len(list(c.export_frames([s]))),
    "skeleton": lambda c, s: c.skeleton(3, sessions=s).frames_total,
    "draw_map": lambda c, s: c.draw_map(sessions=[s]).svg,
    "closure_matrix": lambda c, s: tuple(c.closure_matrix([s])),
    # Its journal is trimmed by commits meanwhile.
    "verify": lambda c, s: dataclasses.replace(c.verify([s]), journal_records=0),
    "watch": lambda c, s: next(e for e in c.watch(sessions=s, oldest=True) if isinstance(e, events.FramesAdded)),
    "localise, camera": lambda c, s: _reason(lambda: c.localise(np.zeros((384, 512), np.uint8), camera=s)),
    "match_image, camera": lambda c, s: _reason(lambda: c.match_image(relmap.View(left=_GREY, camera=s))),
    "find_route, filter": lambda c, s: _reason(
        lambda: c.find_route("2:3", "2:30", filter=relmap.RouteFilter(sessions=[s])).frames
    ),
    "find_route, a view": lambda c, s: _reason(lambda: c.find_route("2:3", relmap.View(left=_GREY, camera=s))),
    "freeze_session": lambda c, s: _reason(lambda: c.freeze_session(s, False)),
    "delete_session": lambda c, s: _reason(lambda: c.delete_session(s, "no uuid of it")),
    "repair": lambda c, s: _reason(lambda: c.repair([s])),
}
_GREY = np.zeros((384, 512), np.uint8)


def _reason(call: Callable[[], Any]) -> Any:
    """What the call answers, or why it does not."""
    try:
        return call()
    except relmap.RelmapError as error:
        return type(error), error.reason, error.message


@pytest.mark.parametrize("name", CALLS)
def test_a_session_is_named_by_number_name_or_uuid(client: relmap.Client, name: str) -> None:
    call = CALLS[name]
    session = client.sessions().named("evening")
    assert session.number == 2
    expected = call(client, 2)
    for same in ("2", "evening", "cart/evening", session.uuid, session.uuid.upper(), uuid.UUID(session.uuid), session):
        assert call(client, same) == expected, same
    with pytest.raises(relmap.RequestError, match="no session is called 'night'") as raised:
        done = call(client, "night")
        if isinstance(done, tuple):  # of _reason()
            raise done[0](*done[1:])
    assert raised.value.reason == relmap.Reason.NO_SUCH_SESSION


def test_asyncio_takes_names_as_well(daemon: Daemon) -> None:
    async def run() -> tuple[int, int]:
        async with await relmap.aio.connect(daemon.server, timeout=PATIENCE_S) as client:
            edges = [edge async for edge in client.iter_edges(session="evening", other_session="evening")]
            return len(edges), len((await client.odometry("evening")).T)

    assert asyncio.run(run()) == (39, 40)


def _session(number: int, robot: str, state: int = graph_pb2.SESSION_STATE_OPEN) -> graph_pb2.Session:
    camera = relmap.camera.camera_message(points_world.CAMERA)
    return graph_pb2.Session(
        number=number, uuid=str(uuid.UUID(int=number)), robot=robot, name="drive", state=state, camera=camera
    )  # type: ignore[arg-type]


@pytest.fixture
def alike() -> Iterator[relmap.Client]:
    """A client of a daemon whose sessions are all called the same; what is asked of the skeleton is told as an error."""
    going = graph_pb2.SESSION_STATE_DELETING
    sessions = [_session(1, "cart", going), _session(2, "cart"), _session(3, "van"), _session(4, "bus", going)]

    def listed(request: Any, context: Any) -> map_pb2.ListSessionsReply:
        return map_pb2.ListSessionsReply(sessions=sessions)

    with FakeDaemon(ListSessions=listed) as daemon:
        with relmap.connect(daemon.address, timeout=PATIENCE_S) as client:
            yield client


def test_a_name_of_several_sessions_is_refused_with_what_tells_them_apart(alike: relmap.Client) -> None:
    with pytest.raises(relmap.RequestError, match=r"2 sessions are called 'drive': 2 \(robot cart\), 3 \(robot van\)") as raised:
        alike.odometry("drive")
    assert raised.value.reason == relmap.Reason.INVALID_ARGUMENT
    assert "number, uuid or as ROBOT/NAME" in raised.value.message
    listed = alike.sessions()
    assert listed.number_of("van/drive") == 3
    assert listed.number_of("cart/drive") == 2  # the other one is being deleted
    assert listed.number_of("bus/drive") == 4  # nothing else is called so
    assert listed.number_of(str(uuid.UUID(int=1))) == 1


def test_numbers_cost_no_call_and_names_one() -> None:
    asked: list[Any] = []

    def listed(request: Any, context: Any) -> map_pb2.ListSessionsReply:
        asked.append(request)
        return map_pb2.ListSessionsReply(sessions=[_session(7, "cart")])

    def edges(request: map_pb2.ListEdgesRequest, context: Any) -> map_pb2.ListEdgesReply:
        asked.append(request.session)
        return map_pb2.ListEdgesReply()

    with FakeDaemon(ListSessions=listed, ListEdges=edges) as fake:
        with relmap.connect(fake.address, timeout=PATIENCE_S) as client:
            client.edges(session=3)
            assert asked == [3]
            client.edges(session="drive")
            assert asked[2:] == [7] and len(asked) == 3

