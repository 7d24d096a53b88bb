# SPDX-License-Identifier: Apache-2.0
"""The mentor in the conversation: a state in, a recommended action out."""

from comply_ros.core.advising import Advising, WITHOUT_LIMIT
from comply_ros.core.attendant import Attendant
from comply_ros.core.dialogue import (
    Action,
    ANYONE,
    Dropped,
    follows,
    Notice,
    Recommendation,
    Refused,
    StateReward,
    turn,
)
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.problems import problem_of_confidence, problem_of_state
from comply_ros.core.turns import FIRST, NOT_YET, Turns
from comply_ros.core.world import World


class MentorActor(Attendant):
    """
    Answers every state with its policy's action; holds the last one until it has a policy.

    Parameters
    ----------
    budget: how many recommendations it has to give; 0 for no limit.
    when: when it gives one; see `Advising`. Where it counts mistakes, it answers a state only
        after it has heard what the learner did in the one before.

    Attributes
    ----------
    world: the `World` that it attends to, None before.
    policy: list of actions by state, None until there is one for this world.
    watches: whether it needs to hear the learner's actions.
    remembers: whether what it says depends on what it was told, so that it must be kept.
    turns: states that were answered so far.

    """

    def __init__(self, budget=WITHOUT_LIMIT, when='early'):
        super().__init__()
        self.world, self.policy, self.turns = None, None, 0
        self.remembers = budget != WITHOUT_LIMIT
        self.watches = self.remembers and when == 'mistakes'
        self._budget, self._when, self._advising = budget, when, None
        self._forget_the_run()

    def look(self):
        """Return what is to be said if the world is silent and another asks; once a second."""
        self._turns.look()
        self._looks += 1
        return super().look()

    def hear_less(self):
        """Be ready for a gap: what was said in the last time may not have been heard."""
        self._turns.may_lack = True

    def waits_for(self):
        """Text of what this mentor needs before it can go on; None where it has it all."""
        return self._attention.waits_for()

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
        return self.hear_held()

    def _advise_by(self, policy):
        self._advising = Advising(self.world, policy, self._budget, self._when)

    def hear_held(self):
        """Return what is to be said about the state that came too early, if there is one."""
        held, self._held = self._held, None
        return self.hear_state(held) if held else ()

    def hear_state(self, said):
        """Return the `Recommendation` for a state; none where the episode is over."""
        attention = self._attention
        if said.run != attention.run:
            return attention.hold(self.hear_state, said, 'a state')
        if attention.held:
            return (*attention.refuse_held(), *self.hear_state(said))
        attention.silent = 0
        if self.policy is None or self._must_see_first(said):
            if not self._held or turn(said) > turn(self._held):
                self._held = said
            return ()
        if self._held and turn(said) >= turn(self._held):
            self._held = None
        problem = problem_of_state(said, self.world)
        if problem or said.terminated:
            return (problem,) if problem else ()
        if self.watches:
            return self._hear_in_turn(said)
        return self._hear_to_spend(said) if self.remembers else self._advise(said)

    def hear_action(self, said):
        """Remember what the learner did; return what is to be said about a state that waited."""
        asked = self._asked
        if self._is_passed_by(said):
            self._asked, self._turns = None, Turns(sees_ends=False)
            return ()
        if asked is None or said.run != self._attention.run or turn(said) != turn(asked) \
                or turn(said) == self._acted or not self._can_answer(said, asked):
            return ()
        self._acted = turn(said)
        self.told.append(said)
        if said.action in range(4):
            self._advising.watch(asked.state, said.action)
        return self.hear_held()

    def _is_passed_by(self, said):
        """Tell whether the learner went on without advice, from the last question to one held."""
        held, asked = self._held, self._asked
        return (held is not None and asked is not None and said.run == held.run
                and (turn(asked) < turn(said) == (held.episode, held.step - 1)
                     or held.step == 0 and self._turns.may_lack and self._looks > 1
                     and turn(asked) < turn(said) < turn(held)))

    def _can_answer(self, said, asked):
        """Tell whether the world takes this `Action` for an answer; it warns of one that not."""
        if asked.learner not in (ANYONE, said.learner) or problem_of_confidence(said):
            return False
        if asked.truncated:
            return said.action == NO_ACTION
        return said.action in range(4) and bool(self.world.available[asked.state, said.action])

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
        return facts, {name: getattr(self._advising, name) for name in ('told', 'left', 'did')}

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
            self._acted = turn(told)
            if told.action in range(4):
                self._advising.watch(self._asked.state, told.action)
        else:
            self._advise(told)

    def attend(self, said, grid):
        """Change into a mentor in this world; return a `Notice`, and what came early."""
        is_reset, held = follows(said, self.described), self._attention.attend(said)
        self._forget_the_run()
        if self.world is None or self.world.grid != grid:
            self.world, self.policy = World(grid), None
        elif is_reset and self._advising:  # as at a fresh start, with its whole budget
            self._advise_by(self._advising.policy)
        self.begins = self.policy is not None
        return (Notice(f'attends to world {said.name!r}, run {said.run}'),
                *(answer for hear, message in held for answer in hear(message)))

    def _forget_the_run(self):
        self._asked, self._answer, self._acted, self._held = None, (), None, None
        self._doubted, self._looks = None, 0
        self._turns = Turns(sees_ends=False)

    def _hear_in_turn(self, said):
        """Return the `Recommendation`: the same for a repeated state, none for an older one."""
        if self._asked and turn(said) < turn(self._asked):
            return (self._turns.too_late(turn(said)),)
        if self._asked and turn(said) == turn(self._asked):
            self._asked = self._asked._replace(learner=said.learner)  # another may answer now
            return self._answer
        remark = self._turns.remark(said, self.world)
        if type(remark) in (Refused, Dropped):
            return (remark,)
        return (remark, *self._advise(said)) if remark else self._advise(said)

    def _hear_to_spend(self, said):
        """Return the `Recommendation`; none for a state that nobody can be in, now or any more."""
        here, newest = turn(said), turn(self._asked) if self._asked else NOT_YET
        if here < newest:
            return (self._turns.too_late(here),)
        again, self._doubted = said == self._doubted, said
        if said.episode > newest[0] + 1 and not again:
            return (Dropped('joins late', f'was asked about turn {here} after {newest}: answers '
                            'as soon as that is asked again'),)
        return self._advise(said)

    def _advise(self, said):
        """Return the `Recommendation` for a state, which may cost one of the budget."""
        left = self._advising.left[0]
        self._turns.take(said)
        self.turns += self._asked is None or turn(said) > turn(self._asked)
        self._attention.committed |= turn(said) != FIRST  # somebody answers in this run
        self._asked, self._looks = said, 0
        self._answer = (Recommendation(said.run, said.episode, said.step, said.state,
                                       self._advising.advise(said.state)),)
        if self.watches or self._advising.left[0] != left:
            self.told.append(said)
        return self._answer

    def _must_see_first(self, said):
        """Tell whether what the learner did in the last state matters, and is not known yet."""
        return (self.watches and self._asked is not None and turn(said) > turn(self._asked)
                and self._acted != turn(self._asked))
