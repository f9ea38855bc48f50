"""Effects that were added to a model: the same from every client, with what they need to be told, and runs in time."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import EVERY_CLIENT, connect
from servers import VEHICLES, Server, binary, environment

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
from effects_by_hand import LIBRARY, add_effects, copy_with

STATE = wade.State(depth_m=0.15, velocity_mps=(0.5, 0.1, 0), acceleration_mps2=(1010.0, 0, 0))
#: What the effects need to be told, for three states.
TOLD: dict[str, Any] = {
    "heading_rad": np.array([0.5, -0.25, 3.0]),
    "depth_rate_mps": 0.125,
    "wheel_speed_radps": [(3.0, 3.0, 2.0, 2.0), (0, 0, 0, 0), (-1, -1, 4, 4)],
}
ARRAYS = (
    *("force_n", "moment_nm", "surface_force_n", "effect_force_n", "effect_moment_nm", "effect_left_out"),
    *("effect_surface_force_n", "effects_outside", "added_mass"),
)
MEMORY = (wade.Effect.HULL_FLOODING, wade.Effect.WAVE_MEMORY)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Whose vehicles have every effect."""
    folder = tmp_path_factory.mktemp("effects")
    server = Server(folder)
    server.start(copy_with({name: {} for name in LIBRARY}, folder / "vehicles", VEHICLES))
    yield server
    server.stop()


@pytest.fixture(params=EVERY_CLIENT)
def client(request: pytest.FixtureRequest, server: Server, loop: asyncio.AbstractEventLoop) -> Iterator[Any]:
    with connect(request.param, server, loop, timeout_s=20.0) as client:
        yield client


@pytest.fixture(scope="module")
def expected(server: Server) -> dict[str, Any]:
    """What the program itself says of `STATE`."""
    command: list[Any] = [binary(), "query", "--vehicle", "husky", "--vehicles", server.folder / "vehicles", "--json"]
    command += ["--velocity=0.5,0.1,0", "--acceleration=1010,0,0", "--depth=0.15"]
    return dict(json.loads(subprocess.run(command, capture_output=True, check=True, env=environment()).stdout))


def over_shm(server: Server) -> wade.Client:
    return wade.ShmClient(server.namespace, timeout_s=20.0)


def row(states: wade.State, i: int) -> wade.State:
    """One state of a batch."""
    names = ("depth_m", *TOLD)
    values = {name: getattr(states, name) for name in names}
    picked: dict[str, Any] = {
        name: value if np.ndim(value) == 0 else np.asarray(value)[i] for name, value in values.items()
    }
    return wade.State(**picked, velocity_mps=states.velocity_mps, implicit_added_mass=states.implicit_added_mass)


def test_the_effects_are_those_of_the_query_command(client: Any, expected: dict[str, Any]) -> None:
    forces = client.evaluate("husky", STATE)
    assert [wade.Effect(effect).name.lower() for effect in forces.effects] == [e["name"] for e in expected["effects"]]
    left_out = [wade.LeftOut(code).name.lower() if code else None for code in forces.effect_left_out]
    assert left_out == [effect["left_out"] for effect in expected["effects"]]
    assert {*left_out} == {None, "no_session", "no_heading", "no_wheel_speeds", "no_depth_rate"}
    for array, value in {
        "force_n": expected["wrench"]["force"],
        "effect_force_n": [effect["force"] for effect in expected["effects"]],
        "effect_moment_nm": [effect["moment"] for effect in expected["effects"]],
        "effect_surface_force_n": [surface["effects_force"] for surface in expected["surfaces"]],
        "added_mass": expected["added_mass"],
    }.items():
        np.testing.assert_array_equal(getattr(forces, array), np.array(value, np.float32), err_msg=array)
    # seen up to 1000 m/s2
    assert forces.effects_outside[wade.BoxQuantity.ACCELERATION] == pytest.approx(10.0)
    assert np.count_nonzero(forces.effects_outside) == len(expected["effects_outside"]) == 1


def test_surfaces_and_effects_sum_to_the_wrench(client: Any) -> None:
    forces = client.evaluate("husky", STATE)
    total = forces.surface_force_n.sum(axis=0) + forces.effect_force_n.sum(axis=0)
    np.testing.assert_allclose(forces.force_n, total, rtol=1e-5, atol=1e-2)
    moments = np.cross(forces.surface_point_m - forces.about_m, forces.surface_force_n).sum(axis=0)
    moments += forces.surface_couple_nm.sum(axis=0)
    np.testing.assert_allclose(forces.moment_nm, moments + forces.effect_moment_nm.sum(axis=0), rtol=1e-4, atol=1e-2)


def test_what_effects_are_told_brings_them_in(client: Any) -> None:
    state = wade.State(depth_m=0.15, heading_rad=0.5, depth_rate_mps=0.125, wheel_speed_radps=(3, 3, 3, 3))
    forces = client.evaluate("husky", state)
    left_out = {e: code for e, code in zip(forces.effects, forces.effect_left_out, strict=True) if code}
    assert left_out == dict.fromkeys(MEMORY, wade.LeftOut.NO_SESSION)
    at = forces.effects.index
    # wheels that turn forward push it on
    assert forces.effect_force_n[at(wade.Effect.WHEEL_PADDLE_THRUST), 0] > 0
    stated = client.evaluate("husky", wade.State(depth_m=0.15, heading_rad=0.5, current_mps=(0.25, 0, 0)))
    assert stated.effect_left_out[at(wade.Effect.CURRENT)] == wade.LeftOut.CURRENT_STATED


def test_added_mass_is_a_force_or_a_matrix(client: Any) -> None:
    rates = np.array([1.0, -2.0, 0.5])
    at_rest = wade.State(depth_m=0.15, acceleration_mps2=rates)
    implicit = wade.State(depth_m=0.15, acceleration_mps2=rates, implicit_added_mass=True)
    force, matrix = client.evaluate("husky", at_rest), client.evaluate("husky", implicit)
    index = force.effects.index(wade.Effect.ADDED_MASS)
    assert force.added_mass.shape == (6, 6)
    np.testing.assert_array_equal(force.added_mass, matrix.added_mass)
    np.testing.assert_allclose(matrix.added_mass, matrix.added_mass.T, atol=1e-6)
    # the center of mass moves as the origin does: nothing turns
    load = -force.added_mass.astype(float) @ [*rates, 0, 0, 0]
    # the effect has a part of it, the base the rest
    share = force.effect_force_n[index] / load[:3]
    assert (share > 0).all() and (share < 1).all()
    assert not matrix.effect_force_n[index].any() and not matrix.effect_left_out[index]
    # the error of the density scales the base's part
    np.testing.assert_allclose(force.force_n - matrix.force_n, load[:3], rtol=0.02, atol=1e-3)


def test_a_batch_has_the_effects_of_its_states_alone(client: Any, server: Server) -> None:
    for implicit in (False, True):
        states = wade.State(depth_m=[0.1, 0.15, 0.2], velocity_mps=(0.5, 0.1, 0), implicit_added_mass=implicit, **TOLD)
        batch = client.evaluate_batch("husky", states)
        assert batch.effect_force_n.shape == (3, 15, 3) and batch.added_mass.shape == (3, 6, 6)
        assert not batch.session_begins.any()
        for i in range(3):
            single = client.evaluate("husky", row(states, i))
            assert single.effects == batch.effects
            for array in ARRAYS:
                np.testing.assert_array_equal(getattr(batch, array)[i], getattr(single, array), err_msg=array)
    net = client.evaluate_batch("husky", states, surfaces=False)
    assert net.effect_surface_force_n.shape == (3, 0, 3)
    np.testing.assert_array_equal(net.effect_force_n, batch.effect_force_n)


def column(states: list[wade.State], name: str) -> Any:
    return [getattr(state, name) for state in states]


def run_in_time(phase: float) -> list[wade.State]:
    """A hull that heaves and surges."""
    times = phase + 0.05 * np.arange(20)
    return [
        wade.State(
            depth_m=0.12 + 0.04 * np.cos(t),
            velocity_mps=(0.6 + 0.3 * np.sin(t), 0.05, 0),
            acceleration_mps2=(0.3 * np.cos(t), 0, 0),
            time_step_s=0.05,
        )
        for t in times
    ]


def test_a_stream_remembers_and_another_does_not_reach_it(client: Any, server: Server) -> None:
    first, second = run_in_time(0.0), run_in_time(1.5)
    with over_shm(server) as shm, shm.stream("husky") as alone:
        expected = [alone.evaluate(state) for state in first]
    with client.stream("husky") as stream, client.stream("husky") as other:
        for i, (state, disturbing) in enumerate(zip(first, second, strict=True)):
            forces = stream.evaluate(state)
            disturbed = other.evaluate(disturbing)
            assert bool(forces.session_begins) is (i == 0)
            assert wade.LeftOut.NO_SESSION not in forces.effect_left_out
            for array in ARRAYS:
                np.testing.assert_array_equal(getattr(forces, array), getattr(expected[i], array), err_msg=array)
        memory = forces.effects.index(wade.Effect.WAVE_MEMORY)
        assert (forces.effect_force_n[memory] != disturbed.effect_force_n[memory]).any()
        # a call that fails ends the run
        with pytest.raises(wade.InvalidState):
            stream.evaluate(wade.State(depth_m=float("nan")))
        assert stream.evaluate(first[1]).session_begins and not stream.evaluate(first[2]).session_begins


@pytest.mark.parametrize("kind", ["shm_block", "in_process"])
def test_a_batch_steps_many_runs_at_once(kind: str, server: Server, loop: asyncio.AbstractEventLoop) -> None:
    count = 300  # more than one load of shared memory
    phases = np.linspace(0, 2, count)
    runs = [run_in_time(phase)[:3] for phase in phases]
    with connect(kind, server, loop) as client, client.stream("husky") as stream:
        expected = [stream.evaluate(state) for state in runs[-1]]
        for step in range(3):
            now = [run[step] for run in runs]
            states = wade.State(
                depth_m=column(now, "depth_m"),
                velocity_mps=column(now, "velocity_mps"),
                acceleration_mps2=column(now, "acceleration_mps2"),
                time_step_s=0.05,
                session=np.arange(1, count + 1),
            )
            forces = client.evaluate_batch("husky", states)
            assert (forces.session_begins == (step == 0)).all()
            for array in ARRAYS:
                np.testing.assert_array_equal(getattr(forces, array)[-1], getattr(expected[step], array))
        # the numbers of single calls are apart from those of batches
        alone = wade.State(depth_m=0.15, session=7, time_step_s=0.05)
        assert client.evaluate("husky", alone).session_begins and not client.evaluate("husky", alone).session_begins


def test_a_session_has_no_place_in_a_call_over_grpc(server: Server) -> None:
    with wade.GrpcClient(server.address, timeout_s=20.0) as client, client.stream("husky") as stream:
        single, batch = wade.State(depth_m=0.1, session=3), wade.State(depth_m=[0.1], time_step_s=0.05)
        for call in (
            lambda: client.evaluate("husky", single),
            lambda: stream.evaluate(single),
            lambda: client.evaluate_batch("husky", batch),
        ):
            with pytest.raises(wade.InvalidState, match="a stream is a run of states"):
                call()


def test_a_run_that_the_server_forgot_is_told(mortal_server: Server) -> None:
    mortal_server.start()
    state = wade.State(depth_m=0.15, session=5, time_step_s=0.05)
    with wade.ShmClient(mortal_server.namespace, timeout_s=1.0) as client:
        assert client.evaluate("husky", state, timeout_s=20).session_begins
        assert not client.evaluate("husky", state, timeout_s=20).session_begins
        mortal_server.kill()
        with pytest.raises((wade.DeadlineExceeded, wade.ServerUnavailable)):
            client.evaluate("husky", state)
        mortal_server.start()
        assert client.evaluate("husky", state, timeout_s=20).session_begins


def test_a_server_says_what_was_added(server: Server) -> None:
    with wade.GrpcClient(server.address, timeout_s=20.0) as client:
        vehicle = client.vehicle("husky")
    assert tuple(effect.effect for effect in vehicle.effects) == (*wade.Effect,)
    assert [effect.name for effect in vehicle.effects] == [*LIBRARY]
    surge = next(p for p in vehicle.effects[0].parameters if p.name == "surge")
    assert (surge.value, surge.std, surge.unit) == (0.3, 0.0, "1")
    assert vehicle.effects_validity[wade.BoxQuantity.ACCELERATION] == (0.0, 1000.0)


def test_effects_come_with_a_reload(
    kind: str, mortal_server: Server, loop: asyncio.AbstractEventLoop, tmp_path: Path
) -> None:
    vehicles = copy_with({}, tmp_path / "vehicles", VEHICLES)
    mortal_server.start(vehicles)
    with (
        connect(kind, mortal_server, loop, timeout_s=20.0) as client,
        wade.GrpcClient(f"unix:{mortal_server.socket}", timeout_s=20.0) as admin,
    ):
        bare = client.evaluate("husky", STATE)
        assert bare.effects == () and bare.added_mass is not None and bare.effect_force_n.shape == (0, 3)
        assert bare.effect_surface_force_n.shape == (0, 3) and not bare.effects_outside.any()
        add_effects(vehicles / "husky", {"added_mass": {"surge": 0.5}})
        assert [found.refusal for found in admin.reload("husky")] == [""]
        forces = client.evaluate("husky", STATE)
        assert forces.effects == (wade.Effect.ADDED_MASS,)
        assert forces.added_mass is not None and forces.added_mass[0, 0] > bare.added_mass[0, 0] + 1
        assert forces.force_n[0] < bare.force_n[0] - 50
        (vehicles / "husky" / "effects.toml").write_text("")
        (found,) = admin.reload("husky")
        assert "effects.toml" in found.refusal and found.bundle_version == forces.bundle_version
        assert client.evaluate("husky", STATE).effects == (wade.Effect.ADDED_MASS,)
        with pytest.raises(wade.UnknownVehicle):
            admin.reload("tank")


@pytest.mark.parametrize(
    ("kind", "transport"), [("tcp", "grpc_unary"), ("unix", "uds_unary"), ("asyncio", "grpc_unary")]
)
def test_the_server_tells_its_latency(
    kind: str, transport: str, server: Server, loop: asyncio.AbstractEventLoop
) -> None:
    with connect(kind, server, loop, timeout_s=20.0) as client:
        client.evaluate("husky", STATE)
        found = {(at.transport, at.vehicle): at for at in client.latency()}
    at = found[transport, "husky"]
    assert at.since_start.count > 0 and at.window_s > 0
    assert 0 < at.since_start.p50_us <= at.since_start.p99_us <= at.since_start.max_us
