# SPDX-License-Identifier: Apache-2.0
"""Several mentors of one learner: how they are written, and their names."""

from __future__ import annotations

from collections.abc import Sequence
import re

from comply_ros.mentor.mentor_spec import FROM_FILES, KINDS, MentorError

BETWEEN = ' + '  # two mentors, as they are written
MOST_MENTORS = 16  # of one learner
PERSON = 'person'  # name of the person on the page beside mentors with names, unless it is given
NAME = re.compile(r'[A-Za-z](_?[A-Za-z0-9])*')  # a part of the name of a topic
NAMED = re.compile(r'([^=:@]*)=(.*)', re.DOTALL)


class MentorNameError(MentorError):
    """Names that mentors cannot have; the message names the rule and the value."""


def validate_mentor_names(names: Sequence[str]) -> None:
    """
    Return if the mentors of a learner can have these names; '' is that of one without a name.

    Raises
    ------
    MentorNameError: otherwise.

    """
    if not 1 <= len(names) <= MOST_MENTORS:
        raise MentorNameError(f'a learner must have 1 to {MOST_MENTORS} mentors, got {len(names)}')
    for place, name in enumerate(names):
        if name and not NAME.fullmatch(name):
            raise MentorNameError('the name of a mentor must be a letter, then letters, digits '
                                  f'and single underscores between them, got {name!r}')
        if name in names[:place]:
            raise MentorNameError(f'each mentor must have a name of its own, got {name!r} twice')


def can_be_mentors(names: Sequence[str]) -> bool:
    """Tell whether the mentors of a learner can have these names."""
    try:
        validate_mentor_names(names)
    except MentorNameError:
        return False
    return True


def split_mentors(text: str) -> dict[str, str]:
    """
    Return the mentors in a text such as `optimal + anna=noisy:0.6`, each by its name.

    One without a name in the text has that of its kind and value, such as `noisy_0_6`, and a
    number behind it where that name is taken. A single mentor has the name ''.

    Raises
    ------
    MentorNameError: for names that cannot be.

    """
    parts = _split(text)
    if len(parts) == 1:
        return {'': text}
    given = [NAMED.fullmatch(part) for part in parts]
    taken = [match[1] for match in given if match]
    names, specs = [], []
    for part, match in zip(parts, given):
        name = match[1] if match else _free_name(part, [*taken, *names])
        names.append(name)
        specs.append(match[2] if match else part)
    validate_mentor_names(names)
    return dict(zip(names, specs))


def joined(mentors: str | Sequence[str]) -> str:
    """Return the text of several mentors."""
    return mentors if isinstance(mentors, str) else BETWEEN.join(mentors)


def has_files(text: str) -> bool:
    """Tell whether any of the mentors in a text is from a file."""
    return any(spec.partition(':')[0] in FROM_FILES for spec in split_mentors(text).values())


def free_name(name: str, taken: Sequence[str]) -> str:
    """Return a name, with a number behind it from 2 on where it is taken."""
    free, number = name, 2
    while free in taken:
        free, number = f'{name}_{number}', number + 1
    return free


def _split(text: str) -> list[str]:
    """Return the parts between plus signs; where one is no mentor, it is part of a path."""
    parts: list[str] = []
    for part in text.split(BETWEEN):
        match = NAMED.fullmatch(part)
        kind = (match[2] if match else part).partition(':')[0].partition('@')[0]
        if parts and kind not in KINDS:
            parts[-1] += BETWEEN + part
        else:
            parts.append(part)
    return parts


def _free_name(spec: str, taken: Sequence[str]) -> str:
    """Return a name for a mentor by what it is, which is not taken."""
    kind, _, value = spec.partition(':')
    stem = value.rpartition('/')[2].partition('.txt')[0].partition('.npz')[0]
    words = re.findall('[A-Za-z0-9]+', stem if stem[:1].isalpha() else f'{kind} {stem}')
    return free_name('_'.join(words) or kind, taken)
