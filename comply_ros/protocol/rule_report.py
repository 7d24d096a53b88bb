# SPDX-License-Identifier: Apache-2.0
"""What a check of a node has found about each rule, and its channel to the node."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, Protocol

PASS, FAIL, NOT_REACHED = 'PASS', 'FAIL', 'NOT REACHED'
# Rules with a SHOULD: a node that breaks them works, but is less robust, or shows less.
SHOULD = frozenset((
    'P2', 'P4', 'P7', 'P8', 'P9', 'P10', 'P12', 'W14', 'W15', 'W18', 'W19', 'W20', 'W21', 'W23',
    'W24', 'M4', 'M5', 'M6', 'M7', 'M8', 'L9', 'L11', 'L12', 'L13', 'L15', 'L17', 'L19'))
PATIENCE = 10.0  # seconds that an answer may take
QUIET = 0.3  # seconds without a message that count as silence
SHOWN_MESSAGES = 4  # of those that show a failure


class Received(NamedTuple):
    """A message, and when it was received or sent, in seconds of the channel's clock."""

    time: float
    message: Any


class Verdict(NamedTuple):
    """
    What was found about a rule.

    Attributes
    ----------
    rule: its number on the page of the protocol, such as `W6`.
    result: `PASS`, `FAIL`, or `NOT REACHED` where the check saw nothing that the rule is about.
    expected, got: of a failure, in words.
    messages: those that show the failure, the last one last.
    item: of the plan of the check in which a rule was broken, by its index.
    transcript: all that was sent and received in the check until then.

    """

    rule: str
    result: str = NOT_REACHED
    expected: str = ''
    got: str = ''
    messages: tuple[Any, ...] = ()
    item: int = 0
    transcript: tuple[Received, ...] = ()


class Channel(Protocol):
    """
    Publishes to the node that is checked, and receives from it.

    Attributes
    ----------
    received: all messages of the node so far, by the name of their type.
    transcript: all messages so far, of both sides.
    time: now, in seconds.
    last_run: the largest number of a run that a check has used on this channel.
    followed: the run that a check has described last, for the node to follow; 0 for none.

    """

    received: defaultdict[str, list[Received]]
    transcript: list[Received]
    last_run: int
    followed: int

    @property
    def time(self) -> float:
        """The time now, in seconds."""
        ...

    def send(self, message: Any) -> None:
        """Publish a message."""
        ...

    def wait(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Wait until a condition is true, at most so many seconds; return whether it is."""
        ...

    def reset(self) -> bool:
        """Ask the node to start anew; return False if it cannot be asked."""
        ...

    def restart(self, seed: int) -> bool:
        """End the node and start it with a seed; return False if that is not possible."""
        ...

    def digest(self) -> str | None:
        """Return the digest of what a learner has learned; None if it does not say."""
        ...


class RuleReport:
    """
    Collects verdicts: a rule passes when it was seen kept, and never broken.

    Parameters
    ----------
    rules: a short title of each, by its number, in the order of the page.
    channel: to the node, for the transcript of a failure.

    Attributes
    ----------
    item: of the plan of the check, by its index, for the verdicts that follow.

    """

    def __init__(self, rules: Mapping[str, str], channel: Channel) -> None:
        self._verdicts = {rule: Verdict(rule) for rule in rules}
        self._channel, self._start, self.item = channel, len(channel.transcript), 0

    def follow(self, plan: Iterable[str], do: Callable[[str], object]) -> None:
        """Do the items of the plan of a check in turn, until one returns False."""
        for self.item, item in enumerate(plan):
            if do(item) is False:
                return

    def check(self, rule: str, kept: object, expected: str, got: object = '',
              *messages: Any) -> bool:
        """Note whether a rule was kept, and what shows it if it was not; return whether it was."""
        before = self._verdicts[rule]
        if before.result != FAIL:
            self._verdicts[rule] = Verdict(rule, PASS) if kept else Verdict(
                rule, FAIL, expected, str(got), messages[-SHOWN_MESSAGES:], self.item,
                tuple(self.transcript()))
        return bool(kept)

    def transcript(self) -> list[Received]:
        """Return what was sent and received since the check began."""
        return self._channel.transcript[self._start:]

    def result(self, rule: str) -> str:
        """Return what was found about a rule so far."""
        return self._verdicts[rule].result

    def verdicts(self) -> tuple[Verdict, ...]:
        """Return the verdicts in the order of the rules."""
        return tuple(self._verdicts.values())


def breaks_a_must(verdicts: tuple[Verdict, ...]) -> bool:
    """Tell whether a rule with a MUST was broken."""
    return any(each.result == FAIL and each.rule not in SHOULD for each in verdicts)


def summary(name: str, verdicts: tuple[Verdict, ...]) -> str:
    """Return one line about all verdicts, for a badge."""
    counts = {result: sum(each.result == result for each in verdicts)
              for result in (PASS, FAIL, NOT_REACHED)}
    weak = sum(each.result == FAIL and each.rule in SHOULD for each in verdicts)
    return (f'{name}: {counts[PASS]} passed, {counts[FAIL]} failed'
            + (f' ({weak} of them only a SHOULD)' if weak else '')
            + f', {counts[NOT_REACHED]} not reached')
