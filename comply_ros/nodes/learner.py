# SPDX-License-Identifier: Apache-2.0
"""The node that learns."""

from dataclasses import replace
import time

from comply_msgs.srv import Save

from comply_ros.core.compliance import confidences
from comply_ros.core.dialogue import Progress, Refused
from comply_ros.core.learner_actor import LearnerActor
from comply_ros.core.method import MethodError
from comply_ros.core.methods import find_method
from comply_ros.core.planning import greedy
from comply_ros.nodes.actor_node import ActorNode, run_node
from comply_ros.nodes.parameters import (
    field_parameters,
    MAP_PERIOD,
    METHOD,
    ParameterError,
    PROFILE,
    REMEMBERS_ADVICE,
    SEED,
)
from comply_ros.nodes.topics import (
    ACTION,
    POLICY,
    Policy,
    PROGRESS,
    RECOMMENDATION,
    SAVE,
    STATE,
    TRUST,
    Trust,
    WORLD,
)
from comply_ros.session.results import save_learning


class Learner(ActorNode):
    """Acts in every state, complying with the mentor as far as it trusts it, and learns."""

    def __init__(self, **kwargs):
        super().__init__('learner', **kwargs)
        name, profile, seed = (self.declare(each) for each in (METHOD, PROFILE, SEED))
        row = find_method(name, profile)
        fields = {each.name: self.declare(each) for each in field_parameters(row)}
        self.actor = LearnerActor(replace(row, **fields), seed, self.declare(REMEMBERS_ADVICE))
        self._map_period, self._map_time = self.declare(MAP_PERIOD), float('-inf')
        for topic in (ACTION, PROGRESS, TRUST, POLICY):
            self.speaks_on(topic)
        self.create_service(Save, SAVE, self.save)
        self.listens_to(WORLD, self.hear_world)
        self.listens_to(STATE, self.hear_state)
        if self.actor.method.needs_mentor():
            self.listens_to(RECOMMENDATION, self.hear_recommendation)

    def hear_world(self, said):
        """Return what is to be said about a world, and about a state that came before it."""
        try:
            return self.actor.hear_world(said)
        except ValueError as error:
            return (Refused('not a world', f'a world must be whole: {error}'),)

    def hear_state(self, said):
        """Return the action in a state, and the maps when an iteration ends."""
        return self._with_maps(self.actor.hear_state(said))

    def hear_recommendation(self, said):
        """Return the action in the state that waited for this advice."""
        return self._with_maps(self.actor.hear_recommendation(said))

    def save(self, request, response):
        """Answer the service: write what was learned, return its digest."""
        if self.actor.memory is None:
            response.message = 'nothing is learned before a world is known'
            return response
        if not request.path:
            response.message = 'the path of the file must be given, got an empty one'
            return response
        try:
            save_learning(request.path, self.actor.method, self.actor.memory,
                          self.actor.advice_heard())
        except OSError as error:
            response.message = f'{request.path}: {error.strerror.lower()}'
            return response
        response.success, response.digest = True, self.actor.memory.digest()
        return response

    def _with_maps(self, utterances):
        """Return the utterances, with maps after a `Progress` if they are due."""
        if not utterances or type(utterances[-1]) is not Progress:
            return utterances
        progress = utterances[-1]
        if progress.finished:
            self.get_logger().info(f'finished {progress.iterations} iterations, '
                                   f'digest {self.actor.memory.digest()}')
        elif time.monotonic() - self._map_time < self._map_period:
            return utterances
        self._map_time = time.monotonic()
        return (*utterances, *self._maps(progress.run))

    def _maps(self, run):
        world, memory = self.actor.world, self.actor.memory
        shape = run, world.grid.width, world.grid.height
        trust = confidences(self.actor.method, memory, self.actor.advice_heard())
        return (Trust(*shape, trust),
                Policy(*shape, greedy(memory.q, world.free).tolist()))


def main(argv):
    """Run the node; return the exit code."""
    return run_node(Learner, argv, (ParameterError, MethodError))
