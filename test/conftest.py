# SPDX-License-Identifier: Apache-2.0
"""What tests share: kernels plain and compiled, and a ROS domain of its own for each test."""

import os

import pytest
import shared_memory

from comply_ros.numerics.jit import compiled
from comply_ros.storage.kernel_cache import use_kernel_cache

use_kernel_cache()


@pytest.fixture(params=['plain', 'compiled'])
def as_run(request):
    """Return a function that gives a kernel as it runs in a callback, and in a compiled loop."""
    return compiled if request.param == 'compiled' else lambda kernel: kernel


@pytest.fixture
def domain(monkeypatch):
    """Give the test, and the processes that it starts, a ROS domain that nobody else has."""
    from domain_coordinator import domain_id
    with domain_id() as number:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        monkeypatch.setenv('ROS_PYTHON_CHECK_FIELDS', '1')
        assert os.environ['ROS_DOMAIN_ID'] == str(number)
        shared_memory.clear(number)  # of nodes that earlier tests have killed
        yield number
