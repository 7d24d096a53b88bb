# SPDX-License-Identifier: Apache-2.0
"""
The maps as environments of Gymnasium.

Importing this module registers them: `gymnasium.make('comply_ros/Maze-v0')` works from then on.
"""

from gymnasium.envs.registration import register

from comply_ros.storage.map_name import map_names

ENVIRONMENT = 'comply_ros.experiments.map_environment:MapEnvironment'


def environment_name(map_name: str) -> str:
    """Return what a map is called there: `comply_ros/FourRooms-v0` for `four_rooms`."""
    return f'comply_ros/{"".join(map(str.capitalize, map_name.split("_")))}-v0'


for name in map_names():
    register(environment_name(name), ENVIRONMENT, kwargs={'map_name': name})
