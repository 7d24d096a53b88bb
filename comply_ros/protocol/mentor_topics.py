# SPDX-License-Identifier: Apache-2.0
"""The names of the topics and services of a mentor that has a name."""

from comply_ros.mentor.several_mentors import NAME

MENTORS = 'mentors'  # namespace of what mentors with a name publish
TOPICS_OF_MENTORS = ('recommendation', 'mentor_policy')  # that each of them has


def name_of_mentor(name: str, mentor: str) -> str:
    """Return the name of a topic or service of a mentor, whose own name may be empty."""
    return f'{MENTORS}/{mentor}/{name}' if mentor else name


def topic_and_mentor(name: str) -> tuple[str, str]:
    """Return the name of a topic of the only mentor, and the mentor whose topic is named so."""
    before, _, topic = name.rpartition('/')
    space, _, mentor = before.partition('/')
    return (topic, mentor) if space == MENTORS and NAME.fullmatch(mentor) else (name, '')
