# SPDX-License-Identifier: Apache-2.0
"""Recorded conversations: written, read, replayed, plotted. No rclpy."""
