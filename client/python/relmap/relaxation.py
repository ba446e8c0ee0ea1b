"""A light relaxation of a skeleton, for pictures of the map.

The map is relative: its cycles need not close, and it has no coordinates. A picture needs some, so the errors of cycles are
spread over their edges, in proportion to their variances. Rotations are relaxed first, then positions; each is a network of
resistors (a weighted Laplacian), in which points between junctions are eliminated and found again by interpolation. Loop
closures that fit badly count less (Huber). It is a picture, not a measurement: never take distances from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Tuple

import numpy as np

from relmap.geometry import Array, PoseKind, frozen, so3_exp, so3_log
from relmap.graph import EdgeState
from relmap.ids import FrameId
from relmap.record import Record
from relmap.skeleton import Skeleton
from relmap.tables import make_table

_HUBER_SIGMAS = 3.0
_ROTATION_ROUNDS, _POSITION_ROUNDS = 6, 4
_DENSE = 1500  # junctions up to which the network is solved by one factorisation
_LEAST_VARIANCE = 1e-10
_CARRIED_VARIANCE = (1e4, 10.0)  # m^2, rad^2: what is known of a ride beside what closures measured


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RelaxedPicture(Record):
    """Positions of a skeleton's points for a picture. Parts that no edge joins are placed by themselves, each in the frame of
    its first point.

    Attributes:
        chains: of each chain float64 (n, 4, 4), T_part_frame: camera poses (x right, y down, z forward), metres.
        parts: of each chain the number of its part, from 0, the largest first.
        skeleton: what was relaxed.
    """

    chains: Tuple[Array, ...]
    parts: Tuple[int, ...]
    skeleton: Skeleton

    @property
    def kind(self) -> PoseKind:
        """What the poses are: a relaxed picture."""
        return PoseKind.RELAXED_PICTURE

    def positions(self) -> Mapping[FrameId, Array]:
        """The position (3, metres, in its part) of every kept frame."""
        return {
            FrameId(chain.session, int(index)): T[i, :3, 3]
            for chain, T in zip(self.skeleton.chains, self.chains)
            for i, index in enumerate(chain.index)
        }

    def to_pandas(self) -> Any:
        """A pandas.DataFrame with a row for each kept frame. ImportError if pandas is not installed."""
        rows = [
            (chain.session, int(index), part, *T[i, :3, 3].tolist())
            for chain, T, part in zip(self.skeleton.chains, self.chains, self.parts)
            for i, index in enumerate(chain.index)
        ]
        names = ("session", "index", "part", "x", "y", "z")
        return make_table({name: [row[k] for row in rows] for k, name in enumerate(names)})

    def draw(self, width: int = 900) -> Any:
        """Seen from above, `width` points wide; an SVG, which notebooks show."""
        from relmap.drawing.picture import draw_map

        return draw_map(self, width)

    def _repr_svg_(self) -> str:
        return str(self.draw().svg)


class _Network:
    """Resistors: edges (a, b) whose ends should differ by `want` (3), each with a variance. Solves for the values of all
    nodes by least squares; the first node of each connected part stays 0."""

    def __init__(self, nodes: int, a: Array, b: Array, fixed: Array) -> None:
        self.nodes, self.a, self.b = nodes, a, b
        self.free = np.ones(nodes, bool)
        self.free[fixed] = False
        self.place = np.cumsum(self.free) - 1

    def solve(self, want: Array, weight: Array) -> Array:
        n = int(self.free.sum())
        values = np.zeros((self.nodes, 3))
        if n == 0:
            return values
        right = np.zeros((self.nodes, 3))
        np.add.at(right, self.b, weight[:, None] * want)
        np.add.at(right, self.a, -weight[:, None] * want)
        values[self.free] = self._dense(right, weight) if n <= _DENSE else self._iterate(right, weight)
        return values

    def _dense(self, right: Array, weight: Array) -> Array:
        n = int(self.free.sum())
        L = np.zeros((n, n))
        fa, fb = self.free[self.a], self.free[self.b]
        pa, pb = self.place[self.a], self.place[self.b]
        np.add.at(L, (pa[fa], pa[fa]), weight[fa])
        np.add.at(L, (pb[fb], pb[fb]), weight[fb])
        both = fa & fb
        np.add.at(L, (pa[both], pb[both]), -weight[both])
        np.add.at(L, (pb[both], pa[both]), -weight[both])
        return np.asarray(np.linalg.solve(L, right[self.free]))

    def _iterate(self, right: Array, weight: Array) -> Array:
        """Conjugate gradients with the diagonal as preconditioner."""
        diagonal = np.bincount(self.a, weight, self.nodes) + np.bincount(self.b, weight, self.nodes)
        scale = (1.0 / diagonal[self.free])[:, None]
        x = np.zeros((int(self.free.sum()), 3))
        full = np.zeros((self.nodes, 3))

        def apply(v: Array) -> Array:
            full[self.free] = v
            flow = weight[:, None] * (full[self.b] - full[self.a])
            out = np.empty_like(full)
            for k in range(3):
                out[:, k] = np.bincount(self.b, flow[:, k], self.nodes) - np.bincount(self.a, flow[:, k], self.nodes)
            return np.asarray(out[self.free])

        r = right[self.free].copy()
        start = float(np.sum(r * r))
        z = scale * r
        p, rz = z.copy(), np.sum(r * z, axis=0)
        for _ in range(4 * len(x)):
            if np.sum(r * r) <= 1e-16 * max(start, 1e-300):
                break
            Ap = apply(p)
            alpha = rz / np.maximum(np.sum(p * Ap, axis=0), 1e-300)
            x += alpha * p
            r -= alpha * Ap
            z = scale * r
            rz, before = np.sum(r * z, axis=0), rz
            p = z + rz / np.maximum(before, 1e-300) * p
        return x


@dataclass
class _Segment:
    """A stretch of a chain between two junctions: points first..last."""

    chain: int
    first: int
    last: int
    a: int  # the junctions' numbers
    b: int


@dataclass
class _Closures:
    """The closures that count: their ends, as chain and point, and as junctions."""

    at_a: List[Tuple[int, int]]
    at_b: List[Tuple[int, int]]
    rows: Array
    a: Array
    b: Array


class _Relaxation:
    """One relaxation."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.chains = skeleton.chains
        self.T = [_chained(chain.step) for chain in self.chains]
        self._find_closures()
        self._find_junctions()
        self._find_parts()
        fixed = [next(j for j, part in enumerate(self.part_of) if part == p) for p in range(self.parts)]
        segments = self.segments
        self.network = _Network(
            self.junctions,
            np.array([s.a for s in segments] + self.closures.a.tolist(), np.intp),
            np.array([s.b for s in segments] + self.closures.b.tolist(), np.intp),
            np.array(fixed, np.intp),
        )

    def run(self) -> None:
        self._place_parts()
        for kind, rounds in ((1, _ROTATION_ROUNDS), (0, _POSITION_ROUNDS)):
            soft = np.ones(len(self.closures.rows))
            for _ in range(rounds):
                soft = self._round(kind, soft)

    # ---- What is joined to what

    def _find_closures(self) -> None:
        place: Dict[Tuple[int, int], Tuple[int, int]] = {}
        for c, chain in enumerate(self.chains):
            for i, index in enumerate(chain.index.tolist()):
                place.setdefault((chain.session, index), (c, i))
        known = self.skeleton.closures
        rows, at_a, at_b = [], [], []
        for row in range(len(known)):
            a = place.get((int(known.a[row, 0]), int(known.a[row, 1])))
            b = place.get((int(known.b[row, 0]), int(known.b[row, 1])))
            counts = known.state[row] == EdgeState.ACCEPTED and known.carries[row]
            if counts and a is not None and b is not None and a != b:
                rows.append(row)
                at_a.append(a)
                at_b.append(b)
        none = np.empty(0, np.intp)
        self.closures = _Closures(at_a, at_b, np.array(rows, np.intp), none, none)

    def _find_junctions(self) -> None:
        cuts: List[set[int]] = [{0, len(chain) - 1} for chain in self.chains]
        for c, i in self.closures.at_a + self.closures.at_b:
            cuts[c].add(i)
        # A later chain that begins where another of the same session ends is joined to it.
        number: Dict[Tuple[int, int], int] = {}
        by_frame: Dict[Tuple[int, int], int] = {}
        self.segments: List[_Segment] = []
        self.junctions = 0
        self.junction_at: List[Tuple[int, int]] = []
        for c, chain in enumerate(self.chains):
            ordered = sorted(cuts[c])
            for i in ordered:
                frame = (chain.session, int(chain.index[i]))
                if frame not in by_frame:
                    by_frame[frame] = self.junctions
                    self.junction_at.append((c, i))
                    self.junctions += 1
                number[c, i] = by_frame[frame]
            for first, last in zip(ordered, ordered[1:]):
                self.segments.append(_Segment(c, first, last, number[c, first], number[c, last]))
        self.number = number
        self.closures.a = np.array([number[at] for at in self.closures.at_a], np.intp)
        self.closures.b = np.array([number[at] for at in self.closures.at_b], np.intp)

    def _find_parts(self) -> None:
        root = list(range(self.junctions))

        def find(j: int) -> int:
            while root[j] != j:
                root[j] = root[root[j]]
                j = root[j]
            return j

        for segment in self.segments:
            root[find(segment.a)] = find(segment.b)
        for a, b in zip(self.closures.a.tolist(), self.closures.b.tolist()):
            root[find(a)] = find(b)
        size: Dict[int, int] = {}
        for c, chain in enumerate(self.chains):
            j = find(self.number[c, 0])
            size[j] = size.get(j, 0) + len(chain)
        order = {j: k for k, j in enumerate(sorted(size, key=lambda j: (-size[j], j)))}
        self.part_of = [order.get(find(j), 0) for j in range(self.junctions)]
        self.parts = len(order)

    # ---- A start: breadth first from the first chain of each part

    def _place_parts(self) -> None:
        placed: List[Optional[Array]] = [None] * self.junctions
        done = [False] * len(self.chains)
        joins: List[List[Tuple[int, Array]]] = [[] for _ in range(self.junctions)]  # closures by junction
        xi = self.skeleton.closures.a_from_b
        for k, row in enumerate(self.closures.rows.tolist()):
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = so3_exp(xi[row, 3:]), xi[row, :3]
            a, b = int(self.closures.a[k]), int(self.closures.b[k])
            joins[a].append((b, T))
            joins[b].append((a, np.linalg.inv(T)))
        chains_at: List[List[Tuple[int, int]]] = [[] for _ in range(self.junctions)]
        for (c, i), j in self.number.items():
            chains_at[j].append((c, i))
        for c in range(len(self.chains)):
            if done[c]:
                continue
            queue = [self.number[c, 0]]
            placed[queue[0]] = np.eye(4)
            for j in queue:  # grows
                here = placed[j]
                assert here is not None
                reached = [(k, here @ T) for k, T in joins[j]]
                for other, i in chains_at[j]:
                    if not done[other]:
                        done[other] = True
                        self.T[other] = here @ np.linalg.inv(self.T[other][i]) @ self.T[other]
                        reached += [
                            (self.number[other, m], self.T[other][m])
                            for m in range(len(self.chains[other]))
                            if (other, m) in self.number
                        ]
                for k, pose in reached:
                    if placed[k] is None:
                        placed[k] = pose
                        queue.append(k)

    # ---- One round: rotations (kind 1) or positions (kind 0)

    def _round(self, kind: int, soft: Array) -> Array:
        misfits, variances = [], []  # of the steps of each chain
        for c, chain in enumerate(self.chains):
            misfits.append(self._misfits(kind, self.T[c][:-1], self.T[c][1:], chain.step))
            variance = np.maximum(chain.variance[:, kind], _LEAST_VARIANCE)
            variance = np.where(chain.carried, np.maximum(variance, _CARRIED_VARIANCE[kind]), variance)
            variances.append(variance)
        sums = [np.vstack([np.zeros(3), np.cumsum(m, axis=0)]) for m in misfits]
        ohms = [np.concatenate([[0.0], np.cumsum(v)]) for v in variances]
        want = [sums[s.chain][s.last] - sums[s.chain][s.first] for s in self.segments]
        weight = [1.0 / (ohms[s.chain][s.last] - ohms[s.chain][s.first]) for s in self.segments]
        rows = self.closures.rows
        if len(rows):
            Ta = np.stack([self.T[c][i] for c, i in self.closures.at_a])
            Tb = np.stack([self.T[c][i] for c, i in self.closures.at_b])
            known = self.skeleton.closures
            apart = self._misfits(kind, Ta, Tb, known.a_from_b[rows])
            variance = np.maximum(known.variance[rows, kind], _LEAST_VARIANCE)
            want += list(apart)
            weight += list(soft / variance)
        if not want:
            return soft
        change = self.network.solve(np.array(want), np.array(weight))
        self._apply(kind, change, sums, ohms)
        if not len(rows):
            return soft
        left = apart - (change[self.closures.b] - change[self.closures.a])
        sigmas = np.sqrt(np.sum(left * left, axis=1) / variance)
        return np.asarray(np.minimum(1.0, _HUBER_SIGMAS / np.maximum(sigmas, 1e-12)))

    def _misfits(self, kind: int, Ta: Array, Tb: Array, xi: Array) -> Array:
        """By how much b should move against a, in the part's coordinates, so that the edge fits (n, 3)."""
        if len(xi) == 0:
            return np.empty((0, 3))
        if kind == 0:
            return np.asarray(np.einsum("nij,nj->ni", Ta[:, :3, :3], xi[:, :3]) - (Tb[:, :3, 3] - Ta[:, :3, 3]))
        should = Ta[:, :3, :3] @ np.stack([so3_exp(x) for x in xi[:, 3:]])
        turn = should @ np.swapaxes(Tb[:, :3, :3], 1, 2)
        return np.stack([so3_log(R) for R in turn])

    def _apply(self, kind: int, change: Array, sums: List[Array], ohms: List[Array]) -> None:
        for segment in self.segments:
            c, first, last = segment.chain, segment.first, segment.last
            share = (ohms[c][first : last + 1] - ohms[c][first]) / (ohms[c][last] - ohms[c][first])
            own = sums[c][first : last + 1] - sums[c][first]
            across = change[segment.b] - change[segment.a] - own[-1]
            moved = change[segment.a] + own + share[:, None] * across
            begin = 0 if first == 0 else 1  # the junction between two segments moves once
            for i in range(begin, last - first + 1):
                T = self.T[c][first + i]
                if kind == 0:
                    T[:3, 3] += moved[i]
                else:
                    T[:3, :3] = so3_exp(moved[i]) @ T[:3, :3]
        for c, chain in enumerate(self.chains):
            if len(chain) == 1:
                T = self.T[c][0]
                if kind == 0:
                    T[:3, 3] += change[self.number[c, 0]]
                else:
                    T[:3, :3] = so3_exp(change[self.number[c, 0]]) @ T[:3, :3]


def _chained(steps: Array) -> Array:
    out = np.tile(np.eye(4), (len(steps) + 1, 1, 1))
    for i, step in enumerate(steps):
        R, t = out[i, :3, :3], out[i, :3, 3]
        out[i + 1, :3, :3] = R @ so3_exp(step[3:])
        out[i + 1, :3, 3] = R @ step[:3] + t
    return out


def relaxed_picture(skeleton: Skeleton) -> RelaxedPicture:
    """Positions of a skeleton's points for a picture: cycles are bent until they close. Not a measurement."""
    work = _Relaxation(skeleton)
    work.run()
    parts = tuple(work.part_of[work.number[c, 0]] for c in range(len(skeleton.chains)))
    return RelaxedPicture(tuple(frozen(T) for T in work.T), parts, skeleton)
