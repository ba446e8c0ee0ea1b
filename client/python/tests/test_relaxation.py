"""Relaxed pictures of maps in which nothing measured many of the steps."""

from __future__ import annotations

import numpy as np
import pytest
from relmap import geometry
from relmap.geometry import Array, frozen
from relmap.graph import EdgeState
from relmap.relaxation import relaxed_picture
from relmap.skeleton import Skeleton, SkeletonChain, SkeletonClosures

LAP, LAPS = 200, 4
CLOSURE_SIGMAS = np.repeat([0.03, 0.003], 3)  # metres, radians


def _six(T: Array) -> Array:
    return np.concatenate([T[:, :3, 3], geometry.so3_log(T[:, :3, :3])], axis=1)


def _transforms(xi: Array) -> Array:
    T = np.tile(np.eye(4), (len(xi), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = geometry.so3_exp(xi[:, 3:]), xi[:, :3]
    return T


def _laps(seed: int, guess_sigmas: tuple[float, float]) -> tuple[Skeleton, Array]:
    """Four laps round a circle of 200 m, of which every fourth step is a guess. Half of the points of later laps are joined
    with one of an earlier lap, at the same place. Returns the skeleton and the true poses."""
    rng = np.random.default_rng(seed)
    n, radius = LAP * LAPS, LAP / (2 * np.pi)
    angle = 2 * np.pi * np.arange(n) / LAP
    zero = np.zeros(n)
    true = _transforms(np.stack([radius * np.cos(angle), zero, radius * np.sin(angle), zero, -angle, zero], axis=1))
    guess = np.zeros(n - 1, bool)
    guess[rng.permutation(n - 1)[: n // 4]] = True
    sigmas = np.where(guess[:, None], np.repeat(guess_sigmas, 3), np.repeat([0.01, 0.001], 3))
    step = np.linalg.inv(true[:-1]) @ true[1:] @ _transforms(rng.normal(0, sigmas))
    whole = frozen(np.arange(n))
    drive = SkeletonChain(
        1, whole, whole, frozen(_six(step)), frozen(3 * sigmas[:, [0, 3]] ** 2), frozen(np.ones(n - 1, int)), frozen(guess),
        frozen(np.zeros(n - 1, bool)),
    )  # fmt: skip
    b = LAP + np.flatnonzero(rng.random(n - LAP) < 0.5)
    a = b - LAP * rng.integers(1, b // LAP + 1)
    m = len(a)
    measured = np.linalg.inv(true[a]) @ true[b] @ _transforms(rng.normal(0, 1, (m, 6)) * CLOSURE_SIGMAS)
    one = np.ones(m, int)
    closures = SkeletonClosures(
        frozen(np.stack([one, a], axis=1)), frozen(np.stack([one, b], axis=1)), frozen(one),
        frozen(np.full(m, int(EdgeState.ACCEPTED))), frozen(np.ones(m, bool)), frozen(_six(measured)),
        frozen(np.tile(3 * CLOSURE_SIGMAS[[0, 3]] ** 2, (m, 1))), frozen(np.zeros(m)), frozen(one),
    )  # fmt: skip
    return Skeleton((drive,), closures, n, 1), true


@pytest.mark.parametrize("seed", range(6))
def test_guesses_however_wrong_put_no_closure_at_odds(seed: int) -> None:
    """They are off by a radian, so that those between the same two places contradict each other by half a turn."""
    skeleton, _ = _laps(seed, (2.0, 1.0))
    T = relaxed_picture(skeleton).chains[0]
    closures = skeleton.closures
    apart = _six(np.linalg.inv(_transforms(closures.a_from_b)) @ np.linalg.inv(T[closures.a[:, 1]]) @ T[closures.b[:, 1]])
    assert np.abs(apart / CLOSURE_SIGMAS).max() < 6


def test_a_map_of_which_a_quarter_are_guesses_is_as_true_as_they_are() -> None:
    skeleton, true = _laps(1, (0.05, 0.01))
    T = relaxed_picture(skeleton).chains[0]
    expected = np.linalg.inv(true[0]) @ true
    assert np.linalg.norm(T[:, :3, 3] - expected[:, :3, 3], axis=1).max() < 2  # metres, of a circle of 64 m across
