# SPDX-License-Identifier: Apache-2.0
"""How mentors are written."""

import pytest

from comply_ros.mentor.mentor_spec import MentorError, MentorSpec, parse_mentor_spec


@pytest.mark.parametrize('text, spec', [
    ('optimal', MentorSpec('optimal')), ('none', MentorSpec('none')),
    ('noisy:0.2', MentorSpec('noisy', 0.2)), ('snapshot:0.75', MentorSpec('snapshot', 0.75)),
    ('file:a:b.txt', MentorSpec('file', 'a:b.txt')),
    ('snapshot:0.75@0.2', MentorSpec('snapshot', 0.75, 0.2)), ('optimal@1', MentorSpec('optimal')),
    ('learned:a:b.npz@0.5', MentorSpec('learned', 'a:b.npz', 0.5)),
    ('learner:/robot_2', MentorSpec('learner', '/robot_2')),
    ('learner:/@0.5', MentorSpec('learner', '/', 0.5)),
    ('file:a@0.5', MentorSpec('file', 'a', 0.5)), ('file:a@b.txt', MentorSpec('file', 'a@b.txt'))])
def test_a_mentor_is_written_as_kind_and_value(text, spec):
    assert parse_mentor_spec(text) == spec


@pytest.mark.parametrize('text, message', [
    ('good', 'a mentor must be one of optimal, random, adversarial, noisy:P, snapshot:Q, '
     "file:PATH, learned:FILE.npz, learner:/NAMESPACE, none, got 'good'"),
    ('noisy', "this mentor is written noisy:P, such as noisy:0.3, got 'noisy'"),
    ('optimal:1', "this mentor is written optimal, got 'optimal:1'"),
    ('file:', "this mentor is written file:PATH, such as file:mentor.txt, got 'file:'"),
    ('noisy:1.5', "the P of noisy:P must lie in [0, 1], got '1.5'"),
    ('noisy:much', "the P of noisy:P must be a number, got 'much'"),
    ('optimal@2', "the coverage of MENTOR@COVERAGE must lie in [0, 1], got '2'"),
    ('optimal@', "the coverage of MENTOR@COVERAGE must be a number, got ''"),
    ('optimal@0.5@0.2', 'a mentor must be one of optimal, random, adversarial, noisy:P, '
     "snapshot:Q, file:PATH, learned:FILE.npz, learner:/NAMESPACE, none, got 'optimal@0.5'"),
    ('learner:robot_2', 'the NAMESPACE of learner:/NAMESPACE must be that of another learner, '
     "such as /robot_2, got 'robot_2'"),
    ('noisy:0.2@1@1', "the P of noisy:P must be a number, got '0.2@1'"),
    ('snapshot:nan', "the Q of snapshot:Q must lie in [0, 1], got 'nan'")])
def test_a_mentor_that_does_not_exist_is_rejected(text, message):
    with pytest.raises(MentorError) as error:
        parse_mentor_spec(text)
    assert str(error.value) == message
