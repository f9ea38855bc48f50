"""What people type and print: attitudes of any kind, poses in the world, short answers, help and clear errors."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wade

PYPROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"


def close(a: Any, b: Any, rtol: float = 1e-7, atol: float = 1e-12) -> None:
    np.testing.assert_allclose(np.asarray(a, float), np.asarray(b, float), rtol=rtol, atol=atol)


def quaternion(axis: tuple[float, float, float], angle: float) -> np.ndarray[Any, Any]:
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.array(axis))])


def product(a: Any, b: Any) -> np.ndarray[Any, Any]:
    (w, x, y, z), (p, q, r, s) = a, b
    vector = (w * q + x * p + y * s - z * r, w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p)
    return np.array([w * p - x * q - y * r - z * s, *vector])


def yaw_pitch_roll(yaw: float, pitch: float, roll: float) -> np.ndarray[Any, Any]:
    about = [quaternion((0, 0, 1), yaw), quaternion((0, 1, 0), pitch), quaternion((1, 0, 0), roll)]
    return product(product(about[0], about[1]), about[2])


def test_the_version_is_that_of_the_package() -> None:
    found = re.search(r'^version = "(.*)"', PYPROJECT.read_text(), re.MULTILINE)
    assert found and wade.__version__ == found[1]


def test_roll_pitch_and_quaternions_set_gravity_and_heading() -> None:
    by_angles = wade.State(depth_m=0.1, roll_pitch_rad=(0.1, -0.2))
    close(by_angles.gravity_direction, wade.gravity_from_roll_pitch(0.1, -0.2))
    by_quaternion = wade.State(depth_m=0.1, world_from_body=yaw_pitch_roll(0.7, -0.2, 0.1))
    close(by_quaternion.gravity_direction, by_angles.gravity_direction)
    close(by_quaternion.heading_rad, 0.7)
    assert wade.State(depth_m=0.1, world_from_body=(1, 0, 0, 0), heading_rad=0.3).heading_rad == 0.3
    rows = wade.State(depth_m=np.full(2, 0.1), roll_pitch_rad=[(0.1, -0.2), (0.0, 0.0)]).rows()
    close(rows["gravity_direction"][1], (0, 0, -1))
    cases: list[tuple[dict[str, Any], str]] = [
        ({"roll_pitch_rad": (0, 0), "world_from_body": (1, 0, 0, 0)}, "both"),
        ({"roll_pitch_rad": (0, 0), "gravity_direction": (0, 0, -1.0)}, "both"),
        ({"roll_pitch_rad": 0.1}, "roll_pitch_rad"),
        ({"world_from_body": (1, 0, 0)}, "world_from_body"),
    ]
    for wrong, word in cases:
        with pytest.raises(wade.InvalidState, match=word):
            wade.State(depth_m=0.1, **wrong)
    again = dataclasses.replace(by_angles, depth_m=0.2)
    close(again.gravity_direction, by_angles.gravity_direction)


def test_a_pose_in_the_world_has_the_forces_of_the_state_in_the_body(client: Any) -> None:
    turn = yaw_pitch_roll(2.1, 0.15, -0.1)
    position, velocity, rates, current = (3.0, -4.0, 10.2), (0.6, 0.3, -0.1), (0.1, -0.2, 0.3), (0.2, 0.0, 0.0)
    state = wade.state_in_world(
        position_m=position,
        world_from_body=turn,
        velocity_mps=velocity,
        angular_velocity_radps=rates,
        current_mps=current,
        water_level_m=10.25,
    )
    assert state.water_level_m == pytest.approx(0.05)
    forces = client.evaluate("husky", state)
    force, moment, about = wade.wrench_in_world(forces, turn, position)
    # lengths do not turn, and power is the same in both frames
    assert np.linalg.norm(force) == pytest.approx(np.linalg.norm(forces.force_n), rel=1e-6)
    assert np.dot(force, velocity) == pytest.approx(np.dot(forces.force_n, state.velocity_mps), rel=1e-5)
    assert np.dot(moment, rates) == pytest.approx(np.dot(forces.moment_nm, state.angular_velocity_radps), rel=1e-5)
    assert np.linalg.norm(about - np.array(position)) == pytest.approx(np.linalg.norm(forces.about_m), rel=1e-6)
    # the same vehicle elsewhere in the world and turned about up, with its water: the same forces in its body
    further = wade.state_in_world(
        position_m=(0.0, 0.0, 0.0),
        world_from_body=product(quaternion((0, 0, 1), np.pi / 2), turn),
        velocity_mps=(-velocity[1], velocity[0], velocity[2]),
        angular_velocity_radps=(-rates[1], rates[0], rates[2]),
        current_mps=(0.0, 0.2, 0.0),
        water_level_m=0.05,
    )
    close(client.evaluate("husky", further).force_n, forces.force_n, rtol=1e-4, atol=1e-3)


def test_an_answer_prints_in_a_line_or_two(client: Any) -> None:
    one = repr(client.evaluate("husky", wade.State(depth_m=0.15)))
    assert one.startswith("Forces(force_n=[") and "in_domain=True" in one and len(one) < 300, one
    many = repr(client.evaluate_batch("husky", wade.State(depth_m=np.linspace(0.1, 0.2, 50))))
    assert "[50]" in many and "force_n=<50x3>" in many and len(many) < 300, many
    assert repr(wade.State(depth_m=0.15, velocity_mps=(1, 0, 0))) == "State(depth_m=0.15, velocity_mps=[1, 0, 0])"


def test_help_says_what_every_field_is() -> None:
    for kind in (wade.State, wade.Forces, wade.Ford, wade.Stability):
        text = kind.__doc__ or ""
        undocumented = [field.name for field in dataclasses.fields(kind) if f"        {field.name}: " not in text]
        assert undocumented == [], kind


def test_swapped_arguments_are_named(client: Any) -> None:
    for call in (client.evaluate, client.evaluate_batch):
        with pytest.raises(TypeError, match=r"evaluate\(vehicle, state\) takes"):
            call(wade.State(depth_m=0.1), "husky")
