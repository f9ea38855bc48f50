"""A Warthog is let go in deep water in PyBullet and comes to rest where it floats, by the same client as in MuJoCo.

    pip install pybullet
    python clients/python/examples/pybullet_floating.py         # with wade serve running on this machine

Bullet's mass matrix is out of reach, but where nothing touches the body the force that it needs can be worked out: the
one under which its own mass moves as the mass and the water's would (`driven`).
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import pybullet

import wade

VEHICLE = "warthog"
TIMESTEP_S = 0.002
GRAVITY = 9.81


def driven(mass: Any, added: Any, load: Any, weight: Any, velocity: Any) -> Any:
    """The wrench that gives a free body of this mass matrix the accelerations of `mass + added` under `load`.

    About the center of mass in body axes, forces first: `(M + M_A) nu_dot = load + weight - C(nu) nu`, with Euler's
    `C(nu) nu = (omega x m v, omega x I omega)`, of which Bullet has the weight and C already.
    """
    turning = np.concatenate([np.cross(velocity[3:], part @ velocity) for part in (mass[:3], mass[3:])])
    own = weight - turning
    return mass @ np.linalg.solve(mass + added, load + own) - own


def let_go(client: wade.Client, vehicle: wade.Vehicle, depth_m: float, duration_s: float) -> Any:
    """Depths [m] along the way, one a step, from rest and level at a depth."""
    center = vehicle.center_of_mass_m.astype(float)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = vehicle.mass_kg * np.eye(3), np.diag(np.diag(vehicle.inertia_kgm2))
    world = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=world)
        pybullet.setTimeStep(TIMESTEP_S, physicsClientId=world)
        # Bullet places a body by its center of mass
        start = np.array([0.0, 0.0, -vehicle.z0_m - depth_m]) + center
        body = pybullet.createMultiBody(vehicle.mass_kg, basePosition=start.tolist(), physicsClientId=world)
        pybullet.changeDynamics(
            body,
            -1,
            localInertiaDiagonal=np.diag(vehicle.inertia_kgm2).tolist(),
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=world,
        )
        with client.stream(VEHICLE) as water:
            return np.array(
                [_step(world, body, water, vehicle, mass, center) for _ in range(round(duration_s / TIMESTEP_S))]
            )
    finally:
        pybullet.disconnect(world)


def _step(world: int, body: int, water: wade.Stream, vehicle: wade.Vehicle, mass: Any, center: Any) -> float:
    place, turned = pybullet.getBasePositionAndOrientation(body, physicsClientId=world)
    rotation = np.array(pybullet.getMatrixFromQuaternion(turned)).reshape(3, 3)
    linear, angular = (np.array(v) @ rotation for v in pybullet.getBaseVelocity(body, physicsClientId=world))
    origin = linear - np.cross(angular, center)
    depth = -(place[2] - rotation[2] @ center) / rotation[2, 2] - vehicle.z0_m
    forces = water.evaluate(
        wade.State(
            depth_m=max(depth, 0.0),
            velocity_mps=origin,
            angular_velocity_radps=angular,
            gravity_direction=-rotation[2],
            depth_rate_mps=-(rotation @ origin)[2],
            time_step_s=TIMESTEP_S,
            implicit_added_mass=True,
        )
    )
    load = np.concatenate((forces.force_n, forces.moment_nm)).astype(float)
    if forces.added_mass is not None:
        weight = np.concatenate((-vehicle.mass_kg * GRAVITY * rotation[2], np.zeros(3)))
        load = driven(mass, forces.added_mass.astype(float), load, weight, np.concatenate((linear, angular)))
    force, moment = rotation @ load[:3], rotation @ load[3:]
    pybullet.applyExternalForce(body, -1, force.tolist(), place, pybullet.WORLD_FRAME, physicsClientId=world)
    pybullet.applyExternalTorque(body, -1, moment.tolist(), pybullet.WORLD_FRAME, physicsClientId=world)
    pybullet.stepSimulation(physicsClientId=world)
    return float(depth)


def main() -> None:
    """Lets it go and says where it came to rest."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--namespace", default="wade", help="of the server's shared memory")
    parser.add_argument("--address", default="127.0.0.1:50051", help="of its gRPC, for mass and size of the vehicle")
    arguments = parser.parse_args()
    with wade.GrpcClient(arguments.address) as client:
        vehicle = client.vehicle(VEHICLE)
    with wade.ShmClient(arguments.namespace) as client:
        depths = let_go(client, vehicle, 0.42, 6.0)
    end = depths[-500:]
    print(f"from {depths[0]:.3f} m to {end.mean():.3f} m, in the last second within {np.ptp(end) * 1e3:.1f} mm")


if __name__ == "__main__":
    main()
