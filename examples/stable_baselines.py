# SPDX-License-Identifier: Apache-2.0
"""PPO of Stable-Baselines3 in a map of ours: alone, and after it has imitated a mentor."""

import sys

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
import torch

import comply_ros.environments  # noqa: F401 - registers the maps

MAP, STEPS, STAGES = 'comply_ros/BarGrid-v0', 12_000, 4
ADVISED_STEPS, PASSES = 4_000, 200  # of the imitation


def advised_states(env, seed):
    """Return the states of some steps by the advice, and the advice in them."""
    seen, (state, info) = [], env.reset(seed=seed)
    for _ in range(ADVISED_STEPS):
        seen.append((state, info['advice']))
        state, _, terminated, truncated, info = env.step(info['advice'])
        if terminated or truncated:
            state, info = env.reset()
    return torch.tensor(np.array(seen)).T


def imitate(model, states, advice):
    """Change the policy of a model so that it does what was advised."""
    for _ in range(PASSES):
        _, log_probability, _ = model.policy.evaluate_actions(states, advice)
        model.policy.optimizer.zero_grad()
        (-log_probability.mean()).backward()
        model.policy.optimizer.step()


def returns(mentor, seed):
    """Return the mean return of the episodes in each stage of a training."""
    env = Monitor(gymnasium.make(MAP, mentor=mentor))
    model = PPO('MlpPolicy', env, n_steps=1000, batch_size=250, seed=seed, device='cpu')
    if mentor != 'none':
        imitate(model, *advised_states(gymnasium.make(MAP, mentor=mentor), seed))
    model.learn(STEPS)
    ends = np.cumsum(env.get_episode_lengths())
    stages = np.digitize(ends, np.arange(1, STAGES) * STEPS / STAGES)
    return [np.mean(np.array(env.get_episode_rewards())[stages == k]) for k in range(STAGES)]


if __name__ == '__main__':
    for mentor in sys.argv[1:] or ('none', 'noisy:0.2'):
        for seed in range(3):
            print(mentor, seed, *(f'{mean:.2f}' for mean in returns(mentor, seed)), flush=True)
