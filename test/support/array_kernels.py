# SPDX-License-Identifier: Apache-2.0
"""Kernels of a step that take arrays, as compiled ones do, and need no compiler."""

from comply_ros.learner.choose_and_learn import choose_action
from comply_ros.learner.step_kernels import StepKernels
from comply_ros.learner.update_rules import learn
from comply_ros.learner.usual_outcome_model import finish_episode


def on_arrays(agent):
    """Return kernels for an agent, which it takes for machine code."""
    def choose(*arguments):
        a, p, m = choose_action(*arguments)
        return int(a), float(p), int(m)
    return StepKernels(choose, learn, finish_episode, agent.step_types)
