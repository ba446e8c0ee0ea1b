"""Cameras: rectified ones, as all of the map uses them, and stereo rigs before rectification."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from relmap.geometry import Array, check_transform, frozen, read_transform, transform_message
from relmap.record import Record
from relmap.v1 import common_pb2


def _size(what: str, width: int, height: int) -> None:
    if not (hasattr(width, "__index__") and hasattr(height, "__index__")):
        raise ValueError(f"{what} of {width!r} x {height!r} pixels; must be whole numbers")
    if not (16 <= width <= 16384 and 16 <= height <= 16384):
        raise ValueError(f"{what} of {width} x {height} pixels; each side must have 16..16384")


@dataclass(frozen=True, slots=True)
class StereoCamera:
    """A rectified camera, or stereo pair: u = f x/z + cx, v = f y/z + cy, u_right = f (x - baseline)/z + cx.

    ValueError: a number is not finite, or no camera is like this (the same limits as relmapd's).

    Attributes:
        f: focal length, pixels.
        cx, cy: principal point, pixels; (0, 0) is the centre of the top left pixel.
        baseline: metres; 0 for a mono camera.
        width, height: pixels.
    """

    f: float
    cx: float
    cy: float
    baseline: float
    width: int
    height: int

    def __post_init__(self) -> None:
        if not all(math.isfinite(x) for x in (self.f, self.cx, self.cy, self.baseline)):
            raise ValueError("a number of the camera is not finite")
        _size("a camera", self.width, self.height)
        if not 0.1 <= self.f / self.width <= 20:
            raise ValueError(f"a focal length of {self.f} px for a picture of {self.width} px; must be 0.1..20 widths")
        if not (0 <= self.cx <= self.width and 0 <= self.cy <= self.height):
            raise ValueError(f"the principal point ({self.cx}, {self.cy}) is outside the picture")
        if self.baseline != 0 and not 0.005 <= self.baseline <= 10:
            raise ValueError(f"a baseline of {self.baseline} m; must be 0 or 0.005..10")

    @property
    def is_stereo(self) -> bool:
        """Whether it has two eyes, and so measures metres."""
        return self.baseline > 0

    def project(self, points: Array) -> Array:
        """Pixels (n, 3: u_left, v, u_right) of points (n, 3, metres, in the left camera's frame, z > 0)."""
        p = np.asarray(points, dtype=float)
        s = self.f / p[:, 2]
        return np.stack([s * p[:, 0] + self.cx, s * p[:, 1] + self.cy, s * (p[:, 0] - self.baseline) + self.cx], axis=1)

    def triangulate(self, pixels: Array) -> Array:
        """Points (n, 3, metres) of pixels (n, 3: u_left, v, u_right), u_left > u_right."""
        z = np.asarray(pixels, dtype=float)
        depth = self.f * self.baseline / (z[:, 0] - z[:, 2])
        return np.stack([(z[:, 0] - self.cx) / self.f * depth, (z[:, 1] - self.cy) / self.f * depth, depth], axis=1)


@dataclass(frozen=True, slots=True)
class RawCamera:
    """A pinhole camera before rectification, with radial-tangential distortion as OpenCV's k1, k2, p1, p2, k3.

    Attributes:
        fx, fy, cx, cy: pixels.
        k1, k2, p1, p2, k3: distortion.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RawStereo(Record):
    """A stereo rig, or a single camera, before rectification. ValueError: a size or transform is impossible.

    Attributes:
        left: the left camera.
        right: the right camera; None: a mono camera.
        T_right_left: p_right = T_right_left p_left (4 x 4, metres).
        width, height: pixels of both pictures.
        T_body_left: p_body = T_body_left p_left (4 x 4, metres); kept with keyframes, and unused in questions.
    """

    left: RawCamera
    right: Optional[RawCamera]
    T_right_left: Array
    width: int
    height: int
    T_body_left: Array = field(default_factory=lambda: np.eye(4))

    def __post_init__(self) -> None:
        _size("a rig's picture", self.width, self.height)
        for name in ("T_right_left", "T_body_left"):
            object.__setattr__(self, name, frozen(check_transform(getattr(self, name), name)))


def camera_message(camera: StereoCamera) -> common_pb2.Camera:
    """A rectified camera as a message."""
    return common_pb2.Camera(
        f=camera.f, cx=camera.cx, cy=camera.cy, baseline=camera.baseline, width=camera.width, height=camera.height
    )


def read_camera(message: common_pb2.Camera) -> StereoCamera:
    """The rectified camera of a message."""
    return StereoCamera(message.f, message.cx, message.cy, message.baseline, message.width, message.height)


_RAW_FIELDS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


def raw_message(raw: RawStereo) -> common_pb2.RawStereo:
    """A rig before rectification as a message."""
    message = common_pb2.RawStereo(width=raw.width, height=raw.height)
    for name in _RAW_FIELDS:
        setattr(message.left, name, getattr(raw.left, name))
        if raw.right is not None:
            setattr(message.right, name, getattr(raw.right, name))
    if raw.right is not None:
        message.right_from_left.CopyFrom(transform_message(raw.T_right_left))
    return message


def read_raw(message: common_pb2.RawStereo) -> RawStereo:
    """The rig before rectification of a message."""
    left, right = message.left, message.right
    return RawStereo(
        RawCamera(*(getattr(left, name) for name in _RAW_FIELDS)),
        RawCamera(*(getattr(right, name) for name in _RAW_FIELDS)) if message.HasField("right") else None,
        read_transform(message.right_from_left),
        message.width,
        message.height,
    )
