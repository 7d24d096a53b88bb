# SPDX-License-Identifier: Apache-2.0
"""Garbage on every topic and service: nobody dies, nothing is learned from it, and it is told."""

from collections import Counter
from dataclasses import replace
import os
import random
import time

from flood import Flood, kinds, requests, rubbish
from garbage import GARBAGE
from hypothesis import given, HealthCheck, Phase, settings
from hypothesis import strategies as st
from nodes import log_has, nodes
import pytest
import rclpy
from test_talk import Table

from comply_ros.core.advising import Advising
from comply_ros.core.dialogue import (
    Action,
    Progress,
    Recommendation,
    Refused,
    StateReward,
    WorldDescription,
)
from comply_ros.core.draws import streams
from comply_ros.core.mentors import noisy_policy
from comply_ros.core.methods import find_method
from comply_ros.core.training import Training
from comply_ros.core.world import World
from comply_ros.session.maps import read_map
from comply_ros.session.mentors import mentor_policy, read_spec

settings.register_profile('garbage', deadline=None, max_examples=8, database=None,
                          phases=[Phase.explicit, Phase.generate],
                          derandomize=os.environ.get('CI') == 'true',
                          suppress_health_check=list(HealthCheck))
garbage = settings(settings.get_profile('garbage'))
HEARD = WorldDescription, StateReward, Recommendation, Action
A_HANDFUL = st.lists(st.one_of([st.tuples(st.just(kind), GARBAGE[kind]) for kind in HEARD]),
                     min_size=30, max_size=60)


class DirtyTable(Table):
    """A table onto which garbage is thrown, as soon as the first question is answered."""

    def __init__(self, *arguments):
        self.said, self.thrown = {}, Counter()
        super().__init__(*arguments)

    def lay(self, said):
        """Put a message on the table, and remember the last of its kind."""
        self.said[type(said)] = said
        super().lay(said)

    def hold_among(self, rubbish):
        """Let them talk, with garbage thrown in between; each of it is used once at least."""
        rest, asked = [], 0
        while not self.learner.finished and asked < 1000:
            if not self.open:  # as its node does
                asked += 1
                self.lay(self.world.question)
            self.take_up()
            if self.world.turns > 1 and self.learner.turns > 1 and len(self.open) < 40:
                kind, spoil = rest.pop() if rest else rest.extend(rubbish) or rest.pop()
                if kind in self.said:
                    self.throw(kind, spoil(self.said[kind]))
        return self

    def take_up(self):
        """Let somebody hear a message that lies on the table."""
        listener, said = self.open.pop(self.shuffle.randrange(len(self.open)))
        for answer in listener(said):
            self.lay(answer)

    def throw(self, kind, said):
        """Say garbage to all who listen to its topic, at once."""
        self.thrown[kind] += 1
        before = len(self.open)
        genuine = self.said.get(kind)
        Table.lay(self, said)
        self.said[kind] = genuine
        thrown, self.open = self.open[before:], self.open[:before]
        for listener, message in thrown:
            try:
                answers = listener(message)
            except ValueError:  # not a world: told by the node
                answers = (Refused('not a world', ''),)
            for answer in answers:
                self.lay(answer)

    def tell_mentor_of_world(self, said):
        """Let the mentor hear of a world; it has its policy from the first on."""
        answers = self.mentor.hear_world(said)
        return self.mentor.use(self.policy) if self.mentor.policy is None else answers


@pytest.mark.parametrize('name, remembers, budget', [
    ('beta_implicit', True, 0), ('explicit', False, 0), ('q_learning', True, 0),
    ('beta_implicit', False, 12)])
@garbage
@given(rubbish=A_HANDFUL, number=st.integers(0, 1000))
def test_garbage_changes_no_bit_and_stops_no_conversation(name, remembers, budget, rubbish,
                                                          number):
    row = replace(find_method(name, 'published'), episodes=2, iterations=2)
    told = Advising(World(BAR), POLICY, budget, 'mistakes')
    training = Training(World(BAR), told, row, seed=4)
    returns = [training.iterate().mean_return for _ in range(2)]
    table = DirtyTable(row, BAR, POLICY, 4, random.Random(number), remembers, budget, 'mistakes')
    table.hold_among(rubbish)
    assert table.learner.finished, 'the conversation stopped'
    assert not (table.learner.aside or table.world.aside)
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [said for said in table.reports if isinstance(said, Progress)]
    assert [said.mean_return for said in progress] == returns


BAR = read_map('bar_grid', 'published')
POLICY = noisy_policy(World(BAR), 0.3, streams(8)[0])


ITERATIONS = 150
MANY, TIMES = 10_000, 4
OURS = {'iterations': ITERATIONS, 'episodes': 5}
FEW = settings(settings.get_profile('garbage'), max_examples=10_000)


@pytest.fixture
def expected():
    """Return the `Training` that learned what the nodes are to learn."""
    world = World(BAR)
    row = replace(find_method('beta_implicit', 'published'), **OURS)
    training = Training(world, mentor_policy(read_spec('noisy:0.3'), world, 0), row, 3)
    training.returns = [training.iterate().mean_return for _ in range(ITERATIONS)]
    return training


@pytest.fixture
def context():
    """Return a context of the test's own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    rclpy.try_shutdown(context=context)


def flood_while(flood, learns, least=MANY):
    """Let hypothesis throw garbage until that much has arrived; fail where nobody learned then."""
    class Enough(Exception):
        pass

    @FEW
    @given(handful=st.lists(rubbish, min_size=20, max_size=30), request=requests)
    def throw(handful, request):
        for _ in range(TIMES):  # each time made of what is true then
            flood.say(handful)
        flood.ask(*request)
        assert learns(), f'the learning was over after {flood.count}'
        if flood.count.total() >= least:
            raise Enough

    flood.spin_until(lambda: len(flood.latest) == len(kinds), 'message on every topic')
    flood.turns.clear()
    with pytest.raises(Enough):
        throw()
    flood.wait()
    assert learns(), 'the learning was over before all had arrived'
    assert len(flood.turns) > 50, 'the conversation stood still in the flood'
    flood.spin_until(lambda: all(future.done() for future in flood.asked), 'answer')
    assert not [future.exception() for future in flood.asked if future.exception()]


def assert_told_once(started, flood):
    """Check that each kind of refusal is counted, and warned of in one line."""
    for name, process in started.items():
        log = process.log.read_text(errors='replace')
        kinds = [key for key in flood.told[name] if key.startswith('refused: ')]
        assert kinds and log.count('refused: ') == len(kinds), (name, kinds, log)
        assert 'Traceback' not in log and len(log) < 20_000
        process.check()


@pytest.mark.usefixtures('domain')
def test_ten_thousand_messages_of_garbage_leave_the_digest_and_every_node(
        tmp_path, context, expected):
    with nodes(tmp_path, grid_world=('-p', 'map:=bar_grid', '-p', 'seed:=3', '-p', 'rate:=300.0'),
               mentor=('-p', 'mentor:=noisy:0.3'), learner=(
                   '-p', 'seed:=3', *(word for name, value in OURS.items()
                                      for word in ('-p', f'{name}:={value}')))) as started:
        flood = Flood(context, [process.pid for process in started.values()])
        finished = log_has(started['learner'], 'finished')
        begin = time.monotonic()
        flood_while(flood, lambda: not finished())
        print('FLOOD', flood.told, time.monotonic() - begin, flood.count, len(flood.turns), len(flood.asked))
        flood.set_rate(0.0)
        flood.spin_until(finished, 'end of the learning')
        flood.told.clear()
        flood.spin_until(lambda: flood.told.keys() >= started.keys(), 'last diagnoses')
        assert expected.memory.digest() in started['learner'].log.read_text()
        assert_told_once(started, flood)
