# SPDX-License-Identifier: Apache-2.0
"""A ROS domain that nobody else has, for a test or a file of tests."""

from collections.abc import Generator
from contextlib import contextmanager
import itertools
import os

import pytest
import shared_memory

# Domains are taken in turn. In that of the test before, a node may still end; its shared memory
# would be cleared here, and when it ends it would delete that of a new node by the same name.
# Messages would then go where nobody reads. Each worker of pytest-xdist begins elsewhere.
_WORKER = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw'))
_turns = itertools.count(50 * _WORKER)


@contextmanager
def own_domain(monkeypatch: pytest.MonkeyPatch) -> Generator[int]:
    """Give a ROS domain to this process, and to those that it starts."""
    from domain_coordinator import domain_id
    with domain_id(lambda: 1 + next(_turns) % 100) as number:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(number))
        monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        monkeypatch.setenv('ROS_PYTHON_CHECK_FIELDS', '1')
        assert os.environ['ROS_DOMAIN_ID'] == str(number)
        shared_memory.clear(number)  # of nodes that earlier tests have killed
        yield number
