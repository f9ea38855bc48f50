"""A Warthog drives down a ramp into the water and out again in MuJoCo, the water's forces asked for at every step.

    wade serve
    python clients/python/examples/mujoco_wading.py --plot wading.png --heave heave.png

MuJoCo has no free surface. Here each step of 1 ms asks the server for the net wrench at the present depth, attitude
and velocity, over shared memory, and puts it on the body that carries the wheels. The matrix of added mass goes into
MuJoCo's own before the accelerations are solved for. As a force (`explicit`) it follows the acceleration of the step
before; in a session the server solves for what body and water share, so that this is stable too (`--heave` draws both).
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

import wade

if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    # MuJoCo chooses how to draw when it is imported, and without a display would choose one
    os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco

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
  <geom type="cylinder" size="0.305 0.127" euler="90 0 0" mass="15" friction="1 0.01 0.001" rgba="0.2 0.2 0.2 1"/>
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
          <visual><headlight ambient="0.5 0.5 0.5" diffuse="0.5 0.5 0.5"/></visual>
          <asset>
            <texture type="skybox" builtin="gradient" rgb1="0.8 0.9 1" rgb2="0.5 0.6 0.8" width="64" height="64"/>
          </asset>
          <worldbody>
            <light pos="4 -3 6" dir="0 0.4 -1"/>
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
    """Puts the server's forces on the vehicle, along one run of states, which lasts until it is closed."""

    def __init__(
        self,
        client: wade.Client,
        model: mujoco.MjModel,
        *,
        current: tuple[float, float, float] = (0.0, 0.0, 0.0),
        explicit: bool = False,
    ):
        self._model, self._body = model, model.body("warthog").id
        self._stream = client.stream(VEHICLE)
        self._current, self._explicit = np.array(current), explicit
        self._wheels = model.jnt_dofadr[[model.joint(f"wheel_{name}").id for name in WHEELS]]
        # the body's own degrees of freedom come first: six, or one on a guide
        self._dofs = int(self._wheels.min())
        # of the mass matrix there is the lower triangle, by rows
        self._triangle = np.tril_indices(self._dofs)
        self._places = model.M_rowadr[self._triangle[0]] + self._triangle[1]
        self._jacobian, self._product = np.zeros((6, model.nv)), np.zeros(3)
        # angular and linear, body axes; and the same with the linear one in the world, of the step before
        self._velocity, self._before = np.zeros(6), np.zeros(6)
        #: CPU time within the calls [s].
        self.called_s = 0.0
        #: What the server says that it computed [s].
        self.computed_s = 0.0

    def close(self) -> None:
        """Ends the run."""
        self._stream.close()

    def depth(self, data: mujoco.MjData) -> float:
        """Height of the water above the contact plane at the body's origin, along the body's z axis [m]."""
        up_z = data.xmat[self._body, 8]
        return float((WATER_LEVEL - data.xpos[self._body, 2]) / up_z - Z0)

    def apply(self, data: mujoco.MjData) -> wade.Forces:
        """Between `mj_step1` and `mj_step2`: wrench and added mass of this step."""
        body, depth = self._body, self.depth(data)
        wrench = data.xfrc_applied[body]
        world_from_body = data.xmat[body].reshape(3, 3)
        state = self._state(data, depth, world_from_body)
        start = time.thread_time()
        forces = self._stream.evaluate(state)
        self.called_s += time.thread_time() - start
        self.computed_s += forces.compute_ns * 1e-9
        load = np.concatenate((forces.force_n, forces.moment_nm)).astype(float)
        center = data.xpos[body] + world_from_body @ forces.about_m
        if forces.added_mass is not None and not self._explicit:
            load += self._add_mass(data, forces.added_mass.astype(float), world_from_body, center)
        # MuJoCo takes the wrench about the center of mass of this one body
        wrench[:3] = world_from_body @ load[:3]
        mujoco.mju_cross(self._product, center - data.xipos[body], wrench[:3])
        wrench[3:] = world_from_body @ load[3:] + self._product
        return forces

    def _state(self, data: mujoco.MjData, depth: float, world_from_body: Any) -> wade.State:
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, self._body, self._velocity, 1)
        in_world = world_from_body @ self._velocity[3:]
        state = wade.State(
            depth_m=depth,
            velocity_mps=self._velocity[3:],
            angular_velocity_radps=self._velocity[:3],
            gravity_direction=-world_from_body[2],
            heading_rad=math.atan2(world_from_body[1, 0], world_from_body[0, 0]),
            depth_rate_mps=-in_world[2],
            wheel_speed_radps=data.qvel[self._wheels],
            time_step_s=self._model.opt.timestep,
            implicit_added_mass=not self._explicit,
        )
        if self._current.any():
            state.current_mps = world_from_body.T @ self._current
        if self._explicit:
            now = np.concatenate((self._velocity[:3], in_world))
            if data.time > 0.0:
                # that of the step before: there is no other yet
                rates = (now - self._before) / self._model.opt.timestep
                state.acceleration_mps2 = world_from_body.T @ rates[3:]
                state.angular_acceleration_radps2 = rates[:3]
            self._before = now
        return state

    def _add_mass(self, data: mujoco.MjData, matrix: Any, world_from_body: Any, center: Any) -> Any:
        """Adds `J^T M_A J` to the mass matrix; J takes the body's rates to `nu`, the velocity of the center of mass and
        the angular velocity in body axes. What `nu_dot` has beside `J q_ddot`, `-omega x v`, becomes a load.
        """
        jacobian = self._jacobian
        mujoco.mj_jac(self._model, data, jacobian[:3], jacobian[3:], center, self._body)
        own = np.concatenate((world_from_body.T @ jacobian[:3], world_from_body.T @ jacobian[3:]))[:, : self._dofs]
        data.M[self._places] += (own.T @ matrix @ own)[self._triangle]
        mujoco.mj_factorM(self._model, data)
        mujoco.mju_cross(self._product, self._velocity[:3], self._velocity[3:])
        return matrix[:, :3] @ self._product


@dataclass
class Cost:
    """Seconds that a simulated second took: on the clock, and of this process's CPU by what it did."""

    wall: float
    mujoco: float
    #: Within the client of wade.
    client: float
    #: The rest: this example's Python.
    python: float
    #: The server's own count of its computing; on a busy machine with what interrupted it.
    computed: float


@dataclass
class Track:
    """What a drive was like, a row a step."""

    #: [s]
    time: np.ndarray
    #: Place of the body's origin, world [m], `[steps, 3]`.
    position: np.ndarray
    #: Positive lowers the nose [rad].
    pitch: np.ndarray
    #: [m]
    depth: np.ndarray
    #: Net force of the water, body frame [N], `[steps, 3]`, without what went into the mass matrix.
    force: np.ndarray
    cost: Cost


def run(
    client: wade.Client,
    model: mujoco.MjModel,
    duration_s: float,
    speed: float = 0.0,
    *,
    velocity: tuple[float, ...] = (),
    look: Callable[[mujoco.MjData], None] | None = None,
    **water_settings: Any,
) -> Track:
    """Drives at a wheel speed [m/s] for a time [s], beginning with these rates; ends where it flies apart."""
    data = mujoco.MjData(model)
    data.qvel[: len(velocity)] = velocity
    data.ctrl[:] = speed / WHEEL_RADIUS
    water, steps = Water(client, model, **water_settings), round(duration_s / model.opt.timestep)
    body, rows, stepped_s = model.body("warthog").id, [], 0.0
    began, began_s = time.perf_counter(), time.thread_time()
    for _ in range(steps):
        start = time.thread_time()
        mujoco.mj_step1(model, data)
        stepped_s += time.thread_time() - start
        forces = water.apply(data)
        pitch = -math.asin(data.xmat[body, 6])
        rows.append((data.time, *data.xpos[body], pitch, water.depth(data), *forces.force_n))
        if look is not None:
            look(data)
        start = time.thread_time()
        mujoco.mj_step2(model, data)
        stepped_s += time.thread_time() - start
        if not abs(data.qvel[:6]).max() < 100.0:
            break
    wall, total = time.perf_counter() - began, time.thread_time() - began_s
    water.close()
    parts = (wall, stepped_s, water.called_s, total - stepped_s - water.called_s, water.computed_s)
    table = np.array(rows)
    cost = Cost(*(part / (len(rows) * model.opt.timestep) for part in parts))
    return Track(table[:, 0], table[:, 1:4], table[:, 4], table[:, 5], table[:, 6:], cost)


def ford(client: wade.Client, timestep_s: float = TIMESTEP_S, pictures: Pictures | None = None) -> Track:
    """Through the ford, at 1.2 m/s, in 14 s."""
    model = build(FORD, x=-5.0, z=FORD[0][1] - Z0 + 0.01, timestep_s=timestep_s)
    return run(client, model, 14.0, 1.2, look=None if pictures is None else pictures.of(model))


def heave(client: wade.Client, depth_m: float, *, explicit: bool = False, timestep_s: float = TIMESTEP_S) -> Track:
    """Let go 2 cm too high in the basin, on a guide that leaves it up and down alone, for 3 s."""
    guide = '<joint type="slide" axis="0 0 1"/>'
    model = build(BASIN, x=0.0, z=-Z0 - depth_m + 0.02, timestep_s=timestep_s, joint=guide)
    return run(client, model, 3.0, explicit=explicit)


class Pictures:
    """Looks at a drive now and then, from the side. Without a display it draws by EGL, or by what MUJOCO_GL names."""

    def __init__(self, times_s: tuple[float, ...]):
        self._times_s, self.taken = list(times_s), list[Any]()

    def of(self, model: mujoco.MjModel) -> Callable[[mujoco.MjData], None]:
        """What `run` calls at each step."""
        renderer, camera = mujoco.Renderer(model, 240, 480), mujoco.MjvCamera()
        camera.distance, camera.azimuth, camera.elevation = 4.5, 115.0, -12.0

        def look(data: mujoco.MjData) -> None:
            if self._times_s and data.time >= self._times_s[0]:
                self._times_s.pop(0)
                camera.lookat[:] = data.xpos[model.body("warthog").id]
                renderer.update_scene(data, camera)
                self.taken.append(renderer.render())

        return look

    def save(self, path: str) -> None:
        """All of them in one, two beside each other."""
        from matplotlib import image

        rows = [np.hstack(self.taken[i : i + 2]) for i in range(0, len(self.taken), 2)]
        image.imsave(path, np.vstack(rows))


def plot(track: Track, path: str) -> None:
    """Depth, pitch and force over time."""
    figure, axes = _figure(3)
    axes[0].plot(track.time, np.maximum(track.depth, 0.0))
    axes[0].set_ylabel("water depth [m]")
    axes[1].plot(track.time, np.degrees(track.pitch))
    axes[1].set_ylabel("pitch, nose down + [deg]")
    axes[2].plot(track.time, track.force, label=["Fx", "Fy", "Fz"])
    axes[2].set_ylabel("force of the water [N]")
    axes[2].set_xlabel("time [s]")
    axes[2].legend()
    figure.savefig(path, dpi=100)


def acceleration(track: Track) -> Any:
    """Of the depth [m/s2], a row less at each end."""
    return np.diff(track.depth, 2) / (track.time[1] - track.time[0]) ** 2


def plot_heave(implicit: Track, explicit: Track, path: str) -> None:
    """The same hull let go twice: the added mass in the mass matrix, and as a force."""
    figure, axes = _figure(2)
    for track, label in ((explicit, "added mass as a force, of the step before"), (implicit, "in the mass matrix")):
        axes[0].plot(track.time, track.depth, label=label)
        axes[1].plot(track.time[1:-1], acceleration(track), label=label, linewidth=0.5)
    middle = implicit.depth.mean()
    axes[0].set_ylim(middle - 0.06, middle + 0.06)
    axes[0].set_ylabel("water depth [m]")
    axes[1].set_ylabel("its acceleration [m/s2]")
    axes[1].set_xlabel("time [s]")
    axes[0].legend()
    figure.savefig(path, dpi=100)


def _figure(rows: int) -> tuple[Any, Any]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(rows, sharex=True, figsize=(7, 1 + 2.2 * rows), layout="constrained")
    return figure, axes


def main() -> None:
    """Drives, says how it went, draws."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--namespace", default="wade", help="of the server's shared memory")
    parser.add_argument("--plot", help="where to put a plot of depth, pitch and force")
    parser.add_argument("--pictures", help="where to put six pictures of the drive")
    parser.add_argument("--heave", help="where to put a plot of the hull let go afloat, added mass both ways")
    arguments = parser.parse_args()
    pictures = Pictures((1.0, 3.5, 5.5, 7.5, 10.0, 12.5)) if arguments.pictures else None
    with wade.ShmClient(arguments.namespace) as client:
        track = ford(client, pictures=pictures)
        if arguments.heave:
            plot_heave(heave(client, 0.378), heave(client, 0.378, explicit=True), arguments.heave)
    deepest, cost = track.depth.argmax(), track.cost
    print(f"from x = {track.position[0, 0]:.1f} m to {track.position[-1, 0]:.1f} m in {track.time[-1]:.1f} s")
    print(f"deepest {track.depth[deepest]:.3f} m, there force {track.force[deepest].round(1)} N")
    print(f"pitch {np.degrees(track.pitch.min()):.1f} to {np.degrees(track.pitch.max()):.1f} degrees")
    print(f"{1 / cost.wall:.1f} times real time at {1 / TIMESTEP_S:.0f} Hz; of a second's CPU time in MuJoCo", end=" ")
    print(f"{cost.mujoco:.3f} s, in the client {cost.client:.3f} s, in this program {cost.python:.3f} s")
    if arguments.plot:
        plot(track, arguments.plot)
    if pictures is not None:
        pictures.save(arguments.pictures)


if __name__ == "__main__":
    main()
