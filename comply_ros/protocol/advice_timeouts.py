# SPDX-License-Identifier: Apache-2.0
"""How long a learner waits for the advice of each of its mentors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from comply_ros.learner.learner_config import ConfigError
from comply_ros.protocol.messages import Ignored

NO_LIMIT = 0.0
LONGEST = 3600.0  # seconds


def validate_timeouts(timeouts: Sequence[float], mentors: Sequence[str]) -> None:
    """
    Return if these can be the timeouts of the mentors: one for each, or one for all.

    Raises
    ------
    ConfigError: otherwise.

    """
    given = list(timeouts)
    if len(given) not in (1, len(mentors)):
        raise ConfigError('advice_timeouts must have one number for each of the mentors '
                          f'{list(mentors)}, or one for all, got {given}')
    if not all(0.0 <= each <= LONGEST for each in given):  # false for nan
        raise ConfigError('advice_timeouts must have numbers of seconds in '
                          f'[0.0, {LONGEST}], got {given}')


class AdviceTimeouts:
    """
    The seconds that a learner waits for each mentor; 0 for no limit.

    Parameters
    ----------
    for_all: of those that have none of their own.
    timeouts: of each mentor, or one for all of them; 0 for none of its own.
    mentors: their names.

    Raises
    ------
    ConfigError: as `validate_timeouts`.

    """

    def __init__(self, for_all: float, timeouts: Sequence[float], mentors: Sequence[str]) -> None:
        validate_timeouts(timeouts, mentors)
        each = timeouts if len(timeouts) == len(mentors) else len(mentors) * [timeouts[0]]
        self._for_all = for_all
        self._own = {name: own for name, own in zip(mentors, each) if own != NO_LIMIT}

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
