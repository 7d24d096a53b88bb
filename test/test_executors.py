# SPDX-License-Identifier: Apache-2.0
"""Where runs are learned: not more at once than is said, and until somebody wants to stop."""

from concurrent.futures import Future
from threading import Event

import pytest

from comply_ros.experiments.executors import Engine, measure, MEASURES, outcomes, this_machine
from comply_ros.experiments.training_runs import learn, measures, Run

SHORT = Run('bar_grid', method='sarsa', mentor='optimal',
            settings=(('iterations', 3), ('episodes', 4)))


def test_a_run_is_measured_as_it_was_learned():
    learned, measured = learn(SHORT), measure(SHORT)
    assert tuple(measured) == MEASURES
    assert measured['digest'] == learned.digest
    assert (measured['iterations'], measured['steps']) == (3, learned.steps)
    assert measured['final_return'] == learned.returns[-1]
    assert measured['regret'] == measures(SHORT, learned.returns)['regret']
    assert measured['mentor_return'] == measured['optimal_return']
    assert measure(SHORT._replace(mentor='none'))['mentor_return'] is None


def test_each_run_comes_back_with_its_number():
    runs = [(k, SHORT._replace(seed=k)) for k in range(20)]
    stop = Event()
    with this_machine(2, stop) as engine:
        found = dict(outcomes(engine, runs, stop))
    assert found == {k: measure(run) for k, run in runs}


def test_runs_are_asked_for_one_by_one():
    asked = []

    def runs():
        for number in range(100):
            asked.append(number)
            yield number, number

    def submit(number):
        job = Future()
        job.set_result(number)
        return job
    engine = Engine('', submit, Future.result, ahead=5)
    for ended, outcome in enumerate(outcomes(engine, runs(), Event()), 1):
        assert outcome[0] == outcome[1]
        assert len(asked) <= ended + 4
    assert ended == 100


def test_who_wants_to_stop_need_not_wait_for_a_run():
    stop = Event()
    endless = SHORT._replace(settings=(('iterations', 1_000_000_000),))

    def runs():
        yield 0, endless
        stop.set()
    with pytest.raises(KeyboardInterrupt), this_machine(2, stop) as engine:
        list(outcomes(engine, runs(), stop))


def test_what_has_ended_is_given_before_a_stop():
    stop, jobs = Event(), []

    def submit(number):
        jobs.append(Future())
        if number == 2:  # the last of three: two of them have ended, and somebody stops
            jobs[0].set_result('first')
            jobs[1].set_result('second')
            stop.set()
        return jobs[-1]
    found = outcomes(Engine('', submit, Future.result, ahead=3), enumerate(range(9)), stop)
    assert [next(found), next(found)] == [(0, 'first'), (1, 'second')]
    with pytest.raises(KeyboardInterrupt):
        next(found)
    assert len(jobs) == 3
