"""Promise: a unit is valid, has the bits of the C client, goes back to where it was, and takes nonsense as such."""

from __future__ import annotations

import json
import os
import subprocess
import time
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from conftest import VEHICLE, Run, addresses, unit
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from numpy.typing import NDArray
from servers import Server

STEP = 0.001
COLUMNS = 11
INPUTS = ("velocity_mps", "current_mps", "angular_velocity_radps", "acceleration_mps2", "angular_acceleration_radps2")
#: Statuses of the standard.
WARNING, DISCARD, ERROR = 1, 2, 3

Open = Callable[..., Run]


@pytest.fixture
def open_run(tmp_path: Path) -> Iterator[Open]:
    """Opens a run of a new unit, and ends it with the test."""
    runs = []

    def opened(*arguments: str) -> Run:
        out = unit(tmp_path, *arguments)
        folder = tmp_path / out.stem
        zipfile.ZipFile(out).extractall(folder)
        runs.append(Run(folder))
        return runs[-1]

    yield opened
    for run in runs:
        run.close()


def rows(count: int) -> NDArray[np.float32]:
    """A drive through water that is deep enough to float in, tilted this way and that."""
    t = np.arange(count) * STEP
    waves = [np.sin(2 * np.pi * (0.1 + 0.037 * column) * t + column) for column in range(18)]
    sizes = [1.0, 0.4, 0.1, 0.2, 0.2, 0.0, 0.2, 0.2, 0.4, 0.5, 0.5, 0.5, 0.4, 0.4, 0.4, 0.15, 0.15, 0.15]
    return (np.stack(waves, axis=1) * sizes).astype(np.float32)


def set_row(run: Run, row: NDArray[np.float32]) -> None:
    for place, name in enumerate(INPUTS):
        run.set(name, row[3 * place : 3 * place + 3])
    x, y = row[15:17]
    down = -np.sqrt(np.float32(1.0) - x * x - y * y)
    run.set("gravity_direction", [x, y, down])
    run.set("water_level_m", row[17])


def wrench(run: Run) -> NDArray[np.float64]:
    return np.concatenate([run.get("force_n"), run.get("moment_nm")])


def status(call: Callable[[], Any]) -> int:
    with pytest.raises(FMICallException) as raised:
        call()
    return int(raised.value.status)


@pytest.mark.parametrize("arguments", [[], ["--surfaces"]])
@pytest.mark.parametrize("kind", ["embedded", "shm", "grpc"])
def test_a_unit_is_valid(kind: str, arguments: list[str], tmp_path: Path, server: Server) -> None:
    source = ["--embedded"] if kind == "embedded" else ["--connect", addresses(server)[kind]]
    out = unit(tmp_path, *source, *arguments)
    assert validate_fmu(str(out)) == []
    description = fmpy.read_model_description(str(out))
    assert description.coSimulation.canGetAndSetFMUstate == (kind == "embedded")
    loads = [v for v in description.modelVariables if v.name.startswith("surface_")]
    assert len(loads) == (3 if arguments else 0)
    assert all(variable.description for variable in description.modelVariables)
    credibility = json.loads(zipfile.ZipFile(out).read("extra/org.wade/credibility.json"))
    assert credibility["vehicle"] == VEHICLE and "openfoam v1912" in credibility["training_data"]
    assert "castellated mesh" in credibility["training_data"] and credibility["training_cases"] > 100
    for example in credibility["deviation_examples"]:
        assert example["force_n"][0] < 0.0 < example["force_deviation_n"][0] < -example["force_n"][0]
    assert unit(tmp_path, *source, *arguments).read_bytes() == out.read_bytes(), "the same unit is the same file"


def test_fmpy_runs_a_unit(tmp_path: Path) -> None:
    result = fmpy.simulate_fmu(
        str(unit(tmp_path, "--embedded")),
        stop_time=0.1,
        output_interval=0.01,
        start_values={"water_level_m": 0.0, "velocity_mps": [1.0, 0.0, 0.0]},
        output=["force_n", "in_domain"],
    )
    assert len(result) == 11 and np.isfinite(result["force_n"]).all()
    assert (result["force_n"][:, 0] < 0.0).all() and (result["force_n"][:, 2] > 0.0).all(), "drag, and lift"


@pytest.mark.timeout(400)
def test_a_hundred_thousand_steps_are_those_of_the_c_client(
    open_run: Open, server: Server, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = rows(100_001)
    count = {"embedded": len(states), "shm": len(states), "grpc": 2_001}
    run_c = [os.environ["WADE_FMU_STEPS"], addresses(server)["shm"], VEHICLE, str(STEP)]
    answered = {}
    for length in set(count.values()):
        out = subprocess.run(run_c, input=states[:length].tobytes(), stdout=subprocess.PIPE, check=True, timeout=200)
        answered[length] = np.frombuffer(out.stdout, np.float32)
    for kind, length in count.items():
        run = open_run("--embedded") if kind == "embedded" else open_run("--connect", addresses(server)[kind])
        set_row(run, states[0])
        run.begin()
        found = np.empty((length, 6), np.float32)
        found[0] = wrench(run)
        seconds = 0.0
        for index in range(1, length):
            set_row(run, states[index])
            start = time.perf_counter()
            run.step(STEP)
            seconds += time.perf_counter() - start
            found[index] = wrench(run)
        expected, jacobian = np.split(answered[length], [6 * length])
        assert np.array_equal(found.ravel(), expected), kind
        for first, unknown in enumerate(["force_n", "moment_nm"]):
            rows_of = jacobian.reshape(6, COLUMNS)[3 * first : 3 * first + 3]
            for begin, known in [(0, "velocity_mps"), (3, "angular_velocity_radps")]:
                for axis in range(3):
                    own = run.derivative(unknown, known, np.eye(3)[axis])
                    assert np.array_equal(own.astype(np.float32), rows_of[:, begin + axis]), (kind, unknown, known)
            assert np.array_equal(run.derivative(unknown, "water_level_m", [1.0]).astype(np.float32), rows_of[:, 6])
            assert np.array_equal(run.derivative(unknown, "density_kgpm3", [1.0]).astype(np.float32), rows_of[:, 10])
        with capsys.disabled():
            print(f"\n{kind}: {length - 1} steps, {1e6 * seconds / (length - 1):.1f} us a step in Python")


def test_the_derivative_by_gravity_is_that_of_the_force(open_run: Open) -> None:
    run = open_run("--embedded")
    # still water alone has no network, which computes in single precision
    run.slave.setInt64([run.references["physics"]], [4])
    down = np.array([0.1, -0.05, -np.sqrt(1 - 0.1**2 - 0.05**2)])
    run.set("water_level_m", 0.0)
    run.set("gravity_direction", down)
    run.begin()
    along = np.cross(down, [0.3, 0.5, 0.1])
    slope = run.derivative("moment_nm", "gravity_direction", along)

    def moment(share: float) -> NDArray[np.float64]:
        turned = down + share * along
        run.set("gravity_direction", turned / np.linalg.norm(turned))
        run.step(STEP)
        return run.get("moment_nm")

    difference = (moment(1e-3) - moment(-1e-3)) / 2e-3
    assert np.linalg.norm(slope - difference) < 0.02 * np.linalg.norm(difference)


def test_a_run_goes_back_into_the_middle_of_its_waves(open_run: Open) -> None:
    run = open_run("--embedded")
    states = rows(600)
    set_row(run, states[0])
    run.begin()
    for row in states[1:200]:
        set_row(run, row)
        run.step(STEP)

    def go_on() -> NDArray[np.float64]:
        wrenches = []
        for row in states[200:]:
            set_row(run, row)
            run.step(STEP)
            wrenches.append(wrench(run))
        return np.array(wrenches)

    kept, then = run.slave.getFMUState(), run.time
    first = go_on()
    without_waves = open_run("--embedded")
    set_row(without_waves, states[199])
    without_waves.begin()
    run.slave.setFMUState(kept)
    run.time = then
    assert np.array_equal(wrench(run), wrench(run))
    assert np.array_equal(go_on(), first)
    # one state serves many times, and another run
    other = open_run("--embedded")
    other.begin()
    other.slave.setFMUState(kept)
    other.time = then
    set_row(other, states[200])
    other.step(STEP)
    assert np.array_equal(wrench(other), first[0])
    set_row(without_waves, states[200])
    without_waves.step(STEP)
    assert not np.array_equal(wrench(without_waves), first[0]), "the water remembers"
    run.slave.freeFMUState(kept)


def two_masses(run: Run, implicit: bool, seconds: float) -> NDArray[np.float64]:
    """A hull that floats with a load on a spring, both free to heave: heights and speeds along the run."""
    hull, load, spring, damper, gravity, step = 50.0, 10.0, 2000.0, 40.0, 9.81, 0.002
    heights, speeds, before = np.array([0.05, 0.05 - load * gravity / spring]), np.zeros(2), 0.0
    run.set_flag("implicit_added_mass", implicit)
    run.set("water_level_m", -heights[0])
    run.begin()
    history = []
    for _ in range(round(seconds / step)):
        run.set("velocity_mps", [0.0, 0.0, speeds[0]])
        run.set("acceleration_mps2", [0.0, 0.0, 0.0 if implicit else before])
        run.set("water_level_m", -heights[0])
        run.step(step)
        lift = run.get("force_n")[2]
        water = run.get("added_mass").reshape(6, 6)[2, 2] if implicit else 0.0
        pull = spring * (heights[1] - heights[0]) + damper * (speeds[1] - speeds[0])
        before = (lift + pull - hull * gravity) / (hull + water)
        speeds = speeds + step * np.array([before, -pull / load - gravity])
        heights = heights + step * speeds
        history.append([*heights, *speeds])
        if not np.abs(history[-1]).max() < 10.0:
            break
    return np.array(history)


def test_two_masses_float_with_the_added_mass_in_their_own(open_run: Open, server: Server) -> None:
    embedded = open_run("--embedded")
    history = two_masses(embedded, True, 20.0)
    assert len(history) == 10_000 and np.abs(history[-500:, 2:]).max() < 1e-3, "they come to rest"
    assert abs(embedded.get("force_n")[2] / (60.0 * 9.81) - 1.0) < 1e-3, "and weigh what the water lifts"
    assert abs(history[-1, 0] - history[-1, 1] - 10.0 * 9.81 / 2000.0) < 1e-4, "with the load on its spring"
    remote = two_masses(open_run("--connect", addresses(server)["shm"]), True, 2.0)
    assert np.array_equal(remote, history[: len(remote)])
    # as a force of the step before, the same rest by another way
    explicit = two_masses(open_run("--embedded"), False, 20.0)
    assert np.abs(explicit[-1] - history[-1]).max() < 1e-4 and not np.array_equal(explicit[:100], history[:100])


def test_nonsense_is_refused_and_the_run_goes_on(open_run: Open) -> None:
    run = open_run("--embedded")
    run.set("water_level_m", 0.0)
    run.begin()
    run.step(STEP)
    before = wrench(run)
    nan = float("nan")
    for begin, length in [(0.0, STEP), (STEP, 0.0), (STEP, -STEP), (STEP, nan), (nan, STEP), (STEP, float("inf"))]:
        assert status(partial(run.slave.doStep, begin, length)) == DISCARD, (begin, length)
    assert "goes back" in run.messages[0] and "above 0" in run.messages[1]
    for name, value in [("velocity_mps", [nan, 0, 0]), ("density_kgpm3", [-1.0]), ("gravity_direction", [0, 0, -3])]:
        good = run.get(name)
        run.set(name, value)
        assert status(lambda: run.slave.doStep(run.time, STEP)) == DISCARD
        assert name in run.messages[-1]
        run.set(name, good)
    assert np.array_equal(wrench(run), before)
    assert status(lambda: run.set("force_n", [0, 0, 0])) == ERROR
    assert status(lambda: run.set("velocity_mps", [0, 0])) == ERROR
    assert status(lambda: run.slave.getFloat64([999])) == ERROR
    assert status(lambda: run.slave.getFloat32([1])) == ERROR
    assert status(lambda: run.derivative("force_n", "current_mps", [1, 0, 0])) == ERROR
    assert "velocity" in run.messages[-1]
    run.step(STEP)
    run.slave.reset()
    run.time = 0.0
    run.set("water_level_m", 0.0)
    run.begin()
    run.step(STEP)
    assert np.array_equal(wrench(run), before), "a run after a reset is the first"


def test_a_unit_that_was_changed_or_has_no_server_says_so(open_run: Open, tmp_path: Path) -> None:
    run = open_run("--connect", "shm:nobody_is_here")
    run.set("timeout_s", 0.2)
    run.slave.enterInitializationMode()
    assert status(run.slave.exitInitializationMode) == ERROR
    assert "wade serve" in run.messages[-1]
    out = unit(tmp_path, "--embedded")
    folder = tmp_path / "broken"
    zipfile.ZipFile(out).extractall(folder)
    (folder / "resources" / "vehicles" / VEHICLE / "network.safetensors").write_bytes(b"nonsense")
    broken = Run(folder)
    broken.slave.enterInitializationMode()
    assert status(broken.slave.exitInitializationMode) == ERROR
    assert "network.safetensors" in broken.messages[-1]
    broken.close()


@pytest.mark.parametrize("kind", ["shm", "grpc"])
def test_a_server_that_dies_is_bridged_as_long_as_was_asked(kind: str, open_run: Open, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    server = Server(tmp_path / "own")
    server.start()
    run = open_run("--connect", addresses(server)[kind])
    run.set("timeout_s", 0.3)
    run.set("oldest_answer_s", 2.5 * STEP)
    run.set("water_level_m", 0.0)
    run.begin()
    run.step(STEP)
    before = wrench(run)
    server.kill()
    for steps in (1, 2):
        run.step(STEP)
        assert np.array_equal(wrench(run), before) and run.get("age_s")[0] == pytest.approx(steps * STEP)
        assert "old" in run.messages[-1]
    assert status(lambda: run.slave.doStep(run.time, STEP)) == ERROR
    server.start()
    run.step(STEP)
    assert run.get("age_s")[0] == 0.0
    server.kill()
