# SPDX-License-Identifier: Apache-2.0
"""All combinations of the values of a sweep, each with a number; they are not kept in memory."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

from comply_ros.experiments.training_runs import Run


@dataclass(frozen=True)
class Sweep:
    """
    Runs with the numbers from 0 to `len(sweep) - 1`.

    axes: `{field: values}`, fields of `Run` and of the method. The last one varies fastest, and
        the values of a field differ from each other.
    """

    axes: dict[str, tuple]

    def __len__(self) -> int:
        return prod(len(values) for values in self.axes.values())

    def values_of(self, number: int) -> dict[str, Any]:
        """Return `{field: value}` of a run."""
        chosen = {}
        for name, values in reversed(self.axes.items()):
            number, place = divmod(number, len(values))
            chosen[name] = values[place]
        return {name: chosen[name] for name in self.axes}

    def run(self, number: int) -> Run:
        """Return the run with a number."""
        values = self.values_of(number)
        settings = tuple((name, values.pop(name)) for name in self.axes if name not in Run._fields)
        return Run(**values, settings=settings)

    def number_of(self, texts: Mapping[str, str]) -> int | None:
        """Return the number of the run whose values are written like this, None without one."""
        number = 0
        for name, places in self._places.items():
            if texts[name] not in places:
                return None
            number = number * len(places) + places[texts[name]]
        return number

    @cached_property
    def _places(self) -> dict[str, dict[str, int]]:
        return {name: {str(value): place for place, value in enumerate(values)}
                for name, values in self.axes.items()}
