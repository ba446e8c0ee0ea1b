"""What happens to the map is told, through a killed daemon, too."""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from typing import Any, Callable, Iterator

import grpc
import pytest
import relmap
import relmap.aio
from conftest import PATIENCE_S, Daemon, ingest
from fake_daemon import FakeDaemon, refuse
from relmap import events
from relmap.v1 import common_pb2, graph_pb2, reason_pb2, status_pb2, watch_pb2


class Watcher:
    """Watches in a thread of its own."""

    def __init__(self, server: str, **options: Any) -> None:
        self.seen: list[events.MapEvent] = []
        self._queue: "queue.Queue[Any]" = queue.Queue()
        self._client = relmap.connect(server)
        threading.Thread(target=self._run, kwargs=options, daemon=True).start()

    def _run(self, **options: Any) -> None:
        try:
            for event in self._client.watch(**options):
                self._queue.put(event)
        except Exception as error:
            self._queue.put(error)

    def until(self, wanted: Callable[[events.MapEvent], bool]) -> events.MapEvent:
        while True:
            event = self._queue.get(timeout=PATIENCE_S)
            if isinstance(event, Exception):
                raise event
            self.seen.append(event)
            if wanted(event):
                return event


def _is(kind: type) -> Callable[[events.MapEvent], bool]:
    return lambda event: isinstance(event, kind)


def test_everything_is_told_through_a_kill(own_daemon: Daemon) -> None:
    watcher = Watcher(own_daemon.server, oldest=True, patience=PATIENCE_S)
    watcher.until(_is(events.CaughtUp))
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        number = ingest(client, "watched", 70)
        client.set_label("1:3", "shelf")
        client.commit()
    watcher.until(lambda e: isinstance(e, events.LabelsChanged) and e.labels == ("shelf",))
    own_daemon.kill()
    own_daemon.start()
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        client.set_label("1:4", "lamp")
        client.commit()
        closures = {e.id: e.state for e in client.edges(kinds=[relmap.EdgeKind.LOOP])}
    last = watcher.until(lambda e: isinstance(e, events.LabelsChanged) and e.frame.index == 4)
    assert isinstance(last, events.LabelsChanged) and last.labels == ("lamp",) and last.time.year >= 2025
    added = [f.frame.index for e in watcher.seen if isinstance(e, events.FramesAdded) for f in e.frames]
    assert added == list(range(70))
    told = {e.edge.id: e.edge.state for e in watcher.seen if isinstance(e, events.EdgeChanged)}
    assert told == closures and len(told) > 3
    assert any(isinstance(e, events.SessionChanged) and e.session == number for e in watcher.seen)
    tokens = [e.origin.resume_token for e in watcher.seen if e.origin.resume_token]
    again = Watcher(own_daemon.server, resume_token=tokens[-1])
    again.until(_is(events.CaughtUp))
    assert not any(isinstance(e, events.LabelsChanged) for e in again.seen)


def test_asyncio_watches_too(client: relmap.Client, daemon: Daemon) -> None:
    client.commit()  # what is not committed is not told

    async def run() -> list[events.MapEvent]:
        seen = []
        async with await relmap.aio.connect(daemon.server) as watching:
            async for event in watching.watch(oldest=True, no_frames=True):
                seen.append(event)
                if isinstance(event, events.CaughtUp):
                    return seen
        return seen

    seen = asyncio.run(run())
    assert any(isinstance(e, events.SessionChanged) for e in seen)
    assert not any(isinstance(e, events.FramesAdded) for e in seen)


def test_a_token_that_is_none_is_refused(client: relmap.Client) -> None:
    with pytest.raises(relmap.RequestError):
        next(client.watch(resume_token="no token"))


def _event(number: int, **event: Any) -> watch_pb2.MapEvent:
    return watch_pb2.MapEvent(resume_token=f"t{number}", journal_sequence=number, time_us=5, author="anna", **event)


def test_every_event_is_read_and_a_later_one_does_not_disturb() -> None:
    frame = common_pb2.FrameId(session=1, index=2)
    all_of = [
        _event(1, session_changed=graph_pb2.Session(number=1)),
        _event(2, edge_changed=graph_pb2.Edge(id=common_pb2.EdgeId(frame=frame, ordinal=1), b=frame)),
        _event(3, frames_moved=watch_pb2.FramesMoved(ranges=[watch_pb2.FrameRange(session=1, first=2, last=3)])),
        _event(4, frames_added=watch_pb2.FramesAdded(frames=[watch_pb2.AddedFrame(frame=common_pb2.FrameId(session=1, index=4))])),
        _event(5, skipped=watch_pb2.SkippedSequences(session=1, first=5, last=6, reason=reason_pb2.REASON_CAPTURE_FAILED)),
        _event(6, frames_removed=watch_pb2.FramesRemoved(session=1, first=3)),
        _event(7, session_deleted=watch_pb2.SessionDeleted(session=1, uuid="u")),
        _event(8, edge_removed=watch_pb2.EdgeRemoved(edge=common_pb2.EdgeId(frame=frame, ordinal=1))),
        _event(9, frame_labels=watch_pb2.FrameLabels(frame=frame, labels=["a"])),
        _event(10, robot_changed={"uuid": "u", "lag_us": -1}),
        _event(11, storage_changed=watch_pb2.StorageState(reason=reason_pb2.REASON_DISK_FULL)),
        _event(12, resync=watch_pb2.Resync(reason=reason_pb2.REASON_VIEW_EXPIRED)),
        _event(13, caught_up=watch_pb2.CaughtUp(journal_sequence=13)),
        _event(14),
    ]
    kinds = [type(events.read_event(message)).__name__ for message in all_of]
    fields = [f.name for f in watch_pb2.MapEvent.DESCRIPTOR.oneofs_by_name["event"].fields]
    assert len(set(kinds)) == len(all_of) == len(fields) - 2 + 1  # two are deprecated, one is unknown
    assert kinds[-1] == "UnknownEvent"


def test_a_stream_goes_on_after_the_last_event() -> None:
    def method(request: watch_pb2.WatchMapRequest, context: Any) -> Iterator[watch_pb2.MapEvent]:
        first = int(request.resume_token.removeprefix("t") or 0) + 1
        yield watch_pb2.MapEvent(storage_changed=watch_pb2.StorageState())
        yield _event(first, caught_up=watch_pb2.CaughtUp(journal_sequence=first))
        context.abort(grpc.StatusCode.UNAVAILABLE, "broken")

    with FakeDaemon(WatchMap=method) as daemon, relmap.connect(daemon.address) as client:
        watch = client.watch()
        seen = [next(watch) for _ in range(4)]
        watch.close()
        assert [type(e).__name__ for e in seen] == ["StorageChanged", "CaughtUp", "CaughtUp", "CaughtUp"]
        assert [r.resume_token for r in daemon.calls["WatchMap"]] == ["", "t1", "t2"]


def test_a_watcher_gives_up_after_its_patience() -> None:
    def refused(request: Any, context: Any) -> Iterator[Any]:
        if False:
            yield
        refuse(context, grpc.StatusCode.RESOURCE_EXHAUSTED, reason_pb2.REASON_BUDGET_EXCEEDED, "too many watch")

    def gone(request: Any, context: Any) -> Iterator[Any]:
        if False:
            yield
        context.abort(grpc.StatusCode.UNAVAILABLE, "gone")

    with FakeDaemon(WatchMap=refused) as daemon, relmap.connect(daemon.address) as client:
        with pytest.raises(relmap.DaemonError, match="too many watch"):
            next(client.watch())
    with FakeDaemon(WatchMap=gone) as daemon, relmap.connect(daemon.address) as client:
        with pytest.raises(relmap.Unreachable):
            next(client.watch(patience=0.3))


def _stopped(request: Any, context: Any) -> Iterator[watch_pb2.MapEvent]:
    """Says something, then nothing, as a daemon whose network is cut."""
    yield _event(int(request.resume_token.removeprefix("t") or 0) + 1)
    while context.is_active():
        time.sleep(0.02)


def test_a_stream_that_falls_silent_is_broken() -> None:
    with FakeDaemon(WatchMap=_stopped) as daemon, relmap.connect(daemon.address) as client:
        watch = client.watch(silence=0.3)
        seen = [next(watch) for _ in range(3)]
        watch.close()
        assert [e.origin.resume_token for e in seen] == ["t1", "t2", "t3"]
        assert [r.resume_token for r in daemon.calls["WatchMap"]] == ["", "t1", "t2"]
        with pytest.raises(ValueError):
            next(client.watch(silence=0))


def test_patience_ends_with_a_daemon_that_answers_nothing() -> None:
    stopped = threading.Event()

    def status(request: Any, context: Any) -> status_pb2.GetStatusReply:
        while stopped.is_set() and context.is_active():
            time.sleep(0.02)
        return status_pb2.GetStatusReply()

    with FakeDaemon(WatchMap=_stopped, GetStatus=status) as daemon, relmap.connect(daemon.address) as client:
        watch = client.watch(silence=0.3, patience=0.5)
        next(watch)
        stopped.set()
        with pytest.raises(relmap.Unreachable, match="nothing was heard for 0.3 s"):
            next(watch)
        assert len(daemon.calls["WatchMap"]) == 1 and len(daemon.calls["GetStatus"]) > 1
        stopped.clear()


def test_a_slow_watcher_is_not_a_silent_daemon() -> None:
    def method(request: Any, context: Any) -> Iterator[watch_pb2.MapEvent]:
        yield _event(1)
        yield _event(2)
        while context.is_active():
            time.sleep(0.02)

    with FakeDaemon(WatchMap=method) as daemon, relmap.connect(daemon.address) as client:
        watch = client.watch(silence=5)
        next(watch)
        time.sleep(7)
        assert next(watch).origin.resume_token == "t2" and len(daemon.calls["WatchMap"]) == 1
        watch.close()


def test_silence_is_noticed_by_asyncio_too() -> None:
    async def run(address: str) -> list[str]:
        seen = []
        async with await relmap.aio.connect(address) as client:
            async for event in client.watch(silence=0.3):
                seen.append(event.origin.resume_token)
                if len(seen) == 3:
                    break
            await client.close()
            with pytest.raises(relmap.ClientClosed):
                await client.watch().__anext__()
            with pytest.raises(relmap.ClientClosed):
                await client.status()
        return seen

    with FakeDaemon(WatchMap=_stopped) as daemon:
        assert asyncio.run(run(daemon.address)) == ["t1", "t2", "t3"]


def test_a_closed_client_says_so() -> None:
    with FakeDaemon(WatchMap=_stopped) as daemon:
        client = relmap.connect(daemon.address)
        watch = client.watch(silence=0.3)
        assert [next(watch).origin.resume_token for _ in range(2)] == ["t1", "t2"]  # by a connection of its own
        client.close()
        with pytest.raises(relmap.ClientClosed):
            next(watch)
        for call in (client.status, lambda: next(client.watch()), lambda: client.set_label("1:1", "a"), client.edges):
            with pytest.raises(relmap.ClientClosed, match="the client is closed"):
                call()
        with client.connect_again() as again:
            assert again.status() is not None
