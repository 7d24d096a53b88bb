# SPDX-License-Identifier: Apache-2.0
"""Rows of the table of methods, and what they may hold."""

from dataclasses import fields

import pytest

from comply_ros.core.method import (
    FIELDS,
    find_method,
    listening_lead,
    Method,
    MethodError,
    METHODS,
    Numbers,
    TRUSTS,
    with_text,
)

ROWS = [(profile, name) for profile, table in METHODS.items() for name in table]


def test_both_profiles_know_the_same_methods():
    assert list(METHODS) == ['report', 'published']
    assert set(METHODS['report']) == set(METHODS['published']) == {
        'sarsa', 'q_learning', 'constant', 'vanishing', 'beta_implicit', 'explicit'}


def test_numbers_hold_every_field():
    assert Numbers._fields == tuple(FIELDS) == tuple(f.name for f in fields(Method))
    numbers = find_method('explicit', 'report').numbers()
    assert TRUSTS[numbers.trust] == 'explicit'
    assert all(isinstance(value, (bool, int, float)) for value in numbers)


def test_every_field_explains_itself():
    for row in FIELDS.values():
        assert len(row.metadata['text']) > 10
        assert row.type is not float or row.metadata['low'] < row.metadata['high']


@pytest.mark.parametrize('profile, name', ROWS)
def test_learning_rates_obey_stochastic_approximation(profile, name):  # (2.16)
    # sum of 1 / c^e diverges for e <= 1, sum of its squares converges for 2 e > 1.
    row = find_method(name, profile)
    assert 0.5 < row.learning_rate_exponent <= 1.0
    assert row.visit_growth > 0.0


@pytest.mark.parametrize('profile, name', ROWS)
def test_only_scheduled_learners_may_repeat_a_refused_action(profile, name):  # 3.4.1 against (3.7)
    row = find_method(name, profile)
    assert row.excludes_refused == (row.trust in ('beta', 'explicit'))


RATES = ('temperature', 'temperature_factor', 'initial_value', 'learning_rate',
         'learning_rate_exponent', 'visit_growth', 'iterations', 'episodes')
# The settings of the runs behind the figures, as they were.
PUBLISHED = {
    'sarsa': (4.0, 0.99, 3.0, 1.0, 1.0, 1 / 15, 600, 15),
    'q_learning': (1.0, 0.98, 1.0, 0.8, 0.505, 1.0, 600, 10),
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


@pytest.mark.parametrize('name', METHODS['published'])
def test_the_published_rows_are_those_of_the_runs(name):
    row = METHODS['published'][name]
    assert tuple(getattr(row, field) for field in RATES) == PUBLISHED[name]
    assert {field: getattr(row, field) for field in TRUSTING.get(name, ())} == TRUSTING.get(
        name, {})
    assert (row.temperature_floor, row.measuring_iterations, row.discount) == (0.03, 1, 1.0)
    assert row.off_policy == (name == 'q_learning')


@pytest.mark.parametrize('name', METHODS['report'])
def test_the_report_rows_differ_where_the_text_does(name):
    row = METHODS['report'][name]
    assert (row.learning_rate_exponent, row.visit_growth) == (0.55, 1.0)  # (2.26)
    assert (row.temperature_floor, row.measuring_iterations) == (1e-9, 0)
    assert not row.sign_only and not row.bounded_belief  # (4.2)
    assert row.updates_both  # (3.12)
    assert row.cooling_confidence == 1.0
    assert row.trust_rate == {'beta_implicit': 0.3, 'explicit': 0.1}.get(name, 1.0)


def test_explicit_begins_with_the_lead_of_the_prior():  # (3.13): 0.5 log(0.9 / 0.1)
    row = METHODS['report']['explicit']
    lead = listening_lead(0.9, row.listen_temperature)
    assert row.belief_listen - row.belief_discard == pytest.approx(lead)


@pytest.mark.parametrize('name, value, message', [
    ('discount', 1.3, 'discount must lie in [0, 1], got 1.3'),
    ('temperature', 0.0, 'temperature must lie in [1e-09, 1000000], got 0.0'),
    ('temperature', float('nan'), 'temperature must lie in [1e-09, 1000000], got nan'),
    ('episodes', 0, 'episodes must lie in [1, 1000000], got 0'),
    ('discount', 1, 'discount must be a number such as 1.0, got 1'),
    ('off_policy', 1, 'off_policy must be true or false, got 1'),
    ('trust', 'blind', "trust must be one of none, scheduled, beta, explicit, got 'blind'"),
])
def test_a_value_out_of_range_is_refused(name, value, message):
    with pytest.raises(MethodError) as error:
        Method(**{name: value})
    assert str(error.value) == message


def test_ranges_that_depend_on_the_kind_of_trust():
    with pytest.raises(MethodError, match=r'trust_rate must lie in \[0, 1\] where trust is expl'):
        Method(trust='explicit', trust_rate=2.0)
    with pytest.raises(MethodError, match='must be above 0 where trust is beta, got 0.0 and 2.0'):
        Method(trust='beta', belief_listen=0.0)


@pytest.mark.parametrize('name, text, value', [
    ('discount', '0.5', 0.5), ('episodes', '7', 7), ('off_policy', 'True', True),
    ('trust', 'beta', 'beta'), ('temperature', '2', 2.0)])
def test_fields_are_read_from_text(name, text, value):
    assert getattr(with_text(Method(), name, text), name) == value


@pytest.mark.parametrize('name, text, message', [
    ('speed', '1', "a method has no field 'speed'; it has off_policy, "),
    ('episodes', '1.5', "episodes must be a whole number, got '1.5'"),
    ('off_policy', 'maybe', "off_policy must be true or false, got 'maybe'"),
    ('discount', 'high', "discount must be a number such as 1.0, got 'high'"),
    ('discount', '-1', 'discount must lie in [0, 1], got -1.0')])
def test_a_wrong_text_is_refused(name, text, message):
    with pytest.raises(MethodError) as error:
        with_text(Method(), name, text)
    assert str(error.value).startswith(message)


def test_an_unknown_name_is_refused_with_those_that_exist():
    with pytest.raises(MethodError, match="method must be one of sarsa, .*, got 'sarse'"):
        find_method('sarse', 'report')
    with pytest.raises(MethodError, match="profile must be one of report, published, got 'x'"):
        find_method('sarsa', 'x')
