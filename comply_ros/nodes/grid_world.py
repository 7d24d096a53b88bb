# SPDX-License-Identifier: Apache-2.0
"""The node that publishes states and rewards."""

from pathlib import Path
import secrets
import time

from std_srvs.srv import SetBool, Trigger

from comply_ros.nodes.parameters import (
    MAP,
    ParameterError,
    PROFILE,
    RATE,
    SEED,
    SLOWEST,
)
from comply_ros.nodes.protocol_node import map_words, ProtocolNode
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import ACTION, EPISODE, PAUSE, RESET, STATE, STEP, WORLD
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.messages import Action, step_id
from comply_ros.protocol.validation import rejected_description
from comply_ros.storage.map_files import read_map
from comply_ros.storage.state_store import StateError
from comply_ros.world.grid import MapError

FIRST_PAUSE, LONGEST_PAUSE = 0.02, 5.0  # seconds before an unanswered question is said again


class GridWorldNode(ProtocolNode):
    """Describes the world, asks with a state, and moves by the action that answers."""

    def __init__(self, **kwargs):
        super().__init__('grid_world', **kwargs)
        name, profile, seed = (self.declare(each) for each in (MAP, PROFILE, SEED))
        grid = read_map(name, profile)
        self.actor = GridWorld(grid, Path(name).stem, new_run(), seed, time.time())
        kept = self.store.load({'map': map_words(Path(name).stem, grid.sha256), 'seed': seed},
                                 (Action,))
        if kept:
            self.actor.restore(*kept)
            self.get_logger().info(f'goes on at turn {step_id(self.actor.question)}')
        for topic in (WORLD, STATE, EPISODE):
            self.advertise(topic)
        self.subscribe(ACTION, self.actor.on_action)
        self.subscribe(WORLD, self.on_world, also_paused=True)
        for kind, service, reply in (SetBool, PAUSE, self.pause), (Trigger, STEP, self.step), \
                (Trigger, RESET, self.reset):
            self.serves(kind, service, reply)
        self._timer, self._open, self._signs, self._since = None, None, 0, 0.0
        self._wait, self._next = FIRST_PAUSE, 0.0
        self.create_timer(FIRST_PAUSE, self._repeat)
        rate = self.declare(RATE)
        check_rate(rate)
        self.on_parameters_set(
            self._pace, lambda values: check_rate(values.get('rate', rate)))
        self._pace({'rate': rate})
        self.answer(self.actor.recall())

    def on_world(self, msg):
        """Return what is to be said about another world on the same topics."""
        try:
            return self.actor.on_world(msg)
        except ValueError as error:
            return (rejected_description(error),)

    def look(self):
        """Return nothing: this node leads, and repeats its question on a clock of its own."""
        return ()

    def pause(self, request, response):
        """Answer the service: ask nothing any more, or go on."""
        self.answer(self.actor.pause_gate.pause(request.data))
        response.success, response.message = True, self.words()
        return response

    def step(self, request, response):
        """Answer the service: let one question be asked and answered, while paused."""
        if not self.actor.pause_gate.paused:
            response.message = f'a step must be from a pause, and this world {self.words()}'
            return response
        self.answer(self.actor.pause_gate.step())
        response.success, response.message = True, 'one question'
        return response

    def reset(self, request, response):
        """Answer the service: begin a new run."""
        self.answer(self.actor.reset(new_run(), time.time()))
        response.success, response.message = True, f'run {self.actor.description.run}'
        return response

    def words(self):
        """How it is while all is well."""
        return 'is paused' if self.actor.pause_gate.paused else 'runs'

    def _pace(self, values):
        if 'rate' not in values:
            return
        rate = values['rate']
        if self._timer:
            self.destroy_timer(self._timer)
        self._timer = self.create_timer(1.0 / rate, self._tick) if rate else None
        self.answer(self.actor.pause_gate.pace(bool(rate)))

    def _repeat(self):
        """Ask again what was not answered, with growing pauses; who has heard it drops it."""
        now, opened, signs = time.monotonic(), step_id(self.actor.question), self.actor.signs
        if opened != self._open or self.actor.pause_gate.held or self.paused:
            self._since, self._wait, self._next = now, FIRST_PAUSE, now + FIRST_PAUSE
        elif signs != self._signs:  # puts nothing off: old actions without end are no answer
            self._since, self._wait = now, FIRST_PAUSE
            self._next = min(self._next, now + FIRST_PAUSE)
        self._open, self._signs = opened, signs
        if now >= self._next:
            learner = self.actor.question.learner
            self.say(self.actor.ask_again(now - self._since))
            released = learner != self.actor.question.learner
            self._wait = FIRST_PAUSE if released else min(2.0 * self._wait, LONGEST_PAUSE)
            self._next = now + self._wait

    def _tick(self):
        self.answer(self.actor.pause_gate.tick())


def new_run():
    """Return a number that no other run has, but by chance."""
    return 1 + secrets.randbelow(2 ** 32 - 1)


def check_rate(rate):
    """
    Return if a rate can be kept.

    Raises
    ------
    ParameterError: if it is nan, or so small that a step would take more than a quarter of an
        hour.

    """
    if rate != 0.0 and not rate >= SLOWEST:  # nor is nan a rate
        raise ParameterError(f'parameter rate must be 0.0 or at least {SLOWEST}, got {rate}')


def main(argv):
    """Run the node; return the exit code."""
    return run_node(GridWorldNode, argv, (ParameterError, MapError, StateError))
