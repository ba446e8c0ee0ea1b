"""Lists and streams: pages, versions of the map that expire, streams that break."""

from __future__ import annotations

import asyncio
from typing import Any, Iterator

import grpc
import pytest
import relmap
import relmap.aio
from fake_daemon import FakeDaemon, edge, refuse
from relmap.v1 import common_pb2, graph_pb2, map_pb2, reason_pb2, skeleton_pb2, watch_pb2

EXPIRED = (grpc.StatusCode.ABORTED, reason_pb2.REASON_VIEW_EXPIRED, "the version is gone")


class Pages:
    """Lists nine edges, three a page. `expires`: the calls (from 0) that find the version gone."""

    def __init__(self, *expires: int) -> None:
        self.expires, self.call = set(expires), -1

    def __call__(self, request: map_pb2.ListEdgesRequest, context: Any) -> map_pb2.ListEdgesReply:
        self.call += 1
        if self.call in self.expires:
            refuse(context, *EXPIRED)
        first = int(request.page_token or 1)
        token = str(first + 3) if first < 7 else ""
        return map_pb2.ListEdgesReply(edges=[edge(i) for i in range(first, first + 3)], next_page_token=token)


def _indices(edges: Any) -> list[int]:
    return [e.b.index for e in edges]


@pytest.mark.parametrize("expires", [(), (0,), (1,), (2,), (0, 1, 3)])
def test_a_list_begins_again_when_its_version_expires(expires: tuple[int, ...]) -> None:
    with FakeDaemon(ListEdges=Pages(*expires)) as daemon, relmap.connect(daemon.address) as client:
        assert _indices(client.edges()) == list(range(1, 10))


def test_a_list_does_not_begin_again_for_ever() -> None:
    with FakeDaemon(ListEdges=Pages(*range(100))) as daemon, relmap.connect(daemon.address) as client:
        with pytest.raises(relmap.ViewExpired):
            client.edges()
        with pytest.raises(relmap.ViewExpired):
            list(client.iter_edges())


def test_an_iterator_begins_again_only_while_nothing_was_given_out() -> None:
    with FakeDaemon(ListEdges=Pages(0, 1)) as daemon, relmap.connect(daemon.address) as client:
        assert _indices(client.iter_edges()) == list(range(1, 10))
    with FakeDaemon(ListEdges=Pages(2)) as daemon, relmap.connect(daemon.address) as client:
        edges = client.iter_edges()
        assert _indices(next(edges) for _ in range(6)) == [1, 2, 3, 4, 5, 6]
        with pytest.raises(relmap.ViewExpired, match="6 items of it were given out; begin the list again") as raised:
            next(edges)
        assert raised.value.request_id == "fake"


def test_an_asynchronous_iterator_does_the_same() -> None:
    async def run(address: str) -> tuple[list[int], list[int]]:
        async with await relmap.aio.connect(address) as client:
            whole = _indices(await client.edges())
            return whole, [e.b.index async for e in client.iter_edges()]

    with FakeDaemon(ListEdges=Pages(1, 5)) as daemon:
        whole, iterated = asyncio.run(run(daemon.address))
        assert whole == iterated == list(range(1, 10))


def _route(breaks: int) -> Any:
    """A route of six steps, one a message, whose stream breaks after each of the first `breaks` messages."""
    broken = [0]

    def method(request: map_pb2.FindRouteRequest, context: Any) -> Iterator[map_pb2.FindRouteReply]:
        for i in range(int(request.resume_token or 0), 6):
            reply = map_pb2.FindRouteReply(resume_token=str(i + 1))
            reply.steps.add(frame=common_pb2.FrameId(session=1, index=i))
            if i == 0:
                reply.summary.cost = 7
            yield reply
            if broken[0] < breaks:
                broken[0] += 1
                context.abort(grpc.StatusCode.UNAVAILABLE, "broken")

    return method


def test_a_stream_that_breaks_goes_on() -> None:
    with FakeDaemon(FindRoute=_route(4)) as daemon, relmap.connect(daemon.address) as client:
        route = client.find_route("1:0", "1:5")
        assert [f.index for f in route.frames] == list(range(6)) and route.cost == 7
        assert [r.resume_token for r in daemon.calls["FindRoute"]] == ["", "1", "2", "3", "4"]


def test_a_stream_that_always_breaks_ends() -> None:
    def never(request: Any, context: Any) -> Iterator[Any]:
        if False:
            yield
        context.abort(grpc.StatusCode.UNAVAILABLE, "broken")

    with FakeDaemon(FindRoute=never) as daemon, relmap.connect(daemon.address) as client:
        with pytest.raises(relmap.Unreachable):
            client.find_route("1:0", "1:5")
        assert len(daemon.calls["FindRoute"]) == 1  # there was nothing to resume


def _expiring(replies: list[Any], *expires: int) -> Any:
    """A stream of replies. `expires`: the calls (from 0) that find the version gone before the last reply."""
    calls = iter(range(1000))

    def method(request: Any, context: Any) -> Iterator[Any]:
        expired = next(calls) in expires
        assert not request.resume_token
        yield from replies[:-1]
        if expired:
            refuse(context, *EXPIRED)
        yield replies[-1]

    return method


def _steps() -> list[Any]:
    replies = [map_pb2.FindRouteReply(resume_token=str(i)) for i in range(3)]
    for i, reply in enumerate(replies):
        reply.steps.add(frame=common_pb2.FrameId(session=1, index=i))
    return replies


def _chain(*index: int) -> dict[str, Any]:
    """Of session 1, with indices as they are sent."""
    n = len(index) - 1
    return dict(
        session=1, index=index, time_ms=[5] * (n + 1), step=([1.0] + [0.0] * 5) * n, variance=[1, 1] * n, frames=[1] * n
    )


def _chains() -> list[Any]:
    chain = _chain(1, 1)
    reply = skeleton_pb2.GetSkeletonReply(resume_token="a", map_version=7)
    reply.chains.add(**chain)
    return [reply, skeleton_pb2.GetSkeletonReply(resume_token="b", map_version=7, frames_total=2)]


FILES = [map_pb2.ExportReply(session=1, data=text, resume_token="r") for text in (b"ab", b"cd")]


def test_what_is_given_out_at_its_end_begins_again() -> None:
    methods = dict(
        FindRoute=_expiring(_steps(), 0, 1), GetSkeleton=_expiring(_chains(), 0, 2), Export=_expiring(FILES, 0),
        ListSessions=lambda r, c: map_pb2.ListSessionsReply(), FindLabels=lambda r, c: map_pb2.FindLabelsReply(),
    )  # fmt: skip
    with FakeDaemon(**methods) as daemon, relmap.connect(daemon.address) as client:
        assert [f.index for f in client.find_route("1:0", "1:2").frames] == [0, 1, 2]
        skeleton = client.skeleton()
        assert [len(chain) for chain in skeleton.chains] == [2] and skeleton.frames_total == 2
        assert "2 frames" in client.draw_map().svg
        assert [file.data for file in client.export_trajectories()] == [b"abcd"]
        assert {name: len(daemon.calls[name]) for name in methods} == {
            "FindRoute": 3, "GetSkeleton": 4, "Export": 2, "ListSessions": 1, "FindLabels": 1
        }  # fmt: skip
    always = range(1000)
    methods = dict(
        FindRoute=_expiring(_steps(), *always), GetSkeleton=_expiring(_chains(), *always),
        ListSessions=lambda r, c: map_pb2.ListSessionsReply(),
    )  # fmt: skip
    with FakeDaemon(**methods) as daemon, relmap.connect(daemon.address) as client:
        for call in (lambda: client.find_route("1:0", "1:2"), client.skeleton, client.draw_map):
            with pytest.raises(relmap.ViewExpired):
                call()


def test_a_chain_of_several_messages_is_one() -> None:
    def method(request: Any, context: Any) -> Iterator[skeleton_pb2.GetSkeletonReply]:
        for sent in ([_chain(3, 1)], [_chain(4, 2), _chain(8)], [_chain(8, 1, 1), _chain(12, 1)]):
            yield skeleton_pb2.GetSkeletonReply(chains=[skeleton_pb2.SkeletonChain(**chain) for chain in sent])

    with FakeDaemon(GetSkeleton=method) as daemon, relmap.connect(daemon.address) as client:
        skeleton = client.skeleton()
        assert [chain.index.tolist() for chain in skeleton.chains] == [[3, 4, 6], [8, 9, 10], [12, 13]]
        assert [len(c.time_ms) for c in skeleton.chains] == [3, 3, 2] and [len(c.step) for c in skeleton.chains] == [2, 2, 1]
        shown = skeleton.relaxed_picture()
        positions = shown.to_pandas()
        assert len(positions) == 8 and not positions.duplicated(["session", "index"]).any()


MALFORMED = (
    {"unmeasured": [0]}, {"carried": [2]}, {"unmeasured": [2**32 - 1]}, {"index": []}, {"index": [1, 0]},
    {"index": [2**32 - 1, 1]}, {"time_ms": [1]}, {"step": [1.0] * 5}, {"step": [float("nan")] * 6}, {"variance": [-1, 1]},
    {"variance": [1]}, {"frames": []},
)  # fmt: skip


@pytest.mark.parametrize("change", MALFORMED)
def test_a_malformed_chain_is_the_daemons_fault(change: dict[str, Any]) -> None:
    reply = skeleton_pb2.GetSkeletonReply(chains=[skeleton_pb2.SkeletonChain(**{**_chain(1, 1), **change})])
    with FakeDaemon(GetSkeleton=lambda r, c: iter([reply])) as daemon, relmap.connect(daemon.address) as client:
        with pytest.raises(relmap.DaemonError, match="the daemon's reply is malformed") as raised:
            client.skeleton()
        assert raised.value.reason == relmap.Reason.CORRUPT


def test_other_malformed_replies_are_the_daemons_fault() -> None:
    one = dict(
        ordinal=[1], session_b=[1], index_b=[2], session_a=[1], index_a=[1], state=[2], carries=[True],
        a_from_b=[0.0] * 6, variance=[1, 1], suspicion=[0], alike=[1],
    )  # fmt: skip
    closures = [{**one, **change} for change in ({"index_a": [2]}, {"alike": []}, {"a_from_b": [float("inf")] * 6})]
    skeletons = iter([skeleton_pb2.GetSkeletonReply(closures=skeleton_pb2.SkeletonClosures(**c)) for c in closures])
    steps = [map_pb2.RouteStep(frame=common_pb2.FrameId(session=1, index=i)) for i in range(2)]
    steps[0].to_next.rotation.w = 3
    bad_edge = edge(3)
    bad_edge.covariance.upper.append(1)
    methods = dict(
        ListSessions=lambda r, c: map_pb2.ListSessionsReply(sessions=[graph_pb2.Session(number=1)]),  # of 0 x 0 pixels
        ListEdges=lambda r, c: map_pb2.ListEdgesReply(edges=[bad_edge]),
        FindRoute=lambda r, c: iter([map_pb2.FindRouteReply(steps=steps)]),
        GetSkeleton=lambda r, c: iter([next(skeletons)]),
        Export=lambda r, c: iter([map_pb2.ExportReply(session=1, data=b"1.0 no numbers")]),
        WatchMap=lambda r, c: iter([watch_pb2.MapEvent(edge_changed=bad_edge)]),
    )
    with FakeDaemon(**methods) as daemon, relmap.connect(daemon.address) as client:
        for call in (
            client.sessions, client.edges, lambda: next(client.iter_edges()), lambda: client.find_route("1:0", "1:1"),
            client.skeleton, client.skeleton, client.skeleton, lambda: client.odometry(1), lambda: next(client.watch()),
        ):  # fmt: skip
            with pytest.raises(relmap.DaemonError, match="the daemon's reply is malformed") as raised:
                call()
            assert raised.value.reason == relmap.Reason.CORRUPT


def test_exported_frames_begin_again_only_while_none_was_given_out() -> None:
    frames = [map_pb2.ExportReply(resume_token="r") for _ in range(3)]
    for index, reply in enumerate(frames[1:]):
        reply.frames.add(id=common_pb2.FrameId(session=1, index=index))
    with FakeDaemon(Export=_expiring(frames[::2], 0, 1)) as daemon, relmap.connect(daemon.address) as client:
        assert [f.id.index for f in client.export_frames()] == [1]
        assert len(daemon.calls["Export"]) == 3
    with FakeDaemon(Export=_expiring(frames, 0)) as daemon, relmap.connect(daemon.address) as client:
        given = client.export_frames()
        assert next(given).id.index == 0
        with pytest.raises(relmap.ViewExpired, match="1 frames of it were given out; begin the export again"):
            next(given)


def test_an_iterator_takes_the_filters_of_the_list() -> None:
    filters: dict[str, Any] = dict(
        states=[relmap.EdgeState.ACCEPTED], kinds=[relmap.EdgeKind.LOOP], session=1, other_session=2, frame="1:3",
        since=5, until=9, min_suspicion=0.25, around="1:4", around_edges=3, around_metres=2.5,
        order=relmap.EdgeOrder.SUSPICION,
    )  # fmt: skip
    with FakeDaemon(ListEdges=Pages()) as daemon, relmap.connect(daemon.address) as client:
        assert _indices(client.edges(**filters)) == _indices(client.iter_edges(**filters))
        requests = daemon.calls["ListEdges"]
        assert requests[:3] == requests[3:] and requests[0].region.max_edges == 3 and requests[0].until_us == 9


def test_edits_are_sent_again_with_the_same_key() -> None:
    failures = iter([True, True, False])

    def set_label(request: map_pb2.SetLabelRequest, context: Any) -> map_pb2.SetLabelReply:
        if next(failures):
            context.abort(grpc.StatusCode.UNAVAILABLE, "broken")
        return map_pb2.SetLabelReply(labels=["a"])

    with FakeDaemon(SetLabel=set_label) as daemon, relmap.connect(daemon.address) as client:
        assert client.set_label("1:2", "a") == ("a",)
        keys = {request.idempotency_key for request in daemon.calls["SetLabel"]}
        assert len(daemon.calls["SetLabel"]) == 3 and len(keys) == 1 and "" not in keys


def test_what_is_wrong_is_not_sent() -> None:
    with FakeDaemon(ListEdges=Pages(), FindRoute=_route(0)) as daemon, relmap.connect(daemon.address) as client:
        for wrong in (
            lambda: client.edges(min_suspicion=float("nan")),
            lambda: client.edges(frame="nonsense"),
            lambda: client.find_route("1:2", "kitchen", max_cost=float("nan")),
            lambda: client.find_route("1:2", "kitchen", alternatives=6),
            lambda: client.find_route("1:2", "kitchen", weights=relmap.RouteWeights()),
            lambda: client.skeleton(4),
            lambda: client.localise(relmap.View(left=b"no picture")),
            lambda: client.edit_edge("1:2/1", "destroy"),
        ):
            with pytest.raises(ValueError):
                wrong()
        with pytest.raises(TypeError):
            client.localise(3.5)  # type: ignore[arg-type]
        assert set(daemon.calls) == {"GetStatus"}


def test_an_older_daemon_is_drawn_by_its_edges() -> None:
    def unimplemented(request: Any, context: Any) -> Iterator[Any]:
        if False:
            yield
        refuse(context, grpc.StatusCode.UNIMPLEMENTED, reason_pb2.REASON_UNIMPLEMENTED, "GetSkeleton")

    methods = dict(
        ListEdges=Pages(), GetSkeleton=unimplemented,
        ListSessions=lambda r, c: map_pb2.ListSessionsReply(), FindLabels=lambda r, c: map_pb2.FindLabelsReply(),
    )  # fmt: skip
    with FakeDaemon(**methods) as daemon, relmap.connect(daemon.address) as client:
        assert "10 frames" in client.draw_map().svg
