# SPDX-License-Identifier: Apache-2.0
"""World, mentor and learner are killed at any moment, and the digest is that of who lived on."""

from dataclasses import replace
import os
from pathlib import Path
import random
from tempfile import TemporaryDirectory

import pytest
from test_presets import ROWS
from test_protocol_digests import Table
from tiny_worlds import grid

from comply_ros.learner.presets import find_method
from comply_ros.learner.student import Student
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy, sparse_policy
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    AnsweredObservation,
    Episode,
    Notice,
    Progress,
    Recommendation,
    StateReward,
    WorldDescription,
)
from comply_ros.storage import state_store
from comply_ros.storage.state_store import StateStore
from comply_ros.world.mdp import World

SEED, RUN = 4, 7
ROOM = grid('....G', '.##..', '....#', '.....', starts=(0, 4), limit=40)
LISTENERS = {
    WorldDescription: (('mentor', 'on_world'), ('learner', 'on_world')),
    StateReward: (('mentor', 'observe'), ('learner', 'observe')),
    Recommendation: (('learner', 'on_recommendation'),),
    Action: (('world', 'on_action'), ('mentor', 'on_action'))}
SAYS = {'world': (WorldDescription, StateReward), 'mentor': (Recommendation,),
        'learner': (Action,)}
KINDS = {'world': (Action,), 'mentor': (StateReward, Action),
         'learner': (AnsweredObservation, Recommendation)}
MOMENTS = ('before it is kept', 'before it is said', 'after it was said')


class MortalTable(Table):
    """
    A table at which each of the three keeps its state as its node does, and may be killed.

    What was said last on a topic is latched: who comes back hears it, while its speaker lives.
    """

    def __init__(self, folder, rate, *arguments, **settings):
        self.folder, self.rate, self.kills = folder, rate, 0
        self.latched, self.keepers, self.moves = {}, {}, set()
        super().__init__(*arguments, **settings)
        self.method, self.grid, self.remembers = arguments[0], arguments[1], (
            self.learner._remembers_advice)
        self.budget, self.when = settings.get('budget', 0), settings.get('when', 'early')
        self.open, self.latched = [], {}
        for name in ('learner', 'mentor', 'world'):
            self.revive(name)

    def make(self, name):
        """Return one of the three as it starts."""
        if name == 'world':
            return GridWorld(self.grid, 'map', RUN, SEED)
        if name == 'mentor':
            return Mentor(self.budget, self.when)
        return Learner(self.method, SEED, self.remembers, 1 + self.kills)

    def revive(self, name):
        """Start one of the three; it goes on from what was kept."""
        actor = self.make(name)
        setattr(self, name, actor)
        if name != 'mentor':
            kept = self.recall(name)
            if kept:
                actor.restore(*kept)
            if kept or name == 'world':
                self.answer(name, actor.recall())
        for kind, msg in self.latched.items():
            self.open += [(listener, msg) for listener in self.listeners(kind)
                          if listener[0] == name]

    def recall(self, name):
        """Return what was kept."""
        self.keepers[name] = StateStore(self.folder, name, {}, KINDS[name])
        return self.keepers[name].load()

    def kill(self, name):
        """End one of the three, with what it has not heard yet; start it again."""
        self.kills += 1
        if name in self.keepers:
            self.keepers.pop(name).close()
        lost = SAYS[name] if self.shuffle.random() < 0.5 else ()
        self.open = [(listener, msg) for listener, msg in self.open
                     if listener[0] != name and type(msg) not in lost]
        for kind in SAYS[name]:
            self.latched.pop(kind, None)
        self.revive(name)

    def lay(self, msg):
        """Put a message on the table for each listener; latch it."""
        if type(msg) in LISTENERS:
            self.latched[type(msg)] = msg
            self.open += [(listener, msg) for listener in self.listeners(type(msg))]
        else:
            self.reports.append(msg)

    def listeners(self, kind):
        """Return who hears messages of a kind: a mentor hears actions only where they matter."""
        return [(name, hear) for name, hear in LISTENERS[kind]
                if hear != 'on_action' or name == 'world' or self.mentor.watches]

    def answer(self, name, outputs):
        """Keep what an actor was told, then say what it answers, as `ProtocolNode` does."""
        if outputs:
            self.keep(name)
            for msg in outputs:
                self.lay(msg)

    def keep(self, name):
        """Keep what an actor was told."""
        actor, keeper = getattr(self, name), self.keepers.get(name)
        if keeper and actor.begins:
            keeper.write_checkpoint(*actor.state())
            actor.begins = False
        elif keeper:
            keeper.append(actor.told)
        actor.told.clear()
        if keeper and keeper.is_checkpoint_due():
            keeper.write_checkpoint(*actor.state())

    def hear(self, name, hear, msg):
        """Return what one of the three has to say about a message."""
        actor = getattr(self, name)
        if name == 'world':
            before = self.world.question
            outputs = actor.on_action(msg)
            after = self.world.question
            if after.episode == before.episode and after.step > before.step:
                self.moves.add((before.state, msg.action, after.reward, after.state))
            return outputs
        outputs = getattr(actor, hear)(msg)
        if hear == 'on_world' and name == 'mentor' and actor.policy is None:
            kept = self.recall('mentor') if actor.remembers else None
            return (*outputs, *actor.use(self.policy, kept))
        return outputs

    def step_id(self):
        """Let somebody hear one message, and perhaps be killed by it."""
        index = self.shuffle.randrange(len(self.open))
        (name, hear), msg = self.open[index]
        if self.shuffle.random() > 0.1:
            del self.open[index]
        moment = self.shuffle.choice(MOMENTS) if self.shuffle.random() < self.rate else None
        outputs = self.hear(name, hear, msg)
        if outputs and moment == 'before it is said':
            self.keep(name)
        elif moment != 'before it is kept':
            self.answer(name, outputs)
        if moment:
            self.kill(name)

    def hold(self):
        """Let them talk until the learner has finished; the world repeats its question."""
        silent, before = 0, None
        while not self.learner.finished:
            if self.open:
                self.step_id()
                continue
            silent = silent + 1 if self.world.question[:3] == before else 0
            before = self.world.question[:3]
            assert silent < 50, (self.world.question, self.learner.waiting_for())
            for name in ('learner', 'mentor'):  # a second goes by
                self.answer(name, getattr(self, name).look())
            self.lay(self.world.question)
        return self

    def close(self):
        """Close what is kept."""
        for keeper in self.keepers.values():
            keeper.close()


@pytest.fixture
def folder(tmp_path):
    """Return a folder in memory where there is one: a thousand files are made there."""
    memory = Path('/dev/shm')
    with TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else tmp_path) as made:
        yield Path(made)


@pytest.fixture
def table(folder, monkeypatch):
    """Return a function that makes a table, on which snapshots are frequent."""
    monkeypatch.setattr(state_store, 'RECORDS_PER_CHECKPOINT', 60)
    for name in ('fsync', 'fdatasync'):  # a kill takes nothing that was written
        monkeypatch.setattr(os, name, lambda file: None)
    made = []

    def make(*arguments, **settings):
        made.append(MortalTable(folder, *arguments, **settings))
        return made[-1]
    yield make
    for each in made:
        each.close()


def reports(table, kind, number):
    """Return the reports of a kind by their number; what was said twice was the same."""
    msg = {}
    for report in table.reports:
        if isinstance(report, kind):
            assert repr(msg.setdefault(report[number], report)) == repr(report)
    return list(msg.values())


def check(table, training, iterations):
    """Fail unless all that was learned and said is as in the compiled loop."""
    table.kill('learner')
    assert table.learner.finished
    assert table.learner.memory.digest() == training.memory.digest()
    progress = reports(table, Progress, 1)
    assert [msg.mean_return for msg in progress] == [it.mean_return for it in iterations]
    assert repr([msg.confidence for msg in progress]) == repr([i.confidence for i in iterations])
    assert progress[-1].steps == sum(it.steps for it in iterations)
    assert sum(msg.steps for msg in reports(table, Episode, 1)) == progress[-1].steps


@pytest.mark.parametrize('profile, name', ROWS)
def test_whoever_is_killed_at_whatever_moment_the_digest_is_that_of_the_compiled_loop(
        table, profile, name):
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    row = replace(find_method(name, profile), episodes=2, iterations=3)
    training = Training(World(ROOM), policy, row, SEED)
    iterations = [training.iterate() for _ in range(3)]
    held = table(0.15, row, ROOM, policy, SEED, random.Random(name), len(name) % 2 == 0).hold()
    check(held, training, iterations)
    assert held.kills > 10


@pytest.mark.parametrize('when, remembers', [
    ('early', True), ('early', False), ('important', True)])
@pytest.mark.parametrize('rate', [0.1, 0.3])
def test_a_mentor_with_a_budget_may_be_killed_too(table, when, remembers, rate):
    policy = sparse_policy(noisy_policy(World(ROOM), 0.3, random_streams(8)[0]), World(ROOM), 0.8, 2)
    row = replace(find_method('explicit', 'published'), episodes=2, iterations=2)
    told = AdviceBudget(World(ROOM), policy, 5, when)
    training = Training(World(ROOM), told, row, SEED)
    iterations = [training.iterate() for _ in range(2)]
    held = table(rate, row, ROOM, policy, SEED, random.Random(when), remembers, budget=5,
                 when=when).hold()
    check(held, training, iterations)
    assert told.remaining[0] < 5


def test_a_learner_that_comes_back_knows_the_advice_that_it_has_heard(table, monkeypatch):
    monkeypatch.setattr(state_store, 'RECORDS_PER_CHECKPOINT', 10 ** 6)
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    row = replace(find_method('explicit', 'published'), episodes=2, iterations=2)
    held = table(0.0, row, ROOM, policy, SEED, random.Random(1)).hold()
    before = held.learner.advice_heard().tolist()
    assert len(set(before)) > 1
    held.kill('learner')
    assert held.learner.advice_heard().tolist() == before


@pytest.mark.parametrize('lost', [2, 7, 40])
@pytest.mark.parametrize('name', ['sarsa', 'explicit', 'watkins', 'head_start'])
def test_a_learner_whose_journal_lacks_its_end_goes_on_and_learns_no_wrong_step(
        table, monkeypatch, name, lost):
    monkeypatch.setattr(state_store, 'RECORDS_PER_CHECKPOINT', 10 ** 6)
    policy = noisy_policy(World(ROOM), 0.3, random_streams(8)[0])
    row = replace(find_method(name, 'published'), episodes=2, iterations=4)
    held, learned, learn = table(0.0, row, ROOM, policy, SEED, random.Random(lost)), [], \
        Student.learn

    def record(student, s, a, r, s2, *rest):
        learned.append((s, a, r, s2))
        learn(student, s, a, r, s2, *rest)
    monkeypatch.setattr(Student, 'learn', record)
    for _ in range(300):
        held.step_id() if held.open else held.lay(held.world.question)
    held.keepers.pop('learner').close()
    journal, = held.folder.glob('learner.*.journal')
    os.truncate(journal, journal.stat().st_size - lost * 40)  # and not behind a whole record
    held.revive('learner')
    held.hold()
    notices = [msg.text for msg in held.reports if isinstance(msg, Notice)]
    assert any(text.startswith('goes on at turn') for text in notices)
    assert len(learned) > 50 and set(learned) <= held.moves
