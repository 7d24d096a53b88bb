# SPDX-License-Identifier: Apache-2.0
"""Recorded runs in rosbag2 files: read, written, replayed and plotted. Imports no rclpy."""
