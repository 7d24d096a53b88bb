# SPDX-License-Identifier: Apache-2.0
"""A world of every model is described, rebuilt and stored; each rule has one description."""

from array import array
import json

import numpy as np
import pytest
from tiny_tables import frozen_lake, hall, machine
from tiny_worlds import grid

from comply_ros.protocol.world_description import (
    describe_world,
    description_from_state,
    description_state,
    is_reset_of,
    is_same_world,
    world_from_description,
)
from comply_ros.world.state_action_spaces import Spaces

TABLE = describe_world(machine(), 'machine', 7)
SPACES = describe_world(Spaces(2, ('go', 'wait'), 10, np.array([[True, True], [True, False]])),
                        'robot', 7)
SOURCES = [grid('..G', '.#.'), machine(), frozen_lake(), hall(4, 200), Spaces(3, ('a', 'b'), 5),
           Spaces(1, ('go',), 10, np.array([[True]])),
           machine(positions=np.array([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]), cells=('a', '', 'b'))]


@pytest.mark.parametrize('source', SOURCES)
def test_a_world_is_rebuilt_from_its_description_and_from_a_state(source):
    description = describe_world(source, 'world', 7, 12345)
    assert world_from_description(description) == source
    values, arrays = description_state(description)
    stored = description_from_state(json.loads(json.dumps(values)), arrays)
    assert stored == description
    assert world_from_description(stored) == source


def test_pictures_of_a_table_are_kept():
    rebuilt = world_from_description(describe_world(SOURCES[-1], 'world', 7))
    assert rebuilt.positions.tolist() == SOURCES[-1].positions.tolist()
    assert rebuilt.cells == ('a', '', 'b')


def table(**changes):
    """Return the machine with other arrays in its table."""
    return {'table': TABLE.table._replace(**changes), 'sha256': ''}


@pytest.mark.parametrize('description, changes, message', [
    (TABLE, {'sha256': 'x'}, f"sha256 must be that of the world, {TABLE.sha256[:8]}..., got 'x'"),
    (TABLE, {'step_limit': 0}, 'step_limit must be a whole number in [1, 1000000], got 0'),
    (TABLE, {'states': 4}, 'first must have an element for each action of each state, and one, '
     '13, got 10'),
    (TABLE, {'states': 2 ** 32 - 1}, 'a world must have 1 to 16777216 states, got 4294967295'),
    (TABLE, {'actions': ()}, 'a world must have 1 to 32767 actions, got 0'),
    (TABLE, {'positions': array('d', [1.0])},
     'positions must have x and y of each of the 3 states, got 1 numbers'),
    (TABLE, {'cells': ('a',)}, 'cells must have a character or none for each of the 3 states'),
    (TABLE, {'available': (True,)},
     'available must be empty in a world of model TABLE, got 1 elements'),
    (TABLE, table(successor=array('I', [2 ** 32 - 1] * 7)),
     'a successor must be a state in [0, 2], got 4294967295'),
    (TABLE, table(terminal=array('I', [3])), 'terminal must be states in [0, 2], ascending, '
     'got [3]'),
    (TABLE, table(terminal=array('I', [2, 2])), 'terminal must be states in [0, 2], ascending, '
     'got [2, 2]'),
    (TABLE, table(probability=array('d', [0.5] * 7)), 'the probabilities of an action must add up '
     "to 1, got 0.5 in state 0, action 'stop'"),
    (SPACES, {'starts': (0,)}, 'starts must be empty in a world of model NONE, got 1'),
    (SPACES, {'available': (True,)}, 'available must be empty, or have each of the 2 actions of '
     'the 2 states, got 1 values'),
    (SPACES, {'actions': ('go', 'go')}, "the names of actions must differ, got 'go' twice"),
    (SPACES, {'model': 2}, 'available must be empty in a world of model TABLE, got 4 elements')])
def test_a_description_that_breaks_a_rule_is_rejected(description, changes, message):
    with pytest.raises(ValueError) as error:
        world_from_description(description._replace(**changes))
    assert str(error.value) == message


@pytest.mark.parametrize('source', SOURCES)
def test_worlds_without_a_hash_are_compared_field_by_field(source):
    description = describe_world(source, 'world', 7)
    unhashed = description._replace(sha256='', starts=array('I', description.starts))
    assert is_same_world(unhashed, description) and is_same_world(description, unhashed)
    assert not is_same_world(unhashed, description._replace(step_limit=3))
    reset = unhashed._replace(run=8, replaces=7)
    assert is_reset_of(reset, description)
    assert not is_reset_of(reset._replace(replaces=6), description)
    assert not is_reset_of(reset._replace(step_limit=3), description)
