# SPDX-License-Identifier: Apache-2.0
"""The messages of world, mentor and learner, decoded from a bag."""

from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from comply_ros.bags.bag_message import BagError, BagMessage, first_line
from comply_ros.bags.bag_reader import Bag
from comply_ros.protocol import world_description
from comply_ros.protocol.mentor_topics import topic_and_mentor, TOPICS_OF_MENTORS
from comply_ros.protocol.messages import (
    GridModel,
    NANOSECONDS,
    NO_RUN,
    PROTOCOL,
    TableModel,
    TOPIC_TYPES,
    tuple_maker,
    WorldDescription,
)
from comply_ros.world.grid import ACTION_NAMES
from comply_ros.world.mdp import World

# Of a WorldDescription of version 0.1.0, whose messages had no header and no `protocol`.
FIELDS_OF_PROTOCOL_1 = ('run', 'began', 'name', 'width', 'height', 'rows', 'starts', 'step_reward',
                        'obstacle_reward', 'goal_reward', 'intended', 'step_limit', 'slips_bump')
# Fields of messages of the present protocol that are left at their defaults where there is one
# mentor, without a name; protocol 2 and version 0.1.0 do not have them.
ONE_MENTOR_FIELDS = ('mentor', 'all_advice', 'mentors')


class DecodedMessages:
    """
    The messages in one namespace of a bag as tuples of `messages`, in the order of the bag.

    namespace: of the nodes; None for the only one that has a world. Then as in `/second`, and
        empty for the root. BagError if it has no world, or if there is more than one to choose.
    """

    def __init__(self, bag: Bag, namespace: str | None = None) -> None:
        self.bag = bag
        self.namespace = _find_namespace(bag, namespace)
        self._decoders: dict[str, Callable[[bytes], Any]] = {}

    def __iter__(self) -> Iterator[tuple[str, Any]]:
        """
        Yield the topic and the tuple of each message; raises BagError for an unreadable one.

        The topics of mentors have the names of `name_of_mentor`.
        """
        prefix = f'{self.namespace}/'
        for number, recorded in enumerate(self.bag):
            topic = recorded.topic.removeprefix(prefix)
            kind = topic_kind(topic) if recorded.topic.startswith(prefix) else None
            if kind is None or recorded.message_type != message_type(kind):
                continue
            if topic not in self._decoders:
                self._decoders[topic] = _decoder(kind, recorded)
            try:
                msg = self._decoders[topic](recorded.data)
            except Exception as error:  # noqa: BLE001 - arbitrary bytes can raise anything
                raise BagError(f'message {number} of the bag, on topic {recorded.topic}, must be '
                               f'a {recorded.message_type}, and is not ({first_line(error)})'
                               ) from None
            yield topic, msg


@cache
def topic_kind(topic: str) -> str | None:
    """Return the name of `TOPIC_TYPES` of a topic, of a mentor perhaps; None if it is no such."""
    kind, mentor = topic_and_mentor(topic)
    return kind if kind in (TOPICS_OF_MENTORS if mentor else TOPIC_TYPES) else None


def message_type(topic: str) -> str:
    """ROS type of the messages on a topic of `TOPIC_TYPES`."""
    return f'comply_msgs/msg/{TOPIC_TYPES[topic].__name__}'


def world_from_description(description: WorldDescription) -> World:
    """`World` of a recorded description; raises BagError for an invalid one."""
    try:
        return World(world_description.world_from_description(description))
    except ValueError as error:
        raise BagError(f'the world of run {description.run} must be valid: {error}') from None


def _find_namespace(bag: Bag, given: str | None) -> str:
    """Return the given namespace, or the only one, if it has a world."""
    found = set()
    for recorded in bag:
        namespace, _, topic = recorded.topic.rpartition('/')
        if topic == 'world' and recorded.message_type == message_type('world'):
            found.add(namespace)
    wanted = found if given is None else {'/' + given.strip('/') if given.strip('/') else ''}
    if not wanted or not wanted <= found:
        where = ''.join(f' in namespace {name}' for name in wanted if name)
        raise BagError(f'bag {str(bag.path)!r} must have a world{where}, and has none among its '
                       f'{bag.count} messages' + (f' ({bag.truncation})' if bag.truncation else '')
                       + (f': its namespaces are {_listed(found)}' if found else ''))
    if len(wanted) > 1:
        raise BagError(f'bag {str(bag.path)!r} has worlds in several namespaces: choose one of '
                       f'{_listed(found)} with --namespace')
    return wanted.pop()


def _listed(namespaces: Iterable[str]) -> str:
    return ', '.join(namespace or '/' for namespace in sorted(namespaces))


def _decoder(topic: str, recorded: BagMessage) -> Callable[[bytes], Any]:
    """Return a function from bytes to a tuple; raises BagError for another message version."""
    tuple_type, (encoding, text) = TOPIC_TYPES[topic], recorded.definition
    if encoding != 'ros2msg':
        raise BagError(f'topic {recorded.topic} must come with its definition as ros2msg, '
                       f'got {encoding or "none"!r}')
    try:
        store = _types(text, recorded.message_type)
        fields = [field for field, _ in store.fielddefs[recorded.message_type][1]]
    except Exception as error:  # noqa: BLE001 - an arbitrary text can raise anything
        raise BagError(f'the definition of {recorded.message_type} in the bag must be valid '
                       f'({first_line(error)})') from None
    missing = [field for field in tuple_type._fields if field not in fields]
    make = tuple_maker(tuple_type)
    if missing:
        make = _maker_of_older(tuple_type, missing, fields)
    elif tuple_type is WorldDescription:
        make = _world_of_protocol_2
    if make is None:
        raise BagError(f'{recorded.message_type} must have the fields of protocol {PROTOCOL}, of '
                       'protocol 2 or of version 0.1.0; in the bag it has no '
                       f'{", ".join(missing)}')
    return lambda data: _with_lists(make(store.deserialize_cdr(data, recorded.message_type)))


@lru_cache(100)
def _types(text: str, name: str) -> Any:
    """Return the types of a definition: read once, and not for each mentor and each bag."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, name))
    return store


def _with_lists(values: Any) -> Any:
    """Return a tuple with lists instead of arrays of numpy, and tuples in `ONE_MENTOR_FIELDS`."""
    found = [value.tolist() if isinstance(value, np.ndarray) else
             _with_lists(value) if hasattr(value, '_fields') else value for value in values]
    return type(values)(*[
        tuple(value) if name in ONE_MENTOR_FIELDS and isinstance(value, list) else value
        for name, value in zip(values._fields, found)])


def _maker_of_older(tuple_type: type[Any], missing: Sequence[str],
                    fields: Sequence[str]) -> Callable[[Any], Any] | None:
    """Return a function from a message of protocol 2 or version 0.1.0 to a tuple, or None."""
    if tuple_type is WorldDescription:
        return _world_of_protocol_1 if set(FIELDS_OF_PROTOCOL_1) <= set(fields) else None
    if not set(missing) <= {*ONE_MENTOR_FIELDS, 'observation_count'} \
            or 'observation_count' in missing and 'turns' not in fields:
        return None
    return lambda msg: tuple_type(**{
        name: getattr(msg, 'turns' if name not in fields else name)
        for name in tuple_type._fields if name in fields or name == 'observation_count'})


def _world_of_protocol_2(msg: Any) -> WorldDescription:
    """Return a world; one of protocol 2 has the same fields as one of the present protocol."""
    description = tuple_maker(WorldDescription)(msg)
    return description._replace(protocol=PROTOCOL) if description.protocol == 2 else description


def _world_of_protocol_1(msg: Any) -> WorldDescription:
    """Return a world of version 0.1.0, a grid; its hash was another one, and is left out."""
    return WorldDescription(
        PROTOCOL, msg.run, getattr(msg, 'replaces', NO_RUN), int(msg.began * NANOSECONDS),
        msg.name, msg.width * msg.height, ACTION_NAMES, msg.starts, msg.step_limit,
        world_description.GRID,
        GridModel(tuple(msg.rows), msg.step_reward, msg.obstacle_reward, msg.goal_reward,
                  msg.intended, msg.slips_bump), TableModel(), (), array('d'), (), '')
