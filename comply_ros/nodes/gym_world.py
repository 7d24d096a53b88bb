# SPDX-License-Identifier: Apache-2.0
"""The node `gym_world`: a world that is moved by an environment of Gymnasium."""

from importlib import import_module
from typing import Any

from comply_ros.nodes.grid_world import check_rate, GridWorldNode, MadeWorld
from comply_ros.nodes.parameters import (
    BINS,
    ENV,
    ENV_ARGS,
    IMAGE_RATE,
    LIMITS,
    MODULE,
    ParameterError,
    USE_TABLE,
)
from comply_ros.nodes.picture_publisher import PicturePublisher
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import IMAGE, MessageError
from comply_ros.protocol.messages import Action, Outputs
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.storage.gymnasium_moves import EnvironmentFault
from comply_ros.storage.gymnasium_table import one_line
from comply_ros.storage.gymnasium_world import EnvironmentName, EnvironmentWorld, read_limits
from comply_ros.storage.text_and_yaml_files import load_yaml, YamlError
from comply_ros.world.grid import MapError


class GymWorldNode(GridWorldNode):
    """
    Publishes the observations of an environment as states, as `GridWorldNode` does those of a map.

    An exception of the environment ends the node, with exit code 1.
    """

    node_name = 'gym_world'

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        if self._image_rate and self._moves.gives_pictures:
            self._pictures = PicturePublisher(self, self._moves, self._image_rate)
        elif self._image_rate:
            self.get_logger().info('the environment has no render mode rgb_array, so there is no '
                                   f'topic {IMAGE}')

    def make_world(self, seed: int) -> MadeWorld:
        """Declare the parameters of the world and return it. seed: of what is random in it."""
        name, arguments, module, bins, limits, use_table = (
            self.declare(each) for each in (ENV, ENV_ARGS, MODULE, BINS, LIMITS, USE_TABLE))
        if not name:
            raise ParameterError('parameter env must be the name of an environment, such as '
                                 'FrozenLake-v1, got none')
        self._image_rate = self.declare(IMAGE_RATE)
        check_rate(self._image_rate, IMAGE_RATE.name)
        if module:
            import_own(module)
        try:
            pairs = read_limits(limits)
        except MapError as error:
            raise ParameterError(f'parameter {error}') from None
        world = EnvironmentWorld(EnvironmentName(
            name, read_arguments(arguments), tuple(bins), pairs, use_table),
            gives_pictures=bool(self._image_rate))
        self._moves = world.moves(seed)
        return MadeWorld(world.source, name, self._moves, f' {arguments} {list(bins)} {limits}')

    def on_action(self, msg: Action) -> Outputs:
        """Return outputs for an action of the learner."""
        try:
            return self.machine.on_action(msg)
        except EnvironmentFault as fault:
            self.mistake = fault
            return ()


def import_own(module: str) -> None:
    """
    Import a module that registers environments.

    Raises
    ------
    ParameterError: if that fails, saying why.

    """
    try:
        import_module(module)
    except Exception as error:  # noqa: BLE001 - its author raises what they like
        raise ParameterError(f'parameter module must be a module that can be imported, got '
                             f'{module!r} ({one_line(error)})') from None


def read_arguments(text: str) -> dict[str, Any]:
    """
    Return the arguments of an environment from YAML.

    Raises
    ------
    ParameterError: unless it is a table whose keys are names.

    """
    try:
        arguments = load_yaml(text).value if text.strip() else {}
    except YamlError as error:
        raise ParameterError(error.about('parameter env_args')) from None
    if not isinstance(arguments, dict) or not all(
            isinstance(key, str) and key.isidentifier() for key in arguments):
        raise ParameterError("parameter env_args must be a table such as '{is_slippery: false}', "
                             f'got {text!r:.80}')
    return arguments


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(GymWorldNode, argv, (
        ParameterError, MapError, MessageError, StateError, EnvironmentFault))
