# SPDX-License-Identifier: Apache-2.0
"""Garbage on every topic and service: nobody dies, nothing is learned from it, and it is told."""

from collections import Counter
from dataclasses import replace
import json
import os
import random
import subprocess
import sys

from fuzz_node import Flood, kinds, requests, rubbish
from hypothesis import given, HealthCheck, Phase, settings
from hypothesis import strategies as st
from message_strategies import GARBAGE
from node_processes import log_has, nodes, wait_until
import numpy as np
import pytest
import rclpy
from test_lesson import children
from test_protocol_digests import Table

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.advice_budget import AdviceBudget
from comply_ros.mentor.mentor_policies import noisy_policy
from comply_ros.nodes import topics
from comply_ros.nodes.node_processes import START
from comply_ros.nodes.run_monitor import is_valid_advice, is_valid_progress
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.grid_world import GridWorld
from comply_ros.protocol.learner import Learner
from comply_ros.protocol.mentor import Mentor
from comply_ros.protocol.messages import (
    Action,
    describe_world,
    grid_from_description,
    Progress,
    Recommendation,
    Rejected,
    StateReward,
    WorldDescription,
)
from comply_ros.protocol.validation import validate_same_world
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world import grid
from comply_ros.world.mdp import World

settings.register_profile('garbage', deadline=None, max_examples=8, database=None,
                          phases=[Phase.explicit, Phase.generate],
                          derandomize=os.environ.get('CI') == 'true',
                          suppress_health_check=list(HealthCheck))
garbage = settings(settings.get_profile('garbage'))
HEARD = WorldDescription, StateReward, Recommendation, Action
BAR = read_map('bar_grid', 'published')
POLICY = noisy_policy(World(BAR), 0.3, random_streams(8)[0])
A_HANDFUL = st.lists(st.one_of([st.tuples(st.just(kind), GARBAGE[kind]) for kind in HEARD]),
                     min_size=30, max_size=60)


class DirtyTable(Table):
    """A table onto which garbage is thrown, as soon as the first question is answered."""

    def __init__(self, *arguments):
        self.msg, self.thrown = {}, Counter()
        super().__init__(*arguments)

    def lay(self, msg):
        """Put a message on the table, and remember the last of its kind."""
        self.msg[type(msg)] = msg
        super().lay(msg)

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
                if kind in self.msg:
                    self.throw(kind, spoil(self.msg[kind]))
        return self

    def take_up(self):
        """Let somebody hear a message that lies on the table."""
        listener, msg = self.open.pop(self.shuffle.randrange(len(self.open)))
        for answer in listener(msg):
            self.lay(answer)

    def throw(self, kind, msg):
        """Say garbage to all who listen to its topic, at once."""
        self.thrown[kind] += 1
        before = len(self.open)
        genuine = self.msg.get(kind)
        Table.lay(self, msg)
        self.msg[kind] = genuine
        thrown, self.open = self.open[before:], self.open[:before]
        for listener, message in thrown:
            try:
                answers = listener(message)
            except ValueError:  # not a world: told by the node
                answers = (Rejected('not a world', ''),)
            for answer in answers:
                self.lay(answer)

    def tell_mentor_of_world(self, msg):
        """Let the mentor hear of a world; it has its policy from the first on."""
        answers = self.mentor.on_world(msg)
        return self.mentor.use(self.policy) if self.mentor.policy is None else answers


@pytest.mark.parametrize('name, remembers, budget', [
    ('beta_implicit', True, 0), ('explicit', False, 0), ('q_learning', True, 0),
    ('beta_implicit', False, 12)])
@garbage
@given(rubbish=A_HANDFUL, number=st.integers(0, 1000))
def test_garbage_changes_no_bit_and_stops_no_conversation(name, remembers, budget, rubbish,
                                                          number):
    row = replace(find_method(name, 'published'), episodes=2, iterations=2)
    told = AdviceBudget(World(BAR), POLICY, budget, 'mistakes')
    training = Training(World(BAR), told, row, seed=4)
    returns = [training.iterate().mean_return for _ in range(2)]
    table = DirtyTable(row, BAR, POLICY, 4, random.Random(number), remembers, budget, 'mistakes')
    table.hold_among(rubbish)
    assert table.learner.finished, 'the conversation stopped'
    assert not (table.learner.aside or table.world.aside)
    assert table.learner.memory.digest() == training.memory.digest()
    progress = [msg for msg in table.reports if isinstance(msg, Progress)]
    assert [msg.mean_return for msg in progress] == returns


ITERATIONS = 60
MANY, TIMES = 10_000, 4
OURS = {'iterations': ITERATIONS, 'episodes': 5}
FEW = settings(settings.get_profile('garbage'), max_examples=10_000)


@pytest.fixture
def expected():
    """Return the `Training` that learned what the nodes are to learn."""
    world = World(BAR)
    row = replace(find_method('beta_implicit', 'published'), **OURS)
    training = Training(world, mentor_policy(read_mentor_spec('noisy:0.3'), world, 0), row, 3)
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
    steps = flood.steps()
    with pytest.raises(Enough):
        throw()
    flood.wait()
    assert learns(), 'the learning was over before all had arrived'
    assert flood.steps() > steps, 'the conversation stood still in the flood'
    flood.spin_until(lambda: all(future.done() for future in flood.asked), 'answer')
    assert not [future.exception() for future in flood.asked if future.exception()]


def assert_told_once(started, flood):
    """Check that each kind of refusal is counted, and warned of in one line."""
    for name, process in started.items():
        log = process.log.read_text(errors='replace')
        kinds = [key for key in flood.told[name] if key.startswith('rejected: ')]
        assert kinds and log.count('rejected: ') == len(kinds), (name, kinds, log)
        assert 'Traceback' not in log and len(log) < 20_000
        process.check()


@pytest.mark.usefixtures('domain')
def test_ten_thousand_messages_of_garbage_leave_the_digest_and_every_node(
        tmp_path, context, expected):
    with nodes(tmp_path, grid_world=('-p', 'map:=bar_grid', '-p', 'seed:=3', '-p', 'rate:=100.0'),
               mentor=('-p', 'mentor:=noisy:0.3'), learner=(
                   '-p', 'seed:=3', *(word for name, value in OURS.items()
                                      for word in ('-p', f'{name}:={value}')))) as started:
        flood = Flood(context, [process.pid for process in started.values()])
        finished = log_has(started['learner'], 'finished')
        flood_while(flood, lambda: not finished())
        flood.set_rate(0.0)
        flood.spin_until(finished, 'end of the learning')
        flood.told.clear()
        flood.spin_until(lambda: flood.told.keys() >= started.keys(), 'last diagnoses')
        assert expected.memory.digest() in started['learner'].log.read_text()
        assert_told_once(started, flood)


@pytest.mark.usefixtures('domain')
def test_a_lesson_in_a_flood_of_garbage_ends_with_its_digest_and_its_curve(
        tmp_path, context, expected):
    lesson = subprocess.Popen(
        [sys.executable, '-c', START.format('lesson'), '--map', 'bar_grid', '--mentor',
         'noisy:0.3', '--iterations', str(ITERATIONS), '--episodes', '5', '--seed', '3',
         '--rate', '100', '--out', str(tmp_path)], stderr=subprocess.PIPE, text=True)
    try:
        log = tmp_path / 'learner.log'
        wait_until(lambda: log.exists() and 'starts to learn' in log.read_text(), 'learning')
        flood = Flood(context, list(children(lesson).values()))
        flood.spin_until(lambda: topics.PROGRESS.name in flood.latest, 'progress')
        flood_while(flood, lambda: 'finished' not in log.read_text(), least=1_000)
        flood.set_rate(0.0)
        msg = lesson.communicate(timeout=60)[1]
    finally:
        lesson.kill()
        lesson.wait()
    assert lesson.returncode == 0 and 'Traceback' not in msg, msg
    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert summary['digest'] == expected.memory.digest()
    assert summary['return_per_iteration'] == pytest.approx(expected.returns)
    assert len(log.read_text()) < 20_000


def seated(**settings):
    """Return a learner without a mentor that has answered the first question of a world."""
    world = GridWorld(BAR, 'bar', 7, 4)
    learner = Learner(replace(find_method('q_learning', 'published'), **settings), 4)
    learner.on_world(world.description)
    world.on_action(*learner.observe(world.question))
    return world, learner


def test_questions_to_somebody_else_that_do_not_follow_each_other_put_no_learner_aside():
    world, learner = seated()
    order = random.Random(1)
    for _ in range(200):
        learner.observe(world.question._replace(
            episode=order.randrange(2, 2 ** 32), step=order.randrange(9), learner=99))
    assert not learner.aside
    for step in range(20):
        learner.observe(world.question._replace(episode=3, step=step + 1, learner=99))
    assert learner.aside


def test_two_unlikely_moves_in_one_turn_are_not_one_that_is_asked_again():
    world, learner = seated()
    far = [s for s in range(121) if World(BAR).free[s] and not World(BAR).leads(
        learner._turns.state, s)]
    for s in far[:5]:
        assert type(learner.observe(world.question._replace(
            state=s, terminated=False))[0]) is Rejected
    assert type(learner.observe(world.question)[0]) is Action


def test_a_mentor_leaves_no_world_that_is_answered_for_one_that_began_earlier():
    mentor, world = Mentor(), GridWorld(BAR, 'bar', 7, 4, began=9.0)
    mentor.on_world(world.description)
    mentor.use(POLICY)
    mentor.observe(world.question._replace(step=1, reward=-1.0))
    assert mentor.on_world(world.description._replace(run=8, began=1.0)) == ()
    assert mentor.described.run == 7


@pytest.mark.parametrize('wrong', [{'action': 99}, {'confidence': float('nan')}])
def test_a_mentor_that_watches_overhears_what_the_world_refuses(wrong):
    mentor, world = Mentor(5, 'mistakes'), GridWorld(BAR, 'bar', 7, 4)
    mentor.on_world(world.description)
    mentor.use(POLICY)
    mentor.observe(world.question)
    right = Action(7, 1, 0, int(World(BAR).available[world.question.state].argmax()), False, 0.0)
    mentor.on_action(right._replace(**wrong))
    assert right not in mentor.told
    mentor.on_action(right)
    assert right in mentor.told


def test_a_world_with_a_wrong_hash_is_refused_before_its_ways_are_searched(monkeypatch):
    monkeypatch.setattr(grid, 'reaching', None)
    with pytest.raises(ValueError, match='sha256 must be that of the world'):
        grid_from_description(describe_world(BAR, 'bar', 7)._replace(sha256='x'))


def test_a_name_of_megabytes_is_not_written_into_a_log():
    here = describe_world(BAR, 'bar', 7)
    with pytest.raises(ValueError, match='a name must have at most 255 characters, got 1000000'):
        grid_from_description(here._replace(name='x' * 1_000_000))
    refused, = validate_same_world(here._replace(name='x' * 1_000_000, sha256=''), here)
    assert len(refused.reason) < 400


@pytest.mark.parametrize('wrong', [
    {'mean_return': float('nan')}, {'temperature': float('inf')}, {'confidence': 7.0},
    {'finished': True}, {'episodes': 0}])
def test_a_report_that_cannot_be_right_is_none_of_a_lesson(wrong):
    right = Progress(7, 1, 9, 5, 80, -3.0, float('nan'), 0.5, False)
    assert is_valid_progress(right) and not is_valid_progress(right._replace(**wrong))


def test_advice_that_no_cell_has_is_none_of_a_lesson():
    world = World(BAR)
    assert is_valid_advice(POLICY, world)
    assert not is_valid_advice(POLICY[:-1], world)
    for wrong in (77, -128, int(np.flatnonzero(~world.available[0])[0])):
        assert not is_valid_advice([wrong, *POLICY[1:]], world)
