"""What a keyframe measures: tracks, from which landmarks are made, and appearance, by which places are recognised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

from relmap.geometry import Array, ArrayLike, frozen
from relmap.record import Record
from relmap.v1 import common_pb2

MAX_MEASUREMENTS = 1024
"""The most tracks, and the most appearance features, that a keyframe or view may have."""


def _column(what: str, values: Optional[ArrayLike], dtype: Any, count: Optional[int], nan: bool = False) -> Array:
    if values is None:
        assert count is not None
        return frozen(np.full(count, -1 if np.issubdtype(dtype, np.integer) else np.nan, dtype=dtype))
    given = np.asarray(values)
    if given.ndim != 1 or (count is not None and given.shape[0] != count):
        raise ValueError(f"{what} has shape {given.shape}; must be ({'n' if count is None else count},)")
    if np.issubdtype(dtype, np.integer):
        limits = np.iinfo(dtype)
        if given.size and (given.dtype.kind not in "iu" or given.min() < limits.min or given.max() > limits.max):
            raise ValueError(f"{what} must be whole numbers {limits.min}..{limits.max}")
    elif given.size and (np.isinf(given.astype(float)).any() or (not nan and np.isnan(given.astype(float)).any())):
        raise ValueError(f"{what} is not finite")
    return frozen(np.array(given, dtype=dtype))


def _count(what: str, count: int) -> None:
    if count > MAX_MEASUREMENTS:
        raise ValueError(f"{count} {what}; at most {MAX_MEASUREMENTS}")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Tracks(Record):
    """Tracked points of a keyframe, one element each in every array. ValueError: shapes differ, or a number is impossible.

    Attributes:
        sequence: uint32 (n,), the sequence of the keyframe that introduced the track; with `index` it names the track.
        index: uint32 (n,), its place among the tracks of that keyframe.
        u_left, v: float32 (n,), pixels in the rectified left picture.
        u_right: float32 (n,), pixels in the rectified right one; NaN if only the left eye sees it. At most u_left.
        level: uint8 (n,), pyramid level at which it was measured, 0..7: its deviation is 2^level pixels.
    """

    sequence: Array
    index: Array
    u_left: Array
    v: Array
    u_right: Array
    level: Array

    def __post_init__(self) -> None:
        sequence = _column("sequence", self.sequence, np.uint32, None)
        n = len(sequence)
        _count("tracks", n)
        object.__setattr__(self, "sequence", sequence)
        object.__setattr__(self, "index", _column("index", self.index, np.uint32, n))
        object.__setattr__(self, "u_left", _column("u_left", self.u_left, np.float32, n))
        object.__setattr__(self, "v", _column("v", self.v, np.float32, n))
        object.__setattr__(self, "u_right", _column("u_right", self.u_right, np.float32, n, nan=True))
        object.__setattr__(self, "level", _column("level", self.level, np.uint8, n))
        if n and self.level.max() > 7:
            raise ValueError(f"a track at level {self.level.max()}; at most 7")
        if np.any(self.u_right > self.u_left):
            raise ValueError("u_right must not be greater than u_left")
        if len(np.unique(np.stack([self.sequence, self.index]), axis=1).T) != n:
            raise ValueError("a track occurs twice")

    @staticmethod
    def none() -> "Tracks":
        """No tracks."""
        return Tracks(*(np.empty(0, np.uint32),) * 2, *(np.empty(0, np.float32),) * 3, np.empty(0, np.uint8))

    def __len__(self) -> int:
        return len(self.sequence)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Features(Record):
    """Appearance features: SIFT at blobs, by which a place is recognised. ValueError: shapes differ, or numbers are impossible.

    Attributes:
        u, v: float32 (n,), pixels in the rectified left picture.
        scale: float32 (n,), diameter of the described region in pixels, above 0.
        angle: float32 (n,), radians.
        sift: uint8 (n, 128), descriptors; as whole float numbers 0..255, too, as OpenCV gives them.
        disparity: float32 (n,), u_left - u_right in pixels, at least 0; NaN if it was not measured. None: of none.
        track: int16 (n,), the position of its track among the keyframe's tracks, or -1. None: none has one.
    """

    u: Array
    v: Array
    scale: Array
    angle: Array
    sift: Array
    disparity: Array = None  # type: ignore[assignment]  # becomes an array
    track: Array = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        u = _column("u", self.u, np.float32, None)
        n = len(u)
        _count("features", n)
        object.__setattr__(self, "u", u)
        for name in ("v", "scale", "angle"):
            object.__setattr__(self, name, _column(name, getattr(self, name), np.float32, n))
        object.__setattr__(self, "disparity", _column("disparity", self.disparity, np.float32, n, nan=True))
        object.__setattr__(self, "track", _column("track", self.track, np.int16, n))
        sift = np.array(self.sift)
        if sift.dtype.kind == "f" and np.all((sift >= 0) & (sift <= 255) & (sift == np.rint(sift))):
            sift = sift.astype(np.uint8)  # as OpenCV gives them
        if sift.shape != (n, 128) or sift.dtype != np.uint8:
            raise ValueError(f"sift has shape {sift.shape} of {sift.dtype}; must be ({n}, 128) of uint8, or of whole numbers 0..255")
        object.__setattr__(self, "sift", frozen(sift))
        if np.any(self.scale <= 0):
            raise ValueError("scale must be above 0")
        if np.any(self.disparity < 0):
            raise ValueError("disparity must not be negative")
        if np.any(self.track < -1):
            raise ValueError("track must be -1 or the position of a track")

    @staticmethod
    def none() -> "Features":
        """No features."""
        return Features(*(np.empty(0, np.float32),) * 4, np.empty((0, 128), np.uint8))

    def __len__(self) -> int:
        return len(self.u)


def feature_set_message(features: Features) -> common_pb2.FeatureSet:
    """Features as a message of a view; their tracks are not sent."""
    message = common_pb2.FeatureSet()
    columns = (features.u, features.v, features.disparity, features.scale, features.angle)
    rows = zip(*(column.tolist() for column in columns), features.sift)
    for u, v, disparity, scale, angle, sift in rows:
        feature = message.features.add(u=u, v=v, scale=scale, angle=angle, sift=sift.tobytes())
        if disparity == disparity:
            feature.disparity = disparity
    return message


def read_feature_set(message: common_pb2.FeatureSet) -> Features:
    """The features of a message."""
    all_of = message.features
    sift = np.frombuffer(b"".join(f.sift for f in all_of), dtype=np.uint8).reshape(len(all_of), -1)
    return Features(
        np.array([f.u for f in all_of], np.float32),
        np.array([f.v for f in all_of], np.float32),
        np.array([f.scale for f in all_of], np.float32),
        np.array([f.angle for f in all_of], np.float32),
        sift if len(all_of) else np.empty((0, 128), np.uint8),
        np.array([f.disparity if f.HasField("disparity") else np.nan for f in all_of], np.float32),
    )
