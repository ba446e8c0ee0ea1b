"""A light relaxation of a skeleton, for pictures of the map.

The map is relative: its cycles need not close, and it has no coordinates. A picture needs some, so the errors of cycles are
spread over their edges, in proportion to their variances. Rotations are relaxed first, then positions; each is a network of
resistors (a weighted Laplacian). Loop closures that fit badly count less (Huber).

Measured steps, and closures that are edges of the graph and in force, count with their variances. A doubtful step, which
nothing measured or along which the robot was carried, counts only where no measured edges connect its ends: a guess with its
own variance, a ride next to nothing. C++ counts the same (client/springs.h).

It is a picture, not a measurement: never take distances from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Tuple

import numpy as np

from relmap.geometry import Array, PoseKind, frozen, so3_exp, so3_log
from relmap.graph import EdgeState
from relmap.ids import FrameId
from relmap.network import Network
from relmap.record import Record
from relmap.skeleton import Skeleton, SkeletonChain
from relmap.tables import make_table

_HUBER_SIGMAS = 3.0
_ROTATION_ROUNDS, _POSITION_ROUNDS = 6, 4
_LEAST_VARIANCE = 1e-10
_CARRIED_VARIANCE = (3e4, 3.0)  # m^2, rad^2: of a ride, next to nothing beside what closures measured


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


class _Relaxation:
    """One relaxation. The points of all chains lie one after another. Pieces are chains, or parts of chains between doubtful
    steps that do not count; piece p has the points from begin[p] to begin[p + 1]."""

    def __init__(self, skeleton: Skeleton) -> None:
        chains = skeleton.chains
        self.chain_begin = np.concatenate([[0], np.cumsum([len(chain) for chain in chains], dtype=np.int64)])
        points = int(self.chain_begin[-1])
        chain_of = np.repeat(np.arange(len(chains)), np.diff(self.chain_begin))
        self.is_step = chain_of[1:] == chain_of[:-1]
        self.step, self.step_variance = np.zeros((points - 1, 6)), np.ones((points - 1, 2))
        doubtful = np.zeros(points - 1, bool)
        if self.is_step.any():
            self.step[self.is_step] = np.concatenate([chain.step for chain in chains])
            self.step_variance[self.is_step] = np.concatenate([_variances(chain) for chain in chains])
            doubtful[self.is_step] = np.concatenate([chain.unmeasured | chain.carried for chain in chains])
        self._find_closures(skeleton)
        self.is_step &= self._pull(doubtful)
        begins = np.flatnonzero(np.concatenate([[True], ~self.is_step]))
        self.begin = np.append(begins, points)
        self.piece_of = np.repeat(np.arange(len(begins)), np.diff(self.begin))
        self.part_of, first_of_part = self._find_parts()
        self.fixed = self.begin[first_of_part]
        self.T = self._place_parts(doubtful, self.fixed)

    @property
    def chain_parts(self) -> Tuple[int, ...]:
        """Of each chain its part; the pieces of a chain are all of one part."""
        return tuple(self.part_of[p] for p in self.piece_of[self.chain_begin[:-1]].tolist())

    def run(self) -> None:
        """Relaxes rotations, then positions."""
        for kind, rounds in ((1, _ROTATION_ROUNDS), (0, _POSITION_ROUNDS)):
            weight = np.where(self.is_step, 1.0 / self.step_variance[:, kind], 0.0)
            network = Network(weight, self.a, self.b, self.fixed)
            soft = np.ones(len(self.a))  # how much each closure counts, for its misfit
            for _ in range(rounds):
                network.weigh(soft / self.variance[:, kind])
                soft = self._round(kind, network)
        part_of_point = np.array(self.part_of)[self.piece_of]
        for part, begin in enumerate(self.fixed.tolist()):  # in the frame of its first point
            points = part_of_point == part
            self.T[points] = np.linalg.inv(self.T[begin]) @ self.T[points]

    def _find_closures(self, skeleton: Skeleton) -> None:
        """The closures that count, as points a and b, with transforms and variances; and where a chain begins at the frame at
        which another ends, the same, without a way between."""
        key = np.concatenate([(chain.session << 32) + chain.index for chain in skeleton.chains])
        order = np.argsort(key, kind="stable")
        known = skeleton.closures
        ends = []
        for frames in (known.a, known.b):
            wanted = (frames[:, 0].astype(np.int64) << 32) + frames[:, 1]
            at = order[np.minimum(np.searchsorted(key[order], wanted), len(order) - 1)]
            ends.append(np.where(key[at] == wanted, at, -1))
        a, b = ends
        counts = (known.state == EdgeState.ACCEPTED) & known.carries & (a >= 0) & (b >= 0) & (a != b)
        again = np.flatnonzero(key[order][1:] == key[order][:-1])
        self.a = np.concatenate([a[counts], order[again]])
        self.b = np.concatenate([b[counts], order[again + 1]])
        self.measured = np.concatenate([known.a_from_b[counts], np.zeros((len(again), 6))])
        self.variance = np.maximum(
            np.concatenate([known.variance[counts], np.zeros((len(again), 2))]), _LEAST_VARIANCE
        )

    def _pull(self, doubtful: Array) -> Array:
        """Of each step (n - 1,) whether it counts: a doubtful one only if no measured edges connect its ends."""
        measured = np.concatenate([[0], np.cumsum(~(self.is_step & ~doubtful))])  # of each point what measured steps join
        root = _roots(int(measured[-1]) + 1, measured[self.a], measured[self.b])[measured]
        return np.asarray(~doubtful | (root[1:] != root[:-1]))

    def _find_parts(self) -> Tuple[List[int], Array]:
        """Of each piece its part, the one with the most points first; and of each part its first piece."""
        root = _roots(len(self.begin) - 1, self.piece_of[self.a], self.piece_of[self.b]).tolist()
        size: Dict[int, int] = {}
        for first, points in zip(root, np.diff(self.begin).tolist()):
            size[first] = size.get(first, 0) + points
        firsts = sorted(size, key=lambda first: (-size[first], first))
        number = {first: part for part, first in enumerate(firsts)}
        return [number[first] for first in root], np.array(firsts, np.intp)

    def _place_parts(self, doubtful: Array, fixed: Array) -> Array:
        """A start (n, 4, 4): what measured steps join is placed by closures, and what measured edges join as a whole by
        guesses; so guesses put nothing at odds that was measured."""
        measured = self.is_step & ~doubtful
        cut = np.concatenate([[True], ~measured])
        T = _place_chains(self.step, measured, np.append(np.flatnonzero(cut), len(cut)))
        body = np.cumsum(cut) - 1
        root = _roots(int(body[-1]) + 1, body[self.a], body[self.b])
        _place_bodies(T, body, np.unique(root), self.a, self.b, _transforms(self.measured))
        guessed = np.flatnonzero(self.is_step & doubtful)
        whole = root[body]
        _place_bodies(T, whole, whole[fixed], guessed, guessed + 1, _transforms(self.step[guessed]))
        return T

    def _round(self, kind: int, network: Network) -> Array:
        """One round: rotations (kind 1) or positions (kind 0). Returns how much each closure counts afterwards."""
        apart = self._misfits(kind, self.T[self.a], self.T[self.b], self.measured)
        change = network.solve(self._misfits(kind, self.T[:-1], self.T[1:], self.step), apart)
        if kind == 0:
            self.T[:, :3, 3] += change
        else:
            self.T[:, :3, :3] = so3_exp(change) @ self.T[:, :3, :3]
        left = apart - (change[self.b] - change[self.a])
        sigmas = np.sqrt(np.sum(left * left, axis=1) / self.variance[:, kind])
        return np.asarray(np.minimum(1.0, _HUBER_SIGMAS / np.maximum(sigmas, 1e-12)))

    @staticmethod
    def _misfits(kind: int, Ta: Array, Tb: Array, xi: Array) -> Array:
        """By how much b should move against a, in the part's coordinates, so that the edge fits (n, 3)."""
        if kind == 0:
            return np.asarray(np.einsum("nij,nj->ni", Ta[:, :3, :3], xi[:, :3]) - (Tb[:, :3, 3] - Ta[:, :3, 3]))
        R: Array = Ta[:, :3, :3] @ so3_exp(xi[:, 3:]) @ np.swapaxes(Tb[:, :3, :3], 1, 2)
        return so3_log(R)


def _variances(chain: SkeletonChain) -> Array:
    """Of each step (n, 2), if it counts."""
    return np.asarray(np.where(chain.carried[:, None], _CARRIED_VARIANCE, np.maximum(chain.variance, _LEAST_VARIANCE)))


def _roots(count: int, a: Array, b: Array) -> Array:
    """Of things 0..count-1, of which a[k] and b[k] are joined: of each the first one that is joined with it (count,)."""
    root = list(range(count))

    def find(c: int) -> int:
        while root[c] != c:
            root[c] = root[root[c]]
            c = root[c]
        return c

    pairs = np.unique(np.stack([np.minimum(a, b), np.maximum(a, b)]), axis=1)
    for x, y in pairs.T.tolist():
        x, y = find(x), find(y)
        root[max(x, y)] = min(x, y)
    return np.array([find(c) for c in range(count)], np.intp)


def _transforms(xi: Array) -> Array:
    """T (n, 4, 4) of translations and rotation vectors (n, 6)."""
    T = np.tile(np.eye(4), (len(xi), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = so3_exp(xi[:, 3:]), xi[:, :3]
    return T


def _place_chains(step: Array, is_step: Array, begin: Array) -> Array:
    """The poses (n, 4, 4) of the points of each chain in the frame of its first point: products of ever longer stretches."""
    T = np.concatenate([np.eye(4)[None], _transforms(np.where(is_step[:, None], step, 0.0))])
    place = np.arange(len(T)) - np.repeat(begin[:-1], np.diff(begin))
    longest, shift = int(place.max()), 1
    while shift <= longest:
        reaches = np.flatnonzero(place >= shift)
        T[reaches] = T[reaches - shift] @ T[reaches]
        shift *= 2
    return np.asarray(T)


def _place_bodies(T: Array, body: Array, firsts: Array, a: Array, b: Array, T_ab: Array) -> None:
    """Moves bodies, sets of poses of which body[k] has pose k, so that one of the edges between two of them fits: breadth
    first from the first bodies. The edges are between poses a and b, with T_ab."""
    order = np.argsort(body, kind="stable")
    begin = np.concatenate([[0], np.cumsum(np.bincount(body))])
    body_a, body_b = body[a], body[b]
    joins: List[List[Tuple[int, int]]] = [[] for _ in range(len(begin) - 1)]
    # Of the edges between two bodies one is enough.
    _, one = np.unique(np.stack([body_a, body_b]), axis=1, return_index=True)
    for k in one.tolist():
        if body_a[k] != body_b[k]:
            joins[int(body_a[k])].append((int(body_b[k]), k))
            joins[int(body_b[k])].append((int(body_a[k]), k))
    done = np.zeros(len(joins), bool)
    done[firsts] = True
    queue = firsts.tolist()
    for here in queue:  # grows
        for other, k in joins[here]:
            if done[other]:
                continue
            done[other] = True
            queue.append(other)
            forward = body_b[k] == other
            end, start = (b[k], a[k]) if forward else (a[k], b[k])
            move = T[start] @ (T_ab[k] if forward else np.linalg.inv(T_ab[k])) @ np.linalg.inv(T[end])
            points = order[begin[other] : begin[other + 1]]
            T[points] = move @ T[points]


def relaxed_picture(skeleton: Skeleton) -> RelaxedPicture:
    """Positions of a skeleton's points for a picture: cycles are bent until they close. Not a measurement."""
    if not skeleton.chains:
        return RelaxedPicture((), (), skeleton)
    work = _Relaxation(skeleton)
    work.run()
    chains = tuple(frozen(T) for T in np.split(work.T, work.chain_begin[1:-1]))
    return RelaxedPicture(chains, work.chain_parts, skeleton)
