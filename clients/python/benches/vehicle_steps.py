"""Vehicle-steps a second: MuJoCo with its own fluid model, with the server's forces, and the environment in numpy.

    python clients/python/benches/vehicle_steps.py --out benches/results/DATE/vehicle-steps.json

MuJoCo's fluid model fills all space and has no surface, so the cases do not answer the same question; they cost what
a user of each would pay. The MuJoCo cases step one vehicle after the other on one core, by 1 ms, in the ford.
Repeats alternate between the cases; the most and the median are reported, and the client's CPU time, which what else
the machine does changes least.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import mujoco
import numpy as np
from roundtrip import ROOT, machine, served

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import mujoco_wading as wading
from wading_env import WadingVectorEnv, steer


def models(count: int, fluid: str) -> tuple[mujoco.MjModel, list[mujoco.MjData]]:
    """That many vehicles that drive on the bed of the ford."""
    model = wading.build(wading.FORD, x=4.0, z=wading.FORD[2][1] - wading.Z0, fluid=fluid)
    return model, [mujoco.MjData(model) for _ in range(count)]


def stepping(model: mujoco.MjModel, vehicles: list[mujoco.MjData]) -> Callable[[], None]:
    """One step of each with what MuJoCo has."""

    def step() -> None:
        for data in vehicles:
            mujoco.mj_step(model, data)

    return step


def served_one_by_one(client: wade.Client, model: mujoco.MjModel, vehicles: list[mujoco.MjData]) -> Callable[[], None]:
    """One step of each with a call for each."""
    waters = [wading.Water(client, model) for _ in vehicles]

    def step() -> None:
        for water, data in zip(waters, vehicles, strict=True):
            mujoco.mj_step1(model, data)
            water.apply(data)
            mujoco.mj_step2(model, data)

    return step


def served_in_a_batch(client: wade.Client, model: mujoco.MjModel, vehicles: list[mujoco.MjData]) -> Callable[[], None]:
    """One step of each with one call for all."""
    body = model.body("warthog").id
    for data in vehicles:
        mujoco.mj_forward(model, data)

    def step() -> None:
        # the free joint: place and quaternion; velocity in the world, angular velocity in the body
        place = np.array([data.qpos[:7] for data in vehicles])
        motion = np.array([data.qvel[:6] for data in vehicles])
        rotation = np.array([data.xmat[body] for data in vehicles]).reshape(-1, 3, 3)
        depth = np.maximum((wading.WATER_LEVEL - place[:, 2]) / rotation[:, 2, 2] - wading.Z0, 0.0)
        states = wade.State(
            depth_m=depth,
            velocity_mps=np.einsum("nji,nj->ni", rotation, motion[:, :3]),
            angular_velocity_radps=motion[:, 3:],
            gravity_direction=-rotation[:, 2],
        )
        water = client.evaluate_batch(wading.VEHICLE, states, surfaces=False)
        force = np.einsum("nij,nj->ni", rotation, water.force_n)
        centers = np.array([data.xipos[body] for data in vehicles])
        arm = place[:, :3] + rotation @ water.about_m - centers
        moment = np.einsum("nij,nj->ni", rotation, water.moment_nm) + np.cross(arm, force)
        for data, wrench in zip(vehicles, np.hstack((force, moment)), strict=True):
            data.xfrc_applied[body] = wrench
            mujoco.mj_step(model, data)

    return step


def environment(client: wade.Client, count: int) -> Callable[[], None]:
    """One step of the environment, with a policy by hand."""
    env = WadingVectorEnv(client, count)
    observations, _ = env.reset(seed=1)

    def step() -> None:
        nonlocal observations
        observations = env.step(steer(observations))[0]

    return step


def measure(cases: dict[str, tuple[Callable[[], None], int]], repeats: int, steps: int) -> dict[str, dict[str, float]]:
    """Vehicle-steps a second of each case."""
    rates: dict[str, list[float]] = {name: [] for name in cases}
    cpu: dict[str, list[float]] = {name: [] for name in cases}
    for repeat in range(repeats + 1):
        for name, (step, count) in cases.items():
            wall, used = time.perf_counter(), time.process_time()
            for _ in range(max(steps // count, 1)):
                step()
            done = max(steps // count, 1) * count
            if repeat > 0:  # the first warms up
                rates[name].append(done / (time.perf_counter() - wall))
                cpu[name].append((time.process_time() - used) / done * 1e6)
    return {
        name: {
            "per_second_most": max(rates[name]),
            "per_second_median": float(np.median(rates[name])),
            "client_cpu_us_each": float(np.median(cpu[name])),
        }
        for name in cases
    }


def main() -> None:
    """Starts a server of its own, measures, prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wade", type=Path, default=ROOT / "target" / "release" / "wade")
    parser.add_argument("--repeats", type=int, default=20)
    parser.add_argument("--steps", type=int, default=4096, help="vehicle-steps of a repeat")
    parser.add_argument("--note", default="", help="what else the machine does, for the results")
    parser.add_argument("--out", type=Path, help="JSON file for the results")
    arguments = parser.parse_args()
    cpus, started = sorted(os.sched_getaffinity(0)), machine(arguments.wade)
    with ExitStack() as stack:
        namespace = stack.enter_context(served(arguments.wade.resolve(), "block", cpus[0])).namespace
        os.sched_setaffinity(0, {cpus[-1]})
        client = stack.enter_context(wade.ShmClient(namespace, timeout_s=60.0))
        water = 'density="1000" viscosity="0.001"'
        cases = {
            "MuJoCo, no fluid": (stepping(*models(64, "")), 64),
            "MuJoCo, its own fluid model": (stepping(*models(64, water)), 64),
            "MuJoCo, wade one by one": (served_one_by_one(client, *models(64, "")), 64),
            "MuJoCo, wade in batches of 1024": (served_in_a_batch(client, *models(1024, "")), 1024),
            "environment of 4096, wade": (environment(client, 4096), 4096),
        }
        results = measure(cases, arguments.repeats, arguments.steps)
    print(f"{'vehicle-steps a second':34} {'most':>10} {'median':>10} {'client CPU each [us]':>22}")
    for name, row in results.items():
        print(f"{name:34} {{:10.0f}} {{:10.0f}} {{:22.1f}}".format(*row.values()))
    if arguments.out:
        versions = {"mujoco": mujoco.__version__}
        report = {
            "machine": started | versions,
            "note": arguments.note,
            "vehicle": wading.VEHICLE,
            "results": results,
        }
        arguments.out.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
