# SPDX-License-Identifier: Apache-2.0
"""The node that serves recommended actions."""

from array import array
from concurrent.futures import Future
import hashlib
from threading import Thread

from comply_msgs.srv import Recommend

from comply_ros.mentor.mentor_policies import MentorError
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.parameters import (
    ADVISING,
    BUDGET,
    MENTOR,
    MENTOR_SEED,
    ParameterError,
)
from comply_ros.nodes.protocol_node import map_words, ProtocolNode
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import (
    ACTION,
    MENTOR_POLICY,
    RECOMMEND,
    RECOMMENDATION,
    STATE,
    WORLD,
)
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import Action, Policy, StateReward
from comply_ros.protocol.validation import rejected_description
from comply_ros.storage.mentor_cache import is_slow, mentor_policy, read_mentor_spec
from comply_ros.storage.state_store import StateError
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.planning import PlanningError

POLL = 0.02  # seconds between looks at a mentor that is being generated


class MentorNode(ProtocolNode):
    """Recommends an action in every state, by a policy made for the world that is described."""

    def __init__(self, **kwargs):
        super().__init__('mentor', **kwargs)
        self._mentor, self._seed = self.declare(MENTOR), self.declare(MENTOR_SEED)
        self._spec = read_mentor_spec(self._mentor)
        self.actor = Mentor(self.declare(BUDGET), self.declare(ADVISING))
        self._generated, self._poll, self._mapped = None, None, None
        for topic in (RECOMMENDATION, MENTOR_POLICY):
            self.advertise(topic)
        self.serves(Recommend, RECOMMEND, recommends(self.actor))
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.actor.observe)
        if self.actor.watches:
            self.subscribe(ACTION, self.actor.on_action)

    def on_world(self, msg):
        """Return what is to be said about a world; begin to make a policy if one is due."""
        try:
            return self._with_map(self.actor.on_world(msg))
        except ValueError as error:
            return (rejected_description(error),)

    def look(self):
        """Return what is to be said if another world is attended to now."""
        return self._with_map(super().look())

    def _with_map(self, outputs):
        """Return the utterances, with the map of all advice if there is a new run."""
        described = self.actor.described
        if described is None or described.run == self._mapped:
            return outputs
        self._mapped = described.run
        if self.actor.policy is None:
            self._make_policy()
            return outputs
        return (self._map_of_advice(), *outputs, *self.actor.release_held())

    def _make_policy(self):
        """Begin to make a policy in the background for the world that is attended to."""
        if is_slow(self._spec, self.actor.world, self._seed):
            self.get_logger().info('generating this mentor; it is remembered for the next start')
        self._generated = in_background(
            mentor_policy, self._spec, self.actor.world, self._seed)
        if self._poll is None:
            self._poll = self.create_timer(POLL, self._use_what_was_made)

    def _use_what_was_made(self):
        """Use the policy as soon as it is generated."""
        if not self._generated.done():
            return
        self.destroy_timer(self._poll)
        self._poll, self.mistake = None, self._generated.exception()
        if self.mistake:
            return
        policy = self._generated.result()
        try:
            outputs = self.actor.use(policy, self._kept(policy))
        except StateError as error:
            self.mistake = error
            return
        self.get_logger().info(f'advises in world {self.actor.described.name!r}')
        self.answer((self._map_of_advice(), *outputs))

    def _kept(self, policy):
        """Return what was kept of this mentor, None where nothing was or has to be."""
        if not self.actor.remembers:
            return None
        return self.store.load({
            'mentor': self._mentor, 'seed': self._seed,
            'map': map_words(self.actor.described.name, self.actor.described.sha256),
            'budget': self.get_parameter('budget').value,
            'advising': self.get_parameter('advising').value,
            'policy': hashlib.sha256(policy.tobytes()).hexdigest()}, (StateReward, Action))

    def _map_of_advice(self):
        return map_of_advice(self.actor)


def recommends(actor):
    """Return the reply to the service: the action for a state, or why there is none."""
    def reply(request, response):
        try:
            response.action, response.success = actor.advice(request.state), True
        except ValueError as error:
            response.action, response.success, response.message = NO_ACTION, False, str(error)
        return response
    return reply


def map_of_advice(actor):
    """Return the `Policy` of an actor that has one, to be said."""
    world = actor.described
    return Policy(world.run, world.width, world.height, array('b', actor.policy))


def in_background(function, *arguments):
    """Return the `Future` of a call in a thread that does not keep the process alive."""
    future = Future()

    def call():
        try:
            future.set_result(function(*arguments))
        except Exception as error:  # noqa: BLE001 - whoever asks for the result gets it
            future.set_exception(error)
    Thread(target=call, daemon=True).start()
    return future


def main(argv):
    """Run the node; return the exit code."""
    return run_node(MentorNode, argv, (ParameterError, MentorError, PolicyError, PlanningError,
                                   StateError))
