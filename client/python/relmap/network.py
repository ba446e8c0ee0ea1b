"""Networks of resistors: least squares with one unknown for each node, for all axes at once.

What is solved for is where the nodes of chains lie if edges say by how much their ends differ, each with a weight (one over
its variance). The chains, ways of robots, are stiff and long, and what joins them are few other edges. So conjugate gradients
are preconditioned by the exact solution of the chains, which a tridiagonal system gives, and by that of a small system of
pins spread evenly over them.
"""

from __future__ import annotations

from typing import List, Optional, Tuple

import numpy as np

from relmap.geometry import Array

_MAX_PINS = 600  # evenly spread; the ends of chains come on top
_MAX_PINNED = 1500  # chains with pins
_MAX_ITERATIONS = 1000
# Of the energy (the sum of squared misfits in standard deviations) by which an answer is off, as the preconditioner sees
# it: far less than the measurements themselves are off. Without pins it sees little of what bends the whole.
_ENERGY, _ENERGY_WITHOUT_PINS = 1e-2, 1e-9
_ROUNDING = 1e-16  # of the energy of the question


class Tridiagonal:
    """A symmetric positive definite tridiagonal system, factorised by odd-even reduction: half of the unknowns at a time, so
    that numpy solves for all of them at once."""

    def __init__(self, diagonal: Array, beside: Array) -> None:
        self.levels: List[Tuple[Array, Array, Array]] = []
        while len(diagonal) > 1:
            odd, left, right = diagonal[1::2], beside[0::2], beside[1::2]
            by_left, by_right = left / odd, right / odd[: len(right)]
            even = diagonal[0::2].copy()
            even[: len(odd)] -= left * by_left
            even[1 : 1 + len(right)] -= right * by_right
            self.levels.append((odd[:, None], by_left[:, None], by_right[:, None]))
            diagonal, beside = even, -by_left[: len(right)] * right
        self.last = diagonal[:, None]

    def solve(self, right_side: Array) -> Array:
        """The solution (n, k) for right sides (n, k)."""
        eliminated = []
        for _, by_left, by_right in self.levels:
            odd, even = right_side[1::2], right_side[0::2].copy()
            even[: len(odd)] -= by_left * odd
            even[1 : 1 + len(by_right)] -= by_right * odd[: len(by_right)]
            eliminated.append(odd)
            right_side = even
        x = right_side / self.last
        for (pivot, by_left, by_right), odd in zip(reversed(self.levels), reversed(eliminated)):
            found = odd / pivot - by_left * x[: len(odd)]
            found[: len(by_right)] -= by_right * x[1 : 1 + len(by_right)]
            both = np.empty((len(x) + len(found), x.shape[1]))
            both[0::2], both[1::2] = x, found
            x = both
        return np.asarray(x)


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
        self.beads: Optional[List[Tuple[Array, Array]]] = None

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
        self.chains = Tridiagonal(diagonal + self.ground, -self.step)
        if self.beads is None:  # those of the first weights are near enough for later ones
            self._place_pins()

    def solve(self, step_want: Array, want: Array) -> Array:
        """The values (n, 3) of the nodes, if each step should make a difference of `step_want` (n - 1, 3), and each other
        edge b - a of `want` (m, 3)."""
        r = np.zeros((self.nodes, 3))
        flow = self.step[:, None] * step_want
        r[1:] += flow
        r[:-1] -= flow
        self._add_flow(r, self.weight[:, None] * want)
        x = np.zeros_like(r)
        z = self._precondition(r)
        p, rz = z.copy(), np.sum(r * z, axis=0)
        enough = max(self.energy, _ROUNDING * float(rz.sum()))
        for _ in range(_MAX_ITERATIONS):
            if rz.sum() <= enough:
                break
            Ap = self._apply(p)
            alpha = rz / np.maximum(np.sum(p * Ap, axis=0), 1e-300)
            x += alpha * p
            r -= alpha * Ap
            z = self._precondition(r)
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

    def _precondition(self, r: Array) -> Array:
        z = self.chains.solve(r)
        if self.pins == 0:
            return z
        pulled = np.zeros((self.pins, 3))
        assert self.beads is not None
        for pin, part in self.beads:
            for k in range(3):
                pulled[:, k] += np.bincount(pin, part * r[:, k], self.pins)
        moved = self.inverse @ pulled
        for pin, part in self.beads:
            z += part[:, None] * moved[pin]
        return np.asarray(z)

    def _place_pins(self) -> None:
        """Pins at both ends of every long chain and evenly between, and one for each short chain, which moves as a whole.
        Nodes move with the pins around them, like beads on a rod, in proportion to the variance of the way; so the system of
        the pins has the shape of the whole. Chains without pins, the shortest if they are many, are left to the
        iterations."""
        begins = np.flatnonzero(np.concatenate([[True], self.step == 0]))
        ends = np.append(begins[1:], self.nodes) - 1
        apart = -(-self.nodes // _MAX_PINS)
        length = ends + 1 - begins
        pinned = np.zeros(len(length), bool)
        pinned[np.argsort(-length, kind="stable")[:_MAX_PINNED]] = True
        both = pinned & (length >= (1 if len(length) <= _MAX_PINS else apart))
        chain_of = np.repeat(np.arange(len(length)), length)
        chain_is_pinned = pinned[chain_of]
        node = np.arange(self.nodes)
        at = np.unique(np.concatenate([begins[pinned], ends[both], node[both[chain_of] & (node % apart == 0)]]))
        self.pins = len(at)
        self.beads = []  # the pins with which each node moves, and by how much with each
        self.energy = _ENERGY if pinned.all() else _ENERGY_WITHOUT_PINS
        if self.pins == 0:
            return
        before = np.maximum(np.searchsorted(at, node, side="right") - 1, 0)
        after = np.minimum(before + 1, self.pins - 1)
        ohms = np.divide(1.0, self.step, out=np.zeros_like(self.step), where=self.step > 0)
        along = np.concatenate([[0.0], np.cumsum(ohms)])
        gone, whole = along - along[at[before]], along[at[after]] - along[at[before]]
        between = chain_is_pinned & (chain_of[at[after]] == chain_of) & (whole > 0)
        share = np.divide(gone, whole, out=np.zeros(self.nodes), where=between)
        self.beads = [(before, np.where(chain_is_pinned, 1 - share, 0.0)), (after, share)]
        steps = np.flatnonzero(self.step > 0)
        system = np.zeros(self.pins * self.pins)
        for a, b, weight in (
            (steps, steps + 1, self.step[steps]),
            (self.a, self.b, self.weight),
            (np.flatnonzero(self.ground), None, self.ground[self.ground > 0]),
        ):
            # weight (v_b - v_a)^2, where the value of a node is the sum over its beads.
            terms = [(pin[a], -part[a]) for pin, part in self.beads]
            if b is not None:
                terms += [(pin[b], part[b]) for pin, part in self.beads]
            for i, x in terms:
                for j, y in terms:
                    system += np.bincount(i * self.pins + j, weight * x * y, len(system))
        A = system.reshape(self.pins, self.pins)
        self.inverse = np.linalg.inv(A + 1e-12 * np.diag(np.diag(A)))
