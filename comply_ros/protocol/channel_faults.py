# SPDX-License-Identifier: Apache-2.0
"""A wire with faults: messages are lost, late, said twice or out of turn, as a seed decides."""

from collections import Counter
from dataclasses import dataclass, field, fields
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from comply_ros.numerics.rng import UniformRows

UNIFORMS = 7  # of each message, used or not: drop, reorder, duplicate, two copies' delay and time
LONGEST = 60  # seconds that a message may be late
COUNTED = ('heard', 'dropped', 'delayed', 'duplicated', 'reordered', 'relayed')


class FaultError(ValueError):
    """A probability or time that cannot be; the message names the field, the rule, the value."""


def _field(default, text, high=1):
    return field(default=default, metadata={'text': text, 'low': 0, 'high': high})


@dataclass(frozen=True)
class Faults:
    """
    How often which fault happens to a message, independently of each other.

    Every field is a parameter of the fault_injector node.

    Raises
    ------
    FaultError: for a value out of its range.

    """

    drop: float = _field(0.0, 'Probability that a message is lost')
    delay: float = _field(0.0, 'Probability that a message, or its second copy, is late')
    duplicate: float = _field(0.0, 'Probability that a message is said twice')
    reorder: float = _field(
        0.0, 'Probability that a message comes after the next one of its topic, or after '
        'longest_delay if there is none')
    longest_delay: float = _field(
        0.02, 'The longest time that a message is late, in seconds', LONGEST)

    def __post_init__(self):
        for each in fields(self):
            value, high = getattr(self, each.name), each.metadata['high']
            if not 0 <= value <= high:
                raise FaultError(f'{each.name} must lie in [0, {high}], got {value}')


class Late(NamedTuple):
    """A message on the wire: when it is due, the turn in which it was put there, itself."""

    time: float
    step_id: int
    message: object


class FaultyChannel:
    """
    One topic with faults: a message goes in by `hear`, and comes out of `due` when it is time.

    Parameters
    ----------
    faults: `Faults`.
    generator: `numpy.random.Generator`, of which each message takes `UNIFORMS`.

    Attributes
    ----------
    counts: how many messages were heard, met each fault, and were relayed, by name.

    """

    def __init__(self, faults, generator):
        self.counts = Counter(dict.fromkeys(COUNTED, 0))
        self._faults, self._draws = faults, UniformRows(generator, UNIFORMS)
        self._late = []  # a heap: the first that is due comes first
        self._aside = ()  # `Late` copies of a message that lets another one pass
        self._turn = 0

    def is_empty(self):
        """Tell whether all that was heard has come out, or is lost."""
        return not self._late and not self._aside

    def hear(self, message, now):
        """Put a message on the wire, in none, one or two copies; `now` in seconds."""
        drop, reorder, duplicate, *times = self._draws.row()
        self.counts['heard'] += 1
        if drop < self._faults.drop:
            self.counts['dropped'] += 1
            return
        copies = 1 + self._counted('duplicated', duplicate < self._faults.duplicate)
        if not self._aside and self._counted('reordered', reorder < self._faults.reorder):
            self._aside = (self._after(now, self._faults.longest_delay, message),) * copies
            return
        for late, share in (times[:2], times[2:])[:copies]:
            is_late = self._counted('delayed', late < self._faults.delay)
            heappush(self._late, self._after(
                now, share * self._faults.longest_delay if is_late else 0.0, message))

    def due(self, now):
        """Take off the wire, and return, the messages whose time has come, first to last."""
        msg = []
        while self._late and self._late[0].time <= now:
            first = heappop(self._late)
            msg.append(first.message)
            if self._aside and first.step_id > self._aside[0].step_id:
                msg += self._take_aside()
        if self._aside and self._aside[0].time <= now:
            msg += self._take_aside()
        self.counts['relayed'] += len(msg)
        return msg

    def _after(self, now, delay, message):
        self._turn += 1
        return Late(now + delay, self._turn, message)

    def _take_aside(self):
        aside, self._aside = self._aside, ()
        return [late.message for late in aside]

    def _counted(self, name, happens):
        self.counts[name] += happens
        return happens


def fault_streams(seed, count):
    """Return generators for the topics, independent, also of the world's and the learner's."""
    children = np.random.SeedSequence(seed).spawn(2 + count)[2:]
    return [np.random.Generator(np.random.PCG64(child)) for child in children]
