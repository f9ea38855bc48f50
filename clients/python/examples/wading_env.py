"""Thousands of Warthogs that learn to cross a river: a vectorised gymnasium environment, one batch call a step.

    python clients/python/examples/wading_env.py        # with wade serve running on this machine

`gymnasium.make("wade/Wading-v0")` is one of them, once this module is imported; `wading_training.py` learns to cross.
Each river has a depth and a current of its own, which the policy does not choose. A vehicle that wades deeper stands
lighter on its wheels and has less traction to hold against the current; afloat it has none. The motion is planar and
level: surge, sway and yaw, integrated by semi-implicit Euler steps.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

import wade

VEHICLE = "warthog"
MASS, YAW_INERTIA, HALF_TRACK = 280.0, 99.3, 0.5685
GRAVITY = 9.81
#: Along the wheels, across them [-].
TRACTION, LATERAL_FRICTION, ROLLING_RESISTANCE = 0.6, 0.5, 0.02
#: Most force of the wheels of one side [N].
DRIVE = 500.0
TIMESTEP_S, STEPS = 0.02, 600
#: From shore to shore, and half the width of the ford [m].
LENGTH, HALF_WIDTH = 10.0, 3.0

#: Of the observations: an episode ends well before.
LEAST = np.array([-1, -2, -1, -1, -10, -10, -10, 0, 0, -1], np.float32)
MOST = np.array([2, 2, 1, 1, 10, 10, 10, 1, 2, 1], np.float32)

Array = NDArray[np.float64]


class WadingVectorEnv(VectorEnv[Any, Any, Any]):
    """Observations `[N, 10]`: x and y over the size of the ford, cosine and sine of the heading, surge, sway and yaw
    rate, depth, share of the weight on the wheels, current across the river. Actions `[N, 2]`: drive of the left and
    right wheels, -1 to 1. The reward is the way made [m] less a little for effort, and 5 for the far shore.
    """

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012, as gymnasium declares it

    def __init__(self, client: wade.Client, num_envs: int):
        self.num_envs = num_envs
        self.single_observation_space = gymnasium.spaces.Box(LEAST, MOST)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)
        self._client = client
        # x, y, yaw and their rates in the body frame; depth of the river in its middle and its current
        self.pose, self.rates = np.zeros((num_envs, 3)), np.zeros((num_envs, 3))
        self.river_depth, self.current = np.zeros(num_envs), np.zeros(num_envs)
        self._load, self._ages = np.ones(num_envs), np.zeros(num_envs, int)
        self._done = np.zeros(num_envs, bool)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """A new river for each vehicle."""
        super().reset(seed=seed)
        self._done[:] = False
        self._begin(np.ones(self.num_envs, bool))
        return self.observe(), {}

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One time step of all; a vehicle whose episode ended begins anew instead."""
        begins = self._done
        before = self.pose[:, 0].copy()
        drive = np.clip(np.asarray(actions, float), -1.0, 1.0)
        self._move(drive)
        self._begin(begins)
        reward = self.pose[:, 0] - before - 0.001 * (drive**2).sum(axis=1)
        across = self.pose[:, 0] > LENGTH
        terminated = across | (np.abs(self.pose[:, 1]) > HALF_WIDTH) | (self.pose[:, 0] < -1.0)
        self._ages += 1
        truncated = ~terminated & (self._ages >= STEPS)
        reward = np.where(begins, 0.0, reward + 5.0 * across)
        self._done = terminated | truncated
        return self.observe(), reward, terminated, truncated, {}

    def depth(self) -> Array:
        """Water under each vehicle [m]: none on the shores, all in the middle."""
        inside = np.clip(self.pose[:, 0] / LENGTH, 0.0, 1.0)
        return np.asarray(self.river_depth * np.sin(np.pi * inside) ** 2)

    def state(self) -> wade.State:
        """What the server is asked."""
        yaw, none = self.pose[:, 2], np.zeros(self.num_envs)
        surge, sway, yaw_rate = self.rates.T
        return wade.State(
            depth_m=self.depth(),
            velocity_mps=np.stack((surge, sway, none), axis=1),
            angular_velocity_radps=np.stack((none, none, yaw_rate), axis=1),
            current_mps=np.stack((self.current * np.sin(yaw), self.current * np.cos(yaw), none), axis=1),
        )

    def _move(self, drive: Array) -> None:
        water = self._client.evaluate_batch(VEHICLE, self.state(), surfaces=False)
        weight = np.maximum(MASS * GRAVITY - water.force_n[:, 2], 0.0)
        self._load = weight / (MASS * GRAVITY)
        surge, sway, yaw_rate = self.rates.T
        limit = TRACTION * weight[:, None] / 2
        sides = np.clip(DRIVE * drive, -limit, limit)
        forward = sides.sum(axis=1) - ROLLING_RESISTANCE * weight * np.tanh(surge / 0.05) + water.force_n[:, 0]
        lateral = water.force_n[:, 1] - LATERAL_FRICTION * weight * np.tanh(sway / 0.05)
        scrub = LATERAL_FRICTION * weight * 0.25 * np.tanh(yaw_rate / 0.1)
        turning = HALF_TRACK * (sides[:, 1] - sides[:, 0]) - scrub + water.moment_nm[:, 2]
        accelerations = (forward / MASS + yaw_rate * sway, lateral / MASS - yaw_rate * surge, turning / YAW_INERTIA)
        self.rates += TIMESTEP_S * np.stack(accelerations, axis=1)
        cos, sin = np.cos(self.pose[:, 2]), np.sin(self.pose[:, 2])
        surge, sway, yaw_rate = self.rates.T
        self.pose += TIMESTEP_S * np.stack((cos * surge - sin * sway, sin * surge + cos * sway, yaw_rate), axis=1)

    def _begin(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        if count == 0:
            return
        random = self.np_random
        self.pose[which] = np.stack(
            (np.zeros(count), random.uniform(-0.5, 0.5, count), random.uniform(-0.2, 0.2, count)), axis=1
        )
        self.rates[which], self._load[which], self._ages[which] = 0.0, 1.0, 0
        self.river_depth[which], self.current[which] = random.uniform(0.1, 0.4, count), random.uniform(-0.6, 0.6, count)

    def observe(self) -> Any:
        """What each vehicle sees."""
        x, y, yaw = self.pose.T
        columns = (
            x / LENGTH,
            y / HALF_WIDTH,
            np.cos(yaw),
            np.sin(yaw),
            *self.rates.T,
            self.depth(),
            self._load,
            self.current,
        )
        return np.stack(columns, axis=1, dtype=np.float32, casting="same_kind")


class WadingEnv(gymnasium.Env[Any, Any]):
    """One vehicle of `WadingVectorEnv`, for learners that take one at a time. It stays where its episode ended."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012, as gymnasium declares it

    def __init__(self, client: wade.Client | None = None, namespace: str = "wade"):
        self._client = wade.ShmClient(namespace, timeout_s=60.0) if client is None else client
        self._owns_client = client is None
        self._vector = WadingVectorEnv(self._client, 1)
        self.observation_space = self._vector.single_observation_space
        self.action_space = self._vector.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """A new river."""
        super().reset(seed=seed)
        # one generator: a run without seeds goes on with the numbers that the last seed began
        self._vector.np_random = self.np_random
        return self._vector.reset()[0][0], {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """One time step."""
        observations, rewards, terminated, truncated, _ = self._vector.step(np.asarray(action)[None])
        return observations[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), {}

    def close(self) -> None:
        """Closes a client that it opened itself."""
        if self._owns_client and isinstance(self._client, wade.ShmClient):
            self._client.close()


def _vectorised(num_envs: int = 1, client: wade.Client | None = None, namespace: str = "wade") -> WadingVectorEnv:
    return WadingVectorEnv(wade.ShmClient(namespace, timeout_s=60.0) if client is None else client, num_envs)


gymnasium.register("wade/Wading-v0", entry_point=WadingEnv, vector_entry_point=_vectorised)


def steer(observations: Any) -> Any:
    """A policy by hand: straight across, leaning against the current."""
    heading = np.arctan2(observations[:, 3], observations[:, 2])
    turn = -2.0 * heading - 1.5 * observations[:, 1] - 0.8 * observations[:, 6] - 0.3 * observations[:, 9]
    return np.clip(np.stack((0.7 - turn, 0.7 + turn), axis=1), -1.0, 1.0).astype(np.float32)


def main() -> None:
    """Crosses with the policy by hand and says how many got over, and how fast it went."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--namespace", default="wade", help="of the server's shared memory")
    parser.add_argument("--vehicles", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=STEPS)
    arguments = parser.parse_args()
    with wade.ShmClient(arguments.namespace, timeout_s=60.0) as client:
        env = WadingVectorEnv(client, arguments.vehicles)
        observations, _ = env.reset(seed=1)
        crossed = ended = 0
        start = time.perf_counter()
        for _ in range(arguments.steps):
            observations, _, terminated, truncated, _ = env.step(steer(observations))
            crossed += int((terminated & (observations[:, 0] > 1.0)).sum())
            ended += int((terminated | truncated).sum())
        seconds = time.perf_counter() - start
    print(f"{crossed} of {ended} got over; {arguments.vehicles * arguments.steps / seconds:.0f} vehicle-steps a second")


if __name__ == "__main__":
    main()
