# SPDX-License-Identifier: Apache-2.0
"""Training in one process, without ROS: train, reproduce and sweep."""
