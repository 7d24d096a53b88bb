# SPDX-License-Identifier: Apache-2.0
"""The shortest plan of a check that still shows that a rule is broken."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from comply_ros.protocol.rule_report import FAIL, Verdict

ATTEMPTS = 16  # shorter plans that are tried for a rule
Plan = tuple[str, ...]  # what a check does, item by item


def shortest_failure(verdict: Verdict, plan: Plan,
                     check: Callable[[Plan], Sequence[Verdict]],
                     attempts: int = ATTEMPTS) -> Verdict:
    """
    Return a verdict on the same rule with a transcript that is as short as could be found.

    What came after the item that broke the rule is left out; then parts are left out of the rest,
    at first half of it, later a single item, as long as the rule is still broken.

    Parameters
    ----------
    verdict: a failure.
    plan: of the check that found it.
    check: runs a check by a plan, and returns its verdicts.
    attempts: plans to try at most.

    """
    plan, size = plan[:verdict.item + 1], max(1, verdict.item // 2)
    while attempts > 0:
        start = 0
        while start < len(plan) and attempts > 0 and len(plan) > 1:
            shorter, attempts = (*plan[:start], *plan[start + size:]), attempts - 1
            found = next((each for each in check(shorter) if each.rule == verdict.rule
                          and each.result == FAIL), None) if shorter else None
            if found is None:
                start += size
            else:
                plan, verdict = shorter[:found.item + 1], found
        if size == 1:
            break
        size //= 2
    return verdict
