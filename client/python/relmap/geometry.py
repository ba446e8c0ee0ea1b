"""SE(3) in numpy, with the conventions of all of relmap.

``T_ab`` maps coordinates in frame b to frame a: ``p_a = T_ab @ p_b``, as a 4 x 4 matrix of float64. Lengths are in
metres, angles in radians. A camera frame is x right, y down, z forward; a keyframe's frame is its rectified left camera.
A covariance of ``T_ab`` is 6 x 6, that of ``xi = (rho, phi)`` in ``T_ab @ exp(xi)``: translation first, expressed in b.
"""

from __future__ import annotations

import math
from typing import Any, Sequence, Union

import numpy as np
import numpy.typing as npt

from relmap.enums import NamedEnum
from relmap.v1 import common_pb2

Array = npt.NDArray[Any]
"""An array of numpy. The docstring of what returns one says shape and type; none that relmap returns can be written."""
ArrayLike = Union[npt.ArrayLike, Sequence[float]]
"""What numpy makes an array of."""


class PoseKind(NamedEnum):
    """What a pose is. The map has no global coordinates, so a pose is always relative to something."""

    RELATIVE = "relative"
    """Between two frames of the map, along its edges: the map's own estimate."""
    ODOMETRY = "odometry"
    """Along the motion of one session, chained: locally exact, drifts with the distance, knows of no closure."""
    RELAXED_PICTURE = "relaxed_picture"
    """For a picture only: cycles are bent until they close. Never measure distances in it; ask for a transform instead."""


_UPPER = np.triu_indices(6)
_PLACE = np.empty((6, 6), dtype=np.intp)
_PLACE[_UPPER] = np.arange(21)
_PLACE.T[_UPPER] = np.arange(21)
_GRID = 2.0**46
_MAX_CORRELATION_ERROR = 1e-9


def frozen(array: Array) -> Array:
    """The same array, which can no longer be written."""
    array.setflags(write=False)
    return array


def skew(v: Array) -> Array:
    """The matrix [v]x (..., 3, 3) of the cross product with `v` (..., 3)."""
    K = np.zeros((*np.shape(v), 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = np.moveaxis(v, -1, 0)
    return np.asarray(K - np.swapaxes(K, -1, -2))


def so3_exp(phi: Array) -> Array:
    """The rotations (..., 3, 3) of rotation vectors (..., 3, radians)."""
    angle = np.sqrt(np.sum(phi * phi, axis=-1))[..., None, None]
    K = skew(phi)
    safe = np.where(angle < 1e-8, 1.0, angle)
    first = np.where(angle < 1e-8, 1.0, np.sin(safe) / safe)
    second = np.where(angle < 1e-8, 0.5, (1 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + first * K + second * (K @ K))


def so3_log(R: Array) -> Array:
    """The rotation vectors (..., 3, radians, of length 0..pi) of rotations (..., 3, 3)."""
    q = _quaternions(R)
    v = q[..., 1:] * np.where(q[..., :1] < 0, -1.0, 1.0)
    sine = np.sqrt(np.sum(v * v, axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, np.abs(q[..., :1]))
    return np.asarray(np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 1e-12) * v)


def _quaternions(R: Array) -> Array:
    """The quaternions (..., 4: w, x, y, z) of rotations (..., 3, 3), of unit length: of the four ways to compute one that
    which divides by the largest number."""
    d = np.stack([np.trace(R, axis1=-2, axis2=-1), R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]], axis=-1)
    x, y, z = (R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1])
    xy, xz, yz = (R[..., i, j] + R[..., j, i] for i, j in ((0, 1), (0, 2), (1, 2)))
    square = [1 + d[..., 0], *(1 - d[..., 0] + 2 * d[..., k] for k in (1, 2, 3))]
    ways = ((square[0], x, y, z), (x, square[1], xy, xz), (y, xy, square[2], yz), (z, xz, yz, square[3]))
    way = np.argmax(d, axis=-1)[..., None]
    q = np.select([way == k for k in range(4)], [np.stack(one, axis=-1) for one in ways])
    return np.asarray(q / np.sqrt(np.sum(q * q, axis=-1, keepdims=True)))


def _left_jacobian(phi: Array) -> Array:
    angle = float(np.sqrt(np.dot(phi, phi)))
    K = skew(phi)
    if angle < 1e-6:
        return np.asarray(np.eye(3) + 0.5 * K + K @ K / 6)
    a, b = (1 - math.cos(angle)) / angle**2, (angle - math.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + a * K + b * (K @ K))


def exp(xi: ArrayLike) -> Array:
    """The transform (4 x 4) of xi (6: translation part rho, then rotation vector phi)."""
    v = np.asarray(xi, dtype=float)
    T = np.eye(4)
    T[:3, :3] = so3_exp(v[3:])
    T[:3, 3] = _left_jacobian(v[3:]) @ v[:3]
    return T


def log(T: Array) -> Array:
    """xi (6: rho, phi) of a transform (4 x 4); the inverse of exp()."""
    phi = so3_log(T[:3, :3])
    return np.concatenate([np.linalg.solve(_left_jacobian(phi), T[:3, 3]), phi])


def inverse(T: Array) -> Array:
    """T_ba, given T_ab (4 x 4)."""
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out


def adjoint(T: Array) -> Array:
    """Ad(T) (6 x 6): T exp(xi) T^-1 = exp(Ad(T) xi)."""
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = T[:3, :3]
    out[:3, 3:] = skew(T[:3, 3]) @ T[:3, :3]
    return out


def compound_covariance(cov_ab: Array, T_bc: Array, cov_bc: Array) -> Array:
    """The covariance (6 x 6) of T_ab T_bc if the two are independent."""
    A = adjoint(inverse(T_bc))
    return np.asarray(A @ cov_ab @ A.T + cov_bc)


def chain(steps: Sequence[Array]) -> Array:
    """The poses (n + 1, 4, 4) in the first frame of consecutive steps T_this_next (each 4 x 4); the first is the identity."""
    out = np.empty((len(steps) + 1, 4, 4))
    out[0] = np.eye(4)
    for i, step in enumerate(steps):
        out[i + 1] = out[i] @ step
    return out


def matrix_of_quaternion(w: float, x: float, y: float, z: float) -> Array:
    """The rotation (3 x 3) of a quaternion; ValueError if its length is not 1 within 1e-6."""
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not abs(length - 1) <= 1e-6:
        raise ValueError(f"a quaternion of length {length}; must be 1")
    w, x, y, z = w / length, x / length, y / length, z / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(R: Array) -> tuple[float, float, float, float]:
    """The quaternion (w, x, y, z) of a rotation (3 x 3), of unit length."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    trace = a + e + i
    if trace > 0:
        s = math.sqrt(trace + 1.0)
        k = 0.5 / s
        return 0.5 * s, (h - f) * k, (c - g) * k, (d - b) * k
    if a >= e and a >= i:
        s = math.sqrt(a - e - i + 1.0)
        k = 0.5 / s
        return (h - f) * k, 0.5 * s, (b + d) * k, (c + g) * k
    if e >= i:
        s = math.sqrt(e - i - a + 1.0)
        k = 0.5 / s
        return (c - g) * k, (b + d) * k, 0.5 * s, (f + h) * k
    s = math.sqrt(i - a - e + 1.0)
    k = 0.5 / s
    return (d - b) * k, (c + g) * k, (f + h) * k, 0.5 * s


def _on_grid(R: Array) -> tuple[float, float, float, float]:
    q = list(quaternion_of(R))
    largest_size = max(abs(c) for c in q)
    largest = next(i for i in range(4) if i == 3 or abs(q[i]) >= largest_size - 1e-9)
    rest = 1.0
    for i in range(4):
        if i != largest:
            q[i] = math.copysign(math.floor(abs(q[i] * _GRID) + 0.5), q[i]) / _GRID
            rest -= q[i] * q[i]
    q[largest] = math.copysign(math.sqrt(rest), q[largest])
    sign = -1.0 if next((c for c in q if c != 0), 1.0) < 0 else 1.0
    w, x, y, z = (c * sign + 0.0 for c in q)
    return w, x, y, z


def canonical_quaternion(R: Array) -> tuple[float, float, float, float]:
    """The quaternion (w, x, y, z) in which relmap writes a rotation (3 x 3): equal rotations give equal bytes.

    The first nonzero component is positive, three are multiples of 2^-46, and the largest completes them to unit length.
    """
    q = _on_grid(R)
    for _ in range(4):  # rounding can move two components across the threshold
        again = _on_grid(matrix_of_quaternion(*q))
        if again == q:
            break
        q = again
    return q


def check_transform(T: ArrayLike, what: str = "the transform") -> Array:
    """`T` as a 4 x 4 array of float64. ValueError: another shape, not finite, or not a rigid transform."""
    matrix = np.array(T, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise ValueError(f"{what} has shape {matrix.shape}; must be (4, 4)")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{what} is not finite")
    R = matrix[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > 1e-5 or np.linalg.det(R) < 0 or np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
        raise ValueError(f"{what} is not a rigid transform: its upper left 3 x 3 must be a rotation, its last row 0 0 0 1")
    return matrix


def check_covariance(cov: ArrayLike, what: str = "the covariance") -> Array:
    """`cov` as a 6 x 6 array of float64. ValueError: another shape, not finite, not symmetric or positive definite."""
    matrix = np.array(cov, dtype=np.float64)
    if matrix.shape != (6, 6):
        raise ValueError(f"{what} has shape {matrix.shape}; must be (6, 6)")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{what} is not finite")
    variances = np.diag(matrix)
    if not (variances > 0).all():
        raise ValueError(f"{what} is not positive definite")
    scale = np.sqrt(np.outer(variances, variances))
    if np.abs((matrix - matrix.T) / scale).max() > _MAX_CORRELATION_ERROR:
        raise ValueError(f"{what} is not symmetric")
    try:
        np.linalg.cholesky(matrix / scale)
    except np.linalg.LinAlgError:
        raise ValueError(f"{what} is not positive definite") from None
    return matrix


def upper_triangle(cov: Array) -> Array:
    """The 21 numbers of a covariance (6 x 6) that are sent: its upper triangle, row by row."""
    return np.asarray(cov[_UPPER])


def covariance_of_upper(upper: ArrayLike) -> Array:
    """The covariance (6 x 6) of 21 numbers."""
    return np.asarray(np.asarray(upper, dtype=np.float64)[_PLACE])


def transform_message(T: Array) -> common_pb2.Transform:
    """A transform (4 x 4) as a message."""
    w, x, y, z = canonical_quaternion(T[:3, :3])
    a, b, c = T[:3, 3].tolist()
    return common_pb2.Transform(
        rotation=common_pb2.Quaternion(w=w, x=x, y=y, z=z), translation=common_pb2.Vector3(x=a, y=b, z=c)
    )


def covariance_message(cov: Array) -> common_pb2.Covariance:
    """A covariance (6 x 6) as a message."""
    return common_pb2.Covariance(upper=upper_triangle(cov).tolist())


def read_transform(message: common_pb2.Transform) -> Array:
    """The transform (4 x 4) of a message; the identity if it is not set. ValueError: it is no transform."""
    T = np.eye(4)
    q, t = message.rotation, message.translation
    if q.w or q.x or q.y or q.z:
        T[:3, :3] = matrix_of_quaternion(q.w, q.x, q.y, q.z)
    T[0, 3], T[1, 3], T[2, 3] = t.x, t.y, t.z
    return frozen(T)


def read_covariance(message: common_pb2.Covariance) -> Array:
    """The covariance (6 x 6) of a message; zeros if it is not set. ValueError: it does not have 21 numbers."""
    if len(message.upper) == 0:
        return frozen(np.zeros((6, 6)))
    if len(message.upper) != 21:
        raise ValueError(f"a covariance of {len(message.upper)} numbers; must be 21")
    return frozen(covariance_of_upper(message.upper))
