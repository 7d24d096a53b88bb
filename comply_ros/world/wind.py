# SPDX-License-Identifier: Apache-2.0
"""`Wind` of a grid: what carries an agent besides its moves; chances of a map are checked here."""

from collections.abc import Mapping
from typing import NamedTuple

from comply_ros.world.grid import MapError

MOST_WIND = 100  # cells


class Wind(NamedTuple):
    """
    Wind that is added to a move, as strong as in the cell that the move leaves.

    columns: cells upwards, for each column, or None. rows: cells to the right, for each row, the
    top row first, or None. chance: probability that the wind blows. gusts: probabilities that it
    is stronger by so many cells (weaker: below 0), where there is any; else it is as given.
    """

    columns: tuple[int, ...] | None = None
    rows: tuple[int, ...] | None = None
    chance: float = 1.0
    gusts: Mapping[int, float] = {}

    def variants(self) -> list[tuple[float, float, int]]:
        """Return probability, factor (0 for no wind) and change of strength of each variant."""
        as_given = 1.0 - sum(self.gusts.values()) + self.gusts.get(0, 0.0)
        blowing = [(self.chance * chance, 1.0, change)
                   for change, chance in {**self.gusts, 0: as_given}.items()]
        return [each for each in [*blowing, (1.0 - self.chance, 0.0, 0)] if each[0] > 0]

    def check(self, width: int, height: int) -> None:
        """Raise MapError unless this can be the wind of a map of so many cells."""
        if (self.columns is None) == (self.rows is None):
            raise MapError('wind needs either columns or rows, got '
                           + ('none' if self.rows is None else 'both'))
        for name, given, count in (('columns', self.columns, width), ('rows', self.rows, height)):
            if given is not None and len(given) != count:
                raise MapError(f'wind must have one number for each of the {count} {name}, '
                               f'got {len(given)}')
        strongest = max(map(abs, (*(self.columns or ()), *(self.rows or ()), *self.gusts)))
        if strongest > MOST_WIND:
            raise MapError(f'wind may be at most {MOST_WIND} cells, got {strongest}')
        if not 0 <= self.chance <= 1:
            raise MapError(f'the chance of wind must lie in [0, 1], got {self.chance}')
        check_chances('gusts', self.gusts)


def check_chances(name: str, chances: Mapping[int | str, float] | Mapping[int, float]) -> None:
    """Raise MapError unless all chances are in [0, 1], and their sum too; name: of what."""
    for key, chance in chances.items():
        if not 0 <= chance <= 1:
            raise MapError(f'a chance of {name} must lie in [0, 1], got {chance} for {key}')
    if not sum(chances.values()) <= 1 + 1e-9:
        raise MapError(f'the chances of {name} must not exceed 1 in sum, '
                       f'got {sum(chances.values())}')
