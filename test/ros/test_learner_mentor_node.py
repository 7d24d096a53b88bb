# SPDX-License-Identifier: Apache-2.0
"""A mentor node that follows the policy of another learner, which is killed and comes back."""

from node_processes import log_has, nodes, run
import pytest
from ros_client import ros_client
from waiting import wait_until

from comply_ros.nodes.topics import ACTION, MENTOR_POLICY, POLICY

pytestmark = pytest.mark.usefixtures('domain')

WORLD = ('-p', 'map:=bar_grid')
AT_OTHER = ('-r', '__ns:=/other')
OTHER_WORLD = (*AT_OTHER, *WORLD)
OTHER = (*AT_OTHER, '-p', 'method:=q_learning', '-p', 'iterations:=0')
TAUGHT = ('-p', 'method:=constant', '-p', 'confidence:=1.0', '-p', 'iterations:=0', '-p',
          'remembers_advice:=false')
MENTOR = ('-p', 'mentor:=learner:/other')
OTHER_POLICY = POLICY._replace(name='/other/policy')


@pytest.mark.long
def test_the_newest_policy_of_a_learner_that_dies_and_comes_back_is_the_advice(tmp_path):
    with ros_client() as client, nodes(tmp_path, grid_world=WORLD, mentor=MENTOR, learner=TAUGHT):
        client.subscribe(ACTION, MENTOR_POLICY, OTHER_POLICY)
        actions, policies, theirs = (client.received[topic.name] for topic in (
            ACTION, MENTOR_POLICY, OTHER_POLICY))
        client.until(lambda: len(actions) > 20, 'actions before the other learner is there')
        assert not any(each.followed for each in actions)
        with nodes(tmp_path / 'world', grid_world=OTHER_WORLD):
            for life in ('first', 'second'):
                count = len(theirs)
                with nodes(tmp_path / life, learner=OTHER):
                    client.until(lambda: len(theirs) > count + 2 and actions[-1].followed,
                                 f'advice in its {life} life')
                client.until(lambda: policies[-1].action == theirs[-1].action,
                             'its last policy')
                count = len(actions)
                client.until(lambda: len(actions) > count + 50, 'actions after its death')
                assert any(each.followed for each in actions[count:])


def test_a_learner_in_another_world_is_not_followed_and_one_sentence_says_so(tmp_path):
    other = (*AT_OTHER, '-p', 'map:=free_grid')
    with ros_client() as client, nodes(tmp_path / 'other', grid_world=other, learner=OTHER), \
            nodes(tmp_path, grid_world=WORLD, mentor=MENTOR, learner=TAUGHT) as started:
        client.subscribe(ACTION)
        sentence = "the learner /other must be in the world of this mentor, 'bar_grid' (hash"
        wait_until(log_has(started['mentor'], sentence), 'sentence')
        count = len(client.received['action'])
        client.until(lambda: len(client.received['action']) > count + 20, 'actions')
        assert not client.received['action'][-1].followed
        assert started['mentor'].log.read_text().count(sentence) == 1


@pytest.mark.parametrize('parameters, sentence', [
    (('mentor:=learner:/',), 'a mentor must follow another learner than the one that it teaches, '
     'got learner:/'),
    (('mentor:=learner:/other', 'budget:=3'), 'a mentor that follows a running learner must have '
     'no budget, got budget 3'),
    (('mentor:=learner:other',), 'the NAMESPACE of learner:/NAMESPACE must be that of another '
     "learner, such as /robot_2, got 'other'")])
def test_what_cannot_be_followed_ends_the_node_with_one_line(parameters, sentence):
    done = run('mentor', '--ros-args', *(word for each in parameters for word in ('-p', each)))
    assert (done.returncode, done.stderr) == (2, f'mentor: {sentence}\n')
