# SPDX-License-Identifier: Apache-2.0
"""`lesson --external`: a node of somebody else takes part, whatever it is called."""

import json
import subprocess
import sys

from example_nodes import example
from node_processes import log_has, nodes, run
import pytest
from waiting import wait_until

pytestmark = pytest.mark.usefixtures('domain')
SAVER = """
import sys
from comply_msgs.srv import Save
import rclpy

def save(request, response):
    response.success, response.message = sys.argv[1] == 'True', 'disk full'
    return response

rclpy.init()
node = rclpy.create_node('saver')
service = node.create_service(Save, 'save', save)
rclpy.spin(node)
"""
SMALL = ('--map', 'bar_grid', '--mentor', 'noisy:0.3', '--iterations', '3', '--episodes', '5')


def summary_with(folder, part, *argv):
    """Return the summary of a lesson in which one part is external."""
    done = run('lesson', *SMALL, *argv, '--external', part, '--out', str(folder))
    assert done.returncode == 0, done.stderr
    return json.loads((folder / 'summary.json').read_text())


def test_a_learner_that_neither_reports_nor_saves_is_measured_by_its_episodes(tmp_path):
    with example('own_learner'):
        summary = summary_with(tmp_path, 'learner')
    assert summary['method'] == 'external /own_learner'
    assert summary['iterations'] == len(summary['return_per_iteration']) == 3
    assert summary['steps'] >= 15 and summary['digest'] is None
    assert '/**/learner' not in (tmp_path / 'parameters.yaml').read_text()
    assert not (tmp_path / 'learner.log').exists() and not (tmp_path / 'learning.npz').exists()
    assert (tmp_path / 'learning_curve.png').exists()


@pytest.mark.long
def test_a_learner_that_saves_has_its_digest_in_the_summary(tmp_path):
    with nodes(tmp_path / 'own', learner=('-r', '__node:=theirs')):
        summary = summary_with(tmp_path, 'learner')
    assert len(summary['digest']) == 64 and (tmp_path / 'trust_map.png').exists()


@pytest.mark.long
@pytest.mark.parametrize('success, reason', [
    ('False', 'could not save: disk full'), ('True', 'did not save what it learned: a learning ')])
def test_a_learner_that_does_not_save_as_ours_leaves_the_other_results(
        tmp_path, success, reason):
    saver = subprocess.Popen([sys.executable, '-c', SAVER, success])
    try:
        with example('own_learner'):
            done = run('lesson', *SMALL, '--external', 'learner', '--out', str(tmp_path))
    finally:
        saver.kill()
        saver.wait()
    assert done.returncode == 0, done.stderr
    assert f'lesson: the external learner {reason}' in done.stdout + done.stderr
    assert json.loads((tmp_path / 'summary.json').read_text())['digest'] is None


@pytest.mark.long
def test_a_mentor_that_publishes_no_policy_is_followed(tmp_path):
    with example('own_mentor'):
        summary = summary_with(tmp_path, 'mentor')
    assert summary['mentor'] == 'external /own_mentor' and summary['mentor_return'] is None
    assert len(summary['digest']) == 64 and not (tmp_path / 'mentor.txt').exists()


@pytest.mark.long
def test_the_map_of_an_external_world_is_what_it_describes(tmp_path):
    with nodes(tmp_path / 'own', grid_world=('-p', 'map:=frozen_lake', '-r', '__node:=w')) as own:
        wait_until(log_has(own['grid_world'], 'ready'), 'a world')
        summary = summary_with(tmp_path, 'world')
    assert summary['map'] == 'frozen_lake' and summary['step_limit'] == 100


@pytest.mark.long
def test_without_the_node_it_says_what_is_missing(tmp_path):
    done = run('lesson', *SMALL, '--external', 'learner', '--out', str(tmp_path))
    assert done.returncode == 1 and done.stderr.endswith(
        'lesson: an external learner must be the only publisher on the topic action, got none '
        'within 10 s\n')


@pytest.mark.long
def test_in_a_world_without_a_model_the_results_name_what_is_not_known(tmp_path):
    with example('own_world'):
        summary = summary_with(tmp_path, 'world', '--mentor', 'random')
    assert summary['map'] == 'corridor' and summary['optimal_return'] is None
    assert 'optimal_return' in summary['unknown'] and len(summary['return_per_iteration']) == 3


@pytest.mark.long
@pytest.mark.parametrize('action, problem', [
    ('forth', ''), ('right', "lesson: an action must be one of back, forth, got 'right'")])
def test_a_mentor_of_a_file_must_fit_the_external_world_and_not_the_option_map(
        tmp_path, action, problem):
    (tmp_path / 'policy.txt').write_text(f'3 {action}\n')
    with example('own_world'):
        done = run('lesson', '--external', 'world', '--map', 'no_map', '--iterations', '2',
                   '--mentor', f'file:{tmp_path}/policy.txt', '--out', str(tmp_path))
    assert done.returncode == (2 if problem else 0), done.stderr
    assert problem in done.stderr
    assert (tmp_path / 'summary.json').exists() != bool(problem)
