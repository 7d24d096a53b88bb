# SPDX-License-Identifier: Apache-2.0
"""Several mentors of one learner: how they are written, and their names."""

import pytest

from comply_ros.mentor.several_mentors import (
    has_files,
    joined,
    MentorNameError,
    split_mentors,
    validate_mentor_names,
)


def test_a_single_mentor_has_no_name():
    assert split_mentors('noisy:0.6@0.5') == {'': 'noisy:0.6@0.5'}


def test_several_have_names_by_what_they_are_or_those_that_are_given():
    assert split_mentors('optimal + noisy:0.6 + anna=file:a/b c.txt') == {
        'optimal': 'optimal', 'noisy_0_6': 'noisy:0.6', 'anna': 'file:a/b c.txt'}


def test_a_mentor_from_a_file_has_the_name_of_the_file():
    assert list(split_mentors('file:maps/me 2.txt + learned:out/learning.npz + file:2.txt')) == [
        'me_2', 'learning', 'file_2']


def test_a_name_that_is_taken_gets_a_number():
    assert list(split_mentors('random + random + random_2=optimal + random')) == [
        'random', 'random_3', 'random_2', 'random_4']


def test_a_plus_in_a_path_does_not_part_two_mentors():
    assert split_mentors('file:a + b.txt') == {'': 'file:a + b.txt'}
    assert split_mentors('optimal + file:a + b.txt') == {'optimal': 'optimal',
                                                         'a_b': 'file:a + b.txt'}


def test_a_list_is_the_same_as_its_text():
    assert joined(['optimal', 'bob=random']) == 'optimal + bob=random'
    assert joined('optimal + random') == 'optimal + random'


def test_it_is_known_whether_one_of_them_is_from_a_file():
    assert has_files('optimal + me=learned:a.npz') and not has_files('optimal + random')


@pytest.mark.parametrize('text, message', [
    ('anna=optimal + anna=random', "each mentor must have a name of its own, got 'anna' twice"),
    ('a b=optimal + random', 'the name of a mentor must be a letter, then letters, digits and '
     "single underscores between them, got 'a b'"),
    ('=optimal + =random', "each mentor must have a name of its own, got '' twice"),
    (joined(50 * ['random']), 'a learner must have 1 to 16 mentors, got 50')])
def test_names_that_cannot_be_are_rejected_in_a_sentence(text, message):
    with pytest.raises(MentorNameError) as error:
        split_mentors(text)
    assert str(error.value) == message


@pytest.mark.parametrize('name', ['1a', 'a__b', 'a_', '_a', 'a-b', 'ä', 'a/b', 'a\n'])
def test_a_name_must_be_a_part_of_the_name_of_a_topic(name):
    with pytest.raises(MentorNameError, match='the name of a mentor must be a letter'):
        validate_mentor_names(['good', name])


def test_one_of_several_may_have_no_name_and_there_must_be_one():
    validate_mentor_names(['', 'anna'])
    with pytest.raises(MentorNameError, match='must have 1 to 16 mentors, got 0'):
        validate_mentor_names([])
