# SPDX-License-Identifier: Apache-2.0
"""The table of learners: what each row sets."""

from dataclasses import replace

import pytest

from comply_ros.learner.learner_config import ConfigError
from comply_ros.learner.presets import find_method, listening_lead, METHODS

ROWS = [(profile, name) for profile, table in METHODS.items() for name in table]


def test_both_profiles_know_the_same_methods():
    assert list(METHODS) == ['report', 'published']
    assert list(METHODS['report']) == list(METHODS['published'])


@pytest.mark.parametrize('profile, name', [
    row for row in ROWS if 'off_policy' not in row[1] or row[0] == 'report'])
def test_learning_rates_obey_stochastic_approximation(profile, name):  # (2.16)
    # sum of 1 / c^e diverges for e <= 1, sum of its squares converges for 2 e > 1.
    row = find_method(name, profile)
    assert 0.5 < row.learning_rate_exponent <= 1.0
    assert row.visit_growth > 0.0


@pytest.mark.parametrize('profile, name', ROWS)
def test_only_scheduled_learners_may_repeat_a_refused_action(profile, name):  # 3.4.1 against (3.7)
    row = find_method(name, profile)
    assert row.excludes_refused == (row.trust in ('beta', 'explicit', 'shaping'))


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
def test_the_published_rows_are_those_of_the_runs(name):
    row = METHODS['published'][name]
    assert tuple(getattr(row, field) for field in RATES) == PUBLISHED[name]
    assert {field: getattr(row, field) for field in TRUSTING.get(name, ())} == TRUSTING.get(
        name, {})
    assert (row.temperature_floor, row.measuring_iterations, row.discount) == (0.03, 1, 1.0)
    assert row.off_policy == (name in ('q_learning', 'watkins'))
    assert row.trace_decay == {'sarsa_lambda': 0.8, 'watkins': 0.8}.get(name, 0.0)


@pytest.mark.parametrize('name', PUBLISHED)
def test_the_report_rows_differ_where_the_text_does(name):
    row = METHODS['report'][name]
    assert (row.learning_rate_exponent, row.visit_growth) == (0.55, 1.0)  # (2.26)
    assert (row.temperature_floor, row.measuring_iterations) == (1e-9, 0)
    assert not row.sign_only and not row.bounded_belief  # (4.2)
    assert row.updates_both  # (3.12)
    assert row.cooling_confidence == 1.0
    assert row.trust_rate == {'beta_implicit': 0.3, 'explicit': 0.1}.get(name, 1.0)


@pytest.mark.parametrize('profile', METHODS)
def test_variants_differ_from_their_rows_in_one_thing(profile):
    table = METHODS[profile]
    for name in ('constant', 'vanishing', 'beta_implicit', 'explicit'):
        assert table[f'{name}_lambda'] == replace(table[name], trace_decay=0.8)
    for name in ('beta_implicit', 'explicit'):  # section 4.4
        assert table[f'{name}_off_policy'].off_policy
    assert table['explicit_off_policy'] == replace(table['explicit'], off_policy=True)


def test_the_published_off_policy_belief_had_settings_of_its_own():
    row = METHODS['published']['beta_implicit_off_policy']
    assert (row.learning_rate_exponent, row.visit_growth) == (0.2, 1 / 15)
    assert (row.sign_only, row.trust_rate_factor) == (False, 0.99)


def test_explicit_begins_with_the_lead_of_the_prior():  # (3.13): 0.5 log(0.9 / 0.1)
    row = METHODS['report']['explicit']
    lead = listening_lead(0.9, row.listen_temperature)
    assert row.belief_listen - row.belief_discard == pytest.approx(lead)


def test_an_unknown_name_is_refused_with_those_that_exist():
    with pytest.raises(ConfigError, match="method must be one of sarsa, .*, got 'sarse'"):
        find_method('sarse', 'report')
    with pytest.raises(ConfigError, match="profile must be one of report, published, got 'x'"):
        find_method('sarsa', 'x')
