"""Hand-worked attitudes (REP-103): positive pitch lowers the nose, positive roll the right side."""

import numpy as np
import pytest

import wade

QUARTER = np.pi / 2
HALF = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("roll", "pitch", "quaternion", "down"),
    [
        (0.0, 0.0, (1, 0, 0, 0), (0, 0, -1)),
        (0.0, QUARTER, (HALF, 0, HALF, 0), (1, 0, 0)),  # nose down: gravity points forward
        (QUARTER, 0.0, (HALF, HALF, 0, 0), (0, -1, 0)),  # on its right side: gravity points right
        (0.0, 0.0, (HALF, 0, 0, HALF), (0, 0, -1)),  # yaw changes nothing
        (np.pi, 0.0, (0, 3, 0, 0), (0, 0, 1)),  # on its roof, by a quaternion of length 3
    ],
)
def test_gravity(roll: float, pitch: float, quaternion: tuple[float, ...], down: tuple[float, ...]) -> None:
    np.testing.assert_allclose(wade.gravity_from_roll_pitch(roll, pitch), down, atol=1e-15)
    np.testing.assert_allclose(wade.gravity_from_quaternion(quaternion), down, atol=1e-15)


def test_rows_are_taken_alone() -> None:
    roll, pitch = np.array([0.1, -0.2, 0.3]), 0.25
    rows = wade.gravity_from_roll_pitch(roll, pitch)
    assert rows.shape == (3, 3)
    np.testing.assert_array_equal(rows[1], wade.gravity_from_roll_pitch(-0.2, 0.25))
    quaternions = np.random.default_rng(3).normal(size=(4, 4))
    np.testing.assert_allclose(np.linalg.norm(wade.gravity_from_quaternion(quaternions), axis=1), 1.0)
    np.testing.assert_array_equal(
        wade.gravity_from_quaternion(quaternions)[2], wade.gravity_from_quaternion(quaternions[2])
    )
