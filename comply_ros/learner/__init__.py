# SPDX-License-Identifier: Apache-2.0
"""Learners: presets, update rules, exploration, trust, and training in one process."""
