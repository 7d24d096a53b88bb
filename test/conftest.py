# SPDX-License-Identifier: Apache-2.0
"""What tests share: kernels plain and compiled, and a ROS domain of its own for each test."""

from functools import cache
import signal

import pytest
from ros_domain import own_domain

from comply_ros.numerics.jit import compiled
from comply_ros.storage.kernel_cache import use_kernel_cache

use_kernel_cache()
# Started in the background of a shell, this process and all that it starts would ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)


# test_training.py has the compiled step of every row: each kernel alone is for the long run.
@pytest.fixture(params=['plain', pytest.param('compiled', marks=pytest.mark.long)])
def as_run(request):
    """Return a function that gives a kernel as it runs in a callback, and in a compiled loop."""
    return called_compiled if request.param == 'compiled' else lambda kernel: kernel


@cache
def called_compiled(kernel):
    """Return a compiled function that calls a kernel, whose code the compiled loop then shares."""
    def entry(*arguments):
        return kernel(*arguments)
    return compiled(entry)


def pytest_collection_modifyitems(items):
    """
    Order the tests so that of two processes, one compiles the kernels with a model or a planner.

    `--dist worksteal` gives each process one half. Those kernels have types of their own, so they
    share no code with the others, which the first process compiles; what it has compiled is in
    the cache when the second one needs it.
    """
    names = ('model_based', 'test_outcome_model', 'mentor_records', 'prioritized_sweeping',
             'r_max', 'mbie_eb', 'psrl', 'test_planned_values', 'test_learner_config',
             'cannot_begin_one_with_a_model')
    of_model = [item for item in items if any(name in item.nodeid for name in names)]
    moved = set(of_model)
    others = [item for item in items if item not in moved]
    others.sort(key=lambda item: 'as_run' not in getattr(item, 'fixturenames', ()))
    half = len(items) // 2
    items[:] = [*others[:half], *of_model, *others[half:]]


@pytest.fixture
def domain(monkeypatch):
    """Give the test, and the processes that it starts, a ROS domain that nobody else has."""
    with own_domain(monkeypatch) as number:
        yield number
