# SPDX-License-Identifier: Apache-2.0
"""Numbers of the observations of an environment of Gymnasium, as states of a world."""

from collections.abc import Callable, Sequence
from math import isfinite, prod
from typing import Any

import numpy as np

from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.grid import MapError
from comply_ros.world.transition_table import MOST_STATES

Limits = Sequence[tuple[float, float]]
BINS = 20  # intervals in each dimension of a Box, where nothing else is said
OUTSIDE = -1  # the number of an observation that does not lie in its space


class StateNumbers:
    """
    Numbers the observations of an environment from 0.

    Parameters
    ----------
    space: Discrete, MultiDiscrete, Box, or a Tuple of such spaces.
    bins: number of intervals in each dimension of a Box; of a Tuple, in those of all its Boxes,
        in order. One number is for all of them.
    limits: (low, high) of the same dimensions; none: those of the space. Values beyond belong to
        the first or last interval.

    Raises
    ------
    MapError: for another space, or bins and limits that do not fit it.

    Attributes
    ----------
    count: number of states.

    """

    def __init__(self, space: Any, bins: Sequence[int] = (BINS,), limits: Limits = ()) -> None:
        dimensions = box_dimensions(space)
        sizes = list(bins) * (dimensions if len(bins) == 1 else 1)
        for name, given in (('bins', sizes), ('limits', limits)):
            if len(given) != dimensions and (given or name == 'bins'):
                raise MapError(f'{name} must have one element for each of the {dimensions} '
                               f'dimensions of the observation space, got {len(given)}')
        if min(sizes, default=1) < 1:
            raise MapError(f'bins must be at least 1, got {min(sizes)}')
        self.count, self._number = _numbering(space, sizes, limits, 0)

    def number(self, observation: Any) -> int:
        """Return the number of the state of an observation; -1 if it is not in its space."""
        return self._number(observation)


Numbering = tuple[int, Callable[[Any], int]]  # how many states, and which one


def box_dimensions(space: Any) -> int:
    """Return the number of dimensions of all Boxes in a space."""
    if type(space).__name__ == 'Tuple':
        return sum(map(box_dimensions, space.spaces))
    return prod(space.shape) if type(space).__name__ == 'Box' else 0


def _numbering(space: Any, sizes: Sequence[int], limits: Limits, first: int) -> Numbering:
    """
    Return how many states a space has, and the function from an observation to its state.

    sizes, limits: of its Boxes, as in `StateNumbers`. first: dimension of the first of them.
    """
    kind = type(space).__name__
    if kind == 'Discrete':
        return _products([int(space.n)], lambda seen: [int(seen) - int(space.start)])
    if kind == 'MultiDiscrete':
        return _multi_discrete(space)
    if kind == 'Box':
        return _boxes(space, sizes, limits, first)
    if kind != 'Tuple':
        raise MapError('the observation space must be Discrete, MultiDiscrete, Box or a Tuple '
                       f'of such spaces, got {shown(space)}')
    parts, begin = list[Numbering](), 0
    for each in space.spaces:
        end = begin + box_dimensions(each)
        parts.append(_numbering(each, sizes[begin:end], limits[begin:end], first + begin))
        begin = end

    def digits(observation: Any) -> list[int]:
        if len(observation) != len(parts):
            return [OUTSIDE] * len(parts)
        return [number(each) for (_, number), each in zip(parts, observation)]
    return _products([count for count, _ in parts], digits)


def _multi_discrete(space: Any) -> Numbering:
    """Give every tuple of whole numbers a number."""
    sizes, start = [int(n) for n in np.ravel(space.nvec)], np.ravel(space.start)

    def digits(observation: Any) -> list[int]:
        seen = np.ravel(observation)
        return (seen - start).tolist() if len(seen) == len(start) else [OUTSIDE] * len(start)
    return _products(sizes, digits)


def _products(sizes: Sequence[int], digits: Callable[[Any], list[int]]) -> Numbering:
    """Give every tuple of digits a number, the last digit fastest."""
    count = prod(sizes)
    if not 1 <= count <= MOST_STATES:
        raise MapError(f'the observation space must have 1 to {MOST_STATES} states, got '
                       + (f'{count}' if count < 10 ** 30 else 'far more') + ': give fewer bins')

    def number(observation: Any) -> int:
        total = 0
        for size, digit in zip(sizes, digits(observation), strict=True):
            if not 0 <= digit < size:
                return OUTSIDE
            total = total * size + digit
        return total
    return count, number


def _boxes(space: Any, sizes: Sequence[int], limits: Limits, first: int) -> Numbering:
    """Give every box that intervals in each dimension make a number."""
    given, limits = limits, limits or list(zip(np.ravel(space.low).tolist(),
                                               np.ravel(space.high).tolist()))
    for k, ((low, high), size) in enumerate(zip(limits, sizes), first):
        if not (low < high and isfinite(high - low) and isfinite(size / (high - low))):
            raise MapError(
                ('limits must be finite' if given else 'the observation space needs finite limits')
                + f' with the lower one first, got {low:g} to {high:g} in dimension {k}'
                + ('' if given else ': give limits'))
    low, high = np.array(limits, dtype=float).reshape(-1, 2).T  # also of no dimension
    scale, last = np.array(sizes) / (high - low), np.array(sizes) - 1

    def digits(observation: Any) -> list[int]:
        seen = np.ravel(observation)
        places = np.floor((seen - low) * scale) if len(seen) == len(low) else np.array([np.nan])
        if np.isnan(places).any():
            return [OUTSIDE] * len(sizes)
        return np.clip(places, 0, last).astype(int).tolist()
    return _products(sizes, digits)
