# SPDX-License-Identifier: Apache-2.0
"""The only room with ROS in it: a node is a thin shell round an actor of core."""
