"""Plans how a Husky drives through a pool: a trajectory optimizer that takes the water's derivatives.

The motion is planar: speed ahead, to the left and of turning, at one depth. The drive pushes along the hull and turns
it. The optimizer is iLQR (Li, Todorov, 2004): it rolls the motion out, linearizes it along the way, and solves for
better controls. The derivatives of the force come with each answer or, to compare, from the differences of six answers
a state.

    wade serve &
    python planned_crossing.py
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import wade

Array = NDArray[np.float64]

VEHICLE = "husky"
DEPTH = 0.20
STEP = 0.05
STEPS = 80
#: Where to arrive, at rest: two meters ahead and one to the left, turned by a quarter.
GOAL = np.array([2.0, 1.0, np.pi / 2, 0.0, 0.0, 0.0])
#: Cost of a miss at the end, and of a newton and a newton meter for a second.
MISS = np.diag([4e4, 4e4, 4e4, 4e3, 4e3, 4e3])
EFFORT = np.diag([0.05, 0.2])
#: Rows of the wrench and columns of its derivatives that a planar motion has.
ROWS = [0, 1, 5]
VELOCITIES = [0, 1, 5]
#: Step of a difference of single-precision answers [m/s, rad/s].
DIFFERENCE = 1e-2


@dataclass
class Water:
    """What the water does to the vehicle in planar motion, and how that changes with the motion."""

    client: Any
    differences: bool
    queries: int = 0
    #: Time that derivatives took [s], and of how many states.
    seconds: float = 0.0
    linearized: int = 0

    def states(self, velocity: Array, jacobian: bool) -> wade.State:
        ahead, left, turning = np.moveaxis(velocity, -1, 0)
        zero = np.zeros_like(ahead)
        return wade.State(
            depth_m=DEPTH + zero,
            velocity_mps=np.stack([ahead, left, zero], -1),
            angular_velocity_radps=np.stack([zero, zero, turning], -1),
            jacobian=jacobian,
        )

    def force(self, velocity: Array) -> Array:
        """Forces along the hull and to the left and the turning moment [N, N m]."""
        self.queries += 1
        forces = self.client.evaluate(VEHICLE, self.states(velocity, False))
        return np.array([*forces.force_n[:2], forces.moment_nm[2]], float)

    def derivatives(self, velocities: Array) -> Array:
        """`[N, 3, 3]` of the forces at N motions."""
        begun = time.perf_counter()
        found = self._derivatives(velocities)
        self.seconds += time.perf_counter() - begun
        self.linearized += len(velocities)
        return found

    def _derivatives(self, velocities: Array) -> Array:
        if not self.differences:
            self.queries += len(velocities)
            answer = self.client.evaluate_batch(VEHICLE, self.states(velocities, True), surfaces=False)
            return np.asarray(answer.jacobian[:, ROWS][:, :, VELOCITIES], float)
        steps = DIFFERENCE * np.vstack([np.eye(3), -np.eye(3)])
        moved = (velocities[:, None] + steps).reshape(-1, 3)
        self.queries += len(moved)
        answer = self.client.evaluate_batch(VEHICLE, self.states(moved, False), surfaces=False)
        forces = np.hstack([answer.force_n[:, :2], answer.moment_nm[:, 2:]]).astype(float).reshape(-1, 6, 3)
        return np.asarray(np.swapaxes(forces[:, :3] - forces[:, 3:], 1, 2) / (2 * DIFFERENCE), float)


@dataclass
class Body:
    """A rigid vehicle that the drive pushes and the water holds back; the added mass of the water is left out."""

    mass: float
    inertia: float
    water: Water

    def motion(self, x: Array) -> tuple[Array, Array]:
        """Rates of place and heading, and their derivatives by the state."""
        (_, _, heading, ahead, left, turning) = x
        cosine, sine = np.cos(heading), np.sin(heading)
        rate = np.array([cosine * ahead - sine * left, sine * ahead + cosine * left, turning])
        by_state = np.zeros((3, 6))
        by_state[0, 2:5] = -rate[1], cosine, -sine
        by_state[1, 2:5] = rate[0], sine, cosine
        by_state[2, 5] = 1.0
        return rate, by_state

    def acceleration(self, x: Array, control: Array, force: Array) -> Array:
        """Rates of the velocities along the hull, to its left, and of turning."""
        push, twist = control
        ahead, left, turning = x[3:]
        return np.array(
            [
                (push + force[0]) / self.mass + turning * left,
                force[1] / self.mass - turning * ahead,
                (twist + force[2]) / self.inertia,
            ]
        )

    def step(self, x: Array, control: Array) -> Array:
        force = self.water.force(x[3:])
        rate, _ = self.motion(x)
        return x + STEP * np.concatenate([rate, self.acceleration(x, control, force)])

    def linearized(self, xs: Array) -> tuple[Array, Array]:
        """`[N, 6, 6]` and `[6, 2]`: how the next state follows this one and the control."""
        scale = np.array([self.mass, self.mass, self.inertia])
        by_velocity = self.water.derivatives(xs[:, 3:]) / scale[:, None]
        by_state = np.zeros((len(xs), 6, 6))
        for a, x, water in zip(by_state, xs, by_velocity, strict=True):
            ahead, left, turning = x[3:]
            a[:3] = self.motion(x)[1]
            a[3:, 3:] = water
            a[3, 4:] += turning, left
            a[4, [3, 5]] += -turning, -ahead
        by_control = np.zeros((6, 2))
        by_control[3, 0], by_control[5, 1] = STEP / self.mass, STEP / self.inertia
        return np.eye(6) + STEP * by_state, by_control


def rollout(body: Body, xs: Array, controls: Array, gains: Any, share: float) -> tuple[Array, Array, float]:
    """The motion under controls that a share of the planned change is added to, and its cost."""
    states, used = [xs[0]], []
    for k, control in enumerate(controls):
        if gains is not None:
            change, feedback = gains[k]
            control = control + share * change + feedback @ (states[-1] - xs[k])
        used.append(control)
        states.append(body.step(states[-1], control))
    effort = sum(float(control @ EFFORT @ control) * STEP for control in used)
    miss = states[-1] - GOAL
    return np.array(states), np.array(used), effort + float(miss @ MISS @ miss)


def gains(body: Body, xs: Array, controls: Array, damping: float) -> list[tuple[Array, Array]]:
    """Changes of the controls that are best for the linearized motion, by dynamic programming from the end."""
    by_state, by_control = body.linearized(xs[:-1])
    slope, curve = 2 * MISS @ (xs[-1] - GOAL), 2 * MISS
    found = []
    for a, control in zip(by_state[::-1], controls[::-1], strict=True):
        q_u = 2 * STEP * EFFORT @ control + by_control.T @ slope
        q_uu = 2 * STEP * EFFORT + by_control.T @ curve @ by_control + damping * np.eye(2)
        q_ux = by_control.T @ curve @ a
        change, feedback = -np.linalg.solve(q_uu, q_u), -np.linalg.solve(q_uu, q_ux)
        slope = a.T @ slope + feedback.T @ (q_uu @ change + q_u) + q_ux.T @ change
        curve = a.T @ curve @ a + feedback.T @ q_uu @ feedback + feedback.T @ q_ux + q_ux.T @ feedback
        found.append((change, feedback))
    return found[::-1]


def plan(body: Body, most: int = 60) -> tuple[Array, float, int]:
    """States, cost and iterations until the cost falls by less than a ten-thousandth."""
    controls = np.zeros((STEPS, 2))
    xs, controls, cost = rollout(body, np.zeros((1, 6)), controls, None, 0.0)
    for iteration in range(1, most + 1):
        change = gains(body, xs, controls, 1e-6)
        for share in 0.5 ** np.arange(8):
            tried = rollout(body, xs, controls, change, float(share))
            if tried[2] < cost:
                break
        else:
            return xs, cost, iteration
        gained = cost - tried[2]
        xs, controls, cost = tried
        if gained < 1e-4 * cost:
            return xs, cost, iteration
    return xs, cost, most


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Plans with derivatives and with differences, and tells what each took."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", default="127.0.0.1:50051", help="http[s]://host:port or unix:PATH of a server")
    options = parser.parse_args(arguments)
    results = []
    with wade.GrpcClient(options.address) as client:
        vehicle = client.vehicle(VEHICLE)
        inertia = float(np.array(vehicle.inertia_kgm2).reshape(3, 3)[2, 2])
        for name, differences in (("derivatives", False), ("differences", True)):
            body = Body(vehicle.mass_kg, inertia, Water(client, differences))
            begun = time.perf_counter()
            xs, cost, iterations = plan(body)
            took = time.perf_counter() - begun
            results.append({"name": name, "end": xs[-1], "cost": cost, "iterations": iterations})
            each = 1e6 * body.water.seconds / body.water.linearized
            place = ", ".join(f"{value:.3f}" for value in xs[-1][:3])
            asked = f"{body.water.queries} states asked, {each:.0f} us a linearized state"
            print(f"{name}: {iterations} iterations, {took:.2f} s, {asked}")
            print(f"  arrives at {place} (m, m, rad) of {GOAL[0]}, {GOAL[1]}, {GOAL[2]:.3f} at a cost of {cost:.1f}")
    return results


if __name__ == "__main__":
    main()
