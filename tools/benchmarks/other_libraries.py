# SPDX-License-Identifier: Apache-2.0
"""The SARSA of this package written with Gymnasium and numpy, and with MushroomRL."""

from importlib import import_module
import time
from typing import Any

import numpy as np

from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.world.mdp import World

CLOCK_STEPS = 500  # steps between two readings of the clock


def import_error(name: str) -> str | None:
    """Return why a package cannot be imported; None if it can."""
    try:
        import_module(name)
    except ImportError as error:
        return str(error)
    return None


class PlainWorld:
    """The moves of a `World` in plain Python, as fast as that can be."""

    def __init__(self, world: World, seed: int) -> None:
        self._random = np.random.default_rng(seed).random
        self._starts, self._successor = world.starts.tolist(), world.successor.tolist()
        self._reward, self._terminal = world.reward.tolist(), world.terminal.tolist()
        self._others = [[[b for b in range(4) if b != a and slips[b]] for a in range(4)]
                        for slips in world.slips.tolist()]
        self._intended = world.grid.intended

    def reset(self) -> int:
        """Return the first state of an episode."""
        return self._starts[int(self._random() * len(self._starts))]

    def step(self, s: int, a: int) -> tuple[float, int, bool]:
        """Return the reward, the next state, and whether that is a goal."""
        others = self._others[s][a]
        if others and self._random() >= self._intended:
            a = others[int(self._random() * len(others))]
        s2 = self._successor[s][a]
        return self._reward[s][a], s2, self._terminal[s2]


def gymnasium_environment(world: World, seed: int) -> Any:
    """Return the world as a Gymnasium environment with a time limit."""
    import gymnasium

    class Maze(gymnasium.Env):
        observation_space = gymnasium.spaces.Discrete(len(world.terminal))
        action_space = gymnasium.spaces.Discrete(4)

        def __init__(self):
            self._world = PlainWorld(world, seed)

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            self._s = self._world.reset()
            return self._s, {}

        def step(self, action):
            reward, self._s, done = self._world.step(self._s, action)
            return self._s, reward, done, False, {}
    return gymnasium.wrappers.TimeLimit(Maze(), world.grid.step_limit)


class NumpyLoop:
    """SARSA as a plain loop over a Gymnasium environment, with numpy."""

    def __init__(self, world: World, config: LearnerConfig) -> None:
        self._environment, self._config = gymnasium_environment(world, 0), config
        self._q = np.where(world.available, config.initial_value, -np.inf)
        self._visits = np.ones_like(self._q)
        self._generator = np.random.default_rng(1)

    def rate(self, seconds: float) -> float:
        """Return the steps per second over episodes that together take at least so long."""
        start, steps = time.thread_time(), 0
        while time.thread_time() - start < seconds:
            steps += self._learn_episode()
        return steps / (time.thread_time() - start)

    def _learn_episode(self) -> int:
        """Change the action values by an episode; return its steps."""
        config, q, visits, steps = self._config, self._q, self._visits, 0
        s, _ = self._environment.reset()
        a, over = self._choose(s), False
        while not over:
            s2, r, done, truncated, _ = self._environment.step(a)
            a2 = self._choose(s2)
            target = r if done else r + config.discount * q[s2, a2]
            q[s, a] += config.learning_rate / visits[s, a] * (target - q[s, a])
            visits[s, a] += config.visit_growth
            s, a, over, steps = s2, a2, done or truncated, steps + 1
        return steps

    def _choose(self, s: int) -> int:
        values = self._q[s]
        weights = np.exp((values - values.max()) / self._config.temperature)
        return int(self._generator.choice(4, p=weights / weights.sum()))


def mushroom_environment(world: World, seed: int) -> Any:
    """Return the world as an environment of MushroomRL (its own `FiniteMDP` is slower)."""
    from mushroom_rl.core import Environment, MDPInfo
    from mushroom_rl.utils.spaces import Discrete

    class Maze(Environment):
        def __init__(self):
            self._world = PlainWorld(world, seed)
            super().__init__(MDPInfo(Discrete(len(world.terminal)), Discrete(4), 1.0,
                                     world.grid.step_limit))

        def reset(self, state=None):
            self._s = self._world.reset()
            return np.array([self._s])

        def step(self, action):
            reward, self._s, done = self._world.step(self._s, int(action[0]))
            return np.array([self._s]), reward, done, {}
    return Maze()


class Mushroom:
    """SARSA of MushroomRL, or its SARSA(lambda) if the config has traces."""

    def __init__(self, world: World, config: LearnerConfig) -> None:
        from mushroom_rl.algorithms.value import SARSA, SARSALambda
        from mushroom_rl.core import Core
        from mushroom_rl.policy import Boltzmann
        from mushroom_rl.utils.parameters import ExponentialParameter
        environment = mushroom_environment(world, 0)
        rate = ExponentialParameter(config.learning_rate, exp=config.learning_rate_exponent,
                                    size=environment.info.size)
        arguments = environment.info, Boltzmann(1.0 / config.temperature), rate
        agent = SARSALambda(*arguments, config.trace_decay, trace='accumulating') \
            if config.trace_decay else SARSA(*arguments)
        agent.Q.table[:] = np.where(world.available, config.initial_value, -np.inf)
        self._core = Core(agent, environment)

    def rate(self, seconds: float) -> float:
        """Return the steps per second over at least so many seconds."""
        start, steps = time.thread_time(), 0
        while time.thread_time() - start < seconds:
            self._core.learn(n_steps=CLOCK_STEPS, n_steps_per_fit=1, quiet=True)
            steps += CLOCK_STEPS
        return steps / (time.thread_time() - start)
