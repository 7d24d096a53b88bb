# SPDX-License-Identifier: Apache-2.0
"""Runs on a Dask cluster, by the interface of `executors`."""

import asyncio
from collections.abc import Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
import logging
from typing import Any

from comply_ros.experiments.executors import Executor, measure
from comply_ros.experiments.training_runs import Run
from comply_ros.terminal.training_options import MISTAKES

CONNECT_TIMEOUT = 5.0  # seconds for a scheduler to answer
MAX_PENDING = 500  # runs that a cluster has at once, those that wait included


class ClusterError(Exception):
    """A cluster that does not answer or that was lost; the message names its address."""


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Give an `Executor` of a scheduler's workers; raise ClusterError if it does not answer."""
    client = _connect(address)
    loop = client.loop.asyncio_loop

    def submit(run: Run) -> Future:
        job = client.submit(measure, run, pure=False)
        # Results of runs that end together come in one message.
        return asyncio.run_coroutine_threadsafe(client.gather(job, asynchronous=True), loop)
    try:
        yield Executor('on the cluster', submit, lambda job: _result(job, address), MAX_PENDING)
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
