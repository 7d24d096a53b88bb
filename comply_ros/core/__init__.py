# SPDX-License-Identifier: Apache-2.0
"""The mathematics: worlds, learners, mentors and their conversation. No ROS, no files."""
