# SPDX-License-Identifier: Apache-2.0
"""How long a learner waits for the advice of each of its mentors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from comply_ros.protocol.messages import Ignored

NO_LIMIT = 0.0


class AdviceTimeouts:
    """
    The seconds that a learner waits for each mentor; 0 for no limit.

    Parameters
    ----------
    for_all: of those that have none of their own.
    own: of mentors by their names; 0 for none of its own.

    """

    def __init__(self, for_all: float, own: Mapping[str, float]) -> None:
        self._for_all = for_all
        self._own = {name: seconds for name, seconds in own.items() if seconds != NO_LIMIT}

    def has_own(self, mentor: str) -> bool:
        """Tell whether a mentor has a limit of its own."""
        return mentor in self._own

    def of(self, mentor: str) -> float:
        """Return the seconds to wait for a mentor; 0 for no limit."""
        return self._own.get(mentor, self._for_all)

    def shortest(self) -> float:
        """Return the shortest limit; 0 where there is none."""
        return min((each for each in (self._for_all, *self._own.values()) if each != NO_LIMIT),
                   default=NO_LIMIT)

    def overdue(self, missing: Iterable[str], seconds: float) -> list[str]:
        """Return which of the mentors an observation has waited for long enough."""
        return [name for name in missing if NO_LIMIT < self.of(name) <= seconds]

    def reason(self, overdue: Sequence[str]) -> Ignored:
        """Return why a learner continues without these mentors."""
        of, seconds = ', '.join(filter(None, overdue)), max(self.of(name) for name in overdue)
        return Ignored('no advice in time', f'no recommendation {f"of {of} " if of else ""}came '
                       f'within {seconds} s: continues as without advice')
