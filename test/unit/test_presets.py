# SPDX-License-Identifier: Apache-2.0
"""The table of learners: what each preset sets."""

from dataclasses import replace

from bar_grid_training import PRESETS
import pytest

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.presets import find_method, listening_lead, METHODS

TEXTBOOK = 'sarsa_epsilon', 'q_learning_epsilon', 'expected_sarsa', 'double_q_learning'


def test_both_profiles_have_the_same_methods():
    assert list(METHODS) == ['report', 'published']
    assert list(METHODS['report']) == list(METHODS['published'])


@pytest.mark.parametrize('profile, name', [
    each for each in PRESETS if each[1] not in TEXTBOOK  # whose rates are constant
    and ('off_policy' not in each[1] or each[0] == 'report')])
def test_learning_rates_obey_stochastic_approximation(profile, name):  # (2.16)
    # sum of 1 / c^e diverges for e <= 1, sum of its squares converges for 2 e > 1.
    config = find_method(name, profile)
    assert 0.5 < config.learning_rate_exponent <= 1.0
    assert config.visit_growth > 0.0


@pytest.mark.parametrize('profile, name', PRESETS)
def test_only_scheduled_learners_may_choose_advice_that_they_do_not_follow(
        profile, name):  # 3.4.1 against (3.7)
    config = find_method(name, profile)
    assert config.excludes_refused == (config.trust in ('beta', 'explicit', 'shaping'))


RATES = ('temperature', 'temperature_factor', 'initial_value', 'learning_rate',
         'learning_rate_exponent', 'visit_growth', 'iterations', 'episodes')
# The settings of the runs behind the figures, as they were.
PUBLISHED = {
    'sarsa': (4.0, 0.99, 3.0, 1.0, 1.0, 1 / 15, 600, 15),
    'q_learning': (1.0, 0.98, 1.0, 0.8, 0.505, 1.0, 600, 10),
    'sarsa_lambda': (5.0, 0.97, 2.0, 0.5, 0.51, 1.0, 200, 15),
    'watkins': (2.0, 0.95, 2.0, 0.8, 0.505, 1 / 15, 150, 15),
    'constant': (0.5, 0.98, 0.0, 1.0, 0.51, 1.0, 400, 15),
    'vanishing': (0.5, 0.98, 0.0, 1.0, 0.51, 1.0, 400, 15),
    'beta_implicit': (1.0, 0.99, 0.0, 1.0, 1.0, 1 / 15, 400, 15),
    'explicit': (2.0, 0.99, 0.0, 1.0, 0.55, 1 / 15, 400, 15)}
TRUSTING = {
    'constant': {'confidence': 0.9, 'confidence_factor': 1.0, 'cooling_confidence': 1.0},
    'vanishing': {'confidence': 0.9, 'confidence_factor': 0.99, 'cooling_confidence': 0.5},
    'beta_implicit': {'belief_listen': 8.0, 'belief_discard': 2.0, 'trust_rate': 2.0,
                      'sign_only': True, 'bounded_belief': True},
    'explicit': {'belief_listen': 1.095, 'belief_discard': 0.0, 'trust_rate': 0.1,
                 'updates_both': False, 'listen_temperature': 0.5,
                 'listen_temperature_exponent': 0.55}}


@pytest.mark.parametrize('name', PUBLISHED)
def test_the_published_presets_are_those_of_the_published_runs(name):
    config = METHODS['published'][name]
    assert tuple(getattr(config, field) for field in RATES) == PUBLISHED[name]
    assert {field: getattr(config, field) for field in TRUSTING.get(name, ())} == TRUSTING.get(
        name, {})
    assert (config.temperature_floor, config.measuring_iterations) == (0.03, 1)
    assert config.discount == 1.0
    assert config.off_policy == (name in ('q_learning', 'watkins'))
    assert config.trace_decay == {'sarsa_lambda': 0.8, 'watkins': 0.8}.get(name, 0.0)


@pytest.mark.parametrize('name', PUBLISHED)
def test_the_report_presets_differ_where_the_text_does(name):
    config = METHODS['report'][name]
    assert (config.learning_rate_exponent, config.visit_growth) == (0.55, 1.0)  # (2.26)
    assert (config.temperature_floor, config.measuring_iterations) == (1e-9, 0)
    assert not config.sign_only and not config.bounded_belief  # (4.2)
    assert config.updates_both  # (3.12)
    assert config.cooling_confidence == 1.0
    assert config.trust_rate == {'beta_implicit': 0.3, 'explicit': 0.1}.get(name, 1.0)


@pytest.mark.parametrize('profile', METHODS)
def test_variants_differ_from_their_presets_in_one_setting(profile):
    table = METHODS[profile]
    for name in ('constant', 'vanishing', 'beta_implicit', 'explicit'):
        assert table[f'{name}_lambda'] == replace(table[name], trace_decay=0.8)
    for name in ('beta_implicit', 'explicit'):  # section 4.4
        assert table[f'{name}_off_policy'].off_policy
    assert table['explicit_off_policy'] == replace(table['explicit'], off_policy=True)


def test_the_published_off_policy_belief_had_settings_of_its_own():
    config = METHODS['published']['beta_implicit_off_policy']
    assert (config.learning_rate_exponent, config.visit_growth) == (0.2, 1 / 15)
    assert (config.sign_only, config.trust_rate_factor) == (False, 0.99)


@pytest.mark.parametrize('name', TEXTBOOK)
def test_the_settings_of_the_textbook_are_those_of_its_example_6_6(name):
    config = find_method(name, 'published')
    assert (config.learning_rate, config.learning_rate_exponent) == (0.5, 0.0)
    assert (config.epsilon, config.discount, config.initial_value) == (0.1, 1.0, 0.0)
    assert config.iterations * config.episodes == 500
    assert config.off_policy == ('q_learning' in name)


@pytest.mark.parametrize('name', ['prioritized_sweeping', 'r_max', 'mbie_eb', 'psrl'])
def test_a_planner_has_the_name_of_its_row(name):
    config = find_method(name, 'published')
    assert config.planner == name and config.discount == 0.99
    assert (config.epsilon, config.untried_value) == (
        (0.1, 0.0) if name == 'prioritized_sweeping' else (0.0, 1.0))
    assert config.initial_value == (10.0 if name == 'mbie_eb' else 0.0)


def test_explicit_trust_starts_with_the_lead_of_the_prior():  # (3.13): 0.5 log(0.9 / 0.1)
    config = METHODS['report']['explicit']
    lead = listening_lead(0.9, config.listen_temperature)
    assert config.belief_listen - config.belief_discard == pytest.approx(lead)


def test_an_unknown_name_is_rejected_with_those_that_exist():
    with pytest.raises(ConfigError, match="method must be one of sarsa, .*, got 'sarse'"):
        find_method('sarse', 'report')
    with pytest.raises(ConfigError, match="profile must be one of report, published, got 'x'"):
        find_method('sarsa', 'x')
