# SPDX-License-Identifier: Apache-2.0
"""What a learner does in one world, step by step, whoever brings the messages."""

from comply_ros.learner.confidence import apply_advice_prior
from comply_ros.learner.learner_state import LearnerState, TEMPERATURE
from comply_ros.learner.model import end_episode
from comply_ros.learner.reconfigure import changed_memory
from comply_ros.learner.update_rules import choose, decay_schedules, learn
from comply_ros.numerics.summation import mean_in_order
from comply_ros.protocol.messages import Progress
from comply_ros.world.grid import NO_ACTION

# What it is besides its memory.
FACTS = ('iterations_done', 'steps', 'finished', '_seen_whole', '_return', '_returns', '_weighed',
         '_trusted')


class Student:
    """
    A learner in one world: chooses, learns, and counts its iterations.

    Parameters
    ----------
    world: the `World`.
    method: the `LearnerConfig`.

    Attributes
    ----------
    memory: the `LearnerState`.
    steps, iterations_done: so far.
    finished: True when all iterations are done.

    """

    def __init__(self, world, method):
        self._use(LearnerState.fresh(world, method), method)
        self.iterations_done, self.steps, self.finished = 0, 0, False
        self._begin_iteration()
        self.lose_track()

    def change(self, world, method):
        """Change into one that goes on by another method; one that rests may have more to do."""
        self.finished &= method.iterations == self._method.iterations
        self._use(changed_memory(self.memory, world, self._method, method), method)

    def _use(self, memory, method):
        self.memory, self._method = memory, method
        self._numbers, self._views = method.numbers(), memory.views()

    def lose_track(self):
        """Change the memory by the end of what led here; the episode does not count."""
        self._end_traces()
        self._seen_whole, self._return = False, 0.0

    def begin_episode(self):
        """Begin an episode that is seen from its first state."""
        self.lose_track()
        self._seen_whole = True

    def choose(self, s, advice, step, draws):
        """
        Change the memory by what hearing advice changes; return the action in s, and p.

        draws: uniforms, to listen and to act.
        """
        if self._learns():
            q, visits, belief, _, schedule, *_ = self._views
            apply_advice_prior(s, advice, self._numbers, q, visits, belief, schedule)
        return choose(s, advice, step, *draws, self._numbers, *self._views)

    def record_confidence(self, advice, p):
        """Count a decision that had advice, and the confidence p in it."""
        if advice != NO_ACTION:
            self._weighed, self._trusted = self._weighed + 1, self._trusted + p

    def learn(self, s, a, r, s2, a2, done, advice):
        """Change the memory by one step, and count it."""
        self._return += r
        self.steps += 1
        if self._learns():
            learn(s, a, r, s2, a2, done, advice, self._numbers, *self._views)

    def end_episode(self):
        """Change the memory; return the `Progress` (of run 0) if the iteration ends, or None."""
        self._end_traces()
        if self._seen_whole:
            self._returns.append(self._return)
        if len(self._returns) < self._method.episodes:
            return None
        self.iterations_done += 1
        self.finished = self.iterations_done == self._method.iterations
        progress = self._progress()
        decay_schedules(progress.mean_return, self._numbers, self.memory.schedule)
        self._begin_iteration()
        return progress

    def state(self):
        """Return facts that JSON can write, and the arrays of the memory by name."""
        facts = {name: getattr(self, name) for name in FACTS}
        return facts, dict(zip(self.memory.__dataclass_fields__, self.memory.arrays()))

    def restore(self, facts, arrays):
        """Change into what a state was; raises ValueError where an array does not fit."""
        for name in FACTS:
            setattr(self, name, facts[name])
        for name, array in zip(self.memory.__dataclass_fields__, self.memory.arrays()):
            if arrays[name].shape != array.shape:
                raise ValueError(f'{name} must have the shape {array.shape}, '
                                 f'got {arrays[name].shape}')
            array[...] = arrays[name]

    def _progress(self):
        return Progress(
            0, self.iterations_done, self._method.iterations, len(self._returns), self.steps,
            mean_in_order(self._returns),
            self._trusted / self._weighed if self._weighed else float('nan'),
            float(self.memory.schedule[TEMPERATURE]), self.finished)

    def _learns(self):
        return self.iterations_done >= self._method.measuring_iterations

    def _end_traces(self):
        q, visits, _, _, _, traces, trail, outcomes = self._views
        end_episode(self._numbers, q, visits, outcomes, traces, trail)

    def _begin_iteration(self):
        self._returns, self._weighed, self._trusted = [], 0, 0.0
