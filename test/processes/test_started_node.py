# SPDX-License-Identifier: Apache-2.0
"""A node that `check` starts has the seed, and ends with all that its command started."""

import os
import shlex
import sys

import pytest
from waiting import wait_until

from comply_ros.nodes.started_node import StartedNode

WAITS = 'import sys, time; print("seed", sys.argv[1], flush=True); time.sleep(1000)'


def test_the_seed_is_in_its_place_and_ending_it_ends_its_children(tmp_path):
    python = shlex.join([sys.executable, '-c', WAITS])
    node = StartedNode(shlex.join(['sh', '-c', f'{python} {{seed}} & echo $! > '
                                   f'{tmp_path}/pid; wait']))
    assert node.has_seed
    node.start(17)
    wait_until(lambda: 'seed 17' in node.last_lines(), 'output')
    child = int((tmp_path / 'pid').read_text())
    node.end()
    wait_until(lambda: not os.path.exists(f'/proc/{child}') or 'Z' in open(
        f'/proc/{child}/stat').read().split()[2], 'end of the child')


def test_it_can_be_started_again():
    node = StartedNode(shlex.join([sys.executable, '-c', WAITS, '{seed}']))
    for seed in (1, 2):
        node.start(seed)
        wait_until(lambda seed=seed: f'seed {seed}' in node.last_lines(), 'output')
        node.end()
    node.end()  # nothing runs


def test_a_command_without_a_place_for_the_seed_says_so():
    assert not StartedNode('node --ros-args').has_seed


def test_a_command_that_is_not_there_raises_what_the_system_says():
    with pytest.raises(OSError, match='no_such_program'):
        StartedNode('no_such_program').start(0)
