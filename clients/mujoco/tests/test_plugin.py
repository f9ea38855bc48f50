"""Promise: the plugin's water carries and brakes a vehicle in MuJoCo as the server says, and takes nonsense as such."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import wade
from numpy.typing import NDArray
from servers import Server, binary

GRAVITY, MASS, DENSITY = 9.81, 50.0, 1000.0
#: Of the shipped Husky [m].
Z0 = -0.1845

mujoco.mj_loadPluginLibrary(os.environ["WADE_MUJOCO_PLUGIN"])


def address(server: Server) -> str:
    return f"shm:{server.namespace}"


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("server"))
    server.start()
    yield server
    server.kill()


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings to a file where it runs."""
    monkeypatch.chdir(tmp_path)


def model(
    *, body: str = "", option: str = "", timestep: float = 0.005, height: float = 0.2, **config: Any
) -> mujoco.MjModel:
    """A body with the Husky's mass, free to move over water at height 0."""
    entries = "".join(f'<config key="{key}" value="{value}"/>' for key, value in config.items())
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{timestep}" integrator="implicitfast" {option}/>
          <extension><plugin plugin="wade.water"><instance name="water">{entries}</instance></plugin></extension>
          <worldbody>
            <body name="husky" pos="0 0 {height}">
              <freejoint/>
              <inertial pos="0 0 0.0133" mass="{MASS}" diaginertia="2.52 3.71 5.09"/>
              <geom type="box" size="0.4 0.25 0.1" contype="0" conaffinity="0" mass="0"/>
              <plugin instance="water"/>
              {body}
            </body>
          </worldbody>
        </mujoco>""")


def run(
    of: mujoco.MjModel, seconds: float, velocity: tuple[float, ...] = ()
) -> tuple[mujoco.MjData, NDArray[np.float64]]:
    """The data at the end, and a row a step: time, place of the body, its velocity."""
    data = mujoco.MjData(of)
    data.qvel[: len(velocity)] = velocity
    rows = []
    for _ in range(round(seconds / of.opt.timestep)):
        mujoco.mj_step(of, data)
        rows.append([data.time, *data.qpos[:3], *data.qvel[:6]])
    return data, np.array(rows)


def husky(server: Server, **others: Any) -> mujoco.MjModel:
    return model(vehicle="husky", address=address(server), **others)


def test_a_vehicle_floats_with_its_own_weight_of_water(server: Server) -> None:
    data, track = run(husky(server), 20.0)
    assert np.abs(track[-200:, 4:]).max() < 1e-3, "it comes to rest"
    # what lifts it is what it displaces, and nothing else acts
    assert data.qfrc_passive[2] == pytest.approx(MASS * GRAVITY, rel=1e-4)
    level = -track[-1, 3]
    answer = subprocess.run(
        [binary(), "query", "--vehicle", "husky", "--water-level", str(level), "--addr", address(server)],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    lift = float(next(line for line in answer.splitlines() if line.startswith("net force")).split()[-1])
    assert lift == pytest.approx(MASS * GRAVITY, rel=5e-3)
    # MuJoCo's own model knows drag and added mass, and no surface
    own = model(option=f'density="{DENSITY}" viscosity="0.001"', vehicle="husky", address=address(server), level=-50)
    assert run(own, 3.0)[1][-1, 3] < -2.0, "there it sinks"


def test_water_brakes_a_vehicle_as_it_brakes_it_in_mujocos_own_model(server: Server) -> None:
    _, track = run(husky(server, height=0.0), 6.0, (1.5, 0.0, 0.0))
    speeds = track[:, 4]
    assert speeds[0] > 1.3 and 0.0 < speeds[-1] < 0.5 * speeds[0], speeds[-1]
    # the speed of a body that quadratic drag brakes falls as 1 / (1 + t / T) once waves have gone: 1 / v is straight
    late = slice(len(speeds) // 2, None)
    inverse = 1.0 / speeds[late]
    line = np.polynomial.Polynomial.fit(track[late, 0], inverse, 1)
    assert np.abs(line(track[late, 0]) - inverse).max() < 0.1 * np.ptp(inverse)


def test_a_current_takes_it_along(server: Server) -> None:
    _, track = run(husky(server, current="0.5 0 0"), 30.0)
    assert track[-1, 4] == pytest.approx(0.5, abs=0.05)


def test_the_water_that_moves_along_is_in_the_mass_matrix(server: Server) -> None:
    of = husky(server, height=0.0)
    data = mujoco.MjData(of)
    mujoco.mj_forward(of, data)
    # the last of a row is its diagonal
    heave = data.M[of.M_rowadr[2] + of.M_rownnz[2] - 1]
    assert heave > 1.2 * MASS
    # let go from a height, the first acceleration is the weight without the lift over both masses
    assert data.qacc[2] == pytest.approx((data.qfrc_passive[2] - MASS * GRAVITY) / heave, rel=0.02)


def test_steps_are_those_of_the_python_client(server: Server) -> None:
    """The same loop, written in Python around mj_step1 and mj_step2."""
    of = husky(server, timestep=0.002)
    _, track = run(of, 2.0, (0.8, 0.1, 0.0, 0.1, 0.2, 0.3))
    dry = husky(server, timestep=0.002, level=-100)
    data = mujoco.MjData(dry)
    data.qvel[:6] = (0.8, 0.1, 0.0, 0.1, 0.2, 0.3)
    body, velocity = dry.body("husky").id, np.zeros(6)
    rows, jacobian, before = [], np.zeros((6, dry.nv)), None
    # two copies of iceoryx2 in a process do not get along
    with wade.GrpcClient(f"unix:{server.socket}") as client, client.stream("husky") as stream:
        for _ in range(1000):
            mujoco.mj_step1(dry, data)
            frame = data.xmat[body].reshape(3, 3)
            mujoco.mj_objectVelocity(dry, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 1)
            state = wade.State(
                water_level_m=-data.xpos[body, 2], velocity_mps=velocity[3:], angular_velocity_radps=velocity[:3],
                gravity_direction=-frame[2], heading_rad=np.arctan2(frame[1, 0], frame[0, 0]),
                time_step_s=0.0 if before is None else data.time - before, implicit_added_mass=True,
            )  # fmt: skip
            before = data.time
            forces = stream.evaluate(state)
            assert forces.added_mass is not None
            mass = forces.added_mass.astype(float)
            load = np.concatenate((forces.force_n, forces.moment_nm)).astype(float)
            load += mass[:, :3] @ np.cross(velocity[:3], velocity[3:])
            center = data.xpos[body] + frame @ forces.about_m
            mujoco.mj_jac(dry, data, jacobian[:3], jacobian[3:], center, body)
            own = np.concatenate((frame.T @ jacobian[:3], frame.T @ jacobian[3:]))
            rows_of, columns = np.tril_indices(6)
            data.M[dry.M_rowadr[rows_of] + columns] += (own.T @ mass @ own)[rows_of, columns]
            mujoco.mj_factorM(dry, data)
            mujoco.mj_applyFT(dry, data, frame @ load[:3], frame @ load[3:], center, body, data.qfrc_passive)
            mujoco.mj_step2(dry, data)
            rows.append([data.time, *data.qpos[:3], *data.qvel[:6]])
    assert np.abs(np.array(rows) - track).max() < 1e-6


def test_a_run_that_is_reset_is_the_first(server: Server) -> None:
    of = husky(server)
    data = mujoco.MjData(of)

    def track() -> NDArray[np.float64]:
        rows = []
        for _ in range(300):
            mujoco.mj_step(of, data)
            # an evaluation between steps moves nothing on
            mujoco.mj_forward(of, data)
            rows.append(data.qpos[:7].copy())
        return np.array(rows)

    first = track()
    mujoco.mj_resetData(of, data)
    assert np.array_equal(track(), first)


@pytest.mark.parametrize(
    ("config", "says"),
    [
        ({}, "vehicle is missing"),
        ({"vehicle": "nobody"}, "nobody"),
        ({"vehicle": "husky", "address": "shm:nowhere", "wait": 0.1}, "wade serve"),
        ({"vehicle": "husky", "address": "nonsense"}, "address"),
        ({"vehicle": "husky", "level": "high"}, 'level is "high"'),
        ({"vehicle": "husky", "current": "1 2"}, "three numbers"),
        ({"vehicle": "husky", "density": "nan"}, "density"),
        ({"vehicle": "husky", "wheels": "front"}, "no hinge"),
        ({"vehicle": "husky", "budget": -1}, "budget"),
    ],
)
def test_an_mjcf_that_cannot_be_served_is_an_error(config: dict[str, Any], says: str, server: Server) -> None:
    with pytest.raises(ValueError, match=says):
        model(**({"address": address(server)} | config))


def test_a_server_that_dies_and_comes_back_ends_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    server = Server(tmp_path)
    server.start()
    of = husky(server, budget=0.05, oldest=0.3, height=0.0)
    data = mujoco.MjData(of)
    for _ in range(100):
        mujoco.mj_step(of, data)
    lift = data.qfrc_passive[2]
    server.kill()
    mujoco.mj_step(of, data)
    assert data.qfrc_passive[2] == pytest.approx(lift, rel=0.05), "the last forces stay for a while"
    time.sleep(0.4)
    mujoco.mj_step(of, data)
    for _ in range(20):
        mujoco.mj_step(of, data)
    said = capfd.readouterr().err
    assert data.qfrc_passive[2] == 0.0 and 1 <= said.count("wade.water") <= 3, said
    server.start()
    end = time.monotonic() + 20
    while data.qfrc_passive[2] == 0.0 and time.monotonic() < end:
        # where it is, for it would fall without water
        mujoco.mj_forward(of, data)
    assert data.qfrc_passive[2] > 0.0
    server.kill()
