# SPDX-License-Identifier: Apache-2.0
"""An agent with several mentors: who joins, what is saved, and what others begin with."""

from dataclasses import replace
import json

import numpy as np
import pytest
from tiny_worlds import corridor, room

from comply_ros.learner.agent import Agent
from comply_ros.learner.learner_config import LearnerConfig
from comply_ros.learner.learner_state import arranged_rows
from comply_ros.learner.learning_result import LearningError
from comply_ros.learner.presets import METHODS
from comply_ros.world.grid import DOWN, LEFT, NO_ACTION, RIGHT, UP

SILENT = NO_ACTION


def make_agent(mentors, initial=None, **settings):
    """Return an agent in the corridor, with one episode an iteration."""
    config = LearnerConfig(**{'episodes': 1, 'iterations': 9, 'trust': 'beta', **settings})
    agent = Agent(config, 0, initial, mentors)
    agent.start(corridor())
    return agent


def play_episode(agent, first, second):
    """Lead the agent from 0 over 1 to the goal; return its decisions."""
    silence = len(agent.mentors) * (SILENT,)
    return [agent.step(0, 0, 0.0, False, False, first),
            agent.step(1, 1, -1.0, False, False, second),
            agent.step(2, 2, 10.0, True, False, silence)]


def test_a_mentor_that_joins_is_unknown_and_the_others_stay_known():
    agent = make_agent(('anna', 'bob'))
    for _ in range(2):
        play_episode(agent, (RIGHT, RIGHT), (RIGHT, LEFT))
    before = {name: array.copy() for name, array in agent.state._asdict().items()}
    agent.add_mentor('carl')
    assert agent.mentors == ('anna', 'bob', 'carl')
    for name, array in agent.state._asdict().items():
        if name == 'belief':
            assert array[6:].tolist() == 3 * [[8.0, 2.0, 0.0]]
            assert array[:6].tolist() == before[name].tolist() != 6 * [[8.0, 2.0, 0.0]]
        elif name.startswith('pool_') or name in ('advice_agreed', 'advice_seen'):
            fresh = {'pool_listen': 8.0, 'pool_discard': 2.0}.get(name, 1.0)
            assert array.tolist() == [*before[name], fresh], name
        elif name == 'confidences':
            assert array.tolist() == [0.0, 0.0, 0.0]
        else:
            assert array.tolist() == before[name].tolist(), name
    assert agent.earlier_advice.tolist() == 9 * [SILENT]


def test_a_mentor_joins_a_learner_with_a_model_and_no_advice_of_it_is_judged():
    agent = make_agent(('anna',), learns_model=True, trust='track_record')
    for _ in range(3):
        play_episode(agent, (RIGHT,), (RIGHT,))
    agent.state.verdicts[1] = 1
    before = agent.state.verdicts.tolist()
    agent.add_mentor('bob')
    assert agent.state.verdicts.tolist() == before + len(before) * [0]
    play_episode(agent, (RIGHT, LEFT), (RIGHT, RIGHT))
    assert agent.state.advised[[0, len(before), 1]].tolist() == [RIGHT, LEFT, RIGHT]


def test_with_another_kind_of_trust_no_advice_is_judged():
    agent = make_agent(('anna',), learns_model=True, trust='track_record')
    agent.state.verdicts[:2], agent.state.advice_seen[0] = (1, -1), 6.0
    for trust, seen in (('none', 1.0), ('track_record', 4.0)):
        agent.reconfigure(replace(agent.config, trust=trust), 9 * [SILENT])
        assert not agent.state.verdicts.any()
        assert agent.state.advice_seen[0] == seen


def test_whole_episodes_without_a_reward_count_against_who_advised_in_them():
    agent = make_agent(('anna', 'bob'), learns_model=True, trust='track_record')
    advice, silence = (RIGHT, SILENT), (SILENT, SILENT)
    agent.step(0, 0, 0.0, False, False, advice)
    agent.step(1, 1, 0.0, False, False, advice)  # interrupted: the next one is a start
    for _ in range(2):
        agent.step(0, 0, 0.0, False, False, advice)
        agent.step(1, 1, 0.0, False, True, advice)
    assert agent.state.advice_seen.tolist() == [6.0, 4.0]
    agent.step(0, 0, 0.0, False, False, advice)
    agent.step(2, 1, 10.0, True, False, silence)
    assert agent.state.advice_seen.tolist() == [6.0, 4.0]


@pytest.mark.parametrize('name', ['constant', 'vanishing', 'beta_implicit', 'explicit_lambda',
                                  'head_start', 'jump_start', 'pi_reuse'])
def test_one_who_joins_changes_what_one_changes_who_was_silent_until_then(name):
    settings = {**vars(METHODS['published'][name]), 'episodes': 1, 'iterations': 9}
    late, silent = make_agent(('anna',), **settings), make_agent(('anna', 'bob'), **settings)
    for _ in range(3):
        one = play_episode(late, (RIGHT,), (LEFT,))
        two = play_episode(silent, (RIGHT, SILENT), (LEFT, SILENT))
        assert [each[:3] for each in one] == [each[:3] for each in two]
    late.add_mentor('bob')
    for _ in range(3):
        assert repr(play_episode(late, (RIGHT, RIGHT), (LEFT, RIGHT))) == repr(
            play_episode(silent, (RIGHT, RIGHT), (LEFT, RIGHT)))
    assert late.state.digest() == silent.state.digest()


def test_one_who_joins_within_an_episode_loses_no_step():
    agent = make_agent(('anna',))
    agent.step(0, 0, 0.0, False, False, (RIGHT,))
    agent.add_mentor('bob')
    agent.step(1, 1, -1.0, False, False, (RIGHT, LEFT))
    assert agent.steps == 1 and agent.state.visits[0, RIGHT] == 2.0
    assert agent.state.belief[0].tolist() != [8.0, 2.0, 0.0]  # anna's advice counted
    assert agent.state.belief[3].tolist() == [8.0, 2.0, 0.0]  # bob had given none


def test_an_iteration_has_the_mean_confidence_in_each_of_several_mentors():
    # The confidence is 1 in step 0 and 1/2 in step 1.
    agent = make_agent(('anna', 'bob', 'carl'), trust='scheduled', confidence=1.0,
                       reuse_factor=0.5)
    *_, last = play_episode(agent, (RIGHT, SILENT, SILENT), (RIGHT, RIGHT, SILENT))
    assert last.iteration.confidence == 0.75
    assert repr(last.iteration.confidences) == '(0.75, 0.5, nan)'
    *_, last = play_episode(agent, (RIGHT, SILENT, SILENT), 3 * (SILENT,))
    assert repr(last.iteration.confidences) == '(1.0, nan, nan)'  # of this iteration alone
    *_, last = play_episode(make_agent(('anna',)), (RIGHT,), (RIGHT,))
    assert last.iteration.confidences == ()


def test_a_decision_says_whose_advice_it_considered():
    agent = make_agent(('anna', 'bob'), trust='scheduled', confidence=1.0)
    assert [each[:3] + each[4:] for each in play_episode(
        agent, (SILENT, RIGHT), (SILENT, SILENT))[:1]] == [(RIGHT, True, 1.0, 1)]
    assert play_episode(agent, (SILENT, RIGHT), (SILENT, SILENT))[1][1:3] == (False, 0.0)
    assert [each.mentor for each in play_episode(
        agent, (RIGHT, RIGHT), (SILENT, LEFT))] == [0, 1, -1]


OBSERVATIONS = [(0, 0, 0.0, False, False, (RIGHT, SILENT)),
                (1, 1, -1.0, False, False, (RIGHT, LEFT)),
                (2, 2, 10.0, True, False, (SILENT, SILENT))] * 3


@pytest.mark.parametrize('steps', range(6))
def test_an_agent_with_two_mentors_that_is_restored_at_any_step_continues_the_same(steps):
    settings = {'trace_decay': 0.5, 'episodes': 2}
    names = ('anna', 'bob')
    agent, again = make_agent(names, **settings), make_agent(names, **settings)
    for observation in OBSERVATIONS[:steps]:
        agent.step(*observation)
    values, arrays = agent.state_dict()
    again.load_state_dict(json.loads(json.dumps(values)),
                          {name: array.copy() for name, array in arrays.items()})
    for observation in OBSERVATIONS[steps:]:
        assert repr(again.step(*observation)) == repr(agent.step(*observation))
    assert again.state.digest() == agent.state.digest()


@pytest.mark.parametrize('steps', range(6))
def test_what_was_saved_when_there_was_one_mentor_only_is_restored(steps):
    observations = [(*each[:5], each[5][:1]) for each in OBSERVATIONS]
    agent, again = make_agent(('',), episodes=2), make_agent(('',), episodes=2)
    for observation in observations[:steps]:
        agent.step(*observation)
    values, arrays = agent.state_dict()
    advised, total = values.pop('confidences')
    old = {**values, 'advised': int(advised), 'confidence_sum': total,
           'last_advice': values['last_advice'][0]}
    again.load_state_dict(json.loads(json.dumps(old)), {
        name: array.copy() for name, array in arrays.items() if name != 'confidences'})
    for observation in observations[steps:]:
        assert repr(again.step(*observation)) == repr(agent.step(*observation))
    assert again.state.digest() == agent.state.digest()


def test_rows_of_mentors_are_arranged_by_their_names():
    rows, fresh = np.arange(6), np.full(9, -1)
    found = arranged_rows(rows, ('anna', 'bob'), ('bob', 'carl', 'anna'), fresh)
    assert found.tolist() == [3, 4, 5, -1, -1, -1, 0, 1, 2]
    assert fresh.tolist() == 9 * [-1]


def test_a_learner_begins_with_what_was_learned_of_those_of_its_mentors():
    first = make_agent(('anna', 'bob'))
    play_episode(first, (RIGHT, RIGHT), (RIGHT, LEFT))
    learned = first.learned([RIGHT, RIGHT, SILENT, RIGHT, LEFT, SILENT])
    agent = make_agent(('bob', 'carl'), learned)
    assert agent.state.belief[:3].tolist() == first.state.belief[3:].tolist()
    assert agent.state.belief[3:].tolist() == 3 * [[8.0, 2.0, 0.0]]
    assert agent.state.pool_size.tolist() == [first.state.pool_size[1], 1.0]
    assert agent.state.pool_discard.tolist() == [first.state.pool_discard[1], 2.0]
    assert agent.earlier_advice.tolist() == [RIGHT, LEFT, SILENT, SILENT, SILENT, SILENT]
    assert agent.state.q.tolist() == first.state.q.tolist()


def test_a_learner_that_acts_only_has_the_policy_that_the_mentors_made():
    first = make_agent(('anna', 'bob'))
    learned = first.learned([RIGHT, LEFT, SILENT, SILENT, RIGHT, SILENT])
    # In state 1 both are trusted alike, and no value is known: the first counts.
    assert learned.policy.tolist() == [RIGHT, LEFT, SILENT]
    first.state.belief[3 + 1, 0] = 9.0
    learned = first.learned([RIGHT, LEFT, SILENT, SILENT, RIGHT, SILENT])
    assert learned.policy.tolist() == [RIGHT, RIGHT, SILENT]
    agent = make_agent(('bob',), learned, learns=False)
    assert agent.policy.tolist() == [RIGHT, RIGHT, SILENT]
    assert agent.learned(agent.earlier_advice).confidence.tolist() == [0.8, 9.0 / 11.0, 0.8]


def test_what_was_learned_of_several_mentors_must_have_rows_for_each():
    learned = make_agent(('anna', 'bob')).learned(6 * [SILENT])
    learned.validate(corridor())
    with pytest.raises(LearningError, match=r'belief must be float64 of shape \(9, 3\)'):
        learned._replace(mentors=('anna', 'bob', 'carl')).validate(corridor())


def test_changed_settings_count_for_the_beliefs_in_all_mentors():
    agent = make_agent(('anna', 'bob'))
    play_episode(agent, (RIGHT, SILENT), (SILENT, SILENT))
    known = agent.state.belief[0].tolist()
    agent.reconfigure(replace(agent.config, belief_listen=5.0), 6 * [SILENT])
    belief = agent.state.belief
    assert belief[0].tolist() == known
    assert belief[5].tolist() == [5.0, 2.0, 0.0]  # state 2 was never left
    agent.reconfigure(replace(agent.config, trust='explicit', trust_rate=0.1), 6 * [SILENT])
    assert agent.state.belief.tolist() == 6 * [[5.0, 2.0, 0.0]]
    assert agent.state.pool_size.tolist() == [1.0, 1.0]


def test_an_agent_that_starts_in_another_world_keeps_its_mentors():
    agent = make_agent(('anna',))
    agent.add_mentor('bob')
    agent.start(room())
    assert agent.mentors == ('anna', 'bob') and agent.state.belief.shape == (18, 3)
    decision = agent.step(4, 0, 0.0, False, False, (UP, DOWN))
    assert decision.confidence == 0.8 and decision.mentor == 0
