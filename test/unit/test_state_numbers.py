# SPDX-License-Identifier: Apache-2.0
"""Observations of Gymnasium as states. Skipped where Gymnasium is not installed."""

import numpy as np
import pytest

from comply_ros.storage.state_numbers import StateNumbers
from comply_ros.world.grid import MapError

spaces = pytest.importorskip('gymnasium').spaces
PAIR = spaces.Tuple((spaces.Box(0.0, 1.0, (2,)), spaces.Discrete(3), spaces.Box(-1.0, 1.0, (1,))))


@pytest.mark.parametrize('space, observation, count, number', [
    (spaces.Discrete(5), 4, 5, 4),
    (spaces.Discrete(5, start=10), np.int64(12), 5, 2),
    (spaces.MultiDiscrete([3, 4]), np.array([2, 1]), 12, 9),  # 2 * 4 + 1
    (spaces.Tuple((spaces.Discrete(32), spaces.Discrete(11), spaces.Discrete(2))),
     (14, 10, 0), 704, 14 * 22 + 10 * 2),
    (spaces.Box(0.0, 1.0, (2,)), np.array([0.999, 0.5]), 100, 95),  # intervals 9 and 5 of 10
    (spaces.Box(0.0, 1.0, (0,)), np.array([]), 1, 0),
    (spaces.Box(0.0, 1.0, (2,)), np.array([1.0, -0.1]), 100, 90)])  # values beyond are at the end
def test_an_observation_is_a_state(space, observation, count, number):
    numbers = StateNumbers(space, bins=[10])
    assert (numbers.count, numbers.number(observation)) == (count, number)


def test_each_dimension_of_a_box_has_its_intervals_and_limits():
    numbers = StateNumbers(spaces.Box(-np.inf, np.inf, (2,)), [4, 2], [(-2.0, 2.0), (0.0, 1.0)])
    assert numbers.count == 8
    assert numbers.number(np.array([0.5, 0.7])) == 2 * 2 + 1


@pytest.mark.parametrize('space, options, message', [
    (spaces.Box(-np.inf, np.inf, (1,)), {}, 'the observation space needs finite limits with the '
     'lower one first, got -inf to inf in dimension 0: give limits'),
    (spaces.Box(0.0, 1.0, (2,)), {'limits': [(1.0, 0.0), (0.0, 1.0)]}, 'limits must be finite '
     'with the lower one first, got 1 to 0 in dimension 0'),
    (spaces.Box(0.0, 1.0, (1,)), {'limits': [(-1e308, 1e308)]}, 'limits must be finite with the '
     'lower one first, got -1e+308 to 1e+308 in dimension 0'),
    (spaces.Box(0.0, 1.0, (2,)), {'bins': [4, 4, 4]}, 'bins must have one element for each of the '
     '2 dimensions of the observation space, got 3'),
    (spaces.Box(0.0, 1.0, (2,)), {'limits': [(0.0, 1.0)]}, 'limits must have one element for each '
     'of the 2 dimensions of the observation space, got 1'),
    (spaces.Box(0.0, 1.0, (2,)), {'bins': [0]}, 'bins must be at least 1, got 0'),
    (PAIR, {'bins': [4, 2]}, 'bins must have one element for each of the 3 dimensions of the '
     'observation space, got 2'),
    (PAIR, {'limits': [(0.0, 1.0), (0.0, 1.0), (2.0, 1.0)]}, 'limits must be finite with '
     'the lower one first, got 2 to 1 in dimension 2'),
    (spaces.Discrete(5), {'bins': [4, 4]}, 'bins must have one element for each of the 0 '
     'dimensions of the observation space, got 2'),
    (spaces.Text(4), {}, 'the observation space must be Discrete, MultiDiscrete, Box or a Tuple '
     'of such spaces, got Text(')])
def test_observations_that_cannot_be_states_are_rejected(space, options, message):
    with pytest.raises(MapError) as error:
        StateNumbers(space, **options)
    assert str(error.value).startswith(message)
    assert ('give limits' in str(error.value)) == ('give limits' in message)


def test_no_number_is_no_state_of_a_box():
    numbers = StateNumbers(spaces.Box(0.0, 1.0, (2,)), [4])
    assert numbers.number(np.array([0.5, np.nan])) < 0


def test_a_space_of_too_many_states_is_rejected():
    with pytest.raises(MapError, match=r'the observation space must have 1 to 16777216 states, '
                       'got far more: give fewer bins'):
        StateNumbers(spaces.Box(0, 255, (210, 160, 3), np.uint8))


def test_each_box_of_a_tuple_has_bins_and_limits_of_its_own():
    numbers = StateNumbers(PAIR, [4, 2, 5])
    assert numbers.count == 4 * 2 * 3 * 5
    seen = np.array([0.35, 0.9]), 2, np.array([0.75])  # intervals 1 of 4, 1 of 2, and 4 of 5
    assert numbers.number(seen) == ((1 * 2 + 1) * 3 + 2) * 5 + 4
    narrow = StateNumbers(PAIR, [4, 2, 5], [(0.0, 0.4), (0.0, 1.0), (0.6, 1.1)])
    assert narrow.number(seen) == ((3 * 2 + 1) * 3 + 2) * 5 + 1  # 0.35 of 0.4, 0.15 of 0.5


@pytest.mark.parametrize('space, observation', [
    (spaces.MultiDiscrete([3, 4]), np.array([1, 4])),  # 1 * 4 + 4 would be that of (2, 0)
    (spaces.MultiDiscrete([3, 4]), np.array([1, -1])),
    (spaces.Tuple((spaces.Discrete(3), spaces.Discrete(4))), (0, 5)),
    (spaces.Tuple((spaces.Discrete(3), spaces.Box(0.0, 1.0, (1,)))), (2, np.array([np.nan]))),
    (spaces.MultiDiscrete([3, 4]), np.array([2])),  # of another shape, as the three that follow
    (spaces.Box(0.0, 1.0, (2,)), np.array([0.5])),
    (spaces.Box(0.0, 1.0, (1,)), np.array([0.5, 0.5])),
    (spaces.Tuple((spaces.Discrete(3), spaces.Discrete(4))), (0, 1, 2)),
    (spaces.Discrete(3), 3)])
def test_an_observation_beyond_its_space_is_no_state(space, observation):
    assert StateNumbers(space).number(observation) == -1
