"""From the world frame of a simulator to a state, and from an answer back. World: z up; SI units."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .attitude import rotation
from .forces import Forces
from .state import State


def state_in_world(
    *,
    position_m: ArrayLike,
    world_from_body: ArrayLike,
    velocity_mps: ArrayLike,
    water_level_m: ArrayLike,
    angular_velocity_radps: ArrayLike = (0.0, 0.0, 0.0),
    current_mps: ArrayLike = (0.0, 0.0, 0.0),
    **others: Any,
) -> State:
    """The state of a vehicle by its pose and twist in the world; one vehicle, or `[N, ...]` of them.

    Args:
        position_m: Body origin, the center of the hull's bounding box, `[3]`.
        world_from_body: Quaternion (w, x, y, z) that takes body to world vectors, `[4]`.
        velocity_mps: Velocity of the body origin over ground, world axes, `[3]`.
        water_level_m: Height of the still water, world z.
        angular_velocity_radps: Angular velocity, world axes, `[3]`.
        current_mps: Velocity of the water over ground, world axes, `[3]`.
        others: Further fields of `State`, in the body frame.
    """
    body_from_world = np.swapaxes(rotation(world_from_body), -1, -2)

    def in_body(vector: ArrayLike) -> NDArray[np.float64]:
        return np.asarray((body_from_world @ np.asarray(vector, float)[..., None])[..., 0])

    return State(
        water_level_m=np.asarray(water_level_m, float) - np.asarray(position_m, float)[..., 2],
        world_from_body=world_from_body,
        velocity_mps=in_body(velocity_mps),
        angular_velocity_radps=in_body(angular_velocity_radps),
        current_mps=in_body(current_mps),
        **others,
    )


def wrench_in_world(
    forces: Forces, world_from_body: ArrayLike, position_m: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Net force [N], net moment [N m] and the point that it is about, the center of mass [m], in world axes."""
    world = rotation(world_from_body)

    def turned(vector: ArrayLike) -> NDArray[np.float64]:
        return np.asarray((world @ np.asarray(vector, float)[..., None])[..., 0])

    return turned(forces.force_n), turned(forces.moment_nm), np.asarray(position_m, float) + turned(forces.about_m)
