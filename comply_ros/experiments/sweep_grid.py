# SPDX-License-Identifier: Apache-2.0
"""A sweep: all combinations of what varies, each with a number, and none kept in memory."""

from dataclasses import dataclass
from functools import cached_property
from math import prod

from comply_ros.experiments.training_runs import Run


@dataclass(frozen=True)
class Sweep:
    """
    Runs in the order of their numbers, from 0 to `len(sweep) - 1`.

    Parameters
    ----------
    axes: `{field: values}`; the fields of `Run` and of the method. The last one varies fastest,
        and the values of a field differ from each other.

    """

    axes: dict

    def __len__(self):
        return prod(len(values) for values in self.axes.values())

    @property
    def settings(self):
        """Names of the fields of the method among the axes."""
        return [name for name in self.axes if name not in Run._fields]

    def values_of(self, number):
        """`{field: value}` of a run."""
        chosen = {}
        for name, values in reversed(self.axes.items()):
            number, place = divmod(number, len(values))
            chosen[name] = values[place]
        return {name: chosen[name] for name in self.axes}

    def run(self, number):
        """`Run` with a number."""
        values = self.values_of(number)
        settings = tuple((name, values.pop(name)) for name in self.settings)
        return Run(**values, settings=settings)

    def number_of(self, texts):
        """Return the number of the run whose values are written like this, None without one."""
        number = 0
        for name, places in self._places.items():
            if texts[name] not in places:
                return None
            number = number * len(places) + places[texts[name]]
        return number

    @cached_property
    def _places(self):
        return {name: {str(value): place for place, value in enumerate(values)}
                for name, values in self.axes.items()}
