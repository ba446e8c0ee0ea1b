"""The solver of pictures' networks, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest

import relmap.network
from relmap.geometry import Array
from relmap.network import Network, Tridiagonal

RANDOM = np.random.default_rng(7)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 64, 101])
def test_tridiagonal_systems_are_solved_exactly(n: int) -> None:
    beside = -RANDOM.uniform(0, 1, max(n - 1, 0))
    beside[::5] = 0
    diagonal = 2.1 + RANDOM.uniform(0, 1, n)
    dense = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
    right = RANDOM.normal(size=(n, 3))
    assert np.allclose(Tridiagonal(diagonal, beside).solve(right), np.linalg.solve(dense, right), atol=1e-12)


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


@pytest.mark.parametrize("pins, pinned", [(1, 0), (1, 2), (1, 1000), (6, 1000), (1000, 1000)])
def test_a_network_is_solved_as_dense_least_squares(pins: int, pinned: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relmap.network, "_MAX_PINS", pins)
    monkeypatch.setattr(relmap.network, "_MAX_PINNED", pinned)
    monkeypatch.setattr(relmap.network, "_ENERGY", 1e-20)
    monkeypatch.setattr(relmap.network, "_ENERGY_WITHOUT_PINS", 1e-20)
    # Three chains of 20, 1 and 30 nodes, of which the first and the last are joined; the single node stands alone.
    step = 10 ** RANDOM.uniform(0, 4, 50)
    step[[19, 20]] = 0
    a, b = np.array([0, 3, 12, 18, 25]), np.array([22, 40, 45, 50, 47])
    fixed = np.array([0, 20])
    network = Network(step, a, b, fixed)
    for _ in range(2):  # weighed anew, with the pins of the first weights
        weight = 10 ** RANDOM.uniform(-1, 2, 5)
        step_want, want = RANDOM.normal(size=(50, 3)), RANDOM.normal(size=(5, 3))
        network.weigh(weight)
        expected = _dense(step, a, b, weight, fixed, step_want, want)
        assert np.allclose(network.solve(step_want, want), expected, atol=1e-6)


def test_with_pins_everywhere_few_iterations_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relmap.network, "_MAX_ITERATIONS", 20)
    monkeypatch.setattr(relmap.network, "_ENERGY", 1e-12)
    step = np.ones(99)
    a, b, fixed = np.arange(0, 40, 3), np.arange(0, 40, 3) + 55, np.array([0])
    network = Network(step, a, b, fixed)
    weight, step_want, want = np.ones(14), RANDOM.normal(size=(99, 3)), RANDOM.normal(size=(14, 3))
    network.weigh(weight)
    assert np.allclose(
        network.solve(step_want, want), _dense(step, a, b, weight, fixed, step_want, want), atol=1e-2
    )


def test_chains_that_are_many_and_short_have_a_pin_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that few iterations are enough for them, too: sixty chains of five nodes, in a row."""
    monkeypatch.setattr(relmap.network, "_MAX_PINS", 20)
    monkeypatch.setattr(relmap.network, "_MAX_ITERATIONS", 20)
    monkeypatch.setattr(relmap.network, "_ENERGY", 1e-12)
    monkeypatch.setattr(relmap.network, "_ENERGY_WITHOUT_PINS", 1e-12)
    step = np.ones(299)
    step[4::5] = 0
    a, fixed = np.arange(2, 295, 5), np.array([0])
    network = Network(step, a, a + 4, fixed)
    weight, step_want, want = np.ones(59), RANDOM.normal(size=(299, 3)), RANDOM.normal(size=(59, 3))
    network.weigh(weight)
    expected = _dense(step, a, a + 4, weight, fixed, step_want, want)
    assert np.allclose(network.solve(step_want, want), expected, atol=1e-2)
