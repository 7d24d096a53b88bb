# SPDX-License-Identifier: Apache-2.0
"""What tests of nodes share."""

import pytest
import rclpy
from rclpy.node import Node
from short_training import trained


@pytest.fixture
def expected():
    """Return the digest that `train` gives for the arguments above."""
    return trained(iterations=4)


@pytest.fixture
def node():
    """Return a node of the test's own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    yield Node('test', context=context)
    rclpy.try_shutdown(context=context)
