# SPDX-License-Identifier: Apache-2.0
"""Runs in parallel: on this machine's cores, or on a cluster by the same interface."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any, NamedTuple

from comply_ros.experiments import training_runs
from comply_ros.experiments.training_runs import Run
from comply_ros.terminal.interrupts import check, Stop

RESULT_COLUMNS = ('iterations', 'steps', 'time_to_convergence', 'reward_ratio', 'regret',
                  'final_return', 'mentor_return', 'optimal_return', 'digest')
STOP_PERIOD = 0.1  # seconds between two checks of the stop while nothing completes


class Executor(NamedTuple):
    """
    What runs jobs in parallel.

    Attributes
    ----------
    label: for the progress bar.
    submit: called with a job; returns its future.
    result: called with a future that is done; returns the job's result, None if it was stopped.
    max_pending: jobs submitted and not yet completed; the others are not yet in memory.

    """

    label: str
    submit: Callable[[Any], Future]
    result: Callable[[Future], Any]
    max_pending: int


def measure(run: Run, stop: Stop | None = None) -> dict[str, object] | None:
    """Learn a run and return its `RESULT_COLUMNS` by name; None if `stop` was set."""
    result = training_runs.learn(run, stop)
    if result is None:
        return None
    return {'iterations': len(result.returns), 'steps': result.steps,
            **training_runs.measures(run, result.returns), 'final_return': result.returns[-1],
            'mentor_return': training_runs.mentor_return(run),
            'optimal_return': training_runs.reference_returns_of(run).optimal_return,
            'digest': result.digest}


def completed(
        executor: Executor, jobs: Iterable[tuple[Any, Any]], stop: Stop
) -> Iterator[tuple[Any, Any]]:
    """
    Submit each `(key, job)` and yield each `(key, result)`, in the order of completion.

    Raises
    ------
    KeyboardInterrupt: if `stop` is set; what has completed before is yielded first.
    ClusterError: if the cluster is lost, or cannot do a job.

    """
    done: SimpleQueue = SimpleQueue()
    pending: dict[Any, Future] = {}

    def next_completed() -> Iterator[tuple[Any, Any]]:
        key = _wait(done, stop)
        result = executor.result(pending.pop(key))
        if result is not None:
            yield key, result
    for key, job in jobs:
        if stop.is_set():
            break
        pending[key] = executor.submit(job)
        pending[key].add_done_callback(lambda _, key=key: done.put(key))
        if len(pending) >= executor.max_pending:
            yield from next_completed()
    while pending:
        yield from next_completed()
    check(stop)


def _wait(done: SimpleQueue, stop: Stop) -> Any:
    """Return the next key of the queue; raise KeyboardInterrupt once it is empty and must stop."""
    while True:
        try:
            return done.get(timeout=0 if stop.is_set() else STOP_PERIOD)
        except Empty:
            check(stop)


@contextmanager
def local_executor(
        function: Callable[[Any, Stop], Any], workers: int, stop: Stop) -> Iterator[Executor]:
    """Give an `Executor` of threads that call `function(job, stop)`."""
    with ThreadPoolExecutor(workers) as pool:
        try:
            yield Executor(f'{workers} at once', lambda job: pool.submit(function, job, stop),
                           Future.result, max_pending=4 * workers)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise
