# SPDX-License-Identifier: Apache-2.0
"""What tests share: kernels plain and compiled, and a ROS domain of its own for each test."""

import signal

import pytest
from ros_domain import own_domain

from comply_ros.numerics.jit import compiled
from comply_ros.storage.kernel_cache import use_kernel_cache

use_kernel_cache()
# Started in the background of a shell, this process and all that it starts would ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(params=['plain', 'compiled'])
def as_run(request):
    """Return a function that gives a kernel as it runs in a callback, and in a compiled loop."""
    return compiled if request.param == 'compiled' else lambda kernel: kernel


@pytest.fixture
def domain(monkeypatch):
    """Give the test, and the processes that it starts, a ROS domain that nobody else has."""
    with own_domain(monkeypatch) as number:
        yield number
