# SPDX-License-Identifier: Apache-2.0
"""The node that publishes states and rewards."""

from pathlib import Path
import secrets
import time

from rcl_interfaces.msg import SetParametersResult

from comply_ros.core.dialogue import Action, Dropped, Refused, turn
from comply_ros.core.grid import MapError
from comply_ros.core.problems import problem_of_description
from comply_ros.core.world_actor import WorldActor
from comply_ros.nodes.actor_node import ActorNode, map_words
from comply_ros.nodes.parameters import MAP, ParameterError, PROFILE, RATE, SEED, SLOWEST
from comply_ros.nodes.running import run_node
from comply_ros.nodes.topics import ACTION, EPISODE, STATE, WORLD
from comply_ros.session.keeping import StateError
from comply_ros.session.maps import read_map

FIRST_PAUSE, LONGEST_PAUSE = 0.02, 5.0  # seconds before an unanswered question is said again


class GridWorld(ActorNode):
    """Describes the world, asks with a state, and moves by the action that answers."""

    def __init__(self, **kwargs):
        super().__init__('grid_world', **kwargs)
        name, profile, seed = (self.declare(each) for each in (MAP, PROFILE, SEED))
        grid = read_map(name, profile)
        self.actor = WorldActor(grid, Path(name).stem, secrets.randbits(32), seed, time.time())
        kept = self.store.recall({'map': map_words(Path(name).stem, grid.sha256), 'seed': seed},
                                 (Action,))
        if kept:
            self.actor.restore(*kept)
            self.get_logger().info(f'goes on at turn {turn(self.actor.question)}')
        for topic in (WORLD, STATE, EPISODE):
            self.speaks_on(topic)
        self.listens_to(ACTION, self.hear_action)
        self.listens_to(WORLD, self.hear_world, also_paused=True)
        self._held, self._timer = (), None
        self._open, self._signs, self._since = None, 0, 0.0
        self._wait, self._next = FIRST_PAUSE, 0.0
        self.create_timer(FIRST_PAUSE, self._repeat)
        check_rate(self.declare(RATE))
        self.add_on_set_parameters_callback(self._check_pace)
        self.add_post_set_parameters_callback(self._pace)
        self._pace([self.get_parameter('rate')])
        self.answer(self.actor.recall())

    def hear_world(self, said):
        """Return what is to be said about another world on the same topics."""
        try:
            return self.actor.hear_world(said)
        except ValueError as error:
            return (problem_of_description(error),)

    def look(self):
        """Return nothing: this node leads, and repeats its question on a clock of its own."""
        return ()

    def hear_action(self, said):
        """Return what follows from an action: at once, or on the next tick of the rate."""
        utterances = self.actor.hear_action(said)
        if self._timer is None or not utterances or type(utterances[0]) in (Refused, Dropped):
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
        """Ask again what was not answered, with growing pauses; who has heard it drops it."""
        now, opened, signs = time.monotonic(), turn(self.actor.question), self.actor.signs
        if opened != self._open or self._held or self.paused:
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

    def _say_held(self):
        held, self._held = self._held, ()
        self.answer(held)


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
    return run_node(GridWorld, argv, (ParameterError, MapError, StateError))
