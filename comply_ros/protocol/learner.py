# SPDX-License-Identifier: Apache-2.0
"""The learner as a state machine: observations and recommendations in, actions out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Any

from numpy.typing import NDArray

from comply_ros.learner.agent import Agent, Decision
from comply_ros.learner.learner_config import CONFIG_FIELDS, LearnerConfig
from comply_ros.learner.learner_state import LearnerState, ONE_MENTOR
from comply_ros.learner.learning_result import Learned
from comply_ros.learner.reconfigure import changed_config, words_of_changes
from comply_ros.mentor.several_mentors import validate_mentor_names
from comply_ros.protocol.mentor_advice import MentorAdvice
from comply_ros.protocol.message_validation import validate_observation
from comply_ros.protocol.messages import (
    Action,
    AnsweredObservation,
    ANYONE,
    Ignored,
    Notice,
    OtherAdvice,
    Outputs,
    Progress,
    ReceivedAdvice,
    ReceivedOtherAdvice,
    Recommendation,
    Rejected,
    REPORTS,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.repeated_answer import RepeatedAnswer
from comply_ros.protocol.run_tracker import BEFORE_FIRST, RunTracker
from comply_ros.protocol.world_description import (
    description_from_state,
    description_state,
    world_from_description,
)
from comply_ros.world.grid import NO_ACTION


class Learner:
    """
    Answers every observation once, as soon as the advice that it needs is there, and learns.

    Parameters
    ----------
    config: the settings of the agent.
    seed: of its decisions.
    remembers_advice: whether to act at once in a state that the mentor has advised before, on
        that advice. New advice in the state counts from the next visit on. With a mentor that
        does not change its advice, the bits are the same.
    number: tells this learner from every other; not 0.
    initial: values and beliefs to begin with, see `Agent`.
    mentors: names of those whose advice it waits for; the only one may have none. With the same
        advice, the bits are the same in whatever order it comes.

    Attributes
    ----------
    agent: what acts and learns.
    tracker: the world and run that it takes part in.
    number: as given, or that of the state that was restored.
    waiting: the observation that waits for advice, None where none does.
    reports: the last results of iterations that were published.
    changes: the settings that were changed while it ran, by name; part of its state.
    receivers: for each mentor, a function from a recommendation to outputs.
    journal_entries: what it received and must be in the journal before its outputs are published.
    keeps_journal: whether its answers are among them; False where nothing is stored.
    publish_early: publishes an action before the agent learns from the reward, in the middle of an
        episode; it is not among the outputs then. None where something must be stored before.
    needs_checkpoint: whether its state does not follow from its journal, so that a checkpoint must
        be written before its outputs are published.

    """

    def __init__(self, config: LearnerConfig, seed: int, remembers_advice: bool = True,
                 number: int = 1, initial: Learned | None = None,
                 mentors: Sequence[str] = ONE_MENTOR) -> None:
        validate_mentor_names(mentors)
        self.agent = Agent(config, seed, initial, mentors)
        self.tracker = RunTracker(self._start_run)
        self.number, self._remembers_advice = number, remembers_advice
        self._use_mentors(mentors)
        self.reports: deque[Progress] = deque(maxlen=REPORTS)
        self.changes: dict[str, Any] = {}
        self.journal_entries: list[Any] = []
        self.keeps_journal = True
        self.publish_early: Callable[[Action], None] | None = None
        self._announced = False  # whether the last answer was published early
        self.needs_checkpoint = False
        self._forget_answers()

    @property
    def config(self) -> LearnerConfig:
        """The settings, as they are now."""
        return self.agent.config

    @property
    def state(self) -> LearnerState:
        """What was learned in this world; there must be one."""
        return self.agent.state

    @property
    def step_count(self) -> int:
        """Number of observations that were answered."""
        return self.agent.draws.used

    @property
    def finished(self) -> bool:
        """Tell whether all iterations are done; from then on nothing is answered."""
        return self.tracker.world is not None and self.agent.finished

    @property
    def mentors(self) -> tuple[str, ...]:
        """Names of the mentors whose advice it takes."""
        return self.agent.mentors

    @property
    def expected_mentors(self) -> tuple[str, ...]:
        """Names of these, and of those that join at the next episode."""
        return (*self.mentors, *self._joining)

    def replace_mentors(self, names: Sequence[str]) -> None:
        """
        Take the advice of other mentors from the start on, before anything is answered.

        Raises
        ------
        MentorNameError: if there cannot be mentors of these names.

        """
        validate_mentor_names(names)
        self._use_mentors(names)
        if self.tracker.world is not None:
            self.agent.reset()
            self.waiting = None
            self.needs_checkpoint = True

    def _use_mentors(self, names: Sequence[str]) -> None:
        self.agent.mentors, self._joining = tuple(names), dict[str, Recommendation | None]()
        self._advice = MentorAdvice(names, self.tracker.run)
        self.receivers: list[Callable[[Recommendation], Outputs]] = [
            partial(self.on_recommendation, m=m) for m in range(len(names))]

    def join(self, name: str) -> None:
        """
        Take the advice of one mentor more from the next episode on.

        Raises
        ------
        MentorNameError: if there cannot be one of that name.

        """
        validate_mentor_names((*self.expected_mentors, name))
        self._joining[name] = None

    def hold_advice(self, name: str, msg: Recommendation) -> Outputs:
        """Hold the newest recommendation of a mentor that joins: it may be early; return none."""
        if name in self._joining and msg.mentor == name:
            self._joining[name] = msg
        return ()

    def advice(self) -> NDArray[Any]:
        """
        Return `advice[s]`: the mentor's newest action in a state, -1 where there is none.

        Where it gave none in this run, that of an earlier one, or of the initial learning. Of
        several mentors in rows, `advice[m * n_states + s]`.
        """
        return self._advice.advice(self.agent.earlier_advice)

    def learned(self) -> Learned:
        """Return what was learned in this world; there must be one. Its arrays are not copied."""
        return self.agent.learned(self.advice())

    def waiting_for(self) -> str | None:
        """Text of what this learner needs to continue; None where it has everything."""
        tracker = self.tracker
        if self.waiting:
            name = ''.join(self.missing_mentors()[:1])
            mentor = f'the mentor {name}' if name else 'a mentor'
            return f'a recommendation in state {self.waiting.state}: is {mentor} running?'
        if tracker.left_to_others:
            return 'an observation of its own: the world addresses another learner'
        if tracker.late and not self.finished:
            return (f'a state after step id {tracker.answered}: the world repeats step id '
                    f'{tracker.late}; has it lost the end of its state?')
        return None if self.finished else tracker.waiting_for()

    def on_world(self, msg: WorldDescription) -> Outputs:
        """Return outputs for a world; raises ValueError if it does not describe one."""
        return self.tracker.on_world(msg)

    def allow_gap(self) -> None:
        """Accept a gap before the next observation: messages may have been lost."""
        self.tracker.allow_gap()

    def tick(self) -> Outputs:
        """Return outputs that are due once a second."""
        return self.tracker.tick()

    def observe(self, msg: StateReward) -> Outputs:
        """
        Return the action in a state, if the advice for it is there.

        A repeated observation gets the same action, an older one is `Ignored`, one that cannot be
        right is `Rejected`.
        """
        tracker = self.tracker
        if msg[:3] == tracker.expected and (msg.learner == self.number or msg.learner == ANYONE) \
                and tracker.is_usual_step(msg):
            tracker.silent_ticks = 0
            return () if self.agent.finished else self._start_step(msg, msg.state)
        if tracker.inactive:
            return ()
        if msg.run != tracker.run:
            return tracker.hold(self.observe, msg, 'a state')
        rejected = tracker.continues()
        problem = validate_observation(msg, self._world)
        if problem:
            return (*rejected, problem)
        return (*rejected, *self._observe_in_order(msg))

    def _observe_in_order(self, msg: StateReward) -> Outputs:
        """Return outputs for an observation that is possible, whatever its step id."""
        tracker, here, waiting = self.tracker, step_id(msg), self.waiting
        if here < tracker.answered:
            return (tracker.too_late(here),)
        if here == tracker.answered or waiting and here == step_id(waiting):
            tracker.repeated(msg, self.number)
            # Where it still waits, a mentor may wait for the last action it advised.
            answer = self._repeated
            last = answer.advised_action if here != tracker.answered else None
            return (last or answer.action,) if last or answer.action else ()
        if msg.learner not in (ANYONE, self.number):
            return tracker.leave_to_other(msg, self.number)
        problem = tracker.check_order(msg)
        if self.finished or isinstance(problem, (Rejected, Ignored)):
            return (problem,) if problem else ()
        if not tracker.is_next_step(here):
            self.agent.forget_last_action()
        if tracker.led_here_by_other(msg):
            self.agent.forget_last_action()
            self._forget_answers()
            self.needs_checkpoint = True  # the journal does not say whose action led here
        outputs = self._start_step(msg, msg.state)
        return (problem, *outputs) if problem else outputs

    def _start_step(self, msg: StateReward, s: int) -> Outputs:
        """Return the action in a state, if it does not need advice that is missing."""
        joined = self._let_join(msg) if self._joining and msg.step == 0 else ()
        early = self._advice.add_observation((msg.episode, msg.step), s)
        self.tracker.expected = None  # a repetition of this observation is no usual one
        self.waiting, outputs = msg, joined
        if msg.terminated or not self.agent.config.needs_mentor():
            outputs += self._answer(self._advice.silence)
        else:
            outputs += self._answer_if_advised(msg)
        for m, advice in early:
            outputs += self.receivers[m](advice)
        return outputs

    def _answer_if_advised(self, msg: StateReward) -> Outputs:
        """Return the action in the state that waits, once all advice that counts is there."""
        advice = self._advice.complete_advice(
            msg.state, None if self._remembers_advice else step_id(msg))
        return () if advice is None else self._answer(advice)

    def _let_join(self, msg: StateReward) -> Outputs:
        """Take the advice of those that want to join from this state on; return outputs."""
        joining, self._joining = self._joining, {}
        outputs = ()
        for name, early in joining.items():
            self.agent.add_mentor(name)
            self._receive_from(name)
            if early and early[:3] == msg[:3]:  # it has answered this observation already
                outputs += self.receivers[-1](early)
        self.needs_checkpoint = True
        shown = (name or 'the mentor without a name' for name in joining)
        return (Notice(f'takes the advice of {", ".join(shown)} too'), *outputs)

    def _receive_from(self, name: str) -> None:
        self._advice.add_mentor(name)
        self.receivers.append(partial(self.on_recommendation, m=len(self.receivers)))

    def on_recommendation(self, msg: Recommendation, m: int = 0) -> Outputs:
        """
        Return the action in the state that waits for this advice; else remember it.

        m: the place of its mentor.
        """
        if msg.run != self.tracker.run:
            return self.tracker.hold(self.receivers[m], msg, 'a recommendation')
        if not (self._remembers_advice and self._advice.add_same_advice(m, msg)):
            before = self._advice.newest_advice(m, msg.state) if self._remembers_advice else None
            counts, outputs = self._advice.add_advice(m, msg, self._world)
            if not counts:
                return outputs
            is_news = before is None or before.action != msg.action
            if self.keeps_journal and is_news:
                received = msg[:5]
                self.journal_entries.append(ReceivedOtherAdvice(m, *received) if m else
                                            ReceivedAdvice(*received))
        if self.waiting and step_id(msg) == step_id(self.waiting):
            return self._answer_if_advised(self.waiting)
        return ()

    def continue_without_advice(self) -> Outputs:
        """
        Return the action in the state that waits, on what advice there is.

        One of several mentors that gave none is not waited for until it gives some.
        """
        if self.waiting is None:
            return ()
        available = self._advice.available_advice(
            self.waiting.state, None if self._remembers_advice else step_id(self.waiting))
        if len(available) > 1:
            self._advice.absent |= {m for m, action in enumerate(available) if action is None}
        return self._answer(tuple(NO_ACTION if each is None else each for each in available))

    def leave(self, mentors: Collection[str]) -> Outputs:
        """
        Return the action in the state that waits, where it waits for no other mentors than these.

        Of several mentors, these are not waited for until they give advice again.
        """
        missing = self.missing_mentors()
        if len(self.mentors) > 1:
            self._advice.absent |= {self.mentors.index(name) for name in missing
                                    if name in mentors}
        return () if {*missing} - {*mentors} else self.continue_without_advice()

    def missing_mentors(self) -> list[str]:
        """Return the names of the mentors whose advice an observation waits for."""
        if self.waiting is None:
            return []
        available = self._advice.available_advice(
            self.waiting.state, None if self._remembers_advice else step_id(self.waiting))
        return [name for m, (name, action) in enumerate(zip(self.mentors, available))
                if action is None and m not in self._advice.absent]

    def _answer(self, advice: tuple[int, ...]) -> Outputs:
        """Step the agent by the observation that waits; return the action and any report."""
        msg = self.waiting
        assert msg is not None
        run, episode, step, s, reward, terminated, truncated, _ = msg
        self.waiting = None
        if self.keeps_journal:
            for m in range(1, len(advice)):
                self.journal_entries.append(OtherAdvice(m, advice[m]))
            self.journal_entries.append(AnsweredObservation(
                episode, step, s, reward, terminated, truncated, advice[0]))
        self.tracker.answer(msg)
        self._announced = False
        announce = partial(self._announce, msg, advice) if self.publish_early else None
        decision = self.agent.step(s, step, reward, terminated, truncated, advice, announce)
        if self._announced:
            return ()
        if terminated or truncated:
            self._repeated.add(decision, advice)
            return self._finish_episode(run, decision, terminated)
        return (self._act(msg, advice, decision),)

    def _announce(self, msg: StateReward, advice: tuple[int, ...], decision: Decision) -> None:
        """Publish the action before the agent learns from the reward."""
        self._announced = True
        assert self.publish_early is not None
        self.publish_early(self._act(msg, advice, decision))

    def _act(self, msg: StateReward, advice: tuple[int, ...], decision: Decision) -> Action:
        self._repeated.add(decision, advice)
        return self._repeated.act(*msg[:3], decision, self.number, self.agent.draws.used - 1)

    def _finish_episode(self, run: int, decision: Decision, terminated: bool) -> Outputs:
        """Return the action that lets the next episode start, and the report of an iteration."""
        action, answer = self._end_of_episode(run), self._repeated
        if not terminated:  # a mentor advises in a truncated state, not at a goal
            answer.advised_action = action
        result, agent = decision.iteration, self.agent
        if result is None:
            return (action,)
        progress = Progress(
            run, result.number, agent.config.iterations, result.episodes, agent.steps,
            result.mean_return, result.confidence, result.temperature, agent.finished)
        reports = (progress, *(
            progress._replace(confidence=confidence, mentor=name)
            for name, confidence in zip(self.mentors, result.confidences) if name))
        self.reports.extend(reports)
        if not agent.finished:
            return (action, *reports)
        answer.action = None
        return reports

    def _end_of_episode(self, run: int) -> Action:
        return self._repeated.end_episode(run, self.tracker.answered, self.number,
                                             max(self.step_count - 1, 0))

    def _wake(self) -> Outputs:
        """Return the action that lets the next episode start, if this learner had finished."""
        tracker = self.tracker
        if tracker.answered == BEFORE_FIRST or self._repeated.action or tracker.run is None:
            return ()
        return (self._end_of_episode(tracker.run),)

    def reset(self) -> Outputs:
        """Forget what was learned since the start; return outputs. The run continues."""
        if self.tracker.world is None:
            return ()
        self._advice.forget()
        self.needs_checkpoint = True
        initial = self.agent.initial
        text = f'begins again from {initial.source}' if initial else \
            'forgets everything that it learned'
        return (Notice(text), *self._restart_agent())

    def _restart_agent(self) -> Outputs:
        self.agent.reset()
        self.reports.clear()
        self._repeated.forget_advice()
        return self._wake()

    def check_changes(self, changes: dict[str, Any]) -> LearnerConfig:
        """
        Return the settings after changes, by name; names that are no field are left out.

        Raises
        ------
        ConfigError: if they cannot be changed so.

        """
        known = self.tracker.world is not None
        return changed_config(
            self.config, {name: value for name, value in changes.items() if name in CONFIG_FIELDS},
            self.agent.iterations_done if known else 0)

    def change(self, changes: dict[str, Any]) -> Outputs:
        """
        Continue under other settings from the next decision on; return outputs.

        changes: fields of the settings, `remembers_advice`, and what is only part of the state.

        Raises
        ------
        ConfigError: if they cannot be changed so; then nothing changes.

        """
        config = self.check_changes(changes)
        self._remembers_advice = changes.get('remembers_advice', self._remembers_advice)
        self.changes.update(changes)
        if self.tracker.world is None:
            self.agent.config = config
            return ()
        self.needs_checkpoint = True
        self.agent.reconfigure(config, self.advice())
        outputs = () if self.agent.finished else self._wake()
        if not config.needs_mentor():
            outputs += self.continue_without_advice()
        return (Notice(words_of_changes(changes, config)), *outputs)

    def state_dict(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Return everything needed to continue later: values for JSON, and arrays by name."""
        agent, arrays = self.agent.state_dict()
        assert self.tracker.description is not None
        description, world = description_state(self.tracker.description)
        return {'agent': agent, 'number': self.number, 'changes': self.changes,
                'mentors': self.mentors,
                'description': description,
                'order': self.tracker.state_dict(), **self._repeated.state_dict(),
                'reports': list(self.reports)}, {**arrays, **world, **self._advice.arrays()}

    def load_state_dict(self, values: dict[str, Any], arrays: dict[str, NDArray[Any]],
                        journal: list[Any]) -> None:
        """Continue from a checkpoint, then repeat the steps of its journal."""
        description = description_from_state(values['description'], arrays)
        self.change(values['changes'])
        self._use_mentors(values.get('mentors', ONE_MENTOR))
        self.tracker.follow(description, world_from_description(description))
        self.agent.load_state_dict(values['agent'], arrays)
        self.number = values['number']
        self._repeated.load_state_dict(values)
        self.reports.extend(Progress(*each) for each in values['reports'])
        self.tracker.load_state_dict(values['order'])
        self._advice = MentorAdvice(self.mentors, description.run, self.tracker.answered)
        self._advice.load_arrays(arrays)
        for entry in journal:
            self._repeat(entry)
        self.journal_entries.clear()
        self.needs_checkpoint = False
        self.tracker.allow_gap()

    def last_outputs(self) -> Outputs:
        """Return what to publish again after `load_state_dict`: the reports, the last action."""
        action = self._repeated.action
        return (*self.reports, action) if action else tuple(self.reports)

    def _repeat(self, entry: Any) -> None:
        """Change by one entry of a journal, as it was changed then."""
        if isinstance(entry, ReceivedAdvice):
            self._advice.restore_advice(0, Recommendation(*entry))
            return
        if isinstance(entry, ReceivedOtherAdvice):
            self._advice.restore_advice(entry.m, Recommendation(*entry[1:]))
            return
        if isinstance(entry, OtherAdvice):
            self._other_advice[entry.m] = entry.action
            return
        msg = StateReward(self.tracker.run or 0, entry.episode, entry.step, entry.state,
                          entry.reward, entry.terminated, entry.truncated)
        for m, early in self._advice.add_observation(step_id(msg), msg.state):
            self._advice.add_advice(m, early, self._world)
        if not self.tracker.is_next_step(step_id(msg)):
            self.agent.forget_last_action()
        self.waiting = msg
        self._answer((entry.advice, *(self._other_advice[m] for m in range(1, len(self.mentors)))))

    def _start_run(self, is_reset: bool) -> Outputs:
        """Take part in a new run, and start to learn if its world is another one."""
        description = self.tracker.description
        assert description is not None
        had_learned = self.step_count > 1
        if not self.tracker.world_changed:
            self.agent.earlier_advice = self.advice()
        self._advice = MentorAdvice(self.mentors, description.run)
        self._forget_answers()
        self.agent.forget_last_action()
        text = f'continues in world {description.name!r}, run {description.run}'
        if self.tracker.world_changed:
            self.agent.start(self._world)
            text = self._start_text(f'in world {description.name!r}, run {description.run}')
        elif is_reset and not had_learned:  # as at a fresh start
            self._restart_agent()
        self.needs_checkpoint = True
        return (Notice(text),)

    def _start_text(self, place: str) -> str:
        """Return the line for the log with which this learner starts in a place."""
        agent = self.agent
        source = f', with {agent.initial.source}' if agent.initial else ''
        if agent.config.learns:
            return f'starts to learn {place}{source}'
        return f'acts {place}{source or ", with nothing learned"}, and learns nothing'

    def _forget_answers(self) -> None:
        self.waiting: StateReward | None = None
        self._repeated = RepeatedAnswer()
        self._other_advice: dict[int, int] = {}

    @property
    def _world(self) -> Any:
        return self.tracker.world
