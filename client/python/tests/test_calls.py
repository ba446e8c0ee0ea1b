"""Every RPC is reached by a method of the client, blocking and for asyncio."""

from __future__ import annotations

import asyncio
import inspect
from typing import Any, Awaitable, Callable, Dict, Tuple

import numpy as np
import points_world
import pytest
import relmap
import relmap.aio
from conftest import PATIENCE_S, Daemon
from relmap.requests import ImportedLoop
from relmap.v1 import admin_pb2, ingest_pb2, map_pb2

LOOP = "2:5/1"  # a closure of the fixture's map


def _graph(client: Any) -> Any:
    T = np.tile(np.eye(4), (6, 1, 1))
    T[:, 2, 3] = np.arange(6)
    return client.import_graph(
        "11111111-2222-4333-8444-555555555555", T, 1_700_000_000_000_000 + np.arange(6) * 10**6, robot="other",
        name="imported", step_cov=np.tile(points_world.STEP_COV, (6, 1, 1)), driven_us=np.full(6, 10**6),
        loops=[ImportedLoop(5, 0, np.eye(4), np.eye(6) * 1e-3)],
    )  # fmt: skip


def _session(client: Any) -> Any:
    return client.session("cart", points_world.CAMERA, name="a session without keyframes")


# Of every RPC: the method that calls it, and a call that the fixture's map can answer. The second is the reason with which
# the daemon refuses it.
CALLS: Dict[str, Tuple[str, Callable[[Any, str], Any], str]] = {
    "Map.Localise": ("localise", lambda c, f: c.localise(relmap.FrameId(2, 8), prior="1:28"), ""),
    "Map.MatchImage": ("match_image", lambda c, f: c.match_image(relmap.FrameId(2, 8), max_places=3), ""),
    "Map.FindRoute": ("find_route", lambda c, f: c.find_route("2:30", "kitchen", covariance=True, alternatives=1), ""),
    "Map.GetNeighbourhood": ("neighbourhood", lambda c, f: c.neighbourhood("1:40", landmarks=True), ""),
    "Map.TransformBetween": ("transform_between", lambda c, f: c.transform_between("1:3", "2:30"), ""),
    "Map.GetFrame": (
        "frame",
        lambda c, f: c.frame("1:5", landmarks=True, observations=True, appearance=True, thumbnail=True, picture=True),
        "",
    ),
    "Map.ListSessions": ("sessions", lambda c, f: c.sessions(), ""),
    "Map.ListEdges": ("edges", lambda c, f: c.edges(session=2, other_session=1), ""),
    "Map.ExplainEdge": ("explain_edge", lambda c, f: c.explain_edge(LOOP, pictures=True), ""),
    "Map.GetClosureMatrix": ("closure_matrix", lambda c, f: c.closure_matrix(), ""),
    "Map.GetSkeleton": ("skeleton", lambda c, f: c.skeleton(2), ""),
    "Map.SetEdgeState": ("edit_edge", lambda c, f: c.edit_edge(LOOP, "remove_alone", dry_run=True), ""),
    "Map.ProposeEdge": ("propose_edge", lambda c, f: c.propose_edge("1:3", "1:4"), "INVALID_ARGUMENT"),
    "Map.SetLabel": ("set_label", lambda c, f: c.set_label("1:10", "kitchen"), ""),
    "Map.ImportGraph": ("import_graph", lambda c, f: _graph(c), ""),
    "Map.FindLabels": ("labels", lambda c, f: c.labels("k"), ""),
    "Map.WatchMap": ("watch", lambda c, f: c.watch(oldest=True), ""),
    "Map.ListRobots": ("robots", lambda c, f: c.robots(), ""),
    "Map.GetStatus": ("status", lambda c, f: c.status(), ""),
    "Map.Export": ("export_trajectories", lambda c, f: c.export_trajectories(sessions=[1]), ""),
    "Admin.Verify": ("verify", lambda c, f: c.verify(), ""),
    "Admin.Repair": ("repair", lambda c, f: c.repair(), "FOLDER_LOCKED"),
    "Admin.Backup": ("backup", lambda c, f: c.backup(f), ""),
    "Admin.Compact": ("compact", lambda c, f: c.compact(), ""),
    "Admin.Reindex": ("reindex", lambda c, f: c.reindex(), "FOLDER_LOCKED"),
    "Admin.GetStats": ("stats", lambda c, f: c.stats(), ""),
    "Admin.WaitIdle": ("wait_idle", lambda c, f: c.wait_idle(), ""),
    "Admin.Commit": ("commit", lambda c, f: c.commit(), ""),
    "Admin.SetLogLevel": ("set_log_level", lambda c, f: c.set_log_level(), ""),
    "Admin.FreezeSession": ("freeze_session", lambda c, f: c.freeze_session(1, False), "WRONG_STATE"),
    "Admin.DeleteSession": ("delete_session", lambda c, f: c.delete_session(1, "no uuid of it"), "INVALID_ARGUMENT"),
    "Admin.ListAudit": ("audit", lambda c, f: c.audit(limit=5), ""),
    "Ingest.Stream": ("session", lambda c, f: _session(c), ""),
    "Ingest.GetAcknowledgement": ("acknowledgement", lambda c, f: c.acknowledgement(bytes(range(16))), "NO_SUCH_SESSION"),
}


def _methods() -> list[str]:
    services = [map_pb2.DESCRIPTOR, admin_pb2.DESCRIPTOR, ingest_pb2.DESCRIPTOR]
    return [
        f"{name}.{method.name}"
        for file in services
        for name, service in file.services_by_name.items()
        for method in service.methods
    ]


def test_every_rpc_has_a_method_and_a_call() -> None:
    assert sorted(CALLS) == sorted(_methods())
    for method, _, _ in CALLS.values():
        assert callable(getattr(relmap.Client, method)) and callable(getattr(relmap.aio.AsyncClient, method))


def test_both_clients_have_the_same_methods() -> None:
    def signatures(kind: type) -> Dict[str, str]:
        public = inspect.getmembers(kind, lambda m: inspect.isfunction(m) and not m.__name__.startswith("_"))
        return {name: str(inspect.signature(m)).split(" -> ")[0] for name, m in public}

    assert signatures(relmap.Client) == signatures(relmap.aio.AsyncClient)
    assert set(signatures(relmap.IngestSession)) == set(signatures(relmap.aio.AsyncIngestSession))


def _blocking(daemon: Daemon, call: Callable[[Any, str], Any], folder: str) -> Any:
    with relmap.connect(daemon.server, timeout=PATIENCE_S) as client:
        result = call(client, folder)
        if inspect.isgenerator(result):
            return next(result)
        if isinstance(result, relmap.IngestSession):
            with result as session:
                return session.flush()
        return result


def _asynchronous(daemon: Daemon, call: Callable[[Any, str], Any], folder: str) -> Any:
    async def run() -> Any:
        async with await relmap.aio.connect(daemon.server, timeout=PATIENCE_S) as client:
            result = call(client, folder)
            if inspect.isasyncgen(result):
                first = await result.__anext__()
                await result.aclose()
                return first
            if isinstance(result, relmap.aio.AsyncIngestSession):
                async with result as session:
                    return await session.flush()
            assert isinstance(result, Awaitable)
            return await result

    return asyncio.run(run())


@pytest.mark.parametrize("run", [_blocking, _asynchronous])
@pytest.mark.parametrize("rpc", sorted(CALLS))
def test_every_rpc_is_reached(daemon: Daemon, tmp_path: Any, rpc: str, run: Callable[..., Any]) -> None:
    _, call, refused = CALLS[rpc]
    folder = str(daemon.data.parent / f"backup-{run.__name__}")
    if refused:
        with pytest.raises(relmap.RelmapError) as raised:
            run(daemon, call, folder)
        assert raised.value.reason.name == refused, raised.value
        assert raised.value.request_id
    else:
        run(daemon, call, folder)


# ---- What the answers are like


def test_a_place_is_found_where_it_is(client: relmap.Client) -> None:
    *_, step = points_world.drive(11, start=300 + 27)  # the same place, on another lap, with other noise
    view = relmap.View(features=step.features, camera=points_world.CAMERA)
    place = client.localise(view)
    assert place.kind == relmap.PoseKind.RELATIVE and place.inliers > 20
    assert place.T.shape == (4, 4) and place.cov.shape == (6, 6) and np.linalg.eigvalsh(place.cov).min() > 0
    truth = points_world.pose(2 * np.pi * 37 / 60, 3.0)
    expected = {1: place.frame.index, 2: place.frame.index + 20}[place.frame.session]
    frame = points_world.pose(2 * np.pi * expected / 60, 3.0)
    np.testing.assert_allclose(place.T[:3, 3], (np.linalg.inv(frame) @ truth)[:3, 3], atol=0.05)
    near = client.localise(view, prior=place.frame)
    assert near.near_prior and near.frame.session in (1, 2)
    matches = client.match_image(view)
    assert matches.reason == relmap.Reason.OK and matches[0].verification != relmap.Verification.NONE
    assert len(matches.to_pandas()) == len(matches)


def test_arrays_that_were_given_out_cannot_be_written(client: relmap.Client) -> None:
    route = client.find_route("1:2", "2:35", covariance=True)
    frame = client.frame("1:5", landmarks=True, observations=True, appearance=True)
    assert frame.landmarks is not None and frame.observations is not None and frame.features is not None
    around = client.neighbourhood("1:40", landmarks=True)
    assert route.cov is not None
    for array in (
        route.T, route.cov, route.T_to_next, route.distance_m, frame.T_odom_frame, frame.landmarks.points,
        frame.observations.u_left, frame.features.sift, around.T, around.landmarks[0], frame.edges[0].T_ab,
    ):  # fmt: skip
        assert not array.flags.writeable
        with pytest.raises(ValueError):
            array[...] = 0


def test_a_route_fits_together(client: relmap.Client) -> None:
    route = client.find_route("1:2", relmap.Label("fountain <b>&"), covariance=True)
    n = len(route)
    assert route.T.shape == (n, 4, 4) and route.T_to_next.shape == (n - 1, 4, 4) and len(route.edges) == n - 1
    np.testing.assert_allclose(route.T[0], np.eye(4), atol=1e-12)
    np.testing.assert_allclose(route.T[:-1] @ route.T_to_next, route.T[1:], atol=1e-6)
    plain = client.find_route("1:2", "fountain <b>&")
    np.testing.assert_allclose(plain.T, route.T, atol=1e-6)
    assert plain.cov is None and route.length_m > 0 and "fountain <b>&" in route.labels[-1]
    assert list(route.to_pandas().frame) == [str(f) for f in route.frames]
    assert "<svg" in route._repr_svg_()
    between = client.transform_between(route.frames[0], route.frames[-1])
    np.testing.assert_allclose(between.T, route.T[-1], atol=0.1)


def test_odometry_is_a_trajectory(client: relmap.Client) -> None:
    trajectory = client.odometry(1)
    assert trajectory.kind == relmap.PoseKind.ODOMETRY and trajectory.T.shape == (80, 4, 4)
    edges = {e.b.index: e for e in client.edges(session=1, kinds=[relmap.EdgeKind.ODOMETRY])}
    step = relmap.geometry.inverse(trajectory.T[9]) @ trajectory.T[10]
    np.testing.assert_allclose(step, edges[10].T_ab, atol=1e-5)
    assert abs(trajectory.time_us[3] - client.frame("1:3").time_us) <= 1
    files = client.export_trajectories(relmap.ExportFormat.KITTI, [1, 2])
    assert [file.session for file in files] == [1, 2] and len(files[0].data.splitlines()) == 80
    frames = list(client.export_frames([1], landmarks=True))
    assert [f.id.index for f in frames] == list(range(80)) and sum(len(f.landmarks) for f in frames) > 100


def test_lists_are_tables(client: relmap.Client) -> None:
    sessions = client.sessions()
    assert sessions.named("morning").number == 1 and len(sessions.to_pandas()) == len(sessions)
    with pytest.raises(KeyError):
        sessions.named("nobody")
    edges = client.edges(session=2, other_session=1, kinds=[relmap.EdgeKind.LOOP])
    assert edges and all({e.a.session, e.b.session} == {1, 2} for e in edges)
    assert {"id", "suspicion", "inliers"} <= set(edges.to_pandas().columns)
    assert list(client.iter_edges(page_size=7)) == list(client.edges())
    assert client.edges(session=1, states=[relmap.EdgeState.REMOVED]).to_pandas().empty
    assert [label.label for label in client.labels()] == ["fountain <b>&", "kitchen"]
    worst = client.edges(order=relmap.EdgeOrder.SUSPICION)
    measured = [e.measured for e in worst]
    assert all(m is not None and m.T_ab.shape == (4, 4) and m.cov.shape == (6, 6) for m in measured)
    assert any(m is not None and not np.allclose(m.T_ab, e.T_ab) for m, e in zip(measured, worst)), "nothing is refined"
    doubts = [e.suspicion.value for e in worst if e.suspicion]
    assert doubts == sorted(doubts, reverse=True) and len(doubts) == len(worst)


def test_pandas_is_optional(client: relmap.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="python3-pandas"):
        client.sessions().to_pandas()


def test_a_closure_is_explained_and_judged(client: relmap.Client) -> None:
    matrix = client.closure_matrix([2])
    sessions, counts = matrix.counts()
    assert 2 in sessions and counts.sum() > 0 and (counts == counts.T).all()
    why = client.explain_edge(LOOP, pictures=True)
    assert why.edge.kind == relmap.EdgeKind.LOOP and why.motion is not None
    assert len(why.correspondences) > 0 and why.correspondences.view.shape == (len(why.correspondences), 2)
    assert "<svg" in why.draw_pair().svg and "inliers" in why._repr_html_()
    with pytest.raises(ValueError):
        client.explain_edge(LOOP).draw_pair()
    dry = client.edit_edge(LOOP, relmap.EdgeAction.REMOVE, dry_run=True)
    assert not dry.done and dry.shown and dry.changes and "would change" in dry._repr_html_()
    done = client.edit_edge(LOOP, "remove", shown=dry.shown, note="a test")
    assert done.done and done.edge.state == relmap.EdgeState.REMOVED
    assert [c.id for c in done.changes] == [c.id for c in dry.changes]
    with pytest.raises(relmap.ClosureStateError):
        client.edit_edge(LOOP, "remove")
    back = client.edit_edge(LOOP, "restore")
    assert back.edge.in_force
    history = client.explain_edge(LOOP).edge.history
    assert any(event.note == "a test" for event in history)


def test_each_group_of_reasons_is_an_exception(client: relmap.Client) -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(relmap.RequestError) as request:
        client.frame("9:9")
    assert request.value.reason == relmap.Reason.NO_SUCH_FRAME and "9:9" in request.value.message
    with pytest.raises(relmap.PlaceNotRecognised):
        n = 200
        strange = relmap.Features(
            rng.uniform(0, 500, n), rng.uniform(0, 380, n), np.full(n, 9.0), np.zeros(n),
            rng.integers(0, 60, (n, 128), dtype=np.uint8),
        )  # fmt: skip
        client.localise(relmap.View(features=strange, camera=points_world.CAMERA))
    with pytest.raises(relmap.RequestError):
        client.set_label("1:1", "x" * 100)
    with pytest.raises(relmap.ClosureStateError):
        client.edit_edge("1:5/0", "remove")
    with pytest.raises(relmap.DaemonError) as locked:
        client.repair()
    assert "relmap-admin repair" in locked.value.message
    with pytest.raises(relmap.DeadlineExceeded):
        client.verify(timeout=1e-6)
    with pytest.raises(relmap.RequestError):
        client.localise(b"\xff\xd8\xff damaged")


def test_a_pair_whose_rows_are_apart_is_told(client: relmap.Client) -> None:
    rng = np.random.default_rng(4)
    blocks = np.kron(rng.integers(0, 256, (60, 80)), np.ones((8, 8)))
    left = np.clip(blocks + rng.normal(0, 4, blocks.shape), 0, 255).astype(np.uint8)[:384, 64:576]
    right = np.clip(blocks + rng.normal(0, 4, blocks.shape), 0, 255).astype(np.uint8)[9:393, 76:588]
    with pytest.raises(relmap.CameraError) as raised:
        client.localise(left, right, camera=points_world.CAMERA)
    assert raised.value.reason == relmap.Reason.ROWS_APART


def test_progress_can_end_the_work(client: relmap.Client) -> None:
    seen = []

    class Enough(Exception):
        pass

    def stop(progress: Any) -> None:
        seen.append(progress)
        raise Enough

    try:
        client.compact(on_progress=stop)
    except Enough:
        assert seen
    assert client.status().version  # the client is as it was


def test_an_address_that_nobody_serves_is_told(tmp_path: Any) -> None:
    with pytest.raises(relmap.Unreachable, match="no daemon serves"):
        relmap.connect(tmp_path)
    with pytest.raises(relmap.Unreachable, match="nothing answers at 127.0.0.1:9"):
        relmap.connect("127.0.0.1:9", timeout=5)
    with pytest.raises(relmap.RequestError, match="neither a data folder that exists nor HOST:PORT"):
        relmap.connect("nowhere")
    (tmp_path / "endpoint").write_text("socket /nowhere/socket\npid 7\nboot 0a\n")
    with pytest.raises(relmap.Unreachable, match="written by process 7"):
        relmap.connect(tmp_path)
    for wrong in ({"timeout": 0}, {"request_id": "a b"}, {"token": "t"}, {"tls": True}):
        with pytest.raises(ValueError):
            relmap.connect("localhost:1", **wrong)


def test_the_map_is_drawn(client: relmap.Client) -> None:
    drawing = client.draw_map()
    assert "morning" in drawing.svg and "fountain &lt;b&gt;&amp;" in drawing.svg and "Not for measuring" in drawing.svg
    closures = client.edges(kinds="loop", states="accepted")
    assert len(client.skeleton(1).closures) < len(closures)  # a drawn one stands for several
    assert f"{len(closures)} loop closures in force" in client.draw_map(level=1).svg
    skeleton = client.skeleton(3, candidates=True)
    assert skeleton.frames_total >= 120 and len(skeleton.closures) > 0
    truth = np.array([points_world.pose(2 * np.pi * k / 60, 3.0) for k in range(80)])
    positions = client.skeleton(3, sessions=[1]).relaxed_picture().positions()
    start = np.linalg.inv(truth[0])
    apart = [np.linalg.norm(positions[relmap.FrameId(1, k)] - (start @ truth[k])[:3, 3]) for k in range(80)]
    assert max(apart) < 0.3
