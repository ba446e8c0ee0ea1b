"""A world of points in numpy: a robot with a stereo camera drives in a circle through points, each of which looks like
itself. It stands in for a robot in the notebooks, in tests and in benchmarks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterator

import numpy as np

import relmap

CAMERA = relmap.StereoCamera(f=400.0, cx=256.0, cy=192.0, baseline=0.12, width=512, height=384)
STEP_COV = np.diag([1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6])
BEGIN_US = 1_760_000_000_000_000
FRAME_US = 200_000


@dataclass(frozen=True)
class Step:
    """The arguments of IngestSession.add()."""

    time: int
    T_odom_frame: Any
    step_cov: Any
    tracks: relmap.Tracks
    features: relmap.Features


def pose(angle: float, radius: float) -> Any:
    """T_world_frame on a circle, looking along it: x right, y down, z forward."""
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(4)
    T[:3, :3] = [[c, 0, -s], [0, 1, 0], [s, 0, c]]
    T[:3, 3] = [radius * c, 0, radius * s]
    return T


def drive(frames: int, frames_per_lap: int = 60, points: int = 900, seed: int = 1, start: int = 0) -> Iterator[Step]:
    """The keyframes of a drive in a circle that passes through `points` points. The same seed makes the same world; drives of
    another start, too, see the same points."""
    world = np.random.default_rng(seed)
    noise = np.random.default_rng([seed, start, frames])
    radius = 3.0 * frames_per_lap / 60
    around = world.uniform(0, 2 * np.pi, points)
    away = radius + world.uniform(-2.5, 4.0, points)
    p_world = np.stack([away * np.cos(around), world.uniform(-1.2, 1.2, points), away * np.sin(around)], axis=1)
    sift = np.abs(world.normal(0, 1, (points, 128)))
    sift = 512 * sift / np.linalg.norm(sift, axis=1, keepdims=True)
    odom = np.eye(4)
    seen: dict[int, tuple[int, int]] = {}
    before = None
    for k in range(frames):
        T = pose(2 * np.pi * (start + k) / frames_per_lap, radius)
        step_cov = np.zeros((6, 6))
        if before is not None:
            drift = np.eye(4)
            drift[:3, 3] = noise.normal(0, 0.005, 3)
            odom = odom @ np.linalg.inv(before) @ T @ drift
            step_cov = STEP_COV
        before = T
        local = (p_world - T[:3, 3]) @ T[:3, :3]
        ahead = np.flatnonzero((local[:, 2] > 0.6) & (local[:, 2] < 9))
        z = CAMERA.project(local[ahead]) + noise.normal(0, 0.2, (len(ahead), 3))
        z[:, 2] = np.minimum(z[:, 2], z[:, 0])
        inside = (z.min(axis=1) >= 1) & (z[:, 0] < CAMERA.width - 2) & (z[:, 1] < CAMERA.height - 2)
        chosen, z = ahead[inside][:300], z[inside][:300]
        tracks = []
        for i, point in enumerate(chosen.tolist()):
            name = seen.get(point)
            if name is None or name[0] < 0:
                name = (k, i)
            tracks.append(name)
        seen = dict(zip(chosen.tolist(), tracks))
        ids = np.array(tracks, np.uint32).reshape(-1, 2)
        n = len(chosen)
        look = np.clip(sift[chosen] + noise.normal(0, 3, (n, 128)), 0, 255).astype(np.uint8)
        yield Step(
            time=BEGIN_US + 10**9 * start + k * FRAME_US,
            T_odom_frame=odom,
            step_cov=step_cov,
            tracks=relmap.Tracks(ids[:, 0], ids[:, 1], z[:, 0], z[:, 1], z[:, 2], np.zeros(n, np.uint8)),
            features=relmap.Features(
                z[:, 0], z[:, 1], np.full(n, 8.0), np.zeros(n), look, z[:, 0] - z[:, 2], np.arange(n, dtype=np.int16)
            ),
        )
