# SPDX-License-Identifier: Apache-2.0
"""The example with Stable-Baselines3. Skipped where that, or Gymnasium, is not installed."""

from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

gymnasium = pytest.importorskip('gymnasium')
stable_baselines3 = pytest.importorskip('stable_baselines3')
EXAMPLE = Path(__file__).parents[2] / 'examples' / 'stable_baselines.py'


def test_a_policy_that_has_imitated_a_mentor_does_what_it_advises():
    example = run_path(str(EXAMPLE))
    env = gymnasium.make(example['MAP'], mentor='noisy:0.2')
    states, advice = example['advised_states'](env, 1)
    assert (advice == np.array(env.unwrapped.policy)[states]).all()
    model = stable_baselines3.PPO('MlpPolicy', env, seed=1, device='cpu')

    def agreement():
        actions, _ = model.predict(states.numpy(), deterministic=True)
        return np.mean(actions == advice.numpy())
    before = agreement()
    example['imitate'](model, states, advice)
    assert before < 0.5 and agreement() > 0.95
