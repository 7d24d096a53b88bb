# SPDX-License-Identifier: Apache-2.0
"""The shortest plan of a check that still shows that a rule is broken."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from comply_ros.protocol.rule_report import FAIL, Verdict

ATTEMPTS = 20  # shorter plans that are tried for a rule
Plan = tuple[str, ...]  # what a check does, item by item


def shortest_failure(verdict: Verdict, plan: Plan,
                     check: Callable[[Plan], Sequence[Verdict]],
                     attempts: int = ATTEMPTS) -> Verdict:
    """
    Return a verdict on the same rule with a transcript that is as short as could be found.

    What came after the item that broke the rule is left out. Then this item is tried alone, or the
    first one, or the last 2, 4, 8 and so on. Of the shortest that shows the failure, parts are
    left out as long as it still does: at first half of it, later single items.

    Parameters
    ----------
    verdict: a failure.
    plan: of the check that found it.
    check: runs a check by a plan, and returns its verdicts.
    attempts: plans to try at most.

    """
    search = _Search(verdict, plan[:verdict.item + 1], check, attempts)
    length, size = len(search.plan), 1
    if not search.fails(search.plan[:1]):
        while size < length and not search.fails(search.plan[-size:]):
            size *= 2
    size = len(search.plan) // 2
    while size:
        start = 0
        while start < len(search.plan):
            if not search.fails((*search.plan[:start], *search.plan[start + size:])):
                start += size
        size //= 2
    return search.verdict


class _Search:
    """The shortest plan so far that shows a failure, and its verdict."""

    def __init__(self, verdict: Verdict, plan: Plan,
                 check: Callable[[Plan], Sequence[Verdict]], attempts: int) -> None:
        self.verdict, self.plan, self._check, self._left = verdict, plan, check, attempts

    def fails(self, shorter: Plan) -> bool:
        """Tell whether a shorter plan breaks the rule, and take it in that case."""
        if not 0 < len(shorter) < len(self.plan) or self._left == 0:
            return False
        self._left -= 1
        for found in self._check(shorter):
            if found.rule == self.verdict.rule and found.result == FAIL:
                self.plan, self.verdict = shorter[:found.item + 1], found
                return True
        return False
