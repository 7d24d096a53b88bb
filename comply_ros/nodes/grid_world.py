# SPDX-License-Identifier: Apache-2.0
"""The node `grid_world`: publishes states and rewards, and moves by the learner's actions."""

import secrets
import time
from typing import Any, NamedTuple

from std_srvs.srv import SetBool, Trigger

from comply_ros.nodes.clocks import PaceTimer, steady_timer
from comply_ros.nodes.parameters import MAP, ParameterError, PROFILE, RATE, SEED, SLOWEST
from comply_ros.nodes.protocol_node import map_text, ProtocolNode
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import (
    ACTION,
    check_description_size,
    description_size,
    EPISODE,
    MessageError,
    PAUSE,
    RESET,
    STATE,
    STEP,
    WORLD,
)
from comply_ros.protocol.message_validation import rejected_description
from comply_ros.protocol.messages import (
    Action,
    Outputs,
    ReceivedAction,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.repeated_observation import FIRST_PAUSE, RepeatedObservation
from comply_ros.protocol.world import WorldMachine
from comply_ros.protocol.world_moves import Moves
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.storage.map_files import read_map
from comply_ros.storage.map_name import map_title
from comply_ros.world.grid import default_step_limit, MapError
from comply_ros.world.mdp import Source


class MadeWorld(NamedTuple):
    """
    What a world node publishes.

    Attributes
    ----------
    source: the world.
    name: of it.
    moves: how it moves; None: by its model.
    details: what a checkpoint must agree with, besides the name and the hash.

    """

    source: Source
    name: str
    moves: Moves | None = None
    details: str = ''


class GridWorldNode(ProtocolNode):
    """Publishes the description of the world, then one observation for each action."""

    node_name = 'grid_world'

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(self.node_name, **kwargs)
        seed = self.declare(SEED)
        made = self.make_world(seed)
        source = made.source
        self.machine = WorldMachine(source, made.name, new_run(), seed, time.time_ns(), made.moves)
        if source.step_limit == default_step_limit(self.machine.description.states):
            self.get_logger().info(f'episodes end after {source.step_limit} steps at the latest, '
                                   'ten times the number of states')
        check_description_size(description_size(self.machine.description))
        self._started = time.monotonic()
        saved = self.checkpointing.load(
            {'map': map_text(made.name + made.details, source.sha256), 'seed': seed},
            (ReceivedAction,))
        if saved:
            self.machine.load_state_dict(*saved)
            self.get_logger().info(f'continues at step id {step_id(self.machine.observation)}')
        for topic in (WORLD, STATE, EPISODE):
            self.advertise(topic)
        self.subscribe(ACTION, self.on_action)
        self.subscribe(WORLD, self.on_world, also_blocked=True)
        self.serve(SetBool, PAUSE, self.pause)
        self.serve(Trigger, STEP, self.step)
        self.serve(Trigger, RESET, self.reset)
        self._pace_timer: PaceTimer | None = None
        self._unanswered = RepeatedObservation()
        steady_timer(self, FIRST_PAUSE, self._repeat)
        rate = self.declare(RATE)
        check_rate(rate)
        self.on_parameters_set(
            self._set_rate, lambda values: check_rate(values.get('rate', rate)))
        self._set_rate({'rate': rate})
        self.respond(self.machine.last_outputs())

    def make_world(self, seed: int) -> MadeWorld:
        """Declare the parameters of the world and return it. seed: of what is random in it."""
        name, profile = self.declare(MAP), self.declare(PROFILE)
        return MadeWorld(read_map(name, profile), map_title(name))

    def on_action(self, msg: Action) -> Outputs:
        """Return outputs for an action of the learner."""
        return self.machine.on_action(msg)

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return outputs for another world on the same topics."""
        try:
            return self.machine.on_world(msg, time.monotonic() - self._started)
        except ValueError as error:
            return (rejected_description(error),)

    def tick(self) -> Outputs:
        """Return nothing: this node repeats its observation by a timer of its own."""
        return ()

    def pause(self, request: Any, response: Any) -> Any:
        """Serve `~/pause`: hold the observations, or continue."""
        self.respond(self.machine.pause_gate.pause(request.data))
        response.success, response.message = True, self.status_text()
        return response

    def step(self, request: Any, response: Any) -> Any:
        """Serve `~/step`: publish one observation while paused."""
        if not self.machine.pause_gate.paused:
            response.message = f'a step needs a paused world, and this one {self.status_text()}'
            return response
        self.respond(self.machine.pause_gate.step())
        response.success, response.message = True, 'one step'
        return response

    def reset(self, request: Any, response: Any) -> Any:
        """Serve `~/reset`: start a new run."""
        self.respond(self.machine.reset(new_run(), time.time_ns()))
        response.success, response.message = True, f'run {self.machine.description.run}'
        return response

    def own_run(self) -> int:
        """Return the run of this world."""
        return self.machine.description.run

    def status_text(self) -> str:
        """Text of what the node does while all is well."""
        return 'is paused' if self.machine.pause_gate.paused else 'runs'

    def _set_rate(self, values: dict[str, Any]) -> None:
        if 'rate' not in values:
            return
        if self._pace_timer:
            self._pace_timer.destroy()
        rate, gate = values['rate'], self.machine.pause_gate
        self._pace_timer = PaceTimer(
            self, 1.0 / rate, lambda: self.respond(gate.tick())) if rate else None
        self.respond(gate.pace(bool(rate)))

    def _repeat(self) -> None:
        """Repeat an unanswered observation, with growing pauses."""
        now, machine, unanswered = time.monotonic(), self.machine, self._unanswered
        is_held = machine.pause_gate.held or self.blocked
        if unanswered.is_due(now, step_id(machine.observation), machine.learner_messages, is_held):
            learner = machine.observation.learner
            self.publish(machine.repeat(unanswered.silence(now)))
            unanswered.repeated(now, learner != machine.observation.learner)


def new_run() -> int:
    """Return a number that no other run has, except by chance."""
    return 1 + secrets.randbelow(2 ** 32 - 1)


def check_rate(rate: float, name: str = RATE.name) -> None:
    """
    Return if a world can have this rate. name: of the parameter.

    Raises
    ------
    ParameterError: if it is nan, or so small that a step would take more than a quarter of an
        hour.

    """
    if rate != 0.0 and not rate >= SLOWEST:  # nor is nan a rate
        raise ParameterError(f'parameter {name} must be 0.0 or at least {SLOWEST}, got {rate}')


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(GridWorldNode, argv, (ParameterError, MapError, MessageError, StateError))
