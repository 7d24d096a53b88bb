# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner are killed at any moment, and the digest is that without a kill."""

from dataclasses import replace
import os
from pathlib import Path
import random
from tempfile import TemporaryDirectory

from actor_network import RUN, ShuffledNetwork
from bar_grid_training import PRESETS, use_plain_kernels, use_shared_code
import pytest
from tiny_tables import frozen_lake, machine
from tiny_worlds import grid

from comply_ros.learner import agent
from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy, sparse_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    Episode,
    LEARNER_JOURNAL,
    Notice,
    Progress,
    ReceivedAction,
    Recommendation,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.world import WorldMachine
from comply_ros.storage import checkpoint_store
from comply_ros.storage.checkpoint_store import CheckpointStore
from comply_ros.world.mdp import World

SEED = 4
ROOM = grid('....G', '.##..', '....#', '.....', starts=(0, 4), limit=40)
SUBSCRIBERS = {
    WorldDescription: (('mentor', 'on_world'), ('learner', 'on_world')),
    StateReward: (('mentor', 'observe'), ('learner', 'observe')),
    Recommendation: (('learner', 'on_recommendation'),),
    Action: (('world', 'on_action'), ('mentor', 'on_action'))}
PUBLISHES = {'world': (WorldDescription, StateReward), 'mentor': (Recommendation,),
             'learner': (Action,)}
JOURNAL = {'world': (ReceivedAction,), 'mentor': (StateReward, ReceivedAction),
           'learner': LEARNER_JOURNAL}
BEFORE_JOURNAL, BEFORE_PUBLISHING, AFTER_PUBLISHING = MOMENTS = (
    'before the journal is written', 'before its outputs are published', 'after that')


class MortalNetwork(ShuffledNetwork):
    """
    A network on which each of the three has a state as its node has, and may be killed.

    The last message of a topic is latched: a node that comes back receives it while its
    publisher lives.

    Parameters
    ----------
    folder: for the states.
    rate: probability that the receiver of a message is killed.

    Attributes
    ----------
    kills: number of kills so far.
    moves: (state, action, reward, next state) of every move of the world.

    """

    def __init__(self, folder, rate, config, grid, policy, seed, shuffle, remembers_advice=True,
                 budget=0, mode='early'):
        self.folder, self.rate, self.kills = folder, rate, 0
        self.latched, self.stores, self.moves = {}, {}, set()
        super().__init__(config, grid, policy, seed, shuffle, remembers_advice, budget, mode)
        self._make = {
            'world': lambda: WorldMachine(grid, 'map', RUN, SEED),
            'mentor': lambda: Mentor(budget, mode),
            'learner': lambda: Learner(config, SEED, remembers_advice, 1 + self.kills)}
        self.on_the_way, self.latched = [], {}
        for name in ('learner', 'mentor', 'world'):
            self.start(name)

    def start(self, name):
        """Start one of the three; it continues from its state, if there is one."""
        actor = self._make[name]()
        setattr(self, name, actor)
        if name != 'mentor':
            saved = self.load(name)
            if saved:
                actor.load_state_dict(*saved)
            if saved or name == 'world':
                self.answer(name, actor.last_outputs())
        for message_type, msg in self.latched.items():
            self.on_the_way += [(subscriber, msg) for subscriber in self.subscribers(message_type)
                                if subscriber[0] == name]

    def load(self, name):
        """Return the checkpoint and the journal of one of the three."""
        self.stores[name] = CheckpointStore(self.folder, name, {}, JOURNAL[name])
        return self.stores[name].load()

    def kill(self, name):
        """Kill one of the three, with what it has not received yet; start it again."""
        self.kills += 1
        if name in self.stores:
            self.stores.pop(name).close()
        lost = PUBLISHES[name] if self.shuffle.random() < 0.5 else ()
        self.on_the_way = [(subscriber, msg) for subscriber, msg in self.on_the_way
                           if subscriber[0] != name and type(msg) not in lost]
        for message_type in PUBLISHES[name]:
            self.latched.pop(message_type, None)
        self.start(name)

    def publish(self, msg):
        """Put a message on the way to each of its subscribers; latch it."""
        if type(msg) in SUBSCRIBERS:
            self.latched[type(msg)] = msg
            self.on_the_way += [(subscriber, msg) for subscriber in self.subscribers(type(msg))]
        else:
            self.reports.append(msg)

    def subscribers(self, message_type):
        """Return (name, method) that receive a type; a mentor only actions that it needs."""
        return [(name, method) for name, method in SUBSCRIBERS[message_type]
                if method != 'on_action' or name == 'world' or self.mentor.watches]

    def answer(self, name, outputs):
        """Write the journal of an actor, then publish its outputs, as `ProtocolNode` does."""
        if outputs:
            self.save(name)
            for msg in outputs:
                self.publish(msg)

    def save(self, name):
        """Write the journal of an actor, or a checkpoint."""
        actor, store = getattr(self, name), self.stores.get(name)
        if store and actor.needs_checkpoint:
            store.write_checkpoint(*actor.state_dict())
            actor.needs_checkpoint = False
        elif store:
            store.append(actor.journal_entries)
        actor.journal_entries.clear()
        if store and store.is_checkpoint_due():
            store.write_checkpoint(*actor.state_dict())

    def receive(self, name, method, msg):
        """Let one of the three receive a message; return its outputs."""
        actor = getattr(self, name)
        if name == 'world':
            before = self.world.observation
            outputs = actor.on_action(msg)
            after = self.world.observation
            if after.episode == before.episode and after.step > before.step:
                self.moves.add((before.state, msg.action, after.reward, after.state))
            return outputs
        outputs = getattr(actor, method)(msg)
        if method == 'on_world' and name == 'mentor' and actor.policy is None:
            saved = self.load('mentor') if actor.has_budget else None
            return (*outputs, *actor.use(self.policy, saved))
        return outputs

    def deliver_one(self):
        """Deliver one message; its receiver may be killed by it."""
        index = self.shuffle.randrange(len(self.on_the_way))
        (name, method), msg = self.on_the_way[index]
        if self.shuffle.random() > 0.1:
            del self.on_the_way[index]
        moment = self.shuffle.choice(MOMENTS) if self.shuffle.random() < self.rate else None
        outputs = self.receive(name, method, msg)
        if outputs and moment == BEFORE_PUBLISHING:
            self.save(name)
        elif moment != BEFORE_JOURNAL:
            self.answer(name, outputs)
        if moment:
            self.kill(name)

    def run(self):
        """Deliver until the learner has finished; the world repeats its observation."""
        repetitions, before = 0, None
        while not self.learner.finished:
            if self.on_the_way:
                self.deliver_one()
                continue
            repetitions = repetitions + 1 if self.world.observation[:3] == before else 0
            before = self.world.observation[:3]
            assert repetitions < 50, (self.world.observation, self.learner.waiting_for())
            for name in ('learner', 'mentor'):  # a second passes
                self.answer(name, getattr(self, name).tick())
            self.publish(self.world.observation)
        return self

    def close(self):
        """Close the states."""
        for store in self.stores.values():
            store.close()


@pytest.fixture
def folder(tmp_path):
    """Return a folder in memory where there is one: the tests write a thousand files there."""
    memory = Path('/dev/shm')
    with TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else tmp_path) as made:
        yield Path(made)


@pytest.fixture
def network(folder, monkeypatch):
    """Return a function that makes a `MortalNetwork`, with frequent checkpoints."""
    monkeypatch.setattr(checkpoint_store, 'RECORDS_PER_CHECKPOINT', 60)
    for name in ('fsync', 'fdatasync'):  # a kill takes nothing that was written
        monkeypatch.setattr(os, name, lambda file: None)
    made = []

    def make(*arguments, **settings):
        made.append(MortalNetwork(folder, *arguments, **settings))
        return made[-1]
    yield make
    for each in made:
        each.close()


def reports(network, report_type, number):
    """Return the reports of a type by their number; those published twice must be the same."""
    found = {}
    for report in network.reports:
        if isinstance(report, report_type):
            assert repr(found.setdefault(report[number], report)) == repr(report)
    return list(found.values())


def check(network, training, results):
    """Fail unless what was learned and reported is as in the compiled loop."""
    network.kill('learner')
    assert network.learner.finished
    assert network.learner.state.digest() == training.state.digest()
    progress = reports(network, Progress, 1)
    assert [msg.mean_return for msg in progress] == [each.mean_return for each in results]
    assert repr([msg.confidence for msg in progress]) == repr(
        [each.confidence for each in results])
    assert progress[-1].steps == sum(each.steps for each in results)
    assert sum(msg.steps for msg in reports(network, Episode, 1)) == progress[-1].steps


@pytest.mark.parametrize('profile, name', PRESETS)
def test_with_kills_at_any_moment_the_digest_is_that_of_a_training_in_one_process(
        network, monkeypatch, profile, name):
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    config = replace(find_method(name, profile), episodes=1, iterations=2)
    use_shared_code(monkeypatch, config)
    training = Training(World(ROOM), policy, config, SEED)
    results = [training.iterate() for _ in range(2)]
    rate = min(0.15, 4 / sum(each.steps for each in results))  # about thirty kills in a long one
    mortal = network(rate, config, ROOM, policy, SEED, random.Random(name),
                     len(name) % 2 == 0).run()
    check(mortal, training, results)
    assert mortal.kills > 10


@pytest.mark.parametrize('name', ['explicit', 'head_start'])
@pytest.mark.parametrize('source, episodes', [(machine(), 4), (frozen_lake(), 1)],
                         ids=['machine', 'lake'])
def test_a_world_that_is_a_table_survives_kills_too(network, monkeypatch, source, episodes, name):
    use_plain_kernels(monkeypatch)
    policy = noisy_policy(World(source), 0.3, random_streams(8)[0])
    config = replace(find_method(name, 'published'), episodes=episodes, iterations=2)
    training = Training(World(source), policy, config, SEED)
    results = [training.iterate() for _ in range(2)]
    rate = min(0.15, 6 / sum(each.steps for each in results))
    mortal = network(rate, config, source, policy, SEED, random.Random(name)).run()
    check(mortal, training, results)
    assert mortal.kills > 2


@pytest.mark.parametrize('mode, remembers_advice', [
    ('early', True), ('early', False), ('important', True)])
@pytest.mark.parametrize('rate', [0.05, pytest.param(0.3, marks=pytest.mark.long)])
def test_a_mentor_with_a_budget_may_be_killed_too(network, mode, remembers_advice, rate):
    policy = sparse_policy(noisy_policy(World(ROOM), 0.3, random_streams(8)[0]), World(ROOM), 0.8,
                           2)
    config = replace(find_method('explicit', 'published'), episodes=2, iterations=2)
    budget = AdviceBudget(World(ROOM), policy, 5, mode)
    training = Training(World(ROOM), budget, config, SEED)
    results = [training.iterate() for _ in range(2)]
    mortal = network(rate, config, ROOM, policy, SEED, random.Random(mode), remembers_advice,
                     budget=5, mode=mode).run()
    check(mortal, training, results)
    assert budget.remaining[0] < 5


def test_a_restarted_learner_knows_the_advice_that_it_has_received(network, monkeypatch):
    monkeypatch.setattr(checkpoint_store, 'RECORDS_PER_CHECKPOINT', 10 ** 6)
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    config = replace(find_method('explicit', 'published'), episodes=2, iterations=2)
    mortal = network(0.0, config, ROOM, policy, SEED, random.Random(1)).run()
    before = mortal.learner.advice().tolist()
    assert len(set(before)) > 1
    mortal.kill('learner')
    assert mortal.learner.advice().tolist() == before


@pytest.mark.parametrize('lost', [2, 7, 40])
@pytest.mark.parametrize('name', ['sarsa', 'explicit', 'watkins', 'head_start'])
def test_a_learner_whose_journal_lost_its_end_continues_and_learns_no_wrong_step(
        network, monkeypatch, name, lost):
    monkeypatch.setattr(checkpoint_store, 'RECORDS_PER_CHECKPOINT', 10 ** 6)
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    config = replace(find_method(name, 'published'), episodes=2, iterations=4,
                     measuring_iterations=0)
    learned, plain = [], agent.PLAIN

    def record(s, a, r, s2, *rest):
        learned.append((s, a, r, s2))
        plain.learn(s, a, r, s2, *rest)
    monkeypatch.setattr(agent, 'PLAIN', plain._replace(learn=record))
    mortal = network(0.0, config, ROOM, policy, SEED, random.Random(lost))
    for _ in range(300):
        if mortal.on_the_way:
            mortal.deliver_one()
        else:
            mortal.publish(mortal.world.observation)
    mortal.stores.pop('learner').close()
    journal, = mortal.folder.glob('learner.*.journal')
    os.truncate(journal, journal.stat().st_size - lost * 40)  # in the middle of a record
    mortal.start('learner')
    mortal.run()
    notices = [msg.text for msg in mortal.reports if isinstance(msg, Notice)]
    assert any(text.startswith('continues at step id') for text in notices)
    assert len(learned) > 50 and set(learned) <= mortal.moves
