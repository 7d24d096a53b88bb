# SPDX-License-Identifier: Apache-2.0
"""Worlds as tables of outcomes: what is checked, what is derived, and what they are made from."""

from dataclasses import replace
import hashlib
import struct

import numpy as np
import pytest
from tiny_tables import frozen_lake, machine

from comply_ros.world.grid import MapError
from comply_ros.world.transition_table import Table


def test_actions_without_outcomes_do_not_exist():
    table = machine()
    assert table.n_states == 3
    assert table.available.tolist() == [[True, True, False], [True, True, True], 3 * [False]]
    assert table.pairs.tolist() == [0, 0, 1, 3, 3, 4, 5]


def test_states_that_no_start_leads_to_are_found():
    assert machine().reachable.tolist() == [True, True, True]
    stops = machine(first=np.array([0, 0, 1, 1, 3, 4, 5, 5, 5, 5]),
                    successor=np.array([2, 1, 2, 2, 0], dtype=np.int32),
                    probability=np.array([1.0, 0.75, 0.25, 1.0, 1.0]), reward=np.zeros(5))
    assert stops.reachable.tolist() == [True, False, True]


def test_the_hash_is_that_of_the_bytes_that_are_described():
    data = b'comply_ros table 1\n' + struct.pack('<q', 3)
    for name in (b'run', b'stop', b'repair'):
        data += struct.pack('<q', len(name)) + name
    data += struct.pack('<4q', 3, 7, 1, 50)
    data += struct.pack('<10q', 0, 2, 3, 3, 5, 6, 7, 7, 7, 7)
    data += struct.pack('<7i', 0, 1, 2, 1, 2, 2, 0)
    data += struct.pack('<7d', 0.5, 0.5, 1.0, 0.75, 0.25, 1.0, 1.0)
    data += struct.pack('<7d', 2.0, 2.0, 0.0, 1.0, -4.0, 0.0, -5.0)
    data += bytes([0, 0, 1]) + struct.pack('<q', 0)
    assert machine().sha256 == hashlib.sha256(data).hexdigest()


def test_pictures_do_not_change_the_hash_and_everything_else_does():
    table = machine()
    same = machine(positions=np.zeros((3, 2)), cells=('o', 'w', ''))
    minus = machine(reward=np.array([2.0, 2.0, -0.0, 1.0, -4.0, -0.0, -5.0]))
    assert table == same == minus and hash(table) == hash(same)
    for changes in ({'step_limit': 51}, {'starts': (1,)}, {'starts': (0, 0)},
                    {'actions': ('run', 'stop', 'mend')},
                    {'reward': table.reward + 1}, {'terminal': np.array([False, True, True]),
                                                   'starts': (0,)}):
        assert replace(table, **changes) != table


@pytest.mark.parametrize('changes, message', [
    ({'actions': ()}, 'a world must have 1 to 32767 actions, got 0'),
    ({'actions': ('run', 'stop', 'run')}, "the names of actions must differ, got 'run' twice"),
    ({'actions': ('run', 'stop ', 'x')}, 'the name of an action must be a printable text without '
     "blanks at its ends, got 'stop ' for action 1"),
    ({'actions': ('run', '', 'x')}, "got '' for action 1"),
    ({'actions': ('run', 'a\nb', 'x')}, "got 'a\\nb' for action 1"),
    ({'step_limit': 0}, 'step_limit must be a whole number in [1, 1000000], got 0'),
    ({'step_limit': 2.0}, 'step_limit must be a whole number in [1, 1000000], got 2.0'),
    ({'terminal': np.zeros(0, dtype=bool)}, 'a world must have 1 to 16777216 states, got 0'),
    ({'first': np.array([0, 2])}, 'first must be int64 of shape (10,), got int64 of shape (2,)'),
    ({'reward': np.zeros(7, dtype=np.float32)}, 'reward must be float64 of shape (7,), got '
     'float32 of shape (7,)'),
    ({'first': np.array([0, 2, 3, 3, 5, 4, 7, 7, 7, 7])},
     'first must rise from 0 to the 7 outcomes and never fall'),
    ({'first': np.array([0, 2, 3, 3, 5, 6, 7, 7, 7, 8])},
     'first must rise from 0 to the 7 outcomes and never fall'),
    ({'successor': np.array([0, 1, 2, 1, 3, 2, 0], dtype=np.int32)},
     "a successor must be a state in [0, 2], got 3 in state 1, action 'run'"),
    ({'reward': np.array([2.0, 2.0, np.nan, 1.0, -4.0, 0.0, -5.0])},
     "a reward must be a finite number of at most 1000000, got nan in state 0, action 'stop'"),
    ({'probability': np.array([0.5, 0.5, 1.0, 1.0, 0.0, 1.0, 1.0])},
     "a probability must be in (0, 1], got 0.0 in state 1, action 'run'"),
    ({'probability': np.array([0.5, 0.4, 1.0, 0.75, 0.25, 1.0, 1.0])},
     "the probabilities of an action must add up to 1, got 0.9 in state 0, action 'run'"),
    ({'starts': ()}, 'a world needs at least one start, got none'),
    ({'starts': (0, 7)}, 'a start must be a state in [0, 2], got 7'),
    ({'starts': (2,)}, 'a start must not be terminal, got state 2'),
    ({'starts': (0.5,)}, 'a start must be the number of a state, got (0.5,)'),
    ({'terminal': np.zeros(3, dtype=bool)},
     'a state that can be reached must be terminal or have an action, but state 2 has none'),
    ({'positions': np.zeros((2, 2))}, 'positions must be finite numbers, float64 of shape (3, 2), '
     'got float64 of shape (2, 2)'),
    ({'cells': ('o', 'ww', '')}, 'cells must have a character or none for each of the 3 states')])
def test_what_cannot_be_a_world_is_rejected(changes, message):
    with pytest.raises(MapError) as error:
        machine(**changes)
    assert message in str(error.value)


def test_the_transitions_of_gymnasium_become_a_table():
    lake = frozen_lake()
    assert (lake.n_states, lake.actions) == (64, ('left', 'down', 'right', 'up'))
    assert np.flatnonzero(lake.terminal).tolist() == [19, 29, 35, 41, 42, 46, 49, 52, 54, 59, 63]
    assert not lake.available[lake.terminal].any()
    begin, end = lake.first[:2]  # left of the start: left and up stay, so they are one outcome
    assert lake.successor[begin:end].tolist() == [0, 8]
    assert lake.probability[begin:end] == pytest.approx([2 / 3, 1 / 3])


def test_an_end_in_a_state_where_others_go_on_is_a_state_of_its_own():
    transitions = [[[(0.5, 1, 1.0, False), (0.5, 1, 1.0, True)]], [[(1.0, 0, 0.0, False)]]]
    table = Table.from_transitions(transitions, (0,), 10)
    assert table.actions == ('0',)
    assert table.terminal.tolist() == [False, False, True]
    assert table.successor.tolist() == [1, 2, 0]


def test_an_end_in_a_start_is_a_state_of_its_own():
    table = Table.from_transitions([[[(1.0, 0, 1.0, True)]]], (0,), 10)
    assert (table.terminal.tolist(), table.successor.tolist()) == ([False, True], [1])


def test_impossible_outcomes_are_left_out_and_equal_ones_are_merged():
    transitions = {0: {1: [(0.25, 1, 2.0, True), (0.0, 0, 5.0, False), (0.75, 1, 2.0, True)]},
                   1: {}}
    table = Table.from_transitions(transitions, (0,), 10, ('wait', 'go'))
    assert table.first.tolist() == [0, 0, 1, 1, 1]
    assert (table.successor.tolist(), table.probability.tolist()) == ([1], [1.0])


@pytest.mark.parametrize('transitions, message', [
    ([[[(1.0, 2, 0.0, True)]], []],
     'an outcome must lead to a state in [0, 1], got 2 in state 0, action 0'),
    ({0: {0: []}, 2: {}}, 'the states must be numbered from 0 to 1, but there is no state 1'),
    ({0: {'up': []}}, "an action must lie in [0, 0], got 'up' in state 0"),
    ([], 'a world must have 1 to 32767 actions, got 0')])
def test_transitions_that_cannot_be_are_rejected(transitions, message):
    names = ('go',) if transitions else None
    with pytest.raises(MapError) as error:
        Table.from_transitions(transitions, (0,), 10, names)
    assert str(error.value) == message
