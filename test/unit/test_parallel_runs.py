# SPDX-License-Identifier: Apache-2.0
"""Runs in parallel: not more at once than allowed, and until a stop."""

from concurrent.futures import Future
from threading import Event

import pytest

from comply_ros.experiments.parallel_runs import (
    completed,
    Executor,
    local_executor,
    measure,
    RESULT_COLUMNS,
)
from comply_ros.experiments.training_runs import learn, measures, Run

SHORT = Run('bar_grid', method='sarsa', mentor='optimal',
            settings=(('iterations', 3), ('episodes', 4)))


def test_a_run_has_the_measures_of_its_training():
    learned, measured = learn(SHORT), measure(SHORT)
    assert tuple(measured) == RESULT_COLUMNS
    assert measured['digest'] == learned.digest
    assert (measured['iterations'], measured['steps']) == (3, learned.steps)
    assert measured['final_return'] == learned.returns[-1]
    assert measured['regret'] == measures(SHORT, learned.returns)['regret']
    assert measured['mentor_return'] == measured['optimal_return']
    assert measure(SHORT._replace(mentor='none'))['mentor_return'] is None


def test_each_run_comes_back_with_its_number():
    runs = [(k, SHORT._replace(seed=k)) for k in range(20)]
    stop = Event()
    with local_executor(measure, stop, 2) as executor:
        found = dict(completed(executor, runs, stop))
    assert found == {k: measure(run) for k, run in runs}


def test_runs_are_taken_one_by_one():
    taken = []

    def runs():
        for number in range(100):
            taken.append(number)
            yield number, number

    def submit(number):
        job = Future()
        job.set_result(number)
        return job
    executor = Executor('', submit, Future.result, max_pending=5)
    for count, (key, result) in enumerate(completed(executor, runs(), Event()), 1):
        assert key == result
        assert len(taken) <= count + 4
    assert count == 100


def test_a_stop_does_not_wait_for_a_run_to_end():
    stop = Event()
    endless = SHORT._replace(settings=(('iterations', 1_000_000_000),))

    def runs():
        yield 0, endless
        stop.set()
    with pytest.raises(KeyboardInterrupt), local_executor(measure, stop, 2) as executor:
        list(completed(executor, runs(), stop))


def test_completed_runs_come_before_a_stop():
    stop, jobs = Event(), []

    def submit(number):
        jobs.append(Future())
        if number == 2:  # the last of three: two of them are done when the stop is set
            jobs[0].set_result('first')
            jobs[1].set_result('second')
            stop.set()
        return jobs[-1]
    found = completed(Executor('', submit, Future.result, max_pending=3),
                      enumerate(range(9)), stop)
    assert [next(found), next(found)] == [(0, 'first'), (1, 'second')]
    with pytest.raises(KeyboardInterrupt):
        next(found)
    assert len(jobs) == 3
