# SPDX-License-Identifier: Apache-2.0
"""Environments of Gymnasium in a module `own_envs`: one that fails, one that can be drawn."""

import os

BROKEN = """
import gymnasium

class Broken(gymnasium.Env):
    observation_space = gymnasium.spaces.Discrete(3)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        self._steps = 0
        return 0, {}

    def step(self, action):
        self._steps += 1
        if self._steps == 3:
            raise RuntimeError('the motor is off')
        return self._steps, 0.0, False, False, {}

    def close(self):
        print('closes', flush=True)

gymnasium.register('Broken-v0', Broken)
"""
DRAWN = """
import gymnasium
import numpy

class Drawn(gymnasium.Env):
    metadata = {'render_modes': ['rgb_array'], 'render_fps': 4}
    observation_space = gymnasium.spaces.Discrete(200)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, render_mode=None, display=True):
        self.render_mode, self._display, self._steps = render_mode, display, 0

    def reset(self, *, seed=None, options=None):
        print('begins', flush=True)
        self._steps = 0
        return 0, {}

    def step(self, action):
        self._steps += 1
        return self._steps, 0.0, self._steps == 40, False, {}

    def render(self):
        print('draws', flush=True)
        if not self._display:
            raise RuntimeError('no display')
        return numpy.full((2, 3, 3), self._steps, dtype=numpy.uint8)

gymnasium.register('Drawn-v0', Drawn)
"""


def write_environments(folder, monkeypatch):
    """Write the module to a folder where the processes of a test find it."""
    (folder / 'own_envs.py').write_text(BROKEN + DRAWN)
    path = os.environ.get('PYTHONPATH', '')
    monkeypatch.setenv('PYTHONPATH', f'{folder}{os.pathsep}{path}')
