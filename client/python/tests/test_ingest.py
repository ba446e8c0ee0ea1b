"""Keyframes are streamed without loss: what is refused, a daemon that is killed, sessions that go on."""

from __future__ import annotations

import asyncio
import pathlib
import threading
import time
import uuid
from typing import List

import compare_ingest
import numpy as np
import points_world
import pytest
import relmap
import relmap.aio
from conftest import PATIENCE_S, Daemon
from relmap.ingest_core import IngestCore
from relmap.times import as_us
from relmap.v1 import ingest_pb2


def _add(session: relmap.IngestSession, step: points_world.Step, **more: object) -> int:
    return session.add(
        step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features, **more  # type: ignore[arg-type]
    )


def test_a_daemon_that_is_killed_loses_nothing(own_daemon: Daemon) -> None:
    steps = list(points_world.drive(120))
    with relmap.connect(own_daemon.server) as client:
        with client.session("cart", points_world.CAMERA, name="through kills", patience=PATIENCE_S) as session:
            for k, step in enumerate(steps):
                _add(session, step)
                if k in (40, 80):
                    own_daemon.kill()
                    if k == 80:
                        threading.Timer(0.5, own_daemon.start).start()
                    else:
                        own_daemon.start()
            assert session.flush(PATIENCE_S) == 120
    while own_daemon.endpoint().get("pid") is None:
        time.sleep(0.05)
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        client.wait_idle()
        listed = client.sessions()[0]
        assert (listed.frames, listed.state.name, listed.name) == (120, "ENDED", "through kills")
        assert client.verify().findings == ()


def test_asyncio_does_the_same(own_daemon: Daemon) -> None:
    async def run() -> None:
        async with await relmap.aio.connect(own_daemon.server) as client:
            async with client.session("cart", points_world.CAMERA, patience=PATIENCE_S) as session:
                for k, step in enumerate(points_world.drive(60)):
                    await session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
                    await asyncio.sleep(0)
                    if k == 30:
                        await session.flush()
                        own_daemon.kill()
                        own_daemon.start()
                assert await session.flush() == 60
        async with await relmap.aio.connect(own_daemon.server, timeout=PATIENCE_S) as client:
            await client.wait_idle()
            sessions = await client.sessions()
            assert (sessions[0].frames, sessions[0].state.name) == (60, "ENDED")

    asyncio.run(run())


def test_a_session_goes_on_under_its_uuid(own_daemon: Daemon) -> None:
    steps = list(points_world.drive(40))
    name = uuid.uuid4()
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        with client.session("cart", points_world.CAMERA, name="two parts", uuid=name) as session:
            for step in steps[:25]:
                _add(session, step)
        assert client.acknowledgement(name).next_sequence == 25
        with client.session("cart", points_world.CAMERA, name="two parts", uuid=str(name)) as session:
            assert session.next_sequence == 25
            session.give_up(2)
            for step in steps[27:]:
                _add(session, step, source=relmap.MotionSource.VISION)
        client.wait_idle()
        listed = client.sessions()[0]
        assert (listed.frames, listed.given_up, listed.next_sequence) == (38, 2, 40)


def test_refusals_are_told_once(own_daemon: Daemon) -> None:
    steps = list(points_world.drive(12))
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        with client.session("cart", points_world.CAMERA, name="refused") as session:
            for step in steps[:10]:
                _add(session, step)
            session.flush()
            client.freeze_session(session.number)
            _add(session, steps[10])
            with pytest.raises(relmap.KeyframesRefused) as raised:
                session.flush(PATIENCE_S)
            assert raised.value.reason == relmap.Reason.SESSION_FROZEN
            assert 10 in [r.sequence for r in raised.value.refusals]
            assert isinstance(raised.value, relmap.RobotDataError)
            assert "an operator has frozen the session" in str(raised.value)
            client.freeze_session(session.number, False)
            _add(session, steps[11])
            assert session.flush() == 12
        client.wait_idle()
        assert client.sessions()[0].frames == 11


def test_news_tell_where_keyframes_are_found(own_daemon: Daemon) -> None:
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        with client.session("cart", points_world.CAMERA, name="laps") as session:
            for step in points_world.drive(85):
                _add(session, step)
            session.flush()
            client.wait_idle()
            until = time.monotonic() + PATIENCE_S
            news: List[relmap.ingest_core.KeyframeLocalisation] = []
            while not any(not n.candidate for n in news) and time.monotonic() < until:
                news += session.take_news()
                time.sleep(0.05)
            found = next(n for n in news if not n.candidate)
            assert found.keyframe.index - found.frame.index in range(50, 70) and not found.withdrawn


def test_the_daemon_gone_for_good_is_told(own_daemon: Daemon) -> None:
    with relmap.connect(own_daemon.server) as client:
        with pytest.raises(relmap.Unreachable):
            with client.session("cart", points_world.CAMERA, patience=0.5) as session:
                own_daemon.kill()
                for step in points_world.drive(3):
                    _add(session, step)
                session.flush(PATIENCE_S)


def test_what_is_wrong_is_not_sent(client: relmap.Client) -> None:
    first, second = list(points_world.drive(2))
    before = len(client.sessions())
    with client.session("cart", points_world.CAMERA) as session:
        nan = np.full((4, 4), np.nan)
        for wrong in (
            lambda: session.add(first.time, nan),
            lambda: session.add(first.time, np.eye(3)),
            lambda: session.add(-5, np.eye(4)),
            lambda: session.add(first.time, np.eye(4), picture=b"no JPEG"),
            lambda: session.add(first.time, np.eye(4), sequence=-1),
            lambda: session.add(first.time, np.eye(4), standing_us=-1),
            lambda: session.give_up(0),
        ):
            with pytest.raises(ValueError):
                wrong()
        assert session.next_sequence == 0
    assert len(client.sessions()) == before
    with pytest.raises(ValueError, match="session is closed"):
        session.add(first.time, np.eye(4))
    for wrong in ({"robot": ""}, {"robot": "x" * 65}, {"name": "a\nb"}, {"uuid": "none"}, {"max_unsettled_bytes": 5}):
        with pytest.raises(ValueError):
            client.session(**{"robot": "cart", "camera": points_world.CAMERA, **wrong})
    with pytest.raises(TypeError):
        client.session("cart", None)  # type: ignore[arg-type]


def test_keyframes_that_do_not_ascend_are_not_sent(own_daemon: Daemon) -> None:
    first, second = list(points_world.drive(2))
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        with client.session("cart", points_world.CAMERA) as session:
            _add(session, first)
            with pytest.raises(ValueError, match="times ascend"):
                session.add(first.time, second.T_odom_frame, second.step_cov)
            late = relmap.Keyframe(
                header=session.header, sequence=1, time_us=as_us(first.time), T_odom_frame=second.T_odom_frame,
                step_cov=np.asarray(second.step_cov), source=relmap.MotionSource.VISION,
            )  # fmt: skip
            with pytest.raises(ValueError, match="times ascend"):
                session.add_keyframe(late)
            assert session.next_sequence == 1 and session.flush(PATIENCE_S) == 1


def test_keyframes_of_cpp_make_the_same_map(tmp_path: pathlib.Path) -> None:
    """Of one drive, sent by relmap-frontend and from Python, two deterministic daemons make equal maps; with 10,000 keyframes
    bench/compare_ingest.py does the same."""
    result = compare_ingest.compare(tmp_path, 160)
    assert result["equal"], result
    assert result["python"]["frames"] == 160 and result["python"]["closures"] > 5, result
    assert result["python"]["observations"] > 160 * 20, result


# ---- The state machine alone


def _ack(core: IngestCore, next_sequence: int, credits: int = 100, **more: object) -> ingest_pb2.Acknowledgement:
    return ingest_pb2.Acknowledgement(
        session_uuid=core._uuid, next_sequence=next_sequence, credits=credits, **more  # type: ignore[arg-type]
    )


def _sequences(requests: List[ingest_pb2.IngestRequest]) -> list[int]:
    return [r.keyframe.sequence if r.WhichOneof("content") == "keyframe" else -r.gap.first for r in requests]


def _core(keyframes: int, heard: bool = True) -> IngestCore:
    core = IngestCore(uuid.UUID(int=5))
    for k in range(keyframes):
        core.add_keyframe(k, 1, b"x" * 100)
    core.welcome(_welcome())
    if heard:
        core.acknowledge(_ack(core, 0), 0.0)
    return core


def _welcome(map_uuid: bytes = b"m" * 16, epoch: int = 1) -> ingest_pb2.Welcome:
    welcome = ingest_pb2.Welcome(map_uuid=map_uuid, map_epoch=epoch)
    welcome.protocol.major = 1
    return welcome


def test_only_the_first_is_sent_until_the_daemon_is_heard() -> None:
    core = _core(5, heard=False)
    assert _sequences(core.poll(0.0)) == [0] and core.poll(0.5) == []
    assert _sequences(core.poll(2.0)) == [0]
    core.acknowledge(_ack(core, 1), 2.1)
    assert _sequences(core.poll(2.2)) == [1, 2, 3, 4]


def test_credits_are_obeyed() -> None:
    core = _core(10, heard=False)
    core.acknowledge(_ack(core, 0, credits=3), 0.0)
    assert _sequences(core.poll(0.1)) == [0, 1, 2] and core.poll(0.2) == []
    core.acknowledge(_ack(core, 2, credits=3), 0.3)
    assert _sequences(core.poll(0.4)) == [3, 4]
    core.acknowledge(_ack(core, 5, credits=0), 0.5)
    assert core.poll(0.6) == []


def test_a_broken_stream_is_sent_again_from_what_is_settled() -> None:
    core = _core(6)
    assert len(core.poll(0.1)) == 6
    core.acknowledge(_ack(core, 2), 0.2)
    core.broken()
    assert core.poll(0.3) == []
    core.welcome(_welcome())
    core.acknowledge(_ack(core, 3), 0.4)
    assert _sequences(core.poll(0.5)) == [3, 4, 5] and core.unsettled_bytes == 300


def test_what_is_missing_is_sent_again() -> None:
    core = _core(6)
    core.poll(0.1)
    missing = [ingest_pb2.SequenceRange(first=1, last=2)]
    core.acknowledge(_ack(core, 1, missing=missing), 0.2)
    assert core.poll(0.3) == []  # it may be on its way
    core.acknowledge(_ack(core, 1, missing=missing, held=[ingest_pb2.SequenceRange(first=3, last=5)]), 2.0)
    assert _sequences(core.poll(2.1)) == [1, 2]
    core.acknowledge(_ack(core, 1), 20.0)
    assert _sequences(core.poll(20.1)) == [1, 2]  # not mentioned for ten seconds; 3..5 are held


def test_another_map_gets_nothing() -> None:
    core = _core(3)
    core.broken()
    assert "another map" in (core.welcome(_welcome(b"n" * 16)) or "")
    assert core.poll(5.0) == []


def test_a_restored_map_gets_what_is_kept_and_a_gap() -> None:
    core = _core(6)
    core.poll(0.1)
    core.acknowledge(_ack(core, 4), 0.2)
    core.broken()
    core.welcome(_welcome(epoch=2))
    core.acknowledge(_ack(core, 1), 0.3)
    requests = core.poll(0.4)
    assert _sequences(requests) == [-1, 4, 5] and requests[0].gap.last == 3
    core.acknowledge(_ack(core, 6), 0.5)
    assert core.all_settled


def test_skipped_sequences_are_given_up() -> None:
    core = _core(1)
    core.add_keyframe(5, 1, b"x")
    assert _sequences(core.poll(0.1)) == [0, -1, 5]
    with pytest.raises(ValueError):
        core.add_keyframe(3, 1, b"x")
