# SPDX-License-Identifier: Apache-2.0
"""Tools for the developers of comply_ros. They are not installed."""
