"""In process every field of an answer but the time has the bits of the server's, and every refusal its words."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import tomllib
from servers import ROOT, VEHICLES, Server, rover
from test_effects import TOLD, run_in_time
from test_refusals import GOOD, REFUSED, state
from test_values import STATES, random_states

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
from effects_by_hand import LIBRARY, copy_with

#: Values that are not refused, of fields that are not vectors of three.
FINE: dict[str, Any] = {
    **{"depth_m": 0.15, "density_kgpm3": 1000.0, "gravity_direction": (0.0, 0.0, -1.0)},
    **{"heading_rad": 0.0, "depth_rate_mps": 0.0, "wheel_speed_radps": (0.0, 0.0, 0.0, 0.0)},
    **{"water_level_m": np.nan, "bed_clearance_m": 0.0, "bed": 0.0},
    **{"wave_amplitude_m": 0.0, "wave_phase_rad": 0.0, "current_exponent": 0.0},
    "wheel_water_level_m": (0.0, 0.0, 0.0, 0.0),
}
#: States of which each input that an effect needs is given, too.
ALL_STATES = [
    *(given for given, _ in STATES.values()),
    *(
        wade.State(
            depth_m=0.15,
            velocity_mps=(0.5, 0.1, 0),
            acceleration_mps2=(1010.0, -1.0, 0.5),
            gravity_direction=wade.gravity_from_roll_pitch(0.1, -0.2),
            ground_contact=contact,
            implicit_added_mass=implicit,
            heading_rad=0.5,
            depth_rate_mps=0.125,
            wheel_speed_radps=(3, 3, 2, 2),
        )
        for contact in wade.GroundContact
        for implicit in (False, True)
    ),
]


@pytest.fixture(scope="module", params=["shipped", "every effect"])
def vehicles(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    if request.param == "shipped":
        return VEHICLES
    return copy_with({name: {} for name in LIBRARY}, tmp_path_factory.mktemp("effects") / "vehicles", VEHICLES)


@pytest.fixture(scope="module")
def served(vehicles: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[wade.Client]:
    server = Server(tmp_path_factory.mktemp("server"))
    server.start(vehicles)
    with wade.GrpcClient(server.address, timeout_s=20.0) as client:
        yield client
    server.stop()


def assert_same(ours: wade.Forces, theirs: wade.Forces) -> None:
    """Bits, types and shapes; the time is each one's own."""
    for field in fields(wade.Forces):
        a, b = getattr(ours, field.name), getattr(theirs, field.name)
        if field.name == "compute_ns":
            assert a > 0
        elif isinstance(b, np.ndarray | np.generic):
            assert (a.dtype, a.shape) == (b.dtype, b.shape), field.name
            assert a.tobytes() == b.tobytes(), field.name
        else:
            assert a == b, field.name


@pytest.mark.parametrize("vehicle", ["husky", "warthog"])
def test_a_state_has_the_bits_of_the_server(vehicles: Path, served: wade.Client, vehicle: str) -> None:
    client = wade.InProcess(vehicles)
    for given in ALL_STATES:
        assert_same(client.evaluate(vehicle, given), served.evaluate(vehicle, given))


@pytest.mark.parametrize("vehicle", ["husky", "warthog"])
@pytest.mark.parametrize("surfaces", [True, False])
def test_a_batch_has_the_bits_of_the_server(vehicles: Path, served: wade.Client, vehicle: str, surfaces: bool) -> None:
    client = wade.InProcess(vehicles)
    given = wade.State(depth_m=[0.1, 0.15, 0.2], velocity_mps=(0.5, 0.1, 0), implicit_added_mass=True, **TOLD)
    for states in (random_states(600), given):
        ours = client.evaluate_batch(vehicle, states, surfaces=surfaces)
        assert_same(ours, served.evaluate_batch(vehicle, states, surfaces=surfaces))


def test_a_run_has_the_bits_of_the_server(vehicles: Path, served: wade.Client) -> None:
    with wade.InProcess(vehicles).stream("husky") as ours, served.stream("husky") as theirs:
        for given in run_in_time(0.5):
            assert_same(ours.evaluate(given), theirs.evaluate(given))


@pytest.mark.parametrize(("name", "value", "says"), REFUSED)
def test_a_refusal_has_the_words_of_the_server(server: Server, name: str, value: Any, says: str) -> None:
    with wade.InProcess(server.vehicles) as ours, wade.GrpcClient(server.address, timeout_s=20.0) as theirs:
        errors = []
        for client in (ours, theirs):
            with pytest.raises(wade.InvalidState) as single:
                client.evaluate("husky", state(name, value))
            assert says in str(single.value)
            errors.append([single.value.violations])
            if name == "time_step_s":  # over gRPC the states of a batch have none
                continue
            fine = FINE.get(name, (0.0, 0.0, 0.0))
            with pytest.raises(wade.InvalidState, match="state 2 of the batch") as batch:
                client.evaluate_batch("husky", state(name, [fine, fine, value], [0.15] * 3))
            errors[-1].append(batch.value.violations)
        assert errors[0] == errors[1]


def test_a_batch_that_is_refused_moves_no_session(vehicles: Path) -> None:
    client = wade.InProcess(vehicles)
    states = wade.State(depth_m=[0.1, np.inf], session=[1, 2], time_step_s=0.05)
    with pytest.raises(wade.InvalidState, match="state 1 of the batch"):
        client.evaluate_batch("husky", states)
    good = wade.State(depth_m=[0.1, 0.1], session=[1, 2], time_step_s=0.05)
    assert client.evaluate_batch("husky", good).session_begins.all()
    assert not client.evaluate_batch("husky", good).session_begins.any()
    client.close()
    assert client.evaluate_batch("husky", good).session_begins.all()


def test_without_a_folder_there_are_the_vehicles_that_wade_carries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_DATA_HOME", raising=False)
    client = wade.InProcess()
    assert client.vehicles() == ["husky", "warthog"]
    assert client.evaluate("husky", GOOD).force_n[2] > 0


def test_a_vehicle_of_the_folder_comes_beside_those(tmp_path: Path) -> None:
    rover(tmp_path)
    client = wade.InProcess(str(tmp_path))
    assert client.vehicles() == ["husky", "rover", "warthog"]
    assert_same(client.evaluate("rover", GOOD), wade.InProcess(VEHICLES).evaluate("husky", GOOD))


def test_a_folder_or_a_bundle_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(wade.WadeError, match="there is no such folder of vehicles"):
        wade.InProcess(tmp_path / "nowhere")
    bundle = rover(tmp_path)
    (bundle / "vehicle.toml").write_text("")
    client = wade.InProcess(tmp_path)
    with pytest.raises(wade.WadeError, match=r"vehicle\.toml"):
        client.evaluate("rover", GOOD)
    assert client.evaluate("husky", GOOD).force_n[2] > 0


def test_threads_may_share_a_client() -> None:
    client = wade.InProcess(VEHICLES)
    depths = np.linspace(0.05, 0.2, 40)
    alone = [client.evaluate("husky", wade.State(depth_m=depth)).force_n[2] for depth in depths]
    with ThreadPoolExecutor(4) as pool:
        lifts = list(pool.map(lambda depth: client.evaluate("husky", wade.State(depth_m=depth)).force_n[2], depths))
        batches = pool.map(lambda _: client.evaluate_batch("husky", wade.State(depth_m=depths)).force_n[:, 2], range(8))
        assert all(list(batch) == alone for batch in batches)
    assert lifts == alone


def test_a_batch_leaves_other_threads_running() -> None:
    client = wade.InProcess(VEHICLES)
    states = random_states(20_000)
    ticks: list[float] = []
    done = threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    client.evaluate_batch("husky", states, surfaces=False)
    end = time.monotonic()
    done.set()
    thread.join()
    middle = [tick for tick in ticks if start + 0.25 * (end - start) < tick < start + 0.75 * (end - start)]
    assert middle, f"no other thread ran in a batch of {end - start:.2f} s"


@pytest.mark.parametrize("module", [None, SimpleNamespace(VERSION="0.0.1")])
def test_without_the_compiled_module_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch, module: Any) -> None:
    monkeypatch.setitem(sys.modules, "wade_native", module)
    with pytest.raises(ImportError, match=r"wade_native.*pip install ./clients/python/native"):
        wade.InProcess()


def test_the_module_is_of_the_version_of_the_client() -> None:
    import wade_native

    project = tomllib.loads((ROOT / "clients" / "python" / "pyproject.toml").read_text())["project"]
    assert wade_native.VERSION == project["version"]
