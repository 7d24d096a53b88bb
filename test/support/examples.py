# SPDX-License-Identifier: Apache-2.0
"""How many examples hypothesis makes for a test, and which."""

import os
from typing import Any

from hypothesis import HealthCheck, Phase, settings

GENERATE = (Phase.explicit, Phase.generate)  # where shrinking would take too long
# Set by `scripts/test search`: other examples at each run, and so many times as many.
SEARCH = int(os.environ.get('COMPLY_ROS_SEARCH', '0'))


def examples(count: int, **options: Any) -> settings:
    """Return settings for a test with so many examples, the same ones at each run."""
    return settings(deadline=None, database=None, max_examples=count * max(1, SEARCH),
                    derandomize=not SEARCH, suppress_health_check=list(HealthCheck), **options)
