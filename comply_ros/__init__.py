# SPDX-License-Identifier: Apache-2.0
"""Learning from a suboptimal teacher: how far to comply, state by state, over ROS 2 topics."""

__version__ = '0.1.0'
