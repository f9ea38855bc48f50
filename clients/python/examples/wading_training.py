"""A policy learns to cross rivers, on the CPU: random search over linear policies, hundreds of vehicles a batch call.

    python clients/python/examples/wading_training.py --plot learning.png      # with wade serve running on this machine

Each round tries directions in the space of policies, each of them forward and back on the same rivers, and goes along
those that made a difference (augmented random search; Mania, Guy and Recht, Simple random search of static linear
policies, 2018). It ends with rivers that no round has seen.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray
from wading_env import STEPS, WadingVectorEnv, steer

import wade

Array = NDArray[np.float64]

#: Directions a round, those that count, and rivers on which each is tried.
DIRECTIONS, BEST, RIVERS = 16, 8, 8
#: Size of a try and of a step, over the scale of the observations.
TRY, STEP = 0.3, 0.2
#: Typical size of each observation.
SCALE = np.array([0.5, 0.3, 1.0, 0.3, 0.7, 0.2, 0.3, 0.2, 0.5, 0.4])
#: Rivers of the examination, and their seed.
EXAMINATION, SEED = 512, 10_000


def act(policies: Array, observations: Any) -> Array:
    """Actions `[N, 2]` of linear policies `[N, 2, 11]`, the last number of each row beside the observations."""
    drive = np.einsum("nij,nj->ni", policies[:, :, :-1], observations / SCALE) + policies[:, :, -1]
    return np.asarray(np.tanh(drive))


def returns(env: WadingVectorEnv, seed: int, rivers: int, choose: Any) -> tuple[Array, NDArray[np.bool_]]:
    """Reward of one episode of each vehicle, and whether it crossed. Vehicle `i` has river `i % rivers`."""
    env.reset(seed=seed)
    for array in (env.pose, env.river_depth, env.current):
        array[:] = np.resize(array[:rivers], array.shape)
    total, crossed, running = np.zeros(env.num_envs), np.zeros(env.num_envs, bool), np.ones(env.num_envs, bool)
    observations = env.observe()
    for _ in range(STEPS):
        observations, reward, terminated, truncated, _ = env.step(choose(observations))
        total += running * reward
        crossed |= running & terminated & (observations[:, 0] > 1.0)
        running &= ~(terminated | truncated)
        if not running.any():
            break
    return total, crossed


def learn(client: wade.Client, rounds: int, report: Any) -> Array:
    """A policy `[2, 11]`; `report` gets each round's number and the mean reward of its tries."""
    random, policy = np.random.default_rng(0), np.zeros((2, 11))
    env = WadingVectorEnv(client, 2 * DIRECTIONS * RIVERS)
    for number in range(rounds):
        directions = random.standard_normal((DIRECTIONS, 2, 11))
        tries = policy + TRY * np.concatenate((directions, -directions))
        of_vehicles = np.repeat(tries, RIVERS, axis=0)
        total, _ = returns(env, number, RIVERS, lambda seen, tries=of_vehicles: act(tries, seen))
        ahead, back = total.reshape(2, DIRECTIONS, RIVERS).mean(axis=2)
        best = np.argsort(-np.maximum(ahead, back))[:BEST]
        spread = np.concatenate((ahead[best], back[best])).std() + 1e-9
        policy = policy + STEP / (BEST * spread) * np.einsum("d,dij->ij", ahead[best] - back[best], directions[best])
        report(number, float(total.mean()))
    return policy


def examine(client: wade.Client, choose: Any) -> float:
    """Share of rivers that no round has seen which a policy crosses."""
    env = WadingVectorEnv(client, EXAMINATION)
    return float(returns(env, SEED, EXAMINATION, choose)[1].mean())


def plot(path: str, rewards: list[float], shares: dict[str, float]) -> None:
    """The learning curve."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6.0, 3.2), layout="constrained")
    axes.plot(rewards, color="#0b6e99")
    axes.set_xlabel(f"round of {2 * DIRECTIONS * RIVERS} episodes")
    axes.set_ylabel("mean reward of the tries")
    text = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in shares.items())
    axes.set_title(f"unseen rivers crossed: {text}", fontsize=9)
    figure.savefig(path, dpi=110)


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Learns, and says who crosses how many rivers that nobody has seen."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--namespace", default="wade", help="of the server's shared memory")
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--plot", help="where the learning curve goes")
    chosen = parser.parse_args(arguments)
    rewards: list[float] = []

    def report(number: int, reward: float) -> None:
        rewards.append(reward)
        print(f"round {number + 1:3} of {chosen.rounds}: mean reward {reward:6.2f}", flush=True)

    with wade.ShmClient(chosen.namespace, timeout_s=60.0) as client:
        policy = learn(client, chosen.rounds, report)
        everywhere = np.broadcast_to(policy, (EXAMINATION, *policy.shape))
        nothing = np.zeros((EXAMINATION, *policy.shape))
        shares = {
            "untrained": examine(client, lambda seen: act(nothing, seen)),
            "by hand": examine(client, steer),
            "learned": examine(client, lambda seen: act(everywhere, seen)),
        }
    for name, share in shares.items():
        print(f"{name:10} crosses {100.0 * share:5.1f} % of {EXAMINATION} rivers that no round has seen")
    if chosen.plot:
        plot(chosen.plot, rewards, shares)
    return shares


if __name__ == "__main__":
    main()
