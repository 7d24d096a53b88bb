# SPDX-License-Identifier: Apache-2.0
"""How a mentor is written: `snapshot:0.75`, `noisy:0.3@0.5`, `file:PATH`, ..."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from comply_ros.numerics.number_text import NUMBER, NumberError, read_number

# How a mentor of each kind is written.
KINDS = {
    'optimal': 'optimal', 'random': 'random', 'adversarial': 'adversarial', 'noisy': 'noisy:P',
    'snapshot': 'snapshot:Q', 'file': 'file:PATH', 'learned': 'learned:FILE.npz',
    'learner': 'learner:/NAMESPACE', 'none': 'none'}
EXAMPLES = {'noisy': 'noisy:0.3', 'snapshot': 'snapshot:0.75', 'file': 'file:mentor.txt',
            'learned': 'learned:learning.npz', 'learner': 'learner:/robot_2'}
FROM_FILES = ('file', 'learned')  # kinds that are written with a path
LEARNER = 'learner'  # kind of a mentor that follows a running learner, which only a node can
SEVERAL = 'several'  # kind of several mentors together
NAMESPACE = re.compile(r'/|(/[A-Za-z_][A-Za-z0-9_]*)+')


class MentorError(ValueError):
    """A mentor that cannot be; the message names the value and the rule."""


class MentorSpec(NamedTuple):
    """
    What `kind:value@coverage` says.

    Attributes
    ----------
    value: number, path or namespace, None for kinds without one; of SEVERAL, the specs by name.
    coverage: share of the states in which it has advice.

    """

    kind: str
    value: Any = None
    coverage: float = 1.0

    def by_name(self) -> dict[str, MentorSpec]:
        """Return the mentors by their names; a single one has the name ''."""
        return self.value if self.kind == SEVERAL else {'': self}


def parse_mentor_spec(text: str) -> MentorSpec:
    """
    `MentorSpec` of a mentor as it is written: `noisy:0.2`, `snapshot:0.75@0.2`, `file:PATH`.

    Raises
    ------
    MentorError: for an unknown kind, a missing value or one out of its range.

    """
    written, at, coverage = text.rpartition('@')
    if not at or written.partition(':')[0] in FROM_FILES and not NUMBER.fullmatch(coverage):
        return _parse_kind(text)
    share = _parse_share('the coverage of MENTOR@COVERAGE', coverage)
    return _parse_kind(written)._replace(coverage=share)


def _parse_kind(text: str) -> MentorSpec:
    """`MentorSpec` of what stands before an @."""
    kind, colon, value = text.partition(':')
    if kind not in KINDS:
        raise MentorError(f'a mentor must be one of {", ".join(KINDS.values())}, got {text!r}')
    wanted = KINDS[kind].partition(':')[2]
    if bool(wanted) != bool(value) or bool(colon) != bool(wanted):
        example = f', such as {EXAMPLES[kind]}' if wanted else ''
        raise MentorError(f'this mentor is written {KINDS[kind]}{example}, got {text!r}')
    if wanted in ('P', 'Q'):
        return MentorSpec(kind, _parse_share(f'the {wanted} of {KINDS[kind]}', value))
    if kind == LEARNER and not NAMESPACE.fullmatch(value):
        raise MentorError(f'the NAMESPACE of {KINDS[kind]} must be that of another learner, such '
                          f'as /robot_2, got {value!r}')
    return MentorSpec(kind, value or None)


def _parse_share(name: str, text: str) -> float:
    try:
        share = float(read_number(text))
    except NumberError:
        raise MentorError(f'{name} must be a number, got {text!r}') from None
    if not 0 <= share <= 1:
        raise MentorError(f'{name} must lie in [0, 1], got {text!r}')
    return share
