# SPDX-License-Identifier: Apache-2.0
"""The maps as environments of Gymnasium: `gymnasium.make('comply_ros/Maze-v0')`."""

from importlib.resources import files
from pathlib import Path

ENVIRONMENT = 'comply_ros.experiments.map_environment:MapEnvironment'


def environment_name(map_name: str) -> str:
    """Return what a map is called there: `FourRooms-v0` for `four_rooms`."""
    return ''.join(map(str.capitalize, map_name.split('_'))) + '-v0'


def register_maps() -> None:
    """
    Register every map of the package. Gymnasium calls this when it is imported.

    It loads nothing else: whoever uses Gymnasium for something else should not wait.
    """
    from gymnasium.envs.registration import register
    for entry in files('comply_ros').joinpath('maps').iterdir():
        name = Path(entry.name)
        if name.suffix == '.yaml':
            register(environment_name(name.stem), ENVIRONMENT, kwargs={'map_name': name.stem})
