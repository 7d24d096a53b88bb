# SPDX-License-Identifier: Apache-2.0
"""The taxi, on a map of four cells in a row with two stops."""

import pytest
from table_planning import outcomes

from comply_ros.world.grid import MapError
from comply_ros.world.taxi import taxi_table

ROW = ('A..B',)


def taxi(rows=ROW, walls=()):
    return taxi_table(rows, walls, -1.0, 20.0, -10.0, None)


def state(cell, passenger, destination):
    """Return the state; passenger 2 is in the taxi."""
    return (cell * 3 + passenger) * 2 + destination


def test_states_starts_and_the_step_limit():
    table = taxi()
    assert len(table.terminal) == 4 * 3 * 2
    assert table.starts == tuple(sorted(
        [state(cell, 0, 1) for cell in range(4)] + [state(cell, 1, 0) for cell in range(4)]))
    assert table.step_limit == 240
    assert table.actions == ('left', 'right', 'down', 'up', 'pick_up', 'drop_off')


@pytest.mark.parametrize('s, action, s2, reward', [
    (state(1, 0, 1), 'left', state(0, 0, 1), -1.0),
    (state(0, 0, 1), 'left', state(0, 0, 1), -1.0),  # the edge
    (state(0, 0, 1), 'pick_up', state(0, 2, 1), -1.0),
    (state(1, 0, 1), 'pick_up', state(1, 0, 1), -10.0),  # nobody is there
    (state(0, 2, 1), 'pick_up', state(0, 2, 1), -10.0),  # the passenger is in the taxi
    (state(3, 2, 1), 'drop_off', state(3, 1, 1), 20.0),
    (state(0, 2, 1), 'drop_off', state(0, 0, 1), -1.0),  # the wrong stop
    (state(1, 2, 1), 'drop_off', state(1, 2, 1), -10.0),  # no stop
    (state(3, 0, 1), 'drop_off', state(3, 0, 1), -10.0),  # nobody is in the taxi
])
def test_every_action_has_one_outcome(s, action, s2, reward):
    assert outcomes(taxi(), s, action) == {(s2, reward): 1.0}


def test_a_delivery_ends_the_episode():
    table = taxi()
    assert table.terminal.nonzero()[0].tolist() == [state(0, 0, 0), state(3, 1, 1)]
    assert outcomes(table, state(3, 1, 1), 'left') == {}


def test_the_taxi_drives_through_no_wall_and_no_obstacle():
    assert outcomes(taxi(walls=((1, 0, 1, 1),)), state(0, 0, 1), 'right') == {
        (state(0, 0, 1), -1.0): 1.0}
    table = taxi(rows=('A.#B', '....'))
    assert outcomes(table, state(5, 0, 1), 'right') == {(state(5, 0, 1), -1.0): 1.0}
    assert outcomes(table, state(6, 0, 1), 'left') == {}


def test_stops_are_numbered_from_the_top_row():
    table = taxi(rows=('.A', 'B.'))
    assert outcomes(table, state(3, 0, 1), 'pick_up') == {(state(3, 2, 1), -1.0): 1.0}


@pytest.mark.parametrize('rows, message', [
    (('A...',), 'a taxi needs at least two stops, got 1'),
    (('A.AB',), "a stop must be there once, got 'A' again"),
    (('A.SB',), "a stop must be one character other than . # S < > v ^, got 'S'"),
    (('A' + '.' * 2000 + 'B', *['.' * 2002] * 20),
     'a taxi may have at most 200000 states, got 252252'),
])
def test_a_wrong_map_of_a_taxi_is_rejected(rows, message):
    with pytest.raises(MapError) as error:
        taxi(rows)
    assert str(error.value) == message
