# SPDX-License-Identifier: Apache-2.0
"""A mentor node whose advice a person gives, while it runs; a page or a terminal is its face."""

from concurrent.futures import Future
from queue import Empty, SimpleQueue
import time

from comply_msgs.srv import Recommend
import numpy as np

from comply_ros.mentor.mentor_policies import MentorError, spoiled_policy
from comply_ros.mentor.policy_text import PolicyError
from comply_ros.nodes.mentor import in_background, map_of_advice, recommends
from comply_ros.nodes.parameters import PATIENCE, sets
from comply_ros.nodes.protocol_node import ProtocolNode
from comply_ros.nodes.topics import MENTOR_POLICY, RECOMMEND, RECOMMENDATION, STATE, WORLD
from comply_ros.protocol.human_mentor import HumanMentor
from comply_ros.protocol.validation import rejected_description
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.storage.policy_files import read_policy, write_policy

PERIOD = 0.1  # least seconds between two messages on `mentor_policy`
LOOK = 0.02  # seconds between looks at who waits


class HumanMentorNode(ProtocolNode):
    """
    Recommends what a person paints or steers; without advice at first.

    All methods are for the thread that spins the node; `do` is for any other. Where the learner
    remembers advice, it waits for a person only in states in which nothing was said yet.

    Raises
    ------
    ParameterError: for a parameter that cannot be.

    """

    def __init__(self, **kwargs):
        super().__init__('mentor', **kwargs)
        self.actor = HumanMentor()
        self._patience = self.declare(PATIENCE)
        self._waiting, self._since = None, 0.0
        self._mapped, self._stale, self._said_map = None, False, float('-inf')
        self._deeds, self._making = SimpleQueue(), []
        for topic in (RECOMMENDATION, MENTOR_POLICY):
            self.advertise(topic)
        self.serves(Recommend, RECOMMEND, recommends(self.actor))
        self.subscribe(WORLD, self.on_world)
        self.subscribe(STATE, self.actor.observe)
        sets(self, self._set_patience)
        self.create_timer(LOOK, self._look_around)

    @property
    def policy(self):
        """`advice[s]`, int8, not to be changed in place; None before there is a world."""
        return self.actor.painted

    @property
    def steering(self):
        """Whether the robot's questions wait for the person; may be set."""
        return self.actor.steering

    @steering.setter
    def steering(self, wanted):
        self.answer(self.actor.take_the_wheel(bool(wanted)))

    @property
    def seconds_left(self):
        """Seconds that the robot still waits for the person; None where it does not."""
        if self.actor.waiting is None or self._waiting is not self.actor.waiting:
            return None
        return max(0.0, self._since + self._patience - time.monotonic())

    def paint(self, cells):
        """
        Advise otherwise in some states from the next question on.

        cells: table of actions by state; -1 for no advice.

        Raises
        ------
        ValueError: with one sentence for the person; then nothing changes.

        """
        self.actor.paint(cells)
        self._republish()

    def use(self, policy):
        """Advise by `policy[s]` from the next question on; raises ValueError as `paint` does."""
        self.actor.replace(policy)
        self._republish()

    def erase(self):
        """Say nothing anywhere; raises ValueError before there is a world."""
        self.paint(dict.fromkeys(range(len(self._policy_needed())), -1))

    def steer(self, action):
        """Answer the question that waits; return whether one did. Raises ValueError as `paint`."""
        outputs = self.actor.steer(action)
        self.answer(outputs)
        if outputs:
            self._republish()
        return bool(outputs)

    def load(self, path):
        """Advise by a policy file; raises ValueError with one sentence."""
        self._policy_needed()
        self.use(read_policy(path, self.actor.world))

    def save(self, path):
        """Write the policy to a file; raises ValueError with one sentence."""
        write_policy(path, self._policy_needed(), self.actor.world)

    def spoil(self, share, seed=0):
        """
        Advise, in a share of the states, any action of the cell.

        Raises
        ------
        ValueError: for a share outside of [0, 1], or before there is a world.

        """
        if not 0.0 <= share <= 1.0:
            raise MentorError(f'a share must lie in [0, 1], got {share}')
        generator = np.random.Generator(np.random.PCG64(seed))
        self.use(spoiled_policy(self._policy_needed(), self.actor.world, share, generator))

    def begin_from(self, spec, seed=0):
        """
        Advise as a generated mentor does, as soon as it is made; some take seconds.

        spec: as the parameter `mentor` of a mentor node, such as 'noisy:0.2'.

        Returns
        -------
        concurrent.futures.Future: done when it is used, or with the error that a person can read.

        Raises
        ------
        ValueError: for an unknown mentor, or before there is a world.

        """
        self._policy_needed()
        made = in_background(mentor_policy, read_mentor_spec(spec), self.actor.world, seed)
        used = Future()
        self._making.append((made, used, self.actor.world))
        return used

    def do(self, deed):
        """Have the thread that spins this node call `deed()` soon; return the `Future` of it."""
        future = Future()
        self._deeds.put((deed, future))
        return future

    def on_world(self, msg):
        """Return what is to be said about a world, with the map of all advice in a new run."""
        try:
            return self._with_map(self.actor.on_world(msg))
        except ValueError as error:
            return (rejected_description(error),)

    def look(self):
        """Return what is to be said if another world is attended to now."""
        return self._with_map(super().look())

    def words(self):
        """How it is while all is well."""
        return 'waits for the person' if self.actor.waiting else 'runs'

    def _policy_needed(self):
        if self.policy is None:
            raise PolicyError('a policy must be for a world, and none is known yet')
        return self.policy

    def _with_map(self, outputs):
        described = self.actor.described
        if described is None or described.run == self._mapped:
            return outputs
        self._mapped = described.run
        return (map_of_advice(self.actor), *outputs)

    def _set_patience(self, values):
        self._patience = values.get(PATIENCE.name, self._patience)

    def _look_around(self):
        """Lose patience with the person, say the map if it is due, use what was made."""
        now, waiting = time.monotonic(), self.actor.waiting
        if waiting is not self._waiting or self.paused:
            self._waiting, self._since = waiting, now
        elif waiting is not None and now - self._since >= self._patience:
            self.answer(self.actor.give_up())
        self._say_map()
        self._use_what_was_made()
        self._do_all()

    def _republish(self):
        self._stale = True
        self._say_map()

    def _say_map(self):
        now = time.monotonic()
        if self._stale and now - self._said_map >= PERIOD:
            self._stale, self._said_map = False, now
            self.answer((map_of_advice(self.actor),))

    def _use_what_was_made(self):
        for each in [each for each in self._making if each[0].done()]:
            self._making.remove(each)
            made, used, world = each
            resolve(used, lambda: self._use_in(world, made.result()))

    def _use_in(self, world, policy):
        if world is not self.actor.world:
            raise PolicyError('a policy must be for the world that is here, and that one is gone')
        self.use(policy)

    def _do_all(self):
        while True:
            try:
                deed, future = self._deeds.get_nowait()
            except Empty:
                return
            resolve(future, deed)


def resolve(future, deed):
    """Change a `Future` into what a call returns or raises."""
    try:
        future.set_result(deed())
    except Exception as error:  # noqa: BLE001 - whoever asks for the result gets it
        future.set_exception(error)
