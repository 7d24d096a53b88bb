# SPDX-License-Identifier: Apache-2.0
"""The name of every preset, with its profile."""

from comply_ros.learner.presets import METHODS

PRESETS = [(profile, name) for profile, table in METHODS.items() for name in table]
