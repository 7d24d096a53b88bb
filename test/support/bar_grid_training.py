# SPDX-License-Identifier: Apache-2.0
"""The name of every different preset with its profile, and a short training of one."""

from dataclasses import replace
from functools import cache

from comply_ros.experiments import stepped_training
from comply_ros.learner import training
from comply_ros.learner.mentor_factory import make_policy
from comply_ros.learner.presets import find_method, METHODS
from comply_ros.learner.step_kernels import PLAIN
from comply_ros.learner.training import Training
from comply_ros.mentor.mentor_spec import parse_mentor_spec
from comply_ros.storage.map_files import read_map
from comply_ros.world.mdp import World
from comply_ros.world.planning import optimal_policy

# Where both profiles have the same settings, the published one stands for both.
PRESETS = [(profile, name) for profile, table in METHODS.items() for name in table
           if profile == 'published' or table[name] != METHODS['published'][name]]
# What methods for several mentors have: test_stepped_training.py compiles them with three.
FOR_SEVERAL = {'has_estimates', 'has_bandit'}


def own_code(config):
    """
    Return the names of what gives a method compiled code that it shares with few others.

    To compile it takes ten to thirty seconds.
    """
    kernel_config = config.for_kernels(4)
    return {name for name in ('has_model', 'has_planner', *FOR_SEVERAL)
            if getattr(kernel_config, name)}


def use_shared_code(patch, config):
    """Let trainings from now on run as plain Python where the method is for several mentors."""
    if own_code(config) & FOR_SEVERAL:
        use_plain_kernels(patch)


def use_plain_kernels(patch):
    """Let each training from now on run as plain Python, with nothing to compile."""
    patch.setattr(training, 'specialized', lambda kernel, *arguments: kernel)
    patch.setattr(stepped_training, 'compiled_kernels', lambda *arguments: PLAIN)


@cache
def bar_grid(profile):
    """Return the small map of the package, which hundreds of trainings share."""
    return World(read_map('bar_grid', profile))


@cache
def best_policy(profile):
    """Return an optimal policy in it, to be copied by who changes it."""
    return optimal_policy(bar_grid(profile))


def trained(name, profile, iterations=4, seed=3):
    """Return a training of a preset after some iterations in `bar_grid`, and their results."""
    return train_with(replace(find_method(name, profile), episodes=5, iterations=iterations),
                      profile, seed)


def train_with(config, profile='published', seed=3, noise=0.0):
    """Return a training after all its iterations in `bar_grid`, and their results."""
    world = bar_grid(profile)
    advice = make_policy(parse_mentor_spec(f'noisy:{noise}'), world, seed) if noise else \
        best_policy(profile).copy()
    advice[::3] = -1  # a mentor without advice in a third of the states
    learning = Training(world, advice, config, seed)
    return learning, [learning.iterate() for _ in range(config.iterations)]
