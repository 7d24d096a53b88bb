# SPDX-License-Identifier: Apache-2.0
"""The node that learns."""

from array import array
from dataclasses import asdict, replace
import json
from pathlib import Path
import secrets
import time

from comply_msgs.srv import Save
import numpy as np
from rclpy.parameter import Parameter as RosParameter
from std_srvs.srv import Trigger

from comply_ros.learner.confidence import confidence_map
from comply_ros.learner.learner_config import CONFIG_FIELDS, ConfigError
from comply_ros.learner.presets import find_method
from comply_ros.nodes.cost_throttle import CostThrottle
from comply_ros.nodes.parameters import (
    ADVICE_TIMEOUT,
    config_parameters,
    MAP_PERIOD,
    METHOD,
    ParameterError,
    PROFILE,
    REMEMBERS_ADVICE,
    SEED,
)
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.topics import (
    ACTION,
    ANOTHER,
    DESCRIPTION,
    POLICY,
    PROGRESS,
    RECOMMENDATION,
    RESET,
    SAVE,
    STATE,
    TRUST,
    VALUES,
    WORLD,
)
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.messages import (
    AnsweredObservation,
    Ignored,
    LearnerDescription,
    Notice,
    Policy,
    Progress,
    Recommendation,
    Trust,
    Values,
)
from comply_ros.protocol.validation import rejected_description
from comply_ros.storage.run_files import save_learning
from comply_ros.storage.state_store import StateError
from comply_ros.world.planning import greedy, state_values

CHANGES = {*CONFIG_FIELDS, REMEMBERS_ADVICE.name, ADVICE_TIMEOUT.name}  # while it runs


class LearnerNode(ProtocolNode):
    """Acts in every state, complying with the mentor as far as it trusts it, and learns."""

    def __init__(self, **kwargs):
        super().__init__('learner', **kwargs)
        name, profile, seed = (self.declare(each) for each in (METHOD, PROFILE, SEED))
        row = find_method(name, profile)
        fields = {each.name: self.declare(each) for each in config_parameters(row)}
        method, remembers = replace(row, **fields), self.declare(REMEMBERS_ADVICE)
        self._identity = name, seed, remembers
        self.actor = Learner(method, seed, remembers, 1 + secrets.randbelow(2 ** 32 - 1))
        self._map_pauses = CostThrottle(self.declare(MAP_PERIOD))
        self._timeout = self.declare(ADVICE_TIMEOUT)
        self._asked, self._since, self._hears_mentor, self._timer = None, 0.0, False, None
        self._restore({'method': name, **asdict(method), 'seed': seed,
                       'remembers_advice': remembers})
        for topic in (DESCRIPTION, ACTION, PROGRESS, TRUST, POLICY, VALUES):
            self.advertise(topic)
        self.serves(Save, SAVE, self.save)
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.observe)
        self._listen_to_mentor()
        self.on_parameters_set(self._change, self._check_changes)
        self.serves(Trigger, RESET, self.reset)
        self._say_what_was_kept()

    def on_world(self, msg):
        """Return what is to be said about a world, and about a state that came before it."""
        turns = self.actor.turns
        try:
            return self._in_its_world(self.actor.on_world(msg), turns)
        except ValueError as error:
            return (rejected_description(error),)

    def look(self):
        """Return what is to be said if another world is attended to now."""
        turns = self.actor.turns
        return self._in_its_world(super().look(), turns)

    def observe(self, msg):
        """Return the action in a state, and the maps when an iteration ends."""
        return self._with_maps(self.actor.observe(msg))

    def on_recommendation(self, msg):
        """Return the action in the state that waited for this advice."""
        return self._with_maps(self.actor.on_recommendation(msg))

    def reset(self, request, response):
        """Answer the service: forget all that was learned."""
        self.answer(self._with_new_maps(self.actor.reset()))
        self._tell_who_learns()
        response.success, response.message = True, 'nothing is learned'
        return response

    def save(self, request, response):
        """Answer the service: write what was learned, return its digest."""
        if self.actor.memory is None:
            response.message = 'nothing is learned before a world is known'
            return response
        if request.steps not in (0, self.actor.student.steps):
            response.message = (f'{ANOTHER}: one with {request.steps} steps, and this one has '
                                f'{self.actor.student.steps}')
            return response
        if not request.path:
            response.message = 'the path of the file must be given, got an empty one'
            return response
        reason = self._write(request.path)
        if reason:
            path = request.path if request.path.isprintable() else repr(request.path)
            response.message = f'{path}: {reason}'
            return response
        response.success, response.digest = True, self.actor.memory.digest()
        return response

    def _write(self, path):
        """Write what was learned to a file; return why it could not be, or None."""
        try:
            place = Path(path).expanduser()
            if place.exists() and not place.is_file():  # as root, a device would be replaced
                return 'there is something that is not a file'
            save_learning(place, self.actor.method, self.actor.memory, self.actor.advice_heard())
        except OSError as error:
            return error.strerror.lower()
        except ValueError:  # a NUL, or half of a character
            return 'no file can have this name'
        except RuntimeError:  # ~USER/
            return 'no such user'
        return None

    def words(self):
        """How it is while all is well."""
        return 'has finished' if self.actor.finished else 'runs'

    def _restore(self, identity):
        """Go on from what was kept, if anything was."""
        kept = self.store.load(identity, (AnsweredObservation, Recommendation))
        if kept:
            self.actor.restore(*kept)
            self.set_parameters([RosParameter(name, value=value)
                                 for name, value in self.actor.changed.items()])
            self._timeout = self.get_parameter(ADVICE_TIMEOUT.name).value
            self.get_logger().info(
                f'goes on after {self.actor.student.steps} steps ({len(kept[2])} records read '
                'again from its journal)')
        self._home = self.actor.described.sha256 if kept else None

    def _say_what_was_kept(self):
        if self._home is None:
            return
        self.say(self.actor.recall())
        self.say(self._maps(self.actor.described.run))
        if self.actor.finished:
            self._tell_finished()

    def _listen_to_mentor(self):
        """Hear the mentor, and wait for it only so long, if it is needed; both can change."""
        if self.actor.method.needs_mentor() and not self._hears_mentor:
            self._hears_mentor = True
            self.subscribe(RECOMMENDATION, self.on_recommendation)
        if self._timer:
            self.destroy_timer(self._timer)
        self._timer = self.create_timer(min(0.1, self._timeout / 5.0), self._stop_waiting) \
            if self._timeout else None

    def _check_changes(self, values):
        """Return if parameters may be changed so; raises ValueError."""
        changes = {name: value for name, value in values.items() if name in CHANGES}
        self.actor.changed_method(changes)
        if changes and self.store.error:
            raise ParameterError(f'a change must be kept before it counts, and this node '
                                 f'{self.store.error}')

    def _change(self, values):
        """Go on by other settings, kept before they count."""
        changes = {name: value for name, value in values.items() if name in CHANGES}
        if changes:
            self._timeout = changes.get(ADVICE_TIMEOUT.name, self._timeout)
            self.answer(self._with_new_maps(self.actor.change(changes)))
            self._tell_who_learns()
            self._listen_to_mentor()

    def _tell_who_learns(self):
        """Say by what settings it goes on from here, for who records it."""
        if self.actor.described:
            self.say((self._describe(self.actor.turns),))

    def _with_new_maps(self, outputs):
        """Return the utterances, with maps if there is something to say."""
        return (*outputs, *self._maps(self.actor.described.run)) if outputs else ()

    def _in_its_world(self, outputs, turns):
        """
        Return the utterances, and who learns before the first answer in a run.

        Where a state is kept of another world, return none, and end.
        turns: questions that were answered before.
        """
        described = self.actor.described
        if outputs and type(outputs[0]) is Notice:
            outputs = (outputs[0], self._describe(turns), *outputs[1:])
        if self.store.store is None or described is None:
            return outputs
        if self._home not in (None, described.sha256):
            self.mistake = StateError(
                f'state_dir keeps what was learned in another world than {described.name!r}, '
                f'which is here now: give another state_dir to begin anew')
            return ()
        self._home = described.sha256
        return outputs

    def _stop_waiting(self):
        """Go on without advice where the mentor has been silent for too long."""
        now, asked = time.monotonic(), self.actor.asked
        if asked is not self._asked or asked is None or self.paused:
            self._asked, self._since = asked, now
        elif now - self._since >= self._timeout:
            self.answer((Ignored('no advice in time', f'no recommendation came within '
                                 f'{self._timeout} s: goes on as without advice'),
                         *self._with_maps(self.actor.go_without_advice())))

    def _tell_finished(self):
        self.get_logger().info(f'finished {self.actor.method.iterations} iterations, '
                               f'digest {self.actor.memory.digest()}')

    def _with_maps(self, outputs):
        """Return the utterances, with maps after a `Progress` if they are due."""
        if not outputs or type(outputs[-1]) is not Progress:
            return outputs
        progress = outputs[-1]
        if progress.finished:
            self._tell_finished()
        elif not self._map_pauses.is_due():
            return outputs
        return (*outputs, *self._maps(progress.run))

    def say(self, outputs):
        """Publish, or log, each of the tuples; what maps cost puts the next ones off."""
        if outputs and type(outputs[-1]) is Policy:
            self._map_pauses.go_on(super().say, outputs)
        else:
            super().say(outputs)

    def _maps(self, run):
        """Return what is said on `trust` and `policy`."""
        return self._map_pauses.start(self._make_maps, run)

    def _make_maps(self, run):
        world, memory = self.actor.world, self.actor.memory
        shape = run, world.grid.width, world.grid.height
        trust = confidence_map(self.actor.method, memory, self.actor.advice_heard())
        return (Trust(*shape, array('f', trust.astype(np.float32).tobytes())),
                Policy(*shape, array('b', greedy(memory.q, world.free).tobytes())),
                Values(*shape, array('d', state_values(memory.q, world.free).tobytes())),
                self._describe(self.actor.turns, memory.digest()))

    def _describe(self, turns, digest=''):
        """Who learns, after so many answers, to this digest."""
        name, seed, remembers = self._identity
        remembers = self.actor.changed.get(REMEMBERS_ADVICE.name, remembers)
        return LearnerDescription(
            self.actor.described.run, self.actor.number, turns, name,
            json.dumps(asdict(self.actor.method)), seed, remembers, digest)


def main(argv):
    """Run the node; return the exit code."""
    return run_node(LearnerNode, argv, (ParameterError, ConfigError, StateError))
