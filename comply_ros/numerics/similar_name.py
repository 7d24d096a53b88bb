# SPDX-License-Identifier: Apache-2.0
"""The name that was meant by a misspelt one, for errors and warnings."""

from collections.abc import Iterable
from difflib import get_close_matches

LIKE = 0.7  # similarity from which a name is a misspelt one: `robot_name` is not `robots`


def similar_name(name: str, known: Iterable[str]) -> str | None:
    """Return the name that resembles a name most; None where none does, or where it is known."""
    names = list(known)
    similar = get_close_matches(name, names, n=1, cutoff=LIKE)
    return similar[0] if similar and name not in names else None


def did_you_mean(name: str, known: Iterable[str], before: str = '', after: str = '') -> str:
    """Return a question for the similar name, between two texts; empty where there is none."""
    similar = similar_name(name, known)
    return '' if similar is None else f'{before}did you mean {similar!r}?{after}'
