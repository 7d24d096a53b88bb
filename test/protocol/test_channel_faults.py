# SPDX-License-Identifier: Apache-2.0
"""A wire with faults, its numbers worked by hand; no ROS, and time is an argument."""

from collections import Counter

import numpy as np
import pytest

from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.channel_faults import (
    fault_streams,
    FaultError,
    Faults,
    FaultyChannel,
    LONGEST,
    UNIFORMS,
)


class Uniforms:
    """A generator that gives the rows it was made with, and never faults afterwards."""

    def __init__(self, *rows):
        self._rows = rows

    def random(self, shape):
        """Return the rows, and ones up to the shape asked for."""
        block = np.ones(shape)
        block[:len(self._rows)] = self._rows
        return block


def wire(seed=0, **faults):
    """Return a wire whose faults the seed decides."""
    return FaultyChannel(Faults(**faults), fault_streams(seed, 1)[0])


def through(tested, messages, seconds=0.001):
    """Return what comes out for messages that go in one after the other, and (time, message)."""
    msg = []
    for number, message in enumerate(messages):
        tested.put(message, number * seconds)
        msg += [(number * seconds, each) for each in tested.due(number * seconds)]
    return msg


def names(msg):
    """Return the messages without their times."""
    return [message for _, message in msg]


def test_without_faults_everything_comes_at_once_and_in_order():
    tested = wire()
    assert through(tested, range(5000)) == [(n * 0.001, n) for n in range(5000)]
    assert tested.counts == Counter(heard=5000, relayed=5000)
    assert tested.is_empty()


def test_drop_1_loses_all():
    tested = wire(drop=1.0, delay=1.0, duplicate=1.0, reorder=1.0)
    assert through(tested, range(100)) == []
    assert tested.counts == Counter(heard=100, dropped=100)
    assert tested.is_empty() and tested.due(1e9) == []


def test_duplicate_1_says_all_twice():
    tested = wire(duplicate=1.0)
    assert names(through(tested, 'abc')) == list('aabbcc')
    assert tested.counts == Counter(heard=3, duplicated=3, relayed=6)


def test_reorder_1_swaps_neighbours():
    tested = wire(reorder=1.0)
    assert through(tested, 'abcd') == [(0.001, 'b'), (0.001, 'a'), (0.003, 'd'), (0.003, 'c')]
    assert tested.counts == Counter(heard=4, reordered=2, relayed=4)


def test_a_message_out_of_turn_waits_for_the_next_that_is_said_not_for_one_that_is_lost():
    kept, lost = [1, 0, 1, 1, 1, 1, 1], [0, 1, 1, 1, 1, 1, 1]
    tested = FaultyChannel(Faults(drop=0.5, reorder=0.5), Uniforms(kept, lost))
    assert through(tested, 'abc') == [(0.002, 'c'), (0.002, 'a')]


def test_a_message_out_of_turn_waits_until_the_next_one_which_is_late_is_said():
    turned, late = [1, 0, 1, 1, 1, 1, 1], [1, 1, 1, 0, 0.25, 1, 1]
    tested = FaultyChannel(Faults(delay=0.5, reorder=0.5, longest_delay=0.02),
                           Uniforms(turned, late))
    tested.put('a', 0.0)
    tested.put('b', 0.001)  # due a quarter of 20 ms later, at 6 ms
    assert tested.due(0.0059) == []
    assert tested.due(0.0061) == ['b', 'a']


def test_a_message_that_was_late_already_does_not_put_one_back_in_turn():
    late, turned = [1, 1, 1, 0, 0.25, 1, 1], [1, 0, 1, 1, 1, 1, 1]
    tested = FaultyChannel(Faults(delay=0.5, reorder=0.5, longest_delay=0.02),
                           Uniforms(late, turned))
    tested.put('a', 0.0)  # due at 5 ms
    tested.put('b', 0.001)  # lets the next one pass
    assert tested.due(0.0051) == ['a']
    tested.put('c', 0.006)
    assert tested.due(0.006) == ['c', 'b']


def test_the_two_copies_of_a_message_are_late_each_by_its_own_share_of_the_longest_delay():
    tested = FaultyChannel(Faults(delay=0.5, duplicate=0.5, longest_delay=0.04),
                  Uniforms([1, 1, 0, 0.4, 0.75, 0.4, 0.25], [1, 1, 0, 0.6, 0.75, 0.4, 0.5]))
    tested.put('a', 1.0)  # 40 ms * 0.75 = 30 ms, 40 ms * 0.25 = 10 ms
    tested.put('b', 1.0)  # at once, 40 ms * 0.5 = 20 ms
    assert [tested.due(1.0 + t) for t in (0.0, 0.009, 0.011, 0.021, 0.029, 0.031)] == [
        ['b'], [], ['a'], ['b'], [], ['a']]
    assert tested.counts == Counter(heard=2, delayed=3, duplicated=2, relayed=4)


@pytest.mark.parametrize('faults', [
    {'delay': 1.0}, {'reorder': 1.0}, {'delay': 0.5, 'duplicate': 0.5, 'reorder': 0.5}])
def test_nothing_is_held_longer_than_the_longest_delay(faults):
    for seed in range(50):
        tested = wire(seed, **faults, longest_delay=0.5)
        tested.put('a', 2.0)
        msg = tested.due(2.0) + tested.due(2.5)
        assert msg in (['a'], ['a', 'a'])
        assert tested.is_empty()


def test_the_same_seed_gives_the_same_plan_and_another_seed_another():
    faults = {'drop': 0.2, 'delay': 0.2, 'duplicate': 0.2, 'reorder': 0.2}
    once, again, other = (through(wire(seed, **faults), range(10_000)) for seed in (3, 3, 4))
    assert once == again != other


def test_what_happens_to_a_message_does_not_depend_on_the_other_faults():
    alone = set(range(10_000)) - set(names(through(wire(drop=0.2), range(10_000))))
    tested = wire(drop=0.2, delay=0.3, duplicate=0.3, reorder=0.3)
    msg = set(names(through(tested, range(10_000)))) | set(tested.due(1e9))
    assert set(range(10_000)) - msg == alone


def test_faults_are_as_frequent_as_asked_for_and_every_message_is_accounted_for():
    tested = wire(drop=0.2, delay=0.1, duplicate=0.3, reorder=0.05)
    msg = names(through(tested, range(20_000))) + tested.due(1e9)
    counts = tested.counts
    kept = counts['heard'] - counts['dropped']
    assert counts['heard'] == 20_000 and len(msg) == counts['relayed']
    assert counts['relayed'] == kept + counts['duplicated']
    assert counts['dropped'] / 20_000 == pytest.approx(0.2, abs=0.01)
    assert counts['duplicated'] / kept == pytest.approx(0.3, abs=0.01)
    assert counts['delayed'] / counts['relayed'] == pytest.approx(0.1, abs=0.01)
    assert counts['reordered'] / kept == pytest.approx(0.05, abs=0.01)


def test_topics_have_random_numbers_of_their_own_that_the_world_and_the_learner_do_not_have():
    all_of_them = [*fault_streams(7, 3), *random_streams(7)]
    assert len({generator.random() for generator in all_of_them}) == 5
    first, second = fault_streams(7, 1)[0], fault_streams(7, 3)[0]
    assert first.random(UNIFORMS).tolist() == second.random(UNIFORMS).tolist()


@pytest.mark.parametrize('name', ['drop', 'delay', 'duplicate', 'reorder'])
@pytest.mark.parametrize('value', [-0.1, 1.1, float('nan'), float('inf')])
def test_a_probability_out_of_its_range_is_named(name, value):
    with pytest.raises(FaultError, match=rf'^{name} must lie in \[0, 1\], got {value}$'):
        Faults(**{name: value})


def test_a_longest_delay_out_of_its_range_is_named():
    with pytest.raises(FaultError, match=rf'^longest_delay must lie in \[0, {LONGEST}\], got nan'):
        Faults(longest_delay=float('nan'))
