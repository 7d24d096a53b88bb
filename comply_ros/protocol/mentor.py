# SPDX-License-Identifier: Apache-2.0
"""The mentor in the conversation: a state in, a recommended action out."""

from comply_ros.mentor.advice_budget import AdviceBudget, UNLIMITED
from comply_ros.protocol.attendant import Attendant
from comply_ros.protocol.messages import (
    Action,
    ANYONE,
    follows,
    Ignored,
    Notice,
    Recommendation,
    Rejected,
    StateReward,
    step_id,
)
from comply_ros.protocol.turns import FIRST, NOT_YET, Turns
from comply_ros.protocol.validation import validate_confidence, validate_state
from comply_ros.world.grid import NO_ACTION
from comply_ros.world.mdp import World


class Mentor(Attendant):
    """
    Answers every state with its policy's action; holds the last one until it has a policy.

    Parameters
    ----------
    budget: how many recommendations it has to give; 0 for no limit.
    when: when it gives one; see `AdviceBudget`. Where it counts mistakes, it answers a state only
        after it has heard what the learner did in the one before.

    Attributes
    ----------
    world: the `World` that it attends to, None before.
    policy: list of actions by state, None until there is one for this world.
    watches: whether it needs to hear the learner's actions.
    remembers: whether what it says depends on what it was told, so that it must be kept.
    turns: states that were answered so far.

    """

    def __init__(self, budget=UNLIMITED, when='early'):
        super().__init__()
        self.world, self.policy, self.turns = None, None, 0
        self.remembers = budget != UNLIMITED
        self.watches = self.remembers and when == 'mistakes'
        self._budget, self._when, self._advising = budget, when, None
        self._forget_the_run()

    def look(self):
        """Return what is to be said if the world is silent and another asks; once a second."""
        self._turns.look()
        self._looks += 1
        return super().look()

    def allow_gap(self):
        """Be ready for a gap: what was said in the last time may not have been heard."""
        self._turns.may_lack = True

    def waiting_for(self):
        """Text of what this mentor needs before it can go on; None where it has it all."""
        return self._attention.waiting_for()

    def use(self, policy, kept=None):
        """
        Advise by `policy[s]` from now on; return what is to be said about a state that waited.

        kept: what `state` gave before, and what was told since: (facts, arrays, told), or None.
        """
        self.policy = policy.tolist()
        self._advise_by(policy)
        self.begins = True
        if kept:
            self._restore(*kept)
        return self.release_held()

    def _advise_by(self, policy):
        self._advising = AdviceBudget(self.world, policy, self._budget, self._when)

    def release_held(self):
        """Return what is to be said about the state that came too early, if there is one."""
        held, self._held = self._held, None
        return self.observe(held) if held else ()

    def observe(self, msg):
        """Return the `Recommendation` for a state; none where the episode is over."""
        attention = self._attention
        if msg.run != attention.run:
            return attention.hold(self.observe, msg, 'a state')
        if attention.held:
            return (*attention.refuse_held(), *self.observe(msg))
        attention.silent = 0
        if self.policy is None or self._must_see_first(msg):
            if not self._held or step_id(msg) > step_id(self._held):
                self._held = msg
            return ()
        if self._held and step_id(msg) >= step_id(self._held):
            self._held = None
        problem = validate_state(msg, self.world)
        if problem or msg.terminated:
            return (problem,) if problem else ()
        if self.watches:
            return self._hear_in_turn(msg)
        return self._hear_to_spend(msg) if self.remembers else self._advise(msg)

    def on_action(self, msg):
        """Remember what the learner did; return what is to be said about a state that waited."""
        asked = self._asked
        if self._is_passed_by(msg):
            self._asked, self._turns = None, Turns(sees_ends=False)
            return ()
        if asked is None or msg.run != self._attention.run or step_id(msg) != step_id(asked) \
                or step_id(msg) == self._acted or not self._can_answer(msg, asked):
            return ()
        self._acted = step_id(msg)
        self.told.append(msg)
        if msg.action in range(4):
            self._advising.watch(asked.state, msg.action)
        return self.release_held()

    def _is_passed_by(self, msg):
        """Tell whether the learner went on without advice, from the last question to one held."""
        held, asked = self._held, self._asked
        return (held is not None and asked is not None and msg.run == held.run
                and (step_id(asked) < step_id(msg) == (held.episode, held.step - 1)
                     or held.step == 0 and self._turns.may_lack and self._looks > 1
                     and step_id(asked) < step_id(msg) < step_id(held)))

    def _can_answer(self, msg, asked):
        """Tell whether the world takes this `Action` for an answer; it warns of one that not."""
        if asked.learner not in (ANYONE, msg.learner) or validate_confidence(msg):
            return False
        if asked.truncated:
            return msg.action == NO_ACTION
        return msg.action in range(4) and bool(self.world.available[asked.state, msg.action])

    def advice(self, state):
        """
        Return the action for a state: -1 for no advice, also where nobody can act.

        Raises
        ------
        ValueError: if the state is outside of the grid, or there is no policy yet.

        """
        if self.policy is None:
            raise ValueError('the mentor must have a world and a policy first, and has none yet')
        if not 0 <= state < len(self.policy):
            raise ValueError(f'a state must lie in [0, {len(self.policy) - 1}], got {state}')
        return self.policy[state] if self.world.free[state] else NO_ACTION

    def state(self):
        """Return all that it needs to go on later: facts that JSON can write, and arrays."""
        facts = {'run': self._attention.run, 'asked': self._asked, 'acted': self._acted,
                 'answer': self._answer}
        return facts, {name: getattr(self._advising, name)
                       for name in ('advised', 'remaining', 'last_actions')}

    def _restore(self, facts, arrays, told):
        """Change into what a state was; then hear again what was told since."""
        if facts['run'] != self.described.replaces:
            for name, array in arrays.items():
                getattr(self._advising, name)[...] = array
        self._answer = tuple(Recommendation(*each) for each in facts['answer'])
        self._asked = facts['asked'] and StateReward(*facts['asked'])
        self._acted = facts['acted'] and tuple(facts['acted'])
        if self._asked:
            self._turns.take(self._asked)
        for each in told:
            self._hear_again(each)
        self.told.clear()
        self.begins, self._turns.may_lack = facts['run'] != self._attention.run, True
        if self.begins:
            held = self._held
            self._forget_the_run()
            self._held = held

    def _hear_again(self, told):
        """Change by one thing that was told before, as it was changed then."""
        if type(told) is Action:
            self._acted = step_id(told)
            if told.action in range(4):
                self._advising.watch(self._asked.state, told.action)
        else:
            self._advise(told)

    def attend(self, msg, grid):
        """Change into a mentor in this world; return a `Notice`, and what came early."""
        is_reset, held = follows(msg, self.described), self._attention.attend(msg)
        self._forget_the_run()
        if self.world is None or self.world.grid != grid:
            self.world, self.policy = World(grid), None
        elif is_reset and self._advising:  # as at a fresh start, with its whole budget
            self._advise_by(self._advising.policy)
        self.begins = self.policy is not None
        return (Notice(f'attends to world {msg.name!r}, run {msg.run}'),
                *(answer for hear, message in held for answer in hear(message)))

    def _forget_the_run(self):
        self._asked, self._answer, self._acted, self._held = None, (), None, None
        self._doubted, self._looks = None, 0
        self._turns = Turns(sees_ends=False)

    def _hear_in_turn(self, msg):
        """Return the `Recommendation`: the same for a repeated state, none for an older one."""
        if self._asked and step_id(msg) < step_id(self._asked):
            return (self._turns.too_late(step_id(msg)),)
        if self._asked and step_id(msg) == step_id(self._asked):
            self._asked = self._asked._replace(learner=msg.learner)  # another may answer now
            return self._answer
        remark = self._turns.remark(msg, self.world)
        if type(remark) in (Rejected, Ignored):
            return (remark,)
        return (remark, *self._advise(msg)) if remark else self._advise(msg)

    def _hear_to_spend(self, msg):
        """Return the `Recommendation`; none for a state that nobody can be in, now or any more."""
        here, newest = step_id(msg), step_id(self._asked) if self._asked else NOT_YET
        if here < newest:
            return (self._turns.too_late(here),)
        again, self._doubted = msg == self._doubted, msg
        if msg.episode > newest[0] + 1 and not again:
            return (Ignored('joins late', f'was asked about turn {here} after {newest}: answers '
                            'as soon as that is asked again'),)
        return self._advise(msg)

    def _advise(self, msg):
        """Return the `Recommendation` for a state, which may cost one of the budget."""
        remaining = self._advising.remaining[0]
        self._turns.take(msg)
        self.turns += self._asked is None or step_id(msg) > step_id(self._asked)
        self._attention.committed |= step_id(msg) != FIRST  # somebody answers in this run
        self._asked, self._looks = msg, 0
        self._answer = (Recommendation(msg.run, msg.episode, msg.step, msg.state,
                                       self._advising.advise(msg.state)),)
        if self.watches or self._advising.remaining[0] != remaining:
            self.told.append(msg)
        return self._answer

    def _must_see_first(self, msg):
        """Tell whether what the learner did in the last state matters, and is not known yet."""
        return (self.watches and self._asked is not None and step_id(msg) > step_id(self._asked)
                and self._acted != step_id(self._asked))
