"""A linear policy learns to balance a pole on a cart: augmented random search (Mania, Guy and Recht, 2018) over copies
of the robot, two for each direction that is tried, all stepped together.

    python learn_balance.py                  # some seconds; the same curve every time
    python learn_balance.py --seed 3 --threads 1

Needs gymnasium and mujoco (for the model's file; the physics is subadmm's).
"""

import argparse
import time

import numpy as np

import subadmm.gym

DIRECTIONS, BEST = 16, 8  # tried at a time; those that the step is made of
STEP, NOISE = 2.0, 1.0
STEPS = 200  # of an episode: 4 s


def returns(envs, policies, seed):
    """Of one episode of each: policies, n x 4; all begin alike."""
    observations, _ = envs.reset(seed=[seed] * envs.num_envs)
    alive, total = np.ones(envs.num_envs, bool), np.zeros(envs.num_envs)
    for _ in range(STEPS):
        forces = np.clip((policies * observations).sum(axis=1), -10, 10)
        observations, rewards, terminated, truncated, _ = envs.step(forces[:, None])
        total += rewards * alive
        alive &= ~(terminated | truncated)
        if not alive.any():
            break
    return total


def learn(seed=0, threads=None, most=40, report=print):
    """The returns of the mean policy, iteration by iteration."""
    envs = subadmm.gym.CartPole(2 * DIRECTIONS + 1, threads=threads, episode=STEPS)
    random, policy, curve = np.random.default_rng(seed), np.zeros(4), []
    for iteration in range(most):
        tried = random.standard_normal((DIRECTIONS, 4))
        policies = np.concatenate([policy + NOISE * tried, policy - NOISE * tried, policy[None]])
        total = returns(envs, policies, 1000 * seed + iteration)
        plus, minus, own = total[:DIRECTIONS], total[DIRECTIONS : 2 * DIRECTIONS], total[-1]
        curve.append(own)
        report(f"iteration {iteration:3d}: {own:5.0f} of {STEPS} steps upright")
        if own == STEPS and min(curve[-3:]) == STEPS and len(curve) > 3:
            break
        best = np.argsort(-np.maximum(plus, minus), kind="stable")[:BEST]
        spread = np.concatenate([plus[best], minus[best]]).std() + 1e-9
        policy = policy + STEP / (BEST * spread) * ((plus - minus)[best] @ tried[best])
    return np.array(curve)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, help="default: all cores")
    arguments = parser.parse_args()
    begin = time.perf_counter()
    curve = learn(arguments.seed, arguments.threads)
    print(f"{curve[-1]:.0f} of {STEPS} steps upright after {len(curve)} iterations, {time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()
