"""The shape of the map, contracted for drawing: chains of a session's frames, and the closures between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Iterable, Sequence

import numpy as np

from relmap.errors import reads_reply
from relmap.geometry import Array, frozen, so3_log
from relmap.graph import Edge, EdgeKind
from relmap.ids import EdgeId, FrameId
from relmap.record import Record
from relmap.v1 import skeleton_pb2

if TYPE_CHECKING:
    from relmap.drawing.picture import Drawing
    from relmap.relaxation import RelaxedPicture


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SkeletonChain(Record):
    """Kept frames of one session that motion joins: n points, one element each in every array.

    Attributes:
        session: their session.
        index: int64 (n,), ascending.
        time_ms: int64 (n,), milliseconds UTC.
        step: float64 (n - 1, 6), T_before_this as translation in metres and rotation vector in radians.
        variance: float64 (n - 1, 2), traces of the covariance of translation (m^2) and rotation (rad^2) of each step.
        frames: int64 (n - 1,), number of frames contracted into each step.
        unmeasured, carried: bool (n - 1,), a part of the step is a guess; the robot was carried.
    """

    session: int
    index: Array
    time_ms: Array
    step: Array
    variance: Array
    frames: Array
    unmeasured: Array
    carried: Array

    def __len__(self) -> int:
        return len(self.index)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SkeletonClosures(Record):
    """Loop closures of a skeleton: n, one element each in every array.

    Attributes:
        a: int64 (n, 2), session and index of the older end.
        b: int64 (n, 2), session and index of the newer end.
        ordinal: int64 (n,), with `b` the closure's id.
        state: int64 (n,), an EdgeState each.
        carries: bool (n,), it is an edge of the graph.
        a_from_b: float64 (n, 6), T_ab as translation in metres and rotation vector in radians.
        variance: float64 (n, 2), traces of the covariance of translation (m^2) and rotation (rad^2).
        suspicion: float64 (n,), 0..1.
        alike: int64 (n,), closures that this one stands for, itself included.
    """

    a: Array
    b: Array
    ordinal: Array
    state: Array
    carries: Array
    a_from_b: Array
    variance: Array
    suspicion: Array
    alike: Array

    def __len__(self) -> int:
        return len(self.ordinal)

    def id(self, i: int) -> EdgeId:
        """The identity of the i-th closure."""
        return EdgeId(FrameId(int(self.b[i, 0]), int(self.b[i, 1])), int(self.ordinal[i]))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Skeleton(Record):
    """The shape of the map, or of some sessions, of one version.

    Attributes:
        chains: kept frames, by session and index.
        closures: between kept frames.
        frames_total: number of frames that it stands for.
        map_version: of the map that it shows.
    """

    chains: tuple[SkeletonChain, ...]
    closures: SkeletonClosures
    frames_total: int
    map_version: int

    def relaxed_picture(self) -> "RelaxedPicture":
        """Positions for a picture: cycles are bent until they close. Never measure distances in it."""
        from relmap.relaxation import relaxed_picture

        return relaxed_picture(self)

    def draw(self, width: int = 900) -> "Drawing":
        """The map seen from above, `width` points wide; an SVG, which notebooks show."""
        from relmap.drawing.picture import draw_map

        return draw_map(self.relaxed_picture(), width)

    def _repr_svg_(self) -> str:
        return self.draw().svg


def _undelta(values: Iterable[int]) -> Array:
    return np.cumsum(np.fromiter(values, np.int64))


def _marked(places: Iterable[int], steps: int) -> Array:
    marked = np.zeros(steps, bool)
    for place in places:
        if not 1 <= place <= steps:
            raise ValueError(f"point {place} of a chain of {steps + 1} points is marked; must be 1..{steps}")
        marked[place - 1] = True
    return frozen(marked)


def _numbers(what: str, values: Iterable[float], rows: int, columns: int) -> Array:
    numbers = np.array(values, float).reshape(rows, columns)
    if not np.isfinite(numbers).all() or (what == "variance" and (numbers < 0).any()):
        raise ValueError(f"a {what} that is none")
    return frozen(numbers)


@reads_reply
def read_chain(message: skeleton_pb2.SkeletonChain) -> SkeletonChain:
    """The chain of a message. DaemonError: CORRUPT: its arrays do not fit together."""
    index = _undelta(message.index)
    steps = len(index) - 1
    if steps < 0 or 0 in message.index[1:] or index[-1] >= 2**32:
        raise ValueError("the indices of a chain do not ascend")
    return SkeletonChain(
        message.session,
        frozen(index),
        frozen(_undelta(message.time_ms).reshape(steps + 1)),
        _numbers("step", message.step, steps, 6),
        _numbers("variance", message.variance, steps, 2),
        frozen(np.array(message.frames, np.int64).reshape(steps)),
        _marked(message.unmeasured, steps),
        _marked(message.carried, steps),
    )


def _follows(before: SkeletonChain, chain: SkeletonChain) -> bool:
    return before.session == chain.session and bool(before.index[-1] == chain.index[0])


def _joined(pieces: Sequence[SkeletonChain]) -> SkeletonChain:
    if len(pieces) == 1:
        return pieces[0]

    def points(name: str) -> Array:
        return frozen(np.concatenate([getattr(piece, name)[k > 0 :] for k, piece in enumerate(pieces)]))

    def steps(name: str) -> Array:
        return frozen(np.concatenate([getattr(piece, name) for piece in pieces]))

    return SkeletonChain(
        pieces[0].session, points("index"), points("time_ms"), steps("step"), steps("variance"), steps("frames"),
        steps("unmeasured"), steps("carried"),
    )  # fmt: skip


def joined_chains(chains: Iterable[SkeletonChain]) -> tuple[SkeletonChain, ...]:
    """The chains of consecutive messages, of which one that goes over several is one: there the first point of the later
    part is the last of the part before."""
    pieces: list[list[SkeletonChain]] = []
    for chain in chains:
        if pieces and _follows(pieces[-1][-1], chain):
            pieces[-1].append(chain)
        else:
            pieces.append([chain])
    return tuple(_joined(whole) for whole in pieces)


@reads_reply
def read_closures(messages: Iterable[skeleton_pb2.SkeletonClosures]) -> SkeletonClosures:
    """The closures of messages, joined. DaemonError: CORRUPT: their arrays do not fit together."""
    joined = skeleton_pb2.SkeletonClosures()
    for message in messages:
        joined.MergeFrom(message)
    n = len(joined.ordinal)

    def whole(values: Iterable[int]) -> Array:
        return frozen(np.fromiter(values, np.int64).reshape(n))

    a = np.stack([whole(joined.session_a), whole(joined.index_a)], axis=1)
    b = np.stack([whole(joined.session_b), whole(joined.index_b)], axis=1)
    if (a == b).all(axis=1).any():
        raise ValueError("a closure of a frame with itself")
    return SkeletonClosures(
        frozen(a),
        frozen(b),
        whole(joined.ordinal),
        whole(joined.state),
        frozen(np.array(joined.carries, bool).reshape(n)),
        _numbers("transform", joined.a_from_b, n, 6),
        _numbers("variance", joined.variance, n, 2),
        frozen(np.array(joined.suspicion, float).reshape(n)),
        whole(joined.alike),
    )


def _six(edges: Sequence[Edge]) -> Array:
    T = np.array([edge.T_ab for edge in edges], float).reshape(-1, 4, 4)
    return np.concatenate([T[:, :3, 3], so3_log(T[:, :3, :3])], axis=1)


def _traces(edge: Edge) -> tuple[float, float]:
    return float(np.trace(edge.cov[:3, :3])), float(np.trace(edge.cov[3:, 3:]))


def _chain_of(session: int, edges: list[Edge], times: dict[FrameId, int]) -> SkeletonChain:
    frames = [edges[0].a] + [edge.b for edge in edges]
    return SkeletonChain(
        session,
        frozen(np.array([frame.index for frame in frames], np.int64)),
        frozen(np.array([times.get(frame, 0) // 1000 for frame in frames], np.int64)),
        frozen(_six(edges)),
        frozen(np.array([_traces(edge) for edge in edges])),
        frozen(np.ones(len(edges), np.int64)),
        frozen(np.array([edge.unmeasured for edge in edges], bool)),
        frozen(np.array([bool(edge.carried_by) for edge in edges], bool)),
    )


def _newer_end(edge: Edge) -> FrameId:
    return edge.b


def skeleton_of_edges(edges: Iterable[Edge], map_version: int = 0) -> Skeleton:
    """The skeleton of all frames that these edges join, uncontracted: of a neighbourhood, or of a whole small map."""
    motion: list[Edge] = []
    loops: list[Edge] = []
    for edge in edges:
        (loops if edge.kind == EdgeKind.LOOP else motion).append(edge)
    motion.sort(key=_newer_end)
    times = {edge.b: edge.time_us for edge in motion}
    chains: list[SkeletonChain] = []
    run: list[Edge] = []
    for edge in motion:
        if run and edge.a != run[-1].b:
            chains.append(_chain_of(run[0].b.session, run, times))
            run = []
        run.append(edge)
    if run:
        chains.append(_chain_of(run[0].b.session, run, times))
    metric = [edge for edge in loops if np.any(edge.cov)]
    closures = SkeletonClosures(
        frozen(np.array([(e.a.session, e.a.index) for e in metric], np.int64).reshape(-1, 2)),
        frozen(np.array([(e.b.session, e.b.index) for e in metric], np.int64).reshape(-1, 2)),
        frozen(np.array([e.id.ordinal for e in metric], np.int64)),
        frozen(np.array([int(e.state) for e in metric], np.int64)),
        frozen(np.array([e.carries for e in metric], bool)),
        frozen(_six(metric)),
        frozen(np.array([_traces(e) for e in metric], float).reshape(-1, 2)),
        frozen(np.array([e.suspicion.value if e.suspicion else 0.0 for e in metric], float)),
        frozen(np.ones(len(metric), np.int64)),
    )
    return Skeleton(tuple(chains), closures, sum(len(chain) for chain in chains), map_version)
