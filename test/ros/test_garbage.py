# SPDX-License-Identifier: Apache-2.0
"""Garbage on every topic and service: nobody dies, nothing is learned from it, and it is told."""

from dataclasses import replace
import json
import os
import subprocess
import sys

from fuzz_node import Flood, kinds, requests, rubbish
from hypothesis import given
from hypothesis import strategies as st
from node_processes import log_has, nodes
import numpy as np
import pytest
import rclpy
from short_training import children
from waiting import DEADLINE, wait_until

from comply_ros.learner.presets import find_method
from comply_ros.learner.training import Training
from comply_ros.mentor.mentor_policies import noisy_policy
from comply_ros.mentor.policy_validation import PolicyError, validate_policy
from comply_ros.nodes.node_processes import START
from comply_ros.numerics.rng import random_streams
from comply_ros.protocol.messages import Progress
from comply_ros.protocol.run_reports import is_possible_progress
from comply_ros.storage.map_files import read_map
from comply_ros.storage.mentor_cache import mentor_policy, read_mentor_spec
from comply_ros.world.mdp import World
from examples import examples, GENERATE

BAR = read_map('bar_grid', 'published')
POLICY = noisy_policy(World(BAR), 0.3, random_streams(8)[0])
ITERATIONS = 60
MANY, TIMES = 10_000, 4
OURS = {'iterations': ITERATIONS, 'episodes': 5}
FEW = examples(10_000, phases=GENERATE)


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
@pytest.mark.long
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
        assert expected.state.digest() in started['learner'].log.read_text()
        assert_told_once(started, flood)


# Publishers that a lesson finds before its first iteration are those of others, and end it: the
# flood begins when the lesson shows that iteration, which may be long after it was published.
@pytest.mark.usefixtures('domain')
@pytest.mark.long
def test_a_lesson_in_a_flood_of_garbage_ends_with_its_digest_and_its_curve(
        tmp_path, context, expected):
    shown, log = tmp_path / 'shown.txt', tmp_path / 'learner.log'
    with shown.open('w') as file:
        lesson = subprocess.Popen(
            [sys.executable, '-c', START.format('lesson'), '--map', 'bar_grid', '--mentor',
             'noisy:0.3', '--iterations', str(ITERATIONS), '--episodes', '5', '--seed', '3',
             '--rate', '100', '--out', str(tmp_path)],
            stderr=file, env={**os.environ, 'FORCE_COLOR': '1', 'COLUMNS': '120'})
    try:
        wait_until(lambda: f'1/{ITERATIONS}' in shown.read_text() or lesson.poll(), 'iteration')
        flood = Flood(context, list(children(lesson).values()))
        flood_while(flood, lambda: 'finished' not in log.read_text(), least=1_000)
        flood.set_rate(0.0)
        code = lesson.wait(DEADLINE)
    finally:
        lesson.kill()
        lesson.wait()
    msg = shown.read_text()
    assert code == 0 and 'Traceback' not in msg, msg
    summary = json.loads((tmp_path / 'summary.json').read_text())
    assert summary['digest'] == expected.state.digest()
    assert summary['return_per_iteration'] == pytest.approx(expected.returns)
    assert len(log.read_text()) < 20_000


@pytest.mark.parametrize('wrong', [
    {'mean_return': float('nan')}, {'temperature': float('inf')}, {'confidence': 7.0},
    {'finished': True}, {'episodes': 0}])
def test_a_report_that_cannot_be_right_is_none_of_a_lesson(wrong):
    right = Progress(7, 1, 9, 5, 80, -3.0, float('nan'), 0.5, False)
    assert is_possible_progress(right) and not is_possible_progress(right._replace(**wrong))


def test_advice_that_no_cell_has_is_none_of_a_lesson():
    world = World(BAR)
    assert validate_policy(POLICY, world, clear_not_free=True).tolist() == POLICY.tolist()
    wrong_policies = [POLICY[:-1], *(
        [wrong, *POLICY[1:]]
        for wrong in (77, -128, int(np.flatnonzero(~world.available[0])[0])))]
    for policy in wrong_policies:
        with pytest.raises(PolicyError):
            validate_policy(policy, world, clear_not_free=True)
