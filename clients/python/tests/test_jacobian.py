from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from servers import Server

import wade

EXAMPLES = Path(__file__).parents[1] / "examples"

#: Inputs of the columns: what the state calls them, and which of their numbers.
COLUMNS: list[tuple[str, int | None]] = [("velocity_mps", axis) for axis in range(3)]
COLUMNS += [("angular_velocity_radps", axis) for axis in range(3)]
COLUMNS += [("water_level_m", None)]


def _state() -> wade.State:
    return wade.State(
        water_level_m=0.05,
        velocity_mps=(0.7, 0.2, 0.05),
        angular_velocity_radps=(0.1, -0.2, 0.3),
        jacobian=True,
    )


def _moved(state: wade.State, name: str, axis: int | None, step: float) -> wade.State:
    value = np.array(getattr(state, name), float)
    if axis is None:
        value += step
    else:
        value[axis] += step
    moved: dict[str, Any] = {name: value}
    return replace(state, **moved)


@pytest.mark.parametrize("vehicle", ["husky", "warthog"])
def test_the_derivatives_are_those_of_the_wrench(client: Any, vehicle: str) -> None:
    state = _state()
    forces = client.evaluate(vehicle, state)
    assert forces.jacobian is not None
    assert forces.jacobian.shape == (6, 11)
    for column, (name, axis) in enumerate(COLUMNS):
        step = 1e-2
        ahead, behind = (client.evaluate(vehicle, _moved(state, name, axis, sign * step)) for sign in (1, -1))
        difference = np.hstack([ahead.force_n - behind.force_n, ahead.moment_nm - behind.moment_nm]) / (2 * step)
        found = forces.jacobian[:, column]
        # single precision, and a step that sees units of the network switch
        assert np.linalg.norm(found - difference) < 0.05 * np.linalg.norm(difference), (name, axis)


def test_a_batch_has_the_bits_of_its_states_alone(client: Any) -> None:
    levels = np.array([-0.05, 0.0, 0.08], np.float32)
    states = replace(_state(), water_level_m=levels, velocity_mps=(0.5, 0.1, 0.0))
    for surfaces in (True, False):
        batch = client.evaluate_batch("husky", states, surfaces=surfaces)
        for row, level in enumerate(levels):
            alone = client.evaluate("husky", replace(states, water_level_m=float(level)))
            assert np.array_equal(batch.jacobian[row], alone.jacobian)
    assert client.evaluate("husky", replace(_state(), jacobian=False)).jacobian is None


def test_a_planned_crossing_arrives_as_well_as_with_differences(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(EXAMPLES)
    example = importlib.import_module("planned_crossing")
    exact, differences = example.main(["--address", server.address])
    for plan in (exact, differences):
        assert np.linalg.norm((plan["end"] - example.GOAL)[:3]) < 0.01, plan
    assert exact["cost"] == pytest.approx(differences["cost"], rel=0.01)
