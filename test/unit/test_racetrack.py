# SPDX-License-Identifier: Apache-2.0
"""The race track, on tracks of a few cells."""

import pytest
from table_planning import from_starts, optimal_values, outcomes

from comply_ros.world.grid import MapError
from comply_ros.world.racetrack import CHANGES, racetrack_table

ROWS = ('...F',
        'S.#F')  # cells 0 and 1, and 2 as F, below; 3 to 6 above


def car(cell, vx=0, vy=0):
    """Return the state, with speeds from 0 to 2."""
    return (cell * 3 + vy) * 3 + vx


def track(rows=ROWS, noise=0.0, **changes):
    return racetrack_table(rows, **{'noise': noise, 'largest_speed': 2, **changes})


def test_states_starts_and_the_step_limit():
    table = track()
    assert len(table.terminal) == 7 * 9
    assert table.starts == (car(0),)
    assert table.step_limit == 630
    assert table.terminal.nonzero()[0].tolist() == [*range(18, 27), *range(54, 63)]


@pytest.mark.parametrize('s, action, s2', [
    (car(0), '+1+0', car(1, 1, 0)),
    (car(0), '+1+1', car(4, 1, 1)),
    (car(0), '+0+0', car(0)),
    (car(1, 1, 0), '+0+0', car(0)),  # into the cell beside the track
    (car(1, 1, 0), '+0+1', car(5, 1, 1)),
    (car(3, 1, 0), '+1+0', car(5, 2, 0)),
    (car(4, 1, 0), '+1+0', car(6, 2, 0)),  # the finish
    (car(5, 1, 0), '+1+0', car(6, 2, 0)),  # over the finish, which ends the way
    (car(3, 1, 1), '+0+0', car(0)),  # off the track above
])
def test_a_car_drives_by_its_new_velocity(s, action, s2):
    assert outcomes(track(), s, action) == {(s2, -1.0): 1.0}


def test_a_velocity_lies_in_its_range_and_is_zero_on_the_starting_line_only():
    table = track()
    assert [action for action in table.actions if outcomes(table, car(0), action)] == [
        '+0+0', '+1+0', '+0+1', '+1+1']
    assert outcomes(table, car(4, 1, 0), '-1+0') == {}
    assert outcomes(table, car(4, 2, 0), '+1+0') == {}


def test_noise_leaves_the_velocity_as_it_is():
    assert outcomes(track(noise=0.25), car(3, 1, 0), '+1+0') == {
        (car(5, 2, 0), -1.0): 0.75, (car(4, 1, 0), -1.0): 0.25}


def test_a_car_that_leaves_the_track_is_at_each_start_equally_likely():
    table = track(rows=('..F', 'SS#'))
    assert outcomes(table, car(1), '+1+0') == {(car(0), -1.0): 0.5, (car(1), -1.0): 0.5}


def test_the_way_is_checked_cell_by_cell():
    table = track(rows=('.#.F', 'S.#F'))  # from the lower left over (1, 1), which is no track
    assert outcomes(table, car(0, 1, 0), '+1+1') == {(car(0), -1.0): 1.0}


def test_the_fewest_steps_of_a_straight_track():
    # Cells 0 to 6, the finish at 6; speeds 1, 2, 2, 2: at 1, 3, 5, 7.
    table = track(('S.....F',))
    assert from_starts(table, optimal_values(table)) == -4.0


def test_actions_are_changes_of_the_velocity_to_the_right_and_up():
    assert track().actions == tuple(f'{ax:+d}{ay:+d}' for ax, ay in CHANGES)


@pytest.mark.parametrize('rows, changes, message', [
    (('S.GF',), {}, "a cell of a track must be one of . # S F, got 'G'"),
    (('...F',), {}, 'a track needs at least one start S, got none'),
    (('S...',), {}, 'a track needs at least one finish F, got none'),
    (ROWS, {'noise': 1.0}, 'noise must lie in [0, 1), got 1.0'),
    (ROWS, {'largest_speed': 0}, 'largest_speed must lie in [1, 20], got 0'),
    (('S' + '.' * 30_000 + 'F',), {}, 'a track may have at most 200000 states, got 270018'),
])
def test_a_wrong_track_is_rejected(rows, changes, message):
    with pytest.raises(MapError) as error:
        track(rows, **changes)
    assert str(error.value) == message
