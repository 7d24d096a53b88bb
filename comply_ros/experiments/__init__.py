# SPDX-License-Identifier: Apache-2.0
"""Learning in process, without ROS: the same bits as the nodes, many times faster."""
