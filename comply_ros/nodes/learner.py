# SPDX-License-Identifier: Apache-2.0
"""The node `learner`: acts in every state, follows the mentor as far as it trusts it, learns."""

from array import array
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
import json
from pathlib import Path
import secrets
from typing import Any

from comply_msgs.srv import Save
import numpy as np
from rclpy.parameter import Parameter as RosParameter
from std_srvs.srv import Trigger

from comply_ros.learner.learner_config import CONFIG_FIELDS, ConfigError, LearnerConfig
from comply_ros.learner.learner_state import ONE_MENTOR
from comply_ros.learner.learning_result import LearningError
from comply_ros.learner.presets import find_method
from comply_ros.mentor.several_mentors import can_be_mentors, MentorNameError, MOST_MENTORS
from comply_ros.nodes.clocks import PaceClock, PaceTimer
from comply_ros.nodes.parameters import (
    config_parameters,
    END_WHEN_FINISHED,
    INITIAL_LEARNING,
    MAP_PERIOD,
    MENTORS,
    METHOD,
    ParameterError,
    PROFILE,
    REMEMBERS_ADVICE,
    SEED,
)
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.nodes.publish_throttle import CostThrottle
from comply_ros.nodes.spin import run_node
from comply_ros.nodes.step_compiler import StepCompiler
from comply_ros.nodes.timeout_parameters import TimeoutParameters
from comply_ros.nodes.topics import (
    ACTION,
    ANOTHER,
    DESCRIPTION,
    mentors_found,
    name_of_mentor,
    POLICY,
    PROGRESS,
    RECOMMENDATION,
    RESET,
    SAVE,
    STATE,
    topic_of_mentor,
    TRUST,
    VALUES,
    WORLD,
)
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.message_validation import rejected_description
from comply_ros.protocol.messages import (
    Action,
    Ignored,
    LEARNER_JOURNAL,
    LearnerDescription,
    Notice,
    Outputs,
    Policy,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
    Trust,
    Values,
    WorldDescription,
)
from comply_ros.storage.checkpoint_store import StateError
from comply_ros.storage.file_system import path_errors, PathError, printable
from comply_ros.storage.learning_file import read_learning, save_learning
from comply_ros.storage.versions import LATER_FIELDS
from comply_ros.world.planning import state_values

CHANGEABLE = {*CONFIG_FIELDS, REMEMBERS_ADVICE.name}  # while it runs, besides timeouts


class LearnerNode(ProtocolNode):
    """Answers observations with actions, and publishes what it has learned once in a while."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('learner', **kwargs)
        name, profile, seed = (self.declare(each) for each in (METHOD, PROFILE, SEED))
        config = self._declare_config(find_method(name, profile))
        remembers, file = self.declare(REMEMBERS_ADVICE), self.declare(INITIAL_LEARNING)
        initial = read_learning(file) if file else None
        self._identity, mentors = (name, seed, remembers), self.declare(MENTORS)
        self.machine = Learner(config, seed, remembers, 1 + secrets.randbelow(2 ** 32 - 1),
                               initial, mentors)
        self._refused: set[str] = set()  # names of mentors that cannot join
        self._expected, self._waiting_at_tick = mentors, None  # those that it always waits for
        self._map_throttle = CostThrottle(self.declare(MAP_PERIOD))
        self._timeout_parameters = TimeoutParameters(self, mentors)
        self._timeouts = self._timeout_parameters.timeouts()
        self._pace_clock = PaceClock(self)
        self._waiting_since: tuple[StateReward | None, float] = None, 0.0
        self._heard: list[str] = []  # names of the mentors whose topics it subscribes to
        self._ends, self._finished_ticks = self.declare(END_WHEN_FINISHED), 0
        self._timeout_timer: PaceTimer | None = None
        self._step_compiler = StepCompiler(self.get_logger())
        # `learns` first: where it differs, so does the default of `iterations`.
        self._load({'method': name, 'learns': config.learns, **asdict(config), 'seed': seed,
                    'remembers_advice': remembers, 'mentors': mentors})
        for topic in (DESCRIPTION, ACTION, PROGRESS, TRUST, POLICY, VALUES):
            self.advertise(topic)
        self.serve(Save, SAVE, self.save)
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.on_state)
        self._follow_settings()
        self.on_parameters_set(self._change, self._check_changes)
        self.serve(Trigger, RESET, self.reset)
        self._publish_saved()

    def _declare_config(self, preset: LearnerConfig) -> LearnerConfig:
        """Declare the fields of the settings and return them; without learning, without end."""
        parameters = {each.name: each for each in config_parameters(preset)}
        learns = self.declare(parameters.pop('learns'))
        if not learns:
            parameters['iterations'] = parameters['iterations']._replace(default=0)
        return replace(preset, learns=learns, **{name: self.declare(each)
                                                 for name, each in parameters.items()})

    def on_state(self, msg: StateReward) -> Outputs:
        """Return the action in a state, and the maps when an iteration ends."""
        outputs = self.machine.observe(msg)
        if outputs and type(outputs[0]) is Notice and msg.step == 0:  # mentors have joined
            before = self.machine.step_count - (self.machine.waiting is None)
            outputs = (outputs[0], self._describe(before), *outputs[1:])
        return self._with_maps(outputs) if outputs and type(outputs[-1]) is Progress else outputs

    def on_recommendation(self, name: str, msg: Recommendation) -> Outputs:
        """Return the action in the state that waited for this advice of a mentor."""
        machine, mentors = self.machine, self.machine.mentors
        if name not in mentors:  # it joins at the next episode
            return machine.hold_advice(name, msg)
        if name and msg.mentor != name:
            return (Rejected('another mentor', 'a recommendation on '
                             f'{name_of_mentor(RECOMMENDATION.name, name)} must have mentor '
                             f'{name!r}, got {msg.mentor!r}'),)
        return self._with_maps(machine.receivers[mentors.index(name)](msg))

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return outputs for a world, and for a state of it that came before."""
        return self._in_its_world(lambda: self.machine.on_world(msg))

    @property
    def has_ended(self) -> bool:
        """Whether the node has finished, has told so on /diagnostics, and shall end then."""
        return self._ends and self._finished_ticks > 1

    def tick(self) -> Outputs:
        """Return the outputs that are due once a second."""
        self._finished_ticks += self.machine.finished
        if self.machine.config.needs_mentor():
            self._find_mentors()
            self._leave_silent_mentors()
        if self.machine.tracker.world is not None and not self.machine.finished:
            self._step_compiler.tick(self.machine.agent)
        return self._in_its_world(super().tick)

    def _find_mentors(self) -> None:
        """Let mentors that are found join; at the start, in the place of one without a name."""
        found, machine = mentors_found(self), self.machine
        instead = [name for name in found if can_be_mentors([name])][:MOST_MENTORS]
        if machine.mentors == ONE_MENTOR and not machine.step_count and instead \
                and '' not in found:
            machine.replace_mentors(instead)
            self.get_logger().info(f'takes the advice of {", ".join(instead)}')
            self._publish_description()
            self._follow_settings()
        for name in found:
            if name not in self._heard and name not in self._refused:
                try:
                    machine.join(name)
                    self._follow_settings()
                except MentorNameError as error:
                    self._refused.add(name)
                    self.get_logger().warning(f'the mentor {name!r} cannot join: {error}')

    def _leave_silent_mentors(self) -> None:
        """Do not wait for found mentors that were silent for a second, without own timeouts."""
        waiting, before = self.machine.waiting, self._waiting_at_tick
        self._waiting_at_tick = waiting
        missing = self.machine.missing_mentors()
        silent = [name for name in missing if not self._timeouts.has_own(name)]
        if waiting is None or waiting is not before or self.blocked \
                or not silent or {*missing} & {*self._expected}:
            return
        self.respond((Ignored('no advice in time', f'the mentor {", ".join(silent)} does not '
                              'answer: continues without it until it does'),
                      *self._with_maps(self.machine.leave(silent))))

    def reset(self, request: Any, response: Any) -> Any:
        """Serve `~/reset`: forget everything that was learned since the start."""
        self.respond(self._with_new_maps(self.machine.reset()))
        self._publish_description()
        initial = self.machine.agent.initial
        response.success, response.message = True, \
            f'it begins again with {initial.source}' if initial else 'nothing is learned'
        return response

    def save(self, request: Any, response: Any) -> Any:
        """Serve `save`: write what was learned, return its digest."""
        machine = self.machine
        if machine.tracker.world is None:
            response.message = 'nothing is learned before a world is known'
        elif request.steps not in (0, machine.agent.steps):
            response.message = (f'{ANOTHER}: one with {request.steps} steps, and this one has '
                                f'{machine.agent.steps}')
        elif not request.path:
            response.message = 'the path of the file must be given, got an empty one'
        else:
            reason = self._write(request.path)
            if reason is None:
                response.success, response.digest = True, machine.state.digest()
            else:
                response.message = f'{printable(request.path)}: {reason}'
        return response

    def _write(self, path: str) -> str | None:
        """Write what was learned to a file; return why that is impossible, or None."""
        machine = self.machine
        try:
            with path_errors():
                place = Path(path).expanduser()
                if place.exists() and not place.is_file():  # as root, a device would be replaced
                    return 'there is something that is not a file'
                save_learning(place, machine.learned())
        except PathError as error:
            return str(error)
        return None

    def status_text(self) -> str:
        """Text of what the node does while all is well."""
        return 'has finished' if self.machine.finished else 'runs'

    def _load(self, identity: dict[str, Any]) -> None:
        """Continue from the saved state, if there is one."""
        saved, machine = self.checkpointing.load(
            identity, LEARNER_JOURNAL, {**LATER_FIELDS, 'mentors': list(ONE_MENTOR)}), self.machine
        if self.checkpointing.store is None:
            machine.keeps_journal, machine.publish_early = False, self._publish_early
        self._home: str | None = None  # the hash of the world that the state is of
        if saved is None:
            return
        machine.load_state_dict(*saved)
        self._timeout_parameters.declare_named(machine.changes)
        self.set_parameters([RosParameter(name, value=value)
                             for name, value in machine.changes.items()])
        self._home = machine.tracker.description.sha256
        self.get_logger().info(f'continues after {machine.agent.steps} steps '
                               f'({len(saved[2])} entries were in its journal)')
        if machine.agent.initial:
            self.get_logger().info('initial_learning is not used: the checkpoint in state_dir '
                                   'counts more; it is what a reset returns to')

    def _publish_saved(self) -> None:
        if self._home is None:
            return
        self.publish(self.machine.last_outputs())
        self.publish(self._maps())
        if self.machine.finished:
            self._log_finished()

    def _follow_settings(self) -> None:
        """Subscribe to the mentors if they are needed, and use the parameters of all of them."""
        if self.machine.config.needs_mentor():
            for name in self.machine.expected_mentors:
                if name not in self._heard:
                    self._heard.append(name)
                    self.subscribe(topic_of_mentor(RECOMMENDATION, name),
                                   partial(self.on_recommendation, name))
        if self._timeout_timer:
            self._timeout_timer.destroy()
        self._timeout_parameters.declare_for(self.machine.expected_mentors)
        self._timeouts = self._timeout_parameters.timeouts()
        shortest = self._timeouts.shortest()
        self._timeout_timer = PaceTimer(
            self, min(0.1, shortest / 5.0), self._check_timeouts) if shortest else None

    def _changeable(self, values: dict[str, Any]) -> dict[str, Any]:
        """Return those of the parameters that may change while the node runs."""
        return {name: value for name, value in values.items()
                if name in CHANGEABLE or name in self._timeout_parameters}

    def _check_changes(self, values: dict[str, Any]) -> None:
        """Return if parameters may be changed so; raises ValueError."""
        changes = self._changeable(values)
        self.machine.check_changes(changes)
        if changes and self.checkpointing.error:
            raise ParameterError('a change must be saved before it counts, and this node '
                                 f'{self.checkpointing.error}')

    def _change(self, values: dict[str, Any]) -> None:
        """Continue under other settings, which are saved before they count."""
        changes = self._changeable(values)
        if changes:
            self.respond(self._with_new_maps(self.machine.change(changes)))
            self._publish_description()
            self._follow_settings()

    def _publish_description(self) -> None:
        """Publish the settings from here on, for recorded runs."""
        if self.machine.tracker.description:
            self.publish((self._describe(self.machine.step_count),))

    def _with_new_maps(self, outputs: Outputs) -> Outputs:
        return (*outputs, *self._maps()) if outputs else ()

    def _in_its_world(self, follow: Callable[[], Outputs]) -> Outputs:
        """
        Return the outputs, and the description of the learner before the first action of a run.

        Where the saved state or the initial learning is of another world, return none, and end.

        follow: returns the outputs of a state machine that may follow another world.

        """
        step_count = self.machine.step_count
        try:
            outputs = follow()
        except LearningError as error:
            self.mistake = error
            return ()
        except ValueError as error:
            return (rejected_description(error),)
        description = self.machine.tracker.description
        if outputs and type(outputs[0]) is Notice:
            outputs = (outputs[0], self._describe(step_count), *outputs[1:])
        if self.checkpointing.store is None or description is None:
            return outputs
        if self._home not in (None, description.sha256):
            self.mistake = StateError(
                'state_dir has the state of a learner in another world than '
                f'{description.name!r}, which is here now: give another state_dir to start anew')
            return ()
        self._home = description.sha256
        return outputs

    def _check_timeouts(self) -> None:
        """Continue without the advice of mentors that have been silent for too long."""
        waiting, since = self._waiting_since
        now = self._pace_clock.seconds()
        if self.machine.waiting is not waiting or waiting is None or self.blocked:
            self._waiting_since = self.machine.waiting, now
            return
        overdue = self._timeouts.overdue(self.machine.missing_mentors(), now - since)
        if overdue:
            self.respond((self._timeouts.reason(overdue),
                          *self._with_maps(self.machine.leave(overdue))))

    def _log_finished(self) -> None:
        self.get_logger().info(f'finished {self.machine.config.iterations} iterations, '
                               f'digest {self.machine.state.digest()}')

    def _with_maps(self, outputs: Outputs) -> Outputs:
        """Return the outputs, with maps after a `Progress` if they are due."""
        if not outputs or type(outputs[-1]) is not Progress:
            return outputs
        if outputs[-1].finished:
            self._log_finished()
        elif not self._map_throttle.is_due():
            return outputs
        return (*outputs, *self._maps())

    def publish(self, outputs: Outputs) -> None:
        """Publish, or log, each of the outputs; what maps cost puts the next ones off."""
        if len(outputs) > 1 and type(outputs[-1]) is LearnerDescription:
            self._map_throttle.go_on(super().publish, outputs)
        else:
            super().publish(outputs)

    def _publish_early(self, action: Action) -> None:
        if not self.mistake:
            self.publish((action,))

    def _maps(self) -> Outputs:
        """Return what is published on `trust`, `policy` and `values`."""
        return self._map_throttle.start(self._make_maps)

    def _make_maps(self) -> Outputs:
        machine = self.machine
        world, q = machine.tracker.world, machine.state.q
        run, learned = machine.tracker.run, machine.learned()
        confidence = learned.confidence.astype(np.float32).reshape(len(machine.mentors), -1)
        return (*(Trust(run, array('f', row.tobytes()), name)
                  for name, row in zip(machine.mentors, confidence)),
                Policy(run, array('h', learned.policy.astype(np.int16).tobytes())),
                Values(run, array('d', state_values(q, world.free).tobytes())),
                self._describe(machine.step_count, machine.state.digest()))

    def _describe(self, step_count: int, digest: str = '') -> LearnerDescription:
        """Return the description of this learner after so many answers."""
        name, seed, remembers = self._identity
        remembers = self.machine.changes.get(REMEMBERS_ADVICE.name, remembers)
        settings, initial = asdict(self.machine.config), self.machine.agent.initial
        if initial:
            settings[INITIAL_LEARNING.name] = initial.state.digest()
        return LearnerDescription(
            self.machine.tracker.run, self.machine.number, step_count, name,
            json.dumps(settings), seed, remembers, digest, self.machine.mentors)


def main(argv: list[str]) -> int:
    """Run the node; return the exit code."""
    return run_node(LearnerNode, argv, (ParameterError, ConfigError, LearningError,
                                        MentorNameError, StateError))
