"""Bad input gets a typed error that names the field, the same from every client, and the next good call works."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import wade

NAN, INFINITY = float("nan"), float("inf")
GOOD = wade.State(depth_m=0.15, velocity_mps=(0.5, 0, 0))

# a field, a value that the server refuses, and what it must say
REFUSED = [
    ("velocity_mps", (NAN, 0, 0), "finite"),
    ("current_mps", (0, INFINITY, 0), "finite"),
    ("angular_velocity_radps", (0, 0, 1e9), ""),
    ("acceleration_mps2", (NAN, NAN, NAN), "finite"),
    ("angular_acceleration_radps2", (0, -1e9, 0), ""),
    ("gravity_direction", (0, 0, -0.5), "length 1"),
    ("gravity_direction", (0, NAN, -1), "finite"),
    ("depth_m", NAN, "must be given"),
    ("water_level_m", 0.1, "give one of the two"),
    ("bed_clearance_m", -0.1, "negative"),
    ("bed", 2.0, "between 0 (parked) and 1 (driving)"),
    ("depth_m", 1e39, "finite"),  # more than single precision holds
    ("density_kgpm3", 0.0, "greater than zero"),
    ("density_kgpm3", NAN, "finite"),
    ("heading_rad", NAN, "finite"),
    ("depth_rate_mps", -INFINITY, "finite"),
    ("wheel_speed_radps", (0, 0, NAN, 0), "finite"),
    ("wheel_speed_radps", (0, 0, 0, NAN), "finite"),
    ("wheel_speed_radps", (1, 2), "has 2 values, and the vehicle has 4 wheels"),
    ("wheel_speed_radps", (1, 2, 3, 4, 5, 6), "has 6 values, and the vehicle has 4 wheels"),
    ("time_step_s", -0.001, "negative"),
    ("wave_amplitude_m", -0.1, "negative"),
    ("wave_vector_radpm", (NAN, 0, 0), "finite"),
    ("wave_phase_rad", INFINITY, "finite"),
    ("wheel_water_level_m", (1, 2), "has 2 values, and the vehicle has 4 wheels"),
    ("wheel_water_level_m", (0, NAN, 0, 0), "finite"),
    ("current_exponent", -1.0, "negative"),
]

# a field and a value of the wrong shape, single and batch of two
MISSHAPEN = [
    ("velocity_mps", (1.0, 2.0), [(1.0, 2.0)] * 2),
    ("velocity_mps", 1.0, 1.0),
    ("current_mps", np.zeros(4), np.zeros((3, 3))),
    ("gravity_direction", np.zeros((3, 3)), np.zeros((2, 1, 3))),
    ("acceleration_mps2", None, [(1.0, 2.0, 3.0), (1.0,)]),
    ("density_kgpm3", (1000.0, 1000.0), np.full(3, 1000.0)),
    ("density_kgpm3", "salt", ["salt", "fresh"]),
    ("depth_m", (0.1, 0.1), 0.1),
    ("depth_m", None, []),
    ("depth_m", "deep", [[0.1, 0.2]]),
    ("heading_rad", (0.1, 0.2), np.zeros(3)),
    ("depth_rate_mps", "fast", "fast"),
    ("wheel_speed_radps", (1.0, 2.0, 3.0), np.zeros((2, 3))),
    ("wheel_speed_radps", (), np.zeros((2, 9))),
    ("wheel_speed_radps", 1.0, [1.0, 1.0]),
    ("wave_vector_radpm", (1.0, 2.0), [(1.0, 2.0)] * 2),
    ("wheel_water_level_m", (), np.zeros((2, 9))),
    ("wave_amplitude_m", "high", "high"),
    ("time_step_s", None, [0.1, 0.1, 0.1]),
    ("session", -1, [1, 2, 3]),
    ("session", 0.5, "first"),
]


@pytest.fixture(autouse=True)
def the_next_good_call_works(client: Any) -> Iterator[None]:
    yield
    assert client.evaluate("husky", GOOD).force_n[2] > 0


def state(name: str, value: Any, depth_m: Any = 0.15) -> wade.State:
    return wade.State(**{"depth_m": depth_m, name: value})


@pytest.mark.parametrize(("name", "value", "says"), REFUSED)
def test_a_refused_value_is_named(client: Any, name: str, value: Any, says: str) -> None:
    with client.stream("husky") as stream:
        for call in (lambda: client.evaluate("husky", state(name, value)), lambda: stream.evaluate(state(name, value))):
            with pytest.raises(wade.InvalidState, match=name) as caught:
                call()
            (violation,) = caught.value.violations
            assert violation.field == name and violation.index is None
            assert says in violation.description
        assert stream.evaluate(GOOD).force_n[2] > 0
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("index", [0, 2, 300])
def test_a_refused_value_in_a_batch_is_named_with_its_state(client: Any, index: int) -> None:
    velocity = np.full((400, 3), 0.25)
    velocity[index, 1] = NAN
    with pytest.raises(wade.InvalidState) as caught:
        client.evaluate_batch("husky", wade.State(depth_m=np.full(400, 0.1), velocity_mps=velocity))
    (violation,) = caught.value.violations
    assert (violation.field, violation.index) == ("velocity_mps", index)
    assert str(violation.index) in str(caught.value)


@pytest.mark.parametrize(("name", "single", "batch"), MISSHAPEN)
def test_a_wrong_shape_is_named(client: Any, name: str, single: Any, batch: Any) -> None:
    with pytest.raises(wade.InvalidState) as caught:
        client.evaluate("husky", state(name, single))
    assert caught.value.violations[0].field == name
    with pytest.raises(wade.InvalidState) as caught:
        client.evaluate_batch("husky", state(name, batch, [0.1, 0.1]))
    assert caught.value.violations[0].field == name


@pytest.mark.parametrize("vehicle", ["tank", "", "x" * 300, "Husky"])
def test_an_unknown_vehicle_is_named(client: Any, vehicle: str) -> None:
    calls = [
        lambda: client.evaluate(vehicle, GOOD),
        lambda: client.evaluate_batch(vehicle, wade.State(depth_m=[0.1])),
        lambda: client.stream(vehicle).evaluate(GOOD),
    ]
    for call in calls:
        with pytest.raises(wade.UnknownVehicle) as caught:
            call()
        assert caught.value.vehicle[:50] == vehicle[:50]  # the server cuts a long one
        assert "husky" in str(caught.value)


def test_no_time_is_not_enough(client: Any) -> None:
    with client.stream("husky") as stream:
        calls = [
            lambda: client.evaluate("husky", GOOD, timeout_s=0),
            lambda: client.evaluate_batch("husky", wade.State(depth_m=[0.1]), timeout_s=0.0),
            lambda: stream.evaluate(GOOD, timeout_s=0),
        ]
        for call in calls:
            with pytest.raises(wade.DeadlineExceeded) as caught:
                call()
            assert caught.value.timeout_s == 0
        assert stream.evaluate(GOOD).force_n[2] > 0
    assert isinstance(caught.value, TimeoutError)


@pytest.mark.parametrize("timeout_s", [-1, NAN, INFINITY, "1"])
def test_a_time_that_is_none_is_refused(client: Any, timeout_s: Any) -> None:
    with pytest.raises(ValueError, match="timeout_s"):
        client.evaluate("husky", GOOD, timeout_s=timeout_s)


def test_the_servers_limit_on_batches_is_an_error_of_the_batch(server: Any) -> None:
    with wade.GrpcClient(server.address, timeout_s=20.0) as client:
        with pytest.raises(wade.InvalidState, match=r"4097.*4096") as caught:
            client.evaluate_batch("husky", wade.State(depth_m=np.full(4097, 0.1)))
    assert caught.value.violations[0].field == "depth_m"
