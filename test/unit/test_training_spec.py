# SPDX-License-Identifier: Apache-2.0
"""What is checked of a training before it begins, and when its world is known."""

import pytest

from comply_ros.learner.presets import find_method
from comply_ros.mentor.mentor_spec import MentorError
from comply_ros.mentor.policy_validation import PolicyError
from comply_ros.storage.map_files import read_map
from comply_ros.storage.training_spec import in_world, spec_training
from comply_ros.world.state_action_spaces import Spaces

TWO_STATES = Spaces(2, ('left', 'right'), 9)


def test_what_depends_on_a_world_that_is_not_known_yet_is_checked_when_it_is(tmp_path):
    (tmp_path / 'policy.txt').write_text('1 right\n')
    training = spec_training(None, mentor=f'file:{tmp_path}/policy.txt', method='sarsa')
    assert training.config == find_method('sarsa', 'published')
    found = in_world(training, 'two', TWO_STATES)
    assert (found.map_name, found.source, found.mentor) == ('two', TWO_STATES, training.mentor)
    with pytest.raises(PolicyError, match='a policy must have a row for each of the 11 rows'):
        in_world(training, 'bar_grid', read_map('bar_grid', 'published'))


@pytest.mark.parametrize('mentor, advising, problem', [
    ('optimal', 'early', "a mentor of the kind 'optimal' must plan"),
    ('random', 'important', "advising 'important' must know what an action leads to")])
def test_what_needs_a_model_is_rejected_in_a_world_without_one(mentor, advising, problem):
    training = spec_training(None, mentor=mentor, budget=1, advising=advising)
    with pytest.raises(MentorError, match=problem):
        in_world(training, 'two', TWO_STATES)
