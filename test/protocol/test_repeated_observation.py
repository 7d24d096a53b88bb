# SPDX-License-Identifier: Apache-2.0
"""Pauses after which a world repeats an observation, by examples worked by hand."""

import pytest

from comply_ros.protocol.repeated_observation import (
    FIRST_PAUSE,
    LONGEST_PAUSE,
    RepeatedObservation,
)

STEP, NEXT_STEP = (0, 3), (0, 4)
TICKS = [k / 100 for k in range(2_001)]  # twenty seconds


def repetitions(released=lambda now: False, messages=lambda now: 0, held=lambda now: False):
    """Return when an observation is repeated that came at 0, asked every 10 ms."""
    observation, times = RepeatedObservation(), []
    for now in TICKS:
        if observation.is_due(now, STEP, messages(now), held(now)):
            times.append(now)
            observation.repeated(now, released(now))
    return times


def test_pauses_double_up_to_the_longest():
    times = repetitions()
    assert times[:5] == pytest.approx([0.02, 0.06, 0.14, 0.30, 0.62], abs=0.03)
    pauses = [after - before for before, after in zip(times, times[1:])]
    assert pauses == sorted(pauses)
    assert pauses[-1] == pytest.approx(LONGEST_PAUSE, abs=0.02)


def test_a_new_observation_is_not_repeated_at_once():
    observation = RepeatedObservation()
    assert not observation.is_due(0.0, STEP, 0, False)
    assert observation.is_due(FIRST_PAUSE, STEP, 0, False)
    assert not observation.is_due(FIRST_PAUSE, NEXT_STEP, 0, False)


def test_a_held_observation_is_repeated_only_after_it_is_free_again():
    times = repetitions(held=lambda now: now < 10.0)
    assert times[0] == pytest.approx(10.0 + FIRST_PAUSE, abs=0.02)


def test_a_learner_that_sends_something_is_asked_soon():
    times = repetitions(messages=lambda now: int(now >= 10.0))
    later = [time for time in times if time >= 10.0]
    assert later[0] <= 10.0 + FIRST_PAUSE + 0.01
    assert later[1] - later[0] < 0.1  # the pauses are short again


def test_late_actions_do_not_put_a_repetition_off():
    times = repetitions(messages=lambda now: int(now * 100))  # one in every tick
    assert len(times) > 500


def test_where_any_learner_may_answer_the_pauses_stay_short():
    assert len(repetitions(released=lambda now: True)) > 500


def test_the_silence_of_a_learner_counts_from_its_last_message():
    observation = RepeatedObservation()
    for now in TICKS:
        observation.is_due(now, STEP, int(now >= 10.0), False)
    assert observation.silence(15.0) == pytest.approx(5.0)
