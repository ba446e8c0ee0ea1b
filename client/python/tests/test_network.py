"""The solver of pictures' networks, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

import relmap.network
from relmap.geometry import Array
from relmap.network import Elimination, Network
from relmap.relaxation import _roots

RANDOM = np.random.default_rng(7)


def _dense(step: Array, a: Array, b: Array, weight: Array, fixed: Array, step_want: Array, want: Array) -> Array:
    """The least squares solution, with the fixed nodes left out."""
    n = len(step) + 1
    here = np.flatnonzero(step)
    tails, heads = np.concatenate([here, a]), np.concatenate([here + 1, b])
    weights, wants = np.concatenate([step[here], weight]), np.concatenate([step_want[here], want])
    J = np.zeros((len(tails), n))
    J[np.arange(len(tails)), heads] += 1
    J[np.arange(len(tails)), tails] -= 1
    free = np.setdiff1d(np.arange(n), fixed)
    root = np.sqrt(weights)[:, None]
    x = np.zeros((n, 3))
    x[free] = np.linalg.lstsq(root * J[:, free], root * wants, rcond=None)[0]
    return x


@pytest.mark.parametrize("dense, exact", [(400, 8), (1, 8), (1, 1), (10, 2)])
def test_a_network_is_solved_as_dense_least_squares(dense: int, exact: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relmap.network, "_MAX_DENSE", dense)
    monkeypatch.setattr(relmap.network, "_MAX_EXACT_DEGREE", exact)
    monkeypatch.setattr(relmap.network, "_ENERGY", 1e-20)
    # Three chains of 20, 1 and 30 nodes, of which the first and the last are joined; the single node stands alone.
    step = 10 ** RANDOM.uniform(0, 4, 50)
    step[[19, 20]] = 0
    a, b = np.array([0, 3, 3, 12, 18, 25]), np.array([22, 40, 40, 45, 50, 47])
    fixed = np.array([0, 20])
    network = Network(step, a, b, fixed)
    for _ in range(2):  # weighed anew, with the elimination of the first weights
        weight = 10 ** RANDOM.uniform(-1, 2, 6)
        step_want, want = RANDOM.normal(size=(50, 3)), RANDOM.normal(size=(6, 3))
        network.weigh(weight)
        expected = _dense(step, a, b, weight, fixed, step_want, want)
        assert np.allclose(network.solve(step_want, want), expected, atol=1e-6)


def test_where_few_edges_meet_the_elimination_is_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two ways of a hundred steps each, with rungs between: no node ever has more than eight edges."""
    monkeypatch.setattr(relmap.network, "_MAX_DENSE", 3)
    n = 202
    steps = np.setdiff1d(np.arange(n - 1), [100])
    rungs = np.arange(0, 101, 5)
    a, b = np.concatenate([steps, rungs]), np.concatenate([steps + 1, rungs + 101])
    weight, ground = 10 ** RANDOM.uniform(-2, 2, len(a)), np.eye(1, n)[0]
    A = np.diag(ground)
    for i, j, w in zip(a, b, weight):
        A[[i, j], [i, j]] += w
        A[[i, j], [j, i]] -= w
    right = RANDOM.normal(size=(n, 2))
    expected = np.linalg.solve(A, right)
    assert np.allclose(Elimination(a, b, weight, ground).solve(right), expected, atol=1e-6 * np.abs(expected).max())


def _iterations(monkeypatch: pytest.MonkeyPatch, network: Network, step_want: Array, want: Array) -> int:
    """How many iterations an answer takes that is as precise as numbers are."""
    applied = []
    monkeypatch.setattr(relmap.network, "_ENERGY", 0)
    monkeypatch.setattr(relmap.network, "_ROUNDING", 1e-12)
    apply = network._apply
    monkeypatch.setattr(network, "_apply", lambda v: applied.append(1) or apply(v))
    network.solve(step_want, want)
    return len(applied)


def test_few_iterations_are_enough_however_many_breaks_chains_have(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five laps of 1000 points; every fifth step is missing, and half of the points are joined with one of an earlier lap."""
    lap, laps = 1000, 5
    n = lap * laps
    step = np.full(n - 1, 1e4)
    step[RANDOM.permutation(n - 1)[: n // 5]] = 0
    b = np.flatnonzero(RANDOM.random(n) < 0.5)
    b = b[b >= lap]
    a = b - lap * RANDOM.integers(1, b // lap + 1)
    # What is joined with nothing, and each part, has a node that stays.
    fixed = np.unique(_roots(n, np.concatenate([np.flatnonzero(step), a]), np.concatenate([np.flatnonzero(step) + 1, b])))
    network = Network(step, a, b, fixed)
    network.weigh(np.full(len(a), 1e3))
    want, step_want = RANDOM.normal(size=(len(a), 3)), RANDOM.normal(size=(n - 1, 3))
    assert _iterations(monkeypatch, network, step_want, want) <= 40


def test_few_iterations_are_enough_where_every_node_has_many_edges(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closures between any two points, as no map has them; so most of what an elimination makes is a sample."""
    n, m = 3000, 9000
    a, b = RANDOM.integers(0, n, m), RANDOM.integers(0, n, m)
    a, b = a[a != b], b[a != b]
    network = Network(10 ** RANDOM.uniform(0, 3, n - 1), a, b, np.array([0]))
    network.weigh(10 ** RANDOM.uniform(-1, 2, len(a)))
    assert _iterations(monkeypatch, network, RANDOM.normal(size=(n - 1, 3)), RANDOM.normal(size=(len(a), 3))) <= 60
