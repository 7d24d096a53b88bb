# SPDX-License-Identifier: Apache-2.0
"""The learner in the conversation: a state and a recommendation in, an action out."""

from comply_ros.learner.learner_config import CONFIG_FIELDS
from comply_ros.learner.reconfigure import changed_method
from comply_ros.learner.respondent import Respondent
from comply_ros.protocol.advice_buffer import AdviceBuffer
from comply_ros.protocol.attendant import Attendant
from comply_ros.protocol.messages import (
    AnsweredObservation,
    ANYONE,
    follows,
    grid_from_description,
    Ignored,
    Notice,
    Rejected,
    StateReward,
    step_id,
    WorldDescription,
)
from comply_ros.protocol.turns import Turns
from comply_ros.protocol.validation import validate_state
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class Learner(Attendant):
    """
    Answers every state once, when the advice that it needs is there, and learns by the way.

    Parameters
    ----------
    method: the `LearnerConfig`.
    seed: of its decisions.
    remembers_advice: whether to act at once in a state in which the mentor has spoken before,
        on what it said then. What it says now is heard when it comes, and counts from the
        next visit on. A mentor that does not change its mind makes no difference to the bits.
    number: tells this learner from every other; not 0.

    Attributes
    ----------
    world: the `World` that it attends to, None before.
    asked: the `StateReward` that waits for advice, or None.
    changed: table of the settings that were changed while it ran, kept with its state.

    """

    def __init__(self, method, seed, remembers_advice=True, number=1):
        super().__init__()
        self._remembers_advice, self.changed = remembers_advice, {}
        self.world, self.asked, self._turns, self._hearsay = None, None, Turns(), AdviceBuffer()
        self._respondent = Respondent(method, seed, number)

    def look(self):
        """Return what is to be said if the world is silent and another asks; once a second."""
        self._turns.look()
        return super().look()

    @property
    def method(self):
        """The `LearnerConfig`, as it is now."""
        return self._respondent.method

    @property
    def memory(self):
        """`LearnerState` of what was learned in this world; None before a world is known."""
        return self.student and self.student.memory

    @property
    def turns(self):
        """Questions that were answered so far."""
        return self._respondent.turns

    @property
    def student(self):
        """The `Student` that learns in this world, None before a world is known."""
        return self._respondent.student

    @property
    def number(self):
        """Number that tells this learner from every other."""
        return self._respondent.number

    @property
    def aside(self):
        """Tell whether another learner has this run."""
        return self._turns.aside

    @property
    def reports(self):
        """The last `Progress` said, oldest first."""
        return self._respondent.reports

    @property
    def finished(self):
        """Tell whether all iterations are done; from then on nothing is answered."""
        return self.student is not None and self.student.finished

    def allow_gap(self):
        """Be ready for a gap: what was said in the last time may not have been heard."""
        self._turns.may_lack = True

    def advice_heard(self):
        """`advice[s]`, int8: what the mentor said last in every state, -1 where nothing yet."""
        return self._hearsay.advice(len(self.world.terminal))

    def waiting_for(self):
        """Text of what this learner needs before it can go on; None where it has it all."""
        if self.asked:
            return f'a recommendation in state {self.asked.state}: is a mentor running?'
        if self._turns.left:
            return 'its turn: another learner is asked in this run'
        if self._turns.late and not self.finished:
            return (f'a state after turn {self._turns.answered}: the world asks about turn '
                    f'{self._turns.late} again; has it lost the end of its state?')
        return None if self.finished else self._attention.waiting_for()

    def observe(self, msg):
        """
        Return the `Action` in a state, if the advice for it is there.

        A repeated question gets the same answer; an older one is dropped; one that cannot be
        right is `Rejected`.
        """
        attention = self._attention
        if self._turns.aside:
            return ()
        if msg.run != attention.run:
            return attention.hold(self.observe, msg, 'a state')
        if attention.held:
            return (*attention.refuse_held(), *self.observe(msg))
        attention.silent = 0
        problem = validate_state(msg, self.world)
        if problem:
            return (problem,)
        here = step_id(msg)
        if here < self._turns.answered:
            return (self._turns.too_late(here),)
        if here == self._turns.answered or self.asked and here == step_id(self.asked):
            self._turns.repeat(msg, self.number)
            return self._respondent.again(waits=here != self._turns.answered)
        if msg.learner not in (ANYONE, self.number):
            return self._turns.leave(msg, self.number)
        remark = self._turns.remark(msg, self.world)
        if self.finished or type(remark) in (Rejected, Ignored):
            return (remark,) if remark else ()
        return (remark, *self._start_step(msg)) if remark else self._start_step(msg)

    def on_recommendation(self, msg):
        """Return the `Action` in the state that waited for this advice; else remember it."""
        attention = self._attention
        if msg.run != attention.run:
            return attention.hold(self.on_recommendation, msg, 'a recommendation')
        before = self._hearsay.last(msg.state) if self._remembers_advice else None
        counts, outputs = self._hearsay.hear(msg, self.world)
        if not counts:
            return outputs
        if before is None or before.action != msg.action:  # else it is known already
            self.told.append(msg)
        if self.asked and step_id(msg) == step_id(self.asked):
            return self._respond(msg.action)
        return ()

    def reset(self):
        """Forget all that was learned; return what is to be said. The run goes on."""
        if self.world is None:
            return ()
        self._hearsay.forget()
        self.begins = True
        return (Notice('forgets all that it learned'), *self._respondent.forget(self.world))

    def changed_method(self, changes):
        """
        Return the `LearnerConfig` after changes, a table by name; those of no field are passed over.

        Raises
        ------
        MethodError: if it cannot be changed so.

        """
        fields = {name: value for name, value in changes.items() if name in CONFIG_FIELDS}
        return changed_method(self.method, fields,
                              self.student.iterations_done if self.student else 0)

    def change(self, changes):
        """
        Go on by other settings from the next decision on; return what is to be said.

        changes: table by name, of fields of the method, `remembers_advice`, and what is only kept.

        Raises
        ------
        MethodError: if it cannot be changed so; then nothing is.

        """
        method = self.changed_method(changes)
        self._remembers_advice = changes.get('remembers_advice', self._remembers_advice)
        self.changed.update(changes)
        if self.student is None:
            self._respondent.method = method
            return ()
        self.begins = True
        words = ', '.join(f'{name} {value}' for name, value in changes.items())
        return (Notice(f'goes on with {words}'), *self._respondent.change(self.world, method),
                *self._answer_what_waits())

    def _answer_what_waits(self):
        """Return the `Action` in the state that waits, where no advice is needed any more."""
        return () if self.method.needs_mentor() else self.go_without_advice()

    def go_without_advice(self):
        """Return the `Action` in the state that waits for advice, as if the mentor had none."""
        return self._respond(NO_ACTION) if self.asked else ()

    def state(self):
        """Return all that it needs to go on later: facts that JSON can write, and arrays."""
        facts, arrays = self._respondent.state()
        described = self.described
        facts['changed'] = self.changed
        facts['described'] = described._replace(rows=list(described.rows),
                                                starts=list(described.starts))
        return facts, {**arrays, **self._hearsay.arrays()}

    def restore(self, facts, arrays, told):
        """Change into what a state was, then learn again what was told since, step by step."""
        described = WorldDescription(*facts['described'])
        self.change(facts['changed'])
        self.attend(described, grid_from_description(described))
        self._respondent.restore(facts, arrays)
        last = self._respondent.last
        if last:
            self._turns.take(last)
            self._attention.committed = True
        self._hearsay = AdviceBuffer(described.run, self._turns.answered)
        self._hearsay.restore(arrays)
        for each in told:
            self._learn_again(each)
        self.told.clear()
        self.begins, self._turns.may_lack = False, True

    def recall(self):
        """Return what is to be said again after `restore`: all reports, and the last answer."""
        answer = self._respondent.answer
        return (*self.reports, answer) if answer else tuple(self.reports)

    def _learn_again(self, told):
        """Change the memory by one thing that was told before, as it was changed then."""
        if type(told) is not AnsweredObservation:
            self._hearsay.note(told)
            return
        *question, advice = told
        self.asked = StateReward(self.described.run, *question)
        early = self._hearsay.ask(self.asked)
        if early:
            self._hearsay.hear(early, self.world)
        self._respond(advice)

    def attend(self, msg, grid):
        """Change into one that learns in this world; return a `Notice`, and what came early."""
        is_reset, held = follows(msg, self.described), self._attention.attend(msg)
        self.asked, self._turns, self._hearsay = None, Turns(), AdviceBuffer(msg.run)
        self._respondent.forget_the_run()
        notice = f'goes on in world {msg.name!r}, run {msg.run}'
        if self.world is None or self.world.grid != grid:
            self.world = World(grid)
            self._respondent.begin(self.world)
            notice = f'begins to learn world {msg.name!r}, run {msg.run}'
        elif is_reset and self.turns <= 1:  # nothing was learned yet: as at a fresh start
            self._respondent.forget(self.world)
        self.begins = True
        return (Notice(notice), *(answer for hear, message in held for answer in hear(message)))

    def _start_step(self, msg):
        """Return the `Action` in a state, if it can be told without hearing more."""
        if self._turns.was_left(msg):
            self._respondent.forget_the_run()  # its own answer was not the one that led here
        self.asked, early = msg, self._hearsay.ask(msg)
        known = self._hearsay.last(msg.state)
        if known and not self._remembers_advice and step_id(known) != step_id(msg):
            known = None
        outputs = ()
        if msg.terminated or not self.method.needs_mentor():
            outputs = self._respond(NO_ACTION)
        elif known:
            outputs = self._respond(known.action)
        return outputs + self.on_recommendation(early) if early else outputs

    def _respond(self, advice):
        """Change the memory by the question that is open; return what is to be said."""
        asked, self.asked = self.asked, None
        self.told.append(AnsweredObservation(*asked[1:7], advice))
        self._turns.take(asked)
        self._attention.committed = True
        return self._respondent.respond(asked, advice)
