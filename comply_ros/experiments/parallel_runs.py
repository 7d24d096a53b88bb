# SPDX-License-Identifier: Apache-2.0
"""Jobs in parallel: on this machine's cores, or runs on a Dask cluster, by one interface."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
import logging
from queue import Empty, Queue
from typing import Any, NamedTuple

from comply_ros.experiments import training_runs
from comply_ros.experiments.available_cores import available_cores
from comply_ros.experiments.training_runs import Run
from comply_ros.experiments.worker_files import (
    files_of,
    NamedFile,
    read_file,
    ShippedFile,
    unpack,
    world_of,
)
from comply_ros.storage.kernel_cache import use_kernel_cache
from comply_ros.terminal.interrupts import check, StopFlag
from comply_ros.terminal.training_options import MISTAKES

RESULT_COLUMNS = ('iterations', 'steps', 'time_to_convergence', 'reward_ratio', 'regret',
                  'final_return', 'mentor_return', 'optimal_return', 'digest')
COMPARED_COLUMNS = (*RESULT_COLUMNS[2:5], *RESULT_COLUMNS[6:8])  # of them, what needs a model
STOP_PERIOD = 0.1  # seconds between two checks of the stop while nothing completes
CONNECT_TIMEOUT = 5.0  # seconds for a scheduler to answer


class ClusterError(Exception):
    """A cluster that does not answer or that was lost; the message names its address."""

    exit_code = 1


class Executor(NamedTuple):
    """
    What runs jobs in parallel; label: for the progress bar.

    submit: called with a job; returns its future.
    result: called with a future that is done; returns the job's result, None if it was stopped.
    max_pending: most jobs submitted and not yet completed; the others are not yet in memory.
    """

    label: str
    submit: Callable[[Any], Future]
    result: Callable[[Future], Any]
    max_pending: int


def measure(run: Run, stop: StopFlag | None = None) -> dict[str, object] | None:
    """Learn a run and return its `RESULT_COLUMNS` by name; None if `stop` was set."""
    result = training_runs.learn(run, stop)
    if result is None:
        return None
    return {'iterations': len(result.returns), 'steps': result.steps,
            **training_runs.measures(run, result.returns), 'final_return': result.returns[-1],
            'mentor_return': training_runs.mentor_return(run),
            'optimal_return': training_runs.reference_returns_of(run).optimal_return,
            'digest': result.digest}


def _measure_in_worker(run: Run, files: dict[str, ShippedFile],
                       world: str) -> dict[str, object] | None:
    use_kernel_cache()
    return measure(unpack(run, files, world))


def _same(file: ShippedFile) -> ShippedFile:
    return file


def completed(executor: Executor, jobs: Iterable[tuple[Any, Any]], stop: StopFlag
              ) -> Iterator[tuple[Any, Any]]:
    """
    Submit each `(key, job)` and yield each `(key, result)`, in the order of completion.

    Raises
    ------
    KeyboardInterrupt: if `stop` is set; what has completed before is yielded first.
    ClusterError: if the cluster was lost, or cannot do a job.

    """
    # Not a SimpleQueue: in Python 3.11 its `get` never returns if a signal comes and the time is
    # over before the signal's handler has run.
    done: Queue = Queue()
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


def _wait(done: Queue, stop: StopFlag) -> Any:
    """Return the next key of the queue; raise KeyboardInterrupt if there is none and must stop."""
    while True:
        try:
            return done.get(timeout=0 if stop.is_set() else STOP_PERIOD)
        except Empty:
            check(stop)


@contextmanager
def local_executor(function: Callable[[Any, StopFlag], Any], stop: StopFlag,
                   workers: int | None = None) -> Iterator[Executor]:
    """
    Give an `Executor` of threads that call `function(job, stop)`.

    workers: threads; by default one for each core that this process may use.
    """
    workers = workers or available_cores()
    with ThreadPoolExecutor(workers) as pool:
        try:
            yield Executor(f'{workers} at once', lambda job: pool.submit(function, job, stop),
                           Future.result, max_pending=4 * workers)
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Give an `Executor` of a scheduler's workers; raise ClusterError if it does not answer."""
    import asyncio
    client = _connect(address)
    loop = client.loop.asyncio_loop

    @lru_cache(maxsize=None)
    def shipped(named: NamedFile) -> Any:
        file = read_file(named)  # once: all runs have the same content, whatever happens to it
        return client.submit(_same, file, key=f'comply_ros-{file.sha256}{file.suffix}')

    def submit(run: Run) -> Future:
        files = {field: shipped(named) for field, named in files_of(run).items()}
        job = client.submit(_measure_in_worker, run, files, world_of(run), pure=False)
        # Results of runs that end together come in one message.
        return asyncio.run_coroutine_threadsafe(client.gather(job, asynchronous=True), loop)
    try:
        yield Executor('on the cluster', submit, lambda job: _result(job, address),
                       max_pending=500)
    finally:
        client.close(timeout=CONNECT_TIMEOUT)


def _result(job: Future, address: str) -> Any:
    from distributed.comm import CommClosedError
    try:
        return job.result()
    except MISTAKES:
        raise
    except (CancelledError, CommClosedError) as error:
        raise ClusterError(f'the cluster at {address} was lost') from error
    except Exception as error:
        cause: BaseException = error
        while cause.__cause__ is not None:
            cause = cause.__cause__
        reason = ' '.join(f'{type(cause).__name__}: {cause}'.split())
        raise ClusterError(f'the cluster at {address} cannot do a run ({reason})') from error


def _connect(address: str) -> Any:
    """Return a Dask client."""
    import asyncio
    try:
        from distributed import Client, rpc
    except ImportError:
        raise ClusterError("a scheduler needs the Python package 'distributed', which is missing: "
                           'pip install distributed') from None
    for name in ('distributed', 'distributed.client'):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # we log what matters, once

    async def identify() -> None:  # `Client` alone waits for a silent scheduler forever
        async with (asyncio.timeout(CONNECT_TIMEOUT),
                    rpc(address, timeout=CONNECT_TIMEOUT) as scheduler):
            await scheduler.identity()
    try:
        asyncio.run(identify())
        return Client(address, timeout=CONNECT_TIMEOUT)
    except Exception as error:
        raise ClusterError(f'a Dask scheduler must answer within {CONNECT_TIMEOUT:.0f} s, and '
                           f'none does at {address!r}') from error
