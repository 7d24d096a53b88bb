# SPDX-License-Identifier: Apache-2.0
"""The settings of a learner: fields, ranges, and how they are read from text."""

from dataclasses import fields, replace

from bar_grid_training import train_with, use_shared_code
import pytest

from comply_ros.learner.learner_config import (
    CONFIG_FIELDS,
    ConfigError,
    field_type,
    KernelConfig,
    LearnerConfig,
    TRUSTS,
    with_text,
)
from comply_ros.learner.presets import find_method

# Settings under which each of these values changes what is learned, for the trusts of its field.
BASIS = LearnerConfig(iterations=12, episodes=5, temperature_factor=0.9, belief_listen=1.0,
                      belief_discard=1.0, trust_rate=1.0, guided_steps=6, guided_stages=4)
OTHER_VALUES = {
    'confidence': 0.3, 'confidence_factor': 0.5, 'reuse_factor': 0.7, 'belief_listen': 3.0,
    'belief_discard': 8.0, 'learns_prior': True, 'exploration_probability': 0.9,
    'advice_slack': 1.0, 'trust_rate': 0.3, 'trust_rate_factor': 0.5, 'sign_only': True,
    'bounded_belief': True, 'updates_both': False, 'listen_temperature': 2.0,
    'listen_temperature_exponent': 0.1, 'guided_steps': 2, 'guided_stages': 1,
    'guided_tolerance': 0.0, 'estimates_consistency': True}
OF_SEVERAL = {'return_bonus'}  # with one mentor it changes nothing: see test_mentor_of_episode.py
NOISE = {'advice_slack': 0.2}  # of the mentor, where a perfect one shows no difference


def learn(config, noise=0.0):
    """Return what a learner with these settings has learned in `bar_grid`, and its returns."""
    with pytest.MonkeyPatch.context() as patch:
        use_shared_code(patch, config)
        learning, results = train_with(config, noise=noise)
    state = learning.state
    return [state.q.tobytes(), state.visits.tobytes(), *(each.mean_return for each in results)]


def with_trust(trust):
    """Return the basis with a kind of trust, and with the model that it may need."""
    return replace(BASIS, trust=trust, learns_model=trust == 'track_record')


def test_kernels_get_every_field_as_a_number():
    names = tuple(each.name for each in fields(LearnerConfig))
    assert tuple(CONFIG_FIELDS) == names
    assert KernelConfig._fields == (*names, 'actions', 'has_model', 'has_planner', 'has_estimates',
                                    'has_bandit', 'mentors')
    config = find_method('explicit', 'report')
    kernel_config = config.for_kernels(4)
    assert TRUSTS[kernel_config.trust] == 'explicit'
    assert all(isinstance(value, (bool, int, float)) for value in kernel_config[:len(names)])
    assert (len(kernel_config.actions), len(kernel_config.mentors)) == (4, 1)
    assert len(config.for_kernels(4, 3).mentors) == 3
    for name in names:
        value = getattr(kernel_config, name)
        assert name in ('trust', 'planner') or value == getattr(config, name)


def test_every_field_has_a_text_and_every_number_a_range():
    for name, each in CONFIG_FIELDS.items():
        assert len(each.metadata['text']) > 10
        assert field_type(name) is type(each.default)
        if field_type(name) is float:
            assert each.metadata['low'] < each.metadata['high']


@pytest.mark.parametrize('name, value, message', [
    ('discount', 1.3, 'discount must lie in [0, 1], got 1.3'),
    ('temperature', 0.0, 'temperature must lie in [1e-09, 1000000], got 0.0'),
    ('temperature', float('nan'), 'temperature must lie in [1e-09, 1000000], got nan'),
    ('episodes', 0, 'episodes must lie in [1, 1000000], got 0'),
    ('discount', 1, 'discount must be a number such as 1.0, got 1'),
    ('off_policy', 1, 'off_policy must be true or false, got 1'),
    ('trust', 'blind', 'trust must be one of none, scheduled, beta, explicit, shaping, '
     "jump_start, head_start, track_record, returns, got 'blind'"),
])
def test_a_value_out_of_its_range_is_rejected(name, value, message):
    with pytest.raises(ConfigError) as error:
        LearnerConfig(**{name: value})
    assert str(error.value) == message


def test_a_learner_with_a_model_counts_whole_visits():
    with pytest.raises(ConfigError) as error:
        LearnerConfig(replays=True, visit_growth=0.5)
    assert str(error.value) == 'visit_growth must be 1.0 where replays is true, got 0.5'


@pytest.mark.parametrize(('settings', 'message'), [
    ({'expects': True, 'off_policy': True},
     'off_policy and replays must be false and trust none where expects is true, got true, false '
     'and none'),
    ({'expects': True, 'replays': True},
     'off_policy and replays must be false and trust none where expects is true, got false, true '
     'and none'),
    ({'doubles': True},
     'off_policy must be true, replays false, trust none and trace_decay 0 where doubles is true, '
     'got false, false, none and 0.0')])
def test_what_a_method_cannot_be_at_the_same_time_is_rejected(settings, message):
    with pytest.raises(ConfigError) as error:
        LearnerConfig(**settings)
    assert str(error.value) == message


@pytest.mark.parametrize('settings, message', [
    ({'visit_growth': 0.5}, 'visit_growth must be 1.0 where learns_model is true, got 0.5'),
    ({'replays': True}, 'replays must be false where learns_model is true, got true'),
    ({'expects': True}, 'expects must be false where learns_model is true, got true'),
    ({'doubles': True, 'off_policy': True},
     'doubles must be false where learns_model is true, got true'),
    ({'trust': 'beta'},
     "trust must be none or track_record where learns_model is true, got 'beta'"),
    ({'trust': 'track_record', 'learns_model': False},
     'learns_model must be true where trust is track_record, got false')])
def test_a_model_of_outcomes_rules_out_other_ways_to_learn(settings, message):
    with pytest.raises(ConfigError) as error:
        LearnerConfig(**{'learns_model': True, **settings})
    assert str(error.value) == message


@pytest.mark.parametrize(('settings', 'message'), [
    ({'learns_model': True}, 'learns_model must be false where planner is mbie_eb, got true'),
    ({'doubles': True, 'off_policy': True},
     'doubles must be false where planner is mbie_eb, got true'),
    ({'trust': 'beta'}, 'trust must be none where planner is mbie_eb, got beta'),
    ({'visit_growth': 0.5}, 'visit_growth must be 1.0 where planner is mbie_eb, got 0.5'),
    ({'trace_decay': 0.8}, 'trace_decay must be 0.0 where planner is mbie_eb, got 0.8'),
    ({'discount': 1.0}, 'discount must be below 1 where planner is mbie_eb, got 1.0'),
    ({'planner': 'dyna'}, 'planner must be one of none, prioritized_sweeping, r_max, mbie_eb, '
     "psrl, got 'dyna'")])
def test_a_planner_rules_out_other_ways_to_learn(settings, message):
    with pytest.raises(ConfigError) as error:
        LearnerConfig(**{'planner': 'mbie_eb', 'discount': 0.9, **settings})
    assert str(error.value) == message


def test_some_ranges_depend_on_the_kind_of_trust():
    with pytest.raises(ConfigError, match=r'trust_rate must lie in \[0, 1\] where trust is expl'):
        LearnerConfig(trust='explicit', trust_rate=2.0)
    with pytest.raises(ConfigError, match='must be above 0 where trust is beta, got 0.0 and 2.0'):
        LearnerConfig(trust='beta', belief_listen=0.0)


@pytest.mark.parametrize('name, text, value', [
    ('discount', '0.5', 0.5), ('episodes', '7', 7), ('off_policy', 'True', True),
    ('trust', 'beta', 'beta'), ('temperature', '2', 2.0)])
def test_fields_are_read_from_text(name, text, value):
    assert getattr(with_text(LearnerConfig(), name, text), name) == value


@pytest.mark.parametrize('name, text, message', [
    ('speed', '1', "a method has no field 'speed'; it has off_policy, "),
    ('episodes', '1.5', "episodes must be a whole number, got '1.5'"),
    ('off_policy', 'maybe', "off_policy must be true or false, got 'maybe'"),
    ('discount', 'high', "discount must be a number such as 1.0, got 'high'"),
    ('episodes', '9' * 400, f"episodes must lie in [1, 1000000], got {'9' * 400}"),
    ('discount', '-1', 'discount must lie in [0, 1], got -1.0')])
def test_a_text_that_is_no_value_of_the_field_is_rejected(name, text, message):
    with pytest.raises(ConfigError) as error:
        with_text(LearnerConfig(), name, text)
    assert str(error.value).startswith(message)


@pytest.mark.parametrize('trust', TRUSTS)
def test_a_field_that_a_trust_does_not_use_changes_nothing_that_is_learned(trust):
    known = with_trust(trust)
    learned = learn(known)
    for name, value in OTHER_VALUES.items():
        if not known.uses(name):
            assert learn(replace(known, **{name: value})) == learned, name


@pytest.mark.parametrize('name', OTHER_VALUES)
def test_a_field_with_trusts_changes_what_each_of_them_learns(name):
    for trust in CONFIG_FIELDS[name].metadata['trusts']:
        known = with_trust(trust)
        assert known.uses(name)
        noise = NOISE.get(name, 0.0)
        other = replace(known, **{name: OTHER_VALUES[name]})
        assert learn(other, noise) != learn(known, noise), trust


def test_the_fields_with_trusts_are_those_tested():
    assert OTHER_VALUES.keys() | OF_SEVERAL == {name for name, each in CONFIG_FIELDS.items()
                                                if 'trusts' in each.metadata}


def test_confidence_counts_for_each_trust_where_it_holds_the_temperature():
    assert not LearnerConfig(trust='beta').uses('confidence')
    assert LearnerConfig(trust='beta', cooling_confidence=0.5).uses('confidence')
