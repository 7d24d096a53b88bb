# SPDX-License-Identifier: Apache-2.0
"""How several mentors are told apart: a color of their own, and a place in each cell."""

from math import ceil, sqrt
from typing import NamedTuple

# None looks like a confidence (red, amber, green), the learner (blue) or the robot (purple).
MENTOR_COLORS = ('#EE7733', '#009BB5', '#CC3388', '#8C6D1F', '#6A7F10', '#885533', '#557788',
                 '#D1495B')
NO_NAME = 'without a name'
FAINTEST = 0.25  # opacity of advice without any confidence in it


class Spot(NamedTuple):
    """
    The part of a cell that one of several mentors has.

    Attributes
    ----------
    right, up: of its middle from that of the cell, in sides of a cell.
    size: its side, in the same unit.

    """

    right: float
    up: float
    size: float


def mentor_color(m: int) -> str:
    """Color of mentor m as `#rrggbb`; with more than there are colors, some have the same."""
    return MENTOR_COLORS[m % len(MENTOR_COLORS)]


def mentor_spots(count: int) -> list[Spot]:
    """Return the spots of so many mentors: row by row from the upper left, none over another."""
    columns = ceil(sqrt(count))
    rows = ceil(count / columns)
    size = 1.0 / columns
    return [Spot((m % columns + 0.5) * size - 0.5, ((rows - 1) / 2 - m // columns) * size, size)
            for m in range(count)]


def legend_text(name: str, confidence: float | None) -> str:
    """Text of a mentor, and of the confidence in it in the last iteration."""
    known = confidence is not None and confidence == confidence
    return f'{name or NO_NAME} ' + (f'{confidence:.2f}' if known else '-')


def opacity(confidence: float) -> float:
    """Opacity of the advice of one of several mentors in which there is such a confidence."""
    return FAINTEST + (1.0 - FAINTEST) * confidence
