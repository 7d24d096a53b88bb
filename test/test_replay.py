# SPDX-License-Identifier: Apache-2.0
"""A bag proves what a learner said, names the first difference, and says what it cannot prove."""

import random

from bag_fixtures import Held, write
import pytest

from comply_ros.bags import replay
from comply_ros.bags.learner_replay import MissingMessage, ReplayDifference
from comply_ros.bags.replay_check import ReplayCheck
from comply_ros.learner.presets import METHODS
from comply_ros.protocol.messages import step_id


@pytest.fixture(scope='module')
def held():
    """Return a conversation."""
    return Held()


def told(spoken):
    """Return the proof of a conversation; raises Differs."""
    proof = ReplayCheck()
    for topic, msg in spoken:
        proof.hear(topic, msg)
    proof.end()
    return proof


def changed(spoken, topic, number, **fields):
    """Return a conversation in which the message of that number on a topic is another."""
    place = [place for place, (name, _) in enumerate(spoken) if name == topic][number]
    return [*spoken[:place], (topic, spoken[place][1]._replace(**fields)), *spoken[place + 1:]]


def without(spoken, topic, number):
    """Return a conversation without one message."""
    place = [place for place, (name, _) in enumerate(spoken) if name == topic][number]
    return spoken[:place] + spoken[place + 1:]


@pytest.mark.parametrize('method', METHODS['published'])
def test_every_learner_says_the_same_again_and_reaches_the_same_digest(method):
    held = Held(method, iterations=2, episodes=2)
    retelling, = told(held.spoken).proven
    actions = [msg for topic, msg in held.spoken if topic == 'action']
    assert retelling.same == len(actions) > 10
    assert (retelling.digests, retelling.digest, retelling.finished) == (1, held.digest, True)


def test_topics_may_be_recorded_a_little_out_of_step(held):
    order, drawn = list(enumerate(held.spoken)), random.Random(0)
    delays = {topic: drawn.random() * 200 for topic in ('state', 'recommendation', 'action',
                                                        'method', 'world', 'progress')}
    order.sort(key=lambda each: each[0] + delays.get(each[1][0], 0))
    retelling, = told([spoken for _, spoken in order]).proven
    assert retelling.digest == held.digest


def test_an_answer_that_is_said_twice_counts_once(held):
    twice = [each for each in held.spoken for _ in range(2 if each[0] == 'action' else 1)]
    assert told(twice).proven[0].same == told(held.spoken).proven[0].same


@pytest.mark.parametrize('field, value', [
    ('action', 9), ('followed', None), ('confidence', 0.123), ('advice', 9)])
def test_the_first_answer_that_differs_is_named(held, field, value):
    action = [msg for topic, msg in held.spoken if topic == 'action'][10]
    value = not action.followed if value is None else value
    with pytest.raises(ReplayDifference) as found:
        told(changed(held.spoken, 'action', 10, **{field: value}))
    assert str(found.value).startswith(
        f'on topic action, in run 7, turn {step_id(action)}, was recorded ')
    assert f'{field} {value}' in str(found.value)


def test_a_reward_that_is_slightly_another_is_found_by_the_digest(held):
    state = next(msg for topic, msg in held.spoken if topic == 'state' and msg.step == 1)
    number = [msg for topic, msg in held.spoken if topic == 'state'].index(state)
    with pytest.raises(ReplayDifference, match='was recorded'):
        told(changed(held.spoken, 'state', number, reward=state.reward * (1 + 2 ** -30)))


def test_another_digest_is_named(held):
    with pytest.raises(ReplayDifference, match=f'recorded the digest f{{64}}; a fresh learner has '
                       f'{held.digest}'):
        told(changed(held.spoken, 'method', -1, digest=64 * 'f'))


def test_another_progress_is_named(held):
    with pytest.raises(ReplayDifference, match='on topic progress, in run 7, iteration 2, was recorded'):
        told(changed(held.spoken, 'progress', 1, mean_return=0.5))


def test_another_seed_says_something_else(held):
    with pytest.raises(ReplayDifference, match='on topic action, in run 7'):
        told(changed(held.spoken, 'method', 0, seed=4))


def test_advice_that_nobody_gave_is_named(held):
    lying = [(topic, msg._replace(action=(msg.action + 1) % 4))
             if topic == 'recommendation' else (topic, msg) for topic, msg in held.spoken
             if topic != 'mentor_policy']
    with pytest.raises(ReplayDifference, match='and the bag has no such recommendation'):
        told(lying)


def test_the_policy_of_a_mentor_stands_for_what_it_was_not_heard_to_say(held):
    mute = [each for each in held.spoken if each[0] != 'recommendation']
    assert told(mute).proven[0].unheard == 0
    retelling, = told([each for each in mute if each[0] != 'mentor_policy']).proven
    assert (retelling.unheard > 10, retelling.digest) == (True, held.digest)


def test_answers_that_are_missing_follow_from_the_states(held):
    first = [msg for topic, msg in held.spoken if topic == 'action'][:20]
    late = [each for each in held.spoken if each[1] not in first]
    retelling, = told(late).proven
    assert (retelling.inferred, retelling.digest) == (20, held.digest)
    retelling, = told(without(held.spoken, 'action', 30)).proven
    assert (retelling.inferred, retelling.digest) == (1, held.digest)


def test_a_state_that_is_missing_ends_what_can_be_proven(held):
    with pytest.raises(MissingMessage, match=r'the state of run 7, turn \(.*\), is not in the bag'):
        told(without(held.spoken, 'state', 10))


@pytest.mark.parametrize('number', [5, 6])
def test_a_learner_that_begins_anew_is_told_apart(held, number):
    second = Held(number=number, run=8)
    first, other = told(held.spoken[:len(held.spoken) // 2] + second.spoken).proven
    assert (first.described.learner, first.finished, first.digests) == (5, False, 0)
    assert (other.described.learner, other.digest) == (number, held.digest)


def test_what_is_recorded_from_the_middle_is_checked_as_far_as_it_goes(held):
    late = held.spoken[200:]
    for where in ([held.spoken[0], held.spoken[1]], [held.spoken[0]]):
        proof = told([*where, *late])
        assert (proof.proven, list(proof.unknown)) == ([], [5])
    assert told([held.spoken[0], *late[:9], held.spoken[1], *late[9:]]).proven == []
    proof = told([held.spoken[0], *late])
    assert proof.proven == []
    assert proof.unknown[5].fits > 10
    with pytest.raises(ReplayDifference, match='was recorded action 9, which state'):
        told([held.spoken[0], *changed(late, 'action', 5, action=9)])


def said_of(capsys, *argv):
    """Return exit code, output and errors of the command, without its progress bar."""
    code = replay.main(['replay', *map(str, argv)])
    output = capsys.readouterr()
    return code, output.out, output.err


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_command_proves_a_bag(held, tmp_path, capsys, storage):
    code, out, err = said_of(capsys, write(tmp_path / 'bag', held.spoken, storage))
    assert code == 0
    assert out.startswith('the same: learner 5 (beta_implicit, seed 3), ')
    assert out.endswith(f'; the same 1 digest, the last {held.digest}\n')
    assert 'cut off' not in err


def test_the_command_names_a_difference_and_fails(held, tmp_path, capsys):
    here = step_id([msg for topic, msg in held.spoken if topic == 'action'][10])
    bag = write(tmp_path / 'bag', changed(held.spoken, 'action', 10, confidence=0.5))
    code, out, _ = said_of(capsys, bag)
    assert code == 1
    assert f'differs: on topic action, in run 7, turn {here}, was recorded' in out


def test_the_command_says_what_it_cannot_prove(held, tmp_path, capsys):
    bag = write(tmp_path / 'bag', [held.spoken[0], *held.spoken[200:]])
    code, out, _ = said_of(capsys, bag)
    assert code == 1
    assert out.startswith('not proven: learner 5 was recorded from run 7, turn (')
    assert 'answers fit their questions' in out


def test_of_two_conversations_one_is_named(held, tmp_path, capsys):
    both = write(tmp_path / 'bag', held.spoken, namespace='/second')
    assert said_of(capsys, both, '--namespace', 'second')[0] == 0
    code, _, err = said_of(capsys, both, '--namespace', 'third')
    assert code == 2
    assert err.endswith('must have a world in namespace /third, and has none among its '
                        f'{len(held.spoken)} messages: its namespaces are /second\n')


def test_a_bag_without_a_learner_is_one_sentence(held, tmp_path, capsys):
    mute = [each for each in held.spoken if each[0] not in ('action', 'method', 'progress')]
    code, _, err = said_of(capsys, write(tmp_path / 'bag', mute))
    assert code == 2
    assert 'replay: the bag must have the answers of a learner, and has none\n' in err
