"""Pictures: they are well-formed, and nothing that the map holds becomes markup; relaxation closes cycles."""

from __future__ import annotations

import pathlib
import xml.dom.minidom
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
import relmap
from relmap import geometry
from relmap.drawing.html import _verification_text, table_html
from relmap.drawing.picture import draw_map
from relmap.drawing.style import text_width
from relmap.drawing.svg import Svg
from relmap.geometry import frozen
from relmap.graph import EdgeState, LabelledFrames
from relmap.routes import Route
from relmap.skeleton import Skeleton, SkeletonChain, SkeletonClosures

EVIL = '<script>alert(1)</script>&"\'\x00\x1b\ud800'


def _six(T: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return np.concatenate([T[:3, 3], geometry.so3_log(T[:3, :3])])


def _circle(n: int, noise: float, sessions: int = 1) -> tuple[Skeleton, np.ndarray]:  # type: ignore[type-arg]
    """A drive round a circle, whose last frame is where the first was, and a closure that says so; and its true poses."""
    rng = np.random.default_rng(2)
    true = []
    for k in range(n):
        a = 2 * np.pi * k / (n - 1)
        T = geometry.exp(np.array([0, 0, 0, 0, a, 0]))
        T[:3, 3] = [10 * np.cos(a), 0, -10 * np.sin(a)]
        true.append(T)
    steps = [geometry.inverse(a) @ b @ geometry.exp(rng.normal(0, noise, 6)) for a, b in zip(true, true[1:])]
    chains = []
    per = n // sessions
    for s in range(sessions):
        first, last = s * per, n - 1 if s == sessions - 1 else (s + 1) * per - 1
        m = last - first
        chains.append(
            SkeletonChain(
                s + 1, frozen(np.arange(first, last + 1)), frozen(np.arange(m + 1)),
                frozen(np.array([_six(T) for T in steps[first:last]])), frozen(np.full((m, 2), noise**2)),
                frozen(np.ones(m, int)), frozen(np.zeros(m, bool)), frozen(np.zeros(m, bool)),
            )
        )  # fmt: skip
    ends = [(0, n - 1)] + [(s * per - 1, s * per) for s in range(1, sessions)]

    def session_of(k: int) -> int:
        return min(k // per, sessions - 1) + 1

    relative = [geometry.inverse(true[a]) @ true[b] for a, b in ends]
    closures = SkeletonClosures(
        frozen(np.array([(session_of(a), a) for a, _ in ends])),
        frozen(np.array([(session_of(b), b) for _, b in ends])),
        frozen(np.ones(len(ends), int)),
        frozen(np.full(len(ends), int(EdgeState.ACCEPTED))),
        frozen(np.ones(len(ends), bool)),
        frozen(np.array([_six(T) for T in relative])),
        frozen(np.full((len(ends), 2), 1e-8)),
        frozen(np.zeros(len(ends))),
        frozen(np.ones(len(ends), int)),
    )
    return Skeleton(tuple(chains), closures, n, 1), np.array(true)


@pytest.mark.parametrize("sessions", [1, 3])
def test_relaxation_closes_the_circle(sessions: int) -> None:
    skeleton, true = _circle(200, 0.01, sessions)
    picture = skeleton.relaxed_picture()
    assert picture.kind == relmap.PoseKind.RELAXED_PICTURE and set(picture.parts) == {0}
    T = np.concatenate(picture.chains)
    gap = np.linalg.norm(T[-1, :3, 3] - T[0, :3, 3])
    assert gap < 0.02
    expected = np.array([geometry.inverse(true[0]) @ pose for pose in true])
    error = np.linalg.norm(T[:, :3, 3] - expected[:, :3, 3], axis=1).max()
    odometry = geometry.chain([geometry.inverse(a) @ b for a, b in zip(T, T[1:])])
    assert np.allclose(odometry[:, :3, :3] @ np.swapaxes(odometry[:, :3, :3], 1, 2), np.eye(3), atol=1e-9)
    assert error < 1.0  # metres, on a circle of 63 m with 1 cm and 0.6 degrees of noise at each of 200 steps


def test_a_true_circle_stays() -> None:
    skeleton, true = _circle(120, 1e-9)
    T = np.concatenate(skeleton.relaxed_picture().chains)
    expected = np.array([geometry.inverse(true[0]) @ pose for pose in true])
    np.testing.assert_allclose(T, expected, atol=1e-4)


def _ahead(session: int, metres: list[float], unmeasured: int = -1, carried: int = -1, variance: float = 1e-6) -> SkeletonChain:
    """A drive straight ahead, with a step of so many metres to each point but the first; that with the number `unmeasured` or
    `carried` is doubtful, and has this variance."""
    n = len(metres)
    step, var = np.zeros((n, 6)), np.full((n, 2), 1e-6)
    step[:, 2], var[[k for k in (unmeasured, carried) if k >= 0]] = metres, variance
    return SkeletonChain(
        session, frozen(np.arange(n + 1)), frozen(np.arange(n + 1)), frozen(step), frozen(var), frozen(np.ones(n, int)),
        frozen(np.arange(n) == unmeasured), frozen(np.arange(n) == carried),
    )  # fmt: skip


def _same(*places: tuple[int, int, int, int]) -> SkeletonClosures:
    """Closures that say of frames that they are at one place: session and index, twice each."""
    n, ends = len(places), np.array(places, int).reshape(-1, 4)
    return SkeletonClosures(
        frozen(ends[:, :2]), frozen(ends[:, 2:]), frozen(np.ones(n, int)), frozen(np.full(n, int(EdgeState.ACCEPTED))),
        frozen(np.ones(n, bool)), frozen(np.zeros((n, 6))), frozen(np.full((n, 2), 1e-6)), frozen(np.zeros(n)),
        frozen(np.ones(n, int)),
    )  # fmt: skip


def _z(chains: tuple[SkeletonChain, ...], closures: SkeletonClosures) -> np.ndarray:  # type: ignore[type-arg]
    """How far ahead the points of the first chain are."""
    relaxed = Skeleton(chains, closures, 100, 1).relaxed_picture()
    assert set(relaxed.parts) == {0} or len(closures) == 0
    return np.asarray(relaxed.chains[0][:, 2, 3])


def test_a_guess_counts_only_where_nothing_measured_is_beside() -> None:
    """As in C++."""
    chains = (_ahead(1, [1, 9, 1, 1], unmeasured=1, variance=1e-8), _ahead(2, [1, 1, 1, 1]))
    np.testing.assert_allclose(_z(chains, _same()), [0, 1, 10, 11, 12], atol=1e-6)
    np.testing.assert_allclose(_z(chains, _same((1, 0, 2, 0), (1, 4, 2, 4))), [0, 1, 2, 3, 4], atol=1e-3)


def test_where_the_robot_was_carried_the_closures_say() -> None:
    chains = (_ahead(1, [1, 5, 1], carried=1, variance=1e-8), _ahead(2, [1, 1, 1, 1]))
    np.testing.assert_allclose(_z(chains, _same((1, 1, 2, 1), (1, 2, 2, 4))), [0, 1, 4, 5], atol=1e-3)


def test_guesses_beside_which_nothing_was_measured_have_their_own_variances() -> None:
    """Two guesses of one way, of 2 m and 4 m; the first is three times as certain. A ride beside them says next to nothing."""
    guessed = (_ahead(1, [1, 2, 1], unmeasured=1, variance=0.1), _ahead(2, [1, 4, 1], unmeasured=1, variance=0.3))
    both = _same((1, 1, 2, 1), (1, 2, 2, 2))
    np.testing.assert_allclose(_z(guessed, both), [0, 1, 3.5, 4.5], atol=1e-2)
    ridden = (*guessed, _ahead(3, [1, 99, 1], carried=1, variance=1e-8))
    three = _same((1, 1, 2, 1), (1, 2, 2, 2), (1, 1, 3, 1), (3, 2, 1, 2))
    np.testing.assert_allclose(_z(ridden, three), [0, 1, 3.5, 4.5], atol=2e-2)


@pytest.mark.parametrize("dense, exact", [(400, 8), (5, 8), (5, 1)])
def test_chains_of_many_pieces_are_laid_out_by_what_was_measured(
    dense: int, exact: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of two drives round one circle has guesses, metres and radians off, beside which the other measured; a third drive
    elsewhere is a part of its own."""
    import relmap.network

    monkeypatch.setattr(relmap.network, "_MAX_DENSE", dense)
    monkeypatch.setattr(relmap.network, "_MAX_EXACT_DEGREE", exact)
    rng = np.random.default_rng(5)
    skeleton, true = _circle(200, 1e-6)
    drive = skeleton.chains[0]
    chains = []
    for session, guesses in ((1, np.arange(5, 199, 20)), (2, np.arange(15, 199, 20))):
        step, variance = np.array(drive.step), np.array(drive.variance)
        step[guesses], variance[guesses] = rng.normal(0, 2, (len(guesses), 6)), 1e-14
        unmeasured = np.isin(np.arange(199), guesses)
        chains.append(replace(drive, session=session, step=step, variance=variance, unmeasured=unmeasured))
    chains.insert(1, replace(_ahead(3, [1, 9, 1], unmeasured=1), session=3))
    closures = _same(*((1, k, 2, k) for k in range(2, 200, 7)))
    relaxed = Skeleton(tuple(chains), closures, 404, 1).relaxed_picture()
    assert relaxed.parts == (0, 1, 0) and [len(T) for T in relaxed.chains] == [200, 4, 200]
    np.testing.assert_allclose(relaxed.chains[1][:, 2, 3], [0, 1, 10, 11], atol=1e-6)
    expected = geometry.inverse(true[0]) @ true
    for T in (relaxed.chains[0], relaxed.chains[2]):
        np.testing.assert_allclose(T, expected, atol=0.02)


def test_parts_that_nothing_joins_are_drawn_apart() -> None:
    skeleton, _ = _circle(60, 0.01, 3)
    none = SkeletonClosures(*(frozen(getattr(skeleton.closures, f)[:0]) for f in SkeletonClosures.__slots__))
    apart = Skeleton(skeleton.chains, none, 60, 1).relaxed_picture()
    assert sorted(apart.parts) == [0, 1, 2]
    xml.dom.minidom.parseString(apart.draw().svg)


def test_the_legend_counts_what_closures_stand_for() -> None:
    skeleton, _ = _circle(60, 0.01, 4)
    states = np.array([EdgeState.ACCEPTED, EdgeState.ACCEPTED, EdgeState.CANDIDATE, EdgeState.REMOVED])
    closures = replace(skeleton.closures, state=frozen(states.astype(int)), alike=frozen(np.array([5, 1, 7, 30])))
    drawn = replace(skeleton, closures=closures).draw().svg
    assert "6 loop closures in force" in drawn and "37 others" in drawn


def test_texts_are_escaped() -> None:
    skeleton, _ = _circle(60, 0.01)
    drawing = draw_map(
        skeleton.relaxed_picture(), 600, {1: EVIL}, [LabelledFrames(EVIL, (relmap.FrameId(1, 30),))]
    )
    document = xml.dom.minidom.parseString(drawing.svg)
    assert document.getElementsByTagName("script") == [] and "<script" not in drawing.svg
    assert any("alert(1)" in "".join(n.data for n in t.childNodes) for t in document.getElementsByTagName("text"))
    svg = Svg(10, 10)
    svg.text((1, 1), EVIL, fill=EVIL)
    xml.dom.minidom.parseString(svg.finish(EVIL))
    assert "<script" not in table_html([EVIL], [{EVIL: EVIL}], 5, EVIL)


def _route(steps: int, labels: dict[int, str]) -> Route:
    """A route straight to the right, a metre a step."""
    n = steps + 1
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, 0, 3] = np.arange(n)
    return Route(
        frames=tuple(relmap.FrameId(1, k) for k in range(n)), T=T, cov=None, T_to_next=T[1:], distance_m=np.arange(n),
        time_s=np.arange(n), labels=tuple((labels[k],) if k in labels else () for k in range(n)),
        edges=tuple(relmap.EdgeId(relmap.FrameId(1, k + 1), 0) for k in range(steps)),
        kinds=(relmap.EdgeKind.ODOMETRY,) * steps, long_loop=np.zeros(steps, bool), carried=np.zeros(steps, bool),
        unmeasured=np.zeros(steps, bool), cost=1.0 * steps, long_loops=0, carried_stretches=(), unmeasured_stretches=(),
        unmeasured_m=0.0, frame_by_frame="", bound_closures=False, no_way_by_edges=False, from_view=None, to_view=None,
        shared=0.0, alternatives=(), map_version=1,
    )  # fmt: skip


@pytest.mark.parametrize("steps", [3, 40, 400])
def test_no_label_of_a_route_runs_into_the_rings_at_its_ends(steps: int) -> None:
    """Neither that of an end nor that of a frame beside it."""
    named = {0: "dock", 1: "gate", steps - 1: "hall", steps: "kitchen"}
    document = xml.dom.minidom.parseString(_route(steps, named).draw().svg)
    rings = [c for c in document.getElementsByTagName("circle") if c.getAttribute("r") == "6"]
    assert len(rings) == 2
    texts = {t.firstChild.nodeValue: t for t in document.getElementsByTagName("text")}
    assert {"dock", "kitchen"} <= texts.keys()
    for name in named.values():
        if name not in texts:
            continue  # there is no room for it
        left, baseline = (float(texts[name].getAttribute(a)) for a in ("x", "y"))
        right = left + text_width(name, 11)
        for ring in rings:
            x, y = (float(ring.getAttribute(a)) for a in ("cx", "cy"))
            away = np.hypot(max(left - x, 0, x - right), max(baseline - 9 - y, 0, y - baseline - 2))
            assert away >= 8, f"{name} is {away:.1f} points from the middle of a ring"


def test_what_was_not_verified_here_is_not_said_to_be() -> None:
    def said(verification: relmap.Verification) -> str:
        return _verification_text(
            cast(relmap.Edge, SimpleNamespace(id=relmap.EdgeId(relmap.FrameId(3, 7), 1), verification=verification, inliers=41))
        )

    assert said(relmap.Verification.PNP) == "verified by pnp: 41 inliers"
    assert said(relmap.Verification.IMPORTED) == "imported with session 3, not verified here"
    for other in (relmap.Verification.COMPOUNDED, relmap.Verification.NONE):
        assert "inliers" not in said(other) and "not verified" in said(other)


def test_an_empty_map_is_drawn() -> None:
    closures = SkeletonClosures(
        *(frozen(np.empty((0, 2), int)),) * 2, *(frozen(np.empty(0, int)),) * 3, frozen(np.empty((0, 6))),
        frozen(np.empty((0, 2))), *(frozen(np.empty(0)),) * 2,
    )  # fmt: skip
    assert "no frames" in Skeleton((), closures, 0, 1).draw().svg
    for width in (10, 5000):
        with pytest.raises(ValueError):
            Skeleton((), closures, 0, 1).draw(width)


def test_a_drawing_is_saved_as_what_it_is(tmp_path: pathlib.Path) -> None:
    drawing = _circle(60, 0.01)[0].relaxed_picture().draw()
    drawing.save(tmp_path / "map.svg")
    assert (tmp_path / "map.svg").read_text(encoding="utf-8") == drawing.svg
    with pytest.raises(ValueError, match="does not end with .svg"):
        drawing.save(tmp_path / "map.png")


def test_the_level_of_a_picture_follows_from_the_number_of_frames() -> None:
    from relmap.aio.shapes import _level_for

    assert [_level_for(frames) for frames in (0, 20_000, 20_001, 1_000_000, 10_000_000)] == [3, 3, 2, 1, 0]
