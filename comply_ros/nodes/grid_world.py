# SPDX-License-Identifier: Apache-2.0
"""The node that publishes states and rewards."""

from pathlib import Path
import secrets

from rcl_interfaces.msg import SetParametersResult

from comply_ros.core.dialogue import Refused
from comply_ros.core.grid import MapError
from comply_ros.core.world_actor import WorldActor
from comply_ros.nodes.actor_node import ActorNode, run_node
from comply_ros.nodes.parameters import MAP, ParameterError, PROFILE, RATE, SEED, SLOWEST
from comply_ros.nodes.topics import ACTION, EPISODE, STATE, WORLD
from comply_ros.session.maps import read_map

REPEAT = 1.0  # seconds after which an unanswered question is repeated


class GridWorld(ActorNode):
    """Describes the world, asks with a state, and moves by the action that answers."""

    def __init__(self, **kwargs):
        super().__init__('grid_world', **kwargs)
        name, profile, seed = (self.declare(each) for each in (MAP, PROFILE, SEED))
        self.actor = WorldActor(read_map(name, profile), Path(name).stem,
                                run=secrets.randbits(32), seed=seed)
        for topic in (WORLD, STATE, EPISODE):
            self.speaks_on(topic)
        self.listens_to(ACTION, self.hear_action)
        self._held, self._timer = (), None
        self._repeated = None
        self.create_timer(REPEAT, self._repeat)
        check_rate(self.declare(RATE))
        self.add_on_set_parameters_callback(self._check_pace)
        self.add_post_set_parameters_callback(self._pace)
        self._pace([self.get_parameter('rate')])
        self.say((self.actor.description, self.actor.question))

    def hear_action(self, said):
        """Return what follows from an action: at once, or on the next tick of the rate."""
        utterances = self.actor.hear_action(said)
        if self._timer is None or not utterances or isinstance(utterances[0], Refused):
            return utterances
        self._held = utterances
        return ()

    def _check_pace(self, parameters):
        try:
            for parameter in parameters:
                if parameter.name == 'rate':
                    check_rate(parameter.value)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _pace(self, parameters):
        for parameter in parameters:
            if parameter.name == 'rate':
                if self._timer:
                    self.destroy_timer(self._timer)
                rate = parameter.value
                self._timer = self.create_timer(1.0 / rate, self._say_held) if rate else None
                if not rate:
                    self._say_held()

    def _repeat(self):
        """Ask again what was not answered for a while; who has heard it drops it."""
        if self.actor.question is self._repeated and not self._held:
            self.say((self._repeated,))
        self._repeated = self.actor.question

    def _say_held(self):
        held, self._held = self._held, ()
        self.say(held)


def check_rate(rate):
    """
    Return if a rate can be kept.

    Raises
    ------
    ParameterError: if it is so small that a step would take more than a quarter of an hour.

    """
    if 0.0 < rate < SLOWEST:
        raise ParameterError(f'parameter rate must be 0.0 or at least {SLOWEST}, got {rate}')


def main(argv):
    """Run the node; return the exit code."""
    return run_node(GridWorld, argv, (ParameterError, MapError))
