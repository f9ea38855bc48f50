"""How a vehicle stands, as the direction of gravity in its body frame (x forward, y left, z up)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def gravity_from_roll_pitch(roll_rad: ArrayLike, pitch_rad: ArrayLike) -> NDArray[np.float64]:
    """Unit vector along gravity, `[3]` or `[N, 3]`. Positive roll lowers the right side, positive pitch the nose."""
    roll, pitch = np.broadcast_arrays(np.asarray(roll_rad, float), np.asarray(pitch_rad, float))
    up = (-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch))
    return -np.stack(up, axis=-1)


def gravity_from_quaternion(world_from_body: ArrayLike) -> NDArray[np.float64]:
    """Unit vector along gravity, `[3]` or `[N, 3]`, from the quaternion (w, x, y, z) that takes body to world vectors.

    It is the negated last row of the rotation's matrix. The quaternion is normalized first.
    """
    return -rotation(world_from_body)[..., 2, :]


def heading_from_quaternion(world_from_body: ArrayLike) -> NDArray[np.float64]:
    """Angle from the world's x to the body's x in the horizontal plane [rad], one number or `[N]`."""
    matrix = rotation(world_from_body)
    return np.asarray(np.arctan2(matrix[..., 1, 0], matrix[..., 0, 0]))


def rotation(world_from_body: ArrayLike) -> NDArray[np.float64]:
    """The matrix that takes body to world vectors, `[3, 3]` or `[N, 3, 3]`. The quaternion is normalized first."""
    quaternion = np.asarray(world_from_body, float)
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    rows = [
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
