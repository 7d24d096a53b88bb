# SPDX-License-Identifier: Apache-2.0
"""`replay` verifies a bag, names the first difference, and reports what it cannot verify."""

from dataclasses import asdict
import json
import random

from bag_fixtures import SimulatedRun, write_bag
import pytest

from comply_ros.bags import replay
from comply_ros.bags.bag_message import BagError
from comply_ros.bags.learner_replay import (
    config_from_description,
    MissingMessage,
    ReplayDifference,
)
from comply_ros.bags.replay_check import ReplayCheck
from comply_ros.learner.presets import METHODS


@pytest.fixture(scope='module')
def recorded():
    """Return a run with all its messages."""
    return SimulatedRun()


def check(messages):
    """Return the check of all messages; raises ReplayDifference."""
    result = ReplayCheck()
    for topic, msg in messages:
        result.add(topic, msg)
    result.finish()
    return result


def place_of(messages, topic, number):
    """Return the place of the message of that number on a topic."""
    return [place for place, (name, _) in enumerate(messages) if name == topic][number]


def changed(messages, topic, number, **fields):
    """Return messages in which one has other fields."""
    place = place_of(messages, topic, number)
    other = messages[place][1]._replace(**fields)
    return [*messages[:place], (topic, other), *messages[place + 1:]]


def without(messages, topic, number):
    """Return messages without one of them."""
    place = place_of(messages, topic, number)
    return messages[:place] + messages[place + 1:]


def step_of(action):
    """Return how the command writes the step of an action in run 7."""
    return f'run 7, episode {action.episode}, step {action.step}'


@pytest.mark.parametrize('method', METHODS['published'])
def test_every_learner_is_verified_up_to_its_last_digest(method):
    run = SimulatedRun(method, iterations=2, episodes=1)
    result, = check(run.messages).replays
    actions = [msg for topic, msg in run.messages if topic == 'action']
    assert result.matching == len(actions) > 10
    assert (result.digests, result.digest, result.learner.finished) == (1, run.digest, True)


def test_topics_may_be_recorded_a_little_out_of_order(recorded):
    order, draw = list(enumerate(recorded.messages)), random.Random(0)
    delays = {topic: draw.random() * 200 for topic in ('state', 'recommendation', 'action',
                                                       'method', 'world', 'progress')}
    order.sort(key=lambda each: each[0] + delays.get(each[1][0], 0))
    result, = check([message for _, message in order]).replays
    assert result.digest == recorded.digest


def test_a_repeated_action_counts_once(recorded):
    twice = [each for each in recorded.messages for _ in range(2 if each[0] == 'action' else 1)]
    assert check(twice).replays[0].matching == check(recorded.messages).replays[0].matching


@pytest.mark.parametrize('field, value', [
    ('action', 9), ('followed', None), ('confidence', 0.123), ('advice', 9)])
def test_the_first_action_that_differs_is_named(recorded, field, value):
    action = [msg for topic, msg in recorded.messages if topic == 'action'][10]
    value = not action.followed if value is None else value
    with pytest.raises(ReplayDifference) as found:
        check(changed(recorded.messages, 'action', 10, **{field: value}))
    assert str(found.value).startswith(f'topic action, {step_of(action)}: recorded ')
    assert f'{field} {value}' in str(found.value)


def test_a_slightly_different_reward_is_found(recorded):
    state = next(msg for topic, msg in recorded.messages if topic == 'state' and msg.step == 1)
    number = [msg for topic, msg in recorded.messages if topic == 'state'].index(state)
    with pytest.raises(ReplayDifference, match='recorded'):
        check(changed(recorded.messages, 'state', number, reward=state.reward * (1 + 2 ** -30)))


def test_another_digest_is_named(recorded):
    with pytest.raises(ReplayDifference, match=f'recorded digest f{{64}}; a fresh learner has '
                       f'{recorded.digest}'):
        check(changed(recorded.messages, 'method', -1, digest=64 * 'f'))


def test_another_progress_is_named(recorded):
    with pytest.raises(ReplayDifference,
                       match='topic progress, run 7, iteration 2: recorded Progress'):
        check(changed(recorded.messages, 'progress', 1, mean_return=0.5))


def test_another_seed_gives_another_action(recorded):
    with pytest.raises(ReplayDifference, match='topic action, run 7'):
        check(changed(recorded.messages, 'method', 0, seed=4))


def test_advice_that_was_not_given_is_named(recorded):
    other = [(topic, msg._replace(action=(msg.action + 1) % 4))
             if topic == 'recommendation' else (topic, msg) for topic, msg in recorded.messages
             if topic != 'mentor_policy']
    with pytest.raises(ReplayDifference, match='and the bag has no such recommendation'):
        check(other)


def test_the_policy_of_the_mentor_replaces_missing_recommendations(recorded):
    messages = [each for each in recorded.messages if each[0] != 'recommendation']
    assert check(messages).replays[0].unadvised == 0
    result, = check([each for each in messages if each[0] != 'mentor_policy']).replays
    assert (result.unadvised > 10, result.digest) == (True, recorded.digest)


def test_missing_actions_are_inferred_from_the_observations(recorded):
    first = [msg for topic, msg in recorded.messages if topic == 'action'][:20]
    late = [each for each in recorded.messages if each[0] != 'action' or each[1] not in first]
    result, = check(late).replays
    assert (result.inferred, result.digest) == (20, recorded.digest)
    result, = check(without(recorded.messages, 'action', 30)).replays
    assert (result.inferred, result.digest) == (1, recorded.digest)


def test_a_missing_observation_stops_the_verification(recorded):
    with pytest.raises(MissingMessage, match=r'the observation of run 7, episode \d+, step \d+, '
                       'is not in the bag'):
        check(without(recorded.messages, 'state', 10))


@pytest.mark.parametrize('number', [5, 6])
def test_a_learner_that_starts_again_is_verified_by_itself(recorded, number):
    second = SimulatedRun(number=number, run=8)
    first, other = check(
        recorded.messages[:len(recorded.messages) // 2] + second.messages).replays
    assert (first.description.learner, first.learner.finished, first.digests) == (5, False, 0)
    assert (other.description.learner, other.digest) == (number, recorded.digest)


def test_a_recording_from_the_middle_is_checked_as_far_as_possible(recorded):
    world, description, late = recorded.messages[0], recorded.messages[1], recorded.messages[200:]
    for start in ([world, description], [world]):
        result = check([*start, *late])
        assert (result.replays, list(result.unverifiable)) == ([], [5])
    assert check([world, *late[:9], description, *late[9:]]).replays == []
    result = check([world, *late])
    assert result.replays == []
    assert result.unverifiable[5].possible > 10
    with pytest.raises(ReplayDifference, match='recorded action 9, which state'):
        check([world, *changed(late, 'action', 5, action=9)])
    with pytest.raises(ReplayDifference, match='recorded state 999, which the world does not'):
        check([world, *changed(late, 'state', 5, state=999)])


def test_a_description_of_an_older_version_is_verified(recorded):
    description = recorded.messages[1][1]
    settings = json.loads(description.settings)
    settings['curiosity'] = settings.pop('exploration_probability')
    messages = [(topic, msg._replace(settings=json.dumps(settings)) if topic == 'method' else msg)
                for topic, msg in recorded.messages]
    assert check(messages).replays[0].digest == recorded.digest
    settings['curiosity'] = 0.25
    config = config_from_description(description._replace(settings=json.dumps(settings)))
    assert asdict(config) == {**asdict(recorded.config), 'exploration_probability': 0.25}


@pytest.mark.parametrize('settings', ['', '[]', '{"no_field": 1}', '{"discount": 2.0}'])
def test_invalid_settings_are_named(recorded, settings):
    with pytest.raises(BagError, match='settings of learner 5 must be fields of a method: '):
        check(changed(recorded.messages, 'method', 0, settings=settings))


def run_replay(capsys, *argv):
    """Return exit code, output and errors of the command, without its progress bar."""
    code = replay.main(['replay', *map(str, argv)])
    output = capsys.readouterr()
    return code, output.out, output.err


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_command_verifies_a_bag(recorded, tmp_path, capsys, storage):
    bag = write_bag(tmp_path / 'bag', recorded.messages, storage)
    code, out, err = run_replay(capsys, bag)
    assert code == 0
    assert out.startswith('verified: learner 5 (beta_implicit, seed 3): ')
    assert out.endswith(f'; 1 matching digest, the last {recorded.digest}\n')
    assert 'cut off' not in err


def test_the_command_names_a_difference_and_fails(recorded, tmp_path, capsys):
    action = [msg for topic, msg in recorded.messages if topic == 'action'][10]
    bag = write_bag(tmp_path / 'bag', changed(recorded.messages, 'action', 10, confidence=0.5))
    code, out, _ = run_replay(capsys, bag)
    assert code == 1
    assert f'difference: topic action, {step_of(action)}: recorded' in out


def test_the_command_reports_what_it_cannot_verify(recorded, tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', [recorded.messages[0], *recorded.messages[200:]])
    code, out, _ = run_replay(capsys, bag)
    assert code == 1
    assert out.startswith('not verifiable: learner 5 was recorded from run 7, episode ')
    assert 'actions fit their observations' in out
    bag = write_bag(tmp_path / 'other', without(recorded.messages, 'state', 10))
    code, out, _ = run_replay(capsys, bag)
    assert code == 1
    assert 'verification stopped: the observation of run 7, episode ' in out


def test_a_learner_without_a_description_is_named_as_such(recorded, tmp_path, capsys):
    messages = [each for each in recorded.messages if each[0] not in ('method', 'progress')]
    code, out, _ = run_replay(capsys, write_bag(tmp_path / 'bag', messages))
    actions = sum(topic == 'action' for topic, _ in messages)
    assert code == 1
    assert out == ('not verifiable: learner 5 has published nothing on the topic method, so its '
                   f'initial state is unknown; {actions} actions fit their observations\n')


def test_a_learner_that_began_with_a_learning_cannot_be_verified(recorded, tmp_path, capsys):
    settings = {**json.loads(recorded.messages[1][1].settings), 'initial_learning': 'a digest'}
    messages = [(topic, msg._replace(settings=json.dumps(settings)) if topic == 'method' else msg)
                for topic, msg in recorded.messages]
    code, out, _ = run_replay(capsys, write_bag(tmp_path / 'bag', messages))
    assert code == 1
    assert out.startswith('not verifiable: learner 5 began with initial_learning, which is not in '
                          'the bag, so its initial state is unknown; ')


def test_a_learner_that_learns_nothing_is_verified():
    recorded = SimulatedRun(learns=False)
    result, = check(recorded.messages).replays
    assert result.digest == recorded.digest and result.matching > 10


@pytest.mark.parametrize('method', METHODS['published'])
def test_a_learner_with_several_mentors_is_verified_up_to_its_last_digest(method):
    run = SimulatedRun(method, iterations=2, episodes=1, mentors=('anna', '', 'bob'))
    result, = check(run.messages).replays
    assert (result.digests, result.digest, result.unadvised) == (1, run.digest, 0)
    assert result.matching == sum(topic == 'action' for topic, _ in run.messages) > 10


@pytest.fixture(scope='module')
def of_several():
    """Return a run of a learner with two mentors; a third one joins."""
    return SimulatedRun(mentors=('anna', 'bob'), joining={'carl': 15})


def test_a_mentor_that_joins_is_verified(of_several):
    names = [tuple(msg.mentors) for topic, msg in of_several.messages if topic == 'method']
    assert names == [('anna', 'bob'), ('anna', 'bob', 'carl'), ('anna', 'bob', 'carl')]
    counts = [len(msg.all_advice) for topic, msg in of_several.messages if topic == 'action']
    assert counts == sorted(counts) and {*counts} == {2, 3}
    result, = check(of_several.messages).replays
    assert (result.digest, result.learner.mentors) == (of_several.digest, names[-1])


def test_advice_of_another_mentor_that_was_not_given_is_named(of_several):
    place = next(number for number, (topic, msg) in enumerate(of_several.messages)
                 if topic == 'mentors/bob/mentor_policy')
    topic, policy = of_several.messages[place]
    others = [(topic, policy._replace(action=[(a + 1) % 4 for a in policy.action])),
              *(each for each in of_several.messages if 'mentors/bob' not in each[0])]
    with pytest.raises(ReplayDifference, match=r'recorded advice \d of mentor bob in state \d+, '
                       'and the bag has no such recommendation'):
        check(others)


def test_advice_that_counted_otherwise_is_found(of_several):
    actions = [msg for topic, msg in of_several.messages if topic == 'action']
    number = next(n for n, msg in enumerate(actions) if n > 20 and msg.advice >= 0)
    with pytest.raises(ReplayDifference, match='topic action, run 7'):
        check(changed(of_several.messages, 'action', number, mentor=9))


def test_another_confidence_in_one_mentor_is_named(of_several):
    number = next(n for n, msg in enumerate(msg for topic, msg in of_several.messages
                                            if topic == 'progress') if msg.mentor == 'bob')
    with pytest.raises(ReplayDifference,
                       match='topic progress, run 7, iteration 1, mentor bob: recorded'):
        check(changed(of_several.messages, 'progress', number, confidence=0.125))


def test_missing_actions_of_several_mentors_are_inferred_from_their_policies(of_several):
    late = without(of_several.messages, 'action', 30)
    result, = check(late).replays
    assert (result.inferred, result.digest) == (1, of_several.digest)


def test_names_that_no_mentors_can_have_are_named(recorded):
    with pytest.raises(BagError, match='the mentors of learner 5 must have names that they can '
                       r"have, got \('a', 'a'\)"):
        check(changed(recorded.messages, 'method', 0, mentors=('a', 'a')))


def test_the_namespace_can_be_chosen(recorded, tmp_path, capsys):
    bag = write_bag(tmp_path / 'bag', recorded.messages, namespace='/second')
    assert run_replay(capsys, bag, '--namespace', 'second')[0] == 0
    code, _, err = run_replay(capsys, bag, '--namespace', 'third')
    assert code == 2
    assert err.endswith('must have a world in namespace /third, and has none among its '
                        f'{len(recorded.messages)} messages: its namespaces are /second\n')


def test_a_bag_without_a_learner_is_reported_in_one_line(recorded, tmp_path, capsys):
    messages = [each for each in recorded.messages
                if each[0] not in ('action', 'method', 'progress')]
    code, _, err = run_replay(capsys, write_bag(tmp_path / 'bag', messages))
    assert code == 2
    assert 'replay: the bag must have the actions of a learner, and has none\n' in err
