"""Every client gives the numbers of `wade query`, to the bit, alone, in a batch and in a stream."""

from __future__ import annotations

import json
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import grpc
import numpy as np
import pytest
import tomllib
from servers import VEHICLES, Server, binary, environment

import wade
from wade.v1 import hydrodynamics_pb2, hydrodynamics_pb2_grpc

TILTED = wade.gravity_from_roll_pitch(0.1, -0.2)

# a state, and what makes `wade query` ask for the same
STATES = {
    "forward": (wade.State(depth_m=0.18, velocity_mps=(0.8, 0, 0)), ["--speed=0.8", "--depth=0.18"]),
    "dry": (wade.State(depth_m=0.0), ["--speed=0", "--depth=0"]),
    "everything": (
        wade.State(
            depth_m=0.15,
            density_kgpm3=1200.0,
            velocity_mps=[0.5, -0.25, 0.125],
            current_mps=np.array([-0.5, 0.0625, 0.0]),
            angular_velocity_radps=(0.1, 0.2, 0.3),
            acceleration_mps2=np.array([1, 2, 3], np.float32),
            angular_acceleration_radps2=(0.25, -0.5, 1.0),
            ground_contact=wade.GroundContact.DRY,
        ),
        [
            *("--depth=0.15", "--density=1200", "--velocity=0.5,-0.25,0.125", "--current=-0.5,0.0625,0"),
            *("--angular=0.1,0.2,0.3", "--acceleration=1,2,3", "--angular-acceleration=0.25,-0.5,1"),
            "--ground-contact=dry",
        ],
    ),
    "far outside": (wade.State(depth_m=0.9, velocity_mps=(5, 0, 2)), ["--velocity=5,0,2", "--depth=0.9"]),
    "tilted": (
        wade.State(depth_m=0.15, velocity_mps=(0.5, 0, 0), gravity_direction=TILTED),
        ["--speed=0.5", "--depth=0.15", "--roll=0.1", "--pitch=-0.2"],
    ),
}
ARRAYS = ("force_n", "moment_nm", "uncertainty_n", "surface_force_n", "surface_point_m", "wetted_fraction", "outside")


def query(vehicle: str, arguments: list[str]) -> dict[str, Any]:
    command: list[str | Path] = [binary(), "query", "--vehicle", vehicle, "--vehicles", VEHICLES, "--json", *arguments]
    return dict(json.loads(subprocess.run(command, capture_output=True, check=True, env=environment()).stdout))


def quantity(name: str) -> str:
    """The name without its unit."""
    return next(known.name.lower() for known in wade.Quantity if name.startswith(known.name.lower()))


@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("vehicle", ["husky", "warthog"])
def test_a_state_has_the_forces_of_the_query_command(client: Any, vehicle: str, name: str) -> None:
    state, arguments = STATES[name]
    expected = query(vehicle, arguments)
    with client.stream(vehicle) as stream:
        for forces in (client.evaluate(vehicle, state), stream.evaluate(state), stream.evaluate(state)):
            surfaces = expected["surfaces"]
            for array, value in {
                "force_n": expected["wrench"]["force"],
                "moment_nm": expected["wrench"]["moment"],
                "about_m": expected["wrench"]["about"],
                "uncertainty_n": expected["uncertainty"]["force"],
                "surface_force_n": [surface["force"] for surface in surfaces],
                "surface_point_m": [surface["point"] for surface in surfaces],
                "wetted_fraction": [surface["wetted_fraction"] for surface in surfaces],
            }.items():
                np.testing.assert_array_equal(getattr(forces, array), np.array(value, np.float32), err_msg=array)
            outside = {wade.Quantity(i).name.lower(): x for i, x in enumerate(forces.outside) if x}
            named = {quantity(o["quantity"]): o["excess"] for o in expected["outside"]}
            assert outside == pytest.approx(named, rel=1e-6)
            assert bool(forces.in_domain) is expected["in_domain"]
            # over shared memory it is cut to fit
            assert forces.provenance and expected["provenance"].startswith(forces.provenance)
            assert forces.bundle_version == expected["version"]
            assert 0 < forces.compute_ns < 1e9


def test_water_lifts_and_drags(client: Any) -> None:
    state = wade.State(depth_m=0.18, velocity_mps=(0.8, 0.0, 0.0))
    forces = client.evaluate("husky", state)
    assert forces.force_n[0] < 0 < forces.force_n[2]
    np.testing.assert_allclose(forces.surface_force_n.sum(axis=0), forces.force_n, rtol=1e-5, atol=1e-3)
    dry = client.evaluate("husky", wade.State(depth_m=0.0))
    assert not dry.surface_force_n.any() and not dry.wetted_fraction.any()


def random_states(count: int) -> wade.State:
    random = np.random.default_rng(7)
    return wade.State(
        depth_m=random.uniform(0.0, 0.4, count),
        velocity_mps=random.uniform(-2, 2, (count, 3)),
        current_mps=random.uniform(-1, 1, (count, 3)),
        density_kgpm3=random.uniform(1000, 1200, count),
        gravity_direction=wade.gravity_from_roll_pitch(*random.uniform(-0.2, 0.2, (2, count))),
        ground_contact=wade.GroundContact.DRY,
    )


def row(states: wade.State, i: int) -> wade.State:
    fields = ("depth_m", "velocity_mps", "current_mps", "density_kgpm3", "gravity_direction")
    return wade.State(ground_contact=states.ground_contact, **{name: getattr(states, name)[i] for name in fields})


def test_a_batch_has_the_forces_of_its_states_alone(client: Any) -> None:
    count = 600  # more than two loads of shared memory
    states = random_states(count)
    batch = client.evaluate_batch("husky", states)
    assert batch.force_n.shape == (count, 3) and batch.surface_force_n.shape == (count, 13, 3)
    assert not batch.in_domain.all()
    for i in (0, 1, 255, 256, 511, 512, 599):
        single = client.evaluate("husky", row(states, i))
        for array in ARRAYS:
            np.testing.assert_array_equal(getattr(batch, array)[i], getattr(single, array), err_msg=array)
        assert batch.in_domain[i] == single.in_domain
    np.testing.assert_array_equal(batch.about_m, single.about_m)
    assert batch.provenance == single.provenance


def test_a_batch_can_leave_out_the_surfaces(client: Any) -> None:
    states = random_states(5)
    net = client.evaluate_batch("warthog", states, surfaces=False)
    assert net.surface_force_n.shape == (5, 0, 3) and net.wetted_fraction.shape == (5, 0)
    np.testing.assert_array_equal(net.force_n, client.evaluate_batch("warthog", states).force_n)


def test_what_all_states_of_a_batch_share_need_not_be_repeated(client: Any) -> None:
    depth = [0.1, 0.15]
    shared = wade.State(depth_m=depth, velocity_mps=(0.5, 0.1, 0), density_kgpm3=1100.0)
    repeated = wade.State(depth_m=depth, velocity_mps=[(0.5, 0.1, 0)] * 2, density_kgpm3=[1100.0] * 2)
    forces = [client.evaluate_batch("husky", states).force_n for states in (shared, repeated)]
    np.testing.assert_array_equal(*forces)


def test_the_generated_stub_gets_the_same_with_fields_left_out(server: Server) -> None:
    with grpc.insecure_channel(server.address) as channel, wade.GrpcClient(server.address) as client:
        stub = hydrodynamics_pb2_grpc.HydrodynamicsStub(channel)
        request = hydrodynamics_pb2.EvaluateRequest(vehicle="husky", state=hydrodynamics_pb2.State(depth_m=0.1))
        answer = stub.Evaluate(request, timeout=20)
        forces = client.evaluate("husky", wade.State(depth_m=0.1), timeout_s=20)
    np.testing.assert_array_equal(forces.surface_force_n.ravel(), np.array(answer.surface_force_n, np.float32))
    assert forces.moment_nm[1] == answer.wrench.moment_nm.y


def test_every_client_describes_a_vehicle(client: Any, server: Server) -> None:
    with wade.GrpcClient(server.address, timeout_s=20.0) as rpc:
        expected = rpc.vehicle("husky")
    vehicle = client.vehicle("husky")
    np.testing.assert_equal(asdict(vehicle), asdict(expected))
    assert vehicle.surfaces[-1].name == "wheel_rr" and vehicle.surfaces[-1].kind == "wheel"
    with pytest.raises(wade.UnknownVehicle, match="husky"):
        client.vehicle("nautilus")


def test_a_vehicle_is_described_as_in_its_bundle(server: Server) -> None:
    bundle = tomllib.loads((VEHICLES / "warthog" / "vehicle.toml").read_text())
    with wade.GrpcClient(server.address, timeout_s=20.0) as client:
        vehicle = client.vehicle("warthog", mesh=True)
        bare = client.vehicle("warthog")
    assert [s.name for s in vehicle.surfaces] == [s["name"] for s in bundle["surface"]]
    assert vehicle.length_m == bundle["length_m"] and vehicle.z0_m == bundle["z0_m"]
    assert vehicle.bundle_version == bundle["version"]
    np.testing.assert_array_equal(vehicle.inertia_kgm2, vehicle.inertia_kgm2.T)
    for key, stated in bundle["domain"].items():
        found = vehicle.domain[wade.Quantity[quantity(key).upper()]]
        assert found == pytest.approx((stated["min"], stated["max"]), rel=1e-6)
    assert len(vehicle.domain) >= len(bundle["domain"])
    # binary STL: a header of 84 bytes, 50 a face
    assert len(vehicle.mesh_stl) == 84 + 50 * len(vehicle.face_surface)
    assert vehicle.face_surface.max() == len(vehicle.surfaces) - 1
    assert bare.mesh_stl == b"" and bare.face_surface.size == 0


def test_the_vehicles_are_listed(client: Any) -> None:
    assert client.vehicles() == ["husky", "warthog"]


def test_threads_may_share_a_client(server: Server) -> None:
    depths = np.linspace(0.05, 0.2, 40)
    with (
        wade.GrpcClient(server.address, timeout_s=20.0) as rpc,
        wade.ShmClient(server.namespace, timeout_s=20.0) as shm,
    ):
        alone = [rpc.evaluate("husky", wade.State(depth_m=depth)).force_n[2] for depth in depths]
        clients: tuple[wade.Client, wade.Client] = (rpc, shm)
        for client in clients:
            with ThreadPoolExecutor(4) as pool:
                lifts = pool.map(lambda d, c=client: c.evaluate("husky", wade.State(depth_m=d)).force_n[2], depths)
                assert list(lifts) == alone


def test_moving_water_is_that_of_the_command(client: Any) -> None:
    still: dict[str, Any] = {"depth_m": 0.15, "velocity_mps": (0.5, 0.1, 0), "current_mps": (-0.5, 0, 0)}
    arguments = ["--velocity=0.5,0.1,0", "--current=-0.5,0,0", "--depth=0.15"]
    kinds: list[tuple[dict[str, Any], list[str]]] = [
        (
            {"wave_vector_radpm": (1.5, 0.5, 0), "wave_amplitude_m": 0.0625, "wave_phase_rad": 0.75},
            ["--wave-vector=1.5,0.5,0", "--wave-amplitude=0.0625", "--wave-phase=0.75"],
        ),
        ({"wheel_water_level_m": (0.0, 0.03125, 0.0, -0.0625)}, ["--wheel-levels=0,0.03125,0,-0.0625"]),
        ({"current_exponent": 0.125}, ["--current-exponent=0.125"]),
    ]
    calm = client.evaluate("husky", wade.State(**still)).force_n
    for moving, more in kinds:
        expected = query("husky", [*arguments, *more])["wrench"]["force"]
        alone = client.evaluate("husky", wade.State(**still, **moving)).force_n
        assert (alone == np.array(expected, np.float32)).all() and (alone != calm).any()
        rows: dict[str, Any] = {
            name: np.tile(np.asarray(value), (2, 1) if np.ndim(value) else 2) for name, value in moving.items()
        }
        both = client.evaluate_batch("husky", wade.State(**{**still, "depth_m": [0.15, 0.15]}, **rows)).force_n
        assert (both == alone).all()
    # no wave without a height, and none without the rest
    flat = wade.State(**still, wave_vector_radpm=(1.0, 0, 0))
    assert (client.evaluate("husky", flat).force_n == calm).all()
    with pytest.raises(wade.InvalidState, match="wave_vector_radpm must be greater than zero"):
        client.evaluate("husky", wade.State(**still, wave_amplitude_m=0.1))
