# SPDX-License-Identifier: Apache-2.0
"""The versions of stored files, raised by hand: files of another version are not read."""

# Raise it when what is stored is written in another way: the layout of a checkpoint, a journal, a
# cached mentor or a result cell, or the names or the meaning of what is in them.
FORMAT_VERSION = 3

# Fields of `LearnerConfig` that older files do not have, and the value that they had then.
LATER_FIELDS = {
    'learns': True, 'epsilon': 0.0, 'expects': False, 'doubles': False, 'learns_model': False,
    'slip_prior': 0.0, 'doubt_weight': 0.5, 'untried_value': 0.65, 'advice_slack': 0.12,
    'planner': 'none', 'known_after': 5, 'count_bonus': 0.3, 'unseen_weight': 0.01,
    'follows_majority': False, 'estimates_consistency': False, 'return_bonus': 0.1}

# Raise it when the same inputs give other bits: then test/unit/test_golden_digests.py fails.
ALGORITHM_VERSION = 1
