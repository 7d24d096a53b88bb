# SPDX-License-Identifier: Apache-2.0
"""Who speaks or listens on a topic with another type than it has: DDS would say nothing."""
LONG = 30  # looks, one a second


class TopicTypeCheck:
    """
    Looks at both ends of a node's topics.

    Parameters
    ----------
    node: the rclpy node.

    """

    def __init__(self, node):
        self._node, self._kinds, self._told = node, {}, set()
        self._crowded = {}

    def watch(self, topic, has_one_speaker=False):
        """Look at this topic too; has_one_speaker: whether two on it are one too many."""
        kind = topic.message
        if has_one_speaker:
            self._crowded[self._node.resolve_topic_name(topic.name)] = 0
        package = kind.__module__.partition('.')[0]
        self._kinds[self._node.resolve_topic_name(topic.name)] = f'{package}/msg/{kind.__name__}'

    def look(self):
        """Return one sentence for everything that is wrong and was not told of yet."""
        return [*self._crowds(), *self._wrong_types()]

    def _crowds(self):
        """Return a sentence where two speak for long; a dead one is seen for twenty seconds."""
        for name, looks in self._crowded.items():
            speakers = len(self._node.get_publishers_info_by_topic(name))
            self._crowded[name] = looks + 1 if speakers > 1 else 0
            if looks + 1 == LONG and speakers > 1:
                yield (f'topic {name} must have one speaker, got {speakers}: all of them are '
                       'heard, and the bits are not the same any more; end all but one')

    def _wrong_types(self):
        return [self._sentence(name, kind, end) for name, kind in self._kinds.items()
                for end in (*self._node.get_publishers_info_by_topic(name),
                            *self._node.get_subscriptions_info_by_topic(name))
                if end.topic_type != kind and self._is_new(name, end)]

    def _is_new(self, name, end):
        seen = name, end.topic_type, end.node_namespace, end.node_name
        new = seen not in self._told
        self._told.add(seen)
        return new

    def _sentence(self, name, kind, end):
        who = f'{end.node_namespace.rstrip("/")}/{end.node_name}'
        does = 'speaks' if end.endpoint_type.name == 'PUBLISHER' else 'listens'
        return (f'topic {name} must have the type {kind}, and {who} {does} there with '
                f'{end.topic_type}: nothing of it arrives')
