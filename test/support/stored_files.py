# SPDX-License-Identifier: Apache-2.0
"""A state, a mentor and a result cell on disk, and what of them can be read."""

from typing import NamedTuple

import numpy as np

from comply_ros.experiments.result_cache import ResultCache
from comply_ros.experiments.training_runs import learn, Run
from comply_ros.mentor.mentor_spec import parse_mentor_spec
from comply_ros.storage.checkpoint_store import CheckpointStore
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import is_slow, mentor_policy
from comply_ros.world.mdp import World

RUN = Run('bar_grid', settings=(('iterations', 2), ('episodes', 3)), mentor='optimal')
SPEC = parse_mentor_spec('snapshot:0.1')


class Entry(NamedTuple):
    """A message to a node."""

    step: int


def world():
    """Return the world of the mentor in the cache."""
    return World(read_map('bar_grid', 'report'))


def store(folder):
    """Write a state, a mentor and a result cell."""
    state = CheckpointStore(folder / 'state', 'learner', {'seed': 3}, (Entry,))
    state.write_checkpoint({'steps': 7}, {'q': np.arange(3)})
    state.append([Entry(8)])
    state.close()
    mentor_policy(SPEC, world(), 0)
    ResultCache(folder / 'cells', 1).save(RUN, [learn(RUN)])


def stored(folder):
    """Return what of that can be read: the steps, whether the mentor and whether the cell."""
    state = CheckpointStore(f'{folder}/state', 'learner', {'seed': 3}, (Entry,))
    facts, arrays, entries = state.load()
    assert arrays['q'].tolist() == [0, 1, 2]
    state.close()
    return (facts['steps'], entries[0].step, not is_slow(SPEC, world(), 0),
            ResultCache(f'{folder}/cells', 1).has(RUN))
