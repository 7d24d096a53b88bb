# SPDX-License-Identifier: Apache-2.0
"""What was meant by a misspelt name."""

import pytest

from comply_ros.numerics.similar_name import did_you_mean, similar_name

NAMES = ('mentor', 'mentors', 'robots', 'rate')


@pytest.mark.parametrize('name, similar', [
    ('mentr', 'mentor'), ('Rate', 'rate'), ('robot_name', None), ('mentor', None), ('', None)])
def test_a_similar_name_is_found_and_a_known_or_another_one_has_none(name, similar):
    assert similar_name(name, NAMES) == similar


def test_a_question_is_asked_where_there_is_a_similar_name_only():
    assert did_you_mean('mentr', NAMES, before='; ') == "; did you mean 'mentor'?"
    assert did_you_mean('mentr', NAMES, after=' ') == "did you mean 'mentor'? "
    assert did_you_mean('robot_name', NAMES, before='; ') == ''
