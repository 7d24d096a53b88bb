# SPDX-License-Identifier: Apache-2.0
"""World, learner and several mentors on a network that keeps no order; the learner may die."""

from random import Random

from actor_network import RUN

from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    LEARNER_JOURNAL,
    Recommendation,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage.checkpoint_store import CheckpointStore

MOMENTS = BEFORE_JOURNAL, BEFORE_PUBLISHING, _ = (
    'before the journal is written', 'before its outputs are published', 'after that')


class MentorsNetwork:
    """
    A world, a learner and its mentors on a network that delivers in any order, at times twice.

    Parameters
    ----------
    policies: (`policy[s]`, budget) of each mentor, by its name.

    Attributes
    ----------
    on_the_way: (subscriber, message) of what was published and not delivered yet; the subscriber
        is 'world', 'learner' or the place of a mentor.
    reports: outputs that none of them subscribes to.

    """

    def __init__(self, config, source, policies, seed, shuffle: Random, remembers_advice=True):
        self.world = WorldMachine(source, 'map', RUN, seed)
        self.mentors = [Mentor(budget, name=name) for name, (_, budget) in policies.items()]
        self.policies = [policy for policy, _ in policies.values()]
        self.new_learner = lambda: Learner(config, seed, remembers_advice,
                                           mentors=tuple(policies))
        self.learner, self.shuffle = self.new_learner(), shuffle
        self.on_the_way, self.reports = [], []
        self.publish((self.world.description, self.world.observation))

    def publish(self, outputs):
        """Put messages on the way to each of their subscribers."""
        for msg in outputs:
            kind, mentors = type(msg), range(len(self.mentors))
            subscribers = {WorldDescription: (*mentors, 'learner'), Action: ('world',),
                           StateReward: (*mentors, 'learner'), Recommendation: ('learner',)}
            self.on_the_way += [(each, msg) for each in subscribers.get(kind, ())]
            if kind not in subscribers:
                self.reports.append(msg)

    def receive(self, subscriber, msg):
        """Let one of them receive a message; return its outputs."""
        if subscriber == 'world':
            return self.world.on_action(msg)
        actor = self.learner if subscriber == 'learner' else self.mentors[subscriber]
        if type(msg) is StateReward:
            return actor.observe(msg)
        if type(msg) is Recommendation:
            return actor.receivers[actor.mentors.index(msg.mentor)](msg)
        outputs = actor.on_world(msg)
        if actor is not self.learner and actor.policy is None:
            outputs = (*outputs, *actor.use(self.policies[subscriber]))
        return outputs

    def deliver_one(self):
        """Deliver one message; it may be delivered again."""
        index = self.shuffle.randrange(len(self.on_the_way))
        subscriber, msg = self.on_the_way[index]
        if self.shuffle.random() > 0.1:
            del self.on_the_way[index]
        self.answer(subscriber, self.receive(subscriber, msg))

    def answer(self, subscriber, outputs):
        """Publish the outputs of one of them."""
        self.publish(outputs)

    def run(self):
        """Deliver until the learner has finished; return this network."""
        for _ in range(1_000_000):
            if self.learner.finished:
                return self
            if self.on_the_way:
                self.deliver_one()
            else:
                self.pass_second()
        raise AssertionError(f'{self.world.observation}: {self.learner.waiting_for()}')

    def pass_second(self):
        """Let nobody answer any more: without a kill, that is a fault."""
        raise AssertionError(f'{self.world.observation}: {self.learner.waiting_for()}')


class MortalLearnerNetwork(MentorsNetwork):
    """
    The same, where the learner has a state on disk and may be killed by what it receives.

    Parameters
    ----------
    folder: for the state.
    rate: probability that it is killed by a message.

    Attributes
    ----------
    kills: number of kills so far.

    """

    def __init__(self, folder, rate, *arguments):
        self.folder, self.rate, self.kills = folder, rate, 0
        self.store = CheckpointStore(folder, 'learner', {}, LEARNER_JOURNAL)
        self.store.load()
        super().__init__(*arguments)

    def answer(self, subscriber, outputs):
        """Publish outputs; those of the learner after its journal, and it may be killed."""
        if subscriber != 'learner':
            self.publish(outputs)
            return
        moment = self.shuffle.choice(MOMENTS) if self.shuffle.random() < self.rate else None
        if outputs and moment != BEFORE_JOURNAL:
            self.save()
            if moment != BEFORE_PUBLISHING:
                self.publish(outputs)
        if moment:
            self.kill()

    def save(self):
        """Write the journal of the learner, or a checkpoint."""
        if self.learner.needs_checkpoint:
            self.store.write_checkpoint(*self.learner.state_dict())
            self.learner.needs_checkpoint = False
        else:
            self.store.append(self.learner.journal_entries)
        self.learner.journal_entries.clear()
        if self.store.is_checkpoint_due():
            self.store.write_checkpoint(*self.learner.state_dict())

    def kill(self):
        """Kill the learner, with all that is on its way; it continues from its state."""
        self.kills += 1
        self.store.close()
        self.store = CheckpointStore(self.folder, 'learner', {}, LEARNER_JOURNAL)
        self.on_the_way = [each for each in self.on_the_way if each[0] != 'learner']
        self.learner, saved = self.new_learner(), self.store.load()
        if saved:
            self.learner.load_state_dict(*saved)
            self.publish(self.learner.last_outputs())
        self.on_the_way.append(('learner', self.world.description))

    def pass_second(self):
        """Let a second pass: the world repeats its observation."""
        self.answer('learner', self.learner.tick())
        self.publish((self.world.observation,))
