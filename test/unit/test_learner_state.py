# SPDX-License-Identifier: Apache-2.0
"""The arrays of a learner, and their digest."""

from collections import namedtuple
import hashlib
import struct

import numpy as np
import pytest
from tiny_worlds import Bench, corridor

from comply_ros.learner.learner_state import LATER_ARRAYS, LearnerState

# The fields in the order in which the digest of version 0.1.0 goes over them. There the scalars
# were one array, `schedule`.
SCALARS = ('scheduled_confidence', 'temperature', 'trust_rate', 'guided_stage', 'best_return',
           'advice_agreed', 'advice_seen', 'pool_size', 'pool_listen', 'pool_discard')
FIELDS = ('q', 'visits', 'belief', 'departures', *SCALARS, 'traces', 'trail', 'outcomes',
          'half_difference', 'model', 'pooled', 'values', 'potential', 'advised', 'predecessors',
          'queue', 'queued', 'workspace', 'priority', 'sampled', 'confidences',
          'followed', 'followed_mentor', 'prior_sizes', 'reward_squares', 'sample_squares',
          'value_changes', 'verdicts')
OF_A_MODEL = (*FIELDS[FIELDS.index('model'):FIELDS.index('priority')],
              *FIELDS[FIELDS.index('prior_sizes'):])
OF_A_PLANNER = ('model', 'pooled', 'predecessors', 'queue', 'queued', 'priority', 'sampled')


def test_a_fresh_state_knows_which_actions_there_are():
    state = Bench(corridor(), initial_value=3.0, trust='beta').state
    inf = float('inf')
    assert state.q.tolist() == [[-inf, 3, -inf, -inf], [3, 3, -inf, -inf], [3, -inf, -inf, -inf]]
    assert state.belief.tolist() == [[8.0, 2.0, 0.0]] * 3
    assert state.visits.tolist() == [[1.0] * 4] * 3 and state.departures.tolist() == [1.0] * 3
    assert [getattr(state, name).tolist() for name in SCALARS] == [
        [0.9], [1.0], [1.0], [0.0], [-np.inf], [1.0], [1.0], [1.0], [8.0], [2.0]]


def test_the_digest_is_over_all_arrays_in_order_little_endian():
    state = LearnerState(*(np.array([float(number)]) for number in range(len(FIELDS))))
    expected = hashlib.sha256(
        b''.join(struct.pack('<d', number) for number in range(len(FIELDS))))
    assert state.digest() == expected.hexdigest()


@pytest.mark.parametrize('settings', [
    {'trust': 'beta'}, {'trust': 'explicit', 'trust_rate': 0.1, 'trace_decay': 0.8},
    {'trust': 'head_start', 'replays': True}], ids=str)
def test_the_digest_is_that_of_the_layout_of_version_0_1_0(settings):
    state = Bench(corridor(), **settings).state
    for number, array in enumerate(state, 1):
        array += number  # so that no two arrays are alike; infinities stay
    schedule = np.array([getattr(state, name)[0] for name in SCALARS])
    arrays = (state.q, state.visits, state.belief, state.departures, schedule, state.traces,
              state.trail, state.outcomes)
    elements = b''.join(array.astype('<f8').tobytes() for array in arrays)
    assert state.digest() == hashlib.sha256(elements).hexdigest()


@pytest.mark.parametrize('name', FIELDS)
def test_every_array_counts_in_the_digest(name):
    settings = {'learns_model': True} if name in OF_A_MODEL else {'replays': True}
    if name == 'half_difference':
        settings = {'doubles': True, 'off_policy': True}
    if name in ('priority', 'sampled'):
        settings = {'planner': 'psrl'}
    if name.startswith('followed'):
        settings = {'trust': 'returns'}
    state = Bench(corridor(), 2 if name == 'confidences' else 1, **settings).state
    before = state.digest()
    getattr(state, name).flat[0] = 7
    assert state.digest() != before


@pytest.mark.parametrize(('settings', 'used'), [
    ({}, ()), ({'doubles': True, 'off_policy': True}, ('half_difference',)),
    ({'learns_model': True}, OF_A_MODEL), ({'planner': 'r_max'}, OF_A_PLANNER[:-1]),
    ({'planner': 'psrl'}, OF_A_PLANNER),
    ({'trust': 'shaping', 'estimates_consistency': True}, ('workspace',)),
    ({'trust': 'returns'}, ('followed', 'followed_mentor'))], ids=str)
def test_an_array_that_the_settings_do_not_use_has_no_elements(settings, used):
    state = Bench(corridor(), **settings).state
    assert {name for name in LATER_ARRAYS if getattr(state, name).size} == set(used)
    for name, array in LATER_ARRAYS.items():
        assert (array.ndim, array.dtype) == (
            getattr(state, name).ndim, getattr(state, name).dtype), name


def test_every_field_is_in_the_tests_above():
    assert LearnerState._fields == FIELDS


def test_a_new_array_without_elements_changes_no_digest():
    state = Bench(corridor(), trust='beta').state
    for place in range(len(FIELDS) + 1):
        fields = (*FIELDS[:place], 'new', *FIELDS[place:])
        newer_class = type('NewerState', (namedtuple('NewerState', fields),),
                           {'digest': LearnerState.digest})
        newer = newer_class(**state._asdict(), new=np.zeros((0, 4)))
        assert newer.digest() == state.digest()
        assert newer._replace(new=np.zeros(1)).digest() != state.digest()


def test_views_share_the_arrays():
    state = Bench(corridor()).state
    state.views().q[1, 1] = 7.5
    assert state.q[1, 1] == 7.5


def test_views_have_the_fields_of_the_state():
    state = Bench(corridor(), trust='beta').state
    views = state.views()
    for name, array in state._asdict().items():
        assert np.array_equal(getattr(views, name), array), name
    with pytest.raises(AttributeError):
        views.other = state.q
