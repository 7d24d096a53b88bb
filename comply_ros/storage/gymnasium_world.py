# SPDX-License-Identifier: Apache-2.0
"""The world that an environment of Gymnasium is, and how it is written in the name of a map."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from comply_ros.numerics.number_text import NumberError, read_number
from comply_ros.storage.gymnasium_moves import EnvironmentMoves
from comply_ros.storage.gymnasium_table import (
    close_environment,
    make_environment,
    step_limit_of,
    table_of_environment,
)
from comply_ros.storage.map_name import GYM, parse_map_name
from comply_ros.storage.state_numbers import BINS, Limits, StateNumbers
from comply_ros.storage.text_and_yaml_files import shown
from comply_ros.world.grid import MapError
from comply_ros.world.state_action_spaces import Spaces
from comply_ros.world.transition_table import Table


class EnvironmentName(NamedTuple):
    """
    An environment, and how its observations become states.

    Attributes
    ----------
    name, arguments: as in `make_environment`.
    bins, limits: as in `StateNumbers`.
    use_table: whether the world has the table of the environment, where that has one.

    """

    name: str
    arguments: Mapping[str, Any] = {}
    bins: tuple[int, ...] = (BINS,)
    limits: Limits = ()
    use_table: bool = True


OWN_KEYS = 'bins', 'limits', 'use_table'  # of a name; all others are arguments


def read_environment_name(target: str, arguments: Mapping[str, Any]) -> EnvironmentName:
    """
    Return the environment that the parts of a name of a map say, see `MapName`.

    Raises
    ------
    MapError: for bins, limits or use_table that cannot be.

    """
    own = {key: arguments[key] for key in OWN_KEYS if key in arguments}
    others = {key: value for key, value in arguments.items() if key not in OWN_KEYS}
    use_table = own.get('use_table', True)
    if type(use_table) is not bool:
        raise MapError(f'use_table must be true or false, got {shown(use_table)}')
    return EnvironmentName(target, others, read_bins(own.get('bins', BINS)),
                           read_limits(str(own.get('limits', ''))), use_table)


def read_bins(value: Any) -> tuple[int, ...]:
    """
    Return numbers of intervals from a whole number, a list of such, or text such as `40,40`.

    Raises
    ------
    MapError: for any other value.

    """
    words = value.split(',') if isinstance(value, str) else value
    try:
        bins: list[Any] = [read_number(word) if isinstance(word, str) else word
                           for word in (words if isinstance(words, list) else [words])]
    except NumberError:
        bins = []
    if not bins or any(type(each) is not int for each in bins):
        raise MapError('bins must be a whole number, or one for each dimension, such as 40 or '
                       f'40,40, got {shown(value)}')
    return tuple(bins)


def read_limits(text: str) -> Limits:
    """
    Return (low, high) of each dimension from text such as `-1.2,0.6; -0.07,0.07`.

    Raises
    ------
    MapError: for any other text.

    """
    try:
        pairs = [[float(read_number(word)) for word in part.split(',')]
                 for part in text.split(';')] if text.strip() else []
    except NumberError:
        pairs = [[]]
    if any(len(pair) != 2 for pair in pairs):
        raise MapError("limits must be LOW,HIGH of each dimension, with ';' between two, such as "
                       f"'-1.2,0.6; -0.07,0.07', got {text!r:.80}")
    return tuple((low, high) for low, high in pairs)


class EnvironmentWorld:
    """
    An environment that is made, and the world that it is.

    Parameters
    ----------
    name: of it, with all that decides which world it is.
    gives_pictures: whether it is made so that it gives pictures, where it can.
    requires_table: whether a table that the environment has, and that is no map, is an error; else
        the world is without a model then.

    Raises
    ------
    MapError: if it cannot be made, or be a world; naming the rule and the value.

    Attributes
    ----------
    source: the world.

    """

    source: Table | Spaces

    def __init__(self, name: EnvironmentName, gives_pictures: bool = False,
                 requires_table: bool = False) -> None:
        self._name = name.name
        self._env = make_environment(name.name, name.arguments, gives_pictures)
        try:
            self._numbers = StateNumbers(self._env.observation_space, name.bins, name.limits)
            self.source = environment_source(self._env, self._numbers, name.use_table,
                                             requires_table)
        except MapError as error:
            close_environment(self._env)
            raise MapError(f'environment {shown(name.name)}: {error}') from None

    def moves(self, seed: int) -> EnvironmentMoves:
        """Return what moves the world by this environment; seed: of all its episodes."""
        return EnvironmentMoves(self._env, self._name, self.source, self._numbers, seed)

    def close(self) -> None:
        """Close the environment, which is not used any more."""
        close_environment(self._env)


def environment_source(env: Any, numbers: StateNumbers, use_table: bool = True,
                       requires_table: bool = False) -> Table | Spaces:
    """
    Return the world that an environment is: with a table where it has one, else without a model.

    use_table, requires_table: as in `EnvironmentName` and `EnvironmentWorld`.

    Raises
    ------
    MapError: for actions that are not Discrete, or a table that is no map but is required.

    """
    space = env.action_space
    if type(space).__name__ != 'Discrete':
        raise MapError(f'the action space must be Discrete, got {shown(space)}')
    if use_table and getattr(env.unwrapped, 'P', None) is not None:
        try:
            return table_of_environment(env)
        except MapError as error:
            if requires_table:
                raise MapError(f'{error}; use_table=false makes it a world without a '
                               'model') from None
    return Spaces(numbers.count, tuple(map(str, range(int(space.n)))),
                  step_limit_of(env, numbers.count))


def moves_of_map(map_name: str, seed: int) -> EnvironmentMoves:
    """
    Return what moves the world of a map `gym:NAME`, by an environment of its own.

    Raises
    ------
    MapError: for any other map, and if it cannot be a world.

    """
    scheme, target, arguments = parse_map_name(map_name)
    if scheme != GYM:
        raise MapError('a training needs a world of which is known what every action leads to, or '
                       f'a map gym:NAME, got {shown(map_name)}')
    return EnvironmentWorld(read_environment_name(target, arguments)).moves(seed)
