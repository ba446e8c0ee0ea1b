"""What people pass and see: records and names as arguments, short reprs, timeouts, and programs that end early."""

from __future__ import annotations

import math
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import time
from typing import Any, Callable, Iterator

import grpc
import numpy as np
import points_world
import pytest
import relmap
from conftest import PATIENCE_S, PYTHON, Daemon
from fake_daemon import FakeDaemon, refuse
from relmap import events
from relmap.credentials import credentials_of
from relmap.v1 import map_pb2, reason_pb2

LOOP = "2:5/1"  # a closure of the fixture's map


def test_records_stand_for_what_they_are_of(client: relmap.Client) -> None:
    session = client.sessions()[1]
    assert session.number == 2
    loops = client.edges(session=session, states="accepted", kinds=["loop"], order="suspicion")
    assert loops == client.edges(
        session=np.int64(2), states=[relmap.EdgeState.ACCEPTED], kinds=relmap.EdgeKind.LOOP, order=relmap.EdgeOrder.SUSPICION
    )  # type: ignore[call-overload]
    assert client.explain_edge(loops[0]).edge.id == loops[0].id
    frame = client.frame("2:8")
    assert client.frame(frame).id == frame.id
    view = relmap.FrameId(2, 8)
    assert [client.localise(same).frame for same in (frame, view, "2:8")] == 3 * [relmap.FrameId(1, 30)]
    assert client.find_route(frame, "kitchen", by="distance").frames[0] == frame.id
    assert len(client.odometry(session).T) == len(client.odometry(2).T) == 40
    assert client.skeleton(sessions=session).frames_total == client.skeleton(sessions=[2]).frames_total
    assert client.export_trajectories("kitti", session)[0].session == 2
    assert client.closure_matrix(session).counts("accepted")[0] == (1, 2)


@pytest.mark.parametrize(
    "wrong, error, words",
    [
        (lambda c: c.edges(session=-1), ValueError, "0 or more"),
        (lambda c: c.edges(session=""), ValueError, "empty"),
        (lambda c: c.edges(session=2.0), TypeError, "a Session"),
        (lambda c: c.skeleton(sessions=[1, None]), TypeError, "a Session"),
        (lambda c: c.edges(order="worst"), ValueError, "'suspicion'"),
        (lambda c: c.edges(states=["fine"]), ValueError, "'accepted'"),
        (lambda c: c.edges(timeout=-1), ValueError, "above 0"),
        (lambda c: c.status(timeout=-1), ValueError, "above 0"),
        (lambda c: c.find_route("1:1", "2:1", by="beauty"), ValueError, "'certainty'"),
        (lambda c: c.export_trajectories("csv"), ValueError, "'tum'"),
        (lambda c: c.localise(np.zeros((64, 64), np.uint8), camera=1.5), TypeError, "a Session"),
        (lambda c: c.localise(open(os.devnull, "rb")), TypeError, "file.read()"),
        (lambda c: c.localise(None), TypeError, "NoneType"),
        (lambda c: c.watch(silence=0), ValueError, "silence"),
        (lambda c: c.iter_edges(min_suspicion=2), ValueError, "min_suspicion"),
        (lambda c: c.export_frames(b"all"), TypeError, "a Session"),
        (lambda c: c.iter_edges(other_session="evening"), ValueError, "needs session"),
        (lambda c: c.watch(sessions=[0]), ValueError, "1 or more"),
        (lambda c: c.frame(("2", 8)), TypeError, "a Frame"),
    ],
)
def test_what_is_wrong_is_told_at_once(
    client: relmap.Client, wrong: Callable[[Any], Any], error: type, words: str
) -> None:
    with pytest.raises(error, match=words):
        wrong(client)


@pytest.mark.parametrize("server, error", [(None, TypeError), (50070, TypeError), ("http://localhost:50070", relmap.RequestError)])
def test_what_is_no_server_is_told(server: Any, error: type) -> None:
    with pytest.raises(error, match="HOST:PORT"):
        relmap.connect(server)


def test_what_is_no_timeout_is_told(daemon: Daemon) -> None:
    for wrong in (None, "5"):
        with pytest.raises(TypeError, match="math.inf"):
            relmap.connect(daemon.server, timeout=wrong)  # type: ignore[arg-type]


def test_a_timeout_may_be_infinite_and_is_named(daemon: Daemon) -> None:
    with relmap.connect(daemon.server, timeout=math.inf) as client:
        assert client.status().frames == 120 and len(client.edges()) > 100
        assert repr(client) == f"<Client of {daemon.server}>"
    assert repr(client) == f"<Client of {daemon.server}, closed>"

    def slow(request: Any, context: Any) -> map_pb2.ListEdgesReply:
        time.sleep(2)
        return map_pb2.ListEdgesReply()

    with FakeDaemon(ListEdges=slow) as busy, relmap.connect(busy.address, timeout=PATIENCE_S) as client:
        with pytest.raises(relmap.DeadlineExceeded, match="timeout was 0.2 s"):
            next(client.iter_edges(timeout=0.2))


@pytest.mark.parametrize("call", [lambda c: c.edges(timeout=1.5), lambda c: c.find_route("1:1", "1:2", timeout=1.5)])
def test_an_error_names_the_timeout_that_was_asked_for(call: Callable[[Any], Any]) -> None:
    """Not what was left of it for the second page, or for the stream that went on."""
    seen: list[Any] = []

    def pages(request: Any, context: Any) -> map_pb2.ListEdgesReply:
        seen.append(request)
        time.sleep(0.2 if len(seen) == 1 else 3)
        return map_pb2.ListEdgesReply(next_page_token="more")

    def route(request: Any, context: Any) -> Iterator[map_pb2.FindRouteReply]:
        seen.append(request)
        if len(seen) == 1:
            yield map_pb2.FindRouteReply(resume_token="more")
            time.sleep(0.2)
            refuse(context, grpc.StatusCode.UNAVAILABLE, reason_pb2.REASON_UNREACHABLE, "broken")
        time.sleep(3)

    with FakeDaemon(ListEdges=pages, FindRoute=route) as daemon:
        with relmap.connect(daemon.address, timeout=PATIENCE_S) as client:
            with pytest.raises(relmap.DeadlineExceeded, match="the timeout was 1.5 s"):
                call(client)
    assert len(seen) == 2


def test_tokens_and_certificates_are_checked(tmp_path: pathlib.Path) -> None:
    pem = b"-----BEGIN CERTIFICATE-----\n"
    found = credentials_of(None, " 1234\n", pem)
    assert found is not None and found.token == "1234"  # as read from a file
    for token in ("", "\n", "a b"):
        with pytest.raises(ValueError, match="token"):
            credentials_of(None, token, pem)
    with pytest.raises(ValueError, match="PEM"):
        credentials_of(None, "1234", b"something")
    (tmp_path / "other").write_text("something")
    with pytest.raises(ValueError, match="PEM"):
        credentials_of(None, "1234", tmp_path / "other")
    with pytest.raises(FileNotFoundError):
        credentials_of(None, "1234", tmp_path / "nothing")


def test_what_is_printed_is_short(client: relmap.Client) -> None:
    edges = client.edges()
    lines = repr(edges).splitlines()
    assert lines[0] == f"Edges: {len(edges)}, the first 10:" and len(lines) == 12 and lines[2].startswith("1:1/0")
    assert isinstance(edges[:3], type(edges)) and len(edges[:3].to_pandas()) == 3
    assert repr(edges[:0]) == "Edges: empty" and edges[-1] == tuple(edges)[-1]
    text = repr(client.frame("2:8", landmarks=True, observations=True))
    assert text.startswith("Frame(id=2:8, ") and "T_odom_frame=float64 (4, 4)" in text and len(text) < 8000
    assert len(repr(client.find_route("2:0", "1:30", covariance=True))) < 1500
    assert len(repr(client.draw_map())) < 100 and "<svg" in client.draw_map().svg
    for table in (edges, client.sessions(), client.labels(), client.closure_matrix(), client.match_image("2:8"), client.robots()):
        assert table._repr_html_().startswith("<table>") and list(table.to_pandas().columns) == list(table.columns())
    assert client.match_image("2:8")[:1].reason == relmap.Reason.OK


def test_exceptions_pass_from_process_to_process() -> None:
    place = relmap.PlaceNotRecognised(relmap.Reason.NEW_PLACE, "nothing like it", "r1")
    refused = relmap.KeyframesRefused((relmap.ingest_core.Refusal(3, relmap.Reason.BAD_NAME, "no name"),))
    for error in (place, relmap.ClientClosed(), refused):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and again.__dict__ == error.__dict__ and str(again) == str(error)


def test_events_without_a_time_have_none(client: relmap.Client) -> None:
    told = next(event for event in client.watch() if isinstance(event, events.CaughtUp))
    assert told.time is None


def test_a_page_and_not_a_whole_walk_has_the_timeout() -> None:
    """What is done with the edges may take as long as it likes."""
    from test_iterators import Pages

    with FakeDaemon(ListEdges=Pages()) as daemon, relmap.connect(daemon.address, timeout=PATIENCE_S) as client:
        seen = 0
        for _ in client.iter_edges(timeout=3.0):
            time.sleep(0.5)
            seen += 1
        assert seen == 9


def test_what_cameras_and_features_may_be() -> None:
    with pytest.raises(ValueError, match="whole numbers"):
        relmap.StereoCamera(f=400, cx=256, cy=192, baseline=0.12, width=512.0, height=384)  # type: ignore[arg-type]
    one: dict[str, Any] = dict(u=[1], v=[1], scale=[3], angle=[0])
    assert relmap.Features(**one, sift=np.full((1, 128), 7, np.float32)).sift.dtype == np.uint8
    for sift in (np.full((1, 128), 0.5), np.full((1, 128), 256.0), np.full((1, 128), np.nan)):
        with pytest.raises(ValueError, match="sift"):
            relmap.Features(**one, sift=sift)


def test_arguments_of_a_keyframe(client: relmap.Client) -> None:
    first, second = list(points_world.drive(2))
    session = client.session("cart", points_world.CAMERA)
    with pytest.raises(ValueError, match="not open"):
        session.add(first.time, first.T_odom_frame)
    with session:
        with pytest.raises(TypeError, match="JPEG"):
            session.add(first.time, first.T_odom_frame, picture=np.zeros((384, 512), np.uint8))  # type: ignore[arg-type]
        with pytest.raises(ValueError, match="'vision'"):
            session.add(first.time, first.T_odom_frame, source="wheels")
        assert "0 sequences" in repr(session)
    with pytest.raises(ValueError, match="session is closed"):
        session.open()
    session.close()  # again


PROGRAM = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import points_world, relmap
server, how = sys.argv[1:]
client = relmap.connect(server, timeout=600)
session = client.session("cart", points_world.CAMERA, name=how)
if how == "forgotten":
    session.open()
    for step in points_world.drive(3):
        session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
elif how == "interrupted":
    with session:
        for step in points_world.drive(3):
            session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
        print("added", flush=True)
        sys.stdin.read()
elif how == "forgotten by asyncio":
    import asyncio
    import relmap.aio

    async def main():
        async with await relmap.aio.connect(server) as client:
            session = client.session("cart", points_world.CAMERA, name=how)
            await session.open()
            for step in points_world.drive(3):
                await session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)

    asyncio.run(main())
else:
    for event in client.watch():
        print("watching", flush=True)
"""


def _program(daemon: Daemon, how: str) -> "subprocess.Popen[str]":
    path = os.pathsep.join([str(PYTHON), str(PYTHON / "notebooks")])
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, daemon.server, how],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip


def test_programs_that_end_early_lose_nothing(own_daemon: Daemon) -> None:
    """A session that is not closed, and Ctrl-C: what was added reaches the disk; the sessions stay open."""
    forgetful = _program(own_daemon, "forgotten")
    assert forgetful.communicate(timeout=PATIENCE_S)[1] == "" and forgetful.returncode == 0
    hasty = _program(own_daemon, "forgotten by asyncio")  # whose loop does not wait
    assert "3 of its keyframes" in hasty.communicate(timeout=PATIENCE_S)[1] and hasty.returncode == 0
    for how in ("interrupted", "watching"):
        running = _program(own_daemon, how)
        assert running.stdout is not None and running.stdout.readline()
        running.send_signal(signal.SIGINT)
        said = running.communicate(timeout=PATIENCE_S)[1]
        assert said.rstrip().endswith("KeyboardInterrupt"), said
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        client.wait_idle()
        found = {session.name: (session.frames, session.state.name) for session in client.sessions()}
    assert found == {"forgotten": (3, "OPEN"), "interrupted": (3, "OPEN")}


LEFT_OPEN = """
import atexit, sys, threading

def tell():  # registered first, runs last
    for thread in threading.enumerate():
        if thread is not threading.main_thread() and thread.name != "relmap silence":
            thread.join(20)
            print(thread.name, "is at work" if thread.is_alive() else "is done", flush=True)

atexit.register(tell)
import points_world, relmap
client = relmap.connect(sys.argv[1], timeout=600)
session = client.session("cart", points_world.CAMERA, name="left open")
session.open()
for step in points_world.drive(3):
    session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
events = client.watch()
next(events)
"""


def test_no_call_outlasts_the_program(own_daemon: Daemon) -> None:
    """While the interpreter ends, nothing could end a call any more, and grpcio would wait for that."""
    path = os.pathsep.join([str(PYTHON), str(PYTHON / "notebooks")])
    done = subprocess.run(
        [sys.executable, "-c", LEFT_OPEN, own_daemon.server],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=PATIENCE_S,
    )  # fmt: skip
    assert done.returncode == 0 and "is at work" not in done.stdout, done.stdout + done.stderr


def test_a_program_that_loses_keyframes_says_so(own_daemon: Daemon) -> None:
    """The daemon is gone when the program ends."""
    code = PROGRAM.replace("client = relmap.connect(server, timeout=600)", "client = relmap.connect(server)").replace(
        "    session.open()\n", "    session.open()\n    import os; os.kill(int(how_to_kill), 9)\n"
    )
    assert code != PROGRAM
    pid = own_daemon.endpoint()["pid"]
    path = os.pathsep.join([str(PYTHON), str(PYTHON / "notebooks")])
    done = subprocess.run(
        [sys.executable, "-c", f"how_to_kill = {pid}\n" + code, own_daemon.server, "forgotten"],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path}, timeout=PATIENCE_S,
    )  # fmt: skip
    assert "3 of its keyframes are not on the daemon's" in done.stderr and done.returncode == 0, done.stderr
