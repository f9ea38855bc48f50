"""The vectorised environment: gymnasium's rules, and what the water must do to a vehicle in it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from servers import Server

import wade

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "examples"))
import wading_training
from wading_env import STEPS, TIMESTEP_S, WadingEnv, WadingVectorEnv, steer


@pytest.fixture
def env(server: Server) -> Iterator[WadingVectorEnv]:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        yield WadingVectorEnv(client, 16)


def placed(env: WadingVectorEnv, river_depth: float, current: float) -> WadingVectorEnv:
    """All vehicles at rest in the middle of such a river."""
    env.reset(seed=3)
    env.step(np.zeros((16, 2)))
    env.pose[:], env.rates[:] = (5.0, 0.0, 0.0), 0.0
    env.river_depth[:], env.current[:] = river_depth, current
    return env


def test_it_keeps_the_rules_of_gymnasium(env: WadingVectorEnv) -> None:
    first, _ = env.reset(seed=5)
    again, _ = env.reset(seed=5)
    other, _ = env.reset(seed=6)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert env.observation_space.contains(first)
    observations, reward, terminated, truncated, _ = env.step(env.action_space.sample())
    assert env.observation_space.contains(observations)
    assert reward.shape == terminated.shape == truncated.shape == (16,)


def test_one_vehicle_alone_passes_gymnasiums_own_check(server: Server) -> None:
    alone = gymnasium.make("wade/Wading-v0", namespace=server.namespace)
    check_env(alone.unwrapped)
    assert isinstance(alone.unwrapped, WadingEnv)
    alone.close()
    many = gymnasium.make_vec("wade/Wading-v0", num_envs=3, namespace=server.namespace)
    assert many.reset(seed=1)[0].shape == (3, 10)


def test_one_vehicle_alone_does_what_it_does_among_others(server: Server) -> None:
    with wade.ShmClient(server.namespace, timeout_s=20.0) as client:
        alone, one = WadingEnv(client), WadingVectorEnv(client, 1)
        seen, _ = alone.reset(seed=4)
        np.testing.assert_array_equal(seen, one.reset(seed=4)[0][0])
        for _ in range(50):
            action = steer(seen[None])
            seen, reward, *_ = alone.step(action[0])
            others, rewards, *_ = one.step(action)
            np.testing.assert_array_equal(seen, others[0])
            assert reward == rewards[0]


@pytest.mark.timeout(300)
def test_a_policy_learns_to_cross_rivers(server: Server) -> None:
    with wade.ShmClient(server.namespace, timeout_s=60.0) as client:
        rewards: list[float] = []
        policy = wading_training.learn(client, 5, lambda _, reward: rewards.append(reward))
        assert rewards[-1] > rewards[0] + 3.0, rewards
        learned = np.broadcast_to(policy, (wading_training.EXAMINATION, *policy.shape))
        share = wading_training.examine(client, lambda seen: wading_training.act(learned, seen))
        nothing = wading_training.examine(client, lambda seen: wading_training.act(0.0 * learned, seen))
    assert nothing == 0.0 and share > 0.5, share


def test_an_episode_that_ended_begins_anew_with_the_next_step(env: WadingVectorEnv) -> None:
    env.reset(seed=1)
    env.pose[4, 0] = 11.0
    _, reward, terminated, _, _ = env.step(np.zeros((16, 2)))
    assert terminated[4] and not terminated[5] and reward[4] > 4
    observations, reward, terminated, _, _ = env.step(np.ones((16, 2)))
    assert observations[4, 0] == 0 and reward[4] == 0 and not terminated[4]
    env._ages[:] = STEPS - 1
    assert env.step(np.zeros((16, 2)))[3].all()


def test_a_current_carries_what_floats(env: WadingVectorEnv) -> None:
    for current in (0.5, -0.5):
        placed(env, 0.6, current)
        for _ in range(10):
            env.step(np.ones((16, 2)))
        # afloat there is no traction: full drive moves it no faster than the water does
        assert not env._load.any()
        assert np.sign(env.rates[:, 1]).tolist() == [np.sign(current)] * 16
        assert (np.abs(env.rates[:, 1]) < 0.5).all()


def test_shallow_water_leaves_traction_by_the_weight_on_the_wheels(env: WadingVectorEnv) -> None:
    placed(env, 0.2, 0.0)
    lift = float(env._client.evaluate("warthog", wade.State(depth_m=0.2)).force_n[2])
    env.step(np.ones((16, 2)))
    np.testing.assert_allclose(env._load, 1 - lift / (280 * 9.81), rtol=1e-5)
    # 1 kN of drive on 280 kg, in the first step from rest without drag
    np.testing.assert_allclose(env.rates[:, 0], TIMESTEP_S * 1000 / 280, rtol=0.05)


def test_a_policy_by_hand_gets_over(env: WadingVectorEnv) -> None:
    observations, _ = env.reset(seed=2)
    across = np.zeros(16, bool)
    for _ in range(STEPS // 2):
        observations, _, terminated, _, _ = env.step(steer(observations))
        across |= terminated & (observations[:, 0] > 1)
    assert across.sum() >= 14
