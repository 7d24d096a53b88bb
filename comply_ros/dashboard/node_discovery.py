# SPDX-License-Identifier: Apache-2.0
"""Finds the world, the mentor and the learner by the topics that they publish, not by name."""

from collections import Counter
from collections.abc import Callable, Collection
from typing import NamedTuple

from rclpy.node import Node

from comply_ros.nodes import topics


class Role(NamedTuple):
    """
    What a node does in a lesson.

    Attributes
    ----------
    noun: in sentences.
    topics: that its node publishes on; the first is the one that a lesson needs.

    """

    noun: str
    topics: tuple[topics.Topic, ...]


ROLES = {  # by executable, which is the name of its node unless it was renamed
    'grid_world': Role('world', (topics.WORLD, topics.STATE, topics.EPISODE)),
    'mentor': Role('mentor', (topics.RECOMMENDATION, topics.MENTOR_POLICY)),
    'learner': Role('learner', (topics.ACTION, topics.DESCRIPTION, topics.PROGRESS))}
WORLD, MENTOR, LEARNER = ROLES


class LessonNode(NamedTuple):
    """
    The node that has a role.

    Attributes
    ----------
    name: as `local_name` has it; that of the executable while no node was found.
    topic: full name of the topic that the role needs.
    is_publishing: whether it publishes on a topic of the role.

    """

    name: str
    topic: str
    is_publishing: bool = False


DEFAULT_NODES = {name: LessonNode(name, f'/{role.topics[0].name}') for name, role in ROLES.items()}


def missing_text(role: str, node: LessonNode) -> str:
    """Sentence, without its end, on a role that no node has."""
    return f'no {ROLES[role].noun} publishes on {node.topic}'


class LessonNodes:
    """
    Follows which nodes take part in the lesson on the topics of a node.

    Attributes
    ----------
    by_role: the node that has each role.
    names: of all nodes that publish on a topic of the lesson, and those of the executables.
    mentor_names: under which recommendations are published; '' for the topic without a name.
    is_name_shared: whether more than one mentor has one of these names.

    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.by_role = {name: LessonNode(name, node.resolve_topic_name(role.topics[0].name))
                        for name, role in ROLES.items()}
        self.names: set[str] = {*ROLES}
        self.mentor_names: tuple[str, ...] = ('',)
        self.is_name_shared = True
        self._mentors: set[str] = {MENTOR}

    def is_mentor(self, name: str) -> bool:
        """Whether a node recommends actions."""
        return name in self._mentors

    def silent_mentors(self, names: Collection[str]) -> int:
        """Return how many nodes recommend actions that are not among those with a status."""
        return len(self._mentors - {MENTOR, *names})

    def update(self, is_alive: Callable[[str], bool]) -> None:
        """
        Look for the nodes, with the given test of whether a node has sent its status lately.

        The node of a role is one that sends its status, and has the most topics of the role; else
        the node of before, and else that with the name of the executable.
        """
        self.names = {*ROLES}
        self._update_mentors()
        for role_name, role in ROLES.items():
            counts = Counter(name for topic in self._topics_of(role)
                             for name in self._publishers(topic))
            before = self.by_role[role_name]
            best = max([before.name, role_name, *counts], key=lambda name: (
                is_alive(name), counts[name], name == before.name, name == role_name, name))
            self.by_role[role_name] = before._replace(name=best, is_publishing=counts[best] > 0)
            self.names |= {*counts, best}

    def _update_mentors(self) -> None:
        """Look for the mentors; while none has a name, who else publishes is told otherwise."""
        named = [name for name in topics.mentors_found(self._node) if name][:topics.MOST_MENTORS]
        unnamed = self._node.count_publishers(topics.RECOMMENDATION.name)
        self.mentor_names = (*named, '') if unnamed or not named else (*named,)
        found = [topics.topic_of_mentor(topics.RECOMMENDATION, name) for name in named]
        self.is_name_shared = not named or unnamed > 1 or any(
            self._node.count_publishers(topic.name) > 1 for topic in found)
        self._mentors = {MENTOR, *(name for topic in (topics.RECOMMENDATION, *found)
                                   for name in self._publishers(topic))}

    def _topics_of(self, role: Role) -> list[topics.Topic]:
        """Return the topics of a role: those of a mentor for each name."""
        return list(role.topics) if role is not ROLES[MENTOR] else [
            topics.topic_of_mentor(topic, name) for topic in role.topics
            for name in {*self.mentor_names, ''}]

    def local_name(self, full_name: str) -> str:
        """Name of a node: without the namespace if that is ours, else with it and a slash."""
        namespace, _, name = full_name.strip('/').rpartition('/')
        return name if namespace == self._node.get_namespace().strip('/') else \
            f'/{full_name.strip("/")}'

    def _publishers(self, topic: topics.Topic) -> set[str]:
        return {self.local_name(name) for name in topics.publisher_names(self._node, topic)}
