# SPDX-License-Identifier: Apache-2.0
"""The messages between world, mentor and learner, and each of the three as a state machine."""
