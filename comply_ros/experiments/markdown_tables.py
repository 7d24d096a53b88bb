# SPDX-License-Identifier: Apache-2.0
"""Rows of tables in Markdown, and numbers as the pages of results write them."""

from collections.abc import Iterator, Mapping


def head(*names: str) -> Iterator[str]:
    """Yield the two lines with which a table begins."""
    yield line(*names)
    yield line(*['---'] * len(names))


def line(*words: str) -> str:
    """Return a row of a table."""
    return '| ' + ' | '.join(words) + ' |'


def interval_text(value: Mapping[str, float] | None, digits: int = 0) -> str:
    """Return a mean and half the width of its interval (`mean`, `low`, `high`); `-` for None."""
    if value is None:
        return '-'
    half = (value['high'] - value['low']) / 2
    return f'{unsigned_zero(value["mean"], digits)} ± {half:.{digits}f}'


def unsigned_zero(value: float, digits: int) -> str:
    """Return the text of a number; one that rounds to 0 has no sign."""
    return f'{round(value, digits) + 0.0:.{digits}f}'
