# SPDX-License-Identifier: Apache-2.0
"""What was stored by an earlier version with the same numbers can be read."""

from comply_ros.learner.learner_config import CONFIG_FIELDS, LearnerConfig
from comply_ros.storage.versions import FORMAT_VERSION, LATER_FIELDS

# That the first files of the format had. A new field belongs to LATER_FIELDS, not here.
FIRST_FIELDS = {
    'off_policy', 'replays', 'discount', 'initial_value', 'learning_rate',
    'learning_rate_exponent', 'visit_growth', 'trace_decay', 'trace_floor', 'replacing_traces',
    'cuts_traces', 'temperature', 'temperature_factor', 'temperature_floor', 'cooling_confidence',
    'trust', 'excludes_refused', 'confidence', 'confidence_factor', 'reuse_factor',
    'belief_listen', 'belief_discard', 'learns_prior', 'exploration_probability', 'trust_rate',
    'trust_rate_factor', 'sign_only', 'bounded_belief', 'updates_both', 'listen_temperature',
    'listen_temperature_exponent', 'guided_steps', 'guided_stages', 'guided_tolerance',
    'measuring_iterations', 'iterations', 'episodes'}


def test_every_field_that_the_first_files_do_not_have_has_the_value_of_then():
    assert FORMAT_VERSION == 3
    assert {*FIRST_FIELDS, *LATER_FIELDS} == {*CONFIG_FIELDS}
    assert not FIRST_FIELDS & {*LATER_FIELDS}


def test_a_field_that_came_later_changes_nothing_by_default():
    config = LearnerConfig()
    assert {name: getattr(config, name) for name in LATER_FIELDS} == LATER_FIELDS
