"""A Warthog drives down a ramp into the water and out again in MuJoCo, the water's forces asked for at every step.

    python clients/python/examples/mujoco_wading.py --plot wading.png     # with wade serve running on this machine

MuJoCo has no free surface. Here each step of 1 ms asks the server for the net wrench at the present depth, attitude
and velocity, over shared memory, and puts it on the body that carries the wheels. Not in it yet, since it is not served
yet: added mass, and damping in heave, pitch and roll; `stand_in_damping` puts a plain damping in the place of the
latter. A depth below zero cannot be asked for: the water begins when it reaches the ground under the body's origin.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

import wade

VEHICLE = "warthog"
#: The vehicle file's contact plane, below the body's origin [m].
Z0 = -0.413
#: Surface of the water, world [m].
WATER_LEVEL = 0.0
TIMESTEP_S = 0.001
WHEEL_RADIUS = 0.305
#: Profile of the ford, (x, z) of the ground [m]: shore, ramp of 8 degrees, bed 0.30 m under water, ramp, shore.
FORD = ((-7.0, 0.3), (-2.0, 0.3), (2.3, -0.3), (6.3, -0.3), (10.6, 0.3), (16.0, 0.3))
#: Deep enough to float.
BASIN = ((-50.0, -2.0), (50.0, -2.0))

# masses and places add up to the vehicle file's 280 kg with the center of mass at (0, 0, -0.058)
BODY = """
<body name="warthog" pos="{x} 0 {z}">
  {joint}
  <inertial pos="0 0 -0.0444" mass="220" diaginertia="40 55 80"/>
  <geom name="hull" type="box" size="0.68 0.35 0.2" pos="-0.03 0 0.1" contype="0" conaffinity="0" rgba="0.9 0.7 0.1 1"/>
  {wheels}
</body>
"""
WHEEL = """
<body name="wheel_{name}" pos="{x} {y} -0.108">
  <joint name="wheel_{name}" type="hinge" axis="0 1 0" damping="0.5"/>
  <geom type="cylinder" size="0.305 0.127" euler="90 0 0" mass="15" friction="1 0.01 0.001" rgba="0.1 0.1 0.1 1"/>
</body>
"""
WHEELS = {"fl": (0.457, 0.5685), "fr": (0.457, -0.5685), "rl": (-0.457, 0.5685), "rr": (-0.457, -0.5685)}


def build(
    ground: tuple[tuple[float, float], ...],
    x: float,
    z: float,
    *,
    timestep_s: float = TIMESTEP_S,
    joint: str = "<freejoint/>",
    fluid: str = "",
) -> mujoco.MjModel:
    """The vehicle with its origin at (x, 0, z) over a ground profile; `fluid` are attributes of MuJoCo's own model."""
    slabs = "".join(slab(*start, *end) for start, end in pairwise(ground))
    wheels = "".join(WHEEL.format(name=name, x=place[0], y=place[1]) for name, place in WHEELS.items())
    motors = "".join(f'<velocity joint="wheel_{name}" kv="80" forcerange="-250 250"/>' for name in WHEELS)
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{timestep_s}" integrator="implicitfast" {fluid}/>
          <worldbody>
            <light pos="4 0 6"/>
            <geom name="water" type="plane" size="60 60 1" contype="0" conaffinity="0" rgba="0.2 0.4 0.8 0.4"/>
            {slabs}
            {BODY.format(x=x, z=z, joint=joint, wheels=wheels)}
          </worldbody>
          <actuator>{motors}</actuator>
        </mujoco>""")


def slab(x0: float, z0: float, x1: float, z1: float) -> str:
    """A box whose upper face runs from one point of the profile to the next."""
    length, thickness = np.hypot(x1 - x0, z1 - z0), 0.5
    along, down = np.array([x1 - x0, z1 - z0]) / length, thickness / 2
    center = np.array([x0 + x1, z0 + z1]) / 2 - down * np.array([-along[1], along[0]])
    angle = -np.degrees(np.arctan2(along[1], along[0]))
    size = f"{length / 2} 5 {down}"
    return f'<geom type="box" size="{size}" pos="{center[0]} 0 {center[1]}" euler="0 {angle} 0" rgba="0.5 0.4 0.3 1"/>'


class Water:
    """Puts the server's forces on the vehicle."""

    def __init__(self, client: wade.Client, model: mujoco.MjModel, stand_in_damping: bool = False):
        self._client, self._model = client, model
        self._body = model.body("warthog").id
        self._velocity = np.zeros(6)
        # N s/m and N m s/rad, for heave, roll and pitch
        self._damping = np.array([2000.0, 300.0, 300.0]) if stand_in_damping else np.zeros(3)

    def depth(self, data: mujoco.MjData) -> float:
        """Height of the water above the contact plane at the body's origin, along the body's z axis [m]."""
        up_z = data.xmat[self._body, 8]
        return float((WATER_LEVEL - data.xpos[self._body, 2]) / up_z - Z0)

    def apply(self, data: mujoco.MjData) -> wade.Forces | None:
        """Sets the wrench of the next step; None where the vehicle is out of the water."""
        body, depth = self._body, self.depth(data)
        wrench = data.xfrc_applied[body]
        if depth <= 0.0:
            wrench[:] = 0.0
            return None
        world_from_body = data.xmat[body].reshape(3, 3)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, self._velocity, 1)
        state = wade.State(
            depth_m=depth,
            velocity_mps=self._velocity[3:],
            angular_velocity_radps=self._velocity[:3],
            gravity_direction=-world_from_body[2],
        )
        forces = self._client.evaluate(VEHICLE, state)
        force, moment = forces.force_n.astype(float), forces.moment_nm.astype(float)
        moment[:2] -= self._damping[1:] * self._velocity[:2]
        # MuJoCo takes the wrench about the center of mass of this one body
        arm = data.xpos[body] + world_from_body @ forces.about_m - data.xipos[body]
        wrench[:3] = world_from_body @ force
        wrench[2] -= self._damping[0] * (world_from_body[2] @ self._velocity[3:])
        wrench[3:] = world_from_body @ moment + np.cross(arm, wrench[:3])
        return forces


@dataclass
class Track:
    """What a drive was like, a row a step."""

    #: [s]
    time: np.ndarray
    #: Place of the body's origin [m], `[steps, 3]`.
    position: np.ndarray
    #: Positive lowers the nose [rad].
    pitch: np.ndarray
    #: [m]
    depth: np.ndarray
    #: Net force of the water, body frame [N], `[steps, 3]`.
    force: np.ndarray
    #: Simulated seconds a second.
    real_time_factor: float


def run(client: wade.Client, model: mujoco.MjModel, duration_s: float, speed: float, damping: bool = False) -> Track:
    """Drives at a wheel speed [m/s] for a time [s]."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    water, steps = Water(client, model, damping), round(duration_s / model.opt.timestep)
    data.ctrl[:] = speed / WHEEL_RADIUS
    body = model.body("warthog").id
    rows = np.zeros((steps, 9))
    start = time.perf_counter()
    for row in rows:
        forces = water.apply(data)
        row[0], row[1:4], row[4] = data.time, data.xpos[body], -np.arcsin(data.xmat[body, 6])
        row[5] = water.depth(data)
        if forces is not None:
            row[6:] = forces.force_n
        mujoco.mj_step(model, data)
    factor = duration_s / (time.perf_counter() - start)
    return Track(rows[:, 0], rows[:, 1:4], rows[:, 4], rows[:, 5], rows[:, 6:], factor)


def ford(client: wade.Client, timestep_s: float = TIMESTEP_S) -> Track:
    """Through the ford, at 1.2 m/s, in 14 s."""
    return run(client, build(FORD, x=-5.0, z=FORD[0][1] - Z0 + 0.01, timestep_s=timestep_s), 14.0, 1.2)


def plot(track: Track, path: str) -> None:
    """Depth, pitch and force over time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(3, sharex=True, figsize=(8, 8), layout="constrained")
    axes[0].plot(track.time, np.maximum(track.depth, 0.0))
    axes[0].set_ylabel("water depth [m]")
    axes[1].plot(track.time, np.degrees(track.pitch))
    axes[1].set_ylabel("pitch, nose down + [deg]")
    axes[2].plot(track.time, track.force, label=["Fx", "Fy", "Fz"])
    axes[2].set_ylabel("force of the water [N]")
    axes[2].set_xlabel("time [s]")
    axes[2].legend()
    figure.savefig(path, dpi=120)


def main() -> None:
    """Drives, says how it went, plots."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--namespace", default="wade", help="of the server's shared memory")
    parser.add_argument("--plot", help="where to put a picture of depth, pitch and force")
    arguments = parser.parse_args()
    with wade.ShmClient(arguments.namespace) as client:
        track = ford(client)
    deepest = track.depth.argmax()
    print(f"from x = {track.position[0, 0]:.1f} m to {track.position[-1, 0]:.1f} m in {track.time[-1]:.1f} s")
    print(f"deepest {track.depth[deepest]:.3f} m, there force {track.force[deepest].round(1)} N")
    print(f"pitch {np.degrees(track.pitch.min()):.1f} to {np.degrees(track.pitch.max()):.1f} degrees")
    print(f"{track.real_time_factor:.1f} times real time at {1 / TIMESTEP_S:.0f} Hz")
    if arguments.plot:
        plot(track, arguments.plot)


if __name__ == "__main__":
    main()
