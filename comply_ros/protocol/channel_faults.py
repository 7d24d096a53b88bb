# SPDX-License-Identifier: Apache-2.0
"""A channel with faults: messages are lost, delayed, doubled or reordered, as a seed decides."""

from collections import Counter
from dataclasses import dataclass, field, fields
from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np

from comply_ros.numerics.rng import UniformRows

# Uniforms of each message, used or not: drop, reorder, duplicate, and for each of two copies
# whether it is delayed and for how long.
UNIFORMS = 7
LONGEST = 60  # seconds that a message may be delayed
COUNTED = ('heard', 'dropped', 'delayed', 'duplicated', 'reordered', 'relayed')


class FaultError(ValueError):
    """A probability or time out of its range; the message names the field, rule and value."""


def _field(default: float, text: str, high: float = 1) -> Any:
    return field(default=default, metadata={'text': text, 'low': 0, 'high': high})


@dataclass(frozen=True)
class Faults:
    """
    How often each fault happens to a message, independently of the others.

    Every field is a parameter of the node `fault_injector`.

    Raises
    ------
    FaultError: for a value out of its range.

    """

    drop: float = _field(0.0, 'Probability that a message is lost')
    delay: float = _field(0.0, 'Probability that a message, or its second copy, is delayed')
    duplicate: float = _field(0.0, 'Probability that a message is published twice')
    reorder: float = _field(
        0.0, 'Probability that a message comes after the next one of its topic, or after '
        'longest_delay if there is none')
    longest_delay: float = _field(
        0.02, 'The longest delay of a message, in seconds', LONGEST)

    def __post_init__(self) -> None:
        for each in fields(self):
            value, high = getattr(self, each.name), each.metadata['high']
            if not 0 <= value <= high:
                raise FaultError(f'{each.name} must lie in [0, {high}], got {value}')


class Delayed(NamedTuple):
    """A message in the channel: when it is due, its place in the order of arrival, itself."""

    time: float
    order: int
    message: Any


class FaultyChannel:
    """
    One topic with faults: a message goes in by `put`, and comes out of `due` when it is time.

    Parameters
    ----------
    faults: how often each fault happens.
    generator: of the random numbers; each message takes `UNIFORMS`.

    Attributes
    ----------
    counts: how many messages were received, met each fault, and were relayed, by name.

    """

    def __init__(self, faults: Faults, generator: np.random.Generator) -> None:
        self.counts = Counter(dict.fromkeys(COUNTED, 0))
        self._faults, self._draws = faults, UniformRows(generator, UNIFORMS)
        self._delayed: list[Delayed] = []  # a heap: the first that is due comes first
        self._overtaken: tuple[Delayed, ...] = ()  # copies that wait until another one passed
        self._order = 0

    def is_empty(self) -> bool:
        """Tell whether every message has come out, or is lost."""
        return not self._delayed and not self._overtaken

    def put(self, message: Any, now: float) -> None:
        """Put a message into the channel, in none, one or two copies; `now` in seconds."""
        drop, reorder, duplicate, *times = self._draws.row()
        self.counts['heard'] += 1
        if drop < self._faults.drop:
            self.counts['dropped'] += 1
            return
        copies = 1 + self._counted('duplicated', duplicate < self._faults.duplicate)
        if not self._overtaken and self._counted('reordered', reorder < self._faults.reorder):
            self._overtaken = (self._after(now, self._faults.longest_delay, message),) * copies
            return
        for late, share in (times[:2], times[2:])[:copies]:
            is_late = self._counted('delayed', late < self._faults.delay)
            heappush(self._delayed, self._after(
                now, share * self._faults.longest_delay if is_late else 0.0, message))

    def due(self, now: float) -> list[Any]:
        """Take out, and return, the messages whose time has come, first to last."""
        messages = []
        while self._delayed and self._delayed[0].time <= now:
            first = heappop(self._delayed)
            messages.append(first.message)
            if self._overtaken and first.order > self._overtaken[0].order:
                messages += self._take_overtaken()
        if self._overtaken and self._overtaken[0].time <= now:
            messages += self._take_overtaken()
        self.counts['relayed'] += len(messages)
        return messages

    def _after(self, now: float, delay: float, message: Any) -> Delayed:
        self._order += 1
        return Delayed(now + delay, self._order, message)

    def _take_overtaken(self) -> list[Any]:
        overtaken, self._overtaken = self._overtaken, ()
        return [each.message for each in overtaken]

    def _counted(self, name: str, happens: bool) -> bool:
        self.counts[name] += happens
        return happens


def stream_of_topic(seed: int, name: str) -> np.random.Generator:
    """Return the generator for a topic that is found later: the same whenever it is found."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, *name.encode()])))


def fault_streams(seed: int, count: int) -> list[np.random.Generator]:
    """Return generators for the topics, independent, also of the world's and the learner's."""
    children = np.random.SeedSequence(seed).spawn(2 + count)[2:]
    return [np.random.Generator(np.random.PCG64(child)) for child in children]
