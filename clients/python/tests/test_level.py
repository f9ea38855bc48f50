"""The water level, the bed and the terms of the base, the same over every transport."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import wade


def test_a_depth_may_be_negative(client: Any) -> None:
    forces = client.evaluate("husky", wade.State(depth_m=-0.05))
    assert np.array_equal(forces.force_n, np.zeros(3))


def test_a_water_level_is_a_depth_above_the_contact_plane(client: Any) -> None:
    z0 = -0.1845
    by_depth = client.evaluate("husky", wade.State(depth_m=0.15, velocity_mps=(0.5, 0, 0)))
    by_level = client.evaluate("husky", wade.State(water_level_m=z0 + 0.15, velocity_mps=(0.5, 0, 0)))
    assert np.allclose(by_depth.force_n, by_level.force_n, rtol=1e-4)
    levels = wade.State(water_level_m=[z0 + 0.15, z0 + 0.18], velocity_mps=(0.5, 0, 0))
    batch = client.evaluate_batch("husky", levels)
    assert np.array_equal(batch.force_n[0], by_level.force_n)


def test_on_its_back_a_vehicle_has_a_water_level_only(client: Any) -> None:
    inverted = wade.gravity_from_roll_pitch(math.pi, 0.0)
    with pytest.raises(wade.InvalidState, match="water_level_m"):
        client.evaluate("husky", wade.State(depth_m=0.1, gravity_direction=inverted))
    forces = client.evaluate("husky", wade.State(water_level_m=0.3, gravity_direction=inverted))
    # the whole hull is under water, and up is the body's -z
    assert forces.force_n[2] < -1000.0


def test_bed_and_physics_travel(client: Any) -> None:
    state = wade.State(depth_m=0.15, bed_clearance_m=0.2, bed=1.0, physics=wade.Physics.QUASI_STEADY)
    assert np.isfinite(client.evaluate("husky", state).force_n).all()
