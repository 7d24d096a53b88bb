# SPDX-License-Identifier: Apache-2.0
"""The node `mentor`: recommends an action in every state, by a policy made for the world."""

from array import array
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
import hashlib
from typing import Any

from comply_msgs.srv import Recommend

from comply_ros.mentor.advice_budget import UNLIMITED
from comply_ros.mentor.mentor_spec import (
    LEARNER,
    MentorError,
    MentorSpec,
    NAMESPACE,
    parse_mentor_spec,
)
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.mentor.several_mentors import MentorNameError, validate_mentor_names
from comply_ros.nodes.background_thread import in_background
from comply_ros.nodes.clocks import steady_timer
from comply_ros.nodes.parameters import (
    ADVISING,
    BUDGET,
    MENTOR,
    MENTOR_NAME,
    MENTOR_SEED,
    ParameterError,
    ROBOTS,
)
from comply_ros.nodes.protocol_node import map_text, ProtocolNode
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import (
    ACTION,
    MENTOR_POLICY,
    name_of_mentor,
    POLICY,
    RECOMMEND,
    RECOMMENDATION,
    STATE,
    topic_of_mentor,
    WORLD,
)
from comply_ros.protocol.learner_as_mentor import LearnerMentor
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.message_validation import rejected_description
from comply_ros.protocol.messages import (
    Outputs,
    Policy,
    ReceivedAction,
    StateReward,
    WorldDescription,
)
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.storage.mentor_cache import is_slow, mentor_policy, read_mentor_spec
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World
from comply_ros.world.planning import PlanningError

POLL = 0.02  # seconds between checks of a policy that is being made


class PoliciesInMaking:
    """Makes a policy in the background, once for all the mentors of this process and a world."""

    def __init__(self) -> None:
        self._world: World | None = None
        self._made: Future[Any] = Future()

    def policy(self, spec: MentorSpec, world: World, seed: int) -> Future[Any]:
        """Return the `Future` of the policy of a mentor; all have the same spec and seed."""
        if self._world is None or self._world.source != world.source:
            self._world, self._made = world, in_background(mentor_policy, spec, world, seed)
        return self._made


class MentorNode(ProtocolNode):
    """
    Makes a policy in the background for each new world, then answers observations by it.

    One that follows another learner has the policies that this publishes.

    policies: of the mentors of this process.
    """

    def __init__(self, policies: PoliciesInMaking | None = None, **kwargs: Any) -> None:
        super().__init__('mentor', **kwargs)
        self.robots = [each for each in self.declare(ROBOTS) if each]
        self._policies = policies or PoliciesInMaking()
        self._mentor, self._seed = self.declare(MENTOR), self.declare(MENTOR_SEED)
        self._spec = followed_learner(self._mentor) or read_mentor_spec(self._mentor)
        self.machine = self._make_machine(self.declare(BUDGET), self.declare(ADVISING),
                                          declare_name(self))
        self._made: Future[Any] = Future()
        self._poll: Any = None
        self._published_run: int | None = None  # the run that `mentor_policy` was published for
        advertise_mentor(self)
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.machine.observe)
        if self.machine.watches:
            self.subscribe(ACTION, self.machine.on_action)
        if self._spec.kind == LEARNER:
            self._follow_learner(self._spec.value)

    def _make_machine(self, budget: int, mode: str, name: str) -> Mentor:
        if self._spec.kind != LEARNER:
            return Mentor(budget, mode, name)
        if budget != UNLIMITED:
            raise MentorError('a mentor that follows a running learner must have no budget, got '
                              f'budget {budget}')
        return LearnerMentor(self._spec.value, self._spec.coverage, self._seed, name)

    def _follow_learner(self, namespace: str) -> None:
        """Receive the world and the policies of the learner of another namespace."""
        for topic, receive in ((WORLD, self.machine.on_learner_world),
                               (POLICY, self.machine.on_learner_policy)):
            other = topic._replace(name=f'{namespace.rstrip("/")}/{topic.name}')
            if self.resolve_topic_name(topic.name) == other.name:
                raise MentorError('a mentor must follow another learner than the one that it '
                                  f'teaches, got learner:{namespace}')
            self.subscribe(other, partial(self._on_learner, receive))

    def _on_learner(self, receive: Callable[[Any], Outputs], msg: Any) -> Outputs:
        """Return outputs for a message of the other learner, with the policy if it has changed."""
        before = self.machine.current_policy
        try:
            outputs = receive(msg)
        except ValueError as error:
            return (rejected_description(error),)
        if self.machine.current_policy is before:
            return outputs
        return (policy_message(self.machine), *outputs)

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return outputs for a world; start to make a policy for a new one."""
        try:
            return self._with_policy(self.machine.on_world(msg))
        except ValueError as error:
            return (rejected_description(error),)

    def tick(self) -> Outputs:
        """Return the outputs that are due once a second."""
        return self._with_policy(super().tick())

    def _with_policy(self, outputs: Outputs) -> Outputs:
        """Return the outputs, and the whole policy if there is a new run."""
        description = self.machine.tracker.description
        if description is None or description.run == self._published_run:
            return outputs
        self._published_run = description.run
        if self.machine.policy is None:
            self._make_policy()
            return outputs
        return (policy_message(self.machine), *outputs, *self.machine.release_held())

    def _make_policy(self) -> None:
        """Start to make a policy in the background for the world of this run."""
        world = self.machine.world
        if is_slow(self._spec, world, self._seed):
            self.get_logger().info('generates this mentor; it is in the cache at the next start')
        self._made = self._policies.policy(self._spec, world, self._seed)
        if self._poll is None:
            self._poll = steady_timer(self, POLL, self._use_policy)

    def _use_policy(self) -> None:
        """
        Use the policy as soon as it is made, once: a second time would renew the budget.

        The executor may still call this for the timer after that was destroyed, if it was late.
        """
        if self._poll is None or not self._made.done():
            return
        self.destroy_timer(self._poll)
        self._poll, self.mistake = None, self._made.exception()
        if self.mistake:
            return
        policy, description = self._made.result(), self.machine.tracker.description
        try:
            saved = self._saved(policy, description) if self.machine.has_budget else None
            outputs = self.machine.use(policy, saved)
        except StateError as error:
            self.mistake = error
            return
        self.get_logger().info(f'advises in world {description.name!r}')
        self.respond((policy_message(self.machine), *outputs))

    def _saved(self, policy: Any, description: WorldDescription) -> Any:
        """Return the saved state of this mentor, None where there is none."""
        return self.checkpointing.load({
            'mentor': self._mentor, 'seed': self._seed,
            'map': map_text(description.name, description.sha256),
            'budget': self.get_parameter('budget').value,
            'advising': self.get_parameter('advising').value,
            'policy': hashlib.sha256(policy.tobytes()).hexdigest()}, (StateReward, ReceivedAction))


def mentors_of_robots() -> list[MentorNode]:
    """
    Return a mentor, and one for each robot of its parameter `robots`.

    All have its name and parameters. Remappings count for the first one only.

    Raises
    ------
    ParameterError: for robots that cannot be.

    """
    policies = PoliciesInMaking()
    first = MentorNode(policies)
    validate_robots(first.robots, first.get_namespace())
    given = list(first._parameter_overrides.values())
    return [first, *(MentorNode(
        policies, namespace=robot, use_global_arguments=False, parameter_overrides=given,
        cli_args=['--ros-args', '-r', f'__node:={first.get_name()}'])
        for robot in first.robots)]


def validate_robots(robots: Sequence[str], own: str) -> None:
    """
    Return if a mentor in the namespace `own` can teach these other robots too.

    Raises
    ------
    ParameterError: otherwise.

    """
    for place, robot in enumerate(robots):
        if not NAMESPACE.fullmatch(robot):
            raise ParameterError('parameter robots must have namespaces such as /robot_2, got '
                                 f'{robot!r}')
        if robot in (own, *robots[:place]):
            raise ParameterError('parameter robots must have each robot once, and not the one in '
                                 f'the namespace of this node, {own}, got {list(robots)}')


def followed_learner(mentor: str) -> MentorSpec | None:
    """Return the spec of a mentor that follows a running learner, None for any other."""
    is_one = mentor.partition(':')[0] == LEARNER
    return parse_mentor_spec(mentor) if is_one else None


def declare_name(node: ProtocolNode) -> str:
    """Declare the parameter `name` of a mentor; return it, or raise MentorNameError."""
    name = node.declare(MENTOR_NAME)
    validate_mentor_names([name])
    return name


def advertise_mentor(node: ProtocolNode) -> None:
    """Make the topics and the service of a mentor, under its name."""
    for topic in (RECOMMENDATION, MENTOR_POLICY):
        node.advertise(topic_of_mentor(topic, node.machine.name))
    node.serve(Recommend, name_of_mentor(RECOMMEND, node.machine.name), recommend(node.machine))


def recommend(machine: Mentor) -> Callable[[Any, Any], Any]:
    """Return the reply of the service: the action for a state, or why there is none."""
    def reply(request: Any, response: Any) -> Any:
        try:
            response.action, response.success = machine.advice(request.state), True
        except ValueError as error:
            response.action, response.success, response.message = NO_ACTION, False, str(error)
        return response
    return reply


def policy_message(machine: Mentor) -> Policy:
    """Return the policy of a mentor that has one, to be published."""
    description = machine.tracker.description
    assert description is not None and machine.policy is not None
    return Policy(description.run, array('h', machine.policy))


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(mentors_of_robots, argv, (
        ParameterError, MentorError, MentorNameError, PolicyError, PlanningError, StateError))
