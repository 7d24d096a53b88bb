# SPDX-License-Identifier: Apache-2.0
"""The learner in the conversation: a state and a recommendation in, an action out."""

from comply_ros.core.dialogue import (
    Action,
    grid_of,
    Notice,
    problem_of_advice,
    problem_of_run,
    problem_of_state,
    Refused,
    turn,
)
from comply_ros.core.draws import Draws, streams
from comply_ros.core.grid import NO_ACTION
from comply_ros.core.learning import DRAWS
from comply_ros.core.student import Student
from comply_ros.core.world import World

NOT_YET = (0, -1)  # before the first turn, which is (1, 0)


class LearnerActor:
    """
    Answers every state once, when the advice that it needs is there, and learns by the way.

    Parameters
    ----------
    method: the `Method`.
    seed: of its decisions.
    remembers_advice: whether to act at once in a state in which the mentor has spoken before,
        on what it said then. What it says now is heard when it comes, and counts from the
        next visit on. A mentor that does not change its mind makes no difference to the bits.

    Attributes
    ----------
    world: the `World` that was described last, None before.
    student: the `Student` that learns in it, None before. When it has finished, nothing is
        answered, except in another world, which a new one begins to learn.

    """

    def __init__(self, method, seed, remembers_advice=True):
        self._remembers_advice = remembers_advice
        self.method, self.world, self.student = method, None, None
        self._draws = Draws(streams(seed)[1], DRAWS)
        self._run, self._early = None, {}
        self._forget_the_turn()

    def hear_world(self, said):
        """
        Return a `Notice`, and what is to be said about a state that came before.

        The same world in a new run keeps what was learned; another world begins anew.

        Raises
        ------
        ValueError: if it cannot be a world.

        """
        grid = grid_of(said)
        if said.run == self._run:
            return ()
        self._run = said.run
        self._forget_the_turn()
        notice = f'goes on in world {said.name!r}, run {said.run}'
        if self.world is None or self.world.grid != grid:
            self.world = World(grid)
            self.student = Student(self.world, self.method)
            notice = f'begins to learn world {said.name!r}, run {said.run}'
        early, self._early = self._early, {}
        return (Notice(notice),
                *(answer for hear, (held, _) in early.items() for answer in hear(held)))

    @property
    def memory(self):
        """`Memory` of what was learned in this world; None before a world is known."""
        return self.student and self.student.memory

    @property
    def finished(self):
        """Tell whether all iterations are done; from then on nothing is answered."""
        return self.student is not None and self.student.finished

    def advice_heard(self):
        """`advice[s]`: what the mentor said last in every state, -1 where nothing yet."""
        heard = [NO_ACTION] * len(self.world.terminal)
        for state, said in self._heard.items():
            heard[state] = said.action
        return heard

    def waits_for(self):
        """Text of what this learner needs before it can go on; None where it has it all."""
        if self.world is None:
            return 'a world: is a grid_world running?'
        if self._asked:
            return f'a recommendation in state {self._asked.state}: is a mentor running?'
        return None

    def hear_state(self, said):
        """
        Return the `Action` in a state, if the advice for it is there.

        A repeated question gets the same answer; an older one is dropped; one that cannot be
        right is `Refused`.
        """
        if said.run != self._run:
            return self._hold(self.hear_state, said, 'a state')
        if self._early:
            return (*self._refuse_held(), *self.hear_state(said))
        problem = problem_of_state(said, self.world) or self._problem_of_turn(said)
        if problem:
            return (problem,)
        if turn(said) == self._answered:
            return (self._answer,) if self._answer else ()
        asked = self._asked and turn(said) == turn(self._asked)
        if turn(said) < self._answered or asked or self.finished:
            return ()
        self._asked = said
        if not self.method.needs_mentor() or said.terminated:
            return self._respond(said, NO_ACTION)
        heard = self._heard.get(said.state)
        if heard and (self._remembers_advice or turn(heard) == turn(said)):
            return self._respond(said, heard.action)
        return ()

    def hear_recommendation(self, said):
        """Return the `Action` in the state that waited for this advice; else remember it."""
        if said.run != self._run:
            return self._hold(self.hear_recommendation, said, 'a recommendation')
        problem = problem_of_advice(said, self.world)
        if problem:
            return (problem,)
        heard = self._heard.get(said.state)
        if not heard or turn(said) > turn(heard):
            self._heard[said.state] = said
        if self._asked and said[:4] == self._asked[:4]:
            return self._respond(self._asked, said.action)
        return ()

    def _hold(self, hear, said, what):
        """
        Keep a message of another run for the world that it may belong to.

        It is refused as soon as the world here is heard to go on.
        """
        self._early[hear] = said, what
        return ()

    def _refuse_held(self):
        early, self._early = self._early, {}
        return tuple(problem_of_run(said, self._run, what) for said, what in early.values())

    def _problem_of_turn(self, said):
        """`Refused` for a question that cannot be the next one, or None."""
        episode, step = self._answered
        if self._answered == NOT_YET or turn(said) <= self._answered:
            return None
        if turn(said) in ((episode, step + 1), (episode + 1, 0)):
            return None
        return Refused('question out of turn', f'a state must follow turn {self._answered}, '
                       f'got {turn(said)}: is there another learner?')

    def _respond(self, asked, advice):
        """Change the memory: choose, then learn. Return what is to be said."""
        s, u = asked.state, self._draws.row()
        a, p = NO_ACTION, 0.0
        if not asked.terminated:
            a, p = self.student.choose(s, advice, asked.step, u)
        self._learn_from(asked, a)
        self.student.weigh(advice, p)
        self._previous = s, a, advice
        self._answered, self._asked = turn(asked), None
        if asked.terminated or asked.truncated:
            return self._end_episode(asked)
        followed = advice != NO_ACTION and u[0] < p
        self._answer = Action(*asked[:3], a, followed, p)
        return (self._answer,)

    def _learn_from(self, asked, a):
        """Change the memory by the step that led here, if it is known where it began."""
        if asked.step == 0:
            self.student.begin_episode()
        elif (asked.episode, asked.step - 1) != self._answered:
            self.student.lose_track()
        else:
            s, b, advice = self._previous
            self.student.learn(s, b, asked.reward, asked.state, a, asked.terminated, advice)

    def _end_episode(self, asked):
        """Return the `Action` that lets the next episode begin, and the `Progress` if any."""
        self._answer = Action(*asked[:3], NO_ACTION, False, 0.0)
        progress = self.student.end_episode()
        if progress is None:
            return (self._answer,)
        progress = progress._replace(run=self._run)
        if self.finished:
            self._answer = None
            return (progress,)
        return (self._answer, progress)

    def _forget_the_turn(self):
        self._answered, self._answer = NOT_YET, None
        self._asked, self._previous, self._heard = None, None, {}
