# SPDX-License-Identifier: Apache-2.0
"""Where the runs of a sweep are learned: on this machine's cores, or on a Dask cluster."""

import asyncio
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
import logging
from queue import Empty, SimpleQueue
from typing import NamedTuple

from comply_ros.experiments.training_runs import learn, measures, mentor_return, Run, yardstick_of
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.interrupts import check
from comply_ros.terminal.training_options import MISTAKES

MEASURES = ('iterations', 'steps', 'time_to_convergence', 'reward_ratio', 'regret',
            'final_return', 'mentor_return', 'optimal_return', 'digest')
PATIENCE = 5.0  # seconds for a scheduler to answer
LOOK = 0.1  # seconds between looks at whether somebody wants to stop
AHEAD = 500  # runs that a cluster has at once, those that wait included


class EngineError(Exception):
    """A cluster that cannot be had or that went away; the message names its address."""


class Engine(NamedTuple):
    """
    What learns runs.

    Attributes
    ----------
    label: for the progress bar.
    submit: called with a `Run`; returns a future, which has `add_done_callback`.
    result: called with a future that has ended; returns the measures of its run, None if it was
        stopped.
    ahead: runs to be submitted before the first has ended; so many are in memory, not more.

    """

    label: str
    submit: object
    result: object
    ahead: int


def measure(run, stop=None):
    """Learn a run and return its `MEASURES` as a table; None if the `Stop` stop was set."""
    learned = learn(run, stop)
    if learned is None:
        return None
    return {'iterations': len(learned.returns), 'steps': learned.steps,
            **measures(run, learned.returns), 'final_return': learned.returns[-1],
            'mentor_return': _mentor_return(run.map, run.profile, run.mentor, run.mentor_seed),
            'optimal_return': yardstick_of(run).optimal_return, 'digest': learned.digest}


def _measure_in_worker(run):
    use_kernel_cache()
    return measure(run)


@lru_cache(maxsize=64)
def _mentor_return(name, profile, mentor, seed):
    return mentor_return(Run(map=name, profile=profile, mentor=mentor, mentor_seed=seed))


def outcomes(engine, runs, stop):
    """
    Yield `(number, measures)` of each `(number, run)`, in the order in which they end.

    Raises
    ------
    KeyboardInterrupt: if the `Stop` stop is set.
    EngineError: if the cluster went away, or cannot do a run.

    """
    ended, jobs = SimpleQueue(), {}

    def next_one():
        number = _next(ended, stop)
        measured = engine.result(jobs.pop(number))
        if measured is not None:
            yield number, measured
    for number, run in runs:
        if stop.is_set():
            break
        jobs[number] = engine.submit(run)
        jobs[number].add_done_callback(lambda _, number=number: ended.put(number))
        if len(jobs) >= engine.ahead:
            yield from next_one()
    while jobs:
        yield from next_one()
    check(stop)


def _next(ended, stop):
    """Return the number of a run that has ended; those that have are given before a stop."""
    while True:
        try:
            return ended.get(timeout=0 if stop.is_set() else LOOK)
        except Empty:
            check(stop)


@contextmanager
def this_machine(workers, stop):
    """Give an `Engine` of threads: the compiled loops run on all cores at once."""
    with ThreadPoolExecutor(workers) as pool:
        try:
            yield Engine(f'{workers} at once', lambda run: pool.submit(measure, run, stop),
                         Future.result, ahead=4 * workers)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


@contextmanager
def cluster(address):
    """
    Give an `Engine` of the workers of a Dask scheduler.

    Raises
    ------
    EngineError: if no scheduler answers.

    """
    client = _connected(address)
    loop = client.loop.asyncio_loop

    def submit(run):
        job = client.submit(_measure_in_worker, run, pure=False)
        return asyncio.run_coroutine_threadsafe(_fetched(client, job), loop)
    try:
        yield Engine('on the cluster', submit, lambda job: _result(job, address), AHEAD)
    finally:
        client.close(timeout=PATIENCE)


async def _fetched(client, job):
    """Wait for a run and return its measures; of those that end together in one message."""
    return await client.gather(job, asynchronous=True)


def _result(job, address):
    from distributed.comm import CommClosedError
    try:
        return job.result()
    except MISTAKES:
        raise
    except (CancelledError, CommClosedError) as error:
        raise EngineError(f'the cluster at {address} went away') from error
    except Exception as error:
        raise EngineError(f'the cluster at {address} cannot do a run ({_cause(error)})') from error


def _cause(error):
    """Return what an exception began with, in one line."""
    while error.__cause__ is not None:
        error = error.__cause__
    return ' '.join(f'{type(error).__name__}: {error}'.split())


def _connected(address):
    try:
        from distributed import Client
    except ImportError:
        raise EngineError("a scheduler needs the Python package 'distributed', which is missing: "
                          'pip install distributed') from None
    for name in ('distributed', 'distributed.client'):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters is said once, by us
    try:
        asyncio.run(_identity(address))
        return Client(address, timeout=PATIENCE)
    except Exception as error:
        raise EngineError(f'a Dask scheduler must answer within {PATIENCE:.0f} s, and none does '
                          f'at {address!r}') from error


async def _identity(address):
    """Return what a scheduler says of itself; `Client` alone waits for a silent one forever."""
    from distributed import rpc
    async with asyncio.timeout(PATIENCE), rpc(address, timeout=PATIENCE) as scheduler:
        return await scheduler.identity()
