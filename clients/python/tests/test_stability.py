"""How a vehicle stands: the same from every client that answers it, by the shape of what was asked."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import numpy as np
import pytest
from conftest import connect
from servers import Server

import wade

CLIENTS = ("tcp", "unix", "asyncio", "in_process")


@pytest.fixture
def client_of(server: Server, loop: asyncio.AbstractEventLoop) -> Iterator[Callable[[str], Any]]:
    with ExitStack() as clients:
        yield lambda kind: clients.enter_context(connect(kind, server, loop))


@pytest.fixture(params=CLIENTS)
def asked(request: pytest.FixtureRequest, client_of: Any) -> Any:
    return client_of(request.param)


def test_shapes_are_those_of_depths_and_speeds(asked: Any) -> None:
    one = asked.stability("husky", wade.Ford(depth_m=0.15, speed_mps=1.0, normal_forces=True))
    assert one.probability.floats.shape == () and one.in_domain.shape == ()
    assert one.normal_force_n.shape == (4,)
    assert [foot.surface for foot in one.feet] == ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"]
    depths, speeds = np.linspace(0.0, 0.3, 6), np.linspace(0.0, 2.0, 5)
    grid = asked.stability("husky", wade.Ford(depth_m=depths, speed_mps=speeds))
    assert grid.probability.slides.shape == (6, 5) and grid.margin.steers.shape == (6, 5)
    assert grid.normal_force_n is None
    assert np.all(grid.risk()[0] == 0.0), "dry"
    row = asked.stability("husky", wade.Ford(depth_m=depths[3], speed_mps=speeds))
    np.testing.assert_array_equal(row.probability.slides, grid.probability.slides[3])


def test_every_client_has_the_same_bits(client_of: Any) -> None:
    ford = wade.Ford(
        depth_m=np.linspace(0.05, 0.6, 9),
        speed_mps=np.linspace(0.0, 2.5, 7),
        heading_rad=1.1,
        friction=(0.4, 0.7),
        density_kgpm3=1030.0,
        roll_pitch_rad=(0.1, -0.05),
        ground_contact=wade.GroundContact.DRY,
        bed=0.5,
        normal_forces=True,
    )
    answers = [client_of(name).stability("warthog", ford) for name in CLIENTS]
    for answer in answers[1:]:
        for modes in ("probability", "margin"):
            for name in ("floats", "slides", "topples", "steers"):
                a, b = (getattr(getattr(one, modes), name) for one in (answers[0], answer))
                np.testing.assert_array_equal(a, b, err_msg=name)
        np.testing.assert_array_equal(answers[0].normal_force_n, answer.normal_force_n)
        np.testing.assert_array_equal(answers[0].in_domain, answer.in_domain)
        assert answer.friction == answers[0].friction


def test_a_map_of_a_hundred_thousand_states_is_one_call(client_of: Any) -> None:
    ford = wade.Ford(depth_m=np.linspace(0.0, 0.4, 400), speed_mps=np.linspace(0.0, 2.0, 250))
    assert client_of("tcp").stability("husky", ford).risk().shape == (400, 250)


def test_what_is_wrong_is_named(asked: Any) -> None:
    sound: dict[str, Any] = {"depth_m": 0.1, "speed_mps": 1.0}
    cases: list[tuple[dict[str, Any], str, int | None]] = [
        ({"depth_m": [0.1, np.nan]}, "depth_m", 1),
        ({"speed_mps": -1.0}, "speed_mps", 0),
        ({"friction": 0.0}, "friction_min", None),
        ({"roll_pitch_rad": (1.6, 0.0)}, "roll_pitch", None),
        ({"speed_mps": np.ones(100_001)}, "depth_m", None),
    ]
    for change, field, index in cases:
        with pytest.raises(wade.InvalidState) as caught:
            asked.stability("husky", wade.Ford(**(sound | change)))
        violation = caught.value.violations[0]
        assert (violation.field, violation.index) == (field, index)
    with pytest.raises(wade.UnknownVehicle):
        asked.stability("hovercraft", wade.Ford(depth_m=0.1, speed_mps=1.0))
