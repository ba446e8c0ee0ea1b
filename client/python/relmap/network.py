"""Networks of resistors: least squares with one unknown for each node, for all axes at once.

What is solved for is where the nodes of chains lie if edges say by how much their ends differ, each with a weight (one over
its variance). Conjugate gradients are preconditioned by an elimination of the nodes that is exact along chains and where few
edges meet, and elsewhere keeps a sample of the edges that an exact one would make, so that it takes time and memory in
proportion to the edges, however chains, closures and breaks between chains lie.
"""

from __future__ import annotations

from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from relmap.geometry import Array

_MAX_DENSE = 400  # nodes that are left for dense algebra
_MAX_EXACT_DEGREE = 8  # edges of a node that is eliminated exactly
_MAX_ITERATIONS = 1000
# Of the energy (the sum of squared misfits in standard deviations) by which an answer is off, as the preconditioner sees
# it: far less than the measurements themselves are off.
_ENERGY = 1e-3
_ROUNDING = 1e-16  # of the energy of the question


class _Round(NamedTuple):
    """Nodes that are eliminated at once, since no edge joins two of them."""

    gone: Array  # they
    kept: Array  # the others, which are numbered anew in this order
    total: Array  # of each of them the sum of the weights of its edges, and of the ground
    row: Array  # of each of their edges: which of them,
    to: Array  # the other end among the kept,
    share: Array  # and its part of the total


class Elimination:
    """An approximate solver of a network whose nodes some resistors connect to the ground: a symmetric positive definite
    operator near to the inverse of the network's. The same network gives the same one.

    Args:
        a, b: (m,), the ends of the edges; several may join the same two nodes.
        weight: (m,), of the edges, above 0.
        ground: (n,), of each node the weight to the ground; in each connected part one is above 0.
    """

    def __init__(self, a: Array, b: Array, weight: Array, ground: Array) -> None:
        random = np.random.default_rng(1)
        self.rounds: List[_Round] = []
        a, b, weight = _merged(len(ground), a, b, weight)
        while len(ground) > _MAX_DENSE:
            a, b, weight, ground = self._eliminate(a, b, weight, ground, random)
        A = np.diag(ground)
        for i, j, sign in ((a, b, -1), (b, a, -1), (a, a, 1), (b, b, 1)):
            np.add.at(A, (i, j), sign * weight)
        self.inverse = np.linalg.inv(A + 1e-13 * np.diag(np.diag(A)))

    def solve(self, right_side: Array) -> Array:
        """The approximate solution (n, k) for right sides (n, k)."""
        y: Array = right_side
        eliminated = []
        for step in self.rounds:
            gone, y = y[step.gone], y[step.kept]
            eliminated.append(gone)
            y += _summed(step.to, step.share[:, None] * gone[step.row], len(y))
        x: Array = self.inverse @ y
        for step, gone in zip(reversed(self.rounds), reversed(eliminated)):
            both = np.empty((len(step.gone) + len(step.kept), x.shape[1]))
            both[step.kept] = x
            both[step.gone] = gone / step.total[:, None] + _summed(step.row, step.share[:, None] * x[step.to], len(gone))
            x = both
        return np.asarray(x)

    def _eliminate(
        self, a: Array, b: Array, weight: Array, ground: Array, random: np.random.Generator
    ) -> Tuple[Array, Array, Array, Array]:
        """Eliminates nodes that have few edges and that no edge joins; returns the network of the others."""
        n = len(ground)
        order = np.argsort(np.concatenate([a, b]), kind="stable")
        tail, head, out = (np.concatenate(both)[order] for both in ((a, b), (b, a), (weight, weight)))
        degree = np.bincount(tail, minlength=n)
        begin = np.concatenate([[0], np.cumsum(degree)])
        few = np.maximum(2, np.median(degree))
        rank = np.where(degree <= few, degree + random.random(n), np.inf)
        best_beside = np.full(n, np.inf)
        joined = np.flatnonzero(degree)
        if len(joined):
            best_beside[joined] = np.minimum.reduceat(rank[head], begin[joined])
        chosen = rank < best_beside
        gone, kept = np.flatnonzero(chosen), np.flatnonzero(~chosen)
        number = np.empty(n, np.intp)
        number[gone], number[kept] = np.arange(len(gone)), np.arange(len(kept))
        total = (np.bincount(tail, out, n) + ground)[gone]
        ends = chosen[tail]
        row, to = number[tail[ends]], number[head[ends]]
        share = out[ends] / total[row]
        self.rounds.append(_Round(gone, kept, total, row, to, share))
        stays = ~(chosen[a] | chosen[b])
        edges = [(number[a[stays]], number[b[stays]], weight[stays])]
        for d in np.unique(degree[gone]).tolist():
            alike = degree[gone] == d
            at = begin[gone[alike]][:, None] + np.arange(d)
            edges += _joined(number[head[at]], out[at], total[alike], random)
        left = ground[kept] + np.bincount(to, share * ground[gone][row], len(kept))
        return (*_merged(len(kept), *(np.concatenate(part) for part in zip(*edges))), left)


def _joined(to: Array, weight: Array, total: Array, random: np.random.Generator) -> List[Tuple[Array, Array, Array]]:
    """The edges that nodes leave when they are eliminated: n nodes with d edges each (n, d), with the sums of their weights.
    An exact elimination joins all pairs of ends. Of nodes with many edges each end but the strongest is joined with one
    stronger end, drawn by weight, as strongly as an exact one would join it with all of these together."""
    n, d = to.shape
    if d <= _MAX_EXACT_DEGREE:
        i, j = np.triu_indices(d, 1)
        return [(to[:, i].ravel(), to[:, j].ravel(), (weight[:, i] * weight[:, j] / total[:, None]).ravel())]
    order = np.argsort(weight, axis=1)
    to, weight = np.take_along_axis(to, order, 1), np.take_along_axis(weight, order, 1)
    up_to = np.cumsum(weight, axis=1)
    edges = []
    for k in range(d - 1):
        stronger = np.maximum(up_to[:, -1] - up_to[:, k], weight[:, -1])  # but for rounding errors
        drawn = up_to[:, k] + random.random(n) * stronger
        other = np.clip(np.sum(up_to <= drawn[:, None], axis=1), k + 1, d - 1)
        edges.append((to[:, k], to[np.arange(n), other], weight[:, k] * stronger / total))
    return edges


def _merged(n: int, a: Array, b: Array, weight: Array) -> Tuple[Array, Array, Array]:
    """One edge for all that join the same two of n nodes."""
    between = a != b
    key, which = np.unique(np.minimum(a, b)[between] * np.int64(n) + np.maximum(a, b)[between], return_inverse=True)
    return key // n, key % n, np.bincount(which, weight[between], len(key))


def _summed(to: Array, values: Array, n: int) -> Array:
    """Of each of n things the sum of the values (m, k) that go to it (n, k)."""
    return np.stack([np.bincount(to, column, n) for column in values.T], axis=1)


class Network:
    """Nodes 0..n-1 in chains, and other edges between them.

    Args:
        step: (n - 1,), the weight of the step from each node to the next one; 0 between two chains.
        a, b: (m,), the ends of the other edges.
        fixed: nodes that stay 0, one for each connected part.
    """

    def __init__(self, step: Array, a: Array, b: Array, fixed: Array) -> None:
        self.nodes = len(step) + 1
        self.step, self.a, self.b, self.fixed = step, a, b, fixed
        self.near: Optional[Elimination] = None

    def weigh(self, weight: Array) -> None:
        """Sets the weights (m,) of the other edges."""
        self.weight = weight
        diagonal = np.zeros(self.nodes)
        diagonal[:-1] += self.step
        diagonal[1:] += self.step
        for ends in (self.a, self.b):
            diagonal += np.bincount(ends, weight, self.nodes)
        # A resistor to the ground carries no current where nothing else does: any weight holds the node at 0.
        self.ground = np.zeros(self.nodes)
        self.ground[self.fixed] = np.maximum(diagonal[self.fixed], 1.0)
        if self.near is None:  # that of the first weights is near enough for later ones
            steps = np.flatnonzero(self.step > 0)
            self.near = Elimination(
                np.concatenate([steps, self.a]),
                np.concatenate([steps + 1, self.b]),
                np.concatenate([self.step[steps], weight]),
                self.ground,
            )

    def solve(self, step_want: Array, want: Array) -> Array:
        """The values (n, 3) of the nodes, if each step should make a difference of `step_want` (n - 1, 3), and each other
        edge b - a of `want` (m, 3)."""
        assert self.near is not None
        r = np.zeros((self.nodes, 3))
        flow = self.step[:, None] * step_want
        r[1:] += flow
        r[:-1] -= flow
        self._add_flow(r, self.weight[:, None] * want)
        x = np.zeros_like(r)
        z = self.near.solve(r)
        p, rz = z.copy(), np.sum(r * z, axis=0)
        enough = max(_ENERGY, _ROUNDING * float(rz.sum()))
        for _ in range(_MAX_ITERATIONS):
            if rz.sum() <= enough:
                break
            Ap = self._apply(p)
            alpha = rz / np.maximum(np.sum(p * Ap, axis=0), 1e-300)
            x += alpha * p
            r -= alpha * Ap
            z = self.near.solve(r)
            rz, before = np.sum(r * z, axis=0), rz
            p = z + rz / np.maximum(before, 1e-300) * p
        return x

    def _add_flow(self, out: Array, flow: Array) -> None:
        for k in range(3):
            out[:, k] += np.bincount(self.b, flow[:, k], self.nodes)
            out[:, k] -= np.bincount(self.a, flow[:, k], self.nodes)

    def _apply(self, v: Array) -> Array:
        out = self.ground[:, None] * v
        flow = self.step[:, None] * (v[1:] - v[:-1])
        out[1:] += flow
        out[:-1] -= flow
        self._add_flow(out, self.weight[:, None] * (v[self.b] - v[self.a]))
        return np.asarray(out)
