# SPDX-License-Identifier: Apache-2.0
"""Machine code for the steps of a learner with a model, while its plain Python goes on."""

from concurrent.futures import Future
from contextlib import suppress
import ctypes
import os
from pathlib import Path
import sys
from typing import Any

from comply_ros.learner.agent import Agent
from comply_ros.learner.learner_config import KernelConfig
from comply_ros.learner.learner_state import LearnerState
from comply_ros.learner.step_kernels import cached_kernels, compile_step, PLAIN, StepKernels
from comply_ros.nodes.background_thread import in_background
from comply_ros.numerics.action_values import count_actions
from comply_ros.numerics.jit import can_cache, COMPILER_LIBRARY

NICENESS = 19  # of the process that compiles: the nodes go first
PROGRAM = ('import os; os.nice({niceness}); from comply_ros.terminal.interrupts import '
           'end_with_parent; end_with_parent({parent}); from comply_ros.storage.kernel_cache '
           'import use_kernel_cache; use_kernel_cache(); from {module} import {function}; '
           '{function}({actions}, {mentors})')


class StepCompiler:
    """
    Gives an agent with a model the kernels of its steps as machine code; the bits are the same.

    To load it takes a second of a thread. What is not in the cache is compiled by a process of
    its own, for a minute or so. Until then, and where that fails, the agent steps in plain Python.

    Parameters
    ----------
    logger: of the node.

    """

    def __init__(self, logger: Any) -> None:
        self._logger = logger
        self._loaded: dict[Any, Future[StepKernels]] = {}  # by the `step_types` of the agent

    def tick(self, agent: Agent) -> None:
        """Start to load what the agent needs, or give it what was loaded."""
        types = agent.step_types
        if types is None or agent.runs_machine_code:
            return
        loaded = self._loaded.get(types)
        if loaded is None:
            self._loaded[types] = in_background(load_kernels, agent.kernel_config, agent.state)
        elif loaded.done() and loaded.exception():
            self._logger.warning('goes on in plain Python, which is slower: '
                                 f'{loaded.exception()}')
            self._loaded[types] = Future()  # of which nothing more comes
        elif loaded.done():
            agent.use_kernels(loaded.result())
            if agent.runs_machine_code:
                self._logger.info('steps in machine code from now on')


def load_kernels(config: KernelConfig, state: LearnerState) -> StepKernels:
    """
    Return the kernels of a step for these types, compiled in another process if need be.

    They are plain Python where there is no compiler or no cache.

    Raises
    ------
    OSError, RuntimeError: if that process cannot be started, or fails.

    """
    if not can_cache():
        return PLAIN
    kernels = _load(config, state)
    if kernels is None:
        compile_in_process(count_actions(config.actions), len(config.mentors))
        kernels = _load(config, state)
    return kernels or PLAIN


def _load(config: KernelConfig, state: LearnerState) -> StepKernels | None:
    kernels = cached_kernels(config, state)
    release_code(COMPILER_LIBRARY)
    return kernels


def release_code(library: str) -> None:
    """
    Give back the memory that the code of a library takes in this process (Linux).

    Of the code that is called again, the kernel maps the pages again.
    """
    from mmap import MADV_DONTNEED  # here, so that no other learner loads it
    madvise = ctypes.CDLL(None).madvise
    with suppress(OSError):  # on another system
        for line in Path('/proc/self/maps').read_text().splitlines():
            span, access, *_, path = line.split(maxsplit=5)
            if access == 'r-xp' and library in Path(path).name:
                first, end = (int(number, 16) for number in span.split('-'))
                madvise(ctypes.c_void_p(first), ctypes.c_size_t(end - first), MADV_DONTNEED)


def compile_in_process(n_actions: int, n_mentors: int) -> None:
    """
    Compile the kernels of a step for the cache, in a process that ends with this one.

    Raises
    ------
    OSError, RuntimeError: if it cannot be started, or fails.

    """
    import subprocess  # here, so that no other learner loads it
    done = subprocess.run([sys.executable, '-P', '-c', PROGRAM.format(
        niceness=NICENESS, parent=os.getpid(), module=compile_step.__module__,
        function=compile_step.__name__, actions=n_actions, mentors=n_mentors)],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        start_new_session=True, check=False)
    if done.returncode:
        lines = done.stderr.splitlines() or ['']
        raise RuntimeError(f'the compiler ended with code {done.returncode}: {lines[-1]}')
