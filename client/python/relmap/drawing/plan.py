"""Plans: positions seen from above, at one scale on the page. x is to the right, z up; turned so that the plan lies across."""

from __future__ import annotations

import math

import numpy as np

from relmap.drawing.style import FAINT
from relmap.drawing.svg import Point, Svg
from relmap.geometry import Array


class Plan:
    """Maps positions (n, 3, metres) to a box on the page. At least one position."""

    def __init__(self, positions: Array, left: float, top: float, width: float, max_height: float, turn: bool = True) -> None:
        flat = positions[:, [0, 2]]
        self._turn = np.eye(2)
        if turn and len(flat) > 2:
            _, axes = np.linalg.eigh(np.cov((flat - flat.mean(axis=0)).T))
            across = axes[:, 1]
            if across[0] < 0:
                across = -across
            self._turn = np.array([across, [-across[1], across[0]]])
        turned = flat @ self._turn.T
        low, high = turned.min(axis=0), turned.max(axis=0)
        extent = np.maximum(high - low, 1e-3)
        self.scale = float(min(width / extent[0], max_height / extent[1], 200.0))
        """Points on the page for each metre."""
        self.height = float(max(extent[1] * self.scale, 24.0))
        """Of the plan, points."""
        self._middle = (low + high) / 2
        self._centre = np.array([left + width / 2, top + self.height / 2])

    def at(self, positions: Array) -> Array:
        """Points on the page (n, 2) of positions (n, 3)."""
        turned = np.asarray(positions)[:, [0, 2]] @ self._turn.T
        away = (turned - self._middle) * self.scale
        return np.asarray(self._centre + away * np.array([1.0, -1.0]))

    def direction(self, T: Array) -> Array:
        """Where the camera of a pose (4 x 4) looks, as a vector (2) on the page; its length is that of the horizontal part."""
        return np.asarray(self._turn @ T[[0, 2], 2] * np.array([1.0, -1.0]))


def thinned(points: Array, apart: float = 0.4) -> Array:
    """The points (n, 2) without those that are nearer than `apart` to the one before that is kept."""
    keep = [0]
    for i in range(1, len(points) - 1):
        if abs(points[i] - points[keep[-1]]).sum() >= apart:
            keep.append(i)
    if len(points) > 1:
        keep.append(len(points) - 1)
    return np.asarray(points[keep])


def draw_scale(svg: Svg, at: Point, scale: float) -> None:
    """A bar of a round length, of 40 to 120 points."""
    exponent = math.floor(math.log10(100 / scale))
    metres = next(m for m in (10.0 ** (exponent + 1), 5 * 10.0**exponent, 2 * 10.0**exponent, 10.0**exponent) if m * scale <= 121)
    right = (at[0] + metres * scale, at[1])
    svg.polyline([(at[0], at[1] - 4), at, right, (right[0], right[1] - 4)], stroke=FAINT, stroke_width=1)
    svg.text((right[0] + 6, at[1] + 3), f"{metres:g} m", fill=FAINT, font_size=11)
